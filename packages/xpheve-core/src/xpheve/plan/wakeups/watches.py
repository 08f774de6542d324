"""Quantities that are followed along flights: being inside a region, the sign of an expression, being at rest."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from xpheve.events import AFTER, START, Entry
from xpheve.kernels.clock import NEVER
from xpheve.kernels.vector import Vec
from xpheve.laws import conditions as when
from xpheve.laws.conditions import Condition
from xpheve.observers import Probe
from xpheve.plan.wakeups.inside import State, inside
from xpheve.plan.wakeups.motion import FIRST, Motion, Subject, carrier, is_still
from xpheve.regions import Region

POSITION = frozenset({"position"})
Window = tuple[float, float, list[State]]
"""Where a window ends, how long [s] the next is wished for, and from when what holds in it."""


class Record:
    """What is known of one subject: the state last told, and where its windows stand."""

    __slots__ = ("begin", "entry", "passed", "start", "state", "wish")

    def __init__(self, state: Any = None) -> None:
        self.state = state
        self.begin: tuple[float, float] | None = None
        """The flight that the window belongs to, by its beginning."""
        self.start, self.wish = 0.0, FIRST
        self.passed: tuple[tuple[float, float], float] | None = None
        """Beginning of the flight and time since then [s] of the last change, which rounding must not undo."""
        self.entry: Entry | None = None


class Outlook(NamedTuple):
    """From when [s] since the motion began which state holds, until ``end``; then it is to be looked at again, if at all."""

    states: list[State]
    end: float = NEVER[0]
    wish: float = FIRST
    reads: frozenset[str] = POSITION
    """What the states are made of."""


class Watch(ABC):
    """One quantity, followed for any number of subjects, whoever asks for it."""

    stage = START

    def __init__(self, world: Any) -> None:
        self.world = world
        self.records: dict[Subject, Record] = {}
        self._held: WeakKeyDictionary[Subject, tuple[Any, Window]] = WeakKeyDictionary()
        """The last window of each subject, which has as many events as changes."""

    @abstractmethod
    def outlook(self, subject: Subject, motion: Motion, record: Record, now: float) -> Outlook:
        """What holds when; ``now`` [s] since the motion began."""

    def in_windows(
        self,
        find: Callable[[float, float], Window],
        subject: Subject,
        motion: Motion,
        record: Record,
        now: float,
        own: tuple[Any, ...] = (),
        stays: bool = False,
        reads: frozenset[str] = POSITION,
    ) -> Outlook:
        """The outlook in the window of ``motion`` that reaches beyond ``now`` [s].

        Parameters
        ----------
        find
            Gives the window that begins at a time and has at most a length, both [s].
        subject, motion, record, reads
            Who, how it moves, what is known of it, and what the states are made of.
        own
            What the windows depend on besides.
        stays
            Whether what holds in the first window does so for as long as the motion lasts.
        """
        if record.begin != motion.begin:
            record.begin, record.start, record.wish = motion.begin, 0.0, motion.first_window
        while True:
            key = (motion, record.start, record.wish, own)
            held = self._held.get(subject)
            if held is None or held[0] != key:
                held = self._held[subject] = (key, find(record.start, record.wish))
            stop, wish, states = held[1]
            if stays:
                return Outlook(states, reads=reads)
            if stop > now or stop >= motion.span:
                return Outlook(states, stop if stop < motion.span else NEVER[0], wish, reads)
            record.start, record.wish = stop, wish


class InsideWatch(Watch):
    """Being inside a region: the centre, or with ``volume`` any part of the sphere about it."""

    def __init__(self, world: Any, region: Region, volume: bool) -> None:
        super().__init__(world)
        self.region, self.volume = region, volume

    def outlook(self, subject: Subject, motion: Motion, record: Record, now: float) -> Outlook:
        radius = subject.radius if self.volume and isinstance(subject, Probe) else 0.0
        curve = motion.curve
        if curve is not None:
            from xpheve.plan.wakeups.inside_curve import inside_curve  # brings numpy.polynomial: only who asks pays

            if motion.span == 0.0:
                return Outlook(inside(self.region, radius, motion.x, motion.v, motion.a, 0.0))
            obj = carrier(subject)
            assert obj is not None
            return self.in_windows(
                lambda start, wish: inside_curve(self.region, radius, curve, start, wish, motion.span),
                subject,
                motion,
                record,
                now,
                (radius,),
                math.isinf(motion.span) and is_still(self.world, obj),
            )
        return Outlook(inside(self.region, radius, motion.x, motion.v, motion.a, motion.span))


class SleepWatch(Watch):
    """Being at rest."""

    stage = AFTER

    def outlook(self, subject: Subject, motion: Motion, record: Record, now: float) -> Outlook:
        return Outlook([(now, is_still(self.world, subject))])  # type: ignore[arg-type]


ROUNDING = 1e-14  # of the coordinates: a way so short is no way
LASTING = frozenset({"time", "orientation", "angular_velocity"})  # what changes although the position may not


def next_change(
    states: list[State], motion: Motion, now: float, told: Any, reads: frozenset[str] = POSITION
) -> State | None:
    """When a state other than ``told`` begins, at ``now`` at the earliest; None if it does not. A sign of 0 is unknown.

    A state other than ``told`` that begins with a new flight and is over within rounding of what is read is none: a flight that
    begins on an edge may begin a unit on the wrong side of it.
    """
    here = max((k for k, (start, _) in enumerate(states) if start <= now), default=0)
    for k in range(here, len(states)):
        start, state = states[k]
        if state == told or (state == 0 and not isinstance(state, bool)):
            continue
        over = k == here and k + 1 < len(states) and states[k + 1][1] == told
        if over and is_rounding(motion, now, states[k + 1][0], reads):
            continue
        return max(start, now), state
    return None


def is_rounding(motion: Motion, low: float, high: float, reads: frozenset[str] = POSITION) -> bool:
    """Whether all that is read changes from ``low`` to ``high`` by no more than rounding."""
    if reads & LASTING and high - low > ROUNDING * (abs(motion.begin[0]) + high):
        return False
    if motion.curve is not None:
        return ("velocity" not in reads or motion.curve.is_no_push(low, high)) and (
            "position" not in reads or motion.curve.is_no_way(low, high)
        )
    if "velocity" in reads and (high - low) * _largest(motion.a) > ROUNDING * (
        _largest(motion.v) + high * _largest(motion.a)
    ):
        return False
    return "position" not in reads or _is_no_way(motion, low, high)


def _is_no_way(motion: Motion, low: float, high: float) -> bool:
    """Whether the ways from ``low`` to ``high``, and half as far, so that none is long that comes back, are within rounding of the position."""
    for x, v, a in zip(motion.x, motion.v, motion.a, strict=True):
        for top in (high, 0.5 * (low + high)):
            way = (top - low) * (v + 0.5 * (top + low) * a)
            if abs(way) > ROUNDING * (abs(x) + abs(high * v) + 1e-300):
                return False
    return True


def _largest(vector: Vec) -> float:
    return max(map(abs, vector))


def watch_key(leaf: Condition) -> tuple[Any, ...] | None:
    """What has to be followed for ``leaf``; None for conditions of other kinds."""
    if isinstance(leaf, (when.RegionActive, when.RegionInactive)):
        return "volume", leaf.region
    if isinstance(leaf, (when.ObserverEnter, when.ObserverExit, when.ProbeEnter, when.ProbeExit)):
        return "inside", leaf.region
    if isinstance(leaf, when.Crosses):
        return "crosses", leaf.expression
    if isinstance(leaf, (when.Asleep, when.Awake)):
        return ("rest",)
    return None


def make_watch(world: Any, key: tuple[Any, ...]) -> Watch:
    """The watch for ``key``."""
    if key[0] == "crosses":
        from xpheve.plan.wakeups.cross_watch import CrossWatch  # brings numpy.polynomial along: only who asks pays

        return CrossWatch(world, key[1])
    if key[0] == "rest":
        return SleepWatch(world)
    return InsideWatch(world, key[1], key[0] == "volume")
