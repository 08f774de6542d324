"""RealClock: simulation time from the time of the system, less what was paused.

Source: Nourian (2004), 3.1.2: t = t_system - t_start - t_paused. Here a pause that still runs counts too, and the
system's time never jumps back (`time.monotonic`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from xpheve.errors import InvalidValueError, StateError

FARTHEST = 1e18
"""[s]: readings beyond it are none."""


class Source:
    """The system's time; when it fails or gives nonsense its last good reading goes on, and ``trouble`` says what came."""

    def __init__(self, source: Callable[[], float]) -> None:
        self.source = source
        self.steps = source is not time.monotonic
        """Whether it may jump or stand, so that nobody can sleep until it says something."""
        self.trouble: Exception | None = None
        self._last = 0.0

    def checked(self) -> float:
        """The reading [s]. Raises `InvalidValueError`, or what the source raises."""
        found = self.source()
        if not isinstance(found, (int, float)) or isinstance(found, bool) or not abs(found) < FARTHEST:
            raise InvalidValueError(f"source gave {found!r}: seconds are needed, a finite number below {FARTHEST:g}")
        self._last = float(found)
        return self._last

    def __call__(self) -> float:
        try:
            return self.checked()
        except Exception as wrong:
            self.trouble = wrong
            return self._last


class RealClock:
    """A stopwatch: ``time = origin + speed * (t_system - t_start - t_paused)``; it stands at ``origin`` until `start`.

    Parameters
    ----------
    speed
        Simulated seconds per second of the system.
    origin
        Reading [s] at the start.
    source
        The system's time [s]; by default `time.monotonic`.

    Raises
    ------
    InvalidValueError
        If ``speed`` is not a finite number above 0, or ``origin`` not finite.
    """

    def __init__(
        self, *, speed: float = 1.0, origin: float = 0.0, source: Callable[[], float] = time.monotonic
    ) -> None:
        for name, value, low in (("speed", speed, 0.0), ("origin", origin, -math.inf)):
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not low < value < math.inf:
                raise InvalidValueError(
                    f"{name} = {value!r}: a finite number{' above 0' if low == 0 else ''} is needed"
                )
        if not callable(source):
            raise InvalidValueError(f"source = {source!r}: a function that gives seconds is needed")
        self.speed = float(speed)
        self.origin = float(origin)
        self.source = source
        self._start: float | None = None
        self._past: tuple[float, float | None] = (0.0, None)
        """Seconds of the pauses that are over, and since when one runs; replaced as one, so that any thread may read."""

    def start(self) -> None:
        """Let the clock run from its origin. Raises `StateError` if it was started."""
        if self._start is not None:
            raise StateError("the clock is started already; make another, or resume() it")
        self._start = self.source()

    @property
    def time(self) -> float:
        """Reading [s] now."""
        return self.at(self.source()) if self._start is not None else self.origin

    def at(self, system: float) -> float:
        """Reading [s] when the system's time is ``system``, at or after the last pause or resume."""
        if self._start is None:
            return self.origin
        over, since = self._past
        if since is not None:
            system = since  # all since then is a pause
        return self.origin + self.speed * (system - self._start - over)

    def system_at(self, reading: float) -> float:
        """The system's time [s] at which the clock reads ``reading``, were it never paused again."""
        begin = self._start if self._start is not None else self.source()
        return begin + self._past[0] + (reading - self.origin) / self.speed

    @property
    def paused(self) -> float:
        """Seconds of the system's time spent in pauses so far, one that still runs included."""
        over, since = self._past
        return over if since is None else over + (self.source() - since)

    @property
    def running(self) -> bool:
        """Whether the clock goes."""
        return self._start is not None and self._past[1] is None

    def pause(self, at: float | None = None) -> None:
        """Stand still from now on, or since the system's time ``at``; nothing happens if it stands."""
        if self.running:
            self._past = (self._past[0], self.source() if at is None else at)

    def resume(self, at: float | None = None) -> None:
        """Go on from where it stands; nothing happens if it goes."""
        over, since = self._past
        if since is not None:
            self._past = (over + ((self.source() if at is None else at) - since), None)


__all__ = ["RealClock", "Source"]
