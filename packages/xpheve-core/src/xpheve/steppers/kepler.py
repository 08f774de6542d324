"""Kepler: two bodies under inverse-square forces, or one about a fixed centre, in closed form."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import LawFailedError, StateError
from xpheve.kernels import kepler
from xpheve.kernels.clock import NEVER, Instant, later, two_sum
from xpheve.kernels.elliptic import Pair, pair_add, pair_div, pair_mul, sum_exact
from xpheve.kernels.kepler import Orbit
from xpheve.steppers.contract import Array, Attraction, Offer, Refusal, Rows, Settings, Signature, Sources, State, Stop
from xpheve.steppers.flights import FlightState
from xpheve.steppers.kepler_arrays import PLACES, moved
from xpheve.steppers.smooth import Smooth

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


class KeplerState(FlightState):
    """A `FlightState` with what was read last, and which rows share an orbit."""

    def __init__(self) -> None:
        super().__init__(np.zeros(0, dtype=np.int64))
        self.held: _Held | None = None
        self.orbits: tuple[Rows, Rows] | None = None
        """A row for each orbit, and for each row its orbit among those."""

    def locate(self) -> None:
        super().locate()
        self.held = self.orbits = None


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
        state.held = state.orbits = None

    def _await(self, state: State, places: slice | Rows, t: Instant) -> None:
        """The rows at ``places`` stand as they were written at ``t``, until their orbits are found."""
        arrays = state.arrays
        arrays["begun"][:, places] = 0.0
        arrays["since"][:, places] = arrays["end"][:, places] = np.array(t)[:, None]
        assert isinstance(state, KeplerState)
        state.held = state.orbits = None

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
        self._begin(state, bodies, joined, t, sources)
        return joined

    # From states to orbits

    def _begin(
        self, state: KeplerState, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> None:
        """Find the orbits of ``rows``, which stand at ``t``; those of which the forces have another form by now wait."""
        attractions = {} if sources is None else sources.attractions(rows)
        found = [
            (row, one) for row, one in attractions.items() if one.row < 0 or (one.row > row and one.row in attractions)
        ]
        for row, one in found:
            if one.row < 0:
                self._begin_alone(state, bodies, row, one, t)
            else:
                self._begin_pair(state, bodies, row, one, t)
        state.held = state.orbits = None
        state.facts = None

    def _begin_alone(self, state: KeplerState, bodies: Bodies, row: int, one: Attraction, t: Instant) -> None:
        """One body, about a fixed centre."""
        here = bodies.get("position", row)
        d = tuple(sum_exact(x, -c) for x, c in zip(here, one.place, strict=True))
        v = tuple((w, 0.0) for w in bodies.get("velocity", row))
        self._put(state, bodies, row, row, one, self._orbit(bodies, (row,), d, v, one), 1.0, (0.0,) * 6, t)

    def _begin_pair(self, state: KeplerState, bodies: Bodies, row: int, one: Attraction, t: Instant) -> None:
        """Two bodies, about one another."""
        other = one.row
        d = tuple(
            sum_exact(x, -y) for x, y in zip(bodies.get("position", row), bodies.get("position", other), strict=True)
        )
        mine, its = bodies.get("velocity", row), bodies.get("velocity", other)
        v = tuple(sum_exact(x, -y) for x, y in zip(mine, its, strict=True))
        orbit = self._orbit(bodies, (row, other), d, v, one)
        m, n = bodies.get("mass", row)[0], bodies.get("mass", other)[0]
        shift = -max(kepler.exponent(m), kepler.exponent(n))
        m, n = math.ldexp(m, shift), math.ldexp(n, shift)
        total = sum_exact(m, n)
        # v_c = v_a - (n / (m + n)) (v_a - v_b): nothing of a great mass is lost in it
        part = pair_div((n, 0.0), total) if m >= n else pair_div((-m, 0.0), total)
        base = mine if m >= n else its
        drift = [pair_add((w, 0.0), _minus(pair_mul(part, u))) for w, u in zip(base, v, strict=True)]
        drifts = (*(one[0] for one in drift), *(one[1] for one in drift))
        for which, share in ((row, n), (other, -m)):
            part = pair_div((share, 0.0), total)
            self._put(state, bodies, which, row, one, orbit, part[0], drifts, t)

    def _orbit(self, bodies: Bodies, rows: Sequence[int], d: Any, v: Any, one: Attraction) -> Orbit:
        """The constants of an orbit; raises `LawFailedError` if there is no distance."""
        if not any(part[0] for part in d):
            names = " and ".join(bodies.objects[row].label for row in rows)
            where = "are in one place" if len(rows) > 1 else "is in the centre of its force"
            raise LawFailedError(f"{one.laws}: {names} {where}, where the force is infinite: move them apart")
        return kepler.prepare(d, v, one.mu)

    def _put(
        self,
        state: KeplerState,
        bodies: Bodies,
        row: int,
        lesser: int,
        one: Attraction,
        orbit: Orbit,
        share: float,
        drift: tuple[float, ...],
        t: Instant,
    ) -> None:
        """Give ``row`` its orbit."""
        arrays, local = state.arrays, int(bodies.local[row])
        common = arrays["acceleration"][:, local].copy()
        fall = orbit[8] / orbit[1] * BEFORE_FALL
        arrays["orbit"][:, local] = orbit
        arrays["pair"][0, local] = bodies.serial[lesser]
        arrays["share"][0, local] = share
        arrays["drift"][:, local] = drift
        arrays["common"][:, local] = common
        pull = -one.mu[0] / orbit[9] / orbit[9] / orbit[0] / orbit[0]
        arrays["acceleration"][:, local] = common + share * pull * np.array(orbit[12:15])
        arrays["since"][:, local] = bodies.clock[:, row]
        arrays["end"][:, local] = later(t, fall) if fall < math.inf else NEVER
        arrays["begun"][0, local] = 1.0

    def _report_fall(self, state: KeplerState, bodies: Bodies, sources: Sources | None) -> None:
        """Raise `LawFailedError`: two bodies fall into one another now."""
        end = state.arrays["end"]
        rows = state.rows[end[0] == end[0].min()].tolist()
        one = (sources.attractions(rows) if sources is not None else {}).get(rows[0])
        names = " and ".join(bodies.objects[row].label for row in rows[:2])
        raise LawFailedError(
            f"{one.laws if one is not None else self.id}: {names} fall into the centre of the force at t = {end[0].min()} s, where it is "
            "infinite: give one of them some velocity across, or the law a softening"
        )

    # From orbits to states

    def _written(self, state: FlightState, bodies: Bodies, places: slice | Rows) -> Any:
        return super()._written(state, bodies, places) | (state.arrays["begun"][0, places] == 0.0)

    def curve(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> Motion:
        assert isinstance(state, KeplerState)
        held = state.held
        if held is None or held.t != t or held.change != bodies.change:
            held = state.held = _Held(t, bodies.change, [], {})
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

    def _curve(self, state: KeplerState, bodies: Bodies, t: Instant, places: Rows) -> Motion:
        if len(places) <= FEW:
            columns = list(self._one_by_one(state, bodies, t, places.tolist()))
            pair = np.array(columns).reshape(len(places), 2, 3)
            return pair[:, 0].T, pair[:, 1].T
        arrays, rows = state.arrays, state.rows[places]
        s, rest = spans(t, bodies.clock[0, rows], bodies.clock[1, rows])
        if len(places) == state.count:
            if state.orbits is None:
                _, first, which = np.unique(arrays["pair"][0], return_index=True, return_inverse=True)
                state.orbits = first, which
            first, which = state.orbits
            parts = [one[:, which] for one in moved(arrays["orbit"][:, first], s[first], rest[first])]
        else:
            parts = list(moved(arrays["orbit"][:, places], s, rest))
        share, drift, common = arrays["share"][0, places], arrays["drift"][:, places], arrays["common"][:, places]
        x0, v0 = bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows]
        change, more, kick = parts
        x, v = np.empty((3, len(places))), np.empty((3, len(places)))
        for c in range(3):
            numbers = s, rest, share, drift[c], drift[3 + c], common[c]
            x[c], v[c] = component(x0[c], v0[c], change[c], more[c], kick[c], *numbers)
        return x, v

    def _one_by_one(
        self, state: KeplerState, bodies: Bodies, t: Instant, places: Sequence[int]
    ) -> Iterator[list[list[float]]]:
        """Position and velocity of each of the rows at ``places``, on floats."""
        arrays = state.arrays
        for local in places:
            row = int(state.rows[local])
            s, rest = span(t, bodies.clock_of(row))
            change, more, kick = kepler.moved(tuple(arrays["orbit"][:, local].tolist()), s, rest)
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


def span(t: Instant, since: Instant) -> Pair:
    """Time [s] from ``since`` to ``t``, as a pair."""
    s, e = two_sum(t[0], -since[0])
    return two_sum(s, e + (t[1] - since[1]))


def spans(t: Instant, base: Array, offset: Array) -> tuple[Array, Array]:
    """`span` for arrays, to the same bits."""
    s, e = sum_exact(t[0], -base)  # type: ignore[arg-type]
    return sum_exact(s, e + (t[1] - offset))  # type: ignore[return-value, arg-type]


def _minus(a: Pair) -> Pair:
    return (-a[0], -a[1])
