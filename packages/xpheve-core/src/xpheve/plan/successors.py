"""Objects that take the place of another: the parts it splits into, or what it is replaced by."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xpheve.errors import InvalidValueError
from xpheve.kernels.quaternion import rotate
from xpheve.laws import PairLaw, PhysicalLaw
from xpheve.plan import scenery
from xpheve.plan.driven import immovable

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.world import World

Array = npt.NDArray[np.float64]

KEPT = 1e-9  # of what is at hand: mass, momentum or angular momentum that differs by less is kept


class Motion(NamedTuple):
    """How the parts leave: velocities [m/s], angular velocities [rad/s], (n, 3) each, and the kinetic energy [J] gained."""

    velocity: Array
    spin: Array
    gained: float


def laws_of(world: World, obj: PhysicalObject) -> list[PhysicalLaw]:
    """The laws that what comes after ``obj`` obeys unless told: those of ``obj``, but for laws that name their objects."""
    return [law for law in world.mapping.laws(obj) if not (isinstance(law, PairLaw) and law.named is not None)]


def check_once(world: World, obj: PhysicalObject) -> None:
    """Refuse a second fate of ``obj`` at one instant; raises `InvalidValueError`."""
    if world.transaction is not None:
        if obj in world.transaction.leaving:
            raise InvalidValueError(
                f"{obj!r} is replaced or split at this instant already: an object has one successor"
            )
        world.transaction.leaving[obj] = None
        leaving = world.transaction.leaving
        world.transaction.undo.append(lambda: leaving.pop(obj, None) and None)


def replace(
    world: World, engine: Any, obj: PhysicalObject, new: Sequence[PhysicalObject], laws: Sequence[PhysicalLaw]
) -> None:
    """Take ``obj`` out and ``new`` in."""
    scenery.remove_object(world, obj)
    scenery.add_objects(world, engine, new, laws)


def check_parts(obj: PhysicalObject, parts: Sequence[PhysicalObject], conserve: bool) -> None:
    """Refuse parts that ``obj`` cannot split into; raises `InvalidValueError` with the numbers."""
    if not parts:
        raise InvalidValueError(f"{obj!r} splits into no parts: give one at least, or remove it")
    if immovable(obj) or any(part.fixed for part in parts):
        raise InvalidValueError(f"{obj!r}: what is fixed or driven has no momentum to share: replace it instead")
    masses = math.fsum(part.mass for part in parts)
    if conserve and abs(masses - obj.mass) > KEPT * obj.mass:
        raise InvalidValueError(
            f"{obj!r} has {obj.mass} kg and its parts {masses} kg together: give masses that add up, or conserve=False"
        )
    if conserve:
        _check_momentum(obj, parts)
    motion(obj, parts, conserve)


def _check_momentum(obj: PhysicalObject, parts: Sequence[PhysicalObject]) -> None:
    """The parts have the centre of mass of the whole, and their own velocities cancel."""
    arms, masses, kicks = _arms(obj, parts), _column([part.mass for part in parts]), _array(parts, "velocity")
    size = float(np.max(np.linalg.norm(arms, axis=1))) + 1e-6 * float(np.linalg.norm(obj.position))
    off = (masses * arms).sum(axis=0) / obj.mass
    if float(np.linalg.norm(off)) > KEPT * size:
        raise InvalidValueError(
            f"{obj!r}: the centre of mass of its parts lies {tuple(off.tolist())} m off its own, at {obj.position} m, so that momentum or "
            "angular momentum would change: move the parts, or say conserve=False"
        )
    given = (masses * kicks).sum(axis=0)
    if float(np.linalg.norm(given)) > KEPT * float((masses[:, 0] * np.linalg.norm(kicks, axis=1)).sum()):
        raise InvalidValueError(
            f"{obj!r}: the velocities of its parts, which add to its own motion, have the momentum {tuple(given.tolist())} kg m/s together: "
            "give some that cancel, or say conserve=False"
        )


def motion(obj: PhysicalObject, parts: Sequence[PhysicalObject], conserve: bool) -> Motion:
    """How ``parts`` leave: with the motion of ``obj`` as a rigid body where they are, and their own velocities on top.

    The common angular velocity is that with which they have the angular momentum of ``obj``; of true parts, whose inertia is that of the
    whole, it is that of ``obj``.

    Raises
    ------
    InvalidValueError
        If ``conserve``, and the parts cannot have that angular momentum, or their own velocities have some.
    """
    arms, masses = _arms(obj, parts), _column([part.mass for part in parts])
    kicks, twirls = _array(parts, "velocity"), _array(parts, "angular_velocity")
    own = [_tensor(part) for part in parts]
    around = sum(
        (float(m) * (float(r @ r) * np.eye(3) - np.outer(r, r)) for m, r in zip(masses[:, 0], arms, strict=True)),
        np.zeros((3, 3)),
    )
    tensor = around + sum(own, np.zeros((3, 3)))
    omega = np.array(obj.angular_velocity)
    whole = _tensor(obj) @ omega
    if conserve and whole.any():
        omega = np.linalg.lstsq(tensor, whole, rcond=KEPT)[0]
        _check_turning(obj, tensor @ omega - whole, float(np.linalg.norm(whole)))
    extra = np.cross(arms, masses * kicks) + np.array([t @ w for t, w in zip(own, twirls, strict=True)])
    if conserve:
        size = np.linalg.norm(arms, axis=1) * masses[:, 0] * np.linalg.norm(kicks, axis=1)
        spins = [float(np.linalg.norm(t @ w)) for t, w in zip(own, twirls, strict=True)]
        _check_turning(obj, extra.sum(axis=0), float(size.sum()) + math.fsum(spins))
    velocity = np.array(obj.velocity) + np.cross(omega, arms) + kicks
    spin = omega + twirls
    after = 0.5 * float((masses * velocity * velocity).sum()) + 0.5 * math.fsum(
        float(w @ t @ w) for t, w in zip(own, spin, strict=True)
    )
    v, w = np.array(obj.velocity), np.array(obj.angular_velocity)
    before = 0.5 * obj.mass * float(v @ v) + 0.5 * float(w @ _tensor(obj) @ w)
    return Motion(velocity, spin, after - before)


def _check_turning(obj: PhysicalObject, wrong: Array, size: float) -> None:
    if float(np.linalg.norm(wrong)) > KEPT * size:
        raise InvalidValueError(
            f"{obj!r}: its parts would have {tuple(wrong.tolist())} kg m^2/s more angular momentum than it has: "
            "give them inertia, or velocities that cancel, or say conserve=False"
        )


def split(
    world: World,
    engine: Any,
    obj: PhysicalObject,
    parts: Sequence[PhysicalObject],
    laws: Sequence[PhysicalLaw],
    here: tuple[float, float, float],
    conserve: bool,
) -> None:
    """Take ``obj``, for whose position ``here`` the parts were made, out and ``parts`` in, with the motion it has now."""
    for part in parts if obj.position != here else ():
        x, y, z = (p + now - then for p, now, then in zip(part.position, obj.position, here, strict=True))
        part.position = (x, y, z)
    found = motion(obj, parts, conserve)
    for part, velocity, spin in zip(parts, found.velocity.tolist(), found.spin.tolist(), strict=True):
        part.velocity = velocity
        part.angular_velocity = spin
    replace(world, engine, obj, parts, laws)
    world.add_work("split", found.gained)


def _array(objects: Sequence[PhysicalObject], name: str) -> Array:
    return np.array([getattr(one, name) for one in objects])


def _column(values: Sequence[float]) -> Array:
    found: Array = np.array(values)[:, None]
    return found


def _arms(obj: PhysicalObject, parts: Sequence[PhysicalObject]) -> Array:
    found: Array = _array(parts, "position") - np.array(obj.position)
    return found


def _tensor(obj: PhysicalObject) -> Array:
    """Inertia [kg m^2] about the centre, world frame, (3, 3)."""
    unit = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    axes = np.array([rotate(obj.orientation, axis) for axis in unit]).T
    found: Array = (axes * np.array(obj.inertia)) @ axes.T
    return found
