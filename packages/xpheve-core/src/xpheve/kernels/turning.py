"""Rotation as a motion of second order: the unit quaternion, its derivative, and its second derivative under a torque.

With the angular velocity w and the torque T in the world frame, q' = w q / 2, and Euler's equations, J w' = T - w x (J w), give

    q'' = w' q / 2 - |w|^2 q / 4

so that what carries places by their accelerations carries orientations, too (H. Goldstein, Classical Mechanics, 4.9 and 5.5, for q' and w').
A moment of 0 belongs to what does not turn: a point. Units: [rad/s], [N m], [kg m^2].
"""

from xpheve.kernels.ieee import sqrt
from xpheve.kernels.quaternion import Quat, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, cross


def spin_of(q: Quat, rate: Quat) -> Vec:
    """Angular velocity w = 2 q' q* of the orientation ``q`` that changes by ``rate``; its length is right where |q| = 1."""
    return (
        2.0 * (q[0] * rate[1] - rate[0] * q[1] + (q[2] * rate[3] - q[3] * rate[2])),
        2.0 * (q[0] * rate[2] - rate[0] * q[2] + (q[3] * rate[1] - q[1] * rate[3])),
        2.0 * (q[0] * rate[3] - rate[0] * q[3] + (q[1] * rate[2] - q[2] * rate[1])),
    )


def rate_of(q: Quat, spin: Vec) -> Quat:
    """q' = w q / 2."""
    return (
        -0.5 * (spin[0] * q[1] + spin[1] * q[2] + spin[2] * q[3]),
        0.5 * (spin[0] * q[0] + spin[1] * q[3] - spin[2] * q[2]),
        0.5 * (spin[1] * q[0] + spin[2] * q[1] - spin[0] * q[3]),
        0.5 * (spin[2] * q[0] + spin[0] * q[2] - spin[1] * q[1]),
    )


def bend_of(q: Quat, spin: Vec, inertia: Vec, inverse: Vec, torque: Vec) -> Quat:
    """q'' under ``torque``; ``inverse`` are the inverse principal moments, 0 where there is none."""
    w = rotate_inverse(q, spin)
    t = rotate_inverse(q, torque)
    swept = cross(w, (inertia[0] * w[0], inertia[1] * w[1], inertia[2] * w[2]))
    faster = (inverse[0] * (t[0] - swept[0]), inverse[1] * (t[1] - swept[1]), inverse[2] * (t[2] - swept[2]))
    first = rate_of(q, rotate(q, faster))
    square = 0.25 * (spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2])
    return (first[0] - square * q[0], first[1] - square * q[1], first[2] - square * q[2], first[3] - square * q[3])


def unit(q: Quat) -> Quat:
    """``q`` with the length 1 that rounding takes away."""
    n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] / n, q[1] / n, q[2] / n, q[3] / n)


def across(q: Quat, rate: Quat) -> Quat:
    """``rate`` without its part along the unit quaternion ``q``, which only rounding gives it."""
    along = q[0] * rate[0] + q[1] * rate[1] + q[2] * rate[2] + q[3] * rate[3]
    return (rate[0] - along * q[0], rate[1] - along * q[1], rate[2] - along * q[2], rate[3] - along * q[3])
