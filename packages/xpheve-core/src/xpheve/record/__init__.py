"""What a run leaves behind: records, and what can be made of them.

Nothing is loaded before it is touched; pyarrow only for files, matplotlib only for pictures.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve.record.frame import Frame, FrameSource
    from xpheve.record.record import Record, Track
    from xpheve.record.recorder import Recorder

__all__ = ["Frame", "FrameSource", "Record", "Recorder", "Track"]

_HOMES = {"Frame": "frame", "FrameSource": "frame", "Record": "record", "Recorder": "recorder", "Track": "record"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
