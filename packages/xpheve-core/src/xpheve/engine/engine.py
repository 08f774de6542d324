"""PhysicsEngine: the front door."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from xpheve.bodies import BodiesView
from xpheve.engine.handles import Handles
from xpheve.engine.objects import Objects
from xpheve.engine.running import Running
from xpheve.errors import InvalidValueError
from xpheve.plan.world import World
from xpheve.plugins.registry import Registry
from xpheve.realtime.doors import look
from xpheve.steppers.contract import Stepper


class PhysicsEngine(Running, Handles, Objects):
    """Objects, laws and time.

    Parameters
    ----------
    up
        The axis that points up: ``"x"``, ``"y"`` or ``"z"``.
    seed
        Of the laws' random numbers.
    registry
        Where packs are found; by default the installed ones.
    disable
        Packs, distributions or ids that must not be used.
    on_law_error
        ``"raise"``, or ``"disable"`` to switch off a law that fails, with a warning, and go on.
    compile
        ``"auto"``: loops over many objects or pairs are compiled, small ones are not; by the scene alone, never by a clock or a cache.
        ``"always"``, or ``"never"``.
    stepper
        The id of a stepper that is to serve all groups that it can, such as ``"core:symplectic8"``; by default the plan chooses.
    periodic
        Edges (Lx, Ly, Lz) [m] of a box whose opposite faces are one; None along an axis without period. Places are in [0, L). What knows one
        image of each object only is refused by name.

    Raises
    ------
    InvalidValueError
        If a setting is not one of those.
    """

    def __init__(
        self,
        *,
        up: str = "y",
        seed: int = 0,
        registry: Registry | None = None,
        disable: Sequence[str] = (),
        on_law_error: str = "raise",
        compile: str = "auto",
        stepper: str = "",
        periodic: Sequence[float | None] | None = None,
    ) -> None:
        if up not in ("x", "y", "z"):
            raise InvalidValueError(f"up = {up!r}: choose 'x', 'y' or 'z'")
        if on_law_error not in ("raise", "disable"):
            raise InvalidValueError(f"on_law_error = {on_law_error!r}: choose 'raise' or 'disable'")
        if not isinstance(seed, int) or seed < 0:
            raise InvalidValueError(f"seed = {seed!r}: a whole number from 0 up is needed")
        box = None
        if periodic is not None:
            from xpheve.periodic import periods

            box = periods(periodic)
        self._registry = registry
        self._disable = tuple(disable)
        self._on_law_error = on_law_error
        self._state = "ready"
        self._started = False
        self._running = False
        self._authored: Any = None
        self._queries: Any = None
        self._prepare_control()
        self._view = BodiesView(lambda: self._world.bodies, self._now, self._read_column, lambda: self.snapshot)
        self._renew(World(up, seed, self._all_steppers, box))
        self._world.wish_compiled(compile)
        self._wish_stepper(stepper)
        registry_now = self.registry
        registry_now.call("xpheve_engine_created", engine=self)

    def __setattr__(self, name: str, value: Any) -> None:
        if type(self) is PhysicsEngine and not name.startswith("_") and not hasattr(type(self), name):
            raise InvalidValueError(
                f"engine.{name} = {value!r}: an engine has no {name!r}. What acts is a law: engine.add_law(...), law.parameter = ...; "
                "attributes of your own go into a subclass"
            )
        super().__setattr__(name, value)

    def _renew(self, world: World) -> None:
        """Take up ``world``."""
        self._world = world
        world.on_law_error = self._on_law_error
        world.stopped = self._halted  # type: ignore[method-assign]

    def _all_steppers(self, along: bool = True) -> list[Stepper]:
        """Core's steppers and those of packs; without ``along`` not those that only serve laws evaluated along the way."""
        from xpheve.steppers.core import core_steppers

        return [*core_steppers(along), *(found() for found in self.registry.steppers().values())]

    def _now(self) -> Any:
        """What `bodies` depends on."""
        world = self._world
        return id(world), world.time, world.bodies.change

    def _read_column(self, name: str, spare: Any) -> Any:
        return self._world.show_all(name, spare)

    @look
    def explain(self) -> Any:
        """Who serves what and why, what was skipped, and the drift; ``str()`` for people, ``.data`` and ``.to_json()``."""
        from xpheve.plan.explain import explain

        return explain(self)

    def __repr__(self) -> str:
        world = self._world
        return f"<PhysicsEngine t = {self.time} s, {world.bodies.count} objects, {len(world.laws)} laws, {self._state}>"


__all__ = ["PhysicsEngine"]
