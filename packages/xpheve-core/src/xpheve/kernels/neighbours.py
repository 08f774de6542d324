"""Verlet lists: the pairs of bodies within reach of one another, found through cells in a hash table in O(n).

A list of all pairs closer than cutoff + skin serves until two bodies may have come closer by the skin (L. Verlet, Phys. Rev. 159, 98
(1967)); cells of the size of the reach leave 27 to look into (M. P. Allen, D. J. Tildesley, Computer Simulation of Liquids, 5.3), and a
hash table holds as many of them as there are bodies, wherever these lie (M. Teschner et al., VMV 2003).

Body k's position is s[address[k] + slot], and 32 and 64 places on. A list is first (count + 1) and partners: those of body i that have
a higher number, ascending, are partners[first[i]] to partners[first[i + 1] - 1]. A pair with NaN or infinity in it is none.
Buffers are flat arrays or memory views.
"""

import math


def buckets(count: int) -> int:
    """Size of the hash table for ``count`` bodies: a power of two, at least twice as many."""
    size = 1
    while size < 2 * count:
        size *= 2
    return size


def room(count: int) -> int:
    """Length of ``work`` that `build` needs for ``count`` bodies."""
    return 4 * count + 3 + buckets(count)


def moved(s: list[float], address: list[int], slot: int, count: int, reference: list[float]) -> float:
    """Square of the way [m^2] that the fastest body has made since the list was built; infinite if a position is not finite."""
    most = 0.0
    for k in range(count):
        at = address[k] + slot
        dx = s[at] - reference[3 * k]
        dy = s[at + 32] - reference[3 * k + 1]
        dz = s[at + 64] - reference[3 * k + 2]
        square = dx * dx + dy * dy + dz * dz
        if not square <= most:
            most = square if square == square else math.inf
    return most


def serves(square: float, cutoff: float, reach: float) -> bool:
    """Whether a list of all pairs within ``reach`` has all within ``cutoff`` after ways whose squares are at most ``square``.

    Two bodies may have come closer by twice that way; the last digits of ``reach`` are left to rounding.
    """
    return cutoff + 2.0 * math.sqrt(square) <= reach * (1.0 - 1e-14)


def build(
    s: list[float],
    address: list[int],
    slot: int,
    count: int,
    kind: list[int],
    kinds: int,
    reach: float,
    reference: list[float],
    work: list[int],
    first: list[int],
    partners: list[int],
    capacity: int,
) -> int:
    """Write the list of all pairs closer than ``reach`` [m]: dx*dx + dy*dy + dz*dz < reach*reach, summed from the left.

    Parameters
    ----------
    kind, kinds
        Which bodies make pairs: kind[i] holds in bits 0 to 2 a number, and in bit 3 + m whether i makes pairs with bodies of number m
        (as `xpheve.plan.pairs.PairSet` gives it). Not read if ``kinds`` is 0: then all do.
    reference
        Positions [m] as they are now, for `moved`, by body; written, 6 count. The second half is scratch.
    work
        Scratch, `room` (count).
    first, partners
        The list; written, count + 1 and 2 capacity + 1. The second half of ``partners`` is scratch.

    Returns
    -------
        The number of pairs; if that is more than ``capacity``, it is negative, and there is no list.
    """
    mask = buckets(count) - 1
    take(s, address, slot, count, reach, reference, work)
    sort(count, mask, reference, work)
    found = gather(count, kind, kinds, mask, reach, reference, work, partners, capacity)
    if found > capacity:
        return -found
    turn(count, work, first, partners, capacity)
    return found


def take(
    s: list[float], address: list[int], slot: int, count: int, reach: float, reference: list[float], work: list[int]
) -> None:
    """Keep the positions, and in work[k] the cell of each body: its numbers along x, y and z, 21 bits each; -1 if it has none."""
    for k in range(count):
        at = address[k] + slot
        reference[3 * k] = s[at]
        reference[3 * k + 1] = s[at + 32]
        reference[3 * k + 2] = s[at + 64]
    size = reach * 1.00001  # positions closer than reach differ by one cell at most, rounding included
    ox, oy, oz = middle(reference, 0, count), middle(reference, 1, count), middle(reference, 2, count)
    for k in range(count):
        x, y, z = reference[3 * k], reference[3 * k + 1], reference[3 * k + 2]
        work[k] = -1
        if (x - x) + (y - y) + (z - z) == 0.0:
            work[k] = (cell(x, ox, size) << 42) | (cell(y, oy, size) << 21) | cell(z, oz, size)


def middle(reference: list[float], axis: int, count: int) -> float:
    """The median of the first, the middle and the last coordinate: amid the bodies, though some be far away; 0 if it is not finite."""
    if count == 0:
        return 0.0
    a = reference[axis]
    b = reference[3 * (count // 2) + axis]
    c = reference[3 * (count - 1) + axis]
    found = max(min(a, b), min(max(a, b), c))
    return found if found - found == 0.0 else 0.0


def cell(x: float, origin: float, size: float) -> int:
    """Number of the cell of ``x``, modulo 2^21; all that is 2^28 cells away, or more, is in one."""
    u = (x - origin) / size
    if u < -268435456.0:
        u = -268435456.0
    if u > 268435456.0:
        u = 268435456.0
    return int(u + 268435456.0) & 2097151


def bucket(x: int, y: int, z: int, mask: int) -> int:
    """Place of a cell in the hash table."""
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & mask


def sort(count: int, mask: int, reference: list[float], work: list[int]) -> None:
    """Sort the bodies by bucket: those of bucket b are work[count + p], ascending, p from work[head + b] to work[head + b + 1] - 1.

    Beside them go their cells, to work[2 count + p], and their positions, to reference[3 (count + p)] and on.
    """
    head = 4 * count + 1
    for b in range(mask + 3):
        work[head + b] = 0
    for k in range(count):
        here = work[k]
        if here >= 0:
            b = head + bucket(here >> 42, (here >> 21) & 2097151, here & 2097151, mask)
            work[b + 2] += 1
    for b in range(mask + 1):
        work[head + b + 2] += work[head + b + 1]
    for k in range(count):
        here = work[k]
        if here >= 0:
            b = head + bucket(here >> 42, (here >> 21) & 2097151, here & 2097151, mask)
            p = work[b + 1]
            work[b + 1] = p + 1
            work[count + p] = k
            work[2 * count + p] = here
            reference[3 * (count + p)] = reference[3 * k]
            reference[3 * (count + p) + 1] = reference[3 * k + 1]
            reference[3 * (count + p) + 2] = reference[3 * k + 2]


def gather(
    count: int,
    kind: list[int],
    kinds: int,
    mask: int,
    reach: float,
    reference: list[float],
    work: list[int],
    partners: list[int],
    capacity: int,
) -> int:
    """Number of pairs; the lower partners of body j are written to partners[capacity + p], from p = work[3 count + j] on."""
    start, head = 3 * count, 4 * count + 1
    limit = reach * reach
    found = 0
    for j in range(count):
        work[start + j] = found
        here = work[j]
        if here < 0:
            continue
        x, y, z = reference[3 * j], reference[3 * j + 1], reference[3 * j + 2]
        for side in range(9):
            cx = ((here >> 42) + side % 3 - 1) & 2097151
            cy = ((here >> 21) + side // 3 - 1) & 2097151
            for cz in range((here & 2097151) - 1, (here & 2097151) + 2):
                there = (cx << 42) | (cy << 21) | (cz & 2097151)
                b = head + bucket(cx, cy, cz & 2097151, mask)
                for p in range(work[b], work[b + 1]):
                    i = work[count + p]
                    if i >= j:
                        break
                    at = 3 * (count + p)
                    dx, dy, dz = reference[at] - x, reference[at + 1] - y, reference[at + 2] - z
                    partners[capacity + min(found, capacity)] = i  # stays if it is near: no branch is to be guessed
                    # Another cell may have the same bucket: its bodies are met when that cell is looked into.
                    near = (dx * dx + dy * dy + dz * dz < limit) & (work[2 * count + p] == there)
                    found += near if kinds == 0 else near & (kind[j] >> (3 + (kind[i] & 7)))
    work[start + count] = found
    return found


def turn(count: int, work: list[int], first: list[int], partners: list[int], capacity: int) -> None:
    """From the lower partners of each body, in any order, to the higher ones of each, ascending."""
    start = 3 * count
    for i in range(count + 1):
        first[i] = 0
    for p in range(work[start + count]):
        first[partners[capacity + p] + 1] += 1
    for i in range(count):
        first[i + 1] += first[i]
    for j in range(count):
        for p in range(work[start + j], work[start + j + 1]):
            i = partners[capacity + p]
            partners[first[i]] = j
            first[i] += 1
    for i in range(count, 0, -1):
        first[i] = first[i - 1]
    first[0] = 0
