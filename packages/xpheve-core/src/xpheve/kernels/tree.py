"""The inverse-square field of many charges by a tree, to an error that is asked for and checked.

Of each body, charge q and place x, wanted is e_i = sum over j of q_j (x_i - x_j) / (|x_i - x_j|^2 + s^2)^(3/2): the field in units of the
constant of nature, away from positive charges. A gravity's field is its opposite with masses for charges.

Bodies are sorted into a binary tree of tight boxes, each split across its longest side near the middle, but so that all leaves but the last
are full. What lies far from a group of 32 bodies acts on it by its monopole, dipole and quadrupole (J. Barnes, P. Hut, Nature 324, 446
(1986); one walk for a whole group: J. Barnes, J. Comput. Phys. 87, 161 (1990)), if the part of the field that those leave out is small against
the whole field there (J. K. Salmon, M. S. Warren, J. Comput. Phys. 111, 136 (1994); V. Springel, MNRAS 364, 1105 (2005), eq. 18).
What is left out is estimated by absolute charges, so that charges of both signs are no worse than masses. At the end the error is measured
on a sample of bodies, whose fields are summed directly; as long as its 99th percentile is more than was asked for, all is done again more finely.

The order of all sums is fixed by the places alone. Buffers are flat arrays or memory views: ``s`` floats, ``w`` whole numbers, ``t`` scratch.
"""

import math

from xpheve.kernels.ieee import divide, sqrt

LANES = 32
"""Bodies of a group: they walk the tree together, one in each lane of a vector loop."""
LEAF = 8
"""Bodies of a leaf; `LANES` is a multiple of it."""
NODE = 17
"""Numbers of a node: centre of |q| (3), radius about it, what stands for the octupole, q, dipole (3), quadrupole xx xy xz yy yz zz, |q|, and
the sum of |q| times the square of the distance from the centre."""
CENTRE, RADIUS, OCTUPOLE, CHARGE, DIPOLE, QUADRUPOLE, WEIGHT, SPREAD = 0, 3, 4, 5, 6, 9, 15, 16
NEAREST = 1.21
"""Square of the least distance from which a node may act as a whole, in units of its radius."""
SHARE = 110.0
"""See `share_of`."""
MIXED = 0.1
"""What is left of the share where charges have both signs: fields are weaker then than what the nodes leave out is measured by."""
FINER = 6
"""How often the tree is walked before all pairs are summed."""
SAMPLE = 128
"""Bodies on which the error is measured."""
SAMPLED = 7 * LANES
"""Where in ``t`` the fields of the sample begin."""
SCRATCH = SAMPLED + 4 * SAMPLE
"""Length of ``t``: places, fields and numbers of 32 bodies; then fields of the sample, and their errors."""


def stride(count: int) -> int:
    """Room for one number of each body."""
    return (count + LANES - 1) // LANES * LANES


def nodes(count: int) -> int:
    """Nodes of the tree of ``count`` bodies."""
    return 2 * max(1, (count + LEAF - 1) // LEAF) - 1


def floats(count: int) -> int:
    """Length of ``s``: places and charges in order of the tree, fields, numbers and boxes of nodes."""
    return 7 * stride(count) + (NODE + 6) * nodes(count)


def ints(count: int) -> int:
    """Length of ``w``: the order, and of each node its first and last body, the node after it, and a stack."""
    return stride(count) + 5 * nodes(count) + 4


# The tree ------------------------------------------------------------------------------------------------------------


def build(count: int, s: list[float], w: list[int]) -> int:
    """Sort the bodies, whose places and charges lie in ``s``, into a tree; the number of nodes is returned.

    Nodes are numbered so that what a node contains comes right after it.
    """
    size = stride(count)
    most = nodes(count)
    first, last, after = size, size + most, size + 2 * most
    stack = size + 3 * most
    box = 7 * size + NODE * most
    for k in range(count):
        w[k] = k
    w[stack] = 0
    w[stack + 1] = count
    top = stack + 2
    made = 0
    while top > stack:
        top -= 2
        low, high = w[top], w[top + 1]
        axis = enclose(low, high, s, size, box + 6 * made)
        w[first + made] = low
        w[last + made] = high
        made += 1
        if high - low > LEAF:
            at = box + 6 * (made - 1) + axis
            middle = split(low, high, 0.5 * s[at] + 0.5 * s[at + 3], axis, s, w, size)
            w[top] = middle
            w[top + 1] = high
            w[top + 2] = low
            w[top + 3] = middle
            top += 4
    for k in range(made - 1, -1, -1):
        w[after + k] = k + 1 if w[last + k] - w[first + k] <= LEAF else w[after + w[after + k + 1]]
    return made


def enclose(low: int, high: int, s: list[float], size: int, box: int) -> int:
    """Write the box of bodies ``low`` to ``high``: least and greatest x, y, z; its longest side is returned."""
    longest = -1.0
    axis = 0
    for c in range(3):
        least = s[c * size + low]
        greatest = least
        for k in range(c * size + low, c * size + high):
            value = s[k]
            least = value if value < least else least
            greatest = value if value > greatest else greatest
        s[box + c] = least
        s[box + c + 3] = greatest
        if greatest - least > longest:
            longest = greatest - least
            axis = c
    return axis


def split(low: int, high: int, plane: float, axis: int, s: list[float], w: list[int], size: int) -> int:
    """Put the bodies below ``plane`` first, up to whole groups, or leaves; the place of the first of the second part is returned."""
    unit = LANES if high - low > LANES else LEAF
    cut = partition(low, high - 1, plane, axis, s, w, size)
    whole = (cut - low + unit // 2) // unit
    most = (high - low - 1) // unit
    middle = low + unit * max(1, min(whole, most))
    if middle < cut:
        select(low, cut - 1, middle, axis, s, w, size)
    elif middle > cut:
        select(cut, high - 1, middle, axis, s, w, size)
    return middle


def partition(low: int, high: int, value: float, axis: int, s: list[float], w: list[int], size: int) -> int:
    """Put the bodies of ``low`` to ``high``, both included, whose coordinate is below ``value`` first; how far they reach is returned."""
    at = axis * size
    i, j = low, high
    while True:
        while i <= j and s[at + i] < value:
            i += 1
        while i <= j and not s[at + j] < value:
            j -= 1
        if i >= j:
            return i
        swap(i, j, s, w, size)
        i += 1
        j -= 1


def select(low: int, high: int, wanted: int, axis: int, s: list[float], w: list[int], size: int) -> int:
    """Order the bodies ``low`` to ``high``, both included, so far that none before ``wanted`` has a greater coordinate than one after it.

    Source: C. A. R. Hoare, Comm. ACM 4, 321 (1961), as N. Wirth gives it.
    """
    at = axis * size
    while low < high:
        pivot = s[at + wanted]
        i, j = low, high
        while i <= j:
            while s[at + i] < pivot:
                i += 1
            while pivot < s[at + j]:
                j -= 1
            if i <= j:
                swap(i, j, s, w, size)
                i += 1
                j -= 1
        if j < wanted:
            low = i
        if wanted < i:
            high = j
    return 0


def swap(i: int, j: int, s: list[float], w: list[int], size: int) -> int:
    """Exchange bodies ``i`` and ``j``."""
    for c in range(4):
        kept = s[c * size + i]
        s[c * size + i] = s[c * size + j]
        s[c * size + j] = kept
    number = w[i]
    w[i] = w[j]
    w[j] = number
    return 0


# Moments -------------------------------------------------------------------------------------------------------------


def moments(count: int, s: list[float], w: list[int]) -> int:
    """Write the numbers of all nodes: of leaves from their bodies, of others from the two that they contain."""
    size = stride(count)
    most = nodes(count)
    for k in range(most - 1, -1, -1):
        low, high = w[size + k], w[size + most + k]
        node = 7 * size + NODE * k
        if high - low <= LEAF:
            of_bodies(low, high, s, size, node)
        else:
            other = w[size + 2 * most + k + 1]
            of_nodes(s, node, node + NODE, 7 * size + NODE * other)
        finish(s, node, 7 * size + NODE * most + 6 * k)
    return 0


def of_bodies(low: int, high: int, s: list[float], size: int, node: int) -> int:
    """Moments of bodies ``low`` to ``high`` about the centre of their absolute charges."""
    a, cx, cy, cz = 0.0, 0.0, 0.0, 0.0
    x0, y0, z0 = s[low], s[size + low], s[2 * size + low]
    for k in range(low, high):
        q = abs(s[3 * size + k])
        a += q
        cx += q * (s[k] - x0)
        cy += q * (s[size + k] - y0)
        cz += q * (s[2 * size + k] - z0)
    if a > 0.0:
        cx, cy, cz = cx / a, cy / a, cz / a
    cx, cy, cz = x0 + cx, y0 + cy, z0 + cz
    q, px, py, pz = 0.0, 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz, zz, spread = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(low, high):
        one = s[3 * size + k]
        x, y, z = s[k] - cx, s[size + k] - cy, s[2 * size + k] - cz
        q += one
        px += one * x
        py += one * y
        pz += one * z
        xx += one * x * x
        xy += one * x * y
        xz += one * x * z
        yy += one * y * y
        yz += one * y * z
        zz += one * z * z
        spread += abs(one) * (x * x + y * y + z * z)
    store(s, node, (cx, cy, cz), (q, px, py, pz), (xx, xy, xz, yy, yz, zz), a, spread)
    return 0


def of_nodes(s: list[float], node: int, left: int, right: int) -> int:
    """Moments of two nodes together: each one's are moved to the common centre."""
    a = s[left + WEIGHT] + s[right + WEIGHT]
    share = s[right + WEIGHT] / a if a > 0.0 else 0.5
    cx = s[left] + share * (s[right] - s[left])
    cy = s[left + 1] + share * (s[right + 1] - s[left + 1])
    cz = s[left + 2] + share * (s[right + 2] - s[left + 2])
    q, px, py, pz = 0.0, 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz, zz, spread = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for part in (left, right):
        one = s[part + CHARGE]
        x, y, z = s[part] - cx, s[part + 1] - cy, s[part + 2] - cz
        dx, dy, dz = s[part + DIPOLE], s[part + DIPOLE + 1], s[part + DIPOLE + 2]
        q += one
        px += dx + one * x
        py += dy + one * y
        pz += dz + one * z
        xx += s[part + QUADRUPOLE] + (2.0 * dx + one * x) * x
        xy += s[part + QUADRUPOLE + 1] + dx * y + (dy + one * y) * x
        xz += s[part + QUADRUPOLE + 2] + dx * z + (dz + one * z) * x
        yy += s[part + QUADRUPOLE + 3] + (2.0 * dy + one * y) * y
        yz += s[part + QUADRUPOLE + 4] + dy * z + (dz + one * z) * y
        zz += s[part + QUADRUPOLE + 5] + (2.0 * dz + one * z) * z
        spread += s[part + SPREAD] + s[part + WEIGHT] * (x * x + y * y + z * z)
    store(s, node, (cx, cy, cz), (q, px, py, pz), (xx, xy, xz, yy, yz, zz), a, spread)
    return 0


def store(
    s: list[float],
    node: int,
    centre: tuple[float, float, float],
    poles: tuple[float, float, float, float],
    quadrupole: tuple[float, float, float, float, float, float],
    weight: float,
    spread: float,
) -> int:
    """Write the numbers of a node but for radius and octupole."""
    s[node] = centre[0]
    s[node + 1] = centre[1]
    s[node + 2] = centre[2]
    s[node + CHARGE] = poles[0]
    s[node + DIPOLE] = poles[1]
    s[node + DIPOLE + 1] = poles[2]
    s[node + DIPOLE + 2] = poles[3]
    s[node + QUADRUPOLE] = quadrupole[0]
    s[node + QUADRUPOLE + 1] = quadrupole[1]
    s[node + QUADRUPOLE + 2] = quadrupole[2]
    s[node + QUADRUPOLE + 3] = quadrupole[3]
    s[node + QUADRUPOLE + 4] = quadrupole[4]
    s[node + QUADRUPOLE + 5] = quadrupole[5]
    s[node + WEIGHT] = weight
    s[node + SPREAD] = spread
    return 0


def finish(s: list[float], node: int, box: int) -> int:
    """Write the radius of a node, to the farthest corner of its box, and the bound of its octupole: radius times `SPREAD`."""
    x = max(s[node] - s[box], s[box + 3] - s[node])
    y = max(s[node + 1] - s[box + 1], s[box + 4] - s[node + 1])
    z = max(s[node + 2] - s[box + 2], s[box + 5] - s[node + 2])
    radius = math.sqrt(x * x + y * y + z * z)
    s[node + RADIUS] = radius
    s[node + OCTUPOLE] = radius * s[node + SPREAD]
    return 0


# Fields --------------------------------------------------------------------------------------------------------------


def of_whole(s: list[float], t: list[float], node: int, soft: float) -> int:
    """Add the field of a node to that of the 32 bodies in ``t``, by monopole, dipole and quadrupole; ``soft`` is s^2 [m^2].

    With u = (d^2 + s^2)^(-1/2), d from the centre: the derivatives of u, of which the third is -15 u^7 ddd + 3 u^5 (d and unit tensor).
    """
    cx, cy, cz = s[node], s[node + 1], s[node + 2]
    q, px, py, pz = s[node + 5], s[node + 6], s[node + 7], s[node + 8]
    xx, xy, xz = s[node + 9], s[node + 10], s[node + 11]
    yy, yz, zz = s[node + 12], s[node + 13], s[node + 14]
    half = 0.5 * (xx + yy + zz)
    for lane in range(LANES):
        x = t[lane] - cx
        y = t[lane + 32] - cy
        z = t[lane + 64] - cz
        square = x * x + y * y + z * z + soft
        v = divide(1.0, square)
        u3 = v * sqrt(v)
        u5 = 3.0 * v * u3
        sx = xx * x + xy * y + xz * z
        sy = xy * x + yy * y + yz * z
        sz = xz * x + yz * y + zz * z
        along = px * x + py * y + pz * z - half + 2.5 * v * (sx * x + sy * y + sz * z)
        k = u3 * q + u5 * along
        t[lane + 96] = t[lane + 96] + (k * x - u3 * px - u5 * sx)
        t[lane + 128] = t[lane + 128] + (k * y - u3 * py - u5 * sy)
        t[lane + 160] = t[lane + 160] + (k * z - u3 * pz - u5 * sz)
    return 0


def of_each(s: list[float], t: list[float], size: int, low: int, high: int, soft: float) -> int:
    """Add the fields of bodies ``low`` to ``high``, none of them in ``t``."""
    for j in range(low, high):
        bx, by, bz, q = s[j], s[size + j], s[2 * size + j], s[3 * size + j]
        for lane in range(LANES):
            x = t[lane] - bx
            y = t[lane + 32] - by
            z = t[lane + 64] - bz
            square = x * x + y * y + z * z + soft
            k = divide(q, square * sqrt(square))
            t[lane + 96] = t[lane + 96] + k * x
            t[lane + 128] = t[lane + 128] + k * y
            t[lane + 160] = t[lane + 160] + k * z
    return 0


def of_others(s: list[float], t: list[float], size: int, low: int, high: int, first: int, soft: float) -> int:
    """As `of_each`, where lane l holds body ``first`` + lane, which does not act on itself."""
    for j in range(low, high):
        bx, by, bz, q = s[j], s[size + j], s[2 * size + j], s[3 * size + j]
        own = j - first
        for lane in range(LANES):
            x = t[lane] - bx
            y = t[lane + 32] - by
            z = t[lane + 64] - bz
            square = x * x + y * y + z * z + soft
            k = divide(q, square * sqrt(square))
            t[lane + 96] = t[lane + 96] + (k * x if lane != own else 0.0)
            t[lane + 128] = t[lane + 128] + (k * y if lane != own else 0.0)
            t[lane + 160] = t[lane + 160] + (k * z if lane != own else 0.0)
    return 0


def of_sample(s: list[float], t: list[float], size: int, count: int, soft: float) -> int:
    """As `of_each` for all bodies, where t[192 + l] is the number of the body in lane l, which does not act on itself."""
    for j in range(count):
        bx, by, bz, q = s[j], s[size + j], s[2 * size + j], s[3 * size + j]
        own = float(j)
        for lane in range(LANES):
            x = t[lane] - bx
            y = t[lane + 32] - by
            z = t[lane + 64] - bz
            square = x * x + y * y + z * z + soft
            k = divide(q, square * sqrt(square))
            t[lane + 96] = t[lane + 96] + (k * x if t[lane + 192] != own else 0.0)
            t[lane + 128] = t[lane + 128] + (k * y if t[lane + 192] != own else 0.0)
            t[lane + 160] = t[lane + 160] + (k * z if t[lane + 192] != own else 0.0)
    return 0


# Walks ---------------------------------------------------------------------------------------------------------------


def take(s: list[float], t: list[float], size: int, low: int, high: int) -> int:
    """Put bodies ``low`` to ``high`` into the lanes, without a field; lanes left over repeat the last."""
    for lane in range(LANES):
        k = min(low + lane, high - 1)
        t[lane] = s[k]
        t[lane + 32] = s[size + k]
        t[lane + 64] = s[2 * size + k]
        t[lane + 96] = 0.0
        t[lane + 128] = 0.0
        t[lane + 160] = 0.0
    return 0


def around(t: list[float], c: int) -> tuple[float, float]:
    """Middle and half of the length of what the lanes cover along axis ``c``."""
    least = t[32 * c]
    greatest = least
    for lane in range(1, LANES):
        value = t[32 * c + lane]
        least = value if value < least else least
        greatest = value if value > greatest else greatest
    half = 0.5 * greatest - 0.5 * least
    return least + half, half


def walk(
    count: int, s: list[float], w: list[int], t: list[float], low: int, high: int, soft: float, limit: float
) -> int:
    """Find in ``t`` the fields of the bodies ``low`` to ``high``; what one node leaves out is less than ``limit`` [q/m^2] by estimate."""
    size = stride(count)
    most = nodes(count)
    take(s, t, size, low, high)
    gx, hx = around(t, 0)
    gy, hy = around(t, 1)
    gz, hz = around(t, 2)
    hx, hy, hz = hx * 1.0000001, hy * 1.0000001, hz * 1.0000001
    k = 0
    while k < most:
        node = 7 * size + NODE * k
        first, last, after = w[size + k], w[size + most + k], w[size + 2 * most + k]
        x = max(abs(s[node] - gx) - hx, 0.0)
        y = max(abs(s[node + 1] - gy) - hy, 0.0)
        z = max(abs(s[node + 2] - gz) - hz, 0.0)
        radius = s[node + RADIUS]
        square = x * x + y * y + z * z
        own = first < high and last > low
        if s[node + WEIGHT] == 0.0:
            k = after
        elif (not own and acts_whole(square, radius, s[node + OCTUPOLE], limit)) or (
            radius == 0.0 and (soft > 0.0 or last - first > 1)
        ):
            of_whole(s, t, node, soft)
            k = after
        elif last - first <= LEAF:
            if own:
                of_others(s, t, size, first, last, low, soft)
            else:
                of_each(s, t, size, first, last, soft)
            k = after
        else:
            k += 1
    return 0


def acts_whole(square: float, radius: float, octupole: float, limit: float) -> bool:
    """Whether a node at the distance whose square is given, or farther, may act by its moments.

    What they leave out is at most (4 B_3 - 3 B_4 / d) / (d^3 (d - r)^2), B_n = sum of |q| |x|^n (Salmon, Warren 1994); here stands
    r B_2 for 4 B_3, as the bound is rarely reached, and `SHARE` is measured.
    """
    if not square > NEAREST * radius * radius:
        return False
    distance = math.sqrt(square)
    gap = distance - radius
    return octupole <= limit * (gap * gap) * (square * distance)


def strength(count: int, s: list[float], w: list[int], body: int, soft: float) -> float:
    """How strong the field is at ``body``, roughly: of nodes by monopole and dipole, as soon as the body is farther than their radius."""
    size = stride(count)
    most = nodes(count)
    bx, by, bz = s[body], s[size + body], s[2 * size + body]
    ex, ey, ez = 0.0, 0.0, 0.0
    k = 0
    while k < most:
        node = 7 * size + NODE * k
        x, y, z = bx - s[node], by - s[node + 1], bz - s[node + 2]
        square = x * x + y * y + z * z
        radius = s[node + RADIUS]
        if square > radius * radius:
            v = divide(1.0, square + soft)
            u = v * sqrt(v)
            px, py, pz = s[node + DIPOLE], s[node + DIPOLE + 1], s[node + DIPOLE + 2]
            q = u * (s[node + CHARGE] + 3.0 * v * (px * x + py * y + pz * z))
            ex += q * x - u * px
            ey += q * y - u * py
            ez += q * z - u * pz
            k = w[size + 2 * most + k]
        elif w[size + most + k] - w[size + k] <= LEAF:
            for j in range(w[size + k], w[size + most + k]):
                x, y, z = bx - s[j], by - s[size + j], bz - s[2 * size + j]
                square = x * x + y * y + z * z + soft
                if j != body and square > 0.0:
                    u = divide(s[3 * size + j], square * sqrt(square))
                    ex += u * x
                    ey += u * y
                    ez += u * z
            k = w[size + 2 * most + k]
        else:
            k += 1
    return math.sqrt(ex * ex + ey * ey + ez * ez)


def fields(
    count: int, s: list[float], w: list[int], t: list[float], soft: float, share: float, begin: int, end: int
) -> int:
    """Find the fields of groups ``begin`` to ``end``; what one node leaves out is less than ``share`` of the whole, by estimate.

    Groups do not know one another: whoever finds them, in whatever order, finds the same bits.
    """
    size = stride(count)
    mixed = abs(s[7 * size + CHARGE]) < s[7 * size + WEIGHT]  # then fields may differ from body to body
    for low in range(LANES * begin, min(LANES * end, count), LANES):
        high = min(low + LANES, count)
        whole = strength(count, s, w, low + (high - low) // 2, soft)
        for part in range(4 if mixed else 0):
            whole = min(whole, strength(count, s, w, low + (high - low) * part // 4, soft))
        walk(count, s, w, t, low, high, soft, share * whole if whole == whole else math.inf)
        for lane in range(high - low):
            s[4 * size + low + lane] = t[lane + 96]
            s[5 * size + low + lane] = t[lane + 128]
            s[6 * size + low + lane] = t[lane + 160]
    return 0


# The error -----------------------------------------------------------------------------------------------------------


def share_of(error: float) -> float:
    """Of the whole field, what one node may leave out, that the 99th percentile of the relative error may stay somewhat below ``error``.

    Measured: the percentile goes about as the power 0.57 of the share, for Plummer spheres, uniform cubes and charges of both signs.
    """
    return SHARE * math.pow(error, 1.75)


def sampled(m: int, count: int) -> int:
    """Body ``m`` of the sample, by its place in the tree."""
    return m * count // min(SAMPLE, count)


def sample(count: int, s: list[float], t: list[float], soft: float) -> int:
    """Sum the fields of the sample directly, into ``t`` from `SAMPLED` on."""
    size = stride(count)
    many = min(SAMPLE, count)
    for begin in range(0, many, LANES):
        for lane in range(LANES):
            k = sampled(min(begin + lane, many - 1), count)
            t[lane] = s[k]
            t[lane + 32] = s[size + k]
            t[lane + 64] = s[2 * size + k]
            t[lane + 96] = 0.0
            t[lane + 128] = 0.0
            t[lane + 160] = 0.0
            t[lane + 192] = float(k)
        of_sample(s, t, size, count, soft)
        for lane in range(LANES):
            t[SAMPLED + begin + lane] = t[lane + 96]
            t[SAMPLED + SAMPLE + begin + lane] = t[lane + 128]
            t[SAMPLED + 2 * SAMPLE + begin + lane] = t[lane + 160]
    return 0


def measured(count: int, s: list[float], t: list[float]) -> float:
    """The 99th percentile of the relative error of the fields, of the sample; bodies without a finite field are left out."""
    size = stride(count)
    many = min(SAMPLE, count)
    errors = SAMPLED + 3 * SAMPLE
    for m in range(many):
        k = sampled(m, count)
        ex, ey, ez = t[SAMPLED + m], t[SAMPLED + SAMPLE + m], t[SAMPLED + 2 * SAMPLE + m]
        x, y, z = s[4 * size + k] - ex, s[5 * size + k] - ey, s[6 * size + k] - ez
        off = math.sqrt(x * x + y * y + z * z)
        whole = math.sqrt(ex * ex + ey * ey + ez * ez)
        error = 0.0
        if off > 0.0:
            error = off / whole if whole > 0.0 else math.inf
        at = errors + m
        while at > errors and t[at - 1] > error:
            t[at] = t[at - 1]
            at -= 1
        t[at] = error
    return t[errors + (99 * many + 99) // 100 - 1]


def solve(count: int, s: list[float], w: list[int], t: list[float], soft: float, error: float) -> int:
    """Find the fields of all bodies so that the 99th percentile of the relative error is at most ``error``, as far as the sample tells.

    Parameters
    ----------
    s, w, t
        Buffers of `floats` (count), `ints` (count) and `SCRATCH`. Component c of body k lies at s[c stride + k], its charge at
        s[3 stride + k]: bodies are sorted. After the call component c of the field [q/m^2] of body w[k] is s[(4 + c) stride + k].
    soft
        s^2 [m^2]

    Returns
    -------
        How often the tree was walked; the error measured at last is t[0]. Where no walk is good enough, the last one sums all pairs.
    """
    if count == 0:
        t[0] = 0.0
        return 0
    size = stride(count)
    build(count, s, w)
    moments(count, s, w)
    sample(count, s, t, soft)
    groups = (count + LANES - 1) // LANES
    share = share_of(error)
    if abs(s[7 * size + CHARGE]) < s[7 * size + WEIGHT]:
        share *= MIXED
    walks = 0
    found = math.inf
    while found > error and walks <= FINER:
        fields(count, s, w, t, soft, share if walks < FINER else 0.0, 0, groups)
        found = measured(count, s, t)
        walks += 1
        if found > error:
            share *= min(0.5, share_of(error) / share_of(found)) if found < 1.0 else 0.01
    t[0] = found
    return walks
