"""Live: what a started engine and its thread share: clock, queue, turns, log. It holds no engine, so that one can be forgotten."""

from __future__ import annotations

import atexit
import contextlib
import math
import sys
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Iterator
from threading import get_ident
from typing import Any

from xpheve.realtime import fork
from xpheve.realtime.clock import RealClock, Source
from xpheve.realtime.inputs import Input

BUDGET = 0.02
"""Seconds of the system after which a frame is cut, so that snapshots come and commands are heard although the machine cannot keep up."""
GRACE = 0.01
"""Seconds that a frame may still take when somebody waits for it."""
CALLBACK = 0.2
"""Seconds that an ending waits for ``on_frame``, which may wait for whoever ends the engine."""
CROWD = 10_000
"""Entries in the queue beyond which writers wait."""
LOOK = 1 / 60
"""Seconds after which a time of the system that is not the machine's own is looked at again: it may jump."""
WINDOW = 1.0
"""Seconds of the system over which the real-time factor is taken."""


class Closed(Exception):
    """The engine ended before a call came in, or was started anew: look again."""


class Entry:
    """A write or command of another thread on its way."""

    __slots__ = ("args", "done", "error", "kwargs", "method", "name", "result", "system", "waits")

    def __init__(
        self,
        name: str,
        method: Callable[..., Any],
        args: tuple[Any, ...],
        kwargs: dict[str, Any],
        waits: bool,
        system: float,
    ) -> None:
        self.name, self.method, self.args, self.kwargs = name, method, args, kwargs
        self.waits = waits
        self.system = system
        """The system's time at which it was given."""
        self.done = False
        self.result: Any = None
        self.error: BaseException | None = None


class Live:
    """The shared part. ``turn`` guards all of it but ``holder``, which any thread may compare with itself.

    ``holder`` is the thread that may touch the scene: the engine's own while it makes a frame, or one that looks between two.
    """

    def __init__(
        self,
        clock: RealClock,
        period: float | None,
        host_frames: int,
        until: float,
        on_frame: Callable[[Any], None] | None,
        keep_inputs: bool,
        last_force_id: int,
    ) -> None:
        self.turn = threading.Condition()
        self.clock = clock
        self.source = clock.source = Source(clock.source)
        self.period = period
        self.host_frames = host_frames
        self.until = until
        self.on_frame = on_frame
        self.keep_inputs = keep_inputs
        self.holder: int | None = None
        self.wanting = 0
        """Threads that wait to look."""
        self.tickets = 0
        self.limit: int | None = None
        """The last ticket that still goes before the frame that is due, so that looks never keep frames out."""
        self.admitted = 0
        self.queue: deque[Entry] = deque()
        self.urgent = 0
        """Entries in the queue that somebody waits for."""
        self.log: list[Input] = []
        self.passes = 0
        """How often time passed: inputs of one group have the same."""
        self.calling_back = False
        """Whether the thread is in ``on_frame``, which may wait for whoever waits for a frame."""
        self.going = True
        self.halted_itself = False
        """Stands because of a stop time, or of a handler."""
        self.closed = False
        self.still = 0.0
        """Simulation time until which nothing changes."""
        self.targets: list[float] = []
        """Simulation times that somebody waits for."""
        self.frame_waiters = 0
        self.frames_passed = 0
        self.next_due = self.source()
        self.deadline = math.inf
        """When the frame at hand is to be cut, by `time.monotonic`."""
        self.cuttable = False
        self.trail: deque[tuple[float, float]] = deque()
        """Reading of the clock and of the scene at the latest frames."""
        self.thread: threading.Thread | None = None
        self._last_force_id = last_force_id
        self._ids = threading.Lock()

    # For other threads

    def new_force_id(self) -> str:
        """An id for a force that is queued; a counter of its own, so that it does not depend on what handlers do meanwhile."""
        with self._ids:
            self._last_force_id += 1
            return f"input-{self._last_force_id}"

    def enter(
        self,
        engine: Any,
        name: str,
        method: Callable[..., Any],
        args: tuple[Any, ...],
        kwargs: dict[str, Any],
        waits: bool,
        result: Any = None,
    ) -> Any:
        """Queue a call for the next frame; if it ``waits``, see that there is one at once, and give back what came of it."""
        own = get_ident() == (self.thread.ident if self.thread is not None else None)
        with self.turn:
            while len(self.queue) >= CROWD and not self.closed and not own:
                self.wake(urgent=True)
                self.turn.wait()
            if not self.closed:
                entry = Entry(name, method, args, kwargs, waits, self.source())
                self.queue.append(entry)
                if waits and not own:
                    self.urgent += 1
                    self.wake(urgent=True)
                    if self._wait_for(entry):
                        return self._outcome(entry)
                elif not waits:
                    if not self.going or self.still > self.clock.time:
                        self.turn.notify_all()
                    return result
            else:
                raise Closed
        self._serve(engine)  # the engine's own thread between two frames, or it waits in on_frame for this one
        return self._outcome(entry)

    def _wait_for(self, entry: Entry) -> bool:
        """Until ``entry`` is done; False if that is for the caller to do, since the thread stays in ``on_frame``. The caller has the turn."""
        since = time.monotonic()
        while not entry.done:
            stays = self.calling_back and entry in self.queue
            left = since + GRACE - time.monotonic() if stays else None
            if left is not None and left <= 0.0:
                return False
            self.turn.wait(left)
        return True

    def _serve(self, engine: Any) -> None:
        """What is in the queue, done by this thread at the instant of the last frame."""
        with self.hold():
            entries = self.take_queue()
            if entries and not self.closed:
                engine._carry_out(entries)
                engine._settle(self)
            self.end_frame(entries)

    @staticmethod
    def _outcome(entry: Entry) -> Any:
        error, entry.error = entry.error, None
        if error is not None:
            raise error
        return entry.result

    def wake(self, *, urgent: bool = False) -> None:
        """Wake the thread; with ``urgent`` the frame at hand is cut soon. The caller has the turn."""
        if urgent and self.cuttable:
            self.deadline = min(self.deadline, time.monotonic() + GRACE)
        self.turn.notify_all()

    @contextlib.contextmanager
    def hold(self) -> Iterator[None]:
        """The scene for this thread alone, between two frames."""
        with self.turn:
            self.tickets += 1
            mine = self.tickets
            self.wanting += 1
            self.wake(urgent=True)
            while self.holder is not None or (self.limit is not None and mine > self.limit):
                self.turn.wait()
            self.wanting -= 1
            if self.limit is not None:
                self.admitted -= 1
            self.holder = get_ident()
        try:
            yield
        finally:
            with self.turn:
                self.holder = None
                self.turn.notify_all()

    def close_if_empty(self) -> list[Entry]:
        """What is still in the queue; if nothing is, no more comes in and the thread ends."""
        with self.turn:
            if not self.queue:
                self.closed = True
                self.turn.notify_all()
        return self.take_queue()

    def close(self) -> None:
        """Let the thread end."""
        with self.turn:
            self.closed = True
            self.turn.notify_all()

    # For the engine's own thread

    def join(self) -> None:
        """Wait for the end of the thread, unless it is this one, or stays in ``on_frame``, after which it ends."""
        thread = self.thread
        assert thread is not None
        if thread.ident == get_ident():
            return
        latest = time.monotonic() + CALLBACK
        while thread.is_alive() and not (self.calling_back and time.monotonic() > latest):
            thread.join(GRACE)

    def take_queue(self) -> list[Entry]:
        """What is in the queue, in order."""
        with self.turn:
            found = list(self.queue)
            self.queue.clear()
            self.urgent = 0
            return found

    def overdue(self) -> bool:
        """Whether the frame at hand has taken long enough."""
        return time.monotonic() > self.deadline

    def sleep(self) -> bool:
        """Until there is something to do; False if there never will be."""
        with self.turn:
            while True:
                if self.closed:
                    return False
                if self.urgent or (self.queue and not self.going) or len(self.queue) >= CROWD:
                    return True
                timeout = self._timeout() if self.going else None
                if timeout is not None and timeout <= 0.0:
                    return True
                if timeout is not None and self.source.steps:
                    timeout = min(timeout, max(self.period or 0.0, LOOK))
                self.turn.wait(None if timeout is None else min(timeout, threading.TIMEOUT_MAX))

    def _timeout(self) -> float | None:
        """Seconds of the system until a frame is due; None if that is for others to say."""
        if self.period is None:
            if self.frames_passed >= self.host_frames:
                self.frames_passed = 0
                return 0.0
            return None
        now = self.source()
        if self.source.trouble is not None:
            return 0.0
        stop = self.clock.system_at(self.until) if self.until < math.inf else math.inf
        if self.still > self.clock.at(now) and not self.frame_waiters:
            if self.queue:
                return 0.0
            change = min([self.still, *self.targets])
            due = min(self.clock.system_at(change) if change < math.inf else math.inf, stop)
            if due < math.inf:
                return due - now
            return LOOK if self.source.steps else None
        return min(self.next_due, stop) - now

    def begin_frame(self) -> list[Entry]:
        """Take the turn, looks first; the entries to carry out."""
        with self.turn:
            self.limit, self.admitted = self.tickets, self.wanting
            while self.holder is not None or self.admitted:
                self.turn.wait()
            self.limit = None
            self.holder = get_ident()
            self.deadline = time.monotonic() + (GRACE if self.urgent else BUDGET)
            self.cuttable = True
            if self.period is not None:
                now = self.source()
                # Frames that were missed are left out: the next one covers their time.
                late = max(0.0, (now - self.next_due) / self.period)
                self.next_due = now if late > 2.0**52 else self.next_due + (math.floor(late) + 1) * self.period
            found = list(self.queue)
            self.queue.clear()
            self.urgent = 0
            return found

    def finish_instant(self) -> None:
        """From here on the frame must not be cut."""
        with self.turn:
            self.cuttable = False
            self.deadline = math.inf

    def end_frame(self, entries: list[Entry]) -> None:
        """Give the turn back; what was asked for is done, and can be seen."""
        with self.turn:
            for entry in entries:
                entry.done = True
            self.cuttable = False
            self.deadline = math.inf
            self.holder = None
            self.turn.notify_all()

    def rate(self, scene: float) -> tuple[float, float]:
        """Real-time factor and lag [s] with the scene at ``scene`` [s]."""
        reading = self.clock.time
        trail = self.trail
        trail.append((reading, scene))
        while len(trail) > 2 and (trail[-1][0] - trail[1][0]) > WINDOW * self.clock.speed:
            trail.popleft()
        passed = trail[-1][0] - trail[0][0]
        factor = (trail[-1][1] - trail[0][1]) / passed if passed > 0 else math.nan
        return factor, max(0.0, reading - scene)


# The thread


def launch(engine: Any, live: Live) -> None:
    """Start the thread of ``engine``. It ends when the engine is closed or forgotten, and when the interpreter ends."""
    reference = weakref.ref(engine)
    thread = threading.Thread(target=_work, args=(reference, live), name="xpheve real time", daemon=True)
    live.thread = thread
    weakref.finalize(engine, live.close).atexit = False
    _started.add(engine)
    thread.start()


def _work(reference: weakref.ref[Any], live: Live) -> None:
    while live.sleep():
        engine = reference()
        if engine is None:
            return
        engine._make_frame(live)
        del engine


_started: weakref.WeakSet[Any] = weakref.WeakSet()


def _at_exit() -> None:
    """No thread is left in the midst of a frame, and no error untold."""
    for engine in list(_started):
        live = engine._live
        if live is not None:
            with live.turn:
                live.wake(urgent=True)
            live.close()
            live.thread.join(2.0)
        for error in engine._trouble:
            sys.excepthook(type(error), error, error.__traceback__)


atexit.register(_at_exit)
fork.register(_started)

__all__ = ["BUDGET", "Closed", "Entry", "Live", "launch"]
