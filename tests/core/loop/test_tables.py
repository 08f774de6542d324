"""Tables in loops: the same bits in all tiers, and numbers that are no part of the text."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve import Table

HEIGHTS = (0.0, 0.4, 1.1, 2.5, 6.0)
DENSITIES = (1.2, 0.9, 0.7, 0.2, 0.1)


class Air(xp.FieldLaw):
    """Drag that thins out with height, in gusts."""

    density = Table(HEIGHTS, DENSITIES, unit_x="m", unit="kg/m", kind="cubic", outside="hold")
    gust = Table((0.0, 0.3, 0.6, 2.0), (0.0, 1.0, -0.5, 0.0), unit_x="s", unit="m/s", outside="hold")

    def force(self, body: Any) -> Any:
        """F = -rho |v - g(t) x| (v - g(t) x) [N]."""
        rush = body.velocity - self.gust(body.time) * np.array((1.0, 0.0, 0.0))
        return -self.density(body.position.z) * rush.norm() * rush


class Thick(xp.FieldLaw):
    """Drag by a table of the same shape, with other numbers."""

    density = Table(
        HEIGHTS, tuple(2.0 * one for one in DENSITIES), unit_x="m", unit="kg/m", kind="cubic", outside="hold"
    )
    gust = Air.gust

    def force(self, body: Any) -> Any:
        """As `Air`."""
        rush = body.velocity - self.gust(body.time) * np.array((1.0, 0.0, 0.0))
        return -self.density(body.position.z) * rush.norm() * rush


class Rope(xp.PairLaw):
    """A pull that a table gives."""

    pull = Table((0.0, 1.0, 2.0, 3.0), (0.0, 0.0, 3.0, 4.0), unit_x="m", unit="N", outside="extend")

    def force(self, a: Any, b: Any) -> Any:
        """f(d) along d [N]."""
        gap = b.position - a.position
        return self.pull(gap.norm()) / gap.norm() * gap


def flown(laws: list[type[Any]], count: int, wish: str) -> tuple[Any, set[str], Any]:
    """States of ``count`` bodies under ``laws`` after a second, the tiers that ran, and the engine."""
    engine = xp.PhysicsEngine(up="z")
    engine._world.compile = wish
    mapped = [engine.add_law(law) for law in laws]
    bodies = [
        engine.add_object(
            xp.PhysicalObject(mass=1.0 + 0.2 * k, position=(0.7 * k, 0.1 * k, 0.3 * k), velocity=(3.0, 0.2 * k, 4.0)),
            laws=mapped,
        )
        for k in range(count)
    ]
    engine.run(until=1.0, dt=1 / 64)
    return np.array([[*b.position, *b.velocity] for b in bodies]), set(engine._world.tiers.values()), engine


@pytest.mark.parametrize("laws", [[Air], [Rope], [Air, Rope]])
@pytest.mark.parametrize(("count", "tier"), [(4, "interpreted"), (11, "numpy")])
def test_tables_give_the_same_bits_in_all_tiers(laws: list[type[Any]], count: int, tier: str) -> None:
    if laws == [Air]:
        count += 10 if tier == "numpy" else 0
    compiled, compiled_tier, _ = flown(laws, count, "always")
    other, other_tier, _ = flown(laws, count, "never")
    assert (compiled_tier, other_tier) == ({"compiled"}, {tier})
    assert (compiled == other).all()
    assert np.isfinite(compiled).all()


def text_of(engine: Any) -> str:
    """The text of the one loop of ``engine``."""
    (batch,) = [one for one in engine._world.batches if one.state.count]
    found: str = batch.sources.program.text(arrays=False)
    return found


def test_other_numbers_in_a_table_are_no_other_text() -> None:
    thin, _, one = flown([Air], 3, "never")
    thick, _, other = flown([Thick], 3, "never")
    assert text_of(one) == text_of(other)
    assert (thin != thick).any()
