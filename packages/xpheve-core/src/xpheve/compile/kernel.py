"""A kernel that can be called: interpreted, on memoryviews, or compiled, on addresses."""

from __future__ import annotations

import ctypes
import pickle
import weakref
from collections.abc import Callable, Sequence
from typing import Any

from xpheve.errors import CompileError, InvalidValueError

Array = Any
_Nothing = ctypes.c_char * 0
_Entry = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


class Kernel:
    """What a text's ``entry`` does, ready to be called as ``kernel(floats, ints)``.

    Attributes
    ----------
    what
        What it calculates, in words.
    key
        Hash of the text; of compiled code, the name it is kept under.
    origin
        ``"interpreted"``; ``"compiled"`` in this process and kept, ``"memory"`` if it could not be kept; ``"cache"`` if read from disk.
    seconds
        How long it took to come by [s].
    path
        The file of the cache; empty if there is none.
    """

    def __init__(self, what: str, key: str, origin: str, seconds: float, path: str = "") -> None:
        self.what, self.key, self.origin, self.seconds, self.path = what, key, origin, seconds, path

    def __call__(self, floats: Sequence[Array], ints: Sequence[Array]) -> int:
        """Call ``entry(f, n)`` on contiguous arrays of one dimension, float64 and int64; what it returns is returned.

        Raises
        ------
        InvalidValueError
            An array of another type or layout, before anything is called.
        """
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"Kernel({self.what!r}, {self.origin}, {self.seconds:.3f} s)"


class Interpreted(Kernel):
    """The text as Python runs it."""

    def __init__(
        self, entry: Callable[[list[memoryview], list[memoryview]], int], what: str, key: str, seconds: float
    ) -> None:
        super().__init__(what, key, "interpreted", seconds)
        self._entry = entry

    @property
    def function(self) -> Callable[[list[memoryview], list[memoryview]], int]:
        """``entry`` itself, for code that has its memory views at hand."""
        return self._entry

    def __call__(self, floats: Sequence[Array], ints: Sequence[Array]) -> int:
        f, n = [memoryview(array) for array in floats], [memoryview(array) for array in ints]
        for k, view in enumerate(f):
            if view.format != "d" or view.ndim != 1 or not view.c_contiguous:
                raise _unfit("floats", k, floats[k])
        for k, view in enumerate(n):
            if view.format not in ("l", "q") or view.itemsize != 8 or view.ndim != 1 or not view.c_contiguous:
                raise _unfit("ints", k, ints[k])
        return int(self._entry(f, n))


class Compiled(Kernel):
    """The text as the machine runs it. The code takes pointers: of its result, of what went wrong, of both tables of arrays."""

    def __init__(
        self, address: int, what: str, key: str, origin: str, seconds: float, path: str = "", owner: object = None
    ) -> None:
        super().__init__(what, key, origin, seconds, path)
        self.address = address
        """Where the code lies, for code that calls it; as long as the kernel is kept."""
        self._call = _Entry(address)
        self._owner = owner  # whoever frees the code when it is let go
        self._last: tuple[list[Any], list[Any], Any, Any] = ([], [], _table([]), _table([]))

    def __call__(self, floats: Sequence[Array], ints: Sequence[Array]) -> int:
        f_seen, n_seen, f, n = self._last
        if not (_same(f_seen, floats) and _same(n_seen, ints)):
            f, n = _table(_addresses("floats", "d", floats)), _table(_addresses("ints", "lq", ints))
            self._last = ([weakref.ref(array) for array in floats], [weakref.ref(array) for array in ints], f, n)
        result, failure = ctypes.c_int64(), ctypes.c_void_p()
        if self._call(ctypes.byref(result), ctypes.byref(failure), f, n):
            raise self._error(failure.value)
        return result.value

    def _error(self, failure: int | None) -> Exception:
        """Return what a kernel raised: numba leaves a pickled class and its arguments."""
        why = "without saying why"
        if failure:
            try:
                place = ctypes.c_void_p.from_address(failure)
                size = ctypes.c_int32.from_address(failure + ctypes.sizeof(ctypes.c_void_p))
                raised, arguments, *_ = pickle.loads(ctypes.string_at(place.value or 0, size.value))
                if isinstance(raised, type) and issubclass(raised, Exception):
                    return raised(*(arguments or ()))
            except Exception as wrong:  # whatever unpickling it may raise: the kernel has failed, and that is told
                why = f"and what it raised cannot be read ({type(wrong).__name__}: {wrong})"
        return CompileError(f"{self.what}: the compiled kernel stopped {why}; run with compile='never' to see the line")


def _same(seen: list[Any], arrays: Sequence[Array]) -> bool:
    """Whether these are the very arrays of the last call. A weak reference keeps NumPy from moving an array's numbers."""
    if len(seen) != len(arrays):
        return False
    for reference, array in zip(seen, arrays, strict=True):
        if reference() is not array:
            return False
    return True


def _table(addresses: list[int]) -> Any:
    return (ctypes.c_void_p * max(1, len(addresses)))(*addresses)


def _addresses(name: str, formats: str, arrays: Sequence[Array]) -> list[int]:
    found: list[int] = []
    for k, array in enumerate(arrays):
        try:
            kind, flags = array.dtype, array.flags
        except AttributeError:
            raise _unfit(name, k, array) from None
        if (
            kind.char not in formats
            or kind.itemsize != 8
            or not kind.isnative
            or array.ndim != 1
            or not flags.c_contiguous
        ):
            raise _unfit(name, k, array)
        found.append(ctypes.addressof(_Nothing.from_buffer(array)) if flags.writeable else array.ctypes.data)
    return found


def _unfit(name: str, k: int, array: Array) -> InvalidValueError:
    kind, shape = getattr(array, "dtype", type(array).__name__), getattr(array, "shape", "")
    wanted = "float64" if name == "floats" else "int64"
    return InvalidValueError(
        f"{name}[{k}] of a kernel is {kind} {shape}; a contiguous array of one dimension of {wanted} is needed: "
        f"numpy.ascontiguousarray(x, dtype=numpy.{wanted})"
    )
