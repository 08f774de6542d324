"""Doors: methods of an engine that change its scene, and looks, which must see it whole, as other threads call them.

On the thread that holds the scene (any, while the engine is not started) both are the plain method. From elsewhere a door
is queued until the next frame, and recorded as an input; a look waits until the scene stands between two frames.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from threading import get_ident
from typing import Any, TypeVar, cast

from xpheve.errors import InvalidValueError, OwnershipError
from xpheve.forces import Force
from xpheve.realtime.encode import plain
from xpheve.realtime.live import Closed

F = TypeVar("F", bound=Callable[..., Any])


def door(waits: bool = False) -> Callable[[F], F]:
    """Mark a method as a door; one that ``waits`` is done at once, at a frame of its own, and gives back its result or error."""

    def mark(method: F) -> F:
        name = method.__name__

        @functools.wraps(method)
        def call(self: Any, *args: Any, **kwargs: Any) -> Any:
            while True:
                live = self._live
                if live is None:
                    with self._alone:
                        if self._live is None:
                            return method(self, *args, **kwargs)
                    continue
                if live.holder == get_ident():
                    return method(self, *args, **kwargs)
                self._surface()
                result: Any = None
                if name in PREPARE:
                    args, kwargs, result = PREPARE[name](self, live, *args, **kwargs)
                try:
                    return live.enter(self, name, method, args, kwargs, waits, result)
                except Closed:
                    continue

        call.is_door = True  # type: ignore[attr-defined]
        return cast(F, call)

    return mark


def look(method: F) -> F:
    """Mark a method that reads much of the scene: elsewhere it waits for the end of the frame, and holds the next one up."""

    @functools.wraps(method)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        while True:
            live = self._live
            if live is None:
                with self._alone:
                    if self._live is None:
                        return method(self, *args, **kwargs)
                continue
            if live.holder == get_ident():
                return method(self, *args, **kwargs)
            with live.hold():
                if self._live is live:
                    return method(self, *args, **kwargs)

    return cast(F, call)


# What the caller's thread checks, makes definite and gets back before anything is queued.

Prepared = tuple[tuple[Any, ...], dict[str, Any], Any]


def _add_objects(engine: Any, live: Any, objects: Any, laws: Any = ()) -> Prepared:
    from xpheve.laws import PhysicalLaw

    laws = [laws] if isinstance(laws, (str, PhysicalLaw)) else list(laws)
    return (list(objects), laws), {}, None


def _add_force(engine: Any, live: Any, obj: Any, force: Force) -> Prepared:
    engine._check_own(obj)
    if any(force.torque) and not any(obj.inertia):
        raise InvalidValueError(f"{obj!r} has no inertia, so no torque can turn it: give inertia=, or a shape")
    ident = live.new_force_id() if force.id is None else force.id
    named = Force(force.vector, force.duration, ident, torque=force.torque)
    return (obj, named), {}, named


def _write_object(engine: Any, live: Any, obj: Any, name: str, value: Any) -> Prepared:
    engine._check_own(obj)
    return (obj, name, value), {}, None


def _write_column(engine: Any, live: Any, obj: Any, name: str, value: float) -> Prepared:
    engine._check_own(obj)
    for law in list(engine._world.mapping.laws(obj)):
        if name in law.columns:
            value = law.columns[name].check(value, obj.label, name)
    return (obj, name, value), {}, None


def _set_parameter(engine: Any, live: Any, law: Any, name: str, value: Any) -> Prepared:
    if law.engine is not engine:
        raise OwnershipError(f"{law!r} is not in this engine: add it with engine.add_law first")
    return (law, name, value), {}, None


def _post(engine: Any, live: Any, id: Any, data: Any = None, source: Any = None) -> Prepared:
    from xpheve.laws import PhysicalLaw
    from xpheve.objects import PhysicalObject

    if not isinstance(source, (PhysicalLaw, PhysicalObject)):
        source = plain(source, "post: source")
    return (plain(id, "post: id"), plain(data, "post: data"), source), {}, None


def _input(engine: Any, live: Any, kind: Any, data: Any = None) -> Prepared:
    return (plain(kind, "input: kind"), plain(data, "input: data")), {}, None


PREPARE: dict[str, Callable[..., Prepared]] = {
    "add_objects": _add_objects,
    "add_force": _add_force,
    "write_object": _write_object,
    "write_column": _write_column,
    "set_parameter": _set_parameter,
    "post": _post,
    "input": _input,
}

__all__ = ["door", "look"]
