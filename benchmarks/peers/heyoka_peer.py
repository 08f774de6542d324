"""heyoka: Taylor series of high order, compiled for the scene; tolerance 0 stands for its default, the last digit.

Building is its compilation.

Tuned: the default compiles the whole step in one piece (``compact_mode`` off), which is its fastest; systems of more
than 20 components are compiled in compact mode, as the rest would take minutes. F. Biscani, D. Izzo, MNRAS 504, 2614
(2021).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from benchmarks.smooth.problem import End, Problem
from benchmarks.turns import Contender, row

NAME, MODULE = "heyoka", "heyoka"


def smooth(problem: Problem) -> list[Contender]:
    """A contender a tolerance; "high accuracy" is the last digit, with compensated sums."""
    return [_contender(problem, tolerance) for tolerance in problem.peers.get(MODULE, ())]


def _contender(problem: Problem, tolerance: float | str) -> Contender:
    built: list[Any] = []

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        if not built:  # compiled once; each run has its own start
            built.append(integrator(problem, tolerance))
        compiled, state, end = built[0]
        compiled.time = 0.0
        compiled.state[:] = state

        def go() -> None:
            compiled.propagate_until(problem.span)

        return go, lambda: end(compiled.state)

    setting, note = (
        (f"tol {tolerance:.0e}", "") if isinstance(tolerance, float) and tolerance else ("tol eps", "its default")
    )
    if isinstance(tolerance, str):
        setting, note = f"tol eps, {tolerance}", "tuned: compensated sums"
    return Contender(row(problem, f"{NAME} Taylor", setting, note=note), make)


def integrator(problem: Problem, tolerance: float | str) -> tuple[Any, Any, Callable[[Any], End]]:
    """The compiled integrator, its state at the start, and where all are in a state."""
    more: dict[str, Any] = (
        {"high_accuracy": True} if isinstance(tolerance, str) else {"tol": tolerance} if tolerance else {}
    )
    if problem.swarm is not None:
        swarm = problem.swarm
        system = hy.model.nbody(swarm.n, masses=swarm.mass.tolist(), Gconst=swarm.constant)
        state = np.concatenate([swarm.position, swarm.velocity], axis=1).ravel()
        end = _points
    else:
        slope = problem.slope
        assert slope is not None
        variables = hy.make_vars(*(f"y{k}" for k in range(len(slope.start))))
        right = slope.make(hy.sqrt)(hy.time, variables)
        system = [(y, hy.expression(0.0) + f) for y, f in zip(variables, right, strict=True)]
        state, end = np.array(slope.start), slope.end
    return hy.taylor_adaptive(system, state.tolist(), compact_mode=len(state) > 30, **more), state, end


def _points(state: Any) -> End:
    rows = np.array(state).reshape(-1, 6)
    return End(rows[:, :3], rows[:, 3:])
