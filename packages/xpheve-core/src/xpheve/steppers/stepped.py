"""What steppers share that make one step after another, and are read between them off a polynomial through the steps' ends."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.kernels import spin, turning
from xpheve.kernels.clock import Instant, elapsed
from xpheve.steppers.contract import Array, Grid, Rows, Settings, Sources, State, Stop
from xpheve.steppers.flights import FlightState
from xpheve.steppers.nodes import Newton, Node
from xpheve.steppers.smooth import Smooth

PLACES = ("earlier", "begin", "end")
"""Nodes of the path: position, velocity and acceleration, (9, rows) each, at three times; the present step goes from the second to the third."""
TURNS = ("earlier_turn", "begin_turn", "end_turn")
"""The same of the orientation: q, q' and q'', (12, rows) each."""
KEPT = {name: 9 for name in PLACES} | {name: 12 for name in TURNS} | {"span": 1, "ago": 1, "rests": 6, "momentum": 6}
"""``span`` [s] is how long the present step is, 0 before the first; ``ago`` how long after its beginning the earliest node is (before: below 0);
``rests`` what sums of position and velocity have left over; ``momentum`` L / A [rad/s], and what its sum has left over."""


class Stepped(Smooth):
    """Rows that are known at the ends of their steps, all rows of a batch at the same ones.

    The present step goes from ``begin`` to ``end``; ``end`` is where the batch is covered.
    """

    parts: ClassVar[bool] = True
    extra: ClassVar[dict[str, int]] = {}
    """Arrays that a subclass keeps besides, by their widths."""

    @abstractmethod
    def path(self, begin: Node, end: Node, earlier: Node, span: Array, ago: Array) -> Newton:
        """The polynomial of a step in the time [s] since its beginning; ``span`` and ``ago`` are those of `KEPT`, (1, rows)."""

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        state = self.new_state(KEPT | self.extra, {"base": t[0], "offset": t[1], "steps": 0.0, "evaluations": 0.0})
        self.join(state, rows, bodies, t)
        return state

    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        assert isinstance(state, FlightState)
        first = state.count
        super().join(state, rows, bodies, t)
        state.numbers["base"], state.numbers["offset"] = t
        self._settle(state, bodies, np.arange(first, state.count))

    def merge(self, state: State, other: State, bodies: Bodies, settings: Settings) -> bool:
        """Two batches make the same steps as one."""
        if state.numbers["turning"] != other.numbers["turning"]:
            return False
        rows = np.concatenate([state.rows, other.rows])
        order = np.argsort(rows)
        state.rows = rows[order]
        for name, array in state.arrays.items():
            state.arrays[name] = np.concatenate([array, other.arrays[name]], axis=1)[:, order]
        for name in ("steps", "evaluations"):
            state.numbers[name] = max(state.numbers[name], other.numbers[name])
        bodies.local[state.rows] = np.arange(state.count)
        state.locate()
        return True

    def covered(self, state: State) -> Instant:
        return state.numbers["base"], state.numbers["offset"]

    # Steps

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        begin = self.covered(state)
        if begin >= need:
            return Stop(begin, ())
        return self.stride(state, bodies, Grid(begin, elapsed(wall, begin), 0), 1, settings, sources)

    def _put_beginning(self, state: FlightState, bodies: Bodies, t: Instant) -> None:
        """Write the state at the beginning of the present step, which was just made, into the bodies."""
        state.made.clear()
        rows, begin = state.rows, state.arrays["begin"]
        bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows] = begin[:3], begin[3:6]
        state.arrays["acceleration"] = begin[6:].copy()
        bodies.clock[0, rows], bodies.clock[1, rows] = t
        if state.numbers["turning"] == 1.0:
            turn = node_of(state.arrays["begin_turn"])
            bodies.arrays["orientation"][:, rows], bodies.arrays["angular_velocity"][:, rows] = (
                turn.place,
                spin_of(turn),
            )
            bodies.turn_clock[:, rows] = bodies.clock[:, rows]
        self.begin(state, bodies, slice(None))
        bodies.change += 1

    # Rows that were written

    def cut(self, state: FlightState, bodies: Bodies, places: Rows, t: Instant) -> None:
        """The present step of the rows at ``places`` ends at ``t``."""

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        assert isinstance(state, FlightState)
        together = self.together(bodies, rows, sources)
        places = self.changed_locals(bodies, together)
        kept = state.arrays["rests"][:, places], state.arrays["momentum"][:, places]
        same = ~self._written(state, bodies, places) & (self.covered(state) == t)
        self.cut(state, bodies, places, t)
        self.rebase(state, bodies, places, t)
        state.numbers["base"], state.numbers["offset"] = t
        self._settle(state, bodies, places)
        for name, values in zip(("rests", "momentum"), kept, strict=True):
            state.arrays[name][:, places[same]] = values[:, same]
        return together

    def _settle(self, state: FlightState, bodies: Bodies, places: Rows) -> None:
        """The rows at ``places`` are, at the covered instant, what the bodies say; how they came there is forgotten."""
        state.made.clear()
        arrays, held = state.arrays, self.held(state, bodies, places)
        for name in ("span", "ago", "rests"):
            arrays[name][:, places] = 0.0
        arrays["end"][:, places] = np.concatenate([held["position"], held["velocity"], np.zeros((3, len(places)))])
        arrays["end_turn"][:, places] = 0.0
        arrays["end_turn"][:4, places] = held["orientation"]
        arrays["end_turn"][4:8, places] = rate_of(held["orientation"], held["angular_velocity"])
        arrays["momentum"][:, places] = 0.0
        for k in places[held["angular_velocity"].any(axis=0)].tolist():
            row = int(state.rows[k])
            q: Any = bodies.get("orientation", row)
            omega: Any = bodies.get("angular_velocity", row)
            inertia: Any = bodies.get("inertia", row)
            arrays["momentum"][:, k] = (*spin.stretched(q, omega, spin.excess_of(inertia)), 0.0, 0.0, 0.0)
        self.begin(state, bodies, places)

    def _take_up_rotation(self, state: FlightState, bodies: Bodies) -> None:
        """From now on rotation is made in steps: rows are brought to the covered instant in closed form."""
        t = self.covered(state)
        for local, row in enumerate(state.rows.tolist()):
            turned = {
                name: self.read_row(state, bodies, t, name, local) for name in ("orientation", "angular_velocity")
            }
            for name, values in turned.items():
                bodies.put(name, row, values)
            bodies.turn_clock[0, row], bodies.turn_clock[1, row] = t
        kept = state.arrays["rests"].copy()
        self.rebase(state, bodies, slice(None), t)
        state.numbers["turning"] = 1.0
        self._settle(state, bodies, np.arange(state.count))
        state.arrays["rests"] = kept

    # Reading

    def curve(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        return self._path(state, t, places, PLACES)

    def turned(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        q, rate = self._path(state, t, places, TURNS)
        size = np.sqrt((q * q).sum(axis=0))
        node = Node(q / size, rate / size, rate)
        return node.place, spin_of(node)

    def read_times(self, state: State, bodies: Bodies, times: Sequence[Instant], name: str, local: int) -> Array:
        """The polynomial of one row at many times together."""
        assert isinstance(state, FlightState)
        place = np.array([local], dtype=np.int64)
        span = state.arrays["span"][:, place]
        still = not span[0, 0] or bool(self._written(state, bodies, place)[0])
        if name not in ("position", "velocity") or still:
            return super().read_times(state, bodies, times, name, local)
        end = node_of(state.arrays[PLACES[2]][:, place])
        back = np.array([elapsed(t, self.covered(state)) for t in times])
        found = self._polynomial(state, PLACES).of(place).at(span + back)
        which = 0 if name == "position" else 1
        values: Array = np.where(back == 0.0, (end.place, end.rate)[which], found[which])
        return values

    def _path(self, state: FlightState, t: Instant, places: slice | Rows, names: Sequence[str]) -> tuple[Array, Array]:
        """Places and their derivatives at ``t``; of all rows they are kept for the next look at that instant, so nobody writes into them."""
        end = node_of(state.arrays[names[2]][:, places])
        back = elapsed(t, self.covered(state))
        if back == 0.0:
            return end.place.copy(), end.rate.copy()
        whole = isinstance(places, slice)
        last = state.made.get(names[1]) if whole else None
        if last is not None and last[0] == back:
            return last[1], last[2]
        span = state.arrays["span"][:, places]
        place, rate = self._polynomial(state, names).of(places).at(span + back)
        known = span != 0.0
        place, rate = np.where(known, place, end.place), np.where(known, rate, end.rate)
        if whole:
            state.made[names[1]] = back, place, rate
        return place, rate

    def _polynomial(self, state: FlightState, names: Sequence[str]) -> Newton:
        """The polynomials of all rows over the present step; where there is none, anything."""
        found: Newton | None = state.made.get(names[0])
        if found is None:
            earlier, begin, end = (node_of(state.arrays[name]) for name in names)
            span, ago = state.arrays["span"], state.arrays["ago"]
            known = span != 0.0
            found = self.path(begin, end, earlier, np.where(known, span, 1.0), np.where(known, ago, -1.0))
            state.made[names[0]] = found
        return found


def node_of(kept: Array) -> Node:
    """A node from how rows keep it: three parts, one below the other."""
    width = len(kept) // 3
    return Node(kept[:width], kept[width : 2 * width], kept[2 * width :])


def rate_of(q: Array, omega: Array) -> Array:
    """q' = w q / 2 of columns, as `xpheve.kernels.turning` has it for one."""
    return np.array(turning.rate_of(tuple(q), tuple(omega)))


def spin_of(turn: Node) -> Array:
    """Angular velocity of columns, from q and q', whose part along q only rounding makes."""
    q: Any = tuple(turn.place)
    return np.array(turning.spin_of(q, turning.across(q, tuple(turn.rate))))
