"""All pair forces of many bodies at one instant, outside any motion: compiled, on as many threads as are asked for, to the same bits."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.errors import InvalidValueError
from xpheve.loop.fields import PARAMETERS
from xpheve.loop.long_range import TILES, WIDE, scratch
from xpheve.loop.motion import MotionText
from xpheve.loop.program import values_of
from xpheve.loop.terms import WIDTHS, Term, slot_of
from xpheve.loop.text import PairKind
from xpheve.trace.graph import walk

if TYPE_CHECKING:
    from xpheve.laws import PairLaw

Array = Any

STRIPS = 4
"""Parts in which pairs are summed, each for itself; their sums are added in order, whoever found them."""
STRIPS_FROM = 2000
"""Bodies from which on there is more than one part; of fewer, threads would only be in the way."""

ENTRY = """
def entry(f, n):
    c = n[0]
    pairs_0(f[0], f[1], f[2], f[3], n[1], n[1], n[1], c[0], c[1], c[0], 0, c[2], c[3], c[3], f[1][0], f[4], f[4], c[4], c[5])
    return 0
"""


class DirectSum:
    """The sum of a traced pair law over all pairs of ``count`` bodies.

    Parameters
    ----------
    law
        A law with a formula, without cutoff; its parameters may change between calls.
    count
        How many bodies.

    Raises
    ------
    InvalidValueError
        The law has no formula, a cutoff, a kernel written by hand, or reads how bodies turn.
    """

    def __init__(self, law: PairLaw, count: int) -> None:
        from xpheve.compile import assemble, compiled
        from xpheve.trace.recorder import trace_law

        trace = trace_law(law)
        if trace is None or trace.force is None or np.isfinite(law.reach()):
            raise InvalidValueError(f"{law!r}: the sum over all pairs needs a law with a formula, and no cutoff")
        turning = trace.reads & {"orientation", "angular_velocity", "since"}
        if turning or any(node.op == "kernel" for node in walk(trace.force)):
            raise InvalidValueError(f"{law!r}: the sum over all pairs needs a force of places, velocities and columns")
        self.law, self.count = law, count
        self.term = Term(trace, True)
        self.motion = MotionText([], [PairKind(self.term, TILES, True)], False, False)
        text = "\n".join(self.motion.pairs(0, self.motion.pair_kinds[0]).function())
        self._kernel = compiled(assemble(text + ENTRY), f"all pairs of {trace.label}")
        self.strips = STRIPS if count >= STRIPS_FROM else 1
        self._rows = np.arange(count, dtype=np.int64)
        self._own = [np.zeros(scratch([self.term])) for _ in range(self.strips)]

    def forces(
        self, columns: dict[str, Array], threads: int = 1, time: float = 0.0, up: tuple[float, float, float] = (0, 0, 1)
    ) -> Array:
        """Forces [N] on all bodies, (3, count).

        Parameters
        ----------
        columns
            What the law reads of the bodies, by name: "position" (3, count), "mass" (1, count) or (count,), and so on.
        threads
            How many threads share the work; they change nothing but the time it takes.

        Raises
        ------
        InvalidValueError
            A column that is not there, or of another shape; fewer than one thread.
        """
        if threads < 1:
            raise InvalidValueError(f"threads = {threads}: at least one is needed")
        n = self.count
        s = np.zeros((6 + 3 * self.strips, n))
        slots = self.motion.slots
        k = np.zeros((slots.width, n))
        for name in sorted(self.term.trace.reads - {"time", "up"}):
            width = 3 if name in ("position", "velocity") else WIDTHS.get(name, 1)
            try:
                values = np.asarray(columns[name], dtype=float).reshape(width, n)
            except (KeyError, ValueError, TypeError) as wrong:
                raise InvalidValueError(
                    f"{self.law!r} reads {name}: columns[{name!r}] must be an array of shape ({width}, {n})"
                ) from wrong
            at = {"position": 0, "velocity": 3}.get(name)
            if at is not None:
                s[at : at + 3] = values
            else:
                k[slots.first[slot_of(name)] :][:width] = values
        p = np.array([time, 0.0, 0.0, *(float(one) for one in up), *values_of(self.law, self.term)])
        tables = self.motion.tables if len(self.motion.tables) else np.zeros(1)
        flat, constants = s.reshape(-1), k.reshape(-1)

        def strip(number: int) -> None:
            counts = np.array([n, PARAMETERS, 3 * n, (6 + 3 * number) * n, number, self.strips], dtype=np.int64)
            self._kernel([flat, p, tables, constants, self._own[number]], [counts, self._rows])

        if threads == 1:
            for number in range(self.strips):
                strip(number)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(strip, range(self.strips)))
        found = s[6:9]
        for number in range(1, self.strips):
            found = found + s[6 + 3 * number : 9 + 3 * number]
        return found


__all__ = ["STRIPS", "WIDE", "DirectSum"]
