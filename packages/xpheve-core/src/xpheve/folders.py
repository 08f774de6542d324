"""Where xPheve keeps what it can make again: one rule for all caches. Nothing here touches a file."""

from __future__ import annotations

import os
import sys

__all__ = ["cache_folder"]


def cache_folder(xdg: bool = False) -> str:
    r"""Return the user's cache folder of xPheve as an absolute path; empty where the user has no home.

    It is ``XPHEVE_CACHE_DIR``; else, if ``xdg``, ``XDG_CACHE_HOME/xpheve`` where that is absolute, as its specification demands; else
    ``~/.cache/xpheve``. What must not be moved by a setting meant for others (compiled code) leaves ``xdg`` out, and on Windows and macOS
    lies where those systems keep caches: ``%LOCALAPPDATA%\xpheve`` and ``~/Library/Caches/xpheve``.
    """
    chosen = os.environ.get("XPHEVE_CACHE_DIR", "")
    if chosen:
        return os.path.abspath(chosen)
    home = os.path.expanduser("~")
    base = os.path.join(home, ".cache")
    if xdg:
        named = os.environ.get("XDG_CACHE_HOME", "")
        base = named if os.path.isabs(named) else base
    elif sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA", "") or os.path.join(home, "AppData", "Local")
    elif sys.platform == "darwin":
        base = os.path.join(home, "Library", "Caches")
    return os.path.join(base, "xpheve") if os.path.isabs(base) else ""
