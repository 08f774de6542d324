"""The impulse of one contact point with friction, in plain arithmetic that can be read into compiled loops.

Source and proof that energy never rises: see `rubbing`, which solves any number of contacts together and agrees with this for one.
"""

from __future__ import annotations

import math

import xpheve as xp
from xpheve.kernels.quaternion import Quat, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, dot, scale, sub
from xpheve.laws import Contact
from xpheve.objects import PhysicalObject

Side = tuple[float, Vec, Quat, Vec]
"""One body of a contact: 1/m [1/kg], 1/I [1/(kg m^2)] along its principal axes, orientation, and the arm [m] to the contact."""


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
    still = obj.fixed | obj.driven
    a, b, c = obj.inertia
    weight = xp.where(still, 0.0, 1.0 / obj.mass)
    turns = (_inverse(a, still), _inverse(b, still), _inverse(c, still))
    return weight, turns, obj.orientation, sub(contact.point, obj.position)


def _inverse(moment: float, still: bool) -> float:
    """1 / moment; 0 for what no impulse turns. Both sides of a choice are computed, so that nothing branches."""
    turns = moment > 0.0
    found: float = xp.where(still, 0.0, xp.where(turns, 1.0 / xp.where(turns, moment, 1.0), 0.0))
    return found


def _speed(obj: PhysicalObject, side: Side) -> Vec:
    """Velocity [m/s] of the body at the contact."""
    return add(obj.velocity, cross(obj.angular_velocity, side[3]))


def _moved(one: Side, two: Side, impulse: Vec) -> Vec:
    """By how much [m/s] an impulse at the contact makes the second body faster there, seen from the first: K times it."""
    return add(_moved_alone(one, impulse), _moved_alone(two, impulse))


def _moved_alone(side: Side, impulse: Vec) -> Vec:
    weight, turns, orientation, arm = side
    twist = rotate_inverse(orientation, cross(arm, impulse))
    spin = rotate(orientation, (twist[0] * turns[0], twist[1] * turns[1], twist[2] * turns[2]))
    return add(scale(impulse, weight), cross(spin, arm))


def _stopping(one: Side, two: Side, u: Vec) -> Vec:
    """-K^-1 u [N s], by the cofactors of the matrix K of the contact."""
    k0, k1, k2 = _moved(one, two, (1.0, 0.0, 0.0)), _moved(one, two, (0.0, 1.0, 0.0)), _moved(one, two, (0.0, 0.0, 1.0))
    size = -1.0 / dot(k0, cross(k1, k2))
    return scale((dot(u, cross(k1, k2)), dot(u, cross(k2, k0)), dot(u, cross(k0, k1))), size)


__all__ = ["touching_impulse"]
