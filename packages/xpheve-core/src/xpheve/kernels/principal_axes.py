"""Principal axes of a symmetric tensor, chosen as near to the given axes as they can be.

Jacobi's rotations (Golub and Van Loan, Matrix Computations, 8.5), which keep small off-diagonal elements to their last digit.
"""

import math
from itertools import permutations, product

from xpheve.kernels.quaternion import Quat, normalize
from xpheve.kernels.vector import Vec

Rows = tuple[Vec, Vec, Vec]

ROUNDING = 1e-12
"""Off-diagonal elements and differences of moments below this part of the largest element count as rounding."""
NO_TURN: Quat = (1.0, 0.0, 0.0, 0.0)


def principal_axes(tensor: Rows) -> tuple[Vec, Quat]:
    """Principal values of the symmetric ``tensor``, and the smallest rotation that takes the given axes to principal ones.

    Axes are turned no more than needed: not at all where the tensor is diagonal to rounding; where two values are equal,
    by the smallest turn that brings one given axis onto the single principal axis.
    """
    largest = max(abs(element) for row in tensor for element in row)
    small = ROUNDING * largest
    if max(abs(tensor[0][1]), abs(tensor[0][2]), abs(tensor[1][2])) <= small:
        return (tensor[0][0], tensor[1][1], tensor[2][2]), NO_TURN
    values, axes = _jacobi(tensor)
    equal = [(i, j) for i, j in ((0, 1), (0, 2), (1, 2)) if abs(values[i] - values[j]) <= 10 * small]
    if len(equal) > 1:
        return values, NO_TURN
    if equal:
        return _about_single_axis(values, axes, equal[0])
    return _nearest(values, axes)


def _jacobi(tensor: Rows) -> tuple[Vec, Rows]:
    """Principal values, and the axes that belong to them, as unit vectors."""
    a = [list(row) for row in tensor]
    v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]  # columns are the axes
    for _ in range(30):
        off = max(abs(a[0][1]), abs(a[0][2]), abs(a[1][2]))
        if off <= 1e-17 * max(abs(a[0][0]), abs(a[1][1]), abs(a[2][2])):
            break
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if a[p][q] == 0.0:
                continue
            theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q])
            t = math.copysign(1.0, theta) / (abs(theta) + math.hypot(theta, 1.0))
            c = 1.0 / math.hypot(t, 1.0)
            s = t * c
            r = 3 - p - q
            shift = t * a[p][q]
            a[p][p] -= shift
            a[q][q] += shift
            a[p][q] = a[q][p] = 0.0
            a[r][p], a[r][q] = c * a[r][p] - s * a[r][q], s * a[r][p] + c * a[r][q]
            a[p][r], a[q][r] = a[r][p], a[r][q]
            for row in v:
                row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
    columns = [(v[0][k], v[1][k], v[2][k]) for k in range(3)]
    return (a[0][0], a[1][1], a[2][2]), (columns[0], columns[1], columns[2])


def _about_single_axis(values: Vec, axes: Rows, equal: tuple[int, int]) -> tuple[Vec, Quat]:
    single = 3 - equal[0] - equal[1]
    axis, common = axes[single], 0.5 * (values[equal[0]] + values[equal[1]])
    sizes = [abs(component) for component in axis]
    most = max(sizes)
    k = next(i for i in range(3) if sizes[i] >= most - 1e-9)  # rounding does not decide between equals
    if axis[k] < 0.0:
        axis = (-axis[0], -axis[1], -axis[2])
    found = [common, common, common]
    found[k] = values[single]
    i, j = (k + 1) % 3, (k + 2) % 3
    q = [1.0 + axis[k], 0.0, 0.0, 0.0]  # 1 + e . n, e x n
    q[1 + i], q[1 + j] = -axis[j], axis[i]
    return (found[0], found[1], found[2]), normalize((q[0], q[1], q[2], q[3]))


def _nearest(values: Vec, axes: Rows) -> tuple[Vec, Quat]:
    """Of the 24 right-handed ways to name and point the axes, the one of the smallest turn."""
    best: tuple[float, Vec, Rows] | None = None
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            x, y, z = (tuple(s * component for component in axes[k]) for k, s in zip(order, signs, strict=True))
            handed = (
                x[0] * (y[1] * z[2] - y[2] * z[1])
                + x[1] * (y[2] * z[0] - y[0] * z[2])
                + x[2] * (y[0] * z[1] - y[1] * z[0])
            )
            trace = x[0] + y[1] + z[2]
            if handed > 0 and (best is None or trace > best[0] + 1e-9):
                named = (values[order[0]], values[order[1]], values[order[2]])
                best = trace, named, ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))
    assert best is not None
    return best[1], from_rows(best[2])


def from_rows(m: Rows) -> Quat:
    """Unit quaternion of a rotation matrix given by its rows (Shepperd 1978: the largest component first)."""
    trace = m[0][0] + m[1][1] + m[2][2]
    squares = (trace, m[0][0], m[1][1], m[2][2])
    k = squares.index(max(squares))
    if k == 0:
        q = (1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1])
    elif k == 1:
        q = (m[2][1] - m[1][2], 1.0 + 2.0 * m[0][0] - trace, m[1][0] + m[0][1], m[0][2] + m[2][0])
    elif k == 2:
        q = (m[0][2] - m[2][0], m[1][0] + m[0][1], 1.0 + 2.0 * m[1][1] - trace, m[2][1] + m[1][2])
    else:
        q = (m[1][0] - m[0][1], m[0][2] + m[2][0], m[2][1] + m[1][2], 1.0 + 2.0 * m[2][2] - trace)
    unit = normalize(q)
    return unit if unit[0] >= 0.0 else (-unit[0], -unit[1], -unit[2], -unit[3])


def to_rows(q: Quat) -> Rows:
    """Rotation matrix of a unit quaternion, by its rows."""
    w, x, y, z = q
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
