"""The hooks that core calls in packs, all on this page.

A pack that only offers laws, containers, shapes or steppers needs none: naming them in ``__all__`` is enough. Hooks
are called at load, plan and report time, never in the loop. An implementation may leave out arguments it does not need.

    from xpheve.plugins import hookimpl

    @hookimpl
    def xpheve_plan(plan): ...
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from xpheve.errors import PackError
from xpheve.plugins.suggest import closest, did_you_mean

if TYPE_CHECKING:
    from pluggy import HookimplMarker, PluginManager

    from xpheve.plugins.pack import Pack

__all__ = ["HookSpecs", "audit", "implementations", "marker", "new_manager"]

PROJECT = "xpheve"
MARK = f"{PROJECT}_impl"  # the attribute that pluggy's marker sets; looked for without importing pluggy


class HookSpecs:
    """What a pack may implement. Their order: ``tryfirst`` and ``trylast``, else the pack loaded last runs first."""

    def xpheve_register(self, registry: Pack) -> None:
        """Offer things when the pack is loaded, in place of ``__all__``.

        ``registry`` has ``add_law``, ``add_container``, ``add_shape``, ``add_stepper`` and ``add_contact_server``; each
        takes a class, or a text ``"module:Class"`` with an ``id`` that is imported at first use.
        """

    def xpheve_engine_created(self, engine: Any) -> None:
        """Hear of an engine that was created; of those still alive, when the pack is loaded after them."""

    def xpheve_plan(self, plan: Any) -> None:
        """Inspect or reorder the plan before the first step; an `XpheveError` raised here reaches the caller."""

    def xpheve_report(self, engine: Any, report: Any) -> None:
        """Add to the report of ``engine``."""


def spec_arguments() -> dict[str, tuple[str, ...]]:
    """Return the arguments of each hook."""
    return {
        name: tuple(inspect.signature(spec).parameters)[1:]
        for name, spec in vars(HookSpecs).items()
        if name.startswith("xpheve_")
    }


@lru_cache(maxsize=1)
def marker() -> HookimplMarker:
    """Return the decorator of implementations; to packs it is ``xpheve.plugins.hookimpl``."""
    from pluggy import HookimplMarker

    return HookimplMarker(PROJECT)


def new_manager() -> PluginManager:
    """Return a pluggy manager that knows the hooks of this page."""
    from pluggy import HookspecMarker, PluginManager

    hookspec = HookspecMarker(PROJECT)
    for name in spec_arguments():
        hookspec(vars(HookSpecs)[name])
    manager = PluginManager(PROJECT)
    manager.add_hookspecs(HookSpecs)
    return manager


def _contents(source: Any) -> dict[str, Any]:
    """Return the attributes of a module or object, and of the class of the latter."""
    found: dict[str, Any] = {}
    if not inspect.ismodule(source):
        for base in reversed(type(source).__mro__):
            found.update(vars(base))
    found.update(getattr(source, "__dict__", {}))
    return found


def implementations(source: Any) -> dict[str, Callable[..., Any]]:
    """Return the marked implementations in a module or object, by hook.

    Raises
    ------
    PackError
        If one is for a hook that there is not, or wants an argument that its hook does not have.

    """
    known = spec_arguments()
    found: dict[str, Callable[..., Any]] = {}
    for name, value in _contents(source).items():
        options = getattr(value, MARK, None) if inspect.isroutine(value) else None
        if not isinstance(options, dict):
            continue
        hook = options.get("specname") or name
        if hook not in known:
            raise PackError(f"{hook} is no known hook.{did_you_mean(hook, known)} Hooks: {', '.join(known)}")
        function = getattr(source, name)
        for argument in inspect.signature(function).parameters:
            if argument not in known[hook]:
                raise PackError(
                    f"{hook} has no argument {argument!r}; it may take: {', '.join(known[hook])}."
                    + did_you_mean(argument, known[hook])
                )
        found[hook] = function
    return found


def audit(source: Any) -> list[str]:
    """Return remarks on functions that look like implementations but will never be called."""
    known = spec_arguments()
    remarks: list[str] = []
    for name, value in _contents(source).items():
        if not inspect.isfunction(value) or hasattr(value, MARK) or name.startswith("_"):
            continue
        if name in known:
            remarks.append(f"{name} lacks @hookimpl and will never be called")
        elif name.startswith("xpheve_"):
            # Compared without what all of them begin with, which would make any two look alike.
            near = closest(name.removeprefix("xpheve_"), [hook.removeprefix("xpheve_") for hook in known])
            if near:
                remarks.append(f'{name} is no known hook and will never be called. Did you mean "xpheve_{near}"?')
    return remarks
