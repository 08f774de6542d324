"""Expressions as text: what can be said, and that nothing else is run; in scene files, checkpoints and logs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import DimensionError, InvalidValueError, TraceError
from xpheve.laws.conditions.text import FUNCTIONS, TextExpression
from xpheve.trace.expression_trace import trace_expression

when = xp.when


class Diary(xp.PhysicalLaw):
    """Write down when it was told."""

    id = "mine:diary"

    def enforce_this_law(self, event: Any) -> None:
        self.state["times"] = [*self.state.get("times", []), event.time]


def told(engine: xp.PhysicsEngine) -> list[float]:
    """Return when the diary was told."""
    return list(engine.laws[0].state["times"])


def thrown(expression: Any) -> xp.PhysicsEngine:
    """Return a scene in which a point is thrown upwards."""
    engine = xp.PhysicsEngine(up="z")
    diary = engine.add_law(Diary(), container=xp.LawContainer(when.Crosses(expression)))
    body = engine.add_object(xp.PhysicalObject(velocity=(0, 0, 6.0)), laws=[diary])
    body.add_force((0, 0, -10.0))
    return engine


SAME: list[tuple[str, Any]] = [
    ("body.position.z - 2.0", lambda b: b.position.z - 2.0),
    ("-body.velocity.norm() * 3 + 2 * pi", lambda b: -b.velocity.norm() * 3.0 + 2.0 * np.pi),
    ("body.position.dot((0, 1, -0.5)) ** 2 / body.mass", lambda b: b.position.dot((0.0, 1.0, -0.5)) ** 2.0 / b.mass),
    ("where(body.position.x > 1, sin(body.time), sqrt(body.charge))", lambda b: np.where(b.position.x > 1.0, np.sin(b.time), np.sqrt(b.charge))),
    ("body.to_world((1, 0, 0)).cross(body.up).x", lambda b: b.to_world((1.0, 0.0, 0.0)).cross(b.up).x),
]  # fmt: skip


@pytest.mark.parametrize(("text", "function"), SAME)
def test_a_text_is_read_as_the_function_that_it_says(text: str, function: Any) -> None:
    one, other = trace_expression(TextExpression(text)), trace_expression(function)
    assert one.arrays.text == other.arrays.text and one.dimension == other.dimension


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("__import__('os').system('true')", "cannot be said"),
        ("body.__class__", "cannot be said"),
        ("body.position._recording", "cannot be said"),
        ("body.position.z.recording", "cannot be said"),
        ("body.norm", "cannot be said"),
        ("body", "cannot be said"),
        ("body.position[0]", "cannot be said"),
        ("(lambda: 1)()", "cannot be said"),
        ("[x for x in (1, 2, 3)]", "cannot be said"),
        ("sin", "cannot be said"),
        ("sin(*(1, 2, 3))", "cannot be said"),
        ("sin(x=1)", "cannot be said"),
        ("'a' * 3", "cannot be said"),
        ("True", "cannot be said"),
        ("1 if body.mass else 2", "cannot be said"),
        ("f'{body}'", "cannot be said"),
        ("(y := 2)", "cannot be said"),
        ("body.mass @ body.mass", "cannot be said"),
        ("open('x')", "cannot be said"),
        ("1 " + "+ 1 " * 200, "characters"),
        ("-" * 400 + "1", "50 deep"),
        ("(" * 240 + "1" + ")" * 240, "no expression"),
        ("body.position.z -", "no expression"),
        ("", "no expression"),
        ("x\0y", "no expression"),
        ("1" + "0" * 400, "cannot be said"),
    ],
)
def test_nothing_else_can_be_said(text: str, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        when.Crosses(text)


def test_numbers_are_floats_so_that_no_power_runs_for_ever() -> None:
    with pytest.raises(TraceError, match="OverflowError"):
        thrown("9 ** 9 ** 9 ** 9 - body.time")
    with pytest.raises(DimensionError, match=r"'body\.position\.z - body\.time'.* subtracts m and s"):
        thrown("body.position.z - body.time")


def test_every_function_that_can_be_said_can_be_read() -> None:
    counts = {"where": 3, "arctan2": 2, "hypot": 2, "minimum": 2, "maximum": 2}
    for name in FUNCTIONS:
        arguments = ", ".join(["0.1 * body.mass"] * counts.get(name, 1))
        assert trace_expression(TextExpression(f"{name}({arguments})")).reads == {"mass"}


def test_a_text_goes_into_scene_files_checkpoints_and_copies(tmp_path: Path) -> None:
    text = "body.position.z - 1.0"
    engine, same = thrown(text), thrown(lambda body: body.position.z - 1.0)
    assert str(when.Crosses(text)) == "Crosses('body.position.z - 1.0')" and when.Crosses(text) == when.Crosses(text)
    engine.run(until=0.5)
    others = [engine.copy(), xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Diary])]
    for one in (engine, same, *others):
        one.run(until=3.0)
        assert told(one) == [0.2, 1.0]


def test_a_scene_file_says_it_and_is_written_again(tmp_path: Path) -> None:
    engine = xp.PhysicsEngine(up="z")
    engine.add_container(xp.LawContainer(when.Posted() | when.Crosses("body.position.z - 1.0", direction=-1), name="c"))
    engine.save_scene(tmp_path / "scene.toml")
    assert 'expression = "body.position.z - 1.0"' in (tmp_path / "scene.toml").read_text()
    again = xp.PhysicsEngine.load_scene(tmp_path / "scene.toml")
    assert again.containers[0].condition == engine.containers[0].condition


def test_a_text_that_is_added_while_a_log_is_kept_is_replayed() -> None:
    engine = xp.PhysicsEngine(up="z")
    body = engine.add_object(xp.PhysicalObject(velocity=(0, 0, 6.0), name="ball"))
    first = engine.copy()
    engine.start()
    container = engine.add_container(xp.LawContainer(when.Crosses("body.position.z - 1e6"), name="c"))
    engine.terminate()
    first.replay(engine.inputs)
    assert body in engine.objects and container in engine.containers
    held = first.containers[0]
    assert held.name == "c" and held.condition == when.Crosses("body.position.z - 1e6")
