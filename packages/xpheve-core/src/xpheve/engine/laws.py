"""The laws of an engine and the containers that say when they are enforced."""

from __future__ import annotations

import math
from typing import Any

from xpheve.engine.hosting import Hosting
from xpheve.errors import InvalidValueError, LawDefinitionError, OwnershipError
from xpheve.laws import ContinuousLaw, LawContainer, PairLaw, PhysicalLaw
from xpheve.laws.conditions import Condition
from xpheve.plan import scenery
from xpheve.plan.proof import require_formula
from xpheve.plan.wakeups.references import check_references
from xpheve.realtime.doors import door


class Laws(Hosting):
    """The part of `PhysicsEngine` that takes laws and containers in and out."""

    @door(waits=True)
    def add_law(
        self,
        law: str | PhysicalLaw | type[PhysicalLaw],
        container: LawContainer | type[LawContainer] | str | None = None,
        **parameters: Any,
    ) -> PhysicalLaw:
        """Add a law by id, by class, or made; ``parameters``, ``name``, ``enabled``, ``between`` and ``pairs`` go to the first two.

        ``container`` says when it is enforced; by default what the law itself asks for.

        Raises
        ------
        UnknownLawError, BrokenPackError, ParameterError, LawDefinitionError, NotAcceptedError, OwnershipError
            Before anything changes.
        TraceError
            If the law's ``force``, ``torque`` or ``potential`` is no formula, or has other units than it must: before anything changes.
        """
        made = self._make_law(law, parameters)
        world = self._world
        if "engine" not in made.__dict__:
            raise LawDefinitionError(
                f"{made.label()}: __init__ of {type(made).__name__} leaves the law unmade: begin it with super().__init__(**parameters), "
                "or leave it out and declare numbers as Param"
            )
        if made.engine is not None:
            where = "this engine already" if made.engine is self else "another engine"
            raise OwnershipError(f"{made!r} is in {where}; make another: type(law)(**law.parameters)")
        if made.name and any(other.name == made.name for other in self._world.laws):
            raise InvalidValueError(
                f"a law named {made.name!r} is in the engine already; names are unique: choose another"
            )
        named = made.named or () if isinstance(made, PairLaw) else ()
        for obj in named:
            if obj._engine is not self:
                word = "between names" if made.between is not None else "pairs name"  # type: ignore[attr-defined]
                raise OwnershipError(f"{made.label()}: {word} {obj!r}, which is not in this engine: add it first")
        if isinstance(made, PairLaw):
            made.reach()
        self._check_formula(made)
        holder = self._container_for(made, container)
        if holder is not None:
            holder.check(made)
        if holder is not None and holder.engine is None:
            self.add_container(holder)
        self._take_law(made)
        if holder is not None:
            holder.add_law(made)
        for obj in named:
            scenery.map_law(world, obj, made)
        return made

    def _make_law(self, law: str | PhysicalLaw | type[PhysicalLaw], parameters: dict[str, Any]) -> PhysicalLaw:
        if isinstance(law, PhysicalLaw):
            if parameters:
                raise InvalidValueError(f"{law!r} is made already; set {', '.join(parameters)} on it before adding")
            if not law.is_concrete():
                raise LawDefinitionError(f"{law!r} says nothing yet: write its force, respond or enforce_this_law")
            return law
        kind = self.registry.law(law) if isinstance(law, str) else law
        if not (isinstance(kind, type) and issubclass(kind, PhysicalLaw)):
            raise InvalidValueError(
                f"{law!r} is no law: give an id such as 'basic:planet_gravity', a PhysicalLaw class, or a law"
            )
        if not kind.is_concrete():
            raise LawDefinitionError(f"{kind.__name__} says nothing yet: write its force, respond or enforce_this_law")
        if not isinstance(law, str) and kind.id:
            from xpheve.plugins.spec import check_spec, spec_of

            check_spec(spec_of(kind), kind)
        return kind(**parameters)

    def _container_for(
        self, law: PhysicalLaw, container: LawContainer | type[LawContainer] | str | None
    ) -> LawContainer | None:
        """The container for ``law``: the one given, one of the same kind and condition, or a new one; None for laws that act all the time."""
        if isinstance(container, LawContainer):
            if container.engine is not self:
                self._check_container(container)
            return container
        if container is not None and not isinstance(container, str):
            if not (isinstance(container, type) and issubclass(container, LawContainer)):
                hint = (
                    f"; a condition goes into one: LawContainer({container})"
                    if isinstance(container, Condition)
                    else ""
                )
                raise InvalidValueError(f"container = {container!r}: give a LawContainer, its class, or its id{hint}")
        if container is None:
            if law.container:
                container = law.container
            elif law.condition is None:
                if not isinstance(law, ContinuousLaw):
                    raise InvalidValueError(
                        f"{law!r} does not say when: give add_law(law, container=LawContainer(condition)), or set `condition` on the class"
                    )
                return None
        kind = self.registry.container(container) if isinstance(container, str) else container or LawContainer
        condition = None if kind.condition is not None or kind.detects() else law.condition
        usual = {key: param.default for key, param in kind.params.items()}
        for held in self._world.containers:
            same = held.condition == (kind.condition if condition is None else condition) and held.parameters == usual
            if type(held) is kind and same and not held.name and held not in self._world.spent:
                return held
        return kind(condition)

    @door(waits=True)
    def add_container(self, container: LawContainer) -> LawContainer:
        """Add a container; laws may be in it already or come later (`LawContainer.add_law`)."""
        world = self._world
        if isinstance(container, LawContainer) and container.engine is self:
            return container
        self._check_container(container)
        if container.condition is not None and container.condition.served_by == "contacts":
            self._serve_contacts()
        container.engine = self
        world.structure += 1
        world.containers.append(container)
        world.dirty = True
        if world.transaction is not None:
            world.transaction.undo.append(lambda: scenery.remove_container(world, container))
        for law in container.laws:
            if law.engine is None:
                self._take_law(law)
        return container

    def _check_formula(self, law: PhysicalLaw) -> None:
        """Raise if ``law`` says no formula, or cannot live in a periodic scene that this is."""
        require_formula(law)
        if self._world.periodic is not None:
            from xpheve.plan import periodic

            periodic.check_law(law)

    def _check_container(self, container: LawContainer) -> None:
        """Raise if ``container`` cannot be added."""
        if not isinstance(container, LawContainer):
            hint = f"; a condition goes into one: LawContainer({container})" if isinstance(container, Condition) else ""
            raise InvalidValueError(f"container = {container!r}: give a LawContainer{hint}")
        if container.engine is not None:
            raise OwnershipError(f"{container!r} is in another engine")
        if container.condition is None and not container.is_polled:
            raise InvalidValueError(f"{container!r} has no condition: LawContainer(condition), or override detect")
        check_references(self, container)
        if self._world.periodic is not None:
            from xpheve.plan import periodic

            periodic.check_container(self._world, container)
        period = container.period
        if (
            container.is_polled
            and period is not None
            and not (isinstance(period, (int, float)) and 0 < period < math.inf)
        ):
            raise InvalidValueError(
                f"{container!r}: period = {period!r}: a finite time above 0 s is needed, or None for host steps"
            )
        if container.name and any(other.name == container.name for other in self._world.containers):
            raise InvalidValueError(
                f"a container named {container.name!r} is in the engine already; names are unique: choose another"
            )
        for law in container.laws:
            if law.engine not in (None, self):
                raise OwnershipError(f"{container!r} holds {law!r}, which is in another engine")
            self._check_formula(law)

    def _take_law(self, law: PhysicalLaw) -> None:
        """``law``, checked, is in this engine from now on."""
        world = self._world
        world.laws[law] = max(world.laws.values(), default=0) + 1
        law.engine = self
        world.structure += 1
        world.dirty = True
        if world.transaction is not None:
            world.transaction.undo.append(lambda: scenery.forget_law(world, law))

    def adopt_law(self, law: PhysicalLaw) -> None:
        """``law`` is about to be put into a container of this engine: it comes along, unless it is elsewhere."""
        if law.engine is None:
            self._check_law_name(law)
            self._check_formula(law)
            self._take_law(law)
        elif law.engine is not self:
            raise OwnershipError(f"{law!r} is in another engine; make another: type(law)(**law.parameters)")
        self._world.structure += 1

    @door(waits=True)
    def put_law(self, container: LawContainer, law: PhysicalLaw) -> None:
        """Put ``law`` into ``container`` of this engine: `LawContainer.add_law`."""
        container.check(law)
        self.adopt_law(law)
        container.put(law)

    @door(waits=True)
    def take_law_out(self, container: LawContainer, law: PhysicalLaw) -> None:
        """Take ``law`` out of ``container`` of this engine: `LawContainer.remove_law`."""
        container.take_out(law)

    def _check_law_name(self, law: PhysicalLaw) -> None:
        if law.name and any(other.name == law.name for other in self._world.laws):
            raise InvalidValueError(
                f"a law named {law.name!r} is in the engine already; names are unique: choose another"
            )

    def _own_law(self, law: PhysicalLaw | str) -> PhysicalLaw:
        found = self.law(law) if isinstance(law, str) else law
        if not isinstance(found, PhysicalLaw) or found.engine is not self:
            raise OwnershipError(f"{law!r} is not in this engine: add it with engine.add_law first")
        return found

    @door(waits=True)
    def remove_law(self, law: PhysicalLaw | str) -> None:
        """Take a law out with its mappings; forces it stored are withdrawn."""
        found = self._own_law(law)
        self._structurally(lambda: scenery.remove_law(self._world, found) if found.engine is self else None)

    @door(waits=True)
    def remove_container(self, container: LawContainer) -> None:
        """Take a container out; its laws stay in the engine."""
        if not isinstance(container, LawContainer) or container.engine is not self:
            raise OwnershipError(f"{container!r} is no container of this engine")
        self._structurally(lambda: scenery.remove_container(self._world, container))


__all__ = ["Laws"]
