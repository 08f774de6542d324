"""What is in an engine, and how it stands: what all its rooms build on."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from threading import get_ident
from typing import Any

import numpy as np

from xpheve.bodies import STATE_WIDTHS, BodiesView
from xpheve.errors import InvalidValueError, OwnershipError, UnknownLawError
from xpheve.kernels.vector import Vec
from xpheve.laws import LawContainer, PhysicalLaw
from xpheve.objects import PhysicalObject
from xpheve.plan import energy as conserved
from xpheve.plan.energy import Energy
from xpheve.plugins.registry import Registry
from xpheve.realtime.control import Control
from xpheve.realtime.doors import look


class Looking(Control):
    """The part of `PhysicsEngine` that is looked at."""

    _registry: Registry | None
    _disable: tuple[str, ...]

    @property
    def registry(self) -> Registry:
        """Where packs are found."""
        if self._registry is None:
            self._registry = Registry(disable=self._disable) if self._disable else Registry.default()
        return self._registry

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        live = self._live
        if live is not None and live.holder != get_ident():
            return self._seen(live).time
        return self._world.time[0]

    @property
    def up(self) -> str:
        """The axis that points up."""
        return self._world.up

    @property
    def periodic(self) -> Vec | None:
        """Edges [m] of the box whose opposite faces are one, infinite along an axis without period; None where there is none."""
        return self._world.periodic

    @property
    def seed(self) -> int:
        """Seed of the laws' random numbers."""
        return self._world.seed

    @property
    def compile(self) -> str:
        """``"auto"``, ``"always"`` or ``"never"``: which loops are compiled. Set anew, it holds from the next step on; motion stays the same."""
        return self._world.compile

    @compile.setter
    def compile(self, wish: str) -> None:
        self._world.wish_compiled(wish)

    @property
    def stepper(self) -> str:
        """The id of the stepper that is to serve all groups that it can; empty if the plan chooses. Set anew, it holds from now on."""
        return self._world.wish

    @stepper.setter
    def stepper(self, wish: str) -> None:
        self._wish_stepper(wish)

    def _wish_stepper(self, wish: str) -> None:
        """Ask for stepper ``wish``, whose pack is loaded if it is a pack's."""
        if isinstance(wish, str) and ":" in wish and not wish.startswith("core:"):
            with contextlib.suppress(UnknownLawError):
                self.registry.find("stepper", wish)
        self._world.wish_stepper(wish)

    @property
    def state(self) -> str:
        """``"ready"``, ``"running"``, ``"suspended"``, ``"failed"`` or ``"terminated"``."""
        return self._state

    @property
    def objects(self) -> tuple[PhysicalObject, ...]:
        """All objects, in the order of the rows of `bodies`; removing one moves the last into its place."""
        live = self._live
        if live is not None and live.holder != get_ident():
            return self._seen(live).objects
        return tuple(self._world.bodies.objects)

    @property
    def laws(self) -> tuple[PhysicalLaw, ...]:
        """All laws, as added."""
        return tuple(self._world.laws)

    @property
    def containers(self) -> tuple[LawContainer, ...]:
        """All containers, as added."""
        return tuple(self._world.containers)

    @property
    def bodies(self) -> BodiesView:
        """All objects as read-only arrays at the present time."""
        return self._view

    def object(self, name: str) -> PhysicalObject:
        """The object called ``name``. Raises `InvalidValueError`."""
        for obj in self.objects:
            if obj.name == name:
                return obj
        from xpheve.plugins.suggest import did_you_mean

        names = [obj.name for obj in self.objects if obj.name]
        raise InvalidValueError(f"no object is named {name!r}.{did_you_mean(name, names)}")

    def law(self, name: str) -> PhysicalLaw:
        """The law called ``name``, or with that id if there is one only. Raises `UnknownLawError`."""
        found = [law for law in self._world.laws if law.name == name] or [
            law for law in self._world.laws if law.label() == name
        ]
        if len(found) == 1:
            return found[0]
        if found:
            raise UnknownLawError(f"{len(found)} laws here are {name!r}: give them names, and ask by name")
        at_hand = ", ".join(law.name or law.label() for law in self._world.laws) or "none"
        hint = f". Add it first: engine.add_law({name!r})" if ":" in str(name) else ""
        raise UnknownLawError(f"no law here is {name!r}; at hand: {at_hand}{hint}")

    @look
    def look_at(self, ask: Callable[[], Any]) -> Any:
        """What ``ask()`` gives, which sees the scene whole: on a thread that does not hold it, between two frames."""
        return ask()

    @look
    def laws_of(self, obj: PhysicalObject) -> tuple[PhysicalLaw, ...]:
        """The laws that ``obj`` obeys, in rank order."""
        return tuple(self._world.ordered_laws(self._world.mapping.laws(obj)))

    @look
    def objects_of(self, law: PhysicalLaw) -> tuple[PhysicalObject, ...]:
        """The objects that obey ``law``, in rank order."""
        return tuple(self._world.in_rank_order(self._world.mapping.objects(law)))

    @look
    def energy(self) -> Energy:
        """Kinetic and potential energy [J], and the work [J] done so far by what has no potential."""
        return conserved.energy(self._world)

    @look
    def momentum(self) -> Vec:
        """Momentum [kg m/s] of all moving objects."""
        return conserved.momentum(self._world)

    @look
    def angular_momentum(self) -> Vec:
        """Angular momentum [kg m^2/s] of all moving objects about the origin."""
        return conserved.angular_momentum(self._world)

    @look
    def frame(self) -> Any:
        """The present state for a record (`xpheve.record.frame.Frame`)."""
        from xpheve.record.frame import Frame

        world = self._world
        columns = {name: np.ascontiguousarray(world.show_all(name).T) for name in STATE_WIDTHS}
        serial = world.bodies.serial[: world.bodies.count].copy()
        return Frame(time=self.time, serial=serial, energy=(*self.energy(),), **columns)

    @look
    def object_table(self) -> list[dict[str, Any]]:
        """What a record says of each object."""
        return [
            {
                "serial": obj.serial,
                "name": obj.name,
                "shape": None if obj.shape is None else self._described(obj.shape),
                "mass": obj.mass,
                "fixed": obj.fixed,
            }
            for obj in self._world.bodies.objects
        ]

    def _described(self, shape: Any) -> dict[str, Any]:
        described: dict[str, Any] = shape.describe()
        if described.get("normal", ...) is None:
            described["normal"] = list(self._world.up_vector)
        return described

    # What the rooms share

    def owns(self, obj: PhysicalObject) -> bool:
        """Whether the handle ``obj`` stands for the row it names."""
        live = self._live
        if live is not None and live.holder != get_ident():
            return True  # it is here, and rows may be on the move; a write looks again when it is done
        objects = self._world.bodies.objects
        return 0 <= obj._row < len(objects) and objects[obj._row] is obj

    def _check_own(self, obj: PhysicalObject) -> None:
        if not isinstance(obj, PhysicalObject) or obj._engine is not self:
            if isinstance(obj, PhysicalLaw):
                raise InvalidValueError(
                    f"{obj!r} stands where an object is needed: the object comes first, then the law"
                )
            raise OwnershipError(f"{obj!r} is not in this engine: add it with engine.add_object")

    def _structurally(self, act: Callable[[], None]) -> None:
        """Do ``act`` now, or at the end of the instant while a handler runs."""
        transaction = self._world.transaction
        if transaction is None:
            act()
        else:
            transaction.later.append(act)


__all__ = ["Looking"]
