"""Copies of functions whose names lead to doors."""

from __future__ import annotations

import functools
import math
import operator
import random
import sys
from collections.abc import Mapping
from enum import Enum
from math import sqrt
from types import FunctionType
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import TraceError
from xpheve.trace.graph import walk
from xpheve.trace.plain_python import Doors, GivenImpulse, Stranger
from xpheve.trace.values import NUMBER, Traced

NUMBERS = [1.0, 2.0]
RULES = {"twice": lambda x: 2.0 * x}
PAIR = (3.0, [4.0])
SET = {1.0}
ARRAY = np.array([1.0, 2.0])


class Color(Enum):
    """A choice."""

    RED = 1


@pytest.fixture
def doors() -> Doors:
    return Doors()


def traced(doors: Doors, name: str = "x") -> Traced:
    return Traced(doors.recording, [doors.recording.graph.input(name)], NUMBER)


def ops(value: Traced) -> set[str]:
    return {node.op for node in walk(value.nodes)} - {"input", "const"}


def roots(x: Any) -> Any:
    return math.sqrt(x) + sqrt(x)


def test_functions_of_math_record_under_any_name(doors: Doors) -> None:
    assert ops(doors.copied(roots)(traced(doors))) == {"sqrt", "+"}
    assert doors.copied(roots)(4.0) == roots(4.0)


def test_functions_that_are_called_are_copied_too_and_know_themselves(doors: Doors) -> None:
    assert ops(doors.copied(outer)(traced(doors))) == {"sqrt", "+", "*"}
    assert doors.copied(factorial)(5) == 120


def outer(x: Any) -> Any:
    return RULES["twice"](roots(x))


def factorial(n: int) -> int:
    return 1 if n == 0 else n * factorial(n - 1)


def containers() -> Any:
    return NUMBERS, RULES, PAIR, SET, ARRAY


def test_containers_cannot_be_changed(doors: Doors) -> None:
    numbers, rules, pair, kept, array = doors.copied(containers)()
    assert numbers == (1.0, 2.0) and pair == (3.0, (4.0,)) and kept == frozenset(SET)
    assert isinstance(rules, Mapping) and not hasattr(rules, "update")
    assert not array.flags.writeable and ARRAY.flags.writeable


def harmless() -> Any:
    return Color.RED, operator.mul(2, 3), functools.reduce(operator.add, (1, 2)), np.sqrt(4.0), xp.where(True, 1, 2)


def test_what_has_no_effects_is_handed_out(doors: Doors) -> None:
    assert doors.copied(harmless)() == harmless()


def of_chance() -> Any:
    return random.random()


def of_the_house() -> Any:
    return xp.Impulse((1.0, 2.0, 3.0))


def test_what_has_effects_is_a_stranger(doors: Doors) -> None:
    with pytest.raises(TraceError, match=r"random\.random"):
        doors.copied(of_chance)()
    assert doors.recording.error is not None


def test_answers_are_those_that_take_traced_values(doors: Doors) -> None:
    assert isinstance(doors.copied(of_the_house)(), GivenImpulse)


def extremes(x: Any, y: Any) -> Any:
    return min(x, y), max([x, y, 0.0]), min(1, 2), max((3,)), max(1, 2, key=lambda k: -k)


def test_least_and_greatest_are_choices(doors: Doors) -> None:
    x, y = traced(doors), traced(doors, "y")
    low, high, *rest = doors.copied(extremes)(x, y)
    assert ops(low) == {"<", "where"} and ops(high) == {">", "where"} and rest == [1, 3, 1]


def total(*values: Any) -> Any:
    return sum(values), sum([1.0, 2.0]), sum(values, 1.0)


def test_sums_are_those_of_this_python(doors: Doors) -> None:
    one, plain, other = doors.copied(total)(traced(doors), traced(doors, "y"))
    assert plain == 3.0
    assert ("where" in ops(one)) == ("where" in ops(other)) == (sys.version_info >= (3, 12))


def conversions(x: Any) -> Any:
    return float(x), float("2"), isinstance(1.0, float), isinstance(1, (int, float)), type(NUMBERS)


def test_conversions_of_numbers_are_none(doors: Doors) -> None:
    x = traced(doors)
    same, *rest = doors.copied(conversions)(x)
    assert same.nodes == x.nodes and rest == [2.0, True, True, tuple]


@pytest.mark.parametrize("name", ["fsum", "hypot", "dist", "copysign", "floor", "fmod", "gamma"])
def test_functions_of_math_that_round_in_their_own_way_are_refused(name: str, doors: Doors) -> None:
    plain = getattr(math, name)
    door = doors.stand_in(plain, name)
    x = traced(doors)
    given: tuple[Any, ...] = {"fsum": ([x, x],), "dist": ((x, x), (x, x)), "floor": (x,), "gamma": (x,)}.get(
        name, (x, x)
    )
    with pytest.raises(TraceError, match=f"math.{name}"):
        door(*given)
    assert doors.stand_in(math.hypot, "hypot")(3.0, 4.0) == 5.0


@pytest.mark.parametrize(
    "name", ["isnan", "isfinite", "isinf", "radians", "degrees", "fabs", "log", "exp", "atan2", "pow"]
)
def test_functions_of_math_give_numbers_of_numbers(name: str, doors: Doors) -> None:
    door, plain = doors.stand_in(getattr(math, name), name), getattr(math, name)
    given = (0.3, 0.7)[: 2 if name in ("atan2", "pow") else 1]
    assert door(*given) == plain(*given)
    assert isinstance(door(*[traced(doors)] * len(given)), Traced)


def sets_a_global() -> None:
    global NUMBERS
    NUMBERS = []


def sets_an_attribute(x: Any) -> None:
    x.speed = 1.0


def asks_is(x: Any, y: Any) -> bool:
    return x is y


def asks_none(x: Any) -> bool:
    return x is None


def inner(x: Any) -> Any:
    return [asks(x) for asks in (lambda y: y is x,)]


@pytest.mark.parametrize("function", [sets_a_global, sets_an_attribute, asks_is, inner])
def test_effects_are_seen_in_the_code(function: FunctionType, doors: Doors) -> None:
    assert isinstance(doors.copied(function), Stranger)
    assert not isinstance(doors.copied(asks_none), Stranger)


def test_closures_and_defaults_are_looked_at(doors: Doors) -> None:
    seen: list[Any] = []

    def around(x: Any, more: Any = NUMBERS) -> Any:
        return seen, more

    held, more = doors.copied(around)(1.0)
    assert held == () and more == (1.0, 2.0)


def test_a_stranger_refuses_whatever_is_done_with_it(doors: Doors) -> None:
    stranger = Stranger(doors, "reaches LOG")
    for use in (
        lambda: stranger.hits,
        lambda: stranger(),
        lambda: stranger[0],
        lambda: stranger + 1,
        lambda: 1 * stranger,
        lambda: stranger == 1,
        lambda: bool(stranger),
        lambda: list(stranger),
        lambda: setattr(stranger, "x", 1),
    ):
        with pytest.raises(TraceError, match="reaches LOG"):
            use()
