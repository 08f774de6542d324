"""Sums and products without loss, of floats or arrays of them, to the same bits: Knuth, The Art of Computer Programming 2, 4.2.2."""

from __future__ import annotations

from typing import Any

from xpheve.kernels.clock import Instant
from xpheve.kernels.elliptic import product_exact, sum_exact
from xpheve.steppers.contract import Array


def two_sums(a: Array, b: Array) -> tuple[Array, Array]:
    """``a + b``, and what rounding lost of it."""
    found: Any = sum_exact(a, b)  # type: ignore[arg-type]
    return found  # type: ignore[no-any-return]


def two_products(a: Array, b: Array) -> tuple[Array, Array]:
    """``a * b``, and what rounding lost of it, while nothing overflows (Dekker, Numer. Math. 18 (1971) 224)."""
    found: Any = product_exact(a, b)  # type: ignore[arg-type]
    return found  # type: ignore[no-any-return]


def spans_since(t: Instant, base: Any, offset: Any) -> Any:
    """Time [s] from the instants ``base + offset`` to ``t``, rounded once: `xpheve.kernels.clock.elapsed` for arrays, to the same bits."""
    s, e = sum_exact(t[0], -base)
    return s + (e + (t[1] - offset))


def exact_spans(t: Instant, base: Any, offset: Any) -> tuple[Any, Any]:
    """The same as pairs of floats: ~32 digits."""
    s, e = sum_exact(t[0], -base)
    return sum_exact(s, e + (t[1] - offset))
