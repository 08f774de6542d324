"""Orientations and poses in and out: quaternion, axis and angle, rotations about x, y and z, rotation vector, matrix.

Quaternions are (w, x, y, z), body to world; angles are in radians; matrices multiply columns: ``world = matrix @ body``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import InvalidValueError
from xpheve.kernels import quaternion as kernel
from xpheve.kernels.principal_axes import from_rows, to_rows

Vec = tuple[float, float, float]
Quat = tuple[float, float, float, float]
Pose = tuple[Vec, Quat]
Array = NDArray[np.float64]

RIGID = 1e-6
"""How far the columns of a matrix may be from unit length and right angles; files hold float32."""
UNIT = 1e-14
"""A quaternion whose squared length is this near to 1 is kept to the bit."""
NOWHERE: Pose = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def unit(value: Any, what: str = "orientation") -> Quat:
    """``value`` as a unit quaternion; scaled to length 1 unless it has it to rounding. Raises `InvalidValueError`."""
    w, x, y, z = _numbers(value, 4, f"{what}: a quaternion (w, x, y, z)")
    square = w * w + x * x + y * y + z * z
    if not 1e-200 < square < 1e200:
        raise InvalidValueError(f"{what} = {(w, x, y, z)}: a finite quaternion other than 0 is needed")
    return (w, x, y, z) if abs(square - 1.0) <= UNIT else kernel.normalize((w, x, y, z))


def from_axis_angle(axis: Sequence[float], angle: float) -> Quat:
    """Turn by ``angle`` [rad] about ``axis``, right-handed; the axis may have any length above 0."""
    x, y, z = _numbers(axis, 3, "axis")
    (turn,) = _numbers((angle,), 1, "angle")
    length = math.hypot(x, y, z)
    if not 0.0 < length < math.inf:
        raise InvalidValueError(f"axis = {(x, y, z)}: a finite direction other than 0 is needed")
    return kernel.from_axis_angle((x / length, y / length, z / length), turn)


def to_axis_angle(orientation: Sequence[float]) -> tuple[Vec, float]:
    """Unit axis, and angle [rad] from 0 to pi; the axis of no turn is x."""
    w, x, y, z = unit(orientation)
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    s = math.hypot(x, y, z)
    if s == 0.0:
        return (1.0, 0.0, 0.0), 0.0
    angle = 2.0 * math.atan2(s, w)
    least = -math.frexp(s)[
        1
    ]  # near the least float quotients are rounded: take them where floats have all their digits
    x, y, z = math.ldexp(x, least), math.ldexp(y, least), math.ldexp(z, least)
    s = math.hypot(x, y, z)
    return (x / s, y / s, z / s), angle


def from_rotation_vector(vector: Sequence[float]) -> Quat:
    """Turn by |vector| [rad] about its direction."""
    x, y, z = _numbers(vector, 3, "rotation vector")
    return kernel.from_rotation_vector((x, y, z))


def to_rotation_vector(orientation: Sequence[float]) -> Vec:
    """Axis times angle [rad], no longer than pi."""
    (x, y, z), angle = to_axis_angle(orientation)
    return (x * angle, y * angle, z * angle)


def from_euler(angles: Sequence[float], order: str = "xyz") -> Quat:
    """Three turns [rad] one after another, about the axes that ``order`` names.

    Lower-case letters are the fixed axes of the world, turned about in the order written: ``"xyz"``, the default, turns
    about x, then y, then z (roll, pitch, yaw). Capitals are the axes of the body, which go along: ``"ZYX"`` with the angles
    reversed is the same orientation.
    """
    axes, fixed = _order(order)
    turn: Quat = NOWHERE[1]
    for angle, axis in zip(_numbers(angles, 3, "angles"), axes, strict=True):
        step = kernel.from_axis_angle(_axis(axis), angle)
        turn = kernel.multiply(step, turn) if fixed else kernel.multiply(turn, step)
    return unit(turn)


def to_euler(orientation: Sequence[float], order: str = "xyz") -> Vec:
    """The three angles [rad] that `from_euler` takes, for an ``order`` of three different axes.

    The second lies in [-pi/2, pi/2]; there at its ends (gimbal lock), where only the sum of the others is known, the one
    of the first axis of the body is 0.
    """
    axes, fixed = _order(order)
    if len(set(axes)) != 3:
        raise InvalidValueError(f"order = {order!r}: three different axes are needed to read angles")
    i, j, k = axes[::-1] if fixed else axes  # R = R_i(a) R_j(b) R_k(c), about the axes of the body
    m = to_rows(unit(orientation))
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    b = math.atan2(sign * m[i][k], math.hypot(m[i][i], m[i][j]))
    if math.hypot(m[i][i], m[i][j]) > 1e-9:
        a = math.atan2(-sign * m[j][k], m[k][k])
        c = math.atan2(-sign * m[i][j], m[i][i])
    else:
        a, c = 0.0, math.atan2(sign * m[j][i], m[j][j])
    return (c, b, a) if fixed else (a, b, c)


def from_matrix(matrix: Any) -> Quat:
    """Orientation of a rotation matrix (3, 3), or of a pose (4, 4).

    Raises
    ------
    InvalidValueError
        For scale, shear or reflection, which an orientation cannot hold; names the factors and the way out.
    """
    given = _array(matrix, "matrix")
    if given.shape == (4, 4):
        return from_pose(given)[1]
    if given.shape != (3, 3):
        raise InvalidValueError(f"a matrix of shape {given.shape}: (3, 3) or (4, 4) is needed")
    _check_rigid(given)
    return _rotation(given)


def to_matrix(orientation: Sequence[float]) -> Array:
    """Rotation matrix, shape (3, 3)."""
    return np.array(to_rows(unit(orientation)))


def from_pose(matrix: Any, what: str = "pose") -> Pose:
    """Position [m] and orientation of a pose matrix (4, 4): ``[[rotation, position], [0, 0, 0, 1]]``.

    Raises
    ------
    InvalidValueError
        For another shape, values that are not finite, a last row other than (0, 0, 0, 1), scale, shear or reflection.
    """
    given = _array(matrix, what)
    if given.shape != (4, 4):
        raise InvalidValueError(f"{what} of shape {given.shape}: a matrix of shape (4, 4) is needed")
    if not np.array_equal(given[3], (0.0, 0.0, 0.0, 1.0)):
        raise InvalidValueError(f"{what}: its last row is {given[3].tolist()}: (0, 0, 0, 1) is needed, no perspective")
    _check_rigid(given[:3, :3], what)
    x, y, z = given[:3, 3].tolist()
    return (x, y, z), _rotation(given[:3, :3])


def to_pose(position: Sequence[float], orientation: Sequence[float]) -> Array:
    """Pose matrix, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3] = to_rows(unit(orientation))
    pose[:3, 3] = _numbers(position, 3, "position")
    return pose


def compose(outer: Pose, inner: Pose) -> Pose:
    """The pose ``inner``, given relative to ``outer``, seen from where ``outer`` is given."""
    (ax, ay, az), (bx, by, bz) = outer[0], kernel.rotate(outer[1], inner[0])
    if inner[1] == NOWHERE[1]:
        turn = outer[1]
    else:
        turn = inner[1] if outer[1] == NOWHERE[1] else unit(kernel.multiply(outer[1], inner[1]))
    return (ax + bx, ay + by, az + bz), turn


def inverse(pose: Pose) -> Pose:
    """The pose that undoes ``pose``."""
    back = kernel.conjugate(pose[1])
    x, y, z = kernel.rotate(back, pose[0])
    return (0.0 - x, 0.0 - y, 0.0 - z), (back[0], back[1] + 0.0, back[2] + 0.0, back[3] + 0.0)


def stretch(matrix: Any) -> tuple[Array, Array]:
    """The three factors along the columns of a (3, 3) or (4, 4) matrix, and the part that is left when they are taken out.

    The first factor is negative for a reflection.
    """
    part = np.array(_array(matrix, "matrix")[:3, :3])
    factors = np.array([math.hypot(*part[:, k].tolist()) for k in range(3)])
    if not (factors > 0.0).all():
        raise InvalidValueError(f"a matrix that flattens: factors {factors.tolist()}")
    if np.linalg.det(part / factors) < 0.0:
        factors[0] = -factors[0]
    return factors, part / factors


def _check_rigid(part: Array, what: str = "matrix") -> None:
    factors, rest = stretch(part)
    skew = max(abs(float((rest[:, i] * rest[:, j]).sum())) for i, j in ((0, 1), (0, 2), (1, 2)))
    named = ", ".join(f"{factor:.6g}" for factor in np.abs(factors))
    if skew > RIGID:
        raise InvalidValueError(
            f"{what}: shear of {skew:.3g} (scale {named}): a pose has none; give the vertices in their sheared places"
        )
    if factors[0] < 0.0:
        raise InvalidValueError(f"{what}: a reflection (scale {named}, mirrored): a pose has none; mirror the vertices")
    if np.abs(factors - 1.0).max() > RIGID:
        s = f"{factors[0]:.6g}" if np.ptp(factors) <= RIGID * factors.max() else f"({named})"
        raise InvalidValueError(
            f"{what}: scale {named}: a pose has none; scale the geometry, shape.scaled({s}), and take it out of the matrix"
        )


def _rotation(part: Array) -> Quat:
    """Nearest rotation of a nearly rigid matrix: one Newton step to the polar factor, then a unit quaternion."""
    near = 0.5 * (part + np.linalg.inv(part).T) if np.abs(part.T @ part - np.eye(3)).max() > 1e-15 else part
    a, b, c = (tuple(row) for row in near.tolist())
    w, x, y, z = from_rows((a, b, c))
    return w + 0.0, x + 0.0, y + 0.0, z + 0.0


def _order(order: str) -> tuple[list[int], bool]:
    fixed = isinstance(order, str) and order == order.lower()
    if (
        not isinstance(order, str)
        or len(order) != 3
        or set(order.lower()) - set("xyz")
        or (not fixed and order != order.upper())
    ):
        raise InvalidValueError(
            f"order = {order!r}: three letters such as 'xyz' (fixed axes) or 'ZYX' (the body's) are needed"
        )
    return ["xyz".index(letter) for letter in order.lower()], fixed


def _axis(k: int) -> Vec:
    return (float(k == 0), float(k == 1), float(k == 2))


def _array(value: Any, what: str) -> Array:
    try:
        found = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{what} = {value!r}: a matrix of numbers is needed") from None
    if not np.isfinite(found).all():
        raise InvalidValueError(f"{what}: not all of its elements are finite")
    return found


def _numbers(value: Any, count: int, what: str) -> tuple[float, ...]:
    try:
        found = tuple(float(component) for component in value)
    except (TypeError, ValueError):
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise InvalidValueError(f"{what} = {value!r}: {count} finite number{'s are' if count > 1 else ' is'} needed")
    return found
