"""Whether the forces on a group are stiff: something decays far faster than the state changes, so that explicit steps would crawl.

Where a group is planned its equations of motion y' = g(y), y = (x, v), are taken as linear, C = dg/dy by the traces of its laws. They are stiff if

- the fastest decay that does not oscillate, at the rate L, is `FAST` times as fast as anything that oscillates or grows;
- and over `FAST` / L, by one step of implicit Euler (Hairer, Wanner, Solving ODEs II, IV.3), the places move by less than `STILL` of themselves:
  or the velocities do, where forces read only these.

So a ball under drag is not stiff as long as its speed changes, nor is a spring, however hard, while it swings; one that creeps back in honey is.
Forces that read no velocity have no decay and are not looked at. The same is asked again a little ahead along the motion, because where a
reaction begins with nothing, nothing decays yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import ContinuousLaw, PairLaw
from xpheve.plan.driven import immovable
from xpheve.plan.hand_kernels import formula_of
from xpheve.steppers.contract import Array

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.world import World
    from xpheve.trace.graph import Input
    from xpheve.trace.numpy_text import GraphFunction

FAST = 1e3
"""So many times must be between what decays and what else goes on: steps of an explicit method of high order, less than 1 / L long, would be
as many where an implicit one needs a few."""
STILL = 0.1
"""Change by this part, or more, is change."""
AHEAD = 1e-3
"""How far ahead along the motion it is asked again, by the time in which the velocity changes by itself."""
LARGEST = 64
"""Objects of a group; larger ones take longer to look at than some steps, and are not called stiff unless by wish."""

_FUNCTIONS: dict[Any, GraphFunction] = {}


def is_stiff(world: World, group: Sequence[PhysicalObject]) -> bool:
    """Whether forces on ``group`` decay far faster than its state changes."""
    if len(group) > LARGEST or any(obj._row < 0 for obj in group):
        return False
    laws = {law: None for obj in group for law in world.continuous_laws(obj)}
    traces = [formula_of(law) for law in laws]
    if not may_decay(traces):
        return False
    system = _System(world, group, [law for law in world.ordered_laws(laws) if isinstance(law, ContinuousLaw)])
    x, v = system.state
    reads_places = any("position" in trace.reads for trace in traces if trace is not None)
    with np.errstate(all="ignore"):
        a, by_x, by_v = system.derivatives(x, v)
        if _is_stiff(x, v, a, by_x, by_v, reads_places):
            return True
        speed, push = float(np.abs(v).max()), float(np.abs(a).max())
        if not (0.0 < speed < np.inf and 0.0 < push < np.inf):
            return False
        span = AHEAD * speed / push
        x, v = x + span * v, v + span * a
        return _is_stiff(x, v, *system.derivatives(x, v), reads_places)


def may_decay(traces: Sequence[Any]) -> bool:
    """Whether a law reads velocities, all have formulas that can be derived, and none turns objects."""
    from xpheve.trace.graph import walk

    if not any(trace is not None and "velocity" in trace.reads for trace in traces):
        return False
    return not any(
        trace is None
        or trace.torque is not None
        or {"orientation", "angular_velocity"} & trace.reads
        or any(node.op == "kernel" for node in walk(trace.motion))
        for trace in traces
    )


def _is_stiff(x: Array, v: Array, a: Array, by_x: Array, by_v: Array, reads_places: bool) -> bool:
    """What the module says, of places and velocities (3 n), accelerations and their derivatives (3 n, 3 n)."""
    n = len(x)
    system = np.block([[np.zeros((n, n)), np.eye(n)], [by_x, by_v]])
    slope = np.concatenate([v, a])
    if not (np.isfinite(system).all() and np.isfinite(slope).all()):
        return False
    rates = np.linalg.eigvals(system)
    size = np.abs(rates)
    decays = (rates.real < 0.0) & (np.abs(rates.imag) <= 0.5 * -rates.real)
    fastest = float(size[decays].max(initial=0.0))
    # Rates that are 0 but for rounding, such as a free object's, are roots of what rounding left: they count for nothing.
    noise = 1e-7 * float(size.max(initial=0.0))
    others = size[~decays & (size > noise)]
    if fastest <= noise or float(others.max(initial=0.0)) * FAST > fastest:
        return False
    span = FAST / fastest
    change = np.linalg.solve(np.eye(2 * n) - span * system, span * slope)
    if not np.isfinite(change).all():
        return False
    state, moved = (x, change[:n]) if reads_places else (v, change[n:])
    return float(np.abs(moved).max()) < STILL * float(np.abs(state).max())


class _System:
    """The equations of motion of one group."""

    def __init__(self, world: World, group: Sequence[PhysicalObject], laws: Sequence[ContinuousLaw]) -> None:
        from xpheve.plan.programs import term_of

        self.world, self.group, self.laws = world, list(group), laws
        self.places = {obj: k for k, obj in enumerate(self.group)}
        self.state = self._read("position"), self._read("velocity")
        self.terms = [(law, term) for law in laws if (term := term_of(world, law)) is not None]

    def _read(self, name: str) -> Array:
        return np.array([self.world.read_row(obj._row, name) for obj in self.group]).ravel()

    def derivatives(self, x: Array, v: Array) -> tuple[Array, Array, Array]:
        """Accelerations (3 n) at places ``x`` and velocities ``v``, and their derivatives by both (3 n, 3 n)."""
        from xpheve.loop.program import values_of

        n = len(x)
        bodies = self.world.bodies
        mass = np.repeat([bodies.get("mass", obj._row)[0] for obj in self.group], 3)
        force = np.concatenate([bodies.get("force", obj._row) for obj in self.group])
        slopes = {"position": np.zeros((n, n)), "velocity": np.zeros((n, n))}
        for law, term in self.terms:
            trace = term.trace
            if trace.force is None or not law.enabled:
                continue
            numbers = dict(zip(trace.parameters, values_of(law, term), strict=False))
            function, which = _function_of(trace)
            for sides in self._acting(law):
                inputs = {one: self._value(law, one, sides[one.side or "a"], x, v) for one in function.inputs}
                found = function(inputs, numbers)
                self._add(found, which, sides, force, slopes)
        return force / mass, slopes["position"] / mass[:, None], slopes["velocity"] / mass[:, None]

    def _acting(self, law: ContinuousLaw) -> list[dict[str, PhysicalObject]]:
        """The objects of the group that ``law`` acts on, or its pairs with one in the group."""
        members = self.world.mapping.objects(law)
        if not isinstance(law, PairLaw):
            return [{"a": obj} for obj in self.group if obj in members]
        from xpheve.plan.groups import partners

        found: dict[frozenset[Any], dict[str, PhysicalObject]] = {}
        for obj in self.group:
            if obj not in members:
                continue
            for side, others in partners(self.world, law, obj):
                for other in others:
                    if other is not obj and not (immovable(other) and other in self.places):
                        pair = (other, obj) if side == 2 else (obj, other)
                        found.setdefault(frozenset(pair), {"a": pair[0], "b": pair[1]})
        return list(found.values())

    def _add(
        self,
        found: Sequence[float],
        which: Sequence[tuple[str, str, int, int]],
        sides: dict[str, PhysicalObject],
        force: Array,
        slopes: dict[str, Array],
    ) -> None:
        for target, sign in (("a", 1.0), ("b", -1.0)):
            row = self.places.get(sides[target]) if target in sides else None
            if row is None:
                continue
            force[3 * row : 3 * row + 3] += sign * np.array(found[:3])
            for (side, name, r, c), value in zip(which, found[3:], strict=True):
                column = self.places.get(sides[side or "a"])
                if column is not None:
                    slopes[name][3 * row + r, 3 * column + c] += sign * value

    def _value(self, law: ContinuousLaw, one: Input, obj: PhysicalObject, x: Array, v: Array) -> float:
        """The number that ``law`` reads of ``obj``."""
        world, row, place = self.world, obj._row, self.places.get(obj)
        if one.name == "time":
            return world.time[0]
        if one.name == "up":
            return float(world.up_vector[one.component])
        if one.name in ("position", "velocity") and place is not None:
            return float((x if one.name == "position" else v)[3 * place + one.component])
        if one.name in ("position", "velocity", "orientation", "angular_velocity"):
            return float(world.read_row(row, one.name)[one.component])
        if one.name in ("mass", "inertia"):
            return float(world.bodies.get(one.name, row)[one.component])
        if one.name == "volume":
            return float(world.evaluator.volumes(np.array([row]))[0])
        if one.name == "since":
            return world.evaluator.since(law, obj)
        return float(world.bodies.columns[one.name][row])


def _function_of(trace: Any) -> tuple[GraphFunction, list[tuple[str, str, int, int]]]:
    """The force of a trace and its derivatives that are not zero, on floats; and which these are: side, input, row, column."""
    from xpheve.loop.jacobian_text import slopes_of_force
    from xpheve.trace.numpy_text import scalar_function

    found = _FUNCTIONS.get(trace)
    if found is None:
        slopes = slopes_of_force(trace)
        function = scalar_function([*trace.force, *(slope[-1] for slope in slopes)])
        found = _FUNCTIONS[trace] = function, [slope[:-1] for slope in slopes]  # type: ignore[assignment]
    return found  # type: ignore[return-value]
