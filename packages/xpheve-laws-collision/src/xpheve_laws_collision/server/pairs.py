"""Pairs of objects: who they are, how they stand, who asks for them, and which tables remember them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from xpheve.errors import ContactError
from xpheve.events import Entry
from xpheve.kernels.clock import NEVER, Instant, elapsed
from xpheve.kernels.vector import Vec, sub
from xpheve.laws import Contact
from xpheve.laws.event import UNKNOWN
from xpheve.laws.response import meets
from xpheve.objects import PhysicalObject
from xpheve.periodic import near_image, shortest
from xpheve.shapes import Plane
from xpheve.steppers.contract import ContactServer, Flight
from xpheve_laws_collision.broad_phase import BroadPhase
from xpheve_laws_collision.impact.fleet import Fleet
from xpheve_laws_collision.mass import immovable
from xpheve_laws_collision.narrow_phase import Family, Gap, Mover, family_of, flipped
from xpheve_laws_collision.narrow_phase.limits import extent_of, has_mesh, too_far_apart
from xpheve_laws_collision.server.curves import Curves

Pair = tuple[PhysicalObject, PhysicalObject]

SHORTEST_FLIGHT = 1e-10  # [s] a bounce shorter than this is ended in closed form (design 8)
TABLES = ("touching", "inside", "supports", "held", "collapsing", "streaks", "told")


ROUND = ("sphere", "plane")
"""Shapes whose normals at contacts give no spin."""
TURNING = 4.0
"""For other shapes, the speed that counts as none is this times as much: levers and rotations round more often."""


class _Point:
    """The shape of an object that has none: a sphere of radius 0."""

    kind = "sphere"
    radius = 0.0


class Given(NamedTuple):
    """What the response gave a pair at this instant: sizes [N s] and vector [N s] of its impulses; and how fast [m/s] it met."""

    impulse: float = math.nan
    vector: Vec = UNKNOWN
    velocity: Vec = UNKNOWN


class Support(NamedTuple):
    """What an object rests on: the plane, and the unit normal from it outwards."""

    plane: PhysicalObject
    outward: Vec


class Pairs(ContactServer):
    """What every room of the server asks for: tables of pairs, and the geometry of one."""

    def attach(self, world: Any) -> None:
        self.world = world
        self.curves = Curves(world)
        self.broad_phase = BroadPhase(world, self.curves)
        self.fleet = Fleet(self)
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
        self.given: dict[Pair, Given] = {}
        """What the pairs of the instant that is being told got."""
        self.repeated: tuple[Instant, dict[Pair, int]] = (NEVER, {})
        """How often each pair has met at the instant of the last impact: a guard, that changes no motion."""
        self.queued: dict[Pair, Entry] = {}
        """The last entry of each pair, so that none is queued twice."""
        self.swept: Instant = NEVER
        """Until when pairs have been looked for, in scenes of many bodies."""
        self.near: Pair | None = None
        """The pair that is being asked for its impact, and not only for when it may be near."""
        self.impacts = 0
        self.generations = 0
        self.predictions = 0
        self.watched: dict[PhysicalObject, tuple[int, Instant]] = {}
        """Flights without end, by version, and until when they are looked at."""
        self._families: dict[tuple[str, str], tuple[Family, bool]] = {}
        self._planes: dict[Plane, Plane] = {}
        self._kinds: dict[Any, set[tuple[str, bool]]] = {}
        self._meshes: dict[Any, tuple[int, bool]] = {}
        """By law: whether a mesh was among its objects, and at which structure of the scene."""
        self._extents: dict[Any, dict[bool, tuple[float, float]]] = {}
        """By law, of fixed objects and of others: the greatest reach, and the least that one of them allows [m]."""
        self.looked: dict[Pair, tuple[Instant, int]] = {}
        """Searches that had to be taken up again: the last, and how many in a row hardly moved on; a guard, that changes no motion."""

    def check(self, obj: PhysicalObject, laws: Sequence[Any]) -> None:
        own = (self._kind(obj), obj.fixed)
        for law in laws:
            if not any(c.condition is not None and c.condition.served_by == "contacts" for c in law.containers):
                continue
            if own[0] == "mesh":
                self.world.structure += 1  # what meets it flies along parabolas from then on
            if own[0] == "mesh" and any(obj.angular_velocity):
                raise ContactError(f"{obj!r} under {law!r}: {_turns(f'angular velocity {obj.angular_velocity} rad/s')}")
            kinds = self._kinds.setdefault(law, set())
            for kind, fixed in sorted(kinds):
                if not (fixed and obj.fixed) and not _is_known(own[0], kind):
                    kinds.clear()  # of those that are gone, too: see who is there
                    kinds.update((self._kind(one), one.fixed) for one in self.world.mapping.objects(law))
                    break
            for kind, fixed in sorted(kinds):
                if not (fixed and obj.fixed):
                    try:
                        family_of(own[0], kind)
                    except ContactError as error:
                        raise ContactError(f"{obj!r} under {law!r}: {error}") from None
            kinds.add(own)
            self._check_sizes(obj, law)

    def _kind(self, obj: PhysicalObject) -> str:
        """What its contacts are found as: a compound with a mesh among its parts meets what a mesh meets."""
        shape = self._shape(obj)
        return "mesh" if has_mesh(shape) else str(shape.kind)

    def parabolas(self, obj: PhysicalObject) -> str:
        if obj in self.supports:
            return f"it rests on {self.supports[obj].plane.label}"
        if obj in self.held:
            return "it is held"
        for law in self._heard_laws(obj):
            if self._with_mesh(law):
                return f"a mesh is among the objects of {law.label()}"
        return ""

    def _with_mesh(self, law: Any) -> bool:
        """Whether an object of ``law`` is a mesh, or has one among its parts."""
        seen = self._meshes.get(law)
        if seen is None or seen[0] != self.world.structure:
            found = any(has_mesh(self._shape(one)) for one in self.world.mapping.objects(law))
            seen = self._meshes[law] = self.world.structure, found
        return seen[1]

    def check_turning(self, obj: PhysicalObject, spin: Vec) -> None:
        self._refuse_mesh(obj, f"angular velocity {spin} rad/s" if any(spin) else "")

    def _refuse_turning(self, obj: PhysicalObject) -> None:
        """Refuse a mesh that impacts, or a torque, have made turn."""
        if has_mesh(self._shape(obj)):
            self.check_turning(obj, self.world.bodies.get("angular_velocity", obj._row))
            torque = self.world.bodies.get("torque", obj._row)
            self._refuse_mesh(obj, f"torque {torque} N m" if any(torque) and not immovable(obj) else "")

    def _refuse_mesh(self, obj: PhysicalObject, turning: str) -> None:
        if turning and not obj.fixed and has_mesh(self._shape(obj)) and self._heard_laws(obj):
            raise ContactError(f"{obj!r} at t = {self.world.time[0]} s: {_turns(turning)}")

    def _check_sizes(self, obj: PhysicalObject, law: Any) -> None:
        """Refuse shapes that floats cannot tell apart, alone or beside those that are there."""
        shape = self._shape(obj)
        try:
            reach, most = extent_of(shape)
        except ContactError as error:
            raise ContactError(f"{obj!r} under {law!r}: {error}") from None
        known = self._extents.setdefault(law, {})
        if obj.fixed not in known:
            known[obj.fixed] = (0.0, math.inf)
        for fixed, (largest, least) in known.items():
            if (obj.fixed and fixed) or (largest <= most and reach <= least):
                continue
            # Of those that are gone, too: see who is there.
            for one in self.world.mapping.objects(law):
                other = self._shape(one)
                if one is obj or (obj.fixed and one.fixed):
                    continue
                size, limit = extent_of(other)
                if size > most or reach > limit:
                    large, small = (other, shape) if size > most else (shape, other)
                    raise ContactError(f"{obj!r} and {one!r} under {law!r}: {too_far_apart(large, small)}")
        largest, least = known[obj.fixed]
        known[obj.fixed] = (max(largest, reach), min(least, most))

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

    def _has_mesh(self, pair: Pair) -> bool:
        """Whether a mesh, or a compound with one among its parts, is one of ``pair``: a ball may touch it at several places."""
        return any(has_mesh(self._shape(obj)) for obj in pair)

    def _family(self, a: PhysicalObject, b: PhysicalObject) -> tuple[Family, bool]:
        kinds = (self._shape(a).kind, self._shape(b).kind)
        found = self._families.get(kinds)
        if found is None:
            try:
                found = self._families[kinds] = family_of(*kinds)
            except ContactError as error:
                raise ContactError(f"{a!r} and {b!r}: {error}") from None
        return found

    def _mover(self, obj: PhysicalObject, t: Instant, flight: Flight | None = None) -> Mover:
        """``obj`` at ``t``, which is not before its last re-base; ``flight`` is its own, if that is at hand."""
        flight = flight if flight is not None else self.world.flight(obj._row)
        if flight.curved:
            x, v, a = self.curves.centre(obj, t, flight)
        else:
            s = elapsed(t, flight.t0)
            x, v, a = flight.position, flight.velocity, flight.acceleration
            half = 0.5 * s
            x = (x[0] + s * (v[0] + half * a[0]), x[1] + s * (v[1] + half * a[1]), x[2] + s * (v[2] + half * a[2]))
            v = (v[0] + s * a[0], v[1] + s * a[1], v[2] + s * a[2])
        shape = self._shape(obj)
        turning: tuple[Any, ...] = ()
        orientation: Any = self.world.bodies.get("orientation", obj._row)
        if shape.kind not in ROUND:
            row, bodies = obj._row, self.world.bodies
            orientation, spin = (self.world.read_row(row, name, t) for name in ("orientation", "angular_velocity"))
            still = (0.0, 0.0, 0.0)
            turning = (
                (spin, still, still)
                if immovable(obj)
                else (spin, bodies.get("inertia", row), bodies.get("torque", row))
            )
        return Mover(x, v, a, orientation, shape, *turning)

    def _movers(
        self,
        a: PhysicalObject,
        b: PhysicalObject,
        t: Instant,
        flights: tuple[Flight | None, Flight | None] = (None, None),
    ) -> tuple[Mover, Mover]:
        """Both at ``t``; in a periodic scene the second, or what is fixed, as the image nearest to the other."""
        one, two = self._mover(a, t, flights[0]), self._mover(b, t, flights[1])
        box = self.world.periodic
        if box is not None:
            if a.fixed:
                return beside(one, two, box), two
            return one, beside(two, one, box)
        return one, two

    def _points(self, pair: Pair, t: Instant) -> list[Gap]:
        """The points at which ``pair`` touches; the deepest if none does any more, by rounding."""
        a, b = pair
        family, swapped = self._family(a, b)
        movers = self._movers(a, b, t)
        found = family.points(*(movers[::-1] if swapped else movers))
        if swapped:
            found = [flipped(gap) for gap in found]
        return found or [self._gap(pair, t)]

    def _response(self, a: PhysicalObject, b: PhysicalObject) -> tuple[Any, Instant] | None:
        """The law that answers contacts of the two, and since when; none if neither can be moved."""
        if (immovable(a) and immovable(b)) or not meets(a, b):
            return None
        found: tuple[Any, Instant] | None = self.world.response_law(a, b)
        return found

    def _lever(self, obj: PhysicalObject, gap: Gap) -> Vec:
        """From the centre of ``obj`` to the contact [m]; in a periodic scene of its image there."""
        arm = sub(gap.point, self.world.read_row(obj._row, "position"))
        return arm if self.world.periodic is None else shortest(arm, self.world.periodic)

    def _answered(self, pair: Pair) -> bool:
        return self._response(*pair) is not None

    def _gap(self, pair: Pair, t: Instant) -> Gap:
        a, b = pair
        family, swapped = self._family(a, b)
        one, two = self._movers(a, b, t)
        return flipped(family.gap(two, one)) if swapped else family.gap(one, two)

    def _interest(self, pair: Pair) -> Instant | None:
        """Since when somebody asks for contacts of ``pair``; None if nobody does."""
        a, b = pair
        if not meets(a, b):
            return None
        since: Instant | None = None
        found = self._response(a, b)
        if found is not None:
            since = found[1]
        laws_b = self.world.mapping.laws(b)
        for law, mapped in self.world.mapping.laws(a).items():
            other = laws_b.get(law)
            # Those that respond answer, or have nothing to do with the pair.
            if other is not None and not hasattr(law, "respond") and _hears(law):
                joint = max(mapped, other)
                since = joint if since is None else min(since, joint)
        return since

    def _heard_laws(self, obj: PhysicalObject) -> dict[Any, Instant]:
        """The laws of ``obj`` that wait for contacts in some container."""
        return {law: since for law, since in self.world.mapping.laws(obj).items() if _hears(law)}

    def _hears(self, law: Any) -> bool:
        return _hears(law)

    def _asking_laws(self, obj: PhysicalObject) -> dict[Any, Instant]:
        """The laws of ``obj`` that wait for contacts which are found pair by pair, and not by the loop."""
        return {} if self.fleet.flies(obj) else self._heard_laws(obj)

    def flies(self, obj: PhysicalObject) -> bool:
        return self.fleet.flies(obj)

    def plan(self) -> None:
        self.fleet.plan()
        if self.world.periodic is not None and not self.world.unplanned:
            self.fleet.refuse_few_images()

    def _predict(self, pair: Pair, resting: bool = False) -> Instant:
        """Queue the next event of ``pair``; returns when it is. Its room is `prediction`."""
        raise NotImplementedError

    def _is_support(self, pair: Pair) -> bool:
        a, b = pair
        return any(s in self.supports and self.supports[s].plane is p for s, p in ((a, b), (b, a)))

    def _forget_pair(self, pair: Pair) -> None:
        self.queued.pop(pair, None)
        self.touching.pop(pair, None)
        self.inside.pop(pair, None)
        self.collapsing.pop(pair, None)

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


def beside(mover: Mover, other: Mover, box: Vec) -> Mover:
    """The image of ``mover`` in the periodic ``box`` that is nearest to ``other``; to a plane, which is along the box, all are."""
    if mover.shape.kind == "plane" or other.shape.kind == "plane":
        return mover
    return mover._replace(position=near_image(mover.position, other.position, box))


def pair_of(entry: Entry, server: Pairs) -> Pair:
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


def _hears(law: Any) -> bool:
    """Whether ``law`` is enabled and waits for contacts in some container."""
    if law.enabled:
        for container in law.containers:
            if container.condition is not None and container.condition.served_by == "contacts":
                return True
    return False


def _turns(turning: str) -> str:
    return (
        f"a mesh turns ({turning}): contacts with a mesh are known where it does not turn. Make it a Hull or a "
        "Compound of convex parts, hold its rotation, or do not map it to the collision law"
    )


def _is_known(kind: str, other: str) -> bool:
    try:
        family_of(kind, other)
    except ContactError:
        return False
    return True


def contact_of(pair: Pair, gap: Gap, approach: float, now: Instant, given: Given) -> Contact:
    """What listeners and laws are told of ``pair`` at the instant ``now``."""
    place = (gap.normal, gap.point, gap.separation, approach)
    return Contact(pair[0], pair[1], *place, given.impulse, given.velocity, given.vector, now)


def kinetic(obj: PhysicalObject, velocity: Vec) -> float:
    """Kinetic energy [J] of the centre of mass; 0 for what no impulse moves."""
    return 0.0 if immovable(obj) else 0.5 * obj.mass * math.fsum(c * c for c in velocity)
