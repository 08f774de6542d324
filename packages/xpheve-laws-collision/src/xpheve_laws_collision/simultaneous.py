"""Impacts at one instant, solved together.

Impulses p >= 0 along the normals such that each pair leaves with at least its wanted speed, and with
exactly that where an impulse acts: a linear complementarity problem in A = J M^-1 J^T, the matrix of the
pairs (Moreau 1988; Glocker 2001, "Set-Valued Force Laws"). For one pair it is Newton's law of impact.

Floats are rational numbers, so for up to `EXACT_PAIRS` connected pairs the problem is solved without
error, in integers, and velocities are rounded once, at the end. There is one solution (of least norm) and
one rounding: the order of pairs and bodies, the side a pair is seen from and a mirror do not change a bit.
Larger sets are solved in floats with exact residuals: the same then holds to about 1e-13 of the speeds,
and of the impulses unless contacts are redundant, whose shares may then differ by about 1e-3.
"""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

Vector = tuple[float, float, float]
Pair = tuple[int, int]
Number = float | Fraction
Array = npt.NDArray[np.float64]

EXACT_PAIRS = 16  # a connected set of this many takes some milliseconds; time grows with the fifth power
RIDGE_BITS = (128, 1024)  # a singular matrix is lifted by 2^-128 of itself, then by less, to find what pushes
FLOAT_RIDGE = 2.0**-40  # the same in floats: far above their rounding, and the refinement takes it out again
REFINEMENTS = 8  # each gains about 12 digits where no pairs are redundant; 100 bits are kept
TRIALS = 3  # rounds of switching all pairs that are wrong, without progress, before switching one at a time


def solve_generation(
    pairs: Sequence[Pair],
    inverse_masses: Sequence[float],
    normals: Sequence[Vector],
    velocities: Sequence[Vector],
    targets: Sequence[Number],
) -> list[Fraction]:
    """The impulses [N s] of touching, approaching pairs, one for each.

    Parameters
    ----------
    pairs
        (i, j), indices of bodies.
    inverse_masses
        [1/kg] of each body; 0 is immovable.
    normals
        Of each pair, from i to j, of length 1 but for rounding; world frame.
    velocities
        [m/s] of each body; world frame.
    targets
        The separation speed n . (v_j - v_i) [m/s], at least 0, that each pair should have afterwards. The
        exact ones of `wanted_speeds` make equal masses exchange their velocities exactly.

    Returns
    -------
    list of Fraction
        Exact up to `EXACT_PAIRS` connected pairs; ``float(p)`` is the impulse rounded once. Hand them to
        `apply` as they are. Two immovable bodies get 0. Where several sets of impulses do the same (more
        contacts than the motion can tell apart) it is the one of least norm.

    Raises
    ------
    ValueError
        If no impulses can do it: a body between immovable ones that close in on it.
    """
    impulses = [Fraction(0)] * len(pairs)
    for members in components(pairs, inverse_masses):
        solved = solve_component(
            [pairs[k] for k in members],
            inverse_masses,
            [normals[k] for k in members],
            velocities,
            [targets[k] for k in members],
        )
        for k, impulse in zip(members, solved, strict=True):
            impulses[k] = impulse
    return impulses


def apply(
    pairs: Sequence[Pair],
    normals: Sequence[Vector],
    impulses: Sequence[Number],
    inverse_masses: Sequence[float],
    velocities: Sequence[Vector],
) -> list[Vector]:
    """The velocities [m/s] of all bodies after the impulses: each component summed exactly, rounded once.

    Components across the normals and immovable bodies keep their bits.
    """
    after = list(velocities)
    pushes: dict[int, list[tuple[int, int]]] = {}
    for k, (i, j) in enumerate(pairs):
        if impulses[k] != 0:
            pushes.setdefault(i, []).append((-1, k))
            pushes.setdefault(j, []).append((1, k))
    for body, parts in pushes.items():
        if inverse_masses[body] != 0.0:
            x, y, z = velocities[body]
            after[body] = (
                pushed(x, inverse_masses[body], [(sign, impulses[k], normals[k][0]) for sign, k in parts]),
                pushed(y, inverse_masses[body], [(sign, impulses[k], normals[k][1]) for sign, k in parts]),
                pushed(z, inverse_masses[body], [(sign, impulses[k], normals[k][2]) for sign, k in parts]),
            )
    return after


def separation_speeds(pairs: Sequence[Pair], normals: Sequence[Vector], velocities: Sequence[Vector]) -> list[Fraction]:
    """n . (v_j - v_i) [m/s] of each pair without error; negative when approaching."""
    n, n_scale = integers(normals)
    v, v_scale = integers(velocities)
    return [Fraction(separation(n[k], v[i], v[j]), n_scale * v_scale) for k, (i, j) in enumerate(pairs)]


def wanted_speeds(
    pairs: Sequence[Pair], normals: Sequence[Vector], velocities: Sequence[Vector], restitutions: Sequence[float]
) -> list[Fraction]:
    """Restitution times approach speed [m/s] of each pair, without error (Newton); 0 where not approaching."""
    speeds = separation_speeds(pairs, normals, velocities)
    return [max(Fraction(0), -Fraction(e) * speed) for e, speed in zip(restitutions, speeds, strict=True)]


def components(pairs: Sequence[Pair], inverse_masses: Sequence[float]) -> list[list[int]]:
    """The pairs that share movable bodies, directly or through others: lists of indices of pairs."""
    parent = list(range(len(pairs)))

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    first_of: dict[int, int] = {}
    for k, pair in enumerate(pairs):
        for body in pair:
            if inverse_masses[body] != 0.0:
                parent[root(k)] = root(first_of.setdefault(body, k))
    found: dict[int, list[int]] = {}
    for k in range(len(pairs)):
        found.setdefault(root(k), []).append(k)
    return list(found.values())


def solve_component(
    pairs: Sequence[Pair],
    inverse_masses: Sequence[float],
    normals: Sequence[Vector],
    velocities: Sequence[Vector],
    targets: Sequence[Number],
) -> list[Fraction]:
    """`solve_generation` of connected pairs."""
    bodies = sorted({body for pair in pairs for body in pair})
    row = {body: k for k, body in enumerate(bodies)}
    sides = [(row[i], row[j]) for i, j in pairs]
    n, n_scale = integers(normals)
    v, v_scale = integers([velocities[body] for body in bodies])
    (inverse,), w_scale = integers([[inverse_masses[body] for body in bodies]])

    ratios = [target.as_integer_ratio() for target in targets]
    scale = math.lcm(n_scale * v_scale, *(denominator for _, denominator in ratios))
    lift = scale // (n_scale * v_scale)
    missing = [
        numerator * (scale // denominator) - lift * separation(n[k], v[i], v[j])
        for k, ((i, j), (numerator, denominator)) in enumerate(zip(sides, ratios, strict=True))
    ]
    matrix = pair_matrix(sides, n, inverse)
    unit = n_scale * n_scale * w_scale  # of the matrix; impulses come out in unit / scale

    if all(inverse[i] == 0 and inverse[j] == 0 for i, j in sides):
        return [Fraction(0)] * len(pairs)
    if len(pairs) == 1:
        return [Fraction(max(missing[0], 0) * unit, matrix[0][0] * scale)]
    if len(pairs) > EXACT_PAIRS:
        return refined_solution(matrix, missing, unit, scale)
    numerators, denominator = exact_solution(matrix, missing)
    return [Fraction(x * unit, denominator * scale) for x in numerators]


def integers(rows: Sequence[Sequence[float]]) -> tuple[list[list[int]], int]:
    """(integers, scale), with ``rows`` = integers / scale without error; the scale is a power of two."""
    ratios = [[x.as_integer_ratio() for x in row] for row in rows]
    scale = max(denominator for row in ratios for _, denominator in row)
    return [[numerator * (scale // denominator) for numerator, denominator in row] for row in ratios], scale


def separation(n: Sequence[int], v_i: Sequence[int], v_j: Sequence[int]) -> int:
    """n . (v_j - v_i)."""
    return n[0] * (v_j[0] - v_i[0]) + n[1] * (v_j[1] - v_i[1]) + n[2] * (v_j[2] - v_i[2])


def pushed(speed: float, inverse_mass: float, parts: Sequence[tuple[int, Number, float]]) -> float:
    """speed + inverse_mass * sum of sign * impulse * normal [m/s], rounded once; its own bits if the sum is 0."""
    top = 0
    bottom = 1
    for sign, impulse, normal in parts:
        if normal != 0.0:
            a, b = impulse.as_integer_ratio()
            c, d = normal.as_integer_ratio()
            numerator, denominator = sign * a * c, b * d
            common = math.lcm(bottom, denominator)
            top = top * (common // bottom) + numerator * (common // denominator)
            bottom = common
    if top == 0:
        return speed
    a, b = inverse_mass.as_integer_ratio()
    c, d = speed.as_integer_ratio()
    # Python rounds the quotient of two integers correctly.
    return (c * b * bottom + top * a * d) / (d * b * bottom)


def pair_matrix(sides: Sequence[Pair], n: Sequence[Sequence[int]], inverse: Sequence[int]) -> list[list[int]]:
    """J M^-1 J^T: how fast (row) a pair separates for an impulse at another (column)."""
    matrix = [[0] * len(sides) for _ in sides]
    for k, (i, j) in enumerate(sides):
        for m, (other_i, other_j) in enumerate(sides[: k + 1]):
            shared = 0
            if i == other_i:
                shared += inverse[i]
            if j == other_j:
                shared += inverse[j]
            if i == other_j:
                shared -= inverse[i]
            if j == other_i:
                shared -= inverse[j]
            if shared != 0:
                entry = shared * (n[k][0] * n[m][0] + n[k][1] * n[m][1] + n[k][2] * n[m][2])
                matrix[k][m] = entry
                matrix[m][k] = entry
    return matrix


def exact_solution(matrix: list[list[int]], missing: list[int]) -> tuple[list[int], int]:
    """(numerators, denominator > 0) of the impulses p >= 0 of least norm with A p >= b, complementary.

    Raises
    ------
    ValueError
        If there are none.
    """
    found = pivoted(matrix, missing)
    if found is not None and is_only_solution(matrix, missing, *found):
        return found
    # Several sets of impulses may do it. A + r 1 has one solution, which for r -> 0 tends to the one of
    # least norm (Tikhonov); which pairs push is final at a small r, and their impulses then follow without it.
    largest = max(matrix[k][k] for k in range(len(matrix)))
    for bits in RIDGE_BITS:
        ridged = [
            [(entry << bits) + (largest if k == m else 0) for m, entry in enumerate(row)]
            for k, row in enumerate(matrix)
        ]
        found = pivoted(ridged, missing)
        if found is None:
            continue
        pushing = [k for k, x in enumerate(found[0]) if x > 0]
        numerators, denominator = least_norm(matrix, missing, pushing)
        if is_solution(matrix, missing, numerators, denominator):
            return numerators, denominator
    raise ValueError(
        "no impulses part all pairs: a body is squeezed between immovable ones that close in on it; "
        "let one of them be movable, or stop it"
    )


def pivoted(matrix: list[list[int]], missing: list[int]) -> tuple[list[int], int] | None:
    """The solution by block principal pivoting; None where pairs that should push are redundant.

    Pairs that pull are let go, pairs that are too slow are made to push, all at once; one at a time, the
    last first, when that makes no progress (Murty 1974; Judice and Pires 1994). Ends for a definite matrix.
    """
    size = len(missing)
    pushing = [True] * size
    fewest = size + 1
    trials = TRIALS
    while True:
        chosen = [k for k in range(size) if pushing[k]]
        part, denominator, rank = solved(matrix, missing, chosen)
        if rank < len(chosen):
            return None
        numerators = [0] * size
        for k, x in zip(chosen, part, strict=True):
            numerators[k] = x
        wrong = [
            k
            for k in range(size)
            if (numerators[k] < 0 if pushing[k] else shortfall(matrix[k], missing[k], numerators, denominator) > 0)
        ]
        if not wrong:
            return numerators, denominator
        if len(wrong) < fewest:
            fewest = len(wrong)
            trials = TRIALS
        else:
            trials -= 1
        for k in wrong if trials > 0 else wrong[-1:]:
            pushing[k] = not pushing[k]


def shortfall(row: list[int], missing: int, numerators: list[int], denominator: int) -> int:
    """(b - A p) of one pair, times the denominator; positive when it leaves too slowly."""
    return missing * denominator - sum(a * x for a, x in zip(row, numerators, strict=True) if a and x)


def is_solution(matrix: list[list[int]], missing: list[int], numerators: list[int], denominator: int) -> bool:
    """Whether no pair pulls, none is too slow, and each that pushes leaves at the wanted speed."""
    for k, x in enumerate(numerators):
        slow = shortfall(matrix[k], missing[k], numerators, denominator)
        if x < 0 or slow > 0 or (x > 0 and slow != 0):
            return False
    return True


def is_only_solution(matrix: list[list[int]], missing: list[int], numerators: list[int], denominator: int) -> bool:
    """Whether the pairs that leave at exactly the wanted speed are independent, so that nothing can be traded."""
    tight = [k for k in range(len(missing)) if shortfall(matrix[k], missing[k], numerators, denominator) == 0]
    if all(numerators[k] > 0 for k in tight):
        return True  # they were just solved for
    return solved(matrix, missing, tight)[2] == len(tight)


def least_norm(matrix: list[list[int]], missing: list[int], chosen: list[int]) -> tuple[list[int], int]:
    """The impulses of least norm, of the ``chosen`` pairs alone, that give these their speeds: p = A z, A A z = b."""
    square = [[sum(matrix[k][i] * matrix[i][m] for i in chosen) for m in chosen] for k in chosen]
    z, denominator, _ = solved(square, [missing[k] for k in chosen], list(range(len(chosen))))
    numerators = [0] * len(missing)
    for k in chosen:
        numerators[k] = sum(matrix[k][m] * x for m, x in zip(chosen, z, strict=True))
    return numerators, denominator


def solved(matrix: list[list[int]], right: list[int], chosen: list[int]) -> tuple[list[int], int, int]:
    """(numerators, denominator > 0, rank) of the solution of A x = b on the ``chosen`` rows and columns.

    Elimination without fractions (Bareiss 1968) of a positive semidefinite matrix, which needs no exchange
    of rows: a pivot of 0 means that its row depends on those before; its unknown is then set to 0.
    """
    size = len(chosen)
    a = [[matrix[k][m] for m in chosen] + [right[k]] for k in chosen]
    independent: list[int] = []
    last = 1
    for k in range(size):
        pivot = a[k][k]
        if pivot == 0:
            continue
        row = a[k]
        for i in range(k + 1, size):
            below = a[i]
            factor = row[i]  # the matrix stays symmetric: only its upper half is kept
            for j in range(i, size + 1):
                below[j] = (below[j] * pivot - factor * row[j]) // last
        independent.append(k)
        last = pivot
    x = [0] * size
    for k in reversed(independent):
        x[k] = (a[k][size] * last - sum(a[k][m] * x[m] for m in independent if m > k)) // a[k][k]
    return x, last, len(independent)


def refined_solution(matrix: list[list[int]], missing: list[int], unit: int, scale: int) -> list[Fraction]:
    """The impulses [N s] of many pairs: the pushing pairs from floats, their impulses refined with exact residuals."""
    size = len(missing)
    top = max(matrix[k][k] for k in range(size))
    most = max(1, *(abs(b) for b in missing))
    a = np.array([[entry / top for entry in row] for row in matrix])
    b = np.array([x / most for x in missing])
    ridged = a + FLOAT_RIDGE * np.eye(size)
    chosen = np.flatnonzero(nonnegative_solution(ridged, b) > 0.0)
    inverse = np.linalg.inv(ridged[np.ix_(chosen, chosen)])

    bits = 200  # of the impulses, while they are refined; 100 are kept, so that what differs in the last ones is equal
    impulses = [0] * size
    for _ in range(REFINEMENTS):
        # In units of missing / matrix * 2^-bits.
        residual = [
            ((missing[k] * top) << bits) - most * sum(e * impulses[m] for m, e in enumerate(matrix[k]) if e)
            for k in chosen
        ]
        largest = max((abs(r) for r in residual), default=0)
        if largest == 0:
            break
        step = inverse @ np.array([r / largest for r in residual])
        for k, x in zip(chosen, step, strict=True):
            impulses[k] += int(Fraction(float(x)) * largest / (most * top))
    kept = [max(0, (p + (1 << 99)) >> 100) for p in impulses]
    return [Fraction(p * most * unit, (top * scale) << 100) for p in kept]


def nonnegative_solution(matrix: Array, right: Array) -> Array:
    """p >= 0 with A p >= b, complementary, for a definite matrix; shape (pairs,).

    By active sets, starting with all pairs pushing (Lawson and Hanson 1974, chapter 23; Bro and de Jong 1997).
    """
    size = len(right)
    p = np.zeros(size)
    pushing = right > 0.0
    tolerance = 1e-11 * float(np.max(np.abs(right)))  # a few times the error of a solution under the ridge
    for _ in range(3 * size):
        while pushing.any():
            wanted = np.zeros(size)
            wanted[pushing] = np.linalg.solve(matrix[np.ix_(pushing, pushing)], right[pushing])
            pulling = pushing & (wanted <= 0.0)
            if not pulling.any():
                p = wanted
                break
            fractions = p[pulling] / (p[pulling] - wanted[pulling])
            p = np.where(pushing, p + float(np.min(fractions, initial=1.0)) * (wanted - p), 0.0)
            pushing &= ~(pulling & (p <= 1e-15 * np.max(p, initial=0.0)))
        slow = np.where(pushing, 0.0, right - matrix @ p)
        worst = int(np.argmax(slow))
        if slow[worst] <= tolerance:
            break
        pushing[worst] = True
    return p
