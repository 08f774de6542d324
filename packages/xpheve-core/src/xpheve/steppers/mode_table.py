"""Modes of many rows, each set of numbers kept once, and what spans make of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import CompileError, LawFailedError
from xpheve.steppers.contract import Array
from xpheve.steppers.wide import Wide

Indices = NDArray[np.int64]
Span = tuple[float, float]

NUMBERS = 8
"""Floats of a mode: a and b, real and imaginary, in pairs."""
PREPARED = 24
"""Floats of a prepared one."""
FOUND = 6
"""Floats of S, S' and T."""
MANY = 3000
"""Modes at once from which on it pays to compile; both ways give the same bits."""
REMEMBERED = 4096
"""Results of single modes that are kept."""

_PREPARE = """
def entry(f, n):
    for i in range(n[0][0]):
        k = 8 * i
        found = linear_mode__prepared(
            ((f[0][k], f[0][k + 1]), (f[0][k + 2], f[0][k + 3])), ((f[0][k + 4], f[0][k + 5]), (f[0][k + 6], f[0][k + 7]))
        )
        k = 24 * i
        for j in range(6):
            one = found[j]
            f[1][k + 4 * j] = one[0][0]
            f[1][k + 4 * j + 1] = one[0][1]
            f[1][k + 4 * j + 2] = one[1][0]
            f[1][k + 4 * j + 3] = one[1][1]
    return 0
"""
_FLOW = """
def wide(p, k):
    return ((p[k], p[k + 1]), (p[k + 2], p[k + 3]))


def entry(f, n):
    p = f[0]
    for i in range(n[0][0]):
        k = 24 * n[1][i]
        mode = (wide(p, k), wide(p, k + 4), wide(p, k + 8), wide(p, k + 12), wide(p, k + 16), wide(p, k + 20))
        found = linear_mode__flow(mode, (f[1][2 * i], f[1][2 * i + 1]))
        for j in range(3):
            f[2][6 * i + 2 * j] = found[j][0]
            f[2][6 * i + 2 * j + 1] = found[j][1]
    return 0
"""


class ModeTable:
    """Modes z'' = a z + b z', each once; by number."""

    def __init__(self) -> None:
        self.count = 0
        self._known: dict[bytes, int] = {}
        self._prepared: Array = np.zeros((64, PREPARED))
        self._found: dict[tuple[int, Span], Array] = {}

    def numbers_of(self, a: Wide, b: Wide, c: Wide, d: Wide) -> Indices:
        """The numbers of z'' = (a + i c) z + (b + i d) z', (n,) each."""
        parts = [half for one in (a, c, b, d) for half in (one.high, one.low)]
        rows = np.ascontiguousarray(np.stack(parts, axis=1) + 0.0)
        distinct, back = _distinct(rows)
        numbers = np.array([self._known.get(row.tobytes(), -1) for row in distinct], dtype=np.int64)
        new = np.flatnonzero(numbers < 0)
        if len(new):
            numbers[new] = self.count + np.arange(len(new))
            self._add(distinct[new])
        return numbers[back]

    def _add(self, rows: Array) -> None:
        for k, row in enumerate(rows):
            self._known[row.tobytes()] = self.count + k
        total = self.count + len(rows)
        if total > len(self._prepared):
            self._prepared = np.concatenate([self._prepared, np.zeros((total, PREPARED))])
        out = np.zeros(PREPARED * len(rows))
        _run(
            _PREPARE, [rows.ravel(), out], [np.array([len(rows)], dtype=np.int64)], len(rows), "modes of linear motion"
        )
        self._prepared[self.count : total] = out.reshape(-1, PREPARED)
        self.count = total

    def at(self, numbers: Indices, spans: tuple[Array, Array]) -> Array:
        """S, S' and T of modes after ``spans`` [s], pairs (n,): real and imaginary parts in turn, (6, n)."""
        high, low = spans
        if len(numbers) <= 12:
            each = zip(high.tolist(), low.tolist(), strict=True)
            return np.stack([self._one(*one) for one in zip(numbers.tolist(), each, strict=True)], axis=1)
        same = bool((high == high[0]).all() and (low == low[0]).all())
        if same:
            asked, back = np.unique(numbers, return_inverse=True)
            high, low = np.full(len(asked), high[0]), np.full(len(asked), low[0])
        else:
            keys, back = _distinct(np.stack([numbers.astype(float), high, low], axis=1))
            asked, high, low = keys[:, 0].astype(np.int64), keys[:, 1], keys[:, 2]
        found: Array = self._run(asked, np.stack([high, low], axis=1))[:, back.ravel()]
        return found

    def _one(self, number: int, span: Span) -> Array:
        key = number, span
        held = self._found.get(key)
        if held is None:
            if len(self._found) >= REMEMBERED:
                self._found.clear()
            held = self._found[key] = self._run(np.array([number]), np.array([span]))[:, 0]
        return held

    def _run(self, numbers: Indices, spans: Array) -> Array:
        out = np.zeros(FOUND * len(numbers))
        floats = [self._prepared.ravel(), np.ascontiguousarray(spans).ravel(), out]
        whole = [np.array([len(numbers)], dtype=np.int64), numbers.astype(np.int64)]
        _run(_FLOW, floats, whole, len(numbers), "linear motion")
        return out.reshape(-1, FOUND).T


def _distinct(rows: Array) -> tuple[Array, Indices]:
    """The distinct ``rows``, and which of them each is."""
    rows = np.ascontiguousarray(rows)
    if len(rows) and bool((rows == rows[0]).all()):
        return rows[:1], np.zeros(len(rows), dtype=np.int64)
    packed = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1]))).ravel()
    _, first, back = np.unique(packed, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    place = np.empty(len(first), dtype=np.int64)
    place[order] = np.arange(len(first))
    return rows[first[order]], place[back.ravel()]


_KERNELS: dict[tuple[str, bool], Any] = {}


def _run(body: str, floats: Sequence[Array], whole: Sequence[Indices], count: int, what: str) -> None:
    """Run ``body``: compiled for many, else, and without a compiler, interpreted."""
    many = count >= MANY
    kernel = _KERNELS.get((body, many))
    if kernel is None:
        from xpheve.compile import assemble, compiled, interpreted

        text = assemble(body)
        try:
            kernel = compiled(text, what) if many else interpreted(text, what)
        except CompileError:
            kernel = interpreted(text, what)
        _KERNELS[body, many] = kernel
    try:
        kernel(floats, whole)
    except ArithmeticError as error:
        raise LawFailedError(
            f"{what}: rates of linear forces are beyond what floats hold ({error}); look at stiffness, drag, charges and masses"
        ) from error
