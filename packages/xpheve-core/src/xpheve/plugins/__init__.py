"""Packs: found without importing them, imported when a scene names them, kept apart when they fail."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve.plugins.hooks import marker
    from xpheve.plugins.registry import BrokenPack, LawInfo, PackInfo, Registry
    from xpheve.plugins.spec import LawSpec, parameters_model, spec_of

    hookimpl = marker()

__all__ = ["BrokenPack", "LawInfo", "LawSpec", "PackInfo", "Registry", "hookimpl", "parameters_model", "spec_of"]

_HOMES = {"BrokenPack": "registry", "LawInfo": "registry", "PackInfo": "registry", "Registry": "registry",
          "LawSpec": "spec", "parameters_model": "spec", "spec_of": "spec"}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Names are imported when they are asked for, so that ``import xpheve.plugins`` costs nothing."""
    if name == "hookimpl":
        from xpheve.plugins.hooks import marker

        return marker()
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(f"xpheve.plugins.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
