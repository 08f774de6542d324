"""Packs: found without importing them, imported when a scene names them, kept apart when they fail."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve.plugins.hooks import marker
    from xpheve.plugins.manifest import build_manifest, check_manifest, write_manifest
    from xpheve.plugins.registry import BrokenPack, LawInfo, PackInfo, Registry
    from xpheve.plugins.spec import LawSpec, parameters_model, spec_of
    from xpheve.plugins.suggest import did_you_mean

    hookimpl = marker()

__all__ = [
    "BrokenPack",
    "LawInfo",
    "LawSpec",
    "PackInfo",
    "Registry",
    "build_manifest",
    "check_manifest",
    "did_you_mean",
    "hookimpl",
    "parameters_model",
    "spec_of",
    "write_manifest",
]

_HOMES = {
    "manifest": ("build_manifest", "check_manifest", "write_manifest"),
    "registry": ("BrokenPack", "LawInfo", "PackInfo", "Registry"),
    "spec": ("LawSpec", "parameters_model", "spec_of"),
    "suggest": ("did_you_mean",),
}


def __getattr__(name: str) -> Any:
    """Names are imported when they are asked for, so that ``import xpheve.plugins`` costs nothing."""
    if name == "hookimpl":
        from xpheve.plugins.hooks import marker

        return marker()
    for home, names in _HOMES.items():
        if name in names:
            from importlib import import_module

            return getattr(import_module(f"xpheve.plugins.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
