"""Which of the three ways a loop runs: interpreted, on NumPy arrays, or compiled."""

from __future__ import annotations

from xpheve.loop.program import COMPILED, INTERPRETED, NUMPY

FEW = 12
"""Rows and pairs up to which floats one by one are faster than calls of NumPy."""
MANY = 256
"""Rows and pairs from which on it pays to compile."""


def choose_tier(wish: str, load: int) -> str:
    """The way for a loop over ``load`` rows and pairs; a rule of the scene alone, never of a clock or a cache.

    ``wish`` is "auto", "always" or "never" to compile.
    """
    if wish == "always" or (wish == "auto" and load >= MANY):
        return COMPILED
    return INTERPRETED if load <= FEW else NUMPY


def why_tier(wish: str, load: int) -> str:
    """Why `choose_tier` chooses as it does, for people."""
    size = f"{load} rows and pairs"
    if wish != "auto":
        return f'compile="{wish}"; {size}'
    if load >= MANY:
        return f"{size}: from {MANY} on it pays to compile"
    if load > FEW:
        return f"{size}: below {MANY} it does not pay to compile"
    return f"{size}: up to {FEW} floats one by one are fastest"


def cost_of_step(tier: str, load: int) -> int:
    """About how long a step over ``load`` rows and pairs takes, in units of a compiled row's 10 ns; by which long runs pause for breath."""
    if tier == INTERPRETED:
        return 200 * load
    return load + (10_000 if tier == NUMPY else 0)
