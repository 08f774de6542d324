"""Replay: run between the instants of the inputs, and give each in again."""

from __future__ import annotations

import itertools
from typing import Any

from xpheve.errors import InvalidValueError, RecordError, StateError
from xpheve.kernels.clock import Instant
from xpheve.laws import conditions as when
from xpheve.realtime.encode import Decoder
from xpheve.realtime.inputs import Input, Inputs, kinds_of
from xpheve.steppers.contract import Settings


def replay(engine: Any, inputs: Inputs, until: float | None, classes: tuple[type[Any], ...]) -> None:
    """Carry ``engine`` through ``inputs``."""
    if not isinstance(inputs, Inputs):
        raise InvalidValueError(f"inputs = {inputs!r}: give engine.inputs, or Inputs.load(path)")
    world = engine._world
    if world.time != tuple(inputs.begin):
        raise StateError(
            f"the inputs begin at t = {inputs.begin[0]} s and the scene stands at {engine.time} s: "
            "replay them on a copy of the scene as it was when start() was called"
        )
    end = inputs.end if until is None else (float(until), 0.0)
    engine._begin(Settings(*inputs.settings))
    engine._state, engine._running = "running", True
    try:
        for _, group in itertools.groupby((one for one in inputs if one.instant <= end), key=lambda one: one.group):
            _give(engine, list(group), classes)
            if engine._state == "terminated":
                return
        if engine._state == "running" and (inputs.passed or end > engine._world.time):
            engine._pass_time(max(end, engine._world.time))
    finally:
        engine._running = False
        if engine._state == "running":
            engine._state = "ready"


def _give(engine: Any, group: list[Input], classes: tuple[type[Any], ...]) -> None:
    """To the instant of ``group``, and its inputs."""
    world = engine._world
    if engine._state == "running":
        try:
            engine._pass_time(max(group[0].instant, world.time))
        except Exception as error:
            if not any(_is_told(one, error, world.time) for one in group):
                raise
    for one in group:
        if one.door == "failed":
            engine._state = "suspended"
        elif one.door == "resume":
            engine._state = "running"
        elif one.door in ("Paused", "Resumed"):
            world.wakeups.tell_now(getattr(when, one.door))
        else:
            _do(engine, one, classes)


def _is_told(one: Input, error: Exception, now: Instant) -> bool:
    """Whether ``one`` says that this very failure stopped the run: of the same kind, at the same instant."""
    return one.door == "failed" and tuple(one.instant) == now and dict(one.options).get("error") == kinds_of(error)


def _do(engine: Any, one: Input, classes: tuple[type[Any], ...]) -> None:
    if not getattr(getattr(type(engine), one.door, None), "is_door", False):
        raise RecordError(f"the inputs call {one.door!r}, which is no door of this engine")
    back = Decoder(engine, classes)
    getattr(engine, one.door)(*map(back, one.arguments), **{name: back(value) for name, value in one.options})


__all__ = ["replay"]
