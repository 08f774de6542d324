"""How often Python calls a loop, and what one loop holds: laws of several packs in one text."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest

import xpheve as xp
from xpheve.compile.kernel import Compiled, Interpreted
from xpheve.loop.program import COMPILED, INTERPRETED


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache of compiled loops of its own."""
    home = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(home))
        yield home


class Drag(xp.FieldLaw):
    """Drag as a stranger writes it."""

    id = "stranger:drag"
    columns: ClassVar[dict[str, Any]] = {"drag_constant": xp.Column(unit="kg/m", doc="F / v^2.")}

    def force(self, body: Any) -> Any:
        """Drag [N]."""
        return -body.drag_constant * body.velocity.norm() * body.velocity


def air(count: int, compile: str) -> xp.PhysicsEngine:
    """Gravity and wind of a pack, drag of a stranger, springs between neighbours."""
    engine = xp.PhysicsEngine(up="z", compile=compile)
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("basic:wind"), engine.add_law(Drag)]
    objects = [
        xp.PhysicalObject(position=(k, 0.0, 0.0), velocity=(1.0, 0.1 * k, 2.0), drag_area=0.1, drag_constant=0.02)
        for k in range(count)
    ]
    engine.add_objects(objects, laws=laws)
    engine.add_law("basic:spring", pairs=list(itertools.pairwise(objects)), rest_length=1.0)
    return engine


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was called, kernel by kernel."""
    found: list[str] = []
    for kind in (Compiled, Interpreted):

        def counted(self: Any, floats: Any, ints: Any, plain: Any = kind.__call__) -> int:
            found.append(self.origin)
            return int(plain(self, floats, ints))

        monkeypatch.setattr(kind, "__call__", counted)
    return found


@pytest.mark.parametrize(("compile", "count", "steps", "most"), [("always", 40, 10_000, 2), ("never", 4, 1_000, 2)])
def test_python_calls_a_loop_once_for_very_many_steps(
    compile: str, count: int, steps: int, most: int, calls: list[str]
) -> None:
    engine = air(count, compile)
    engine.run(2.0 * steps * 2.0**-10, dt=2.0**-9)
    assert set(engine._world.tiers.values()) == {COMPILED if compile == "always" else INTERPRETED}
    assert 1 <= len(calls) <= most
    assert engine.explain().data["groups"][0]["steps"] == steps


def test_who_looks_calls_once_a_look_and_not_once_a_step(calls: list[str]) -> None:
    engine = air(40, "always")
    engine.run(4.0, dt=2.0**-9, every=0.5)
    assert 8 <= len(calls) <= 2 * 8 + 2


def test_laws_of_several_packs_are_one_text_and_one_kernel(calls: list[str]) -> None:
    engine = air(40, "always")
    engine.run(0.5, dt=2.0**-9)
    world = engine._world
    found = [world.sources(batch).program for batch in world.batches if batch.state.count]  # type: ignore[union-attr]
    assert len(found) == 1 and found[0] is not None
    assert {term.trace.label for term in found[0].terms} == {"stranger:drag", "basic:wind", "basic:spring"}
    kernel: Any = found[0].made(COMPILED)
    assert kernel.what.split(" + ") == [term.trace.label for term in found[0].terms]
    assert found[0].text(arrays=False).count("def entry(") == 1
    assert len(calls) == 1
