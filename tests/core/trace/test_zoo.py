# ruff: noqa: D101 - the name of a beast says what is wrong with it
"""Wrong laws, each caught when it is read, with a message that names the fault.

What only numbers tell (``isinstance`` on the state, a potential that does not match) is caught by the comparison of tiers, elsewhere.
"""

from __future__ import annotations

import contextlib
import math
import random
import time
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import DimensionError, LawDefinitionError, TracedBranchError, TraceError
from xpheve.trace.recorder import trace_law

generator = np.random.default_rng(1)
calls = []
ZOO: list[Any] = []


def caught(error: type[Exception], says: str) -> Any:
    """Put a law into the zoo: tracing it raises ``error``, whose message ``says`` so."""

    def put(law: Any) -> Any:
        ZOO.append(pytest.param(law, error, says, id=law.__name__))
        return law

    return put


class Drag(xp.FieldLaw):
    """A drag that is right but for what its children do."""

    id = "zoo:drag"
    c = xp.Param(0.1, unit="kg/m", ge=0)
    b = xp.Param(0.1, unit="kg/s", ge=0)
    k = xp.Param(1.0, unit="N/m")
    columns: ClassVar = {"area": xp.Column(1.0, unit="m^2")}


# Numbers that nobody declared


@caught(
    TraceError, r"self\.gain is a plain number of the class, 3\.0: .*gain = Param\(3\.0, unit=\.\.\.\), or Constant"
)
class NumberOfTheClass(Drag):
    gain = 3.0

    def force(self, body: Any) -> Any:
        return -self.gain * self.b * body.velocity


@caught(
    TraceError, r"self\.gain was set on the law by hand, 2\.0: it has no unit, and a change of it would go unnoticed"
)
class NumberOfTheInstance(Drag):
    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.gain = 2.0

    def force(self, body: Any) -> Any:
        return -self.gain * self.b * body.velocity


@caught(TraceError, r"self\.axis is a plain number of the class, \(0\.0, 0\.0, 1\.0\)")
class TupleOfTheClass(Drag):
    axis = (0.0, 0.0, 1.0)

    def force(self, body: Any) -> Any:
        return self.b * body.velocity.cross(self.axis)


@caught(TraceError, r"self\.gain is a plain number of the class")
class NumberBehindTheType(Drag):
    gain = 3.0

    def force(self, body: Any) -> Any:
        return -type(self).gain * self.b * body.velocity


@caught(TraceError, r"self\.gain is a plain number of the class.*At test_zoo\.py:\d+: return cls\.gain")
class NumberInAClassMethod(Drag):
    gain = 3.0

    @classmethod
    def doubled(cls) -> Any:
        return cls.gain * 2

    def force(self, body: Any) -> Any:
        return -self.doubled() * self.b * body.velocity


@caught(TraceError, r"self\.mode was set on the law by hand: 'fast'\. .*declare it as a Param")
class ModeOfTheInstance(Drag):
    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.mode = "fast"

    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * (2.0 if self.mode == "fast" else 1.0)


# Memory, chance and clocks


@caught(TraceError, r"sets self\.last: a formula has no memory")
class Remembers(Drag):
    def force(self, body: Any) -> Any:
        self.last = body.velocity
        return -self.b * self.last


@caught(TraceError, r"self\.calls is a plain number of the class")
class CountsItsCalls(Drag):
    calls = 0

    def force(self, body: Any) -> Any:
        self.calls += 1
        return -self.b * body.velocity / self.calls


@caught(TraceError, r"self\.state: the formula keeps a state between calls.*free-form law")
class CountsInItsState(Drag):
    initial_state: ClassVar = {"calls": 0}

    def force(self, body: Any) -> Any:
        self.state["calls"] += 1
        return -self.b * body.velocity


@caught(TraceError, r"read twice, says two things: 1\.5, then 3\.0\. At test_zoo\.py:\d+: .*len\(calls\)")
class CountsElsewhere(Drag):
    def force(self, body: Any) -> Any:
        calls.append(1)
        return -self.b * body.velocity * (1.5 * len(calls))


@caught(TraceError, r"read twice, says two things: .*Random numbers, clocks and counters are no part")
class DrawsFromItsOwnGenerator(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * generator.normal()


@caught(TraceError, r"draws random numbers: how often it is called is the stepper's affair")
class DrawsFromNumPy(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * np.random.normal()  # noqa: NPY002


@caught(TraceError, r"draws random numbers")
class ThrowsACoin(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity if random.random() < 0.5 else 0


@caught(TraceError, r"self\.random: the formula draws random numbers")
class DrawsFromTheScene(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * self.random.normal()


@caught(TraceError, r"read twice, says two things: .*clocks")
class AsksTheClock(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * math.sin(time.perf_counter())


@caught(TraceError, r"self\.objects: the formula asks for its objects")
class AsksForItsObjects(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity / len(self.objects)


@caught(TraceError, r"self\.engine: the formula asks the engine")
class AsksTheEngine(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * self.engine.time


# Python that decides


@caught(
    TracedBranchError,
    r"zoo:drag\.force: test_zoo\.py:\d+: `if body\.velocity\.norm\(\) > self\.fast:` branches on a traced value\. "
    r"Use np\.where\(body\.velocity\.norm\(\) > self\.fast, a, b\), or write apply\(self, body\)",
)
class BranchesOnTheState(Drag):
    fast = xp.Param(10.0, unit="m/s")

    def force(self, body: Any) -> Any:
        if body.velocity.norm() > self.fast:
            return -2.0 * self.b * body.velocity
        return -self.b * body.velocity


@caught(TracedBranchError, r"Use np\.where\(self\.b > self\.other, self\.b, self\.other\)")
class BranchesOnAParameter(Drag):
    other = xp.Param(1.0, unit="kg/s")

    def force(self, body: Any) -> Any:
        larger = self.b if self.b > self.other else self.other
        return -larger * body.velocity


@caught(TracedBranchError, r"with \(p\) & \(q\) for `p and q`")
class BranchesWithAnd(Drag):
    high = xp.Param(1.0, unit="m")

    def force(self, body: Any) -> Any:
        return np.where((body.position.z > self.high) and (body.mass > 0), -self.b, 0.0) * body.velocity


@caught(TracedBranchError, r"`while body\.time > 0:` branches on a traced value")
class LoopsWhile(Drag):
    def force(self, body: Any) -> Any:
        while body.time > 0:
            pass
        return 0


@caught(
    TracedBranchError,
    r"asks for float\(\) of a traced value, which is no number yet\. Leave float\(\) out, or write apply",
)
class AsksForAFloat(Drag):
    def force(self, body: Any) -> Any:
        return -float(self.b) * body.velocity


@caught(TracedBranchError, r"asks for float\(\) of a traced value.* Use np\.sqrt, or write apply")
class UsesTheMathModule(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * math.sqrt(body.mass)


@caught(TracedBranchError, r"asks for an index of a traced value")
class LoopsOverAParameter(Drag):
    turns = xp.Param(3.0)

    def force(self, body: Any) -> Any:
        force = 0.0 * self.b * body.velocity
        for _ in range(self.turns):
            force = force - self.b * body.velocity
        return force


@caught(TracedBranchError, r"asks for iteration of a traced value.* Use \.x, \.y and \.z")
class LoopsOverObjects(Drag):
    def force(self, body: Any) -> Any:
        return sum(-self.b * v for v in body.velocity)


@caught(TracedBranchError, r"Use np\.minimum\(a, b\) or np\.maximum\(a, b\)")
class TakesPythonsMinimum(Drag):
    def force(self, body: Any) -> Any:
        return -min(self.b, self.b * body.time / body.since) * body.velocity


@caught(TracedBranchError, r"`if body\.mass > 0:` branches on a traced value")
class SwallowsTheError(Drag):
    def force(self, body: Any) -> Any:
        try:
            if body.mass > 0:
                return -self.b * body.velocity
        except Exception:
            pass
        return 0


@caught(DimensionError, r"zoo:drag subtracts kg\*m/s and kg\*m/s\^2\. At test_zoo\.py")
class SwallowsAWrongSum(Drag):
    def force(self, body: Any) -> Any:
        with contextlib.suppress(Exception):
            return body.mass * body.velocity - self.b * body.velocity
        return 0


@caught(TraceError, r"more than 20,000 operations")
class LoopsTooLong(Drag):
    def force(self, body: Any) -> Any:
        force = -self.b * body.velocity
        for k in range(10_000):
            force = force * (1.0 + 1e-9 * k)
        return force


# Views


@caught(TraceError, r"sets body\.velocity, which is read-only|writes into body\.velocity, which is read-only")
class StopsItsBodies(Drag):
    def force(self, body: Any) -> Any:
        body.velocity[...] = 0.0
        return 0


@caught(TraceError, r"writes into body\.position, which is read-only")
class MovesItsBodies(Drag):
    def force(self, body: Any) -> Any:
        place = body.position
        place += body.velocity * self.b / self.b * body.time
        return 0


@caught(TraceError, r"sets body\.mass, which is read-only")
class ChangesTheMass(Drag):
    def force(self, body: Any) -> Any:
        body.mass = 1.0
        return 0


@caught(TraceError, r"body\.count, the size of the batch, changes")
class CountsItsBodies(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity / body.count


@caught(TraceError, r"\[2\] of a batch of shape \(n, 3\) is the row of one object, not a component of all: write \.z")
class TakesARow(Drag):
    def force(self, body: Any) -> Any:
        return -self.k * body.position[2] * (0, 0, 1)


@caught(TraceError, r'reads body\.velocty, which is no property and no column.* Did you mean "velocity"\?')
class Misspells(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocty


@caught(TraceError, r"np\.any\(\.\.\., axis=None\) goes over objects")
class LooksAtAll(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity if np.any(body.mass > 0.0) else 0


@caught(TraceError, r"asks for the number of objects")
class FillsAnArray(Drag):
    def force(self, body: Any) -> Any:
        force = np.zeros(body.position.shape)
        force[:, 2:3] = -self.k * body.position.z
        return force


@caught(TraceError, r"np\.sort has no traced form")
class SortsItsBodies(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * np.sort(body.velocity)


# What is returned


@caught(
    TraceError,
    r"zoo:drag\.force returned an array of shape \(n, 1\); real numbers of shape \(n, 3\) or \(3,\) are needed: .* body\.position\.z \* \(0, 0, 1\)",
)
class ReturnsAColumn(Drag):
    def force(self, body: Any) -> Any:
        return -self.k * body.position.z


@caught(TraceError, r"returned an array of shape \(n,\); .*xp\.vector\(fx, fy, fz\)")
class ReturnsAList(Drag):
    def force(self, body: Any) -> Any:
        return -self.k * body.position[:, 2]


@caught(TraceError, r"returned 5\.0; real numbers of shape")
class ReturnsANumber(Drag):
    def force(self, body: Any) -> Any:
        return 5.0


@caught(TraceError, r"returned None: is a `return` missing\?")
class ReturnsNothing(Drag):
    def force(self, body: Any) -> Any:
        -self.b * body.velocity


@caught(TraceError, r"returned \(<traced value.*real numbers of shape \(n, 3\)")
class ReturnsColumnsInATuple(Drag):
    def force(self, body: Any) -> Any:
        v = body.velocity
        return self.b * v.x, self.b * v.y, self.b * v.z


@caught(
    TraceError, r"zoo:drag\.potential returned an array of shape \(n, 3\); real numbers of shape \(n, 1\) are needed"
)
class HasAVectorForAPotential(Drag):
    def force(self, body: Any) -> Any:
        return -self.k * body.position

    def potential(self, body: Any) -> Any:
        return 0.5 * self.k * body.position * body.position


# Dimensions


@caught(
    DimensionError,
    r"zoo:drag\.force returns kg\*m\^2/s\^3 \(power\), not N\. At test_zoo\.py:\d+: return -self\.c \* body\.velocity.* \* body\.velocity\. "
    r"Hint: one \|velocity\| too many\.",
)
class HasASpeedTooMany(Drag):
    def force(self, body: Any) -> Any:
        return -self.c * body.velocity.norm() ** 2 * body.velocity


@caught(DimensionError, r"returns m/s\^2 \(acceleration\), not N\. .*Hint: one mass too few")
class ReturnsAnAcceleration(Drag):
    g = xp.Param(9.81, unit="m/s^2")

    def force(self, body: Any) -> Any:
        return -self.g * body.up + 0.0 * self.g * body.mass / body.mass


@caught(DimensionError, r"zoo:drag adds m/s and m\. At test_zoo\.py")
class AddsSpeedAndLength(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * (body.velocity + body.position)


@caught(
    DimensionError, r"compares m and 1\. .*A number in the text has no unit: declare it, Constant\(0\.001, unit='m'\)"
)
class ComparesWithABareNumber(Drag):
    def force(self, body: Any) -> Any:
        d = np.maximum(body.position.norm(), 0.001)
        return -self.k * body.position / d * d


@caught(DimensionError, r"exp of m: it takes a pure number, so divide by a scale first")
class TakesTheExponentialOfALength(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * body.velocity * np.exp(-body.position.z)


@caught(DimensionError, r"torque returns kg\*m/s\^2 \(force\), not N m")
class ReturnsAForceForATorque(Drag):
    def torque(self, body: Any) -> Any:
        return -self.b * body.velocity


@caught(DimensionError, r"potential returns kg\*m\^3/s\^2, not J")
class HasAPotentialOfThirdPower(Drag):
    def force(self, body: Any) -> Any:
        return -self.k * body.position

    def potential(self, body: Any) -> Any:
        return 0.5 * self.k * body.position.dot(body.position) * body.position.norm()


@caught(DimensionError, r"returns m\^2 \(area\), not N")
class ForgetsTheUnitOfAColumn(Drag):
    def force(self, body: Any) -> Any:
        return body.area * (0.0, 0.0, 1.0)


@caught(DimensionError, r"returns 1 \(a pure number\), not N\. .*declare it, Constant\(1\.0, unit='N'\)")
class PushesWithABareNumber(Drag):
    def force(self, body: Any) -> Any:
        return (body.time > 0.0) * (1.0, 0.0, 0.0)


@caught(DimensionError, r"returns m \(length\), not N")
class PushesWithALength(Drag):
    push = xp.Constant((0.0, 0.0, 1.0), unit="m")

    def force(self, body: Any) -> Any:
        return self.push


# Slips of Python


@caught(
    TraceError, r"zoo:drag\.force raised AttributeError: .*'damping'\..* At test_zoo\.py:\d+: return -self\.damping"
)
class ReadsAParameterThatIsNotThere(Drag):
    def force(self, body: Any) -> Any:
        return -self.damping * body.velocity


@caught(TraceError, r"None takes part in a formula: ask `is None` first")
class ForgetsThatItMayBeNone(Drag):
    limit = xp.Param(None, unit="m/s")

    def force(self, body: Any) -> Any:
        return -self.b * np.minimum(body.velocity, self.limit)


@caught(TraceError, r"values of shapes \(n,\) and \(n, 1\) do not go together: \[:, k\] gives \(n,\)")
class MultipliesAListByAColumn(Drag):
    def force(self, body: Any) -> Any:
        return -self.k * body.position[:, 2] * body.mass / body.mass * (0, 0, 1)


@caught(TraceError, r"makes a NumPy array of a traced value")
class MakesAnArray(Drag):
    def force(self, body: Any) -> Any:
        return -self.b * np.array([body.velocity.x, body.velocity.y, body.velocity.z])


@pytest.mark.parametrize(("law", "error", "says"), ZOO)
def test_a_wrong_law_is_caught_when_it_is_read(law: Any, error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says) as caught:
        trace_law(law())
    assert type(caught.value) is error and issubclass(error, LawDefinitionError)
    assert "xpheve/trace" not in str(caught.value), "the line is the author's"


def test_the_zoo_is_large() -> None:
    assert len(ZOO) >= 20


def test_a_pair_law_is_told_of_its_own_way_out() -> None:
    class Pair(xp.PairLaw):
        id = "zoo:pair"

        def force(self, a: Any, b: Any) -> Any:
            return a.velocity if a.mass > b.mass else b.velocity

    with pytest.raises(
        TracedBranchError,
        match=r"np\.where\(a\.mass > b\.mass, a\.velocity, b\.velocity\), or write apply\(self, a, b\)",
    ):
        trace_law(Pair())
