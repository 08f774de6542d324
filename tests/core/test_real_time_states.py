"""Each cell of the table of states and commands; and the page that is made from it."""

from __future__ import annotations

import contextlib
import importlib.util
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
import xpheve.realtime
from xpheve.errors import StateError
from xpheve.realtime.states import STATES, TABLE, state_of

DOCS = Path(__file__).parents[2] / "docs"


class Act(xp.PhysicalLaw):
    """Do what the test wants, in a handler."""

    act: Callable[[], None] = staticmethod(lambda: None)  # type: ignore[assignment]

    def enforce_this_law(self, event: Any) -> None:
        """Do it."""
        self.act()


def engine_with(act: Callable[[], None] | None = None) -> tuple[xp.PhysicsEngine, Act]:
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    law = Act()
    if act is not None:
        law.act = act  # type: ignore[method-assign]
    engine.add_law(law, container=xp.LawContainer(xp.when.Elapsed(0.01)))
    return engine, law


def give(engine: xp.PhysicsEngine, command: str) -> Any:
    arguments: dict[str, tuple[Any, ...]] = {"run": (99.0,), "step": (0.1,), "replay": (None,), "wait": (None, 0.01)}
    if command == "replay":
        return engine.replay(xp.realtime.Inputs((), engine._world.time, (engine.time + 1.0, 0.0)))
    return getattr(engine, command)(*arguments.get(command, ()))


def bring(state: str) -> xp.PhysicsEngine:
    """An engine in ``state``; not for "running"."""

    def fail() -> None:
        raise ValueError("on purpose")

    engine, _ = engine_with(fail if state == "failed" else None)
    if state in ("started", "paused"):
        engine.start(frames=1)  # the host's frames: none comes
    if state == "failed":
        engine.start(frames=1)
        time.sleep(0.02)
        engine.frame_passed()
        with pytest.raises(xp.errors.LawFailedError, match="on purpose"):
            engine.wait(timeout=10)
    if state in ("suspended", "paused"):
        engine.suspend()
    if state == "terminated":
        engine.terminate()
    assert state_of(engine) == state
    return engine


# By hand, from figures 3-4 and 3-8 and docs/decisions/0012: the state afterwards, or "-" where the command is refused.
EXPECTED = """
              ready       running     started     suspended   paused      failed      terminated
start         started     -           -           -           -           -           -
run           ready       -           -           -           -           -           -
step          ready       -           -           -           -           -           -
replay        ready       -           -           -           -           -           -
suspend       suspended   suspended   paused      -           -           -           -
resume        -           -           -           ready       started     started     -
terminate     terminated  terminated  terminated  terminated  terminated  terminated  terminated
reset         ready       -           -           ready       ready       ready       ready
wait          -           -           started     -           paused      failed      terminated
frame_passed  -           -           started     -           paused      failed      -
"""
COLUMNS, *ROWS = (line.split() for line in EXPECTED.strip().splitlines())
AFTER = {(row[0], state): after.replace("-", "") for row in ROWS for state, after in zip(COLUMNS, row[1:], strict=True)}
CELLS = list(AFTER)


def test_the_table_has_every_cell() -> None:
    assert all(list(row) == list(STATES) for row in TABLE.values())
    assert {(command, state): cell.after for command, row in TABLE.items() for state, cell in row.items()} == AFTER


@pytest.mark.parametrize(("command", "state"), [cell for cell in CELLS if cell[1] != "running"])
def test_a_command_does_what_its_cell_says(command: str, state: str) -> None:
    engine, after, says = bring(state), AFTER[command, state], TABLE[command][state].says
    try:
        if after and (command, state) != ("wait", "failed"):
            give(engine, command)
            assert state_of(engine) == after
        elif after:
            with pytest.raises(xp.errors.LawFailedError, match="on purpose"):
                give(engine, command)
        else:
            with pytest.raises(StateError) as refused:
                give(engine, command)
            assert says in str(refused.value) and command in str(refused.value)
            assert state_of(engine) == state
    finally:
        with contextlib.suppress(xp.errors.LawFailedError):
            engine.terminate()
        engine._trouble.clear()


@pytest.mark.parametrize("command", list(TABLE))
def test_a_command_in_a_handler_of_a_run_does_what_its_cell_says(command: str) -> None:
    found: list[Any] = []

    def act() -> None:
        try:
            give(engine, command)
        except StateError as error:
            found.append(error)

    engine, _ = engine_with(act)
    engine.run(until=0.02)
    after = AFTER[command, "running"]
    if after:
        assert not found and engine.state == after and engine.time == 0.01
    else:
        assert TABLE[command]["running"].says in str(found[0]) and engine.time == 0.02


@pytest.mark.parametrize(("command", "state"), [("suspend", "suspended"), ("terminate", "terminated")])
def test_a_handler_in_real_time_stops_the_engine_at_its_instant(command: str, state: str) -> None:
    engine, _ = engine_with(lambda: getattr(engine, command)())
    engine.start()
    assert engine.wait(timeout=10)
    assert engine.state == state and engine.time == 0.01 and engine.objects[0].position == (0.01, 0, 0)
    engine.terminate()


def test_the_page_of_states_is_fresh() -> None:
    spec = importlib.util.spec_from_file_location("make_states_page", DOCS / "make_states_page.py")
    assert spec is not None and spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    written = (DOCS / "real_time_states.md").read_text(encoding="utf-8")
    assert written == maker.page(), "run: python docs/make_states_page.py"
