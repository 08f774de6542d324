"""Everything about wakeup conditions that a world has, under one name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

from xpheve.errors import InvalidValueError, OwnershipError
from xpheve.events import START, Entry
from xpheve.laws import Event, LawContainer
from xpheve.laws.combinations import AllNow, AnyOf, Not
from xpheve.laws.conditions import Condition
from xpheve.objects import PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.plan.wakeups.armed import Armed
from xpheve.plan.wakeups.delivery import Delivery, needs_tree
from xpheve.plan.wakeups.inputs import Inputs
from xpheve.plan.wakeups.timers import Timers
from xpheve.plan.wakeups.tracker import Tracker
from xpheve.plan.wakeups.tree import Tree


class Wakeups:
    """The servers of conditions, and what combinations remember."""

    def __init__(self, world: Any) -> None:
        self.world = world
        self.armed = Armed(world)
        self.timers = Timers(world)
        self.tracker = Tracker(world)
        self.inputs = Inputs(world)
        self.trees: dict[LawContainer, Tree] = {}
        self.points: dict[str, Probe] = {}
        """Observers and probes by name."""
        self.paces: WeakKeyDictionary[PhysicalObject, tuple[Any, float]] = WeakKeyDictionary()
        """How fast curved flights without end are, each with what makes that void."""
        self._arming: set[LawContainer] = set()
        self._planned: Any = None

    def plan(self) -> None:
        """Arm what is new; one comparison if nothing is."""
        world = self.world
        key = (world.structure, len(world.containers), world._next_serial, world.bodies.count, len(self.points))
        if key == self._planned:
            return
        self._planned = key
        self.timers.arm()
        self.tracker.arm()
        self.tracker.restored.clear()
        for container in world.containers:
            if needs_tree(container.condition):
                tree = self.trees.get(container)
                if tree is None:
                    tree = self.trees[container] = Tree(container.condition)
                if container not in self._arming and tree.is_stale(self.holds):
                    self._arming.add(container)
                    rank = (3, world.ranks.container_ranks.get(container, 0))
                    world.queue.push(Entry(world.time, START, rank, partial(self._first, container)))

    def _first(self, container: LawContainer, entries: list[Entry]) -> None:
        """Tell ``container`` of the levels that hold when it is armed, or changed because something came or went."""
        self._arming.discard(container)
        if container in self.trees:
            self.world.signal(container, None, Event(self.world.time[0]))

    def refresh(self, objects: Any) -> None:
        """The flights of ``objects`` are new."""
        self.tracker.refresh(objects)

    def followed(self, rows: Any) -> list[int]:
        """Those of ``rows`` of which something is followed along their flights."""
        watched = self.tracker.rows()
        return [int(row) for row in rows if int(row) in watched] if watched else []

    def forget(self, container: LawContainer) -> None:
        """``container`` is gone."""
        self.timers.forget(container)
        self.trees.pop(container, None)
        self._arming.discard(container)

    def tell(self, kind: type[Condition], fits: Callable[[LawContainer, Any], bool], event: Event) -> None:
        """Queue ``event`` now for every container armed with a condition of ``kind`` that ``fits`` takes."""
        world = self.world
        ranks = world.ranks.container_ranks
        for k, (leaf, containers) in enumerate(self.armed.of(kind)):
            found = [c for c in containers if c not in world.spent and fits(c, leaf)]
            if found:
                self.armed.count(leaf)
                world.posts += 1
            for container in found:
                rank = (1, world.posts, ranks.get(container, 0), k)
                world.queue.push(Entry(world.time, START, rank, Delivery(world, container, leaf, event)))

    def tell_now(self, kind: type[Condition]) -> None:
        """Tell all who wait for ``kind`` at once, in an instant of its own or the open one."""
        heard = self.armed.hearers(kind)
        if heard:
            with self.world.instant():
                for leaf in dict.fromkeys(leaf for _, leaf in heard):
                    self.armed.count(leaf)
                for container, leaf in heard:
                    self.world.signal(container, leaf, Event(self.world.time[0], leaf))

    def holds(self, condition: Condition) -> bool:
        """Whether a level condition holds now."""
        if isinstance(condition, Not):
            return not self.holds(condition.of[0])
        if isinstance(condition, AllNow):
            return all(self.holds(one) for one in condition.of)
        if isinstance(condition, AnyOf):
            return any(self.holds(one) for one in condition.of)
        return self.tracker.holds(condition)

    # Observers and probes

    def add_point(self, engine: Any, point: Any, kind: type[Probe]) -> Any:
        """Take in an observer or probe."""
        if not isinstance(point, kind) or (kind is Probe and isinstance(point, Observer)):
            raise InvalidValueError(f"{point!r} is no {kind.__name__}: give one such as xpheve.{kind.__name__}('name')")
        if point.engine is not None:
            where = "this engine already" if point.engine is engine else "another engine"
            raise OwnershipError(f"{point!r} is in {where}; make another")
        if point.name in self.points:
            raise InvalidValueError(
                f"an observer or probe named {point.name!r} is in the engine already; names are unique: choose another"
            )
        if point.attached is not None and point.attached._engine is not engine:
            raise OwnershipError(f"{point!r} rides on {point.attached!r}, which is not in this engine: add it first")
        self._put(engine, point)
        if self.world.transaction is not None:
            self.world.transaction.undo.append(lambda: self._take(point))
        return point

    def _put(self, engine: Any, point: Probe) -> None:
        self.points[point.name] = point
        point.engine = engine
        self.world.structure += 1

    def _take(self, point: Probe) -> None:
        self.points.pop(point.name, None)
        point.engine = None
        self.world.structure += 1

    def remove_point(self, engine: Any, point: Any) -> None:
        """Let an observer or probe go; it stays where it is. What met regions meets them no more, and levels follow."""
        if not isinstance(point, Probe) or point.engine is not engine:
            raise OwnershipError(f"{point!r} is no observer or probe of this engine")
        if self.world.transaction is not None:
            order = dict(self.points)
            self.world.transaction.undo.append(lambda: self._return(engine, point, order))
        point._position = point.position
        point._attached = None
        self._take(point)

    def _return(self, engine: Any, point: Probe, order: dict[str, Probe]) -> None:
        self._put(engine, point)
        self.points = order

    def move_point(self, point: Probe, position: Any) -> None:
        """The host puts ``point`` at ``position`` now."""
        kept = (point._attached, point._position)
        with self.world.instant() as transaction:
            transaction.undo.append(lambda: _place(point, *kept))
            _place(point, None, position)
            transaction.later.append(partial(self._moved, point, kept[0] is not None))

    def _moved(self, point: Probe, was_attached: bool) -> None:
        if was_attached:
            self.tracker.arm()
        self.tracker.moved(point)

    def let_go(self, obj: PhysicalObject) -> None:
        """``obj`` is about to leave the engine: what rides on it stays where it is."""
        for point in self.points.values():
            if point._attached is obj:
                _place(point, None, point.position)
                self.tracker.moved(point)

    def report(self) -> list[dict[str, Any]]:
        """Each distinct condition with its server: one, however many containers share it."""
        found = []
        for leaf, containers in self.armed.all().items():
            found.append(
                {
                    "condition": str(leaf),
                    "server": SERVERS[leaf.served_by],
                    "containers": len(containers),
                    "detections": self.armed.detections.get(leaf, 0),
                }
            )
        return found


SERVERS = {
    "engine": "engine",
    "queue": "event queue",
    "steps": "host steps",
    "contacts": "contact server",
    "flights": "flights",
    "members": "its members",
}


def _place(point: Probe, attached: PhysicalObject | None, position: Any) -> None:
    point._attached, point._position = attached, position
