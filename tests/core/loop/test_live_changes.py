"""What is changed between two runs takes effect in loops that stand."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp
from xpheve.plan import tiers


class Near(xp.PairLaw):
    """Bodies that are near push each other away."""

    id = "live:near"
    push = xp.Param(0.5, unit="N", ge=0)
    cutoff = xp.Param(1.2, unit="m", gt=0)

    def force(self, a: Any, b: Any) -> Any:
        """Force [N] on ``a``."""
        gap = a.position - b.position
        return self.push * (gap / gap.norm())


@pytest.mark.parametrize("few", [10**6, 0], ids=["interpreted", "numpy"])
def test_a_cutoff_that_grows_reaches_farther_at_once(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "FEW", few)
    engine = xp.PhysicsEngine(compile="never")
    law = engine.add_law(Near)
    row = engine.add_objects([xp.PhysicalObject(position=(2.0 * k, 0, 0), mass=1.0) for k in range(2)], laws=[law])
    engine.run(until=1.0, dt=0.125)
    assert row[1].velocity == (0.0, 0.0, 0.0)
    law.cutoff = 9.0  # nobody has moved: a list of neighbours that was made for 1.2 m must not serve on
    engine.run(until=2.0, dt=0.125)
    assert abs(row[1].velocity[0] - 0.5) < 1e-12
    law.cutoff = 1.2
    engine.run(until=3.0, dt=0.125)
    assert abs(row[1].velocity[0] - 0.5) < 1e-12
