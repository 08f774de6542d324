"""States to try a law at: the same ones each time, of all sizes from 1e-3 to 1e3, some of them at rest."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import ParameterError
from xpheve.laws import Column, ContinuousLaw, Param, PhysicalLaw
from xpheve.laws.view import BodyView
from xpheve.trace.derivative import COMPONENTS, SCENE
from xpheve.trace.graph import Input, Parameter

Array = NDArray[np.float64]
AnyLaw = TypeVar("AnyLaw", bound=PhysicalLaw)

SEED = 20
SMALLEST, LARGEST = -3.0, 3.0  # powers of ten
LENGTHS_TO_TRY = (1.0, 1e3, 1e6, 1e9, 1e12)
"""By how much positions are stretched until the law is finite: a black hole has no force inside its horizon."""


class States:
    """``count`` states of an object, or of a pair of objects.

    Parameters
    ----------
    law
        Whose columns are filled.
    count
        How many, all at one time and under one up. Every fourth is at rest; of pairs a, then b, then neither.
    stretch
        Factor on positions.
    seed
        Of the pseudo-random numbers.
    """

    def __init__(self, law: ContinuousLaw, pair: bool, count: int, stretch: float = 1.0, seed: int = SEED) -> None:
        self.law, self.count = law, count
        self.sides = ("a", "b") if pair else ("",)
        self._rng = np.random.default_rng(seed)
        self._known: dict[tuple[str, str], Array] = {}
        self._stretch = stretch
        self._size = 10.0 ** self._rng.uniform(SMALLEST, LARGEST, count)
        for side in self.sides:
            for name in ("position", "velocity", "angular_velocity", "orientation", "mass", "inertia", "volume"):
                self._known[side, name] = getattr(self, f"_{name}")()
        time, up = self._rng.uniform(0.0, 100.0), self._rng.normal(size=3)
        self._known["", "time"] = np.full((count, 1), time)
        self._known["", "up"] = np.repeat([up / np.sqrt(up.dot(up))], count, axis=0)
        for side in self.sides:
            self._known[side, "since"] = time * self._rng.uniform(0.0, 1.0, (count, 1))
        for number, side in enumerate(self.sides):
            still = np.arange(count) % 4 == 3 if not pair else np.arange(count) % 3 == number
            for name in ("velocity", "angular_velocity"):
                self._known[side, name][still] = 0.0

    def array(self, side: str, name: str) -> Array:
        """What is called ``name`` of the objects of ``side``, shape (count, components)."""
        key = ("" if name in SCENE else side, name)
        if key not in self._known:
            self._known[key] = self._column(self.law.columns.get(name))
        return self._known[key]

    def inputs(self, wanted: Sequence[Input]) -> dict[Input, Array]:
        """The numbers of ``wanted``, shape (count,) each."""
        return {one: self.array(one.side, one.name)[:, one.component] for one in wanted}

    def view(self, side: str, rows: Sequence[int] | None = None) -> BodyView:
        """The objects of one side as a law sees them: of all states, or of ``rows``."""
        chosen = np.arange(self.count) if rows is None else np.asarray(rows)

        def fetch(name: str) -> Any:
            found = self.array(side, name)
            if name in SCENE:
                return float(found[0, 0]) if name == "time" else found[0].copy()
            return found[chosen] if COMPONENTS.get(name, 1) > 1 else found[chosen, 0]

        return BodyView(fetch, set(), len(chosen))

    def at_rest(self, row: int, side: str) -> bool:
        """Whether the object of ``side`` does not move in state ``row``."""
        return not (self._known[side, "velocity"][row].any() or self._known[side, "angular_velocity"][row].any())

    def describe(self, row: int, names: Sequence[tuple[str, str]]) -> str:
        """State ``row`` in words: what is called by ``names``, (side, name) each."""
        parts = []
        for side, name in names:
            numbers = self.array(side, name)[row].tolist()
            shown = f"({', '.join(f'{one:.6g}' for one in numbers)})" if len(numbers) > 1 else f"{numbers[0]:.6g}"
            parts.append(f"{side + '.' if side and name not in SCENE else ''}{name} {shown}")
        return ", ".join(parts)

    # What each is like

    def _vectors(self) -> Array:
        found: Array = self._rng.normal(size=(self.count, 3)) * self._size[:, None]
        return found

    def _position(self) -> Array:
        return self._vectors() * self._stretch

    def _velocity(self) -> Array:
        return self._rng.normal(size=(self.count, 3)) * 10.0 ** self._rng.uniform(SMALLEST, LARGEST, (self.count, 1))

    def _angular_velocity(self) -> Array:
        return self._velocity()

    def _orientation(self) -> Array:
        q = self._rng.normal(size=(self.count, 4))
        found: Array = q / np.linalg.norm(q, axis=1, keepdims=True)
        return found

    def _mass(self) -> Array:
        return self._positive()

    def _volume(self) -> Array:
        return self._positive()

    def _inertia(self) -> Array:
        squares = self._rng.uniform(0.1, 1.0, (self.count, 3))  # of the extents: any body's moments are sums of two
        found: Array = (squares.sum(axis=1, keepdims=True) - squares) * self._positive()
        return found

    def _positive(self) -> Array:
        found: Array = 10.0 ** self._rng.uniform(SMALLEST, LARGEST, (self.count, 1))
        return found

    def _column(self, column: Column | None) -> Array:
        """Numbers of a column: within its bounds, of either sign if it has none."""
        numbers = self._positive() * np.where(self._rng.uniform(size=(self.count, 1)) < 0.5, -1.0, 1.0)
        if column is None:
            return numbers
        return np.array([[_within(column.param, one, column.default)] for one in numbers[:, 0].tolist()])


def _within(param: Param, wanted: float, default: float) -> float:
    """``wanted``, or a number like it that ``param`` allows; else ``default``."""
    low = param.ge if param.ge is not None else param.gt
    high = param.le if param.le is not None else param.lt
    share = abs(wanted) / (1.0 + abs(wanted))
    if low is not None and high is not None:
        tries = [low + share * (high - low)]
    elif low is not None:
        tries = [low + abs(wanted)]
    elif high is not None:
        tries = [high - abs(wanted)]
    else:
        tries = [wanted]
    for one in tries:
        if _allowed(param, one):
            return one
    return default


def _allowed(param: Param, value: Any) -> bool:
    try:
        param.check(value)
    except ParameterError:
        return False
    return True


def variants(law: AnyLaw, count: int, seed: int = SEED) -> Iterator[AnyLaw]:
    """``law`` as it is, then copies of it with other numbers in its parameters.

    Numbers that are not 0 are scaled by 1/2 to 2, vectors keep their direction; what is 0 gets a number of the order of 1. Text, switches
    and what was left out stay.
    """
    yield law
    rng = np.random.default_rng(seed)
    for _ in range(count - 1):
        values = {name: _varied(law.params[name], value, rng) for name, value in law.parameters.items()}
        yield with_parameters(law, values)


def with_parameters(law: AnyLaw, values: dict[str, Any]) -> AnyLaw:
    """A copy of ``law`` outside any engine, with other parameters."""
    other = copy.copy(law)
    other.parameters, other.engine, other.state = values, None, dict(law.state)
    return other


def _varied(param: Param, value: Any, rng: np.random.Generator) -> Any:
    if value is None or param.kind not in ("number", "vector"):
        return value
    factor = float(2.0 ** rng.uniform(-1.0, 1.0))
    if param.kind == "vector":
        other: Any = tuple(factor * one for one in value) if any(value) else tuple(rng.normal(size=param.size).tolist())
        return other if _allowed(param, other) else value
    other = factor * value if value else _within(param, float(rng.normal()), 0.0)
    return other if _allowed(param, other) else value


def parameters_of(law: ContinuousLaw, wanted: Sequence[Parameter]) -> dict[Parameter, float]:
    """The numbers of ``wanted``; NaN for what was left out."""
    return {one: _number(law.parameters, one) for one in wanted}


def _number(values: Mapping[str, Any], one: Parameter) -> float:
    value = values[one.name]
    if value is None:
        return math.nan
    return float(value[one.component]) if isinstance(value, (tuple, list)) else float(value)
