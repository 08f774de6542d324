"""ResponseLaw: what two touching, approaching objects do; what it may answer, and values that hold for one pair alone."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from xpheve.errors import InvalidValueError, LawDefinitionError, ParameterError
from xpheve.laws.conditions import Impact
from xpheve.laws.event import Contact, Event, Vec
from xpheve.laws.law import PhysicalLaw
from xpheve.laws.param import Column

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject

GROUPS = 32
"""How many collision groups there are, a bit each."""

ALL_GROUPS = float(2**GROUPS - 1)

Couple = frozenset["PhysicalObject"]


class Impulse:
    """An impulse [N s], world frame, on ``body_b`` of a contact, its opposite on ``body_a``: a response that takes the pair over.

    It acts at the contact point, and so turns bodies, unless the law answers bodies as points.
    """

    __slots__ = ("vector",)

    def __init__(self, vector: Iterable[float]) -> None:
        values = tuple(float(component) for component in vector)
        if len(values) != 3 or not all(map(math.isfinite, values)):
            raise InvalidValueError(f"Impulse({values!r}): three finite numbers [N s] are needed")
        self.vector: Vec = (values[0], values[1], values[2])


class Velocities:
    """Velocities [m/s], world frame, that ``body_a`` and ``body_b`` of a contact have afterwards: a response that takes the pair over.

    What is fixed, or driven by the host, keeps its own. Neither momentum nor energy need be kept; the work is booked.

    Parameters
    ----------
    a, b
        Velocity of ``body_a`` and of ``body_b``, shape (3,).

    Raises
    ------
    InvalidValueError
        If one is not three finite numbers.

    """

    __slots__ = ("a", "b")

    def __init__(self, a: Iterable[float], b: Iterable[float]) -> None:
        for name, given in (("a", a), ("b", b)):
            values = tuple(float(component) for component in given)
            if len(values) != 3 or not all(map(math.isfinite, values)):
                raise InvalidValueError(f"Velocities({name}={values!r}): three finite numbers [m/s] are needed")
            setattr(self, name, values)

    a: Vec
    b: Vec


class Grip(NamedTuple):
    """How two surfaces meet: what a law with friction says of a contact, so that contacts of one instant can be solved together.

    ``restitution`` is Newton's, from 0 to 1; ``friction`` Coulomb's coefficient, from 0 up, infinite where nothing slips; ``tangential`` the
    part of the slip that is reversed where the surfaces stick, from -1 (none of it is stopped) to 1.
    """

    restitution: float
    friction: float
    tangential: float = 0.0


class ResponseLaw(PhysicalLaw):
    """What two touching, approaching objects do; both must be mapped to the law.

    In a container that waits for contacts (`collision:exact`) the contact server asks `respond` at the exact instant; in one that
    finds contacts itself (`collision:bounding_box`, `collision:picking`) for those that it found.

    Every object has the columns ``group`` and ``mask``, whole numbers whose bits are groups, 32 in all: two objects meet only if each one's
    mask has a bit of the other's group. By default all are in the first group, and meet all.
    """

    role = "collision"
    condition = Impact()
    exclusive = frozenset({"contact-response"})
    lever_arms: ClassVar[bool] = True
    """Whether impulses act at the contact points, and so turn bodies; if not, bodies answer as points."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.columns = dict(cls.columns) | {name: column for name, column in FILTER.items() if name not in cls.columns}

    def __init__(self, *, name: str = "", enabled: bool = True, **parameters: Any) -> None:
        super().__init__(name=name, enabled=enabled, **parameters)
        self._pairs: dict[Couple, dict[str, Any]] = {}

    def respond(self, contact: Contact) -> float | Impulse | Velocities:
        """Speed [m/s], >= 0, at which the pair leaves along the normal; or an `Impulse` or `Velocities` that take it over."""
        raise LawDefinitionError(f"{type(self).__name__}: write respond(self, contact)")

    def grip(self, contact: Contact) -> Grip | None:
        """How the surfaces meet, for a law with friction; None, if `respond` says all there is.

        With it, the contact server solves all contacts of an instant together, at any number of points, friction included. `respond` then says
        what one contact point alone does, for those who ask one at a time: both must agree there.
        """
        return None

    # Values of single pairs

    @property
    def pair_values(self) -> Mapping[Couple, Mapping[str, Any]]:
        """What was set for pairs of objects alone, by pair."""
        return MappingProxyType(self._pairs)

    def set_pair(self, a: PhysicalObject, b: PhysicalObject, **values: Any) -> None:
        """Let parameters have other ``values`` for the pair of ``a`` and ``b``, either way round, from this instant on.

        They hold whatever the objects' own columns of that name say. Values given before stay unless given again; None takes one back.

        Raises
        ------
        ParameterError
            If a parameter is unknown or the value does not fit its declaration.
        InvalidValueError
            If the objects are one, or not both mapped to the law.
        """
        self._check_couple(a, b)
        for name in values:
            if name not in self.params or name == "resting":
                known = ", ".join(key for key in self.params if key != "resting")
                raise ParameterError(f"{self.label()} has no parameter {name!r} for a pair; it has: {known or 'none'}")
        given = dict(self._pairs.get(frozenset((a, b)), {}))
        for name, value in values.items():
            if value is None:
                given.pop(name, None)
            else:
                given[name] = self.params[name].check(value, self.label())
        pairs = {couple: held for couple, held in self._pairs.items() if couple != frozenset((a, b))}
        if given:
            pairs[frozenset((a, b))] = given
        if self.engine is None:
            self.put_pairs(pairs)
        else:
            self.engine.set_pairs(self, pairs)

    def put_pairs(self, pairs: dict[Couple, dict[str, Any]]) -> None:
        """For the engine: let ``pairs``, checked already, be the values of pairs at this instant."""
        old, self._pairs = self._pairs, pairs
        if self.engine is not None and old != pairs:
            self.engine.law_changed(self, "_pairs", old)

    def forget_object(self, obj: PhysicalObject) -> None:
        """For the engine: ``obj`` obeys the law no longer, so that its pairs have no values."""
        if any(obj in couple for couple in self._pairs):
            self._pairs = {couple: held for couple, held in self._pairs.items() if obj not in couple}

    def _check_couple(self, a: PhysicalObject, b: PhysicalObject) -> None:
        from xpheve.objects import PhysicalObject

        for obj in (a, b):
            if not isinstance(obj, PhysicalObject):
                raise InvalidValueError(f"{self.label()}.set_pair: {obj!r} is no object: give two objects, then values")
            if obj not in self.objects:
                raise InvalidValueError(
                    f"{self.label()}.set_pair: {obj!r} is not mapped to {self!r}: map both objects first, with engine.map"
                )
        if a is b:
            raise InvalidValueError(
                f"{self.label()}.set_pair: {a!r} and itself are no pair: give two different objects"
            )

    def asked(self, contact: Contact) -> tuple[ResponseLaw, Contact]:
        """The law and the contact as they are asked: with the values of the pair, if it has any, in place of all others."""
        given = self._pairs.get(frozenset((contact.body_a, contact.body_b))) if self._pairs else None
        if not given:
            return self, contact
        twin: ResponseLaw = object.__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin.__dict__["parameters"] = self.parameters | given
        without: Any = (_Without(contact.body_a, given), _Without(contact.body_b, given))
        return twin, replace(contact, body_a=without[0], body_b=without[1])

    def enforce_this_law(self, event: Event) -> None:
        """Answer the contacts that a polled container found. The contact server asks `respond` directly, and does not come here."""
        if self.engine is not None:
            self.engine.answer_contacts(self, event.contacts)

    @classmethod
    def is_concrete(cls) -> bool:
        return cls.respond is not ResponseLaw.respond


class _Without:
    """An object as a law sees it that has values for its pair: without columns of its own by the same names."""

    def __init__(self, obj: PhysicalObject, given: Mapping[str, Any]) -> None:
        self._obj, self._given = obj, given

    def __getattr__(self, name: str) -> Any:
        return getattr(self._obj, name)

    def __getitem__(self, name: str) -> float:
        return math.nan if name in self._given else self._obj[name]

    def __repr__(self) -> str:
        return repr(self._obj)


FILTER: dict[str, Column] = {
    "group": Column(1.0, ge=0, le=ALL_GROUPS, whole=True, doc="Collision groups the object is in, a bit each."),
    "mask": Column(ALL_GROUPS, ge=0, le=ALL_GROUPS, whole=True, doc="Collision groups the object meets, a bit each."),
}
"""Columns of all objects under response laws."""


def meets(a: PhysicalObject, b: PhysicalObject) -> bool:
    """Whether the groups of two objects let them meet."""
    one, two = a._columns, b._columns
    if not one and not two:
        return True
    return bool(
        int(one.get("group", 1.0)) & int(two.get("mask", ALL_GROUPS))
        and int(two.get("group", 1.0)) & int(one.get("mask", ALL_GROUPS))
    )


__all__ = ["Grip", "Impulse", "ResponseLaw", "Velocities", "meets"]
