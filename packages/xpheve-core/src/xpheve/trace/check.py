"""Laws tried by numbers: what was traced against what the method does, potential against force, derivatives against differences.

What a law's expression says is seen when it is traced; what only its numbers show is found here, at the states of
`xpheve.trace.samples`. ``check_law`` says all that it finds; ``quick_check`` is what an engine can afford when it first meets a law.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import PotentialError, TraceError
from xpheve.laws import ContinuousLaw
from xpheve.trace.derivative import gradient, inputs_of, jacobian, unchecked
from xpheve.trace.graph import COMPARISONS, LOGIC, Input, Node, walk
from xpheve.trace.law_trace import LawTrace
from xpheve.trace.nature import MOVING, Nature, nature
from xpheve.trace.numpy_text import GraphFunction, array_function, scalar_function
from xpheve.trace.power import balance, reads_orientation
from xpheve.trace.recorder import trace_law, why_untraced
from xpheve.trace.samples import LENGTHS_TO_TRY, SEED, Array, States, parameters_of, variants
from xpheve.trace.shadow import as_arrays

TOLERANCE = 1e-12  # of the size of the terms: rounding, of formulas written in another order
OWN_ERROR = 1e-13  # by which all that is read is moved, to see what rounding may do to a result
POWER_TOLERANCE = 1e-9  # of the size of the terms: exact formulas, of which both are rounded
SMALLEST = 1e-322  # what a number near the least float is off by
EXACT = frozenset(
    (
        "const",
        "input",
        "param",
        "table",
        "+",
        "-",
        "*",
        "/",
        "sqrt",
        "neg",
        "abs",
        "sign",
        "min",
        "max",
        "floor",
        "where",
    )
) | {*COMPARISONS, *LOGIC}
"""Operations that all tiers round alike."""


@dataclass(frozen=True)
class Finding:
    """Something that is wrong with a law, or worth a remark.

    ``kind`` is "values", "text", "jacobian", "potential", "finite" or "order"; ``method`` is "force", "torque" or "potential"; ``message``
    says it; ``error`` is None for a remark.
    """

    kind: str
    method: str
    message: str
    error: type[TraceError] | None = TraceError


def check_law(law: ContinuousLaw, samples: int = 24, *, trace: LawTrace | None = None) -> list[Finding]:
    """All that numbers show to be wrong with ``law``; empty if nothing is.

    Parameters
    ----------
    law
        Made, with parameters; it need not be in an engine, and is not changed.
    samples
        States to try, a quarter of them with the parameters that the law has, the rest with others.
    trace
        If the law has been traced already.

    Raises
    ------
    TraceError
        If the law cannot be traced.
    """
    trace = trace_law(law) if trace is None else trace
    if trace is None:
        return [
            Finding(
                "values", "", f"{law.label()} is not traced, so its numbers are not checked: {why_untraced(law)}", None
            )
        ]
    found: dict[tuple[str, str, bool], Finding] = {}
    functions = Functions(trace)
    for number, one in enumerate(variants(law, 4)):
        trial = Trial(one, functions, max(6, samples // 4), SEED + number)
        for check in (values, order, texts, potential, jacobians, finite):
            for finding in check(trial):
                found.setdefault((finding.kind, finding.method, finding.error is None), finding)
    return list(found.values())


def require_law(law: ContinuousLaw, samples: int = 24, *, trace: LawTrace | None = None) -> None:
    """Raise the first error of `check_law`; remarks are not raised."""
    _raise(check_law(law, samples, trace=trace))


def quick_check(law: ContinuousLaw, trace: LawTrace | None = None) -> None:
    """Try ``law`` with its own parameters at a handful of states.

    Raises
    ------
    PotentialError
        If its potential does not match its force.
    TraceError
        If what was traced is not what its methods do, or it cannot be traced.
    """
    trace = trace_law(law) if trace is None else trace
    if trace is None:
        return
    trial = Trial(law, Functions(trace), 6, SEED)
    for check in (values, potential):
        _raise(check(trial))


def nature_of(law: ContinuousLaw, trace: LawTrace | None = None) -> Nature | None:
    """The nature of ``law``, with what numbers say of its energy; None if it is not traced."""
    trace = trace_law(law) if trace is None else trace
    if trace is None:
        return None
    functions = Functions(trace)
    trials = [Trial(one, functions, 6, SEED + number) for number, one in enumerate(variants(law, 3))]
    idle = all(map(_does_no_work, trials))
    if trace.potential is None:
        return nature(trace, workless=idle)
    return nature(trace, potential_matches=idle and not any(one.error for trial in trials for one in potential(trial)))


def _raise(findings: Sequence[Finding] | Iterator[Finding]) -> None:
    for finding in findings:
        if finding.error is not None:
            raise finding.error(finding.message)


class Functions:
    """What a trace computes, as functions on arrays, each made once; ``main`` is all that `quick_check` needs."""

    def __init__(self, trace: LawTrace) -> None:
        self.trace = trace
        found = self.balance = balance(trace)
        with unchecked(trace.graph):
            both = trace.graph.op("+", found.power, found.rate)
        self.outputs = [*trace.motion, *([trace.potential] if trace.potential is not None else [])]
        self.energy = [found.power, found.rate, found.size, both, found.turning, found.turning_size]
        self.main = array_function([*self.outputs, *self.energy])
        self.place = {node.index: k for k, node in enumerate([*self.outputs, *self.energy])}
        self._others: dict[tuple[int, ...], GraphFunction] = {}

    def of(self, nodes: Sequence[Node]) -> GraphFunction:
        """The function of other nodes."""
        key = tuple(node.index for node in nodes)
        if key not in self._others:
            self._others[key] = array_function(nodes)
        return self._others[key]


class Trial:
    """A law, its trace, and states at which the law is finite if there are any near."""

    def __init__(self, law: ContinuousLaw, functions: Functions, count: int, seed: int) -> None:
        self.law, self.trace, self.functions = law, functions.trace, functions
        self.parameters = parameters_of(law, self.trace.parameters)
        outputs, best = functions.outputs, -1
        stretches = LENGTHS_TO_TRY if "position" in _names(outputs) else LENGTHS_TO_TRY[:1]
        for stretch in stretches:
            states = States(law, self.trace.pair, count, stretch, seed)
            numbers = self._run(functions.main, states)
            finite = np.isfinite(numbers[: len(outputs)]).all(axis=0)
            if int(finite.sum()) > best:
                best, self.states, self.finite, self._numbers = int(finite.sum()), states, finite, numbers
            if finite.all():
                break

    @cached_property
    def _room(self) -> Array:
        with np.errstate(all="ignore"):
            moved = [np.abs(self._run(self.functions.main, self.states, seed) - self._numbers) for seed in (1, 2)]
            found: Array = 10.0 * np.fmax(moved[0], moved[1])
        return np.where(np.isfinite(found), found, 0.0)

    def _run(self, run: GraphFunction, states: States, moved: int | None = None) -> Array:
        """What ``run`` gives, shape (nodes, count); all that is read moved a little by the pseudo-random numbers of seed ``moved``."""
        inputs, parameters = (
            states.inputs(run.inputs),
            {one: self.parameters.get(one, np.nan) for one in run.parameters},
        )
        if moved is not None:
            rng = np.random.default_rng(moved)
            inputs = {one: x * (1.0 + OWN_ERROR * rng.uniform(-1.0, 1.0, len(x))) for one, x in inputs.items()}
            parameters = {one: p * (1.0 + OWN_ERROR * rng.uniform(-1.0, 1.0)) for one, p in parameters.items()}
        found: Array = np.empty((len(run.outputs), states.count))
        with np.errstate(all="ignore"):
            for k, one in enumerate(run(inputs, parameters)):
                found[k] = one
        return found

    def evaluate(self, nodes: Sequence[Node]) -> Array:
        """``nodes`` at the states, shape (nodes, count)."""
        place = self.functions.place
        if all(node.index in place for node in nodes):
            return self._numbers[[place[node.index] for node in nodes]]
        return self._run(self.functions.of(nodes), self.states)

    def room(self, nodes: Sequence[Node]) -> Array:
        """By how much outputs may be off by rounding, shape (nodes, count): what a small move of all that is read does."""
        return self._room[[self.functions.place[node.index] for node in nodes]]

    def where(self, row: int, nodes: Sequence[Node]) -> str:
        """State ``row`` in words: what ``nodes`` read, and the parameters where they are not the law's defaults."""
        read = {(one.side, one.name) for one in _inputs(nodes)}
        first = [("", "time")] if ("", "time") in read else []
        rank = {name: k for k, name in enumerate(MOVING)}
        ordered = sorted(read - {("", "time")}, key=lambda key: (rank.get(key[1], len(rank)), key[1], key[0]))
        said = self.states.describe(row, ordered + first)
        names = dict.fromkeys(one.name for one in self.parameters if self._is_odd(one.name))
        with_these = ", ".join(f"{name}={_number(self.law.parameters[name])}" for name in names)
        return f"{said or 'any state'}{f' with {with_these}' if with_these else ''}"

    def _is_odd(self, name: str) -> bool:
        return bool(self.law.parameters[name] != self.law.params[name].default)

    def rows(self) -> list[int]:
        """The states at which the law is finite."""
        return np.flatnonzero(self.finite).tolist()


def _inputs(nodes: Sequence[Node]) -> list[Input]:
    return [node.value for node in walk(nodes) if node.op == "input"]


def _names(nodes: Sequence[Node]) -> set[str]:
    return {one.name for one in _inputs(nodes)}


def _outputs(trace: LawTrace) -> dict[str, Sequence[Node]]:
    found: dict[str, Sequence[Node]] = {}
    for method, nodes in (("force", trace.force), ("torque", trace.torque)):
        if nodes is not None:
            found[method] = nodes
    if trace.potential is not None:
        found["potential"] = (trace.potential,)
    return found


# The method itself


def values(trial: Trial) -> Iterator[Finding]:
    """What was traced against the method, called with arrays."""
    states, label = trial.states, trial.trace.label
    for method, nodes in _outputs(trial.trace).items():
        doing = "with arrays"
        try:
            called = _call(trial.law, method, states)
            doing = "again, with other objects,"
            turned = _call(trial.law, method, states, list(range(states.count))[::-1][:-1])
        except Exception as error:
            yield Finding(
                "values",
                method,
                f"{label}.{method}: called {doing} it raised {type(error).__name__}: {error}. It keeps something of an earlier call, "
                "or does what arrays cannot",
            )
            continue
        traced = trial.evaluate(nodes).T
        room = trial.room(nodes).T + TOLERANCE * np.abs(traced)
        bad = _rows_that_differ(called, traced, room)
        if len(bad):
            row = int(bad[0])
            yield Finding(
                "values",
                method,
                f"{label}.{method}: called with arrays it gives {_shown(called[row])}, but its expression {_shown(traced[row])}, at "
                f"{trial.where(row, nodes)}: it does something that no expression says, such as isinstance on a value, "
                "keeping an array of an earlier call, or asking how many objects there are",
            )
            continue
        bad = _rows_that_differ(turned[::-1], called[1:], room[1:])
        if len(bad):
            row = int(bad[0]) + 1
            yield Finding(
                "values",
                method,
                f"{label}.{method} gives {_shown(called[row])}, and {_shown(turned[::-1][row - 1])} when the same objects come in another "
                f"order and number, at {trial.where(row, nodes)}: each object's value may depend on nothing but its own",
            )


def _call(law: ContinuousLaw, method: str, states: States, rows: Sequence[int] | None = None) -> Array:
    """The method, called with views; shape (count, 3), or (count, 1) of potentials."""
    views = [states.view(side, rows) for side in states.sides]
    with np.errstate(all="ignore"):
        result: Array = np.asarray(getattr(as_arrays(law), method)(*views), dtype=float)
    return np.broadcast_to(result, (views[0].count, 1 if method == "potential" else 3))


def _rows_that_differ(one: Array, other: Array, room: Array) -> NDArray[np.intp]:
    """Rows in which two results are apart by more than ``room``, or only one of them is a number."""
    with np.errstate(all="ignore"):
        apart: Any = ~((np.abs(one - other) <= room) | (one == other) | (np.isnan(one) & np.isnan(other)))
    return np.flatnonzero(apart.any(axis=1))


def order(trial: Trial) -> Iterator[Finding]:
    """Whether a pair law does the same when its two objects change places."""
    trace = trial.trace
    if not trace.pair or trace.force is None or getattr(trial.law, "between", None) is not None:
        return
    run = trial.functions.of(trace.force)
    inputs = trial.states.inputs([*run.inputs, *(_other(one) for one in run.inputs)])
    swapped = run({one: inputs[_other(one)] for one in run.inputs}, trial.parameters)
    there = np.array([np.broadcast_to(one, trial.states.count) for one in swapped]).T
    here = trial.evaluate(trace.force).T
    bad = _rows_that_differ(here, -there, trial.room(trace.force).T + TOLERANCE * np.abs(here))
    if len(bad):
        row = int(bad[0])
        yield Finding(
            "order",
            "force",
            f"{trace.label}.force: on a it is {_shown(here[row])}, but {_shown(-there[row])} if a and b change places, at "
            f"{trial.where(row, trace.force)}: what happens depends on which of two objects was added first. "
            "Write it of both alike, or map it with between=(these, those)",
            None,
        )


def _other(one: Input) -> Input:
    return one._replace(side={"a": "b", "b": "a", "": ""}[one.side])


# The texts


def texts(trial: Trial) -> Iterator[Finding]:
    """The text for floats against that for arrays: the same bits where only arithmetic and roots occur."""
    for method, nodes in _outputs(trial.trace).items():
        run = scalar_function(nodes)
        inputs = {one: x.tolist() for one, x in trial.states.inputs(run.inputs).items()}
        alone = np.array(
            [run({one: x[k] for one, x in inputs.items()}, trial.parameters) for k in range(trial.states.count)]
        )
        whole = trial.evaluate(nodes).T
        exact = all(node.op in EXACT for node in walk(nodes))
        room = np.zeros_like(whole) if exact else trial.room(nodes).T + 1e-13 * np.abs(whole)
        bad = _rows_that_differ(alone, whole, room)
        if len(bad):
            row = int(bad[0])
            yield Finding(
                "text",
                method,
                f"{trial.trace.label}.{method}: one object at a time it is {_shown(alone[row])}, over arrays {_shown(whole[row])}, at "
                f"{trial.where(row, nodes)}: a fault of xPheve, please report it with the law",
            )


# Energy


def potential(trial: Trial) -> Iterator[Finding]:
    """Whether the potential falls by what the force gives: (F + dU/dx) . v = 0 for any v, on both sides of a pair."""
    trace = trial.trace
    if trace.potential is None:
        return
    label, read = trace.label, _names([trace.potential])
    for name in sorted(read & {"velocity", "angular_velocity"}):
        yield Finding(
            "potential",
            "potential",
            f"{label}.potential reads {name.replace('_', ' ')}, but a potential is an energy of places. Leave it out: the work of the law is "
            "then reported",
            PotentialError,
        )
        return
    if "time" in read:
        yield Finding(
            "potential", "potential", f"{label}.potential reads time, so that energy is not kept along the way", None
        )
    power, rate, size, both = trial.evaluate(trial.functions.energy)[:4]
    room = trial.room(trial.functions.energy)[3] + POWER_TOLERANCE * size
    with np.errstate(all="ignore"):
        bad = np.flatnonzero(np.abs(both) > room)
    if not len(bad):
        return
    row = int(bad[np.argmax(np.abs(both)[bad] / size[bad])])
    yield Finding(
        "potential",
        "potential",
        f"{label}.potential does not match force: at {trial.where(row, _concerned(trace))} the power is "
        f"{power[row]:.6g} W, so that the potential should change by {-power[row] + 0.0:.6g} J/s, but it changes by {rate[row]:.6g} J/s: the force "
        f"is not -dU/dx. {_why(trial, power, rate, size, room)}",
        PotentialError,
    )


def _concerned(trace: LawTrace) -> list[Node]:
    """What the balance of energy is about: force, potential and the motion, with torque and spin if the potential follows them."""
    assert trace.potential is not None
    turns = reads_orientation(trace.potential)
    moves = trace.force is not None or "position" in _names([trace.potential])
    names = [*(["velocity"] if moves else []), *(["angular_velocity"] if turns else [])]
    sides = ("a", "b") if trace.pair else ("",)
    inputs = [node for side in sides for name in names for node in inputs_of(trace.graph, name, side)]
    moving = [node for node in inputs if node is not None]
    return [*(trace.force or ()), *((trace.torque or ()) if turns else ()), trace.potential, *moving]


def _why(trial: Trial, power: Array, rate: Array, size: Array, room: Array) -> str:
    """What may be wrong: one factor everywhere, no force at all, or one side of a pair."""
    moving = np.isfinite(power) & np.isfinite(rate) & (size > 0.0)
    if not moving.any():
        return "Check it"
    if (np.abs(power[moving]) <= 1e-9 * size[moving]).all():
        return "The force does no work at all: it lacks what the potential says, or the potential should be left out"
    if trial.trace.pair:
        wrong = np.abs(power + rate) > room
        for side, other in (("a", "b"), ("b", "a")):
            alone = [row for row in np.flatnonzero(moving).tolist() if trial.states.at_rest(row, other)]
            if alone and not wrong[alone].any():
                return f"It is right for {side}, not for {other}: when {other} moves, it must change as if {side} had moved the other way"
    with np.errstate(all="ignore"):
        ratio = (-rate / power)[moving & (np.abs(power) > 1e-6 * size)]
    if len(ratio) and np.ptp(ratio) <= 1e-6 * np.abs(ratio).max():
        factor = float(ratio.mean())
        if abs(factor + 1.0) < 1e-6:
            return "Its sign is wrong"
        if abs(factor) < 1e-6:
            return "It does not change where the force acts: a term was left out"
        return f"It is {factor:.6g} times what it should be. Check the factor{' and sign' if factor < 0 else ''}"
    return "Check signs, factors, parameters and terms left out"


def _does_no_work(trial: Trial) -> bool:
    """Whether a law without potential, or what the potential leaves out, has no power."""
    power, _, size, _, turning, turning_size = trial.evaluate(trial.functions.energy)
    if trial.trace.potential is not None:
        power, size = turning, turning_size
    moving = np.isfinite(power) & np.isfinite(size)
    return bool((np.abs(power[moving]) <= 1e-12 * size[moving]).all())


# Derivatives


def jacobians(trial: Trial) -> Iterator[Finding]:
    """Jacobians, and the gradient of the potential, against central differences."""
    trace = trial.trace
    for side in trial.states.sides:
        for name in MOVING:
            for method, nodes in _outputs(trace).items():
                if not any(one.side == side and one.name == name for one in _inputs(nodes)):
                    continue
                rows = (gradient(trace, name, side),) if method == "potential" else jacobian(trace, name, side, method)
                yield from _derivative_findings(trial, method, nodes, rows, name, side)


def _derivative_findings(
    trial: Trial, method: str, nodes: Sequence[Node], rows: Sequence[Sequence[Node]], name: str, side: str
) -> Iterator[Finding]:
    states = trial.states
    run = trial.functions.of(nodes)
    inputs = states.inputs(run.inputs)
    slopes = trial.functions.of([one for row in rows for one in row])

    def slopes_at(moved: dict[Input, Array]) -> Array:
        """All slopes, shape (outputs, components, count)."""
        there = {**states.inputs(slopes.inputs), **moved}
        found: Array = np.empty((len(slopes.outputs), states.count))
        for place, one in enumerate(slopes(there, trial.parameters)):
            found[place] = one
        return found.reshape(len(rows), -1, states.count)

    exact = slopes_at({})
    length = np.abs(states.array(side, name)).max(axis=1)
    h = 1e-5 * np.where(length > 0.0, length, 1e-3)
    noise = 1e-2 * trial.room(nodes) / h + SMALLEST / h
    for k in range(exact.shape[1]):
        key = Input(side, name, k)
        if key not in inputs:
            continue

        def at(step: Array, key: Input = key) -> Array:
            found = run({**inputs, key: inputs[key] + step}, trial.parameters)
            return np.array([np.broadcast_to(one, states.count) for one in found])

        with np.errstate(all="ignore"):
            wide, near = (at(h) - at(-h)) / (2 * h), (at(h / 2) - at(-h / 2)) / h
            off = np.abs((4 * near - wide) / 3 - exact[:, k])
            # a difference quotient is a mean of the slopes between, so that it may be off by as much as they differ
            beside = [slopes_at({key: inputs[key] + step}) for step in (h, -h)]
            span = np.fmax(*(np.abs(one[:, k] - exact[:, k]) for one in beside))
            room = 2 * np.abs(near - wide) + 2 * span + noise + 1e-7 * np.abs(exact).max(axis=(0, 1))
            bad = np.argwhere(off > room)
        if len(bad):
            i, row = bad[0].tolist()
            yield Finding(
                "jacobian",
                method,
                f"{trial.trace.label}.{method}: its derivative by {side + '.' if side else ''}{name} is {exact[i, k, row]:.9g} [{i}, {k}], but "
                f"differences give {near[i, row]:.9g}, at {trial.where(row, nodes)}: it jumps there, or this is a fault of xPheve",
            )
            return


# Finite


def finite(trial: Trial) -> Iterator[Finding]:
    """Whether the law is finite at the states tried; what `singular` says needs no remark, nor a table that ends."""
    if trial.finite.all() or trial.law.singular:
        return
    for method, nodes in _outputs(trial.trace).items():
        tables = [node.value.base for node in walk(nodes) if node.op == "table"]
        numbers = trial.evaluate(nodes).T
        bad = np.flatnonzero(~np.isfinite(numbers).all(axis=1))
        if not len(bad):
            continue
        row = int(bad[0])
        ends = [table for table in tables if table.outside == "error"]
        hint = f"{ends[0]!r} ends there: give outside='hold' or 'extend', or say so in `singular`" if ends else (
            "use np.where or np.maximum there, or say in `singular` why there is no value"
        )  # fmt: skip
        yield Finding(
            "finite",
            method,
            f"{trial.trace.label}.{method} is {_shown(numbers[row])} at {trial.where(row, nodes)}: {hint}",
            None,
        )


def _number(value: Any) -> str:
    return f"({', '.join(f'{one:.6g}' for one in value)})" if isinstance(value, tuple) else f"{value:.6g}"


def _shown(row: Any) -> str:
    numbers = np.asarray(row, dtype=float).tolist()
    return f"({', '.join(f'{one:.9g}' for one in numbers)})" if len(numbers) > 1 else f"{numbers[0]:.9g}"
