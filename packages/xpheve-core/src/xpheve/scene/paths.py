"""Paths that a scene file names: they stay below its folder."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath, PureWindowsPath

from xpheve.errors import SceneError

OUTSIDE = "paths stay below the scene's folder unless it is loaded with allow_outside=True"


def inside(folder: Path, text: str, *, allow_outside: bool = False) -> Path:
    """Return the path that ``text`` names, from ``folder``.

    Raises
    ------
    SceneError
        If it names nothing, or leads out of ``folder``: as an absolute path, by ``..``, or through a symbolic link.
    """
    if not text.strip() or "\0" in text:
        raise SceneError("this is no path")
    try:
        target = folder / text
        if allow_outside:
            return target
        # Read as both systems do, so that a scene means the same everywhere.
        posix, windows = PurePosixPath(text), PureWindowsPath(text)
        if posix.is_absolute() or windows.drive or windows.root or text.startswith("~"):
            raise SceneError(f"this leads out of the folder of the scene; {OUTSIDE}")
        if ".." in posix.parts or ".." in windows.parts:
            raise SceneError(f"this leads out of the folder of the scene by ..; {OUTSIDE}")
        if not target.resolve().is_relative_to(folder.resolve()):
            raise SceneError(
                f"this leads out of the folder of the scene by a symbolic link to {os.path.realpath(target)}; {OUTSIDE}"
            )
    except (OSError, ValueError, RuntimeError) as wrong:
        if isinstance(wrong, SceneError):
            raise
        raise SceneError(f"this is no path: {wrong}") from None
    return target
