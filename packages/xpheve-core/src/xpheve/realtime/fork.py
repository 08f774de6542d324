"""What a fork of the process does to started engines: each goes on in the parent, and stands in the child, which has no thread for it."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable
from contextlib import ExitStack
from threading import get_ident
from typing import Any

_held: list[tuple[ExitStack, list[tuple[Any, Any]]]] = []


def register(started: Iterable[Any]) -> None:
    """Look after the engines in ``started`` from now on, where processes fork."""
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(before=lambda: _hold(started), after_in_parent=_let_go, after_in_child=_stand)


def _hold(started: Iterable[Any]) -> None:
    """All of them between two frames, so that the child gets whole scenes; those that this very thread carries go on in the child."""
    stack, engines = ExitStack(), []
    for engine in list(started):
        live = engine._live
        if live is not None and get_ident() not in (live.holder, live.thread.ident):
            stack.enter_context(live.hold())
            engines.append((engine, live))
    _held.append((stack, engines))


def _let_go() -> None:
    stack, _ = _held.pop()
    stack.close()


def _stand() -> None:
    """In the child: the threads are gone, and with them whoever held a lock."""
    _, engines = _held.pop()
    for engine, live in engines:
        live.turn = threading.Condition()
        live.queue.clear()  # what other threads asked for is done in the parent
        live.closed = True
        engine._leave_clock(live)


__all__ = ["register"]
