"""The loop as Python imports its files: what runs where few bodies do not pay for compiling. The same functions, the same bits."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from xpheve.compile import assemble, interpreted
from xpheve_laws_collision.impact.declared import GIVEN
from xpheve_laws_collision.impact.loop import entry

ANSWERS = "def entry(f, n):\n    return respond(f, n)\n"


class AsFiles:
    """A kernel like those of `xpheve.compile`, with the answers of ``text`` and, if there are any, boxes and capsules."""

    def __init__(self, text: str, files: dict[str, str], solids: bool) -> None:
        self._respond = _answers(text, tuple(sorted(files.items())))
        self._solids = solids
        self._seen: list[Any] = []
        self._views: tuple[list[memoryview], list[memoryview]] = ([], [])

    def __call__(self, floats: Sequence[npt.NDArray[np.float64]], ints: Sequence[npt.NDArray[np.int64]]) -> int:
        arrays: list[Any] = [*floats, *ints]
        if len(arrays) != len(self._seen) or any(a is not b for a, b in zip(arrays, self._seen, strict=True)):
            self._seen = arrays
            views = [memoryview(one) for one in arrays]
            self._views = views[: len(floats)], views[len(floats) :]
        GIVEN.respond = self._respond
        if self._solids:
            from xpheve_laws_collision.impact.solids import solid_gap, solid_time

            GIVEN.solid_time, GIVEN.solid_gap = solid_time, solid_gap
        return int(entry(*self._views))


@lru_cache(maxsize=64)
def _answers(text: str, files: tuple[tuple[str, str], ...]) -> Any:
    kernel: Any = interpreted(assemble(f"{text}\n\n{ANSWERS}", dict(files)), what="answers of collision laws")
    return kernel.function
