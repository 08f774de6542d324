"""xPheve on a scene of smooth motion: one contender a setting."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.smooth.problem import End, Ours, Problem
from benchmarks.turns import Contender, row

NAME = "xPheve"
BEGUN = 2.0**-40  # of the span
"""Each engine runs so far before its time is taken: then its loops are linked, which belongs to the plan, and at most one step is made.

``run(a); run(b)`` ends in the same bits as ``run(b)``.
"""


def contenders(problem: Problem) -> list[Contender]:
    """All settings of xPheve for the scene."""
    return [contender(problem, one) for one in problem.ours]


def contender(problem: Problem, one: Ours) -> Contender:
    """One setting. The plan is made, and kernels are compiled by a run before, so that neither is part of the time."""

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        engine, bodies = built(problem, one)
        engine.run(until=BEGUN * problem.span, **one.run)
        return (lambda: engine.run(until=problem.span, **one.run)), (lambda: read(bodies))

    found = row(problem, f"{NAME} {one.method}", one.setting, one.run.get("dt"))
    found.more["ours"] = True
    return Contender(found, make)


def built(problem: Problem, one: Ours, compile: str = "always") -> tuple[Any, Any]:
    """A planned engine and what to read of it.

    Raises
    ------
    LookupError
        If this xPheve has no such stepper, or it did not get the group.
    """
    engine = asked(one.stepper, compile)
    bodies = problem.build(engine)
    engine.run(until=0.0, **one.run)
    served = {group["stepper"] for group in engine.explain().data["groups"]}
    if one.stepper is not None and one.stepper not in served:
        raise LookupError(f"{one.stepper} did not get the group: {', '.join(sorted(map(str, served)))} did")
    return engine, bodies


def asked(stepper: str | None, compile: str = "always") -> Any:
    """An engine that compiles its loops (unless ``compile`` says otherwise), asked to serve all by ``stepper``, or by its own choice.

    Raises
    ------
    LookupError
        If this xPheve has no such stepper.
    """
    import xpheve as xp
    from xpheve.errors import XpheveError

    if stepper is None:
        return xp.PhysicsEngine(compile=compile)
    if "stepper" not in inspect.signature(xp.PhysicsEngine).parameters:
        raise LookupError(f"this xPheve cannot be asked for {stepper}")
    try:
        return xp.PhysicsEngine(compile=compile, stepper=stepper)
    except XpheveError as wrong:
        raise LookupError(f"this xPheve has no {stepper}") from wrong


def read(bodies: Any) -> End:
    """Where all are."""
    columns = ("position", "velocity", "orientation", "angular_velocity")
    return End(*(np.array([getattr(one, name) for one in bodies]) for name in columns))
