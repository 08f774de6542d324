"""SciPy's `solve_ivp`. The right-hand side is compiled by numba where numba is there (tuned).

``atol`` is a thousandth of ``rtol`` unless the scene says otherwise.

Radau, BDF and LSODA get the Jacobian where the scene has one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.smooth.problem import End, Problem
from benchmarks.turns import Contender, row

NAME, MODULE = "SciPy", "scipy"
IMPLICIT = ("Radau", "BDF", "LSODA")
LEAST = 100 * np.finfo(float).eps  # SciPy takes no smaller rtol


def smooth(problem: Problem) -> list[Contender]:
    """A contender a setting: (method, rtol) or (method, rtol, atol over rtol)."""
    settings = problem.peers.get(MODULE, ())
    if not settings:
        return []
    slope, start, end = right_hand_side(problem)
    return [_contender(problem, tuple(one), slope, start, end) for one in settings]


def _contender(
    problem: Problem, setting: tuple[Any, ...], slope: Any, start: Any, end: Callable[[Any], End]
) -> Contender:
    method, rtol, share = (*setting, 1e-3)[:3]
    more: dict[str, Any] = {}
    note = "right-hand side compiled" if hasattr(slope, "py_func") else "right-hand side in NumPy"
    if method in IMPLICIT and problem.slope is not None and problem.slope.jacobian is not None:
        more["jac"] = _compiled(problem.slope.jacobian) if hasattr(slope, "py_func") else problem.slope.jacobian

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        slope(0.0, start)  # compiled by now
        if "jac" in more:
            more["jac"](0.0, start)
        done: list[Any] = []

        def go() -> None:
            span = (0.0, problem.span)
            done.append(
                solve_ivp(
                    slope, span, start, method=method, rtol=max(rtol, LEAST), atol=rtol * share, t_eval=span[1:], **more
                )
            )
            if not done[0].success:
                raise ArithmeticError(done[0].message)

        return go, lambda: end(done[-1].y[:, -1])

    return Contender(row(problem, f"{NAME} {method}", f"rtol {rtol:.0e}", note=note), make)


def right_hand_side(problem: Problem) -> tuple[Any, Any, Callable[[Any], End]]:
    """f(t, y) on arrays, y at the start, and where all are in a state."""
    if problem.swarm is not None:
        swarm = problem.swarm
        start = np.concatenate([swarm.position.ravel(), swarm.velocity.ravel()])
        return _attraction(swarm), start, lambda y: End(*y.reshape(2, swarm.n, 3))
    slope = problem.slope
    assert slope is not None
    start = np.array(slope.start)
    if slope.arrays is not None:
        return slope.arrays, start, slope.end
    formula = slope.make(math.sqrt)
    try:
        from numba import njit
    except ImportError:
        return (lambda t, y: np.array(formula(t, y))), start, slope.end
    compiled = njit(_with_compiled_helpers(formula))

    @njit
    def on_arrays(t: Any, y: Any) -> Any:
        return np.array(compiled(t, y))

    return on_arrays, start, slope.end


@cache
def _compiled(function: Any) -> Any:
    from numba import njit

    return njit(function)


def _with_compiled_helpers(formula: Any) -> Any:
    """The same function, with what it calls of the benchmarks compiled by numba."""
    from numba import njit

    names = {
        name: njit(_with_compiled_helpers(value))
        for name, value in formula.__globals__.items()
        if isinstance(value, FunctionType) and name in formula.__code__.co_names
    }
    return FunctionType(
        formula.__code__, {**formula.__globals__, **names}, formula.__name__, formula.__defaults__, formula.__closure__
    )


def _attraction(swarm: Any) -> Any:
    n, weights = swarm.n, swarm.constant * swarm.mass

    def slope(t: float, y: Any) -> Any:
        out = np.empty(6 * n)
        out[: 3 * n] = y[3 * n :]
        out[3 * n :] = 0.0
        for i in range(n):
            for j in range(i):
                dx, dy, dz = y[3 * i] - y[3 * j], y[3 * i + 1] - y[3 * j + 1], y[3 * i + 2] - y[3 * j + 2]
                square = dx * dx + dy * dy + dz * dz
                inverse = 1.0 / (square * math.sqrt(square))
                pull, push = -weights[j] * inverse, weights[i] * inverse
                a, b = 3 * (n + i), 3 * (n + j)
                out[a] += pull * dx
                out[a + 1] += pull * dy
                out[a + 2] += pull * dz
                out[b] += push * dx
                out[b + 1] += push * dy
                out[b + 2] += push * dz
        return out

    try:
        from numba import njit
    except ImportError:
        return slope
    return njit(slope)
