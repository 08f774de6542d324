"""The contact server: finds impacts through core's queue, answers them in generations, and keeps what rests at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from xpheve.errors import ContactError, LawFailedError
from xpheve.events import AFTER, IMPACT, Entry
from xpheve.kernels.clock import NEVER, Instant, elapsed, later
from xpheve.kernels.vector import Vec
from xpheve.laws import Impulse, ResponseLaw
from xpheve.laws import conditions as when
from xpheve.laws.combinations import leaves
from xpheve.objects import PhysicalObject
from xpheve.shapes import Plane
from xpheve.steppers.contract import ContactServer
from xpheve_laws_collision.broad_phase import MANY, BroadPhase
from xpheve_laws_collision.narrow_phase import ULPS, Family, Gap, Mover, family_of, flipped, still_speed
from xpheve_laws_collision.narrow_phase.sphere_plane import put_on
from xpheve_laws_collision.simultaneous import apply, solve_generation, wanted_speeds
from xpheve_laws_collision.telling import contact_of, tell

Pair = tuple[PhysicalObject, PhysicalObject]

SHORTEST_FLIGHT = 1e-10  # [s] a bounce shorter than this is ended in closed form (design 8)
STREAK = 1000  # dissipative impacts in a row, each less than CLOSE after the last: collapse
CLOSE = 1e-7  # [s]
TABLES = ("touching", "inside", "supports", "held", "collapsing", "streaks", "told")
GENERATIONS = 10_000  # of one instant; a set of pairs that needs more does not come apart


class _Point:
    """The shape of an object that has none: a sphere of radius 0."""

    kind = "sphere"
    radius = 0.0


class Support(NamedTuple):
    """What an object rests on: the plane, and the unit normal from it outwards."""

    plane: PhysicalObject
    outward: Vec


class ExactServer(ContactServer):
    """Contacts of spheres, points and planes at their exact instants.

    A pair is open (its closing is predicted), *touching* (in ``touching``), *inside* (overlapping with nobody to answer), collapsing
    towards rest (in ``collapsing``), or a support (in ``supports``), whose normal coordinate is set and not tested.
    """

    id: ClassVar[str] = "collision:exact_server"

    def attach(self, world: Any) -> None:
        self.world = world
        self.broad_phase = BroadPhase(world)
        self.touching: dict[Pair, Instant] = {}
        """Pairs in contact, with the instant since when."""
        self.inside: dict[Pair, Instant] = {}
        self.supports: dict[PhysicalObject, Support] = {}
        self.held: dict[PhysicalObject, None] = {}
        self.collapsing: dict[Pair, tuple[Instant, int]] = {}
        self.streaks: dict[PhysicalObject, tuple[int, Instant, int]] = {}
        """Dissipative impacts in quick succession: how many, the last, and with whom (serial number)."""
        self.told: dict[Pair, Instant] = {}
        """When a pair whose flights go on unchanged last met or parted: what comes next is looked for from there."""
        self.parting: list[tuple[Pair, Gap, float]] = []
        """Pairs that came apart at this instant, still to be told."""
        self.queued: dict[Pair, Entry] = {}
        """The last entry of each pair, so that none is queued twice."""
        self.swept: Instant = NEVER
        """Until when pairs have been looked for, in scenes of many bodies."""
        self.impacts = 0
        self.generations = 0
        self.predictions = 0
        self._families: dict[tuple[str, str], tuple[Family, bool]] = {}
        self._planes: dict[Plane, Plane] = {}
        self._kinds: dict[Any, set[tuple[str, bool]]] = {}

    def check(self, obj: PhysicalObject, laws: Sequence[Any]) -> None:
        own = (self._shape(obj).kind, obj.fixed)
        for law in laws:
            if not any(c.condition is not None and c.condition.served_by == "contacts" for c in law.containers):
                continue
            kinds = self._kinds.setdefault(law, set())
            for kind, fixed in sorted(kinds):
                if not (fixed and obj.fixed) and not _is_known(own[0], kind):
                    kinds.clear()  # of those that are gone, too: see who is there
                    kinds.update((self._shape(one).kind, one.fixed) for one in self.world.mapping.objects(law))
                    break
            for kind, fixed in sorted(kinds):
                if not (fixed and obj.fixed):
                    try:
                        family_of(own[0], kind)
                    except ContactError as error:
                        raise ContactError(f"{obj!r} under {law!r}: {error}") from None
            kinds.add(own)

    # Pairs

    def _pair(self, a: PhysicalObject, b: PhysicalObject) -> Pair:
        return (a, b) if a.rank < b.rank else (b, a)

    def _shape(self, obj: PhysicalObject) -> Any:
        shape = obj.shape
        if shape is None:
            return _Point
        if isinstance(shape, Plane) and shape.normal is None:
            if shape not in self._planes:
                self._planes[shape] = Plane(self.world.up_vector, shape.offset)
            return self._planes[shape]
        return shape

    def _family(self, a: PhysicalObject, b: PhysicalObject) -> tuple[Family, bool]:
        kinds = (self._shape(a).kind, self._shape(b).kind)
        found = self._families.get(kinds)
        if found is None:
            try:
                found = self._families[kinds] = family_of(*kinds)
            except ContactError as error:
                raise ContactError(f"{a!r} and {b!r}: {error}") from None
        return found

    def _mover(self, obj: PhysicalObject, t: Instant) -> Mover:
        """``obj`` at ``t``, which is not before its last re-base."""
        flight = self.world.flight(obj._row)
        s = elapsed(t, flight.t0)
        x, v, a = flight.position, flight.velocity, flight.acceleration
        half = 0.5 * s
        return Mover(
            (x[0] + s * (v[0] + half * a[0]), x[1] + s * (v[1] + half * a[1]), x[2] + s * (v[2] + half * a[2])),
            (v[0] + s * a[0], v[1] + s * a[1], v[2] + s * a[2]),
            a,
            self.world.bodies.get("orientation", obj._row),
            self._shape(obj),
        )

    def _gap(self, pair: Pair, t: Instant) -> Gap:
        a, b = pair
        family, swapped = self._family(a, b)
        if swapped:
            return flipped(family.gap(self._mover(b, t), self._mover(a, t)))
        return family.gap(self._mover(a, t), self._mover(b, t))

    def _interest(self, pair: Pair) -> Instant | None:
        """Since when somebody asks for contacts of ``pair``; None if nobody does."""
        a, b = pair
        since: Instant | None = None
        found = self.world.response_law(a, b)
        if found is not None:
            since = found[1]
        for law, mapped in self._heard_laws(a).items():
            other = self._heard_laws(b).get(law)
            if other is not None:
                joint = max(mapped, other)
                since = joint if since is None else min(since, joint)
        return since

    def _heard_laws(self, obj: PhysicalObject) -> dict[Any, Instant]:
        """The laws of ``obj`` that wait for contacts in some container."""
        return {
            law: since
            for law, since in self.world.mapping.laws(obj).items()
            if law.enabled
            and any(c.condition is not None and c.condition.served_by == "contacts" for c in law.containers)
        }

    # Prediction

    def refresh(self, rows: Sequence[int]) -> None:
        world, broad = self.world, self.broad_phase
        objects = [world.bodies.objects[row] for row in rows]
        for obj in objects:
            self._recheck_standing(obj)
        broad.gather(self._heard_laws, rows)
        if broad.moving < MANY:
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
            self.swept = NEVER
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
        """Predict the pairs of ``obj`` but for those with ``done``."""
        broad = self.broad_phase
        laws = self._heard_laws(obj)
        if not laws or obj.rank < 0:
            return
        first = self.swept
        mapping = self.world.mapping
        if not obj.fixed:
            for other in broad.planes:
                if other is not obj and other not in done and not laws.keys().isdisjoint(mapping.laws(other)):
                    first = min(first, self._predict(self._pair(obj, other)))
        objects = self.world.bodies.objects
        if obj in broad.planes:
            near = [row for row in broad.rows.tolist() if not objects[row].fixed]
        else:
            end = min(first, self.world.flight(obj._row).t1)
            near = broad.near(obj._row, max(elapsed(end, self.world.bodies.clock_of(obj._row)), 0.0)).tolist()
        for row in near:
            other = objects[row]
            if other not in done and not laws.keys().isdisjoint(mapping.laws(other)):
                self._predict(self._pair(obj, other))

    def _predict(self, pair: Pair) -> Instant:
        """Queue the next event of ``pair``; returns when it is."""
        world = self.world
        a, b = pair
        since = self._interest(pair)
        if since is None:
            self._forget_pair(pair)
            return NEVER
        flight_a, flight_b = world.flight(a._row), world.flight(b._row)
        start = max(flight_a.t0, flight_b.t0, since)
        if pair in self.told:
            if self.told[pair] > start:
                start = self.told[pair]
            else:
                del self.told[pair]
        end = min(flight_a.t1, flight_b.t1)
        self.predictions += 1
        standing = self.touching.get(pair, self.inside.get(pair))
        family, swapped = self._family(a, b)
        one, two = (b, a) if swapped else (a, b)
        mover_one, mover_two = self._mover(one, start), self._mover(two, start)
        gap = family.gap(mover_one, mover_two)
        horizon = elapsed(end, start)
        if standing is not None and self._late_laws(pair, standing):
            span, act = 0.0, self._tell_late
        elif pair in self.collapsing or self._is_support(pair):
            return NEVER
        elif pair in self.inside:
            span, act = family.leave_time(mover_one, mover_two, gap, horizon), self._leave
            span = 0.0 if gap.separation > 0.0 else span
        else:
            span, act = self._next_impact(pair, family, mover_one, mover_two, gap, horizon)
            if act is None:  # opening at second order: what comes next is looked for from where the gap shows
                lead = math.sqrt(4.0 * gap.touch / gap.acceleration)
                mover_one, mover_two = self._mover(one, later(start, lead)), self._mover(two, later(start, lead))
                after = family.gap(mover_one, mover_two)
                span = lead + family.impact_time(mover_one, mover_two, after, horizon - lead)
                act = self._impact
        if span == math.inf:
            return NEVER
        at: Instant = max(later(start, span), world.time)
        guards = tuple((obj, int(world.bodies.version[obj._row])) for obj in pair)
        held = self.queued.get(pair)
        if held is None or held.guards != guards or held.instant != at or held.act != act:
            self.queued[pair] = world.schedule(at, IMPACT, (a.rank, b.rank), act, guards)
        return at

    def _next_impact(
        self, pair: Pair, family: Family, one: Mover, two: Mover, gap: Gap, horizon: float
    ) -> tuple[float, Any]:
        answered = self.world.response_law(*pair) is not None
        touching = abs(gap.separation) <= gap.touch
        if touching and abs(gap.speed) <= gap.still:
            loaded = self._loaded(pair, gap)
            if loaded and gap.acceleration > 0.0:
                return (0.0, self._leave) if pair in self.touching else (math.inf, None)
            if pair not in self.touching:
                return 0.0, self._meet
            if loaded and answered:
                return 0.0, self._settle
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
        return family.impact_time(one, two, gap, horizon), self._impact

    def _late_laws(self, pair: Pair, begun: Instant) -> list[Any]:
        """Laws that wait for the beginning of contacts, and came to ``pair`` after it had begun."""
        if not self.world.listeners(when.ContactBegin):
            return []
        one, two = (self.world.mapping.laws(obj) for obj in pair)
        return [
            law
            for law in one
            if law in two
            and law.enabled
            and max(one[law], two[law]) > begun
            and any(isinstance(leaf, when.ContactBegin) for c in law.containers for leaf in leaves(c.condition))
        ]

    def _tell_late(self, entries: list[Entry]) -> None:
        """Tell those that armed themselves on a pair in contact, once."""
        self._keep()
        for pair in [_pair_of(entry, self) for entry in entries]:
            table = self.touching if pair in self.touching else self.inside
            laws = self._late_laws(pair, table[pair])
            table[pair] = self.world.time
            gap = self._gap(pair, self.world.time)
            self._tell(when.ContactBegin, [(pair, gap, -gap.speed)], laws)
            self._again([(pair, gap, -gap.speed)])

    def _refuse_sunk(self, entries: list[Entry]) -> None:
        """Bodies at rest inside one another, and pressed further in."""
        pair = _pair_of(entries[0], self)
        depth = -self._gap(pair, self.world.time).separation
        raise ContactError(
            f"{pair[0]!r} and {pair[1]!r} overlap by {depth} m at t = {self.world.time[0]} s, at rest, and are pressed together: "
            "move one of them out, or give it a speed"
        )

    def _loaded(self, pair: Pair, gap: Gap) -> bool:
        """Whether the normal acceleration of a touching pair is more than rounding."""
        scale = sum(math.hypot(*self.world.flight(obj._row).acceleration) for obj in pair)
        speeds = sum(math.hypot(*self.world.flight(obj._row).velocity) ** 2 for obj in pair)
        sizes = sum(getattr(self._shape(obj), "radius", 0.0) for obj in pair)
        return abs(gap.acceleration) > 1e-13 * (scale + (speeds / sizes if sizes else 0.0))

    def _is_support(self, pair: Pair) -> bool:
        a, b = pair
        return any(s in self.supports and self.supports[s].plane is p for s, p in ((a, b), (b, a)))

    def _forget_pair(self, pair: Pair) -> None:
        self.queued.pop(pair, None)
        self.touching.pop(pair, None)
        self.inside.pop(pair, None)
        self.collapsing.pop(pair, None)

    def removed(self, obj: PhysicalObject, row: int, moved: int) -> None:
        tables: tuple[dict[Pair, Any], ...] = (self.touching, self.inside, self.collapsing, self.queued, self.told)
        for table in tables:
            for pair in [pair for pair in table if obj in pair]:
                del table[pair]
        self.supports.pop(obj, None)
        self.broad_phase.removed(obj, row, moved)
        self.held.pop(obj, None)
        self.streaks.pop(obj, None)
        for ball in [ball for ball, support in self.supports.items() if support.plane is obj]:
            self._end_support(ball)

    # What stands: supports, what is held, what collapses

    def _recheck_standing(self, obj: PhysicalObject) -> None:
        """See whether ``obj``, whose flight is new, is still supported, held or collapsing."""
        for pair, (end, seen) in list(self.collapsing.items()):
            if obj in pair:
                mover = pair[0] if pair[1].fixed else pair[1]
                now = int(self.world.bodies.version[mover._row])
                if seen < 0:
                    self.collapsing[pair] = (end, now)
                    self.world.schedule(end, IMPACT, (pair[0].rank, pair[1].rank), self._settle, ((mover, now),))
                elif seen != now and mover is obj:
                    del self.collapsing[pair]
        if obj in self.held and any(self.world.bodies.get("velocity", obj._row)):
            self._release(obj)
        elif obj in self.held:
            self._hold(obj)
        if obj in self.supports:
            self._recheck_support(obj)
        if obj.fixed:
            for ball in [ball for ball, support in self.supports.items() if support.plane is obj]:
                self._recheck_support(ball)

    def _recheck_support(self, ball: PhysicalObject) -> None:
        support = self.supports[ball]
        pair = self._pair(ball, support.plane)
        flight = self.world.flight(ball._row)
        gap = self._gap(pair, flight.t0)
        answered = self.world.response_law(*pair) is not None
        if not answered or abs(gap.separation) > 10.0 * gap.touch or abs(gap.speed) > gap.still:
            self._end_support(ball)
            return
        self._react(ball, support)

    def _react(self, ball: PhysicalObject, support: Support) -> None:
        """Renew the reaction on a supported ball: it takes away what presses it onto the plane, and ends when nothing does."""
        n, world = support.outward, self.world
        flight = world.flight(ball._row)
        reaction = self._reaction(ball)
        press = math.fsum(f * c for f, c in zip(self._force_without(ball), n, strict=True))
        along = press + math.fsum(r * c for r, c in zip(reaction, n, strict=True))
        extra = ball.mass * math.fsum(a * c for a, c in zip(flight.acceleration, n, strict=True)) - along
        size = math.hypot(*self._force_without(ball)) + abs(extra)
        needed = -(press + (extra if abs(extra) > 1e-12 * size else 0.0))
        if needed < 0.0:
            self._end_support(ball)
            return
        force = (needed * n[0], needed * n[1], needed * n[2])
        if max(abs(f - r) for f, r in zip(force, reaction, strict=True)) > 1e-15 * size or not any(reaction):
            world.put_reaction(ball, self, "support", force)

    def _reaction(self, ball: PhysicalObject) -> Vec:
        for one in self.world.forces.on(ball):
            if one.owner is self:
                found: Vec = one.force.vector
                return found
        return (0.0, 0.0, 0.0)

    def _force_without(self, ball: PhysicalObject) -> Vec:
        """Sum of the stored forces on ``ball`` but for the reaction."""
        others = [one.force.vector for one in self.world.forces.on(ball) if one.owner is not self]
        x, y, z = (math.fsum(vector[k] for vector in others) for k in range(3))
        return x, y, z

    def _end_support(self, ball: PhysicalObject) -> None:
        """The plane no longer carries ``ball``."""
        support = self.supports.pop(ball)
        if ball._row >= 0:
            self.world.put_reaction(ball, self, "support", None)
            if support.plane._row >= 0:
                self.touching.setdefault(self._pair(ball, support.plane), self.world.time)

    def _settle(self, entries: list[Entry]) -> None:
        """Touching, still and pressed together: a support, a case that cannot be resolved yet, or held."""
        self._keep()
        for pair in [_pair_of(entry, self) for entry in entries]:
            self.collapsing.pop(pair, None)
            self._rest(pair)

    def _rest(self, pair: Pair) -> None:
        a, b = pair
        world = self.world
        family, swapped = self._family(a, b)
        ball, ground = (b, a) if swapped else (a, b)
        found = world.response_law(a, b)
        hold = found is not None and found[0].parameters.get("resting") == "hold"
        if ball in self.held and (ground in self.held or ground.fixed):
            return
        alone = ball not in self.supports and ball not in self.held
        if not (family.rests and ground.fixed and alone):
            if not hold:
                raise ContactError(
                    f"{a!r} rests on {b!r} at t = {world.time[0]} s, and "
                    + (
                        "has a second support"
                        if not alone
                        else "only a sphere on one fixed plane can rest in closed form so far"
                    )
                    + '. Set resting="hold" on the collision law to hold such bodies in place'
                )
            for obj in pair:
                if not obj.fixed:
                    self._hold(obj)
            return
        transaction = world.transaction
        row = transaction.touch(ball)
        gap = family.gap(self._mover(ball, world.time), self._mover(ground, world.time))
        position, velocity = put_on(self._mover(ball, world.time), gap)
        world.bodies.put("position", row, position)
        world.bodies.put("velocity", row, velocity)
        n = gap.normal
        outward = (-n[0] + 0.0, -n[1] + 0.0, -n[2] + 0.0)
        support = self.supports[ball] = Support(ground, outward)
        transaction.undo.append(lambda: self.supports.pop(ball, None))
        began = pair not in self.touching
        self.touching.setdefault(pair, world.time)
        press = self._force_without(ball)
        needed = max(-math.fsum(f * c for f, c in zip(press, support.outward, strict=True)), 0.0)
        world.put_reaction(ball, self, "support", tuple(needed * c for c in support.outward))
        if began:
            self._tell(when.ContactBegin, [(pair, gap if not swapped else flipped(gap), 0.0)])

    def _hold(self, obj: PhysicalObject) -> None:
        """Stop ``obj`` where it is, and cancel what acts on it."""
        self.held[obj] = None
        world = self.world
        with world.instant() as transaction:
            row = transaction.touch(obj)
            lost = _kinetic(obj, world.bodies.get("velocity", row))
            if lost:
                world.add_work("held", -lost)
            world.bodies.put("velocity", row, (0.0, 0.0, 0.0))
            x, y, z = self._force_without(obj)
            if obj in self.supports:
                del self.supports[obj]
                world.put_reaction(obj, self, "support", None)
            world.put_reaction(obj, self, "hold", (-x + 0.0, -y + 0.0, -z + 0.0))

    def _release(self, obj: PhysicalObject) -> None:
        del self.held[obj]
        self.world.put_reaction(obj, self, "hold", None)

    # Meeting and parting

    def _keep(self) -> None:
        """Let the open transaction take back what changes here from now on."""
        tables = {name: dict(getattr(self, name)) for name in TABLES}
        counts, parting = (self.impacts, self.generations), list(self.parting)

        def put_back() -> None:
            self.parting = parting
            for name, table in tables.items():
                setattr(self, name, table)
            self.impacts, self.generations = counts

        self.world.transaction.undo.append(put_back)

    def _meet(self, entries: list[Entry]) -> None:
        """Pairs that touch without approaching, or overlap with nobody to answer."""
        self._keep()
        begun = []
        for pair in [_pair_of(entry, self) for entry in entries]:
            gap = self._gap(pair, self.world.time)
            overlapping = gap.separation < -gap.touch and self.world.response_law(*pair) is None
            table = self.inside if overlapping else self.touching
            table[pair] = self.world.time
            begun.append((pair, gap, -gap.speed))
        self._tell(when.ContactBegin, begun)
        self._again(begun)

    def _leave(self, entries: list[Entry]) -> None:
        """Pairs that come apart."""
        self._keep()
        ended = []
        for pair in [_pair_of(entry, self) for entry in entries]:
            self._forget_pair(pair)
            gap = self._gap(pair, self.world.time)
            ended.append((pair, gap, -gap.speed))
        self._tell(when.ContactEnd, ended)
        self._again(ended)

    def _again(self, found: list[tuple[Pair, Gap, float]]) -> None:
        """Predict the pairs anew at the end of the instant, though their flights are the same."""
        for pair, _, _ in found:
            self.told[pair] = self.world.time
            self.world.transaction.later.append(lambda pair=pair: self._predict(pair))

    def _tell(
        self, kind: type[when.Condition], found: list[tuple[Pair, Gap, float]], only: list[Any] | None = None
    ) -> None:
        """Fire the containers that wait for ``kind``; of their laws ``only`` those, if given."""
        tell(self, kind, found, only)

    def host_step(self) -> None:
        now = self.world.time
        standing = [pair for pair in (*self.touching, *self.inside) if all(obj._row >= 0 for obj in pair)]
        found = []
        for pair in standing:
            gap = self._gap(pair, now)
            found.append((pair, gap, -gap.speed))
        self._tell(when.ContactStay, found)

    def _part(self, entries: list[Entry]) -> None:
        """Pairs that came apart in an impact, told in the last stage of the instant."""
        self._keep()
        found, self.parting = self.parting, []
        self._tell(when.ContactEnd, found)

    # Impacts

    def _impact(self, entries: list[Entry]) -> None:
        """All impacts of one instant, in generations."""
        self._keep()
        pairs = {_pair_of(entry, self): None for entry in entries}
        passing = [pair for pair in pairs if self.world.response_law(*pair) is None]
        if passing:
            self._pass_through(passing)
        instant = _Instant(self)
        answered = [pair for pair in pairs if pair not in passing]
        instant.solve(answered)
        for pair in answered:
            if pair not in instant.first:
                self._turned(pair)

    def _turned(self, pair: Pair) -> None:
        """A pair that came to its impact with no speed left: if it is pressed together, it rests."""
        gap = self._gap(pair, self.world.time)
        if abs(gap.separation) <= 10.0 * gap.touch and gap.speed <= gap.still and gap.acceleration < 0.0:
            if self._loaded(pair, gap) and not self._is_support(pair):
                self._rest(pair)

    def _pass_through(self, pairs: list[Pair]) -> None:
        begun = []
        for pair in pairs:
            gap = self._gap(pair, self.world.time)
            self.inside[pair] = self.world.time
            begun.append((pair, gap, -gap.speed))
        self._tell(when.Impact, begun)
        self._tell(when.ContactBegin, begun)
        self._again(begun)

    # Saving and reporting

    def save(self) -> dict[str, Any]:
        def pairs(table: Any) -> list[list[int]]:
            return [[a.serial, b.serial] for a, b in table]

        return {
            "touching": pairs(self.touching),
            "inside": pairs(self.inside),
            "begun": [[*self.touching.values()], [*self.inside.values()]],
            "supports": [[ball.serial, s.plane.serial, s.outward] for ball, s in self.supports.items()],
            "held": [obj.serial for obj in self.held],
            "collapsing": [[a.serial, b.serial, end, seen] for (a, b), (end, seen) in self.collapsing.items()],
            "streaks": [[obj.serial, count, last, other] for obj, (count, last, other) in self.streaks.items()],
            "told": [[a.serial, b.serial, when] for (a, b), when in self.told.items()],
            "parting": [[a.serial, b.serial, list(gap), speed] for (a, b), gap, speed in self.parting],
            "counts": [self.impacts, self.generations],
        }

    def restore(self, saved: dict[str, Any]) -> None:
        by = {obj.serial: obj for obj in self.world.bodies.objects}
        self.touching, self.inside = (
            {(by[a], by[b]): tuple(since) for (a, b), since in zip(saved[name], begun, strict=True)}
            for name, begun in zip(("touching", "inside"), saved["begun"], strict=True)
        )
        self.supports = {by[ball]: Support(by[plane], tuple(n)) for ball, plane, n in saved["supports"]}
        self.held = {by[serial]: None for serial in saved["held"]}
        self.collapsing = {}
        for a, b, end, seen in saved["collapsing"]:
            pair = (by[a], by[b])
            mover = pair[0] if pair[1].fixed else pair[1]
            self.collapsing[pair] = (tuple(end), seen)
            self.world.schedule(tuple(end), IMPACT, (pair[0].rank, pair[1].rank), self._settle, ((mover, seen),))
        self.streaks = {by[serial]: (count, tuple(last), other) for serial, count, last, other in saved["streaks"]}
        self.impacts, self.generations = saved["counts"]
        self.told = {(by[a], by[b]): tuple(instant) for a, b, instant in saved["told"]}
        for a, b, gap, speed in saved["parting"]:
            values: list[Any] = [tuple(value) if isinstance(value, list) else value for value in gap]
            self.parting.append(((by[a], by[b]), Gap(*values), speed))
        if self.parting:
            self.world.schedule(self.world.time, AFTER, (1,), self._part)

    def report(self) -> dict[str, Any]:
        return {
            "impacts": self.impacts,
            "generations": self.generations,
            "predictions": self.predictions,
            "touching": [f"{a.label} - {b.label}" for a, b in self.touching],
            "supports": [f"{ball.label} on {support.plane.label}" for ball, support in self.supports.items()],
            "held": [obj.label for obj in self.held],
        }


class _Instant:
    """The impacts of one instant: velocities of those involved, generation after generation."""

    def __init__(self, server: ExactServer) -> None:
        self.server = server
        self.world = server.world
        self.velocity: dict[PhysicalObject, Vec] = {}
        self.before: dict[PhysicalObject, Vec] = {}
        self.gaps: dict[Pair, Gap] = {}
        self.first: dict[Pair, tuple[Gap, float]] = {}
        self.restitution: dict[Pair, float] = {}

    def solve(self, pairs: list[Pair]) -> None:
        """Until no touching pair approaches; then write, and see what has come apart or to rest."""
        pairs = [pair for pair in pairs if self._approach(pair) > 0.0]
        rounds = 0
        while pairs:
            self.server.generations += 1
            self._generation(sorted(pairs, key=lambda pair: (pair[0].rank, pair[1].rank)))
            moved = {obj for pair in pairs for obj in pair if not obj.fixed}
            pairs = [pair for pair in self._around(moved, pairs) if self._approach(pair) > 0.0]
            rounds += 1
            if rounds > GENERATIONS:
                raise ContactError(
                    f"impacts at t = {self.world.time[0]} s do not end: "
                    + ", ".join(f"{a.label} - {b.label}" for a, b in pairs[:4])
                )
        self._write()

    def _around(self, moved: set[PhysicalObject], pairs: list[Pair]) -> list[Pair]:
        """The touching pairs of bodies whose velocity changed."""
        found = dict.fromkeys(pairs)
        found.update({pair: None for pair in self.first})
        for pair in self.server.touching:
            if (pair[0] in moved or pair[1] in moved) and self.world.response_law(*pair) is not None:
                found[pair] = None
        return list(found)

    def _gap(self, pair: Pair) -> Gap:
        if pair not in self.gaps:
            self.gaps[pair] = self.server._gap(pair, self.world.time)
        return self.gaps[pair]

    def _velocity(self, obj: PhysicalObject) -> Vec:
        if obj not in self.velocity:
            found = self.world.read_row(obj._row, "velocity")
            self.velocity[obj] = self.before[obj] = found
        return self.velocity[obj]

    def _separation_speed(self, pair: Pair) -> float:
        n = self._gap(pair).normal
        u, v = self._velocity(pair[0]), self._velocity(pair[1])
        return math.fsum(c * (q - p) for c, p, q in zip(n, u, v, strict=True))

    def _approach(self, pair: Pair) -> float:
        """Approach speed [m/s]; 0 if it is none."""
        speed = -self._separation_speed(pair)
        return speed if speed > self._still(pair) else 0.0

    def _still(self, pair: Pair) -> float:
        speeds = math.hypot(*self._velocity(pair[0])) + math.hypot(*self._velocity(pair[1]))
        return still_speed(speeds, self._gap(pair).acceleration)

    def _generation(self, pairs: list[Pair]) -> None:
        """Solve the pairs that touch and approach now, together."""
        bodies = list({obj: None for pair in pairs for obj in pair})
        place = {obj: k for k, obj in enumerate(bodies)}
        indices = [(place[a], place[b]) for a, b in pairs]
        velocities = [self._velocity(obj) for obj in bodies]
        inverse = [0.0 if obj.fixed else 1.0 / obj.mass for obj in bodies]
        normals = [self._gap(pair).normal for pair in pairs]
        answered: list[int] = []
        taken: list[tuple[int, Impulse]] = []
        restitutions: list[float] = []
        for k, pair in enumerate(pairs):
            approach = self._approach(pair)
            answer = self._ask(pair, approach)
            if isinstance(answer, Impulse):
                taken.append((k, answer))
                continue
            self.restitution[pair] = answer / approach
            answered.append(k)
            restitutions.append(answer / approach)
        some = [indices[k] for k in answered]
        along = [normals[k] for k in answered]
        targets = wanted_speeds(some, along, velocities, restitutions) if some else []
        impulses = solve_generation(some, inverse, along, velocities, targets) if some else []
        before = [self._separation_speed(pairs[k]) for k in answered]
        if some:
            self.velocity.update(zip(bodies, apply(some, along, impulses, inverse, velocities), strict=True))
        for k, impulse, speed in zip(answered, impulses, before, strict=True):
            pair = pairs[k]
            work = 0.5 * float(impulse) * (speed + self._separation_speed(pair))
            law = self.world.response_law(*pair)[0]
            if self.restitution[pair] < 1.0:
                self.world.add_work(law.label(), work)
                self._count_streak(pair)
            self.server.impacts += 1
        for k, answer in taken:
            self._take_over(pairs[k], answer)

    def _ask(self, pair: Pair, approach: float) -> float | Impulse:
        law: ResponseLaw = self.world.response_law(*pair)[0]
        gap = self._gap(pair)
        if pair not in self.first:
            self.first[pair] = (gap, approach)
        law.evaluations += 1
        try:
            answer = law.respond(contact_of(pair, gap, approach))
        except Exception as error:
            raise LawFailedError(
                f"{law.label()}.respond raised {type(error).__name__}: {error}; at t = {self.world.time[0]} s "
                f"for {pair[0].label} and {pair[1].label}. The engine stands just before that impact",
                law,
            ) from error
        if isinstance(answer, Impulse):
            return answer
        if not (isinstance(answer, (int, float)) and 0.0 <= answer < math.inf):
            raise LawFailedError(
                f"{law.label()}.respond gave {answer!r} for {pair[0].label} and {pair[1].label} at t = {self.world.time[0]} s: "
                "a separation speed from 0 m/s up, or an Impulse, is needed",
                law,
            )
        return float(answer)

    def _take_over(self, pair: Pair, impulse: Impulse) -> None:
        """An impulse that a law gave itself; kinetic energy before and after says its work."""
        law = self.world.response_law(*pair)[0]
        before = math.fsum(_kinetic(obj, self._velocity(obj)) for obj in pair)
        for obj, sign in ((pair[0], -1.0), (pair[1], 1.0)):
            if not obj.fixed:
                u, j = self._velocity(obj), impulse.vector
                share = sign / obj.mass
                self.velocity[obj] = (u[0] + share * j[0], u[1] + share * j[1], u[2] + share * j[2])
        self.world.add_work(law.label(), math.fsum(_kinetic(obj, self._velocity(obj)) for obj in pair) - before)
        self.server.impacts += 1
        if self._approach(pair) > 0.0:
            raise LawFailedError(
                f"{law.label()}.respond took over the impact of {pair[0].label} and {pair[1].label} at t = {self.world.time[0]} s "
                f"with {impulse.vector} N s, and they still approach: give an impulse on body_b along the normal that parts them",
                law,
            )

    def _count_streak(self, pair: Pair) -> None:
        """Count dissipative impacts that follow each other closely; too many are a collapse that nothing here can end."""
        now = self.world.time
        law = self.world.response_law(*pair)[0]
        for obj in pair:
            if obj.fixed:
                continue
            partner = pair[1] if obj is pair[0] else pair[0]
            count, last, other = self.server.streaks.get(obj, (0, NEVER, partner.serial))
            if last == NEVER or elapsed(now, last) >= CLOSE:
                count = 0
            alone = other == partner.serial and self._ends_in_closed_form(pair)
            count = count if alone else count + 1
            self.server.streaks[obj] = (count, now, partner.serial)
            if count > STREAK:
                if law.parameters.get("resting") != "hold":
                    raise ContactError(
                        f"{obj!r} bounces ever faster at t = {now[0]} s (last between {pair[0].label} and {pair[1].label}): "
                        'a collapse that is known in closed form only for a sphere on a plane. Set resting="hold" on the collision law'
                    )
                self.world.transaction.later.append(lambda obj=obj: self.server._hold(obj))

    def _write(self) -> None:
        world, server = self.world, self.server
        transaction = world.transaction
        for obj in world.in_rank_order(self.velocity):
            velocity = self.velocity[obj]
            if not obj.fixed and velocity != self.before[obj]:
                row = transaction.touch(obj)
                world.bodies.put("velocity", row, [component + 0.0 for component in velocity])
                transaction.forced.add(obj)
        for pair, (gap, _) in self.first.items():
            self._put_on_plane(pair, gap)
        ended: list[tuple[Pair, Gap, float]] = []
        begun = [(pair, gap, speed) for pair, (gap, speed) in self.first.items() if pair not in server.touching]
        for pair, (gap, _) in self.first.items():
            server.touching.setdefault(pair, world.time)
            speed = self._separation_speed(pair)
            if speed > self._still(pair):
                del server.touching[pair]
                ended.append((pair, gap, -speed))
                self._maybe_collapse(pair, gap, speed)
        laws = {world.response_law(*pair)[0] for pair in self.first}
        for container in {c: None for law in laws for c in law.containers}:
            container.firings += 1
        heard = [(pair, gap, speed) for pair, (gap, speed) in self.first.items()]
        server._tell(when.Impact, heard)
        server._tell(when.ContactBegin, begun)
        if ended and world.listeners(when.ContactEnd):
            server.parting += ended
            world.schedule(world.time, AFTER, (1,), server._part)

    def _put_on_plane(self, pair: Pair, gap: Gap) -> None:
        """Take the rounding of a long flight out of the normal coordinate, where it could pass for a gap later on."""
        family, swapped = self.server._family(*pair)
        ball, ground = (pair[1], pair[0]) if swapped else pair
        if family.rests and ground.fixed and gap.separation != 0.0 and ball in self.world.transaction.touched:
            flown = self.world.transaction.touched[ball]
            size = sum(math.hypot(*one) for one in (flown.held["position"], flown.flown["position"]))
            if abs(gap.separation) <= ULPS * size:
                n, x = gap.normal if not swapped else flipped(gap).normal, self.world.bodies.get("position", ball._row)
                self.world.bodies.put(
                    "position", ball._row, [c + gap.separation * k for c, k in zip(x, n, strict=True)]
                )

    def _maybe_collapse(self, pair: Pair, gap: Gap, speed: float) -> None:
        """End the bounces of a sphere on a plane in closed form once they have become too short to tell apart.

        The next flight lasts 2 v / a and each one after that e times its predecessor: together 2 v / (a (1 - e)).
        """
        restitution = self.restitution.get(pair, 1.0)
        if restitution >= 1.0 or not self._ends_in_closed_form(pair):
            return
        flight = -2.0 * speed / gap.acceleration
        if flight < SHORTEST_FLIGHT:
            end = later(self.world.time, flight / (1.0 - restitution))
            self.server.collapsing[pair] = (end, -1)

    def _ends_in_closed_form(self, pair: Pair) -> bool:
        """Whether ``pair`` is pressed together, so that ever shorter bounces lead to rest at a known instant."""
        return self._gap(pair).acceleration < 0.0


def _pair_of(entry: Entry, server: ExactServer) -> Pair:
    """The pair that an entry was predicted for."""
    ranks = entry.rank
    objects = {obj.rank: obj for obj, _ in entry.guards}
    if len(objects) == 2:
        pair = objects[ranks[0]], objects[ranks[1]]
        server.queued.pop(pair, None)
        return pair
    known = next(iter(objects.values()))
    for pair in server.collapsing:
        if known in pair and (pair[0].rank, pair[1].rank) == ranks:
            return pair
    raise ContactError(f"no pair has the ranks {ranks}")


def _is_known(kind: str, other: str) -> bool:
    try:
        family_of(kind, other)
    except ContactError:
        return False
    return True


def _kinetic(obj: PhysicalObject, velocity: Vec) -> float:
    return 0.0 if obj.fixed else 0.5 * obj.mass * math.fsum(c * c for c in velocity)


__all__ = ["ExactServer"]
