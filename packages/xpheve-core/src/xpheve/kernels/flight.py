"""Flight of one body under a force and a torque constant in the world frame; the same formulas serve arrays and rows."""

import math

from xpheve.kernels.free_rotation import prepare, turn
from xpheve.kernels.quaternion import Quat, from_rotation_vector, multiply, normalize, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, dot, norm, scale

RESTING, FREE, PRINCIPAL, GENERAL = 0, 1, 2, 3
"""How a body turns: not at all; free of torque; under a torque about the principal axis it spins about; under any torque."""

PARALLEL = 4e-16
"""Two directions this close are one: twice the rounding of a unit vector."""


def place(x0: float, v0: float, a: float, s: float) -> float:
    """One coordinate after time ``s``: x0 + s (v0 + s a / 2). Exact for constant ``a``, at any split of the time."""
    return x0 + s * (v0 + (0.5 * s) * a)


def speed(v0: float, a: float, s: float) -> float:
    """One component of velocity after time ``s``."""
    return v0 + s * a


def way_of_turning(q: Quat, omega: Vec, inertia: Vec, torque: Vec) -> int:
    """Which of RESTING, FREE, PRINCIPAL and GENERAL the body's rotation is."""
    if torque == (0.0, 0.0, 0.0):
        return FREE if omega != (0.0, 0.0, 0.0) else RESTING
    axis = scale(torque, 1.0 / norm(torque))
    if norm(cross(omega, axis)) > PARALLEL * norm(omega):
        return GENERAL
    local = rotate_inverse(q, axis)
    bent = (inertia[0] * local[0], inertia[1] * local[1], inertia[2] * local[2])
    if norm(cross(bent, local)) > PARALLEL * max(inertia[0], inertia[1], inertia[2]):
        return GENERAL
    return PRINCIPAL


def turn_about_axis(q: Quat, omega: Vec, inertia: Vec, torque: Vec, s: float) -> tuple[Quat, Vec]:
    """Rotation under a constant torque about the principal axis that the body spins about, after time ``s``."""
    axis = scale(torque, 1.0 / norm(torque))
    local = rotate_inverse(q, axis)
    moment = inertia[0] * local[0] ** 2 + inertia[1] * local[1] ** 2 + inertia[2] * local[2] ** 2
    rate = norm(torque) / moment
    half = 0.5 * s * (dot(omega, axis) + 0.5 * s * rate)
    sine = math.sin(half)
    turned = multiply((math.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]), q)
    return normalize(turned), add(omega, scale(axis, s * rate))


def turn_uniformly(q: Quat, omega: Vec, s: float) -> Quat:
    """Orientation after time ``s`` of a turn at constant angular velocity, world frame."""
    if s == 0.0 or omega == (0.0, 0.0, 0.0):
        return q
    return normalize(multiply(from_rotation_vector(scale(omega, s)), q))


def kicked(q: Quat, omega: Vec, inertia: Vec, angular_impulse: Vec) -> Vec:
    """Angular velocity after ``angular_impulse`` [N m s], world frame: omega + R diag(1/I) R^T J."""
    if angular_impulse == (0.0, 0.0, 0.0):  # a point may spin: it has no inertia, and nothing turns it
        return omega
    j = rotate_inverse(q, angular_impulse)
    return add(omega, rotate(q, (j[0] / inertia[0], j[1] / inertia[1], j[2] / inertia[2])))


def turn_split(q: Quat, omega: Vec, inertia: Vec, torque: Vec, s: float) -> tuple[Quat, Vec]:
    """Rotation under any constant torque after time ``s``: half a free turn, the whole kick, half a free turn.

    Second order (Strang, SIAM J. Numer. Anal. 5 (1968) 506); exact for no torque.
    """
    q, omega = turn(prepare(q, omega, inertia), 0.5 * s)
    omega = kicked(q, omega, inertia, scale(torque, s))
    return turn(prepare(q, omega, inertia), 0.5 * s)
