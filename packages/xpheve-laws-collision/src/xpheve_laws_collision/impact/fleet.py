"""The fleet: all that flies from impact to impact, between the engine's columns and the loop that moves it on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.errors import ContactError
from xpheve.events import IMPACT, Entry
from xpheve.kernels.clock import NEVER, Instant, elapsed
from xpheve.laws import ResponseLaw
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.impact.membership import Membership
from xpheve_laws_collision.impact.scenery import STANDING, Surroundings, scenery_rows
from xpheve_laws_collision.impact.stepper import load_again, look_again, put_due
from xpheve_laws_collision.mass import immovable

if TYPE_CHECKING:
    from xpheve_laws_collision.impact.impact_loop import ImpactLoop, Outcome

MANY = 256
"""Moving bodies from which on the loop is compiled at once."""
COMPILE_AFTER = 20_000
"""Impacts after which the loop of fewer is: it has run for a second or two by then."""
AGAIN = 16
"""Times that one pair may be handed to the contact server at one instant."""
HOPS, BRIEFLY = 1_000, 1e-7
"""So many instants left to the server, in so short a time [s], are no motion any more."""
CLUSTER = 4_000
"""Pairs that may touch at one instant in one heap."""

Pair = tuple[PhysicalObject, PhysicalObject]


class Special:
    """An instant that the contact server must look at: of a pair, with others that touch it."""

    __slots__ = ("instant", "kind", "pair", "touching")

    def __init__(self, kind: str, instant: Instant, pair: Pair, touching: list[Pair]) -> None:
        self.kind, self.instant, self.pair, self.touching = kind, instant, pair, touching


class Fleet:
    """Who flies so; the loop, its numbers taken from the engine's columns and given back; and what it leaves to the server."""

    def __init__(self, server: Any) -> None:
        self.server = server
        self.world = server.world
        self.members = Membership()
        self.scenery: list[PhysicalObject] = []
        self.pending: Special | None = None
        self.impacts = self.predictions = self.specials = 0
        self.compiled = False
        self.responses: Any = None
        self._seen: Any = None
        self._laws: list[Any] = []
        self._bits: dict[Any, int] = {}
        self._hops: tuple[Instant, int] = ((-math.inf, 0.0), 0)
        """The first of the last instants that were left to the server, and how many they are."""
        self._again: tuple[Instant, dict[tuple[Pair, str], int]] = (NEVER, {})

    # Who

    def flies(self, obj: PhysicalObject) -> bool:
        """Whether contacts of ``obj`` are left to the loop."""
        flying = self.members.flying
        return bool(flying) and not flying.isdisjoint(self.world.mapping.laws(obj))

    def plan(self) -> None:
        """Decide anew who flies, if the scene is another one."""
        world = self.world
        seen = (world.structure, world._next_serial, world.bodies.count, world.wish, world.ranks.epoch)
        if seen == self._seen:
            return
        restructured = self._seen is None or seen[0] != self._seen[0]
        self._seen = seen
        heard = [law for law in world.laws if world.mapping.objects(law) and self.server._hears(law)]
        other = self.members.decide(world, heard)
        if other:
            self.server.broad_phase.forget()
            self._take_over()
            for obj in world.bodies.objects:
                self._replan(obj)
        if other or restructured:
            self.forget_scenery()

    def refuse_few_images(self) -> None:
        """Raise `ContactError` if contacts are to be found pair by pair: between one image of each object, where the scene has many."""
        for law, why in self.members.why.items():
            if any(not obj.fixed for obj in self.world.mapping.objects(law)):
                raise ContactError(
                    f"{law.label()}: in a periodic scene contacts are found for spheres that fly in the impact loop only, and here {why}. "
                    "Change that, or leave out periodic="
                )

    def _take_over(self) -> None:
        """Void what the server has queued for pairs that fly from now on."""
        queued = self.server.queued
        for pair in [pair for pair in queued if all(map(self.flies, pair))]:
            queued.pop(pair).alive = False

    def _replan(self, obj: PhysicalObject) -> None:
        number = int(self.world.bodies.batch[obj._row])
        if number >= 0 and obj not in self.world.unplanned:
            if self.world.batches[number].stepper.impacts != self.flies(obj):
                self.world.mark(obj)

    def _states(self) -> Iterable[Any]:
        return (one.state for one in self.world.batches if one.stepper.impacts and one.state.count)

    # What changed

    def stale(self, objects: Iterable[PhysicalObject]) -> None:
        """Flights, columns or surroundings of ``objects`` are new."""
        for obj in objects:
            number = int(self.world.bodies.batch[obj._row])
            if not self.members.fits(self.world, obj):
                self._seen = None
            if obj.fixed:
                self.forget_scenery()
            elif number >= 0 and self.world.batches[number].stepper.impacts:
                load_again(self.world.batches[number].state, [int(self.world.bodies.local[obj._row])])

    def forget_scenery(self) -> None:
        """Laws, mapping or scenery may be others from now on."""
        for state in self._states():
            state.made.setdefault("doubt", self.world.time)
            look_again(state)

    def resume(self) -> None:
        """The server has answered: go on."""
        self.pending = None
        for state in self._states():
            look_again(state)

    # The loop

    def fly(self, state: Any, limit: Instant) -> Any:
        """Let the loop of ``state`` go on up to ``limit``; returns the rows whose flights are new."""
        try:
            loop = self._loop(state)
            outcome = loop.run(limit)
        except BaseException:  # Ctrl-C, too: the engine stands where it stood, and the loop is made anew from there
            state.made.pop("loop", None)
            look_again(state)
            raise
        rows = self._give_back(state, loop)
        self.pending = None
        if outcome.kind in ("limit", "watched"):
            put_due(state, loop.next_time())
        elif outcome.kind == "busy":
            look_again(state)
            raise self._wrong(state, outcome)
        else:
            put_due(state, NEVER)
            self.pending = self._special(state, loop, outcome)
        return rows

    def _loop(self, state: Any) -> ImpactLoop:
        """The loop of ``state``, with all numbers as they are now."""
        compiled = self._compiled(state)
        loop: ImpactLoop | None = state.made.get("loop")
        stale: Iterable[int] = state.made.pop("stale", ())
        if loop is None or "doubt" in state.made or compiled != self.compiled:
            around = self._surroundings(state)
            same = self._same(state, around)
            read = around.read()
            same = state.made.get("read") == read and same
            state.made["read"] = read
            if loop is None or not same or compiled != self.compiled or not self.responses.current:
                self.compiled = compiled
                loop = state.made["loop"] = self._made(state, around)
                stale = range(state.count)
            else:
                loop.set_laws(around.laws_of_bit)
        if stale:
            self._load(state, loop, sorted(stale))
        loop.watch([int(self.world.bodies.local[row]) for row in self.world.wakeups.followed(state.rows)])
        return loop

    def _compiled(self, state: Any) -> bool:
        wish = self.world.compile
        if wish != "auto":
            return bool(wish == "always")
        return bool(state.count >= MANY or state.numbers.get("impacts", 0.0) >= COMPILE_AFTER)

    def _surroundings(self, state: Any) -> Surroundings:
        """What the flights of ``state`` are among, as it is now."""
        world, bodies = self.world, self.world.bodies
        laws = world.ordered_laws(self.members.flying)
        self._laws = [law for law in laws if isinstance(law, ResponseLaw)]
        self._bits = {law: bit for bit, law in enumerate(laws)}
        numbers = {law: k for k, law in enumerate(self._laws) if not _grips_otherwise(law)}
        self.scenery = world.in_rank_order(
            {obj: None for law in laws for obj in world.mapping.objects(law) if obj.fixed and obj.rank >= 0}
        )
        rows = [obj._row for obj in self.scenery]
        return Surroundings(
            scenery_rows([self.server._shape(obj) for obj in self.scenery], bodies, rows),
            self._masks(self.scenery),
            np.concatenate([bodies.arrays[name][:, rows] for name in STANDING]).T,
            {
                name: np.array(bodies.columns[name][rows])
                for name in sorted({name for law in self._laws for name in law.columns})
            },
            self._masks([bodies.objects[row] for row in state.rows.tolist()]),
            [numbers.get(law, -1) for law in laws],
        )

    def _same(self, state: Any, around: Surroundings) -> bool:
        """Whether they are those that ``state`` knows; if not, nothing of them was there before the first doubt about it."""
        since = state.made.pop("doubt", self.world.time)
        mark = float(around.mark())
        known = state.numbers.get("known")
        state.numbers["known"] = mark
        if known is not None and known != mark:
            state.numbers["since"], state.numbers["since_rest"] = since
        return bool(known == mark)

    def _made(self, state: Any, around: Surroundings) -> ImpactLoop:
        from xpheve.loop.responses import Responses
        from xpheve_laws_collision.impact.impact_loop import ImpactLoop

        self.responses = Responses(self._laws, around.columns)
        loop = ImpactLoop(
            state.count,
            around.rows,
            around.masks[0],
            self.responses,
            around.laws_of_bit,
            scenery_heard=around.masks[1],
            scenery_columns=around.columns,
            scenery_bodies=around.bodies,
            periodic=self.world.periodic,
            compiled=self.compiled,
        )
        loop.since = state.numbers.get("since", -np.inf), state.numbers.get("since_rest", 0.0)
        return loop

    def _masks(self, objects: Sequence[PhysicalObject]) -> Any:
        """For each of ``objects`` bits of laws that answer, and of those that listen (2, objects)."""
        masks: dict[Any, tuple[int, int]] = {}
        found = np.zeros((2, len(objects)), dtype=np.int64)
        for k, obj in enumerate(objects):
            key = tuple(self.world.mapping.laws(obj))
            if key not in masks:
                masks[key] = self._mask(obj, True), self._mask(obj, False)
            found[:, k] = masks[key]
        return found

    def _mask(self, obj: PhysicalObject, answering: bool) -> int:
        """A bit for each law of ``obj`` that answers contacts, or that listens to them."""
        own = self.world.mapping.laws(obj)
        return sum(
            1 << bit for law, bit in self._bits.items() if law in own and isinstance(law, ResponseLaw) == answering
        )

    def _load(self, state: Any, loop: ImpactLoop, places: Sequence[int]) -> None:
        """Give the loop the numbers of the rows at ``places``."""
        bodies = self.world.bodies
        rows = state.rows[np.array(places, dtype=np.int64)]
        objects = [bodies.objects[row] for row in rows.tolist()]
        arrays = bodies.arrays
        found = self._masks(objects)
        loop.load(
            np.array(places, dtype=np.int64),
            position=arrays["position"][:, rows],
            velocity=arrays["velocity"][:, rows],
            acceleration=state.arrays["acceleration"][:, places],
            clock=bodies.clock[:, rows],
            spin=arrays["angular_velocity"][:, rows],
            radius=np.array([0.0 if obj.shape is None else obj.shape.radius for obj in objects]),
            mass=arrays["mass"][0, rows],
            inertia=arrays["inertia"][0, rows],
            mask=found[0],
            heard=found[1],
            rank=np.array([obj.rank for obj in objects], dtype=np.int64),
            columns={name: bodies.columns[name][rows] for name in loop.columns},
            orientation=arrays["orientation"][:, rows],
            turn_clock=bodies.turn_clock[:, rows],
            streak=state.arrays["streak"][:, places],
        )
        for place, obj in zip(places, objects, strict=True):
            loop.set_skip(place, self._support_of(obj))

    def _support_of(self, obj: PhysicalObject) -> int:
        """The number of the scenery on which ``obj`` rests, or is about to; -1 if there is none."""
        server = self.server
        ground = server.supports[obj].plane if obj in server.supports else None
        for pair in server.collapsing if ground is None else ():
            if obj in pair:
                ground = pair[0] if pair[1] is obj else pair[1]
        return self.scenery.index(ground) if ground in self.scenery else -1

    def _give_back(self, state: Any, loop: ImpactLoop) -> Any:
        """Write what the loop changed into the engine's columns; returns the rows."""
        bodies = self.world.bodies
        changed = loop.changed()
        rows = state.rows[changed.places]
        if len(rows):
            state.arrays["streak"][:, changed.places] = loop.streaks(changed.places)
            bodies.arrays["position"][:, rows] = changed.position
            bodies.arrays["velocity"][:, rows] = changed.velocity
            bodies.clock[:, rows] = changed.clock
            bodies.version[rows] += changed.flights - 1  # one is counted for the call, however many were flown in it
            if len(changed.turned):
                turned = state.rows[changed.turned]
                bodies.arrays["orientation"][:, turned] = changed.orientation
                bodies.arrays["angular_velocity"][:, turned] = changed.spin
                bodies.turn_clock[:, turned] = changed.turn_clock
        counts = loop.take_counts()
        self.impacts += counts.impacts
        self.server.impacts += counts.impacts
        self.predictions += counts.predictions
        state.numbers["impacts"] = state.numbers.get("impacts", 0.0) + counts.impacts
        for law, evaluations, joules in zip(self._laws, counts.evaluations, counts.work, strict=True):
            law.evaluations += int(evaluations)
            if evaluations:
                for container in law.containers:
                    container.firings += int(evaluations)
            if joules:
                self.world.add_work(law.label(), float(joules))
        return rows

    # What it leaves to the server

    def _object(self, state: Any, number: int, is_scenery: bool) -> PhysicalObject:
        return self.scenery[number] if is_scenery else self.world.bodies.objects[int(state.rows[number])]

    def _pair(self, state: Any, place: int, partner: int, is_scenery: bool) -> Pair:
        found: Pair = self.server._pair(self._object(state, place, False), self._object(state, partner, is_scenery))
        return found

    def _special(self, state: Any, loop: ImpactLoop, outcome: Outcome) -> Special:
        pair = self._pair(state, outcome.place, outcome.partner, outcome.is_scenery)
        touching: list[Pair] = []
        if outcome.kind != "rest":
            due = [self._pair(state, *one) for one in loop.due(outcome.instant)]
            touching = list(dict.fromkeys([*due, *self._cluster(state, loop, outcome)]))
        return Special(outcome.kind, max(outcome.instant, self.world.time), pair, touching)

    def _cluster(self, state: Any, loop: ImpactLoop, outcome: Outcome) -> list[Pair]:
        """All pairs that touch in the heap in which the pair of ``outcome`` is."""
        found: dict[Pair, None] = {}
        frontier = [outcome.place] if outcome.is_scenery else [outcome.place, outcome.partner]
        seen = set(frontier)
        while frontier:
            place = frontier.pop()
            for partner, is_scenery in loop.near(place, outcome.instant):
                found[self._pair(state, place, partner, is_scenery)] = None
                if len(found) > CLUSTER:
                    raise ContactError(
                        f"more than {CLUSTER} pairs touch one another at t = {outcome.instant[0]} s, "
                        f"{self._object(state, place, False)!r} among them: put the objects farther apart"
                    )
                if not is_scenery and partner not in seen:
                    seen.add(partner)
                    frontier.append(partner)
        return list(found)

    def schedule(self) -> None:
        """Queue what the loop has left to the server."""
        special = self.pending
        if special is None:
            return
        a, b = special.pair
        version = self.world.bodies.version
        guards = tuple((obj, int(version[obj._row])) for obj in special.pair)
        self.world.schedule(special.instant, IMPACT, (a.rank, b.rank), self.answer, guards)

    def answer(self, entries: list[Entry]) -> None:
        """The instant has come."""
        special, server = self.pending, self.server
        assert special is not None
        self.specials += 1
        self.world.transaction.later.append(self.resume)
        held = self._count_again(special)
        self._count_hops(special)
        server._keep()
        server.queued.pop(special.pair, None)
        if held:
            return
        if special.kind == "rest":
            self.world.transaction.later.append(lambda: self._rest(special))
        else:
            server._answer_cluster(special.pair, special.touching)

    def _rest(self, special: Special) -> None:
        """Ask the server about a pair that seems to rest; what it has nothing to do about is not to be told again."""
        if self.server._predict(special.pair, True) != NEVER:
            return
        for obj in special.pair:
            number = -1 if obj.fixed or obj._row < 0 else int(self.world.bodies.batch[obj._row])
            if number >= 0 and self.world.batches[number].stepper.impacts:
                state = self.world.batches[number].state
                if "loop" in state.made:
                    state.made["loop"].quiet(int(self.world.bodies.local[obj._row]))

    def _hold(self, special: Special) -> bool:
        """Hold the heap that does not come to rest, if its law says so: in it bodies would bounce for ever, at this instant."""
        found = self.server._response(*special.pair)
        if found is None or found[0].parameters.get("resting") != "hold":
            return False
        heap = {obj: None for pair in (special.pair, *special.touching) for obj in pair if not immovable(obj)}
        for obj in self.world.in_rank_order(heap):
            self.world.transaction.later.append(lambda obj=obj: self.server._hold(obj))
        return True

    def _count_again(self, special: Special) -> bool:
        """Count how often a pair is handed over at one instant; whether that is ended by holding it."""
        if self._again[0] != special.instant:
            self._again = (special.instant, {})
        key, counts = (special.pair, special.kind), self._again[1]
        counts[key] = counts.get(key, 0) + 1
        if AGAIN < counts[key] <= 2 * AGAIN and self._hold(special):
            return True
        if counts[key] > AGAIN:
            a, b = special.pair
            raise ContactError(
                f"contacts of {a!r} and {b!r} at t = {special.instant[0]} s do not come to an end ({special.kind}): give them room, or the law "
                "another restitution"
            )
        return False

    def _count_hops(self, special: Special) -> None:
        """Refuse instants that follow one another without end: bodies so far from the origin that floats cannot tell touching from hopping."""
        self._hops = self._hops[0], self._hops[1] + 1
        if self._hops[1] < HOPS:
            return
        if elapsed(special.instant, self._hops[0]) < BRIEFLY:
            a, b = special.pair
            raise ContactError(
                f"{a!r} and {b!r} at t = {special.instant[0]} s: {HOPS} instants within {BRIEFLY:g} s, whose hops no float tells from rest. Put the "
                'scene nearer to the origin, or set resting="hold" on the collision law'
            )
        self._hops = special.instant, 0

    def _wrong(self, state: Any, outcome: Outcome) -> ContactError:
        pair = self._pair(state, outcome.place, outcome.partner, outcome.is_scenery)
        a, b = pair
        if outcome.kind == "busy":
            return ContactError(
                f"impacts at t = {outcome.instant[0]} s do not end: {a.label} - {b.label} among them. A body that fills a gap cannot move across it: "
                "give it room, no speed across the gap, or the law a restitution below 1"
            )
        return ContactError(
            f"{a!r} and {b!r} at t = {outcome.instant[0]} s: their impact gives velocities that no float holds. Look at speeds, masses and the law"
        )

    def report(self) -> dict[str, Any]:
        """For `explain`."""
        moving = sum(state.count for state in self._states())
        return {
            "moving": moving,
            "scenery": len(self.scenery) if moving else 0,
            "tier": ("compiled" if self.compiled else "interpreted") if moving else "",
            "impacts": self.impacts,
            "predictions": self.predictions,
            "left to the server": self.specials,
            "in Python": {law.label(): why for law in self._laws if moving and (why := self.responses.why(law))},
            "not there": {law.label(): why for law, why in self.members.why.items()},
        }

    def told(self) -> list[str]:
        """The report in words."""
        found = self.report()
        words = []
        if found["moving"]:
            words.append(
                f"impact loop: {found['moving']} bodies among {found['scenery']} fixed shapes, {found['tier']}: {found['impacts']} impacts, "
                f"{found['left to the server']} instants left to the server"
            )
        words += [
            f"impact loop: {law} is asked in Python, one impact at a time: {why}"
            for law, why in found["in Python"].items()
        ]
        words += [f"pair by pair: {law}: {why}" for law, why in found["not there"].items()]
        return words


def _grips_otherwise(law: ResponseLaw) -> bool:
    """Whether the server solves contacts of ``law`` by a ``grip`` that ``respond`` may know nothing of: of laws here both say the same."""
    order = type(law).__mro__
    grip, respond = (next(k for k, one in enumerate(order) if name in one.__dict__) for name in ("grip", "respond"))
    if order[grip] is ResponseLaw:
        return False
    return grip < respond or not order[grip].__module__.startswith("xpheve_laws_collision.")


__all__ = ["Fleet"]
