"""A pack of toys, so that scenes are tested without the packs that ship."""

from __future__ import annotations

from types import ModuleType
from typing import Any, ClassVar

import pytest

from xpheve.errors import InvalidValueError
from xpheve.laws import Column, Constant, Event, FieldLaw, LawContainer, PairLaw, Param, PhysicalLaw
from xpheve.laws.conditions import Condition, Elapsed, Started
from xpheve.plugins import Registry
from xpheve.shapes import Shape


class Wind(FieldLaw):
    """Wind that pushes evenly."""

    id = "toy:wind"
    role = "wind"
    push = Param((1.0, 0.0, 0.0), unit="N", doc="Push.")
    strength = Param(1.0, ge=0, doc="Factor.")
    limit = Param(2.0, optional=True, unit="m")
    mode = Param("soft", choices=("soft", "hard"))
    gusty = Param(False)

    def force(self, body: Any) -> Any:
        return tuple(self.strength * x for x in self.push)


class Charged(FieldLaw):
    """A force on charges."""

    id = "toy:charged"
    columns: ClassVar[dict[str, Column]] = {"charge": Column(0.0, unit="C", ge=-1.0)}

    field = Constant(1.0, unit="N/C")

    def force(self, body: Any) -> Any:
        return self.field * body.charge * body.up


class Pull(PairLaw):
    """A pull between two."""

    id = "toy:pull"
    k = Param(1.0, unit="N/m", ge=0)

    def force(self, a: Any, b: Any) -> Any:
        return -self.k * (a.position - b.position)


class Tick(PhysicalLaw):
    """Does something each second."""

    id = "toy:tick"
    role = "clock"
    condition: ClassVar[Condition | None] = Elapsed(1.0, every=True)

    def enforce_this_law(self, event: Event) -> None:
        return None


class Idle(PhysicalLaw):
    """Says nothing of when."""

    id = "toy:idle"

    def enforce_this_law(self, event: Event) -> None:
        return None


class Clumsy(FieldLaw):
    """Its constructor fails."""

    id = "toy:clumsy"

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        raise ZeroDivisionError("oh no")

    def force(self, body: Any) -> Any:
        return (0.0, 0.0, 0.0)


class AtStart(LawContainer):
    """Its laws act at the start."""

    id = "toy:at_start"
    condition = Started()


class Gears(LawContainer):
    """Takes clocks only."""

    id = "toy:gears"
    condition = Started()
    accepts_role = "clock"


class Ring(Shape):
    """A ring."""

    id: ClassVar[str] = "toy:ring"
    kind: ClassVar[str] = "ring"
    __slots__ = ("radius",)

    def __init__(self, radius: float) -> None:
        if not radius > 0:
            raise InvalidValueError(f"Ring.radius = {radius}: a length above 0 is needed")
        self.radius = float(radius)

    @property
    def volume(self) -> float:
        return self.radius

    @property
    def reach(self) -> float:
        return self.radius

    def inertia(self, mass: float) -> tuple[float, float, float]:
        return mass, mass, 2 * mass

    def describe(self) -> dict[str, Any]:
        return {"kind": self.kind, "radius": self.radius}


def toy_pack() -> ModuleType:
    """The toys as a module, the way a pack offers them."""
    pack = ModuleType("toy")
    things = (Wind, Charged, Pull, Tick, Idle, Clumsy, AtStart, Gears, Ring)
    for thing in things:
        setattr(pack, thing.__name__, thing)
    pack.__all__ = [thing.__name__ for thing in things]  # type: ignore[attr-defined]
    return pack


@pytest.fixture(scope="session")
def registry() -> Registry:
    """The installed packs, and the toys."""
    found = Registry(environment={})
    found.register(toy_pack(), "toy")
    return found
