"""The impulse of one contact point with friction, in plain arithmetic that can be read into compiled loops.

Source and proof that energy never rises: see `rubbing`, which solves any number of contacts together and agrees with this for one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import xpheve as xp
from xpheve.kernels.quaternion import rotate, rotate_inverse
from xpheve.kernels.vector import add, cross, dot, scale, sub
from xpheve_laws_collision.mass import inverse_mass


def touching_impulse(contact: Any, restitution: Any, friction: Any, tangential: Any) -> Any:
    """The impulse [N s] on ``body_b``, three numbers: friction None is infinite, so that the surfaces never slip."""
    one, two = (_side(obj, contact) for obj in (contact.body_a, contact.body_b))
    n = contact.normal
    along = add(_moved(one, n), _moved(two, n))
    x = scale(n, contact.approach_speed / dot(n, along))
    u = sub(_speed(contact.body_b, two), _speed(contact.body_a, one))
    d = sub(_stopping(one, two, u), x)
    normal = scale(x, 1.0 + restitution)
    if friction is None:
        return add(normal, scale(d, 1.0 + tangential))
    push, more = dot(n, normal), dot(n, d)
    across = sub(d, scale(n, more))
    size = np.sqrt(dot(across, across))
    limit = friction * (push + (1.0 + tangential) * more)
    sticks = (1.0 + tangential) * size <= limit
    room = xp.where(sticks, 1.0, size - friction * more)
    return add(normal, scale(d, xp.where(sticks, 1.0 + tangential, friction * push / room)))


def _side(obj: Any, contact: Any) -> Any:
    """1/m, 1/I along the principal axes, orientation, and the arm [m] from the centre to the contact."""
    weight = inverse_mass(obj)
    moments = obj.inertia
    turns = [
        xp.where((weight > 0.0) & (moments[k] > 0.0), 1.0 / xp.where(moments[k] > 0.0, moments[k], 1.0), 0.0)
        for k in range(3)
    ]
    return weight, turns, obj.orientation, sub(contact.point, obj.position)


def _speed(obj: Any, side: Any) -> Any:
    """Velocity [m/s] of the body at the contact."""
    return add(obj.velocity, cross(obj.angular_velocity, side[3]))


def _moved(side: Any, impulse: Any) -> Any:
    """By how much [m/s] an impulse at the contact makes the body faster there."""
    weight, turns, q, arm = side
    twist = rotate_inverse(q, cross(arm, impulse))
    spin = rotate(q, (turns[0] * twist[0], turns[1] * twist[1], turns[2] * twist[2]))
    return add(scale(impulse, weight), cross(spin, arm))


def _stopping(one: Any, two: Any, u: Any) -> Any:
    """-K^-1 u [N s], by the cofactors of the matrix K of the contact."""
    unit = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    k0, k1, k2 = (add(_moved(one, axis), _moved(two, axis)) for axis in unit)
    size = -1.0 / dot(k0, cross(k1, k2))
    parts = (dot(u, cross(k1, k2)), dot(u, cross(k2, k0)), dot(u, cross(k0, k1)))
    return scale(parts, size)


__all__ = ["touching_impulse"]
