"""Conditions, and what waits for them, as plain values and back: for checkpoints, copies and resets.

Functions are named by their place in a list of the live ones, and by their name, by which a checkpoint is given them back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

from xpheve import shapes
from xpheve.errors import RecordError
from xpheve.events import Entry
from xpheve.laws import Contact, Event, LawContainer, PhysicalLaw
from xpheve.laws import conditions as when
from xpheve.laws.combinations import _Combination
from xpheve.laws.conditions.text import TextExpression
from xpheve.objects import PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.plan.wakeups.delivery import Delivery
from xpheve.plan.wakeups.timers import Timer
from xpheve.plan.wakeups.tree import Memory, Tree
from xpheve.plan.wakeups.watches import Record
from xpheve.regions import Region

Plain = Any
SHAPES = {kind.kind: kind for kind in (shapes.Sphere, shapes.Box, shapes.Plane)}


class Writer:
    """Makes plain values of what a world's conditions hold."""

    def __init__(self, world: Any, laws: Sequence[PhysicalLaw], containers: Sequence[LawContainer]) -> None:
        self.world = world
        self.law_numbers = {law: k for k, law in enumerate(laws)}
        self.containers = list(containers)
        self.functions: list[Callable[..., Any]] = []
        self.gone: list[PhysicalObject] = []
        """Objects that are in the world no more, though events or conditions name them."""

    def object(self, obj: PhysicalObject) -> int:
        """The serial number of ``obj``; of one that is gone the place among those, counted down from -1."""
        objects = self.world.bodies.objects
        if 0 <= obj._row < len(objects) and objects[obj._row] is obj:
            return int(obj.serial)
        if not any(one is obj for one in self.gone):
            self.gone.append(obj)
        return -1 - next(k for k, one in enumerate(self.gone) if one is obj)

    def value(self, value: Any) -> Plain:
        """A field of a condition, or what a watch is about."""
        if isinstance(value, when.Condition):
            return ["condition", *self.condition(value)]
        if isinstance(value, Region):
            return ["region", _described(value.shape), value.position, value.orientation]
        if isinstance(value, PhysicalObject):
            return ["object", self.object(value)]
        if isinstance(value, Probe):
            return ["probe", value.name]
        if isinstance(value, PhysicalLaw):
            return ["law", self.law_numbers.get(value, -1)]
        if isinstance(value, TextExpression):
            return ["text", value.text]
        if callable(value):
            if value not in self.functions:
                self.functions.append(value)
            return ["function", self.functions.index(value), getattr(value, "__qualname__", type(value).__name__)]
        return ["plain", value]

    def condition(self, condition: Any) -> list[Plain]:
        """A condition: its class and fields."""
        own = {field.name: self.value(getattr(condition, field.name)) for field in fields(condition) if field.init}
        if isinstance(condition, _Combination):
            own["of"] = ["plain", [self.condition(one) for one in condition.of]]
        return [type(condition).__name__, own]

    def event(self, event: Event) -> dict[str, Plain]:
        """An event, without its condition."""
        contacts = [
            [
                self.object(c.body_a),
                self.object(c.body_b),
                *(c.normal, c.point, c.separation, c.approach_speed),
                *(c.impulse, c.relative_velocity, c.impulse_vector, c.instant),
            ]
            for c in event.contacts
        ]
        force = event.force
        return {
            "time": event.time,
            "objects": [self.object(obj) for obj in event.objects],
            "contacts": contacts,
            "id": event.id,
            "data": event.data,
            "source": self.value(event.source),
            "force": None if force is None else [force.vector, force.torque, force.duration, force.id],
            "dt": event.dt,
        }

    def wakeups(self) -> dict[str, Plain]:
        """Timers, deliveries, inputs, latches, observers and windows."""
        wakeups = self.world.wakeups
        return {
            "points": [self._point(point) for point in wakeups.points.values()],
            "timers": [self._timer(timer) for timer in wakeups.timers.all],
            "timed": [self.containers.index(c) for c in wakeups.timers.known if c in self.containers],
            "waiting": self._waiting(),
            "inputs": [list(one) for one in wakeups.inputs.waiting],
            "trees": [
                [self.containers.index(container), self._memory(tree.memory)]
                for container, tree in wakeups.trees.items()
                if container in self.containers
            ],
            "watches": self._watches(),
            "detections": [[self.condition(leaf), n] for leaf, n in wakeups.armed.detections.items()],
        }

    def _point(self, point: Probe) -> list[Plain]:
        attached = point.attached
        riding = None if attached is None else attached.serial
        return [point.kind, point.name, None if riding is not None else point.position, riding, point.radius]

    def _timer(self, timer: Timer) -> list[Plain]:
        hearers = [self.containers.index(c) for c in timer.hearers]
        polled = isinstance(timer.key, LawContainer)
        key = None if polled else self.condition(timer.key)
        return [key, timer.period, timer.every, timer.origin, timer.count, hearers]

    def _waiting(self) -> list[Plain]:
        found = []
        for item in sorted(self.world.queue._heap):
            entry = item[-1]
            if isinstance(entry.act, Delivery) and entry.act.container in self.containers:
                act = entry.act
                place = self.containers.index(act.container)
                found.append(
                    [entry.instant, entry.stage, entry.rank, place, self.condition(act.leaf), self.event(act.event)]
                )
        return found

    def _memory(self, memory: Memory) -> dict[str, Plain]:
        def parts(given: Any) -> list[Plain]:
            return [[self.condition(leaf), self.event(event)] for leaf, event in given]

        return {
            "met": [[k, parts(given)] for k, given in memory.met.items()],
            "at": [[k, instant, parts(given)] for k, (instant, given) in memory.at.items()],
            "held": [[k, held] for k, held in memory.held.items()],
            "used": sorted(memory.used),
        }

    def _watches(self) -> list[Plain]:
        tracker = self.world.wakeups.tracker
        found = []
        for key in dict.fromkeys([*tracker.watches, *tracker.restored]):
            known = tracker.restored.get(key, {}) | (tracker.watches[key].records if key in tracker.watches else {})
            records = [
                [self.value(subject), one.state, one.begin, one.start, one.wish, one.passed]
                for subject, one in known.items()
            ]
            found.append([[self.value(part) for part in key], records])
        return found


def _described(shape: Any) -> dict[str, Plain]:
    described: dict[str, Plain] = shape.describe()
    return described


def _frozen(value: Any) -> Any:
    """Lists, as JSON has them, as the tuples that they were."""
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


class Reader:
    """Makes conditions of plain values, with the handles of a new or restored world."""

    def __init__(
        self,
        objects: Sequence[PhysicalObject],
        serials: Sequence[int],
        laws: Sequence[PhysicalLaw],
        points: dict[str, Probe],
        functions: Sequence[Callable[..., Any]],
        by_place: bool,
        gone: Sequence[PhysicalObject] = (),
    ) -> None:
        self.objects = dict(zip(serials, objects, strict=True)) | {-1 - k: obj for k, obj in enumerate(gone)}
        self.laws, self.points, self.functions, self.by_place = laws, points, functions, by_place

    def value(self, plain: Plain) -> Any:
        """What `Writer.value` was given."""
        kind, *rest = plain
        if kind == "condition":
            return self.condition(rest)
        if kind == "region":
            described = dict(rest[0])
            region = Region(SHAPES[described.pop("kind")](**described))
            object.__setattr__(region, "position", tuple(rest[1]))
            object.__setattr__(region, "orientation", tuple(rest[2]))
            if rest[0]["kind"] == "plane":  # the very bits: a unit vector made unit again may be another
                object.__setattr__(region.shape, "normal", tuple(rest[0]["normal"]))
            return region
        if kind == "object":
            return self.objects[rest[0]]
        if kind == "probe":
            return self.points.get(rest[0]) or Probe(rest[0])
        if kind == "law":
            return self.laws[rest[0]] if rest[0] >= 0 else None
        if kind == "text":
            return TextExpression(rest[0])
        if kind == "function":
            return self._function(*rest)
        return _frozen(rest[0])

    def _function(self, place: int, name: str) -> Callable[..., Any]:
        if self.by_place:
            return self.functions[place]
        for one in self.functions:
            if getattr(one, "__qualname__", type(one).__name__) == name:
                return one
        raise RecordError(f"the checkpoint needs the function {name} of a condition: restore(..., functions=[{name}])")

    def condition(self, plain: Plain) -> Any:
        """What `Writer.condition` was given."""
        name, own = plain
        kind = getattr(when, name)
        if issubclass(kind, _Combination):
            return kind(*(self.condition(one) for one in own["of"][1]), once=own["once"][1])
        return kind(**{key: self.value(value) for key, value in own.items()})

    def event(self, plain: dict[str, Plain]) -> Event:
        """What `Writer.event` was given."""
        from xpheve.forces import Force

        by = self.objects
        force = plain["force"]
        return Event(
            plain["time"],
            objects=tuple(by[serial] for serial in plain["objects"]),
            contacts=tuple(self.contact(*one) for one in plain["contacts"]),
            id=plain["id"],
            data=plain["data"],
            source=self.value(plain["source"]),
            force=None if force is None else Force(force[0], force[2], force[3], torque=force[1]),
            dt=plain["dt"],
        )

    def contact(self, a: int, b: int, *values: Any) -> Contact:
        """A contact of the objects of two serial numbers."""
        told: list[Any] = [tuple(one) if isinstance(one, (list, tuple)) else one for one in values]
        return Contact(self.objects[a], self.objects[b], *told)

    def points_of(self, plain: list[Plain], engine: Any) -> None:
        """Fill `points` with observers and probes, live ones of that name kept."""
        for kind, name, position, riding, radius in plain:
            point = self.points.get(name)
            if point is None:
                point = Observer(name, radius=radius) if kind == "observer" else Probe(name)
                self.points[name] = point
            point.engine = engine
            point._attached = None if riding is None else self.objects[riding]
            if position is not None:
                point._position = tuple(position)

    def wakeups(self, world: Any, containers: Sequence[LawContainer], plain: dict[str, Plain]) -> None:
        """Fill the fresh ``world``; its containers, objects and queue are there."""
        wakeups = world.wakeups
        wakeups.points = {name: self.points[name] for _, name, *_ in plain["points"]}
        for key, period, every, origin, count, hearers in plain["timers"]:
            made = containers[hearers[0]] if key is None else self.condition(key)
            timer = Timer(made, period, every, tuple(origin), count)
            timer.hearers = [containers[k] for k in hearers]
            wakeups.timers.all.append(timer)
            wakeups.timers.set(timer)
        wakeups.timers.known = {containers[k]: None for k in plain["timed"]}
        for instant, stage, rank, place, leaf, event in plain["waiting"]:
            act = Delivery(world, containers[place], self.condition(leaf), self.event(event))
            world.queue.push(Entry(tuple(instant), stage, tuple(rank), act))
        wakeups.inputs.waiting = [(kind, data) for kind, data in plain["inputs"]]
        if wakeups.inputs.waiting:
            wakeups.inputs.announce()
        for place, memory in plain["trees"]:
            tree = wakeups.trees[containers[place]] = Tree(containers[place].condition)
            tree.memory = self._memory(memory)
        for key, records in plain["watches"]:
            held = wakeups.tracker.restored.setdefault(tuple(self.value(part) for part in key), {})
            for subject, state, begin, start, wish, passed in records:
                record = held[self.value(subject)] = Record(state)
                record.begin = None if begin is None else tuple(begin)
                record.start, record.wish = start, wish
                record.passed = None if passed is None else (tuple(passed[0]), passed[1])
        wakeups.armed.detections = {self.condition(leaf): n for leaf, n in plain["detections"]}
        if plain["watches"]:
            wakeups.tracker.arm()

    def _memory(self, plain: dict[str, Plain]) -> Memory:
        def parts(given: Any) -> list[Any]:
            made = [(self.condition(leaf), self.event(event)) for leaf, event in given]
            return [(leaf, replace(event, condition=leaf)) for leaf, event in made]

        memory = Memory()
        memory.met = {k: parts(given) for k, given in plain["met"]}
        memory.at = {k: (tuple(instant), parts(given)) for k, instant, given in plain["at"]}
        memory.held = {k: held for k, held in plain["held"]}
        memory.used = set(plain["used"])
        return memory
