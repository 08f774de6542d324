"""Follows what is watched along its flights, and puts each next change into the queue; does nothing for what nobody is armed with."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

from xpheve.errors import LawFailedError
from xpheve.events import START, Entry
from xpheve.kernels.clock import Instant, elapsed, later
from xpheve.laws import Event, LawContainer
from xpheve.laws import conditions as when
from xpheve.laws.conditions import Condition
from xpheve.objects import PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.plan.wakeups.motion import Subject, carrier, motion_of
from xpheve.plan.wakeups.watches import Record, Watch, make_watch, next_change, watch_key

Call = tuple[int, int, LawContainer, Condition | None, Event]


class Look(Entry):
    """What is predicted of one subject of a watch: a change of state, the end of a window, or an error on the way."""

    __slots__ = ("error", "state", "subject", "watch", "way", "window")
    watch: Watch
    subject: Subject
    state: Any
    way: tuple[Instant, float]
    window: tuple[float, float] | None
    error: LawFailedError | None


class Tracker:
    """All watches of a world."""

    def __init__(self, world: Any) -> None:
        self.world = world
        self.watches: dict[tuple[Any, ...], Watch] = {}
        self.predictions = 0
        """How often a motion was looked at; 0 for as long as nobody is armed."""
        self._by_object: dict[PhysicalObject, list[tuple[Watch, Subject]]] = {}
        self.restored: dict[tuple[Any, ...], dict[Subject, Record]] = {}
        """Records of a checkpoint, until their subjects are planned."""

    # Who is watched

    def arm(self) -> None:
        """Watch what is asked for now, and nothing else; to be called again when the scene is planned."""
        wanted: dict[tuple[Any, ...], dict[Subject, None]] = {}
        for leaf, containers in self.world.wakeups.armed.all().items():
            key = watch_key(leaf)
            if key is not None:
                wanted.setdefault(key, {}).update(dict.fromkeys(self._subjects(leaf, containers)))
        for key in [key for key in self.watches if key not in wanted]:
            for record in self.watches.pop(key).records.values():
                _void(record)
        new: list[tuple[Watch, Subject]] = []
        for key, subjects in wanted.items():
            watch = self.watches.get(key)
            if watch is None:
                watch = self.watches[key] = make_watch(self.world, key)
            for subject in [one for one in watch.records if one not in subjects]:
                _void(watch.records.pop(subject))
            known: dict[Subject, Record | None] = dict(self.restored.get(key, {}))
            for subject in subjects:
                # What has no flight yet is looked at when it is planned.
                if subject not in watch.records and carrier(subject) not in self.world.unplanned:
                    watch.records[subject] = known.get(subject) or Record()
                    new.append((watch, subject))
        self._by_object = {}
        for watch in self.watches.values():
            for subject in watch.records:
                obj = carrier(subject)
                if obj is not None:
                    self._by_object.setdefault(obj, []).append((watch, subject))
        for watch, subject in new:
            self.look(watch, subject)

    def _subjects(self, leaf: Any, containers: list[LawContainer]) -> list[Subject]:
        """Whom ``leaf`` is about, in rank order."""
        world = self.world
        points = list(world.wakeups.points.values())
        if isinstance(leaf, (when.RegionActive, when.RegionInactive, when.ObserverEnter, when.ObserverExit)):
            return [point for point in points if isinstance(point, Observer)]
        named = leaf.probe if isinstance(leaf, (when.ProbeEnter, when.ProbeExit)) else leaf.obj
        if named is not None:
            here = named in points if isinstance(named, Probe) else named._row >= 0 and named in world.bodies.objects
            return [named] if here else []
        objects = {obj: None for c in containers for law in c.laws for obj in world.mapping.objects(law)}
        found: list[Subject] = list(world.in_rank_order(objects))
        if isinstance(leaf, (when.ProbeEnter, when.ProbeExit)):
            found += [point for point in points if not isinstance(point, Observer)]
        return found

    # Predicting

    def refresh(self, objects: Iterable[PhysicalObject]) -> None:
        """The flights of ``objects`` are new."""
        if self._by_object:
            for obj in objects:
                for watch, subject in self._by_object.get(obj, ()):
                    self.look(watch, subject)

    def follows_any(self, objects: Iterable[PhysicalObject]) -> bool:
        """Whether a quantity of one of ``objects`` is followed."""
        return bool(self._by_object) and any(self._by_object.get(obj) for obj in objects)

    def rows(self) -> set[int]:
        """The rows of the objects of which a quantity is followed."""
        return {obj._row for obj in self._by_object}

    def moved(self, point: Probe) -> None:
        """The host moved ``point``."""
        for watch in self.watches.values():
            if point in watch.records:
                self.look(watch, point)

    def look(self, watch: Watch, subject: Subject) -> None:
        """Predict the next change of ``subject``."""
        record = watch.records.get(subject)
        if record is None:
            return
        _void(record)
        world = self.world
        self.predictions += 1
        motion = motion_of(world, subject)
        now = max(elapsed(world.time, motion.begin), 0.0)
        if record.passed is not None and record.passed[0] == motion.begin:
            now = max(now, record.passed[1])
        try:
            outlook = watch.outlook(subject, motion, record, now)
        except LawFailedError as error:
            self._push(watch, subject, world.time, motion, now, None, error=error)
            return
        if record.state is None:
            here = [state for start, state in outlook.states if start <= now] or [outlook.states[0][1]]
            record.state = here[-1]
        found = next_change(outlook.states, motion, now, record.state, outlook.reads)
        if found is not None and found[0] <= motion.span:
            at = world.time if found[0] <= now else max(later(motion.begin, found[0]), world.time)
            self._push(watch, subject, at, motion, found[0], found[1])
        elif outlook.end < motion.span:
            window = (outlook.end, outlook.wish)
            self._push(watch, subject, later(motion.begin, outlook.end), motion, outlook.end, None, window=window)

    def _push(
        self,
        watch: Watch,
        subject: Subject,
        at: Instant,
        motion: Any,
        s: float,
        state: Any,
        window: tuple[float, float] | None = None,
        error: LawFailedError | None = None,
    ) -> None:
        order = list(self.watches).index(self._key_of(watch))
        obj = carrier(subject)
        rank = (2, order, -1 if obj is None else obj.rank, 0 if isinstance(subject, PhysicalObject) else 1)
        entry = Look(at, watch.stage if window is None else START, rank, self.due, motion.guards)
        entry.watch, entry.subject, entry.state, entry.way = watch, subject, state, (motion.begin, s)
        entry.window, entry.error = window, error
        watch.records[subject].entry = entry
        self.world.queue.push(entry)

    def _key_of(self, watch: Watch) -> tuple[Any, ...]:
        return next(key for key, one in self.watches.items() if one is watch)

    # What comes

    def due(self, entries: list[Entry]) -> None:
        """All changes of one stage of an instant: made first, told then, in the order of the containers' ranks."""
        transaction = self.world.transaction
        changed: dict[Watch, list[tuple[Subject, Any]]] = {}
        for entry in entries:
            assert isinstance(entry, Look)
            record = entry.watch.records.get(entry.subject)
            if record is None or record.entry is not entry:
                continue
            if entry.error is not None:
                raise entry.error
            kept = (record.state, record.start, record.wish, record.begin, record.passed)
            transaction.undo.append(partial(_put_back, record, kept, entry))
            if entry.window is not None:
                record.start, record.wish = entry.window
            else:
                if record.state != 0 or isinstance(record.state, bool):
                    changed.setdefault(entry.watch, []).append((entry.subject, entry.state))
                record.state, record.passed = entry.state, entry.way
            transaction.later.append(partial(self.look, entry.watch, entry.subject))
        self._tell(changed)

    def _tell(self, changed: dict[Watch, list[tuple[Subject, Any]]]) -> None:
        world = self.world
        calls: list[Call] = []
        for key, watch in self.watches.items():
            changes = changed.get(watch)
            if changes:
                for leaf, containers in world.wakeups.armed.all().items():
                    if watch_key(leaf) == key:
                        calls += self._calls(leaf, containers, changes)
        told: set[LawContainer] = set()
        for _, _, container, leaf, event in sorted(calls, key=lambda call: call[:2]):
            if leaf is None and container in told:
                continue
            if leaf is None:
                told.add(container)
            world.signal(container, leaf, event)

    def _calls(self, leaf: Any, containers: list[LawContainer], changes: list[tuple[Subject, Any]]) -> list[Call]:
        world = self.world
        found: list[Call] = []
        counted = False
        for k, (subject, state) in enumerate(changes):
            if not leaf.is_level and not _fits(leaf, subject, state):
                continue
            if leaf.is_level and getattr(leaf, "obj", None) not in (None, subject):
                continue
            if not (leaf.is_level and counted):
                world.wakeups.armed.count(leaf)
                counted = True
            obj = carrier(subject)
            event = Event(
                world.time[0],
                leaf,
                (obj,) if obj is not None and obj._row >= 0 else (),
                id=subject.label if isinstance(subject, Probe) else None,
                source=subject if isinstance(subject, Probe) else None,
                data=state if isinstance(leaf, when.Crosses) else None,
            )
            for container in containers:
                if container not in world.spent and (leaf.is_level or self._concerns(leaf, container, subject)):
                    rank = world.ranks.container_ranks.get(container, 0)
                    found.append((rank, k, container, None if leaf.is_level else leaf, event))
        return found

    def _concerns(self, leaf: Any, container: LawContainer, subject: Subject) -> bool:
        """Whether ``container`` hears of ``subject``: it is named, a point, or under one of the laws."""
        if isinstance(subject, Probe):
            return getattr(leaf, "probe", None) in (None, subject)
        named = leaf.probe if isinstance(leaf, (when.ProbeEnter, when.ProbeExit)) else leaf.obj
        if named is not None:
            return named is subject
        laws = self.world.mapping.laws(subject)
        return any(law in laws for law in container.laws)

    def holds(self, leaf: Any) -> bool:
        """Whether the simple level ``leaf`` holds now."""
        key = watch_key(leaf)
        watch = self.watches.get(key) if key is not None else None
        records = watch.records if watch is not None else {}
        if isinstance(leaf, (when.Asleep, when.Awake)):
            record = records.get(leaf.obj)
            return record is not None and bool(record.state) == isinstance(leaf, when.Asleep)
        active = any(record.state for record in records.values())
        return active == isinstance(leaf, when.RegionActive)


def _fits(leaf: Any, subject: Subject, state: Any) -> bool:
    """Whether the change of ``subject`` to ``state`` is one that ``leaf`` waits for."""
    if isinstance(leaf, (when.ObserverEnter, when.ObserverExit)):
        return isinstance(subject, Observer) and state == isinstance(leaf, when.ObserverEnter)
    if isinstance(leaf, (when.ProbeEnter, when.ProbeExit)):
        if leaf.probe is None and isinstance(subject, Observer):
            return False
        return leaf.probe in (None, subject) and state == isinstance(leaf, when.ProbeEnter)
    if leaf.obj not in (None, subject):
        return False
    if isinstance(leaf, when.Crosses):
        return leaf.direction in (0, state)
    return bool(state) == isinstance(leaf, when.Asleep)


def _void(record: Record) -> None:
    if record.entry is not None:
        record.entry.alive = False
        record.entry = None


def _put_back(record: Record, kept: tuple[Any, ...], entry: Entry) -> None:
    record.state, record.start, record.wish, record.begin, record.passed = kept
    entry.alive = True
    record.entry = entry
