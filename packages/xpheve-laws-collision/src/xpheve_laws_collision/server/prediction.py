"""Prediction: which pairs may meet, and what happens to each of them next."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.errors import ContactError
from xpheve.events import AFTER, IMPACT, Entry
from xpheve.kernels.clock import NEVER, Instant, elapsed, later
from xpheve.objects import PhysicalObject
from xpheve.steppers.contract import Rows
from xpheve_laws_collision.broad_phase import MANY
from xpheve_laws_collision.impact_time.advancement import STEPS, UndecidedError
from xpheve_laws_collision.mass import immovable
from xpheve_laws_collision.narrow_phase import Family, Gap, Mover
from xpheve_laws_collision.narrow_phase.limits import has_mesh
from xpheve_laws_collision.server.instant import ImpactInstant
from xpheve_laws_collision.server.pairs import ROUND, TURNING, Pair, pair_of
from xpheve_laws_collision.server.standing import Standing

if TYPE_CHECKING:
    from xpheve_laws_collision.impact_time.curved import CurvedFamily, Side

LOOKS = 3  # searches of one pair in a row that hardly moved on
REPEATS = 2_000  # impacts of one pair at one instant; more do not end


class Prediction(Standing):
    """Queues the next event of each pair, and acts when impacts are due."""

    def refresh(self, rows: Sequence[int]) -> None:
        world, broad = self.world, self.broad_phase
        objects = [world.bodies.objects[row] for row in rows]
        for obj in objects:
            self._refuse_turning(obj)
            self._recheck_standing(obj)
            self._watch_window(obj)
        broad.gather(self._asking_laws, rows)
        flying = [obj for obj in objects if self.fleet.flies(obj)]
        if flying:
            self.fleet.stale(flying)
            self._predict_standing(set(flying))
            objects = [obj for obj in objects if not self.fleet.flies(obj)]
            if not objects:
                return
        if broad.moving < MANY:
            if self.swept != NEVER:  # the others are known up to the end of the window only
                objects = [world.bodies.objects[row] for row in broad.rows.tolist()]
            self.swept = NEVER
        elif self.swept <= world.time or self.swept == NEVER or 4 * len(rows) > broad.moving:
            self._predict_standing(set(objects))
            self._sweep()
            return
        self._predict_standing(set(objects))
        done: set[PhysicalObject] = set()
        for obj in objects:
            self._predict_all(obj, done)
            done.add(obj)

    def _watch_window(self, obj: PhysicalObject) -> None:
        """Come back at the end of the window of a curved flight without end, to follow it into the next."""
        world = self.world
        flight = world.flight(obj._row)
        if not flight.curved or flight.t1 != NEVER or not self._heard_laws(obj):
            return
        end = self.curves.window(obj, flight)[1]
        mark = (int(world.bodies.version[obj._row]), end)
        if end != NEVER and self.watched.get(obj) != mark:
            self.watched[obj] = mark
            world.schedule(end, AFTER, (2, obj.rank), self._next_windows, ((obj, mark[0]),))

    def _next_windows(self, entries: list[Entry]) -> None:
        """Flights without end come into their next windows."""
        objects = {obj: None for entry in entries for obj, _ in entry.guards}
        self._predict_standing(set(objects))
        done: set[PhysicalObject] = set()
        for obj in objects:
            self._watch_window(obj)
            self._predict_all(obj, done)
            done.add(obj)

    def flown(self, rows: Sequence[int] | Rows) -> None:
        """Flights that the loop has changed: what stands is asked again, and what the loop has left to the server is queued."""
        if self.touching or self.inside or self.supports or self.held:
            objects = [self.world.bodies.objects[int(row)] for row in rows]
            for obj in objects:
                self._recheck_standing(obj)
            self._predict_standing(set(objects))
        self.fleet.schedule()

    def _predict_standing(self, objects: set[PhysicalObject]) -> None:
        """Pairs in contact are asked wherever their bodies have got to."""
        for pair in [*self.touching, *self.inside]:
            if (pair[0] in objects or pair[1] in objects) and pair[0]._row >= 0 and pair[1]._row >= 0:
                self._predict(pair)

    def _sweep(self, entries: list[Entry] | None = None) -> None:
        """Predict all pairs that may touch within a window of time, and come back at its end."""
        world, broad = self.world, self.broad_phase
        if entries is not None and self.swept != NEVER and world.time < self.swept:
            return  # a later window is open already
        if broad.moving < MANY:
            if self.swept != NEVER:
                self.swept = NEVER
                done: set[PhysicalObject] = set()
                for obj in [world.bodies.objects[row] for row in broad.rows.tolist()]:
                    self._predict_all(obj, done)
                    done.add(obj)
            return
        span = broad.window()
        found = broad.sweep(min(span, 1e300))
        objects = world.bodies.objects
        if found is None:  # flights of a foreign stepper: ask every pair
            rows = broad.rows.tolist()
            pairs = [
                (i, j) for k, i in enumerate(rows) for j in rows[k + 1 :] if not (objects[i].fixed and objects[j].fixed)
            ]
            found = pairs, [(row, k) for row in rows for k in range(len(broad.planes))]
        else:
            self.swept = later(world.time, span) if span < np.inf else NEVER
            if self.swept != NEVER:
                world.schedule(self.swept, AFTER, (0,), self._sweep)
        for i, j in found[0]:
            self._predict(self._pair(objects[i], objects[j]))
        for row, number in found[1]:
            self._predict(self._pair(objects[row], broad.planes[number]))

    def _predict_all(self, obj: PhysicalObject, done: set[PhysicalObject]) -> None:
        """Predict the pairs of ``obj`` but for those with ``done``: those that it may meet until the first of them is due.

        If it flies on from there as it did, the others are asked then.
        """
        world, broad = self.world, self.broad_phase
        laws = self._asking_laws(obj)
        if not laws or obj.rank < 0:
            return
        objects, mapping = world.bodies.objects, world.mapping
        unbounded = obj in broad.planes
        if obj.fixed or unbounded:
            near = broad.rows if unbounded else broad.near(obj._row, math.inf)
            for row in near.tolist():
                other = objects[row]
                if not other.fixed and other not in done and not laws.keys().isdisjoint(mapping.laws(other)):
                    self._predict(self._pair(obj, other))
            return
        flight = world.flight(obj._row)
        if flight.curved:
            self._predict_on_curve(obj, laws, done)
            return
        clock = world.bodies.clock_of(obj._row)
        whole = min(self.swept, flight.t1)
        first = whole
        for earliest, other in broad.fixed.ahead(obj, max(elapsed(whole, clock), 0.0)):
            if earliest > 0.0 and later(clock, earliest) > first:
                break
            if other is not obj and other not in done and not laws.keys().isdisjoint(mapping.laws(other)):
                due = self._predict(self._pair(obj, other))
                first = min(first, due) if due > world.time else first
        for row in broad.near(obj._row, max(elapsed(first, clock), 0.0), fixed=False).tolist():
            other = objects[row]
            if other not in done and not laws.keys().isdisjoint(mapping.laws(other)):
                self._predict(self._pair(obj, other))
        if first < whole:
            world.schedule(first, AFTER, (obj.rank,), self._look_on, ((obj, int(world.bodies.version[obj._row])),))

    def _look_on(self, entries: list[Entry]) -> None:
        """Objects that fly on after the first of what was predicted for them: what they meet next."""
        for entry in entries:
            self._predict_all(entry.guards[0][0], set())

    def _predict_on_curve(self, obj: PhysicalObject, laws: dict[Any, Instant], done: set[PhysicalObject]) -> None:
        """`_predict_all` of what flies on a curve: within its window."""
        world, broad, mapping = self.world, self.broad_phase, self.world.mapping
        for other in broad.planes:
            if other is not obj and other not in done and not laws.keys().isdisjoint(mapping.laws(other)):
                self._predict(self._pair(obj, other))
        begin, end = self.curves.window(obj, world.flight(obj._row))
        for row in broad.near(obj._row, max(elapsed(min(self.swept, end), begin), 0.0)).tolist():
            other = world.bodies.objects[row]
            if other not in done and not laws.keys().isdisjoint(mapping.laws(other)):
                self._predict(self._pair(obj, other))

    def _predict(self, pair: Pair, resting: bool = False) -> Instant:
        """Queue the next event of ``pair``; returns when it is. Of those that fly only what stands, or seems to be ``resting``, is asked."""
        world = self.world
        a, b = pair
        since = self._interest(pair)
        if since is None:
            self._forget_pair(pair)
            return NEVER
        flight_a, flight_b = world.flight(a._row), world.flight(b._row)
        curved = flight_a.curved or flight_b.curved
        (low_a, high_a), (low_b, high_b) = self.curves.window(a, flight_a), self.curves.window(b, flight_b)
        start = max(low_a, low_b, since)
        if pair in self.told:
            if self.told[pair] > start:
                start = self.told[pair]
            else:
                del self.told[pair]
        end = min(high_a, high_b)
        if curved and not start < end:
            return NEVER  # of the next step, when that is made
        self.predictions += 1
        standing = self.touching.get(pair, self.inside.get(pair))
        family, swapped = self._family(a, b)
        mover_a, mover_b = self._movers(a, b, start, (flight_a, flight_b))
        one, two = (b, a) if swapped else (a, b)
        mover_one, mover_two = (mover_b, mover_a) if swapped else (mover_a, mover_b)
        horizon = elapsed(end, start)
        plain = family
        if curved:
            family = self._curved(plain, one, two, start)
        elif standing is None and pair != self.near and pair not in self.collapsing and not self._is_support(pair):
            wait = family.apart_for(mover_one, mover_two)
            if not wait <= horizon or wait == math.inf:
                return NEVER
            if later(start, wait) > world.time:
                return self._queue(pair, start, wait, self._nearer)
        gap = family.gap(mover_one, mover_two)
        if not (mover_one.shape.kind in ROUND and mover_two.shape.kind in ROUND):
            gap = gap._replace(still=TURNING * gap.still)
        if standing is not None and self._late_laws(pair, standing):
            span, act = 0.0, self._tell_late
        elif pair in self.collapsing or self._is_support(pair):
            return NEVER
        elif pair in self.inside:
            span, act = self._search_leave(family, mover_one, mover_two, gap, horizon)
        else:
            span, act = self._next_impact(pair, family, mover_one, mover_two, gap, horizon)
            if act is None:  # opening at second order: what comes next is looked for from where the gap shows
                lead = math.sqrt(4.0 * gap.touch / gap.acceleration)
                mover_one, mover_two = self._movers(one, two, later(start, lead))
                after = family.gap(mover_one, mover_two)
                family = self._curved(plain, one, two, start, lead) if curved else family
                span, act = self._search(family, mover_one, mover_two, after, horizon - lead)
                span += lead
        if span == math.inf or (act == self._impact and self.fleet.flies(pair[0]) and self.fleet.flies(pair[1])):
            return NEVER  # impacts of those that fly are found by the loop
        return self._queue(pair, start, span, act)

    def _queue(self, pair: Pair, start: Instant, span: float, act: Any) -> Instant:
        """Queue what happens to ``pair`` next, ``span`` [s] after ``start``; returns when."""
        world = self.world
        a, b = pair
        at: Instant = max(later(start, span), world.time)
        guards = tuple((obj, int(world.bodies.version[obj._row])) for obj in pair)
        held = self.queued.get(pair)
        if held is None or held.guards != guards or held.instant != at or held.act != act:
            self.queued[pair] = world.schedule(at, IMPACT, (a.rank, b.rank), act, guards)
        return at

    def _curved(
        self, family: Family, one: PhysicalObject, two: PhysicalObject, start: Instant, lead: float = 0.0
    ) -> CurvedFamily:
        """The geometry of a pair one of which flies on a curve, from ``lead`` [s] after ``start`` on."""
        from xpheve_laws_collision.impact_time.curved import CurvedFamily

        sides = [self._side(obj, start) for obj in (one, two)]
        plain = self._shape(one).kind in ROUND and self._shape(two).kind in ROUND
        return CurvedFamily(family, sides[0], sides[1], plain, lead)

    def _side(self, obj: PhysicalObject, start: Instant) -> Side:
        from xpheve_laws_collision.impact_time.curved import TURNS, Side

        flight = self.world.flight(obj._row)

        def at(s: float) -> Mover:
            return self._mover(obj, later(start, s), flight)

        def turns(low: float, high: float) -> float:
            if self._shape(obj).kind in ROUND or immovable(obj):
                return 0.0
            return TURNS * self.curves.turn(obj, start, low, high)

        reach = getattr(self._shape(obj), "reach", 0.0)
        return Side(self.curves.track(obj, start, flight), at, turns, reach)

    def _next_impact(
        self, pair: Pair, family: Family, one: Mover, two: Mover, gap: Gap, horizon: float
    ) -> tuple[float, Any]:
        answered = self._answered(pair)
        touching = abs(gap.separation) <= gap.touch
        if touching and abs(gap.speed) <= gap.still:
            loaded = self._loaded(pair, gap)
            if loaded and gap.acceleration > 0.0:
                return (0.0, self._leave) if pair in self.touching else (math.inf, None)
            if pair not in self.touching:
                return 0.0, self._meet
            if loaded and answered:
                return 0.0, self._settle
            if self._has_mesh(pair):
                return self._search(family, one, two, gap, horizon)  # another face may be in the way
            return math.inf, self._leave
        if pair in self.touching and gap.separation > gap.touch:
            return 0.0, self._leave
        sunk = gap.separation < -gap.touch and abs(gap.speed) <= gap.still
        if sunk and answered and gap.acceleration < 0.0 and self._loaded(pair, gap):
            return 0.0, self._refuse_sunk
        if touching and gap.speed > gap.still and pair in self.touching:
            return 0.0, self._leave
        if gap.separation < -gap.touch and not answered and pair not in self.inside:
            return 0.0, self._meet
        if touching and self._hops(pair, gap):
            return -2.0 * gap.speed / gap.acceleration, self._impact
        return self._search(family, one, two, gap, horizon)

    def _nearer(self, entries: list[Entry]) -> None:
        """Pairs whose bounding balls meet from now on: when they touch is worth to be known. Most have turned away before."""
        for entry in entries:
            self.near = pair_of(entry, self)
            try:
                self._predict(self.near)
            finally:
                self.near = None

    def _hops(self, pair: Pair, gap: Gap) -> bool:
        """Whether an extended body leaves to come back before its gap shows: a parabola of which the geometry sees nothing."""
        if self._is_round(pair) or gap.acceleration >= 0.0:
            return False
        return gap.still < gap.speed and gap.speed * gap.speed < -2.0 * gap.acceleration * gap.touch

    def removed(self, obj: PhysicalObject, row: int, moved: int) -> None:
        tables: tuple[dict[Pair, Any], ...] = (
            self.touching,
            self.inside,
            self.collapsing,
            self.queued,
            self.told,
            self.looked,
        )
        for table in tables:
            for pair in [pair for pair in table if obj in pair]:
                del table[pair]
        self.supports.pop(obj, None)
        if has_mesh(self._shape(obj)):
            self.world.structure += 1  # what met it may fly on curves again
        self.watched.pop(obj, None)
        self.curves.forget(obj)
        self.broad_phase.removed(obj, row, moved)
        self.held.pop(obj, None)
        self.streaks.pop(obj, None)
        for ball in [ball for ball, support in self.supports.items() if support.plane is obj]:
            self._end_support(ball)

    def _impact(self, entries: list[Entry]) -> None:
        """All impacts of one instant, in generations."""
        self._keep()
        self._answer_impacts({pair_of(entry, self): None for entry in entries})

    def _answer_impacts(self, pairs: dict[Pair, None]) -> None:
        """Answer ``pairs`` that are due now."""
        self._count_repeated(pairs)
        passing = [pair for pair in pairs if not self._answered(pair)]
        if passing:
            self._pass_through(passing)
        instant = ImpactInstant(self)
        answered = [pair for pair in pairs if pair not in passing]
        instant.solve(answered)
        instant.finish()
        for pair in answered:
            if pair not in instant.first:
                self._not_met(pair)

    def _answer_cluster(self, pair: Pair, others: Sequence[Pair]) -> None:
        """Answer ``pair``, which is due now, with those of ``others``, all that touches beside it, that approach as well."""
        instant = ImpactInstant(self)
        due = {pair: None}
        for other in others:
            if self._answered(other) and instant.approach(other) > 0.0:
                due[other] = None
            elif other != pair:
                self.touching.setdefault(other, self.world.time)
        self._answer_impacts(due)

    def _count_repeated(self, pairs: Iterable[Pair]) -> None:
        """Refuse pairs that meet at one instant again and again: bodies that are wedged, and bounce to and fro in no time."""
        if self.repeated[0] != self.world.time:
            self.repeated = (self.world.time, {})
        counts = self.repeated[1]
        for pair in pairs:
            counts[pair] = counts.get(pair, 0) + 1
            if counts[pair] > REPEATS:
                wedged = sorted({one for one, count in counts.items() if 2 * count > REPEATS}, key=_ranks)
                raise ContactError(
                    f"impacts at t = {self.world.time[0]} s do not end: "
                    + ", ".join(f"{a.label} - {b.label}" for a, b in wedged[:4])
                    + " (each more than once). A body that fills a gap cannot move across it: give it room, no speed across "
                    "the gap, or the law a restitution below 1"
                )

    def _not_met(self, pair: Pair) -> None:
        """A pair that was due and did not approach: it rests, or bodies answer as points and only a corner turns in."""
        if self._is_round(pair):
            self._turned(pair)
            return
        gap = self._gap(pair, self.world.time)
        if gap.speed < -gap.still and not self._response(*pair)[0].lever_arms:  # type: ignore[index]
            self._pass_through([pair])
            return
        self._turned(pair)
        if pair not in self.touching and pair not in self.inside and not any(obj in self.held for obj in pair):
            seen = self.told.get(pair) == self.world.time
            self._again([(pair, gap, -gap.speed)])
            if seen:  # asked at this very instant already: go on where the gap has changed by what counts as none
                self.told[pair] = later(self.world.time, gap.touch / max(abs(gap.speed), gap.still))

    def _is_round(self, pair: Pair) -> bool:
        return self._shape(pair[0]).kind in ROUND and self._shape(pair[1]).kind in ROUND

    def _look_again(self, entries: list[Entry]) -> None:
        """Pairs whose search had shown that there is nothing until now."""
        self._keep()
        pairs = [pair_of(one, self) for one in entries]
        for pair in pairs:
            self._count_looks(pair)
        self._again([(pair, self._gap(pair, self.world.time), 0.0) for pair in pairs])

    def _count_looks(self, pair: Pair) -> None:
        """Refuse a pair whose searches hardly move on: each ends before the bodies have moved by the size of the smaller one."""
        now = self.world.time
        last, count = self.looked.get(pair, (NEVER, 0))
        one, two = self._mover(pair[0], now), self._mover(pair[1], now)
        size = min(reach for mover in (one, two) if 0.0 < (reach := getattr(mover.shape, "reach", 0.0)))
        speed = math.dist(one.velocity, two.velocity)
        for mover in (one, two):
            if any(mover.angular_velocity):
                speed += math.hypot(*mover.angular_velocity) * mover.shape.reach
        slow = last != NEVER and speed * elapsed(now, last) < size
        count = count + 1 if slow else 0
        self.looked[pair] = (now, count)
        if count >= LOOKS:
            raise ContactError(
                f"{pair[0]!r} and {pair[1]!r}: when they meet after t = {now[0]} s is not found: {LOOKS} searches of {STEPS} steps got "
                "no farther than their size. Their sizes differ too much, or they turn too close to each other: make the large or "
                "long one of several smaller ones or a Plane, or the small one a Sphere, or do not map both objects to the collision law"
            )

    def _search_leave(self, family: Family, one: Mover, two: Mover, gap: Gap, horizon: float) -> tuple[float, Any]:
        """When what overlaps, or touches and goes in, is apart."""
        if gap.separation > gap.touch or (gap.separation > 0.0 and gap.speed > gap.still):
            return 0.0, self._leave
        try:
            return family.leave_time(one, two, gap, horizon), self._leave
        except UndecidedError as undecided:
            return undecided.until, self._look_again

    def _search(self, family: Family, one: Mover, two: Mover, gap: Gap, horizon: float) -> tuple[float, Any]:
        """When they meet, or until when it is known that they do not."""
        try:
            return family.impact_time(one, two, gap, horizon), self._impact
        except UndecidedError as undecided:
            return undecided.until, self._look_again


def _ranks(pair: Pair) -> tuple[int, int]:
    return pair[0].rank, pair[1].rank
