"""Orientations as unit quaternions (w, x, y, z), body to world: v_world = q v_body q*."""

import math

from xpheve.kernels.vector import Vec, add, cross, norm, scale

Quat = tuple[float, float, float, float]


def multiply(p: Quat, q: Quat) -> Quat:
    """Hamilton product p q: as rotations, first ``q``, then ``p``."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


def conjugate(q: Quat) -> Quat:
    """q*, for a unit quaternion the inverse rotation."""
    return (q[0], -q[1], -q[2], -q[3])


def normalize(q: Quat) -> Quat:
    """q / |q|; the quaternion zero becomes no rotation."""
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    if 1e-280 < square < 1e300:  # inside, no square that counts has lost a digit
        n = math.sqrt(square)
        return (q[0] / n, q[1] / n, q[2] / n, q[3] / n)
    largest = max(abs(q[0]), abs(q[1]), abs(q[2]), abs(q[3]))
    if largest == 0.0:
        return (1.0, 0.0, 0.0, 0.0)
    w, x, y, z = q[0] / largest, q[1] / largest, q[2] / largest, q[3] / largest
    n = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / n, x / n, y / n, z / n)


def rotate(q: Quat, v: Vec) -> Vec:
    """Vector ``v`` turned by the unit quaternion ``q``: body to world."""
    u = (q[1], q[2], q[3])
    t = scale(cross(u, v), 2.0)
    return add(add(v, scale(t, q[0])), cross(u, t))


def rotate_inverse(q: Quat, v: Vec) -> Vec:
    """Vector ``v`` turned back by the unit quaternion ``q``: world to body."""
    return rotate(conjugate(q), v)


def from_axis_angle(axis: Vec, angle: float) -> Quat:
    """Turn by ``angle`` [rad] about the unit vector ``axis``, right-handed."""
    s = math.sin(0.5 * angle)
    return (math.cos(0.5 * angle), s * axis[0], s * axis[1], s * axis[2])


def from_rotation_vector(v: Vec) -> Quat:
    """Turn by |v| [rad] about the direction of ``v``; the vector zero is no rotation."""
    angle = norm(v)
    if angle == 0.0:
        return (1.0, 0.0, 0.0, 0.0)
    s = math.sin(0.5 * angle)
    return (math.cos(0.5 * angle), v[0] / angle * s, v[1] / angle * s, v[2] / angle * s)
