"""What a scene is to a table of engines side by side: an answer, an error, settings to try, bars to hold."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

Array = Any


class End(NamedTuple):
    """Where all bodies are in the end, in the world frame: (n, 3) [m], (n, 3) [m/s], (n, 4), (n, 3) [rad/s]."""

    position: Array
    velocity: Array
    orientation: Array | None = None
    turning: Array | None = None


@dataclass(frozen=True)
class Bar:
    """What must be shown. Errors are bounded by ``error``; times are held against rows of peers.

    ``method`` and ``setting`` choose our rows, ``peer`` and ``peer_setting`` those of the peer: beginnings of the engine's name and of the setting.
    ``kind`` says what holds:

    - "error": a row of ours has an error of at most ``error``; "all errors": each has; "drift": a row has, of energy;
    - "front": a row of ours with an error of at most ``error`` is beaten by no row of the peers in both time and error; without ``error`` that is
      so for all of our own front;
    - "ratio": our time over that of the fastest of the peer's rows (with ``finest``: of the one of least error) is at most ``ratio``, with an
      error of at most ``error`` and, with ``no_larger``, at most the peer's;
    - "value": the number ``key`` among the measures of each of our rows is at most ``ratio``.
    """

    text: str
    kind: str
    error: float = float("inf")
    method: str = ""
    setting: str = ""
    peer: str = ""
    peer_setting: str = ""
    ratio: float = 1.0
    no_larger: bool = False
    key: str = ""
    finest: bool = False


@dataclass(frozen=True)
class Scene:
    """One scene over one span. ``build(engine)`` fills an xPheve engine and gives the objects to read at the end.

    ``watched`` is for scenes where the way counts, and not only the end: it gets the ends at several times of a run of its
    own, which is not timed, and gives further numbers for the row; one called "error" is the error of the row.
    """

    id: str
    title: str
    span: float
    metric: str
    build: Callable[[Any], Sequence[Any]]
    ours: Sequence[Any]
    error: Callable[[End], float]
    drift: Callable[[End], float] | None = None
    peers: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    bars: Sequence[Bar] = ()
    measures: Mapping[str, Callable[[End], float]] = field(default_factory=dict)
    """Further numbers told of each row, such as an adiabatic invariant."""
    notes: str = ""
    short: float | None = None
    """A span for trying out that all works."""
    watched: Callable[[Sequence[End]], dict[str, float]] | None = None

    @cached_property
    def file(self) -> str:
        """The name of its plot."""
        return re.sub(r"[^a-z0-9]+", "_", self.id.lower()).strip("_")
