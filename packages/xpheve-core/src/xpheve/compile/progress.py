"""What is shown while somebody waits for a compiler."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Watcher = Callable[[str, float | None], object]
"""Called with what is compiled: with None when that begins, with the seconds it took when it is done."""

_watchers: list[Watcher] = []


def on_compile(watcher: Watcher) -> Callable[[], None]:
    """Let ``watcher(what, seconds)`` be called at the beginning (seconds is None) and the end of every compilation.

    While there is a watcher, no line is written to stderr. Return what takes the watcher away again.
    """
    _watchers.append(watcher)

    def remove() -> None:
        if watcher in _watchers:
            _watchers.remove(watcher)

    return remove


@contextmanager
def shown(what: str, kept: bool) -> Iterator[None]:
    """Tell the watchers, or else the terminal, that ``what`` is compiled; ``kept`` says that later runs are spared the wait."""
    watchers = list(_watchers)
    line = not watchers and _wanted()
    started = time.perf_counter()
    for watcher in watchers:
        watcher(what, None)
    if line:
        _say(f"xpheve: compiling {what}{' for the first time (kept for later runs)' if kept else ''} ...")
    end = " failed\n"
    try:
        yield
        end = f" {time.perf_counter() - started:.1f} s\n"
    finally:
        if line:
            _say(end)
        for watcher in watchers:
            watcher(what, time.perf_counter() - started)


def _wanted() -> bool:
    chosen = os.environ.get("XPHEVE_PROGRESS", "")
    if chosen:
        return chosen != "0"
    try:
        return sys.stderr.isatty()
    except (AttributeError, ValueError):  # none, or closed
        return False


def _say(text: str) -> None:
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except (AttributeError, OSError, ValueError):
        pass
