"""One text, two speeds: `interpreted` and `compiled`, and what this process has made of both."""

from __future__ import annotations

import hashlib
import linecache
import math
import os
import threading
import time
from typing import Any

from xpheve.compile import store
from xpheve.compile.kernel import Compiled, Interpreted, Kernel
from xpheve.compile.progress import shown
from xpheve.errors import CompileError

_lock = threading.RLock()
_interpreted: dict[str, Kernel] = {}
_compiled: dict[str, Kernel] = {}


def _new_lock() -> None:
    """In the child of a fork: whoever held the lock is a thread of the parent's."""
    global _lock
    _lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_new_lock)


def interpreted(text: str, what: str = "") -> Kernel:
    """Return the kernel of ``text`` as Python runs it; the same text gives the same kernel.

    Raises
    ------
    CompileError
        The text is not Python, or defines no ``entry``.
    """
    key = _digest(text)
    with _lock:
        if key not in _interpreted:
            started = time.perf_counter()
            entry = _entry_of(text, what or "a kernel")
            _interpreted[key] = Interpreted(entry, what or "a kernel", key, time.perf_counter() - started)
        return _interpreted[key]


def compiled(text: str, what: str = "") -> Kernel:
    """Return the kernel of ``text`` as the machine runs it, from this process, from the cache, or compiled now.

    Raises
    ------
    CompileError
        numba is not there, or cannot type the text.
    """
    digest = _digest(text)
    with _lock:
        if digest not in _compiled:
            _compiled[digest] = _come_by(text, what or "a kernel")
        return _compiled[digest]


def facts() -> list[dict[str, object]]:
    """Return what is known of every kernel of this process: what, key, origin, seconds, path."""
    with _lock:
        kernels = [*_interpreted.values(), *_compiled.values()]
    return [
        {name: getattr(kernel, name) for name in ("what", "key", "origin", "seconds", "path")} for kernel in kernels
    ]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _entry_of(text: str, what: str) -> Any:
    """Return the function ``entry`` that ``text`` defines, as Python runs it."""
    space: dict[str, Any] = {"math": math, "__name__": "xpheve_kernel"}
    name = f"<xpheve {_digest(text)[:16]}>"
    linecache.cache[name] = (len(text), None, text.splitlines(True), name)  # so that errors show the line
    try:
        exec(compile(text, name, "exec"), space)
    except SyntaxError as wrong:
        raise CompileError(f"{what}: line {wrong.lineno} of the generated text is not Python ({wrong.msg})") from wrong
    except Exception as wrong:  # the text itself only defines: it is the author's
        raise CompileError(
            f"{what}: a constant of its kernel file cannot be computed ({type(wrong).__name__}: {wrong}); mend it"
        ) from wrong
    if "entry" not in space:
        raise CompileError(f"{what}: the generated text defines no entry(f, n)")
    return space["entry"]


def _come_by(text: str, what: str) -> Kernel:
    started = time.perf_counter()
    try:
        from xpheve.compile import loader

        key = store.key_of(text, loader.machine())
    except ImportError as wrong:
        raise CompileError(
            f"{what}: llvmlite cannot be imported ({wrong}); install numba, or run with compile='never'"
        ) from wrong
    entry = store.read(key)
    if entry is not None:
        try:
            address = loader.load(entry.code, entry.symbol)
            return Compiled(address, what, key, "cache", time.perf_counter() - started, store.path_of(key))
        except loader.CannotLoadError:
            pass  # as good as not there: it is made again
    return _made(text, what, key, started)


def _made(text: str, what: str, key: str, started: float) -> Kernel:
    from xpheve.compile import loader
    from xpheve.compile.machine import machine_code

    _entry_of(text, what)
    with shown(what, kept=store.distrust() is None):
        made = machine_code(text, what)
    try:
        address = loader.load(made.code, made.symbol)
    except loader.CannotLoadError:  # numba's own engine has what is missing; no other process would
        return Compiled(made.address(), what, key, "memory", time.perf_counter() - started, owner=made)
    kept = store.write(key, store.Entry(made.symbol, what, made.code))
    path = store.path_of(key) if kept else ""
    return Compiled(address, what, key, "compiled" if kept else "memory", time.perf_counter() - started, path)
