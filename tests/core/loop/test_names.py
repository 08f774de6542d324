"""Columns and parameters may be called what they like: loops have names of their own."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp
from xpheve.loop.terms import CHANGING, MOMENTS, TURNING
from xpheve.plan import tiers

LOOPS_OWN = sorted({
    *CHANGING, *TURNING, *MOMENTS, "stored", "stored_working", "inverse_mass", "middle", "middle_velocity", "middle_spin", "pull", "push",
    "pull_working", "force", "x", "s", "p", "k", "now", "math", "z", "a",
} - {"position", "velocity", "orientation", "angular_velocity"})  # fmt: skip
"""What loops, and the engine's rows, call things of theirs."""


def law_of(column: str, pair: bool) -> type[xp.FieldLaw] | type[xp.PairLaw]:
    """A law whose only column is called ``column``, and its only parameter alike if it may be."""

    def pull(self: Any, body: Any) -> Any:
        return -self.stiffness * getattr(body, column) * (body.position + self.age * body.velocity)

    def between(self: Any, a: Any, b: Any) -> Any:
        gap = (a.position - b.position) + self.age * (a.velocity - b.velocity)
        return -self.stiffness * getattr(a, column) * getattr(b, column) * gap

    body: dict[str, Any] = {"id": "names:law", "force": between if pair else pull}
    body |= {"columns": {column: xp.Column(0.5, doc="Share.")}, "stiffness": xp.Param(2.0, unit="N/m")}
    body |= {"age": xp.Constant(0.3, unit="s")}
    return type("Named", (xp.PairLaw if pair else xp.FieldLaw,), body)


def ends(column: str, pair: bool) -> list[tuple[float, ...]]:
    """Where three objects are in the end, and the work on them."""
    engine = xp.PhysicsEngine(compile="never")
    law = engine.add_law(law_of(column, pair))
    for k in range(3):
        given: dict[str, Any] = {column: 0.25 * k + 0.5}
        thing = xp.PhysicalObject(
            shape=xp.Box((1, 2, 3)), density=0.5, position=(k, 1, k * k), velocity=(1, 0, k), **given
        )
        thing.angular_velocity = (1.0, 0.2, k)
        engine.add_object(thing, laws=[law])
        thing.add_force((0.1, 0.0, 0.0))
    engine.run(until=1.0, dt=0.125)
    energy = engine.energy()
    return [(*thing.position, *thing.velocity) for thing in engine.objects] + [(energy.kinetic, energy.work)]


@pytest.mark.parametrize("few", [10**6, 0], ids=["interpreted", "numpy"])
@pytest.mark.parametrize("pair", [False, True], ids=["field", "pair"])
def test_a_column_may_be_called_as_something_in_the_loop_is(
    pair: bool, few: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tiers, "FEW", few)
    plain = ends("portion", pair)
    for column in LOOPS_OWN:
        assert ends(column, pair) == plain, column
