"""Adaptive: steps as long as the forces allow, right to the last digits or to tolerances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any, ClassVar

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import NoStepperError
from xpheve.kernels.clock import NEVER, Instant, elapsed, later
from xpheve.steppers.contract import Array, Offer, Refusal, Rows, Settings, Signature, Sources, State, Stop
from xpheve.steppers.flights import FlightState
from xpheve.steppers.smooth import Smooth
from xpheve.steppers.sums import two_sums

PACE = 0.17
"""Length of a step, by the time in which forces change (Pham, Rein, Spiegel 2024), at the limit of rounding. Two passes a step are enough
then; steps of up to 0.3 need three, take as long, and rounding shows a little more. Measured on the problems of the benchmark."""
LEAST = 1e-20
"""Of the time at hand; a shorter step is lost in the clock."""
KEPT = 20
"""Numbers of a coordinate that lead from step to step."""
WORK = {0: "work", 1: "work_rest", 18: "gain"}
"""By their place in the driver's numbers, each for all rows: work over what is past, its remainder, and what the present step adds."""
LIMITS = {"ahead": 0.0, "limit": 0.0, "limit_rest": 0.0}
"""How far [s] the wall was from the beginning of the present step, and that instant."""
TERMS = 16
"""Coefficients of the series of an acceleration, or power, within a step."""


class Adaptive(Smooth):
    """Gauss-Radau 15: eight forces a step and pass, passes until rounding is met, compensated sums (`xpheve.loop.drivers.radau15`).

    A step is as long as the row needs whose forces change soonest, and longer where tolerances allow. Its acceleration is a series of Legendre
    polynomials of degree 15, by which rows are read at any time within it, as exactly as at its end. E. Everhart, in: Dynamics of Comets (1985), 185;
    H. Rein, D. S. Spiegel, MNRAS 446 (2015) 1424.
    """

    id: ClassVar[str] = "core:adaptive"
    promise: ClassVar[str] = "Gauss-Radau 15: to tolerances, at 1e-13 and less to the limit of rounding"
    books_work: ClassVar[bool] = True
    driver: ClassVar[str] = "radau15"
    asks: ClassVar[bool] = True
    parts: ClassVar[bool] = True
    limit: ClassVar[float] = np.inf

    def offer(self, signature: Signature) -> Offer | Refusal:
        wished = signature.wish == self.id
        reason = self.refusal(signature)
        if not reason and signature.fixed_step and not wished:
            reason = "host steps were asked for, by dt, and its steps are its own"
        if not reason and signature.stiff and not wished:
            reason = "forces are stiff"
        return Refusal(reason) if reason else Offer(15.0, 100.0, False)

    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        arrays = {"path": 0, "curve": 0, "work": 1, "work_rest": 1, "gain": 1, "power": TERMS, "stored": 3}
        counts = {"steps": 0.0, "rejected": 0.0, "passes": 0.0, "evaluations": 0.0}
        state = self.new_state(arrays, {"base": t[0], "offset": t[1], "span": 0.0, "next": 0.0} | LIMITS | counts)
        self.join(state, rows, bodies, t)
        return state

    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        """Those who are there end their step, which leads to ``t``, and begin the next together with ``rows``."""
        assert isinstance(state, FlightState)
        if state.count:
            self._begin_again(state, bodies, t)
        first = state.count
        super().join(state, rows, bodies, t)
        state.numbers["base"], state.numbers["offset"] = t
        self.begin(state, bodies, slice(first, None))

    def covered(self, state: State) -> Instant:
        numbers = state.numbers
        if numbers["span"] > 0.0 and numbers["span"] == numbers["ahead"]:  # up to a wall
            return numbers["limit"], numbers["limit_rest"]
        return later((numbers["base"], numbers["offset"]), numbers["span"])

    # Steps

    def advance(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        return self._go(state, bodies, need, wall, settings, sources, 1)

    def leap(
        self, state: State, bodies: Bodies, need: Instant, wall: Instant, settings: Settings, sources: Sources | None
    ) -> Stop:
        return self._go(state, bodies, need, wall, settings, sources, 0)

    def _go(
        self,
        state: State,
        bodies: Bodies,
        need: Instant,
        wall: Instant,
        settings: Settings,
        sources: Sources | None,
        most: int,
    ) -> Stop:
        """Make steps until ``need``, ``most`` at most if that is not 0."""
        from xpheve.loop.drivers import radau15 as driver

        assert isinstance(state, FlightState) and sources is not None
        if self.covered(state) >= need:
            return Stop(self.covered(state), ())
        motion, numbers = sources.motion, state.numbers
        s, d = self._pack(state, bodies, motion)
        for place, value in (
            (driver.NEED, need[0]), (driver.NEED_REST, need[1]), (driver.WALL, wall[0]), (driver.WALL_REST, wall[1]),
            (driver.RTOL, settings.rtol), (driver.ATOL, settings.atol), (driver.PACE, PACE), (driver.LEAST, LEAST),
        ):  # fmt: skip
            s[place] = value
        d[driver.MOST] = most
        answer = self._run(motion, sources, s, d, need, most)
        self._unpack(state, bodies, motion, s, d)
        if answer == driver.NOT_FINITE:
            t = numbers["base"], numbers["offset"]
            raise motion.fail(t, self.held(state, bodies))
        if answer == driver.TOO_SHORT:
            raise NoStepperError(
                f"core:adaptive cannot go on at t = {numbers['base']} s: the forces on {sources.label(int(d[driver.WORST]))} change ever "
                "faster there, as where points collide, or jump. Soften the forces, stop before, loosen the tolerances, or give run(dt=...)"
            )
        return Stop(self.covered(state), state.rows)

    def _run(self, motion: Any, sources: Sources, s: Array, d: Any, need: Instant, most: int) -> int:
        """Run the driver, with moving sources followed as far as its steps reach; its answer."""
        from xpheve.loop.drivers import radau15 as driver

        known = (float(s[driver.T]), float(s[driver.T_REST]))
        while True:
            begin = later((float(s[driver.T]), float(s[driver.T_REST])), float(s[driver.SPAN]))
            least = later(
                begin, float(s[driver.NEXT]) + 4.0 * math.ulp(begin[0] + float(s[driver.NEXT]))
            )  # what rounding may add
            more = sources.follow(begin, least if most else max(need, least), least)
            if more < least and more <= known:  # they cannot be followed further: the step ends there
                s[driver.WALL], s[driver.WALL_REST] = s[driver.NEED], s[driver.NEED_REST] = more
                more = NEVER
            known = more
            s[driver.KNOWN] = known[0]
            answer: int = motion.run("radau15", s, d)
            if answer != driver.UNKNOWN:
                return answer

    # Numbers of the driver

    def _pack(self, state: FlightState, bodies: Bodies, motion: Any) -> tuple[Array, Rows]:
        """The driver's numbers and whole numbers, at the present step."""
        from xpheve.loop.drivers import radau15 as driver

        numbers, moving, parts = state.numbers, motion.moving, motion.components
        size = driver_places(motion.rows, parts)
        places = size.kept
        s, d = np.zeros(size.total), np.zeros(driver.WORST + 1, dtype=np.int64)
        s[driver.NODE : driver.HEAD] = tables()
        s[driver.T], s[driver.T_REST] = numbers["base"], numbers["offset"]
        s[driver.SPAN], s[driver.NEXT] = numbers["span"], numbers["next"]
        s[driver.AHEAD : driver.LIMIT_REST + 1] = [numbers[name] for name in LIMITS]
        own = places[:, :, :moving]
        x, v = motion.pack(self.held(state, bodies), (numbers["base"], numbers["offset"]))
        s[places[0]], s[places[2]] = x, v
        if len(state.arrays["path"]) == KEPT * parts:
            path = state.arrays["path"].reshape(KEPT, parts, state.count)[:, :, motion.held.order]
            if numbers["span"] > 0.0:
                s[own] = path
            else:  # what was written since is what it says
                for value, rest in ((0, 1), (2, 3)):
                    s[own[rest]] = np.where(path[value] == s[own[value]], path[rest], 0.0)
        for k, name in WORK.items():
            at = size.work + k * motion.rows
            s[at : at + moving] = state.arrays[name][0, motion.held.order]
        counts = ((0, "evaluations"), (driver.STEPS, "steps"), (driver.REFUSED, "rejected"), (driver.PASSES, "passes"))
        for place, name in counts:
            d[place] = int(numbers[name])
        d[driver.TURNING], d[driver.WORKING] = motion.turning, motion.works
        d[driver.SPEEDY] = motion.reads_velocity
        return s, d

    def _unpack(self, state: FlightState, bodies: Bodies, motion: Any, s: Array, d: Any) -> None:
        """Take what the driver has found, and write the beginning of the present step into the bodies."""
        from xpheve.loop.drivers import radau15 as driver

        numbers, moving, parts, order = state.numbers, motion.moving, motion.components, motion.held.order
        size = driver_places(motion.rows, parts)
        places = size.kept
        path, curve = np.empty((KEPT, parts, moving)), np.empty((TERMS, parts, moving))
        path[:, :, order], curve[:, :, order] = s[places[:, :, :moving]], s[size.curve[:, :, :moving]]
        state.arrays["path"], state.arrays["curve"] = path.reshape(-1, moving), curve.reshape(-1, moving)
        state.arrays["acceleration"] = path[4, :3].copy()
        state.arrays["torque"][...] = (
            1.0 if motion.turning else 0.0
        )  # says only that rotation does work, which is booked
        for k, name in WORK.items():
            at = size.work + k * motion.rows
            state.arrays[name][0, order] = s[at : at + moving]
        at = size.work + 2 * motion.rows
        state.arrays["power"][:, order] = s[at : at + TERMS * motion.rows].reshape(TERMS, motion.rows)[:, :moving]
        numbers["base"], numbers["offset"] = float(s[driver.T]), float(s[driver.T_REST])
        numbers["span"], numbers["next"] = float(s[driver.SPAN]), float(s[driver.NEXT])
        numbers |= dict(zip(LIMITS, s[driver.AHEAD : driver.LIMIT_REST + 1].tolist(), strict=True))
        numbers["evaluations"], numbers["steps"] = float(d[0]), float(d[driver.STEPS])
        numbers["rejected"], numbers["passes"] = float(d[driver.REFUSED]), float(d[driver.PASSES])
        numbers["turning"] = 1.0 if motion.turning else 0.0
        rows = state.where
        state.arrays["stored"][...] = bodies.arrays["working"][:, rows]
        bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows] = path[0, :3], path[2, :3]
        bodies.clock[0, rows], bodies.clock[1, rows] = numbers["base"], numbers["offset"]
        if motion.turning:
            orientation, spin = _turning(path[0, 3:], path[2, 3:])
            bodies.arrays["orientation"][:, rows], bodies.arrays["angular_velocity"][:, rows] = orientation, spin
            bodies.turn_clock[:, rows] = bodies.clock[:, rows]
        self.begin(state, bodies, slice(None))
        bodies.change += 1

    # Within a step

    def _within(
        self, state: FlightState, span: float | Array, places: slice | Rows, first: int, last: int
    ) -> tuple[Array, ...]:
        """Places and their rest, velocities and theirs, of components ``first`` to ``last``, ``span`` [s] after the step began.

        For one row ``span`` may be many, (times,).
        """
        count, dt = state.count, state.numbers["span"]
        path = state.arrays["path"].reshape(KEPT, -1, count)[:4, first:last, places]
        curve = state.arrays["curve"].reshape(TERMS, -1, count)[:, first:last, places]
        x, x_rest, v, v_rest = path
        once, twice = series_weights(span / dt)
        way, gain = twice[0] * curve[0], once[0] * curve[0]
        for k in range(1, TERMS):
            way = way + twice[k] * curve[k]
            gain = gain + once[k] * curve[k]
        return (*two_sums(x, x_rest + (span * (v + v_rest) + dt * dt * way)), *two_sums(v, v_rest + dt * gain))

    @staticmethod
    def _since(state: FlightState, t: Instant) -> float:
        """Time [s] from the beginning of the present step to ``t``."""
        return elapsed(t, (state.numbers["base"], state.numbers["offset"]))

    def curve(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        if not state.numbers["span"] > 0.0:
            rows = state.rows[places]
            return bodies.arrays["position"][:, rows], bodies.arrays["velocity"][:, rows]
        x, _, v, _ = self._within(state, self._since(state, t), places, 0, 3)
        return x, v

    def turned(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        if not state.numbers["span"] > 0.0:
            rows = state.rows[places]
            return bodies.arrays["orientation"][:, rows], bodies.arrays["angular_velocity"][:, rows]
        q, _, rate, _ = self._within(state, self._since(state, t), places, 3, 7)
        return _turning(q, rate)

    def read_times(self, state: State, bodies: Bodies, times: Sequence[Instant], name: str, local: int) -> Array:
        """The series of one row at many times together."""
        assert isinstance(state, FlightState)
        place = np.array([local], dtype=np.int64)
        still = not state.numbers["span"] > 0.0 or bool(self._written(state, bodies, place)[0])
        if name not in ("position", "velocity") or still:
            return super().read_times(state, bodies, times, name, local)
        since = state.numbers["base"], state.numbers["offset"]
        key, last = (bodies.change, local, *times), state.made.get("times")
        if last is None or last[0] != key:  # place and velocity are asked for one after the other
            spans = np.array([elapsed(t, since) for t in times])
            last = state.made["times"] = key, self._within(state, spans, place, 0, 3)
        found: Array = last[1][0 if name == "position" else 2]
        return found

    def running_work(self, state: State, bodies: Bodies, t: Instant, places: slice | Rows) -> Array:
        numbers, power = state.numbers, state.arrays["power"][:, places]
        total = np.zeros(power.shape[1])
        if not numbers["span"] > 0.0:
            return total
        once, _ = series_weights(elapsed(t, (numbers["base"], numbers["offset"])) / numbers["span"])
        for k in range(TERMS):
            total = total + once[k] * power[k]
        return numbers["span"] * total - self._stored_work(state, bodies, t, places)

    def _stored_work(self, state: State, bodies: Bodies, t: Instant, places: slice | Rows) -> Array:
        """Work [J] of the stored forces without potential over the present step until ``t``, which core tells itself."""
        assert isinstance(state, FlightState)
        force = state.arrays["stored"][:, places]
        if not force.any():
            return np.zeros(force.shape[1])
        begin = state.arrays["path"].reshape(KEPT, -1, state.count)[0, :3, places]
        way = self.curve(state, bodies, t, places)[0] - begin.reshape(3, -1)
        found: Array = force[0] * way[0] + force[1] * way[1] + force[2] * way[2]
        return found

    # Events

    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        """All rows begin a new step at ``t``: a group that an event changes in the midst of a step of others has left them before."""
        assert isinstance(state, FlightState)
        self._begin_again(state, bodies, t)
        found: list[int] = state.rows.tolist()
        return found

    def _begin_again(self, state: FlightState, bodies: Bodies, t: Instant) -> None:
        """End the present step at ``t``, and keep what rounding left of the rows that nobody wrote."""
        numbers = state.numbers
        if numbers["span"] > 0.0:
            parts = len(state.arrays["path"]) // KEPT
            path = np.zeros((KEPT, parts, state.count))
            path[:4] = self._within(state, self._since(state, t), slice(None), 0, parts)
            rows, arrays = state.rows, state.arrays
            joules = self.running_work(state, bodies, t, slice(None))
            behind = (bodies.clock[0, rows] != t[0]) | (bodies.clock[1, rows] != t[1])  # of others core books it
            joules += np.where(behind, self._stored_work(state, bodies, t, slice(None)), 0.0)
            arrays["work"][0], arrays["work_rest"][0] = two_sums(arrays["work"][0], joules + arrays["work_rest"][0])
            self.rebase(state, bodies, slice(None), t)
            state.arrays["path"] = path.reshape(-1, state.count)
            state.arrays["power"][...] = 0.0
            numbers["span"] = 0.0
        numbers["base"], numbers["offset"] = t
        self.begin(state, bodies, slice(None))


class DriverPlaces:
    """Where the driver's numbers lie for ``rows`` rows of ``parts`` components.

    Attributes
    ----------
    kept
        Of what leads from step to step, (`KEPT`, parts, rows): places and velocities, each with its remainder, accelerations at the beginning, what
        is added at the nodes, what was foretold of it, and by how much places were rounded.
    curve
        Of the coefficients of the accelerations' series, (`TERMS`, parts, rows).
    work
        Of the first row's work; then come the others', the remainders, and the coefficients of the power.
    total
        How many numbers there are.
    """

    def __init__(self, rows: int, parts: int) -> None:
        from xpheve.loop.drivers import radau15 as driver

        tiles = -(-parts * rows // driver.LANES)
        before = driver.HEAD + 3 * driver.LANES * tiles
        first = before + driver.WORKS * rows
        behind = first + driver.SIZE * tiles
        self.work, self.total = before + 48 * rows, behind + driver.CURVE * tiles
        each = np.arange(parts * rows).reshape(parts, rows)
        lane, tile = each % driver.LANES, each // driver.LANES
        slots = [driver.X, driver.X_REST, driver.V, driver.V_REST, driver.A]
        slots += [*range(driver.F1, driver.P7 + 1, driver.LANES), driver.OWED]
        self.kept = np.stack([first + tile * driver.SIZE + lane + slot for slot in slots])
        self.curve = np.stack([behind + tile * driver.CURVE + lane + driver.LANES * k for k in range(TERMS)])


@cache
def tables() -> Array:
    """The numbers of the method, where the driver looks for them."""
    from xpheve.kernels import radau
    from xpheve.loop.drivers import radau15 as driver

    found = np.zeros(driver.HEAD)
    for place, numbers in ((driver.NODE, radau.NODES), (driver.EXTRA, radau.EXTRA), (driver.SHARE, radau.WEIGHTS)):
        found[place : place + 8] = numbers
    weights = (radau.PLACES, radau.SPEEDS, radau.EXTRA_PLACES, radau.EXTRA_SPEEDS)
    for place, rows in zip((driver.PLACE, driver.SPEED, driver.EXTRA_PLACE, driver.EXTRA_SPEED), weights, strict=True):
        found[place : place + 64].reshape(8, 8)[:, :7] = rows
    found[driver.SERIES : driver.SERIES + 256] = np.ravel(radau.SERIES)
    return found[driver.NODE :]


@lru_cache(maxsize=8)
def driver_places(rows: int, parts: int) -> DriverPlaces:
    """The `DriverPlaces` of so many rows and components."""
    return DriverPlaces(rows, parts)


def series_weights(h: Any) -> tuple[list[Any], list[Any]]:
    """What coefficients of Legendre polynomials of 2 h - 1 weigh in the first integral from 0 to ``h``, or many, and in the second.

    The integral of P_k(2 h - 1) is (P_k+1 - P_k-1) / (4 k + 2), with P_-1 = -1 (Abramowitz and Stegun, 22.7.10 and 22.8.5).
    """
    x = 2.0 * h - 1.0
    p: list[Any] = [-1.0, 1.0, x]
    for k in range(1, TERMS + 1):
        p.append(((2.0 * k + 1.0) * x * p[k + 1] - k * p[k]) / (k + 1.0))
    once = [(p[k + 2] - p[k]) / (4.0 * k + 2.0) for k in range(TERMS + 1)]
    twice = [0.5 * h * h, *((once[k + 1] - once[k - 1]) / (4.0 * k + 2.0) for k in range(1, TERMS))]
    return once[:TERMS], twice


def _turning(q: Array, rate: Array) -> tuple[Array, Array]:
    """Orientations and angular velocities of unit quaternions ``q`` that change by ``rate``."""
    from xpheve.kernels.turning import spin_of

    length = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    unit: Any = q / length
    return unit, np.array(spin_of(tuple(unit), tuple(rate / length)))
