"""Scene files: what a person writes, in TOML or JSON, and the engine writes back.

Nothing is loaded before it is touched; pydantic only when a file is read, or its schema asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve.scene.build import SceneFile, load, loads, read
    from xpheve.scene.describe import schema
    from xpheve.scene.write import dumps, save

__all__ = ["SceneFile", "dumps", "load", "loads", "read", "save", "schema"]

_HOMES = {
    **dict.fromkeys(("SceneFile", "load", "loads", "read"), "build"),
    **dict.fromkeys(("dumps", "save"), "write"),
    "schema": "describe",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
