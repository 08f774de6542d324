"""A plan's look at many objects: what does not differ between objects of the same laws is found once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.laws import ContinuousLaw, PairLaw
from xpheve.plan.contacts_wanted import needs_parabolas, waits_for_contacts
from xpheve.plan.groups import signature_of
from xpheve.plan.hand_kernels import formula_of
from xpheve.plan.stiffness import may_decay

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xpheve.objects import PhysicalObject
    from xpheve.plan.world import World
    from xpheve.steppers.contract import Signature

Key = tuple[Any, ...]


class Looks:
    """The signatures of groups in one plan of ``world``.

    Attributes
    ----------
    found
        The objects of each signature, in the order they were taken.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.found: dict[Signature, list[PhysicalObject]] = {}
        self._levels: dict[PairLaw, int] = {}
        self._alike: dict[Key, list[PhysicalObject]] = {}
        """Where objects go that have the same laws, and the same in all else that counts."""
        self._sets: dict[Key, _Laws] = {}
        bodies, n = world.bodies, world.bodies.count
        inertia, torque, force = (bodies.arrays[name][:, :n].any(axis=0) for name in ("inertia", "torque", "force"))
        # A torque is looked at in each object that has one.
        self._kinds: list[int] = (inertia + 2 * force + 4 * (torque | bodies.driven[:n])).tolist()

    def take(self, group: Sequence[PhysicalObject]) -> list[PhysicalObject]:
        """Find the signature of ``group``; returns the objects that have it."""
        objects = self.found.setdefault(signature_of(self.world, group, self._levels), [])
        objects.extend(group)
        return objects

    def take_alone(self, obj: PhysicalObject) -> bool:
        """Take ``obj``, if it surely is a group of its own and does not differ but by its state from others of its laws; whether that was done."""
        laws = self.world.mapping.laws(obj)
        kind = self._kinds[obj._row]
        if kind >= 4:
            return False
        key = tuple(laws)
        known = self._sets.get(key)
        if known is None:
            known = self._sets[key] = _Laws(self.world, key)
        sides: Key = ()
        if known.sided:
            sides = tuple([law.side_of(obj) for law in known.sided])
            if any(side != 2 for side in sides):
                return False
        if not known.alone:
            return False
        parabolas = known.waits and needs_parabolas(self.world, [obj])
        at = (
            known,
            kind,
            parabolas,
            known.waits and self.world.contacts is not None and self.world.contacts.flies(obj),
        )
        objects = self._alike.get(at)
        if objects is None:
            self._alike[at] = self.take([obj])
        else:
            objects.append(obj)
        return True


class _Laws:
    """What is so of all objects that obey ``laws``.

    Attributes
    ----------
    sided
        The one-sided laws among them.
    alone
        Whether none joins its objects with others, if they are but targets of one-sided ones, and none is of a kind that must be looked at in
        each object.
    waits
        Whether one waits for contacts.
    """

    def __init__(self, world: World, laws: Key) -> None:
        self.sided = [law for law in laws if isinstance(law, PairLaw) and law.one_sided]
        self.alone = not any(isinstance(law, PairLaw) and not law.one_sided for law in laws)
        self.waits = any(map(waits_for_contacts, laws))
        if self.alone and world.settings.dt is None:  # whether that is stiff depends on the state
            self.alone = not may_decay([formula_of(law) for law in _continuous(world, laws)])


def _continuous(world: World, laws: Key) -> list[Any]:
    """Those of ``laws`` that may be evaluated along the way."""
    return [
        law
        for law in laws
        if isinstance(law, ContinuousLaw) and law not in world.constant and (law.enabled or world.is_switched(law))
    ]
