"""Object code into this process, by llvmlite alone; and what identifies the machine the code is for."""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
import threading
from functools import cache
from typing import Any

from xpheve.compile.objects import undefined_symbols

PREFIX = "xpheve_"
LIBM = (
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "erf", "erfc", "exp", "expm1", "fmod", "log", "log10",
    "log1p", "log2", "pow", "sin", "sinh", "tan", "tanh",
)  # fmt: skip
"""Functions that Python's ``math`` takes from the C library, so that ours are the same to the bit."""
SPECIAL = ("frexp", "ldexp")
MADE_BY_LLVM = (
    "memcpy",
    "memmove",
    "memset",
    "floor",
    "ceil",
    "trunc",
    "rint",
    "nearbyint",
    "round",
    "sqrt",
    "fmod",
    "fma",
    "copysign",
)
"""What LLVM may call on its own: moves of memory, and exact operations that the processor lacks."""

SETTINGS = (
    "NUMBA_CPU_NAME",
    "NUMBA_CPU_FEATURES",
    "NUMBA_ENABLE_AVX",
    "NUMBA_OPT",
    "NUMBA_LOOP_VECTORIZE",
    "NUMBA_SLP_VECTORIZE",
)
"""numba's settings that change the machine's code."""

_mark = ctypes.c_int(0)
"""Microsoft's compilers ask for a symbol of this kind where there are floats; nobody looks at it."""
_lock = threading.Lock()
_engines: list[Any] = []  # what is loaded stays: a kernel may be called as long as the process lives


class CannotLoadError(Exception):
    """Object code that needs what we do not give, or that LLVM does not take."""


@cache
def provide_symbols() -> dict[str, int]:
    """Tell LLVM where the functions are that compiled text may call; return their addresses."""
    import llvmlite.binding as llvm

    library = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    addresses: dict[str, int] = {}
    for symbol, name in [
        *((PREFIX + name, name) for name in (*LIBM, *SPECIAL)),
        *((name, name) for name in MADE_BY_LLVM),
    ]:
        try:
            address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        except AttributeError:  # a C library without it: a kernel that needs it is not loaded
            continue
        if address:
            addresses[symbol] = address
    if sys.platform == "win32":
        addresses["_fltused"] = ctypes.addressof(_mark)
    for symbol, address in addresses.items():
        if symbol.startswith(PREFIX) or sys.platform == "win32":  # elsewhere LLVM finds those of the C library itself
            llvm.add_symbol(symbol, address)
    return addresses


def missing_symbols(code: bytes) -> set[str]:
    """Return the names that ``code`` needs and that we do not give; ValueError if it is no object file."""
    return undefined_symbols(code) - provide_symbols().keys()


@cache
def machine() -> dict[str, str]:
    """Return what compiled code depends on besides its text; numba is not imported."""
    from importlib.metadata import PackageNotFoundError, version

    import llvmlite
    import llvmlite.binding as llvm

    try:
        numba = version("numba")
    except PackageNotFoundError:
        numba = "none"
    features = llvm.get_host_cpu_features()
    return {
        "numba": numba,
        "llvmlite": str(llvmlite.__version__),
        "platform": str(llvm.get_process_triple()),
        "processor": str(llvm.get_host_cpu_name()),
        "features": str(features.flatten()),
        "lowering": _lowering(),
        **{name: os.environ[name] for name in SETTINGS if os.environ.get(name)},
    }


def _lowering() -> str:
    """Return which version of our own lowering made the code: the hash of its source, empty where there is none to read."""
    try:
        with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "machine.py"), "rb") as source:
            return hashlib.sha256(source.read()).hexdigest()
    except OSError:
        return ""


def load(code: bytes, symbol: str) -> int:
    """Put object ``code`` into this process and return the address of ``symbol``.

    Raises
    ------
    CannotLoadError
        Before LLVM sees it, if the code needs a name we do not give: LLVM would end the process.
    """
    import llvmlite.binding as llvm

    try:
        missing = missing_symbols(code)
    except ValueError as wrong:
        raise CannotLoadError(str(wrong)) from wrong
    if missing:
        raise CannotLoadError(f"it needs {', '.join(sorted(missing))}")
    with _lock:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        target = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine()
        empty = llvm.parse_assembly("")
        engine = llvm.create_mcjit_compiler(empty, target)
        try:
            engine.add_object_file(llvm.ObjectFileRef.from_data(code))
            engine.finalize_object()
            address = int(engine.get_function_address(symbol))
        except (RuntimeError, ValueError) as wrong:
            raise CannotLoadError(str(wrong)) from wrong
        if not address:
            raise CannotLoadError(f"there is no {symbol} in it")
        _engines.append((engine, target))
    return address
