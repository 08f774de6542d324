"""The impulse of one contact point with friction, in plain arithmetic that can be read into compiled loops.

Source and proof that energy never rises: see `rubbing`, which solves any number of contacts together and agrees with this for one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from xpheve.kernels.quaternion import Quat, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, dot, scale, sub
from xpheve.laws import Contact
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.mass import inverse_mass


class Side(NamedTuple):
    """One body of a contact: 1/m [1/kg], principal moments [kg m^2], orientation, and the arm [m] from its centre to the contact."""

    weight: float
    moments: Vec
    orientation: Quat
    arm: Vec


def touching_impulse(contact: Contact, restitution: float, friction: float | None, tangential: float) -> Vec:
    """The impulse [N s] on ``body_b``: friction None is infinite, so that the surfaces never slip."""
    one, two = _side(contact.body_a, contact), _side(contact.body_b, contact)
    n = contact.normal
    x = scale(n, contact.approach_speed / dot(n, _moved(one, two, n)))
    u = sub(_speed(contact.body_b, two), _speed(contact.body_a, one))
    d = sub(_stopping(one, two, u), x)
    normal = scale(x, 1.0 + restitution)
    if friction is None:
        return add(normal, scale(d, 1.0 + tangential))
    push, more = dot(n, normal), dot(n, d)
    across = sub(d, scale(n, more))
    size = math.sqrt(dot(across, across))
    if (1.0 + tangential) * size <= friction * (push + (1.0 + tangential) * more):
        return add(normal, scale(d, 1.0 + tangential))
    return add(normal, scale(d, friction * push / (size - friction * more)))


def _side(obj: PhysicalObject, contact: Contact) -> Side:
    return Side(inverse_mass(obj), obj.inertia, obj.orientation, sub(contact.point, obj.position))


def _speed(obj: PhysicalObject, side: Side) -> Vec:
    """Velocity [m/s] of the body at the contact."""
    return add(obj.velocity, cross(obj.angular_velocity, side.arm))


def _moved(one: Side, two: Side, impulse: Vec) -> Vec:
    """By how much [m/s] an impulse at the contact makes the second body faster there, seen from the first: K times it."""
    return add(_moved_alone(one, impulse), _moved_alone(two, impulse))


def _moved_alone(side: Side, impulse: Vec) -> Vec:
    if side.weight == 0.0:
        return (0.0, 0.0, 0.0)
    straight = scale(impulse, side.weight)
    a, b, c = side.moments
    if a == 0.0:  # a point: then all three are 0
        return straight
    twist = rotate_inverse(side.orientation, cross(side.arm, impulse))
    spin = rotate(side.orientation, (twist[0] / a, twist[1] / b, twist[2] / c))
    return add(straight, cross(spin, side.arm))


def _stopping(one: Side, two: Side, u: Vec) -> Vec:
    """-K^-1 u [N s], by the cofactors of the matrix K of the contact."""
    k0, k1, k2 = _moved(one, two, (1.0, 0.0, 0.0)), _moved(one, two, (0.0, 1.0, 0.0)), _moved(one, two, (0.0, 0.0, 1.0))
    size = -1.0 / dot(k0, cross(k1, k2))
    return scale((dot(u, cross(k1, k2)), dot(u, cross(k2, k0)), dot(u, cross(k0, k1))), size)


__all__ = ["touching_impulse"]
