"""The NumPy tier: the array text of a loop, made a function, and the sums over pairs that it calls."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels import clock, ieee
from xpheve.loop.array_spin import FUNCTIONS

Array = NDArray[np.float64]
Places = NDArray[np.int64]

CHUNK = 1 << 18
"""Pairs at a time: enough to make calls cheap, few enough for caches and memory."""


def chunks(count: int) -> Iterator[slice]:
    """``count`` pairs, a chunk at a time."""
    for begin in range(0, count, CHUNK):
        yield slice(begin, min(begin + CHUNK, count))


def all_pairs(rows: Places, count: int) -> Iterator[tuple[Places, Places]]:
    """All pairs of ``rows``, first by first, in chunks."""
    first: list[int] = []
    held = 0
    for i in range(count):
        first.append(i)
        held += count - 1 - i
        if held >= CHUNK or i == count - 1:
            sizes = count - 1 - np.array(first)
            left = np.repeat(np.array(first), sizes)
            right = np.concatenate([np.arange(i + 1, count) for i in first])
            yield rows[left], rows[right]
            first, held = [], 0


def add_pairs(target: Array, left: Places, right: Places, force: Any) -> None:
    """Add ``force`` to the rows ``left`` and take it from the rows ``right``, pair by pair, in this order."""
    both = np.empty(2 * len(left), dtype=np.int64)
    both[0::2], both[1::2] = left, right
    signed = np.empty(2 * len(left))
    signed[0::2] = force
    np.negative(signed[0::2], out=signed[1::2])
    np.add.at(target, both, signed)


def by_rows(function: Callable[..., Any], *given: Any) -> Any:
    """What ``function`` of floats and tuples of floats gives for each row of arrays and tuples of arrays, as arrays; slow."""
    parts = [part for one in given for part in (one if isinstance(one, tuple) else (one,))]
    count = max((len(part) for part in parts if isinstance(part, np.ndarray)), default=-1)
    if count < 0:
        return function(*given)

    def listed(part: Any) -> Any:
        return part.tolist() if isinstance(part, np.ndarray) else [float(part)] * count

    columns = [list(zip(*map(listed, one), strict=True)) if isinstance(one, tuple) else listed(one) for one in given]
    return np.array([function(*row) for row in zip(*columns, strict=True)], dtype=float).T


@lru_cache(maxsize=64)
def array_entry(text: str, functions: str = "") -> Callable[[Sequence[Array], Sequence[Places]], int]:
    """The entry of the array ``text``, which may call ``functions``, a text of kernels written by hand.

    NumPy's warnings of what is not finite are off: what comes of it is checked by the caller.
    """
    names: dict[str, Any] = {"np": np, "math": math, "chunks": chunks, "all_pairs": all_pairs, "add_pairs": add_pairs}
    exec(compile(functions, "<kernels by hand>", "exec"), names)
    names["by_rows"] = by_rows
    names.update({f"ieee__{name}": value for name, value in vars(ieee).items() if callable(value)})
    names.update({f"clock__{name}": value for name, value in vars(clock).items() if callable(value)})
    names.update({f"spin__{name}": value for name, value in FUNCTIONS.items()})
    if "table__" in text:
        from xpheve.trace.table import ARRAYS, FLOATS

        names.update({f"np_table__{kind}": look_up for kind, look_up in ARRAYS.items()})
        names.update({f"table__{kind}": look_up for kind, look_up in FLOATS.items()})
    exec(compile(text, "<loop for arrays>", "exec"), names)
    entry = names["entry"]

    def run(floats: Sequence[Array], ints: Sequence[Places]) -> int:
        with np.errstate(all="ignore"):
            found: int = entry(floats, [*(one.tolist() for one in ints[:2]), *ints[2:]])
        return found

    return run
