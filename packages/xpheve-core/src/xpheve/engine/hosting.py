"""What laws ask of the engine that holds them, and what hosts tell them: posts, inputs, observers and probes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.engine.looking import Looking
from xpheve.errors import InvalidValueError, UnknownLawError
from xpheve.kernels.clock import later
from xpheve.kernels.vector import Vec
from xpheve.laws import Contact, Event, FieldLaw, PhysicalLaw, ResponseLaw
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.plan import scenery
from xpheve.realtime.doors import door

if TYPE_CHECKING:
    from xpheve.queries import Queries


class Hosting(Looking):
    """The part of `PhysicsEngine` that laws know: `xpheve.laws.law.LawHost`."""

    _queries: Queries | None

    @contextlib.contextmanager
    def acting(self, law: PhysicalLaw) -> Iterator[None]:
        """While ``law`` runs: what it adds is its own; its declared state is taken back if it fails."""
        world = self._world
        before, world.acting = world.acting, law
        kept = {key: list(value) if isinstance(value, list) else value for key, value in law.state.items()}
        if world.transaction is not None:
            world.transaction.undo.append(lambda: _put_state(law, kept))
        try:
            yield
        except BaseException:
            raise  # `acting` stays, so that the error can name the law
        world.acting = before

    @door()
    def set_parameter(self, law: PhysicalLaw, name: str, value: Any) -> None:
        """Set a parameter of ``law``, checked: `PhysicalLaw.set_parameter`."""
        law.put_parameter(name, value)

    @door()
    def set_pairs(self, law: ResponseLaw, pairs: dict[frozenset[PhysicalObject], dict[str, Any]]) -> None:
        """Set what parameters of ``law`` are for pairs of objects, checked: `ResponseLaw.set_pair`."""
        law.put_pairs(pairs)

    @door(waits=True)
    def set_enabled(self, law: PhysicalLaw, value: bool) -> None:
        """Switch ``law``: `PhysicalLaw.enabled`."""
        law.put_enabled(value)

    def law_changed(self, law: PhysicalLaw, what: str, old: Any) -> None:
        """A parameter of ``law``, or whether it is enabled, was set: it takes effect now, or not at all."""
        world = self._world
        try:
            if world.transaction is not None:
                world.transaction.undo.append(lambda: _put_law(law, what, old))
                if what == "enabled":
                    world.transaction.later.append(lambda: scenery.law_changed(world, law, what))
                    return
            scenery.law_changed(world, law, what)
        except BaseException:
            _put_law(law, what, old)
            raise

    def evaluate_and_store(self, law: PhysicalLaw) -> None:
        """Evaluate a field law in an event container once, and store its force until the next event."""
        world = self._world
        if not isinstance(law, FieldLaw):
            raise InvalidValueError(f"{law!r}: only field laws can be stored at events; leave container=None")
        objects = [obj for obj in world.in_rank_order(world.mapping.objects(law)) if not obj.fixed]
        if not objects:
            return
        rows = np.array([obj._row for obj in objects], dtype=np.int64)
        time = later(world.time, world.ahead) if world.ahead else world.time
        force, torque = world.evaluator.field(
            law,
            rows,
            time[0],
            lambda name: np.array([self._world.read_row(int(row), name, time) for row in rows]).T,
            set(),
        )
        with world.instant():
            world._store(law, objects, force, torque)
            world.renewed.update((law, obj) for obj in objects)
            for obj in objects:
                world.sum_forces(obj)

    def answer_contacts(self, law: ResponseLaw, contacts: tuple[Contact, ...]) -> None:
        """Let ``law`` answer ``contacts`` that a polled container found now; those that approach get impulses."""
        if contacts:
            self._serve_contacts()
            with self._world.instant():
                assert self._world.contacts is not None
                self._world.contacts.answer(law, contacts)

    def _serve_contacts(self) -> None:
        """Take up the contact server of the pack that offers one."""
        if self._world.contacts is not None:
            return
        servers = self._contact_servers()
        if not servers:
            raise UnknownLawError("no pack at hand finds contacts: pip install xpheve-laws-collision")
        server = servers[min(servers)]()
        server.attach(self._world)
        self._world.contacts = server

    def _contact_servers(self) -> dict[str, Any]:
        """The contact servers of packs at hand, by id; that of our own pack, if it is there and no other one is loaded."""
        servers = self.registry.contact_servers()
        if not servers:
            with contextlib.suppress(UnknownLawError):
                self.registry.find("contact_server", "collision:exact_server")
            servers = self.registry.contact_servers()
        return servers

    @property
    def queries(self) -> Queries:
        """Rays, nearest points, overlaps and sweeps among the objects as they stand now: `xpheve.queries.Queries`.

        Raises `UnknownLawError` if no pack answers them.
        """
        if self._queries is None:
            servers = self._contact_servers()
            found = (servers[ident].queries(self) for ident in sorted(servers))
            self._queries = next((one for one in found if one is not None), None)
        if self._queries is None:
            raise UnknownLawError("no pack at hand answers queries: pip install xpheve-laws-collision")
        return self._queries

    def random_stream(self, law: PhysicalLaw) -> np.random.Generator:
        """The random numbers of ``law``: seeded by the scene's seed and the law's rank."""
        world = self._world
        if law not in world.streams:
            rank = world.ranks.law_ranks.get(law, world.laws[law])
            world.streams[law] = np.random.default_rng([world.seed, rank])
        stream: np.random.Generator = world.streams[law]
        if world.transaction is not None:
            kept = stream.bit_generator.state
            world.transaction.undo.append(lambda: setattr(stream.bit_generator, "state", kept))
        return stream

    @door()
    def post(self, id: Any, data: Any = None, source: Any = None) -> None:
        """Post ``id``: containers armed with a fitting `xpheve.when.Posted` wake at this instant of simulation time."""
        world = self._world
        sender = source if source is not None else world.acting
        self._structurally(
            lambda: world.tell(
                when.Posted,
                lambda container, condition: condition.id in (None, id) and condition.source in (None, sender),
                Event(world.time[0], id=id, data=data, source=sender),
            )
        )

    @door()
    def input(self, kind: str, data: Any = None) -> None:
        """Hand ``data`` in: containers armed with a fitting `xpheve.when.Input` wake at this instant, with all inputs of it together."""
        self._structurally(lambda: self._world.wakeups.inputs.put(kind, data))

    # Observers and probes

    @property
    def observers(self) -> tuple[Observer, ...]:
        """All observers, as added."""
        return tuple(one for one in self._world.wakeups.points.values() if isinstance(one, Observer))

    @property
    def probes(self) -> tuple[Probe, ...]:
        """All probes, as added."""
        return tuple(one for one in self._world.wakeups.points.values() if not isinstance(one, Observer))

    @door(waits=True)
    def add_observer(self, observer: Observer) -> Observer:
        """Add an observer, for conditions of regions; returns it. Raises `InvalidValueError`, `OwnershipError`."""
        found: Observer = self._world.wakeups.add_point(self, observer, Observer)
        return found

    @door(waits=True)
    def add_probe(self, probe: Probe) -> Probe:
        """Add a probe, for conditions of regions; returns it. Raises `InvalidValueError`, `OwnershipError`."""
        found: Probe = self._world.wakeups.add_point(self, probe, Probe)
        return found

    @door(waits=True)
    def remove_observer(self, observer: Observer) -> None:
        """Take an observer out. Raises `OwnershipError`."""
        self._world.wakeups.remove_point(self, observer)

    @door(waits=True)
    def remove_probe(self, probe: Probe) -> None:
        """Take a probe out. Raises `OwnershipError`."""
        self._world.wakeups.remove_point(self, probe)

    @door()
    def move_point(self, point: Probe, position: Vec) -> None:
        """Put an observer or probe at ``position`` [m], checked: `Probe.position`."""
        self._world.wakeups.move_point(point, position)


def _put_law(law: PhysicalLaw, what: str, value: Any) -> None:
    """Set a parameter, or ``enabled``, without telling the engine."""
    if what == "enabled":
        law._enabled = value
    elif what == "_pairs":
        law._pairs = value
    else:
        law.parameters[what] = value


def _put_state(law: PhysicalLaw, kept: dict[str, Any]) -> None:
    """Give ``law`` back the state it had."""
    law.state.clear()
    law.state.update(kept)


__all__ = ["Hosting"]
