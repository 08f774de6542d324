"""Rotation in steps: free turns that are exact for tops with two equal moments, split for others; torques as kicks between them.

With A_k the principal moments, A the middle one of them, and M = L / A the angular momentum in units of it, the energy is

    H = A |M|^2 / 2 + sum_k A s_k M_k^2 / 2,    s_k = A / A_k - 1 along the body axes,    s_k = 0 for the axis of A,

so free rotation is a turn about M, which is fixed in the world, by |M| t, and turns about body axes at the rates s_k M_k. The first commutes
with all others and is exact; where two moments are equal at most one s_k is not 0, and the whole is. Else the turns about the two axes are
split symmetrically (Strang, SIAM J. Numer. Anal. 5 (1968) 506; R. I. McLachlan, Phys. Rev. Lett. 71 (1993) 3043; S. Reich, Phys. D 76
(1994) 375): second order, reversible, |M| kept to rounding, and the energy without drift. The error of a turn is about s_j s_k (|M| t)^3.
A torque T changes M by T t / A, whatever the orientation.

The functions have no branches on numbers, so that they serve floats and arrays alike (`xpheve.loop.array_run` puts arrays' own sines in);
a body with M = 0 keeps its orientation to the bit, and one with three equal moments its angular velocity.
Units: M and angular velocity [rad/s], world frame; times [s]; s_k and the excess A_k / A - 1 are pure numbers, all 0 for a point.
"""

from xpheve.kernels.ieee import cos, sin, sqrt
from xpheve.kernels.quaternion import Quat, multiply, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add


def uneven(spread: Vec) -> bool:
    """Whether the moments differ."""
    return spread[0] != 0.0 or spread[1] != 0.0 or spread[2] != 0.0


def stretched(q: Quat, v: Vec, by: Vec) -> Vec:
    """``v`` + R diag(by) R^T ``v``: with the excess, M of an angular velocity; with the spread, the angular velocity of M."""
    if uneven(by):
        local = rotate_inverse(q, v)
        return add(v, rotate(q, (by[0] * local[0], by[1] * local[1], by[2] * local[2])))
    return v


def turned(q: Quat, m: Vec, spread: Vec, s: float) -> Quat:
    """Orientation after a free turn of ``s`` [s] with the angular momentum ``m``; not the unit quaternion's sign, but all else is kept."""
    size = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
    moving = 1.0 * (size != 0.0)
    if uneven(spread):
        q = about_axes(q, rotate_inverse(q, m), spread, s)
    half = 0.5 * s * size
    k = sin(half) / (size + (1.0 - moving))
    w, x, y, z = multiply((cos(half), k * m[0], k * m[1], k * m[2]), q)
    length = moving * sqrt(w * w + x * x + y * y + z * z) + (1.0 - moving)
    return (w / length, x / length, y / length, z / length)


def about_axes(q: Quat, m: Vec, spread: Vec, s: float) -> Quat:
    """Turns about the body axes x, y, z, y, x, of which one axis needs none; ``m`` is in the body frame."""
    q, m = through_axes(q, m, spread, s)
    return q


def through_axes(q: Quat, m: Vec, spread: Vec, s: float) -> tuple[Quat, Vec]:
    """As `about_axes`; and ``m`` as the body sees it then. Compositions of it are of higher order (H. Yoshida, Phys. Lett. A 150 (1990) 262)."""
    h = 0.5 * s
    q, m = about_x(q, m, h * spread[0])
    q, m = about_y(q, m, h * spread[1])
    q, m = about_z(q, m, s * spread[2])
    q, m = about_y(q, m, h * spread[1])
    return about_x(q, m, h * spread[0])


def about_x(q: Quat, m: Vec, rate: float) -> tuple[Quat, Vec]:
    """Turn about the body's x by ``rate`` times ``m`` along it: the orientation, and ``m`` as the body sees it then."""
    half = 0.5 * rate * m[0]
    c, s = cos(half), sin(half)
    cosine, sine = 1.0 - 2.0 * s * s, 2.0 * s * c
    q = (c * q[0] - s * q[1], c * q[1] + s * q[0], c * q[2] + s * q[3], c * q[3] - s * q[2])
    return q, (m[0], cosine * m[1] + sine * m[2], cosine * m[2] - sine * m[1])


def about_y(q: Quat, m: Vec, rate: float) -> tuple[Quat, Vec]:
    """As `about_x`, about y."""
    half = 0.5 * rate * m[1]
    c, s = cos(half), sin(half)
    cosine, sine = 1.0 - 2.0 * s * s, 2.0 * s * c
    q = (c * q[0] - s * q[2], c * q[1] - s * q[3], c * q[2] + s * q[0], c * q[3] + s * q[1])
    return q, (cosine * m[0] - sine * m[2], m[1], cosine * m[2] + sine * m[0])


def about_z(q: Quat, m: Vec, rate: float) -> tuple[Quat, Vec]:
    """As `about_x`, about z."""
    half = 0.5 * rate * m[2]
    c, s = cos(half), sin(half)
    cosine, sine = 1.0 - 2.0 * s * s, 2.0 * s * c
    q = (c * q[0] - s * q[3], c * q[1] + s * q[2], c * q[2] - s * q[1], c * q[3] + s * q[0])
    return q, (cosine * m[0] + sine * m[1], cosine * m[1] - sine * m[0], m[2])


def kicked(m: Vec, torque: Vec, s: float) -> Vec:
    """``m`` after a torque in units of A acted for ``s`` [s]; none leaves every bit."""
    return (m[0] + s * torque[0], m[1] + s * torque[1], m[2] + s * torque[2])


def inverse_of(inertia: Vec) -> float:
    """1 / A, 0 for a point, which nothing turns."""
    return 1.0 / middle_moment(inertia) if inertia[0] > 0.0 else 0.0


def flown(q: Quat, omega: Vec, excess: Vec, spread: Vec, torque: Vec, s: float) -> tuple[Quat, Vec]:
    """Orientation and angular velocity after ``s`` [s] under a constant ``torque`` in units of A: half a turn, the kick, half a turn."""
    m = stretched(q, omega, excess)
    q = turned(q, m, spread, 0.5 * s)
    m = kicked(m, torque, s)
    q = turned(q, m, spread, 0.5 * s)
    return q, stretched(q, m, spread)


def middle_moment(inertia: Vec) -> float:
    """The middle one of three moments [kg m^2]; 1 for a point."""
    a, b, c = inertia
    found = max(min(a, b), min(max(a, b), c))
    return found if found > 0.0 else 1.0


def excess_of(inertia: Vec) -> Vec:
    """A_k / A - 1, 0 for a point."""
    if inertia[0] == 0.0:
        return (0.0, 0.0, 0.0)
    middle = middle_moment(inertia)
    return (inertia[0] / middle - 1.0, inertia[1] / middle - 1.0, inertia[2] / middle - 1.0)


def spread_of(inertia: Vec) -> Vec:
    """A / A_k - 1, 0 for a point."""
    if inertia[0] == 0.0:
        return (0.0, 0.0, 0.0)
    middle = middle_moment(inertia)
    return (middle / inertia[0] - 1.0, middle / inertia[1] - 1.0, middle / inertia[2] - 1.0)
