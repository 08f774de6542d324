"""Kepler: two bodies under inverse-square forces, or one about a fixed centre, in closed form."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import LawFailedError, StateError
from xpheve.kernels import kepler
from xpheve.kernels.clock import NEVER, Instant, later
from xpheve.kernels.elliptic import pair_add, pair_div, pair_mul, sum_exact
from xpheve.steppers.contract import (
    Array,
    Attraction,
    Offer,
    Refusal,
    Rows,
    Settings,
    Signature,
    Sources,
    State,
    Stop,
    Vec,
)
from xpheve.steppers.flights import FlightState
from xpheve.steppers.kepler_arrays import PLACES, moved, prepared
from xpheve.steppers.smooth import Smooth
from xpheve.steppers.sums import exact_spans

FEW = 8
"""Rows up to which floats are quicker than arrays; both give the same bits."""
BEFORE_FALL = 1.0 - 2.0**-40
"""Of the time until a body falls into the centre, the part that is served."""
WIDTHS = {"orbit": PLACES, "pair": 1, "share": 1, "drift": 6, "common": 3, "begun": 1, "end": 2}
"""Numbers of a row: its orbit; the serial of the lesser of its two; its part in their distance; the velocity of their centre of mass as pairs;
the acceleration of both alike; whether it has an orbit; and until when it is known."""

Motion = tuple[Array, Array]


class _Held(NamedTuple):
    """Positions and velocities at one time, of all rows or of single ones."""

    t: Instant
    change: int
    every: list[Motion]
    single: dict[int, Motion]
    solved: dict[tuple[float, float, float], tuple[Vec, Vec, Vec]]
    """Solutions of Kepler's equation, by pair and time since its beginning: two bodies share one."""


class KeplerState(FlightState):
    """A `FlightState` with what was read last, and which rows share an orbit."""

    def __init__(self) -> None:
        super().__init__(np.zeros(0, dtype=np.int64))
        self.held: _Held | None = None
        self.orbits: tuple[Rows, Rows, Array] | None = None
        """A row for each orbit, for each row its orbit among those, and their constants."""
        self.many: tuple[tuple[Any, ...], Motion] | None = None
        """One row at many times, as read last."""

    def locate(self) -> None:
        super().locate()
        self.held = self.orbits = self.many = None


class Kepler(Smooth):
    """Two bodies that attract or repel one another with the inverse square of their distance, or one that a fixed centre does.

    Nothing is stepped: each read is one solution of Kepler's equation from the state at the last event. The centre of mass moves uniformly, or
    falls, where stored forces accelerate both bodies alike. Rotation is free, and in closed form.
    """

    id: ClassVar[str] = "core:kepler"
    promise: ClassVar[str] = "closed form of two bodies, exact to rounding"

    def offer(self, signature: Signature) -> Offer | Refusal:
        reason = self.refusal(signature)
        if reason:
            return Refusal(reason)
        if signature.form != "two bodies":
            return Refusal("not two bodies, or one and a fixed centre, under inverse-square forces alone")
        if signature.torque == "general":
            return Refusal("a torque that is not about a principal axis of the spin")
        return Offer(math.inf, 2.0, True)

    # Rows come, change and go

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        state = KeplerState()
        state.arrays |= {name: np.zeros((width, 0)) for name, width in ({"since": 2} | WIDTHS).items()}
        state.numbers = {"turning": 0.0}
        self.join(state, rows, bodies, t)
        return state

    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        first = state.count
        super().join(state, rows, bodies, t)
        self._await(state, slice(first, None), t)

    def leave(self, state: State, local: int) -> None:
        super().leave(state, local)
        assert isinstance(state, KeplerState)
        state.held = state.orbits = state.many = None

    def _await(self, state: State, places: slice | Rows, t: Instant) -> None:
        """The rows at ``places`` stand as they were written at ``t``, until their orbits are found."""
        arrays = state.arrays
        arrays["begun"][:, places] = 0.0
        arrays["pair"][:, places] = -1.0
        arrays["since"][:, places] = arrays["end"][:, places] = np.array(t)[:, None]
        assert isinstance(state, KeplerState)
        state.held = state.orbits = state.many = None

    def covered(self, state: State) -> Instant:
        if not state.count:
            return NEVER
        end = state.arrays["end"]
        first = end[0] == end[0].min()
        return float(end[0].min()), float(end[1][first].min())

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        assert isinstance(state, KeplerState)
        waiting = np.flatnonzero(state.arrays["begun"][0] == 0.0)
        if not len(waiting):
            if self.covered(state) < need:
                self._report_fall(state, bodies, sources)
            return Stop(self.covered(state), ())
        rows = state.rows[waiting].tolist()
        self._begin(state, bodies, rows, self.covered(state), sources)
        if (state.arrays["begun"][0] == 0.0).any():
            raise StateError(f"{self.id}: the forces on some objects are of another form than when they were planned")
        return Stop(self.covered(state), rows)

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        assert isinstance(state, KeplerState)
        joined = self.together(bodies, rows, sources)
        places = self.changed_locals(bodies, joined)
        self.rebase(state, bodies, places, t)
        self._take_forces(state, bodies, places)
        self._await(state, places, t)
        with contextlib.suppress(LawFailedError):  # if it is still so when time passes, `advance` says it
            self._begin(state, bodies, joined, t, sources)
        return joined

    # From states to orbits

    def _begin(
        self, state: KeplerState, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> None:
        """Find the orbits of ``rows``, which stand at ``t``; those of which the forces have another form by now wait."""
        found = {} if sources is None else sources.attractions(rows)
        alone = {row: one for row, one in found.items() if one.row < 0}
        lesser = {row: one for row, one in found.items() if one.row > row and one.row in found}
        if alone:
            self._begin_alone(state, bodies, alone, t)
        if lesser:
            self._begin_pairs(state, bodies, lesser, t)
        state.held = state.orbits = state.many = None
        state.facts = None

    def _begin_alone(self, state: KeplerState, bodies: Bodies, found: dict[int, Attraction], t: Instant) -> None:
        """Single bodies, each about a fixed centre."""
        rows = np.array(list(found), dtype=np.int64)
        places = np.array([one.place for one in found.values()]).T
        d = sum_exact(bodies.arrays["position"][:, rows], -places)  # type: ignore[arg-type]
        v = bodies.arrays["velocity"][:, rows]
        orbits = self._orbits(bodies, [(row,) for row in found], d, (v, np.zeros_like(v)), list(found.values()))
        self._put(state, bodies, rows, rows, orbits, np.ones(len(rows)), np.zeros((6, len(rows))), t)

    def _begin_pairs(self, state: KeplerState, bodies: Bodies, found: dict[int, Attraction], t: Instant) -> None:
        """Pairs of bodies, by the lesser row of each."""
        a, b = np.array(list(found), dtype=np.int64), np.array([one.row for one in found.values()], dtype=np.int64)
        x: Any = bodies.arrays["position"]
        w: Any = bodies.arrays["velocity"]
        d, v = sum_exact(x[:, a], -x[:, b]), sum_exact(w[:, a], -w[:, b])
        pairs = list(zip(a.tolist(), b.tolist(), strict=True))
        orbits = self._orbits(bodies, pairs, d, v, list(found.values()))
        m, n = bodies.arrays["mass"][0, a], bodies.arrays["mass"][0, b]
        scale = -np.frexp(np.maximum(m, n))[1]
        m, n = np.ldexp(m, scale), np.ldexp(n, scale)
        none: Any = np.zeros_like(m)
        total: Any = sum_exact(m, n)
        shares: list[Any] = [pair_div((one, none), total) for one in (n, -m)]
        # v_c = v_a - (n / (m + n)) (v_a - v_b), or the same from v_b: nothing of a great mass is lost in it
        first = m >= n
        part: Any = tuple(np.where(first, shares[0][k], shares[1][k]) for k in range(2))
        base = np.where(first, w[:, a], w[:, b])
        away = pair_mul(part, v)
        drift = pair_add((base, np.zeros_like(base)), (-away[0], -away[1]))
        drifts = np.concatenate(drift)
        for which, share in zip((a, b), shares, strict=True):
            self._put(state, bodies, which, a, orbits, share[0], drifts, t)

    def _orbits(
        self, bodies: Bodies, rows: Sequence[tuple[int, ...]], d: Any, v: Any, found: list[Attraction]
    ) -> Array:
        """The constants of orbits; raises `LawFailedError` if there is no distance, or numbers are beyond all floats."""
        mu = np.array([one.mu for one in found]).T
        for k in np.flatnonzero(~d[0].any(axis=0)).tolist():
            if mu[0, k]:
                where = "are in one place" if len(rows[k]) > 1 else f"is in the centre of its force, {found[k].place}"
                said = f"{found[k].laws}: {_named(bodies, rows[k])} {where}, where the force is infinite. {_way_out(found[k])}"
                raise LawFailedError(said, found[k].law)
            d[0][0, k] = 1.0  # without a force nothing asks where it is
        orbits = prepared(d, v, mu)
        bad = ~np.isfinite(np.delete(orbits, [7, 8], axis=0)).all(axis=0)
        for k in np.flatnonzero(bad).tolist()[:1]:
            raise LawFailedError(
                f"{found[k].laws}: the orbit of {_named(bodies, rows[k])} has numbers beyond all floats: mu = {mu[0, k]} m^3/s^2, "
                f"distance {d[0][:, k].tolist()} m, velocity {v[0][:, k].tolist()} m/s: use other units",
                found[k].law,
            )
        return orbits

    def _put(
        self,
        state: KeplerState,
        bodies: Bodies,
        rows: Rows,
        lesser: Rows,
        orbits: Array,
        share: Array,
        drift: Array,
        t: Instant,
    ) -> None:
        """Give ``rows`` their orbits; ``lesser`` are the rows by which these are known."""
        arrays, places = state.arrays, bodies.local[rows]
        common = arrays["acceleration"][:, places]
        arrays["orbit"][:, places] = orbits
        arrays["pair"][0, places] = bodies.serial[lesser]
        arrays["share"][0, places] = share
        arrays["drift"][:, places] = drift
        arrays["common"][:, places] = common
        with np.errstate(over="ignore"):
            pull = orbits[3] / orbits[9] / orbits[9] * orbits[2] * orbits[1]  # mu / r^2 in units of speed and time
            arrays["acceleration"][:, places] = common - share * pull * orbits[12:15]
        arrays["since"][:, places] = bodies.clock[:, rows]
        arrays["end"][:, places] = np.array(NEVER)[:, None]
        for k in np.flatnonzero(np.isfinite(orbits[8])).tolist():
            arrays["end"][:, places[k]] = later(t, orbits[8, k] / orbits[1, k] * BEFORE_FALL)
        arrays["begun"][0, places] = 1.0

    def _report_fall(self, state: KeplerState, bodies: Bodies, sources: Sources | None) -> None:
        """Raise `LawFailedError`: two bodies fall into one another now."""
        end = state.arrays["end"]
        rows = state.rows[end[0] == end[0].min()].tolist()
        one = ({} if sources is None else sources.attractions(rows)).get(rows[0])
        pair = rows[:1] if one is None or one.row < 0 else [rows[0], one.row]
        into = f" falls into the centre of its force, {one.place}," if len(pair) == 1 and one is not None else " meet"
        raise LawFailedError(
            f"{self.id if one is None else one.laws}: {_named(bodies, pair)}{into} at t = {end[0].min()} s, where the force is infinite. "
            f"{'' if one is None else _way_out(one)}",
            None if one is None else one.law,
        )

    # From orbits to states

    def _written(self, state: FlightState, bodies: Bodies, places: slice | Rows) -> Any:
        return super()._written(state, bodies, places) | (state.arrays["begun"][0, places] == 0.0)

    def curve(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> Motion:
        assert isinstance(state, KeplerState)
        held = state.held
        if held is None or held.t != t or held.change != bodies.change:
            held = state.held = _Held(t, bodies.change, [], {}, {})
        if isinstance(places, slice):
            if not held.every:
                held.every.append(self._curve(state, bodies, t, np.arange(state.count)[places]))
            return held.every[0]
        if len(places) != 1:
            return self._curve(state, bodies, t, places)
        local = int(places[0])
        if local not in held.single:
            held.single[local] = self._curve(state, bodies, t, places)
        return held.single[local]

    def read_times(self, state: State, bodies: Bodies, times: Sequence[Instant], name: str, local: int) -> Array:
        """The orbit is one and its times are many: they are solved together, once for place and velocity."""
        assert isinstance(state, KeplerState)
        if name not in ("position", "velocity") or self._written(state, bodies, np.array([local]))[0]:
            return super().read_times(state, bodies, times, name, local)
        key = (bodies.change, local, *times)
        if state.many is None or state.many[0] != key:
            t, low = np.array(times).T
            s, rest = exact_spans((t, low), *bodies.clock[:, state.rows[local]])
            parts = moved(state.arrays["orbit"][:, local : local + 1], s, rest)
            state.many = key, self._moved_by(state, bodies, slice(local, local + 1), s, rest, parts)
        return state.many[1][0 if name == "position" else 1]

    def _curve(self, state: KeplerState, bodies: Bodies, t: Instant, places: Rows) -> Motion:
        if len(places) <= FEW:
            columns = list(self._one_by_one(state, bodies, t, places.tolist()))
            pair = np.array(columns).reshape(len(places), 2, 3)
            return pair[:, 0].T, pair[:, 1].T
        arrays, rows = state.arrays, state.rows[places]
        s, rest = exact_spans(t, bodies.clock[0, rows], bodies.clock[1, rows])
        first, which, orbits = self._shared(state)
        # Two whose orbit is one are solved once, unless an event has just written one of them, or not all are asked for.
        if len(places) == state.count and bool(((s[first][which] == s) & (rest[first][which] == rest)).all()):
            parts = [one[:, which] for one in moved(orbits, s[first], rest[first])]
        else:
            parts = list(moved(arrays["orbit"][:, places], s, rest))
        return self._moved_by(state, bodies, places, s, rest, parts)

    @staticmethod
    def _moved_by(
        state: KeplerState, bodies: Bodies, places: slice | Rows, s: Array, rest: Array, parts: Sequence[Array]
    ) -> Motion:
        """Positions and velocities after ``s + rest``, shape (n,), by the ``parts`` that `moved` gave; of one row, or of one a time."""
        arrays, rows = state.arrays, state.rows[places]
        share, drift, common = arrays["share"][0, places], arrays["drift"][:, places], arrays["common"][:, places]
        x0, v0 = bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows]
        change, more, kick = parts
        x, v = np.empty((3, len(s))), np.empty((3, len(s)))
        for c in range(3):
            numbers = s, rest, share, drift[c], drift[3 + c], common[c]
            x[c], v[c] = component(x0[c], v0[c], change[c], more[c], kick[c], *numbers)
        return x, v

    def _shared(self, state: KeplerState) -> tuple[Rows, Rows, Array]:
        """A row for each orbit, for each row its orbit among those, and their constants."""
        if state.orbits is None:
            _, first, which = np.unique(state.arrays["pair"][0], return_index=True, return_inverse=True)
            state.orbits = first, which, state.arrays["orbit"][:, first]
        return state.orbits

    def _one_by_one(
        self, state: KeplerState, bodies: Bodies, t: Instant, places: Sequence[int]
    ) -> Iterator[list[list[float]]]:
        """Position and velocity of each of the rows at ``places``, on floats."""
        arrays, solved = state.arrays, {} if state.held is None else state.held.solved
        for local in places:
            row = int(state.rows[local])
            s, rest = exact_spans(t, *bodies.clock_of(row))
            key = (float(arrays["pair"][0, local]), s, rest)
            if key not in solved:
                solved[key] = kepler.moved(tuple(arrays["orbit"][:, local].tolist()), s, rest)
            change, more, kick = solved[key]
            share, drift = float(arrays["share"][0, local]), arrays["drift"][:, local].tolist()
            common = arrays["common"][:, local].tolist()
            x0, v0 = bodies.get("position", row), bodies.get("velocity", row)
            both = [
                component(x0[c], v0[c], change[c], more[c], kick[c], s, rest, share, drift[c], drift[3 + c], common[c])
                for c in range(3)
            ]
            yield [[x for x, _ in both], [v for _, v in both]]


def component(
    x: Any,
    v: Any,
    change: Any,
    more: Any,
    kick: Any,
    s: Any,
    rest: Any,
    share: Any,
    drift: Any,
    drift_rest: Any,
    g: Any,
) -> tuple[Any, Any]:
    """A component of position and velocity of a body, on floats or arrays.

    ``x`` and ``v`` are those at the beginning; ``change`` with ``more`` and ``kick`` is how the two bodies have moved about one another after the
    time ``s + rest``, of which the body has the ``share``; ``drift`` is the velocity of their centre of mass, ``g`` the acceleration of both.
    """
    along = s * (drift + (0.5 * s) * g) + share * change
    there, left = sum_exact(x, along)
    return there + (left + ((s * drift_rest + rest * drift) + share * more)), v + (share * kick + s * g)


def _named(bodies: Bodies, rows: Sequence[int]) -> str:
    return " and ".join(bodies.objects[row].label for row in rows)


def _way_out(one: Attraction) -> str:
    return str(one.law.singular or "Move them apart, or give them some velocity across") + "."
