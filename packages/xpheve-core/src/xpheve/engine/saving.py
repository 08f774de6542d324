"""How an engine is kept and comes back: checkpoints, copies, scene files."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from xpheve.engine.looking import Looking
from xpheve.errors import PackError, RecordError, StateError, UnknownLawError, XpheveError
from xpheve.laws import LawContainer, PhysicalLaw
from xpheve.objects import PhysicalObject
from xpheve.plugins.registry import Registry
from xpheve.realtime.doors import look

if TYPE_CHECKING:
    from xpheve.engine.engine import PhysicsEngine


class Saving(Looking):
    """The part of `PhysicsEngine` that saves and restores it."""

    def _save(self) -> Any:
        from xpheve.plan.saved import save

        return save(self._world, self._started)

    def _take_up(self, saved: Any) -> None:
        from xpheve.plan.saved import restore_into

        restore_into(self, saved)

    @look
    def checkpoint(self, path: str | os.PathLike[str] | None = None) -> bytes:
        """Everything that a run depends on, as bytes, and in a file if ``path`` is given (written aside, then renamed)."""
        from xpheve.plan.saved import attributes_of
        from xpheve.record.checkpoint import pack, write

        if self._world.transaction is not None:
            raise StateError("a handler cannot take a checkpoint: the instant is not over; take it between runs")
        saved = self._save()
        saved.check_functions()
        header, arrays = saved.portable(self._authored)
        for serial, kept in attributes_of(self).items():
            _check_plain(serial, kept)
            header.setdefault("attributes", {})[str(serial)] = kept
        data = pack((header, arrays))
        if path is not None:
            write(Path(path), data)
        return data

    @classmethod
    def restore(
        cls,
        checkpoint: bytes | str | os.PathLike[str],
        *,
        laws: Sequence[type[PhysicalLaw]] = (),
        containers: Sequence[type[LawContainer]] = (),
        objects: Sequence[type[PhysicalObject]] = (),
        functions: Sequence[Callable[..., Any]] = (),
        registry: Registry | None = None,
    ) -> PhysicsEngine:
        """An engine that goes on to the bit where `checkpoint` was taken.

        ``laws`` and ``containers`` are the classes that no installed pack offers, ``objects`` the subclasses of `PhysicalObject`,
        ``functions`` those of `xpheve.when.Crosses`, by their names.

        Raises
        ------
        RecordError
            If it is no checkpoint, torn, or of a newer version.
        UnknownLawError
            If it needs a law that is not at hand.
        """
        from xpheve.plan.saved import give_attributes, revive
        from xpheve.record.checkpoint import TORN, unpack

        portable = unpack(checkpoint)
        kinds: dict[str, type[PhysicalObject]] = {"": PhysicalObject} | {kind.__qualname__: kind for kind in objects}

        def class_of(entry: dict[str, Any]) -> type[PhysicalObject]:
            kind = entry.get("kind", "")
            if kind not in kinds:
                raise RecordError(f"the checkpoint holds objects of the class {kind}: restore(..., objects=[{kind}])")
            return kinds[kind]

        try:
            engine: PhysicsEngine = revive(cls, portable, laws, containers, registry, class_of, functions)
            give_attributes(engine, {int(key): kept for key, kept in portable[0].get("attributes", {}).items()})
        except (UnknownLawError, PackError, RecordError):
            raise
        except (XpheveError, AssertionError, *TORN) as error:
            raise RecordError(f"the checkpoint is damaged ({type(error).__name__}: {error}); take another") from error
        return engine

    @look
    def copy(self) -> Any:
        """An engine of its own in the same state, with copies of all objects and laws (same order, names, serial numbers)."""
        from xpheve.plan.saved import attributes_of, give_attributes, revive

        laws = [type(law) for law in self._world.laws]
        containers = [type(container) for container in self._world.containers]
        if self._authored is not None:
            laws += [type(law) for law in self._authored.laws]
            containers += [type(container) for container in self._authored.containers]
        held = [*self._world.bodies.objects, *(self._authored.objects if self._authored is not None else ())]
        kinds = {obj.serial: type(obj) for obj in held}
        saved, first = self._save(), self._authored
        made = revive(
            type(self),
            saved.portable(first),
            laws,
            containers,
            self._registry,
            lambda entry: kinds.get(entry["serial"], PhysicalObject),
            saved.functions,
            True,
            first.functions if first is not None else (),
        )
        give_attributes(made, attributes_of(self))
        return made

    @look
    def save_scene(self, path: str | os.PathLike[str]) -> None:
        """Write the scene as a TOML or JSON file, by the ending of ``path``."""
        from xpheve.scene import save

        save(cast("PhysicsEngine", self), path)

    @classmethod
    def load_scene(cls, path: str | os.PathLike[str], **options: Any) -> PhysicsEngine:
        """An engine with the scene of a TOML or JSON file. Raises `SceneError`."""
        from xpheve.scene import load

        engine: PhysicsEngine = load(path, **options)
        return engine


def _check_plain(serial: int, kept: dict[str, Any]) -> None:
    """Raise unless what a subclass keeps beside the state can be written into a checkpoint."""
    for name, value in kept.items():
        try:
            same = json.loads(json.dumps(value)) == value
        except (TypeError, ValueError):
            same = False
        if not same:
            raise RecordError(
                f"object #{serial}: {name} = {value!r:.80}: a checkpoint keeps numbers, texts, lists and tables; "
                "keep other things in a table of your own, by the object's name"
            )


__all__ = ["Saving"]
