"""What an engine can be told while time passes: start, wait, suspend, resume, terminate, reset; and what hosts ask of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import suppress
from threading import TIMEOUT_MAX, get_ident
from typing import Any

from xpheve.errors import InvalidValueError, StateError
from xpheve.laws import conditions as when
from xpheve.realtime.clock import RealClock, Source
from xpheve.realtime.inputs import Inputs
from xpheve.realtime.live import Closed, Live, launch
from xpheve.realtime.snapshot import Snapshot, take
from xpheve.realtime.states import check
from xpheve.realtime.update import Update
from xpheve.steppers.contract import Settings

RTOL, ATOL = 1e-6, 1e-9
"""Default tolerances where motion is not exact."""


class Control(Update):
    """The part of `PhysicsEngine` that controls a run."""

    def start(
        self,
        *,
        speed: float = 1.0,
        updates: float = 60.0,
        frames: int | None = None,
        dt: float | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        until: float | None = None,
        on_frame: Callable[[Snapshot], None] | None = None,
        keep_inputs: bool = True,
        source: Callable[[], float] = time.monotonic,
    ) -> None:
        """Run the scene in real time on a thread of its own, from the present simulation time on. Returns at once.

        Other threads then see the last published `snapshot`, and what they write is done at the next frame and recorded in `inputs`.

        Parameters
        ----------
        speed
            Simulated seconds per second.
        updates
            Frames per second of the system's time.
        frames
            In place of ``updates``: a frame at each so-many-th `frame_passed` of the host.
        dt, rtol, atol
            As in `run`: how motion is followed. Frames have nothing to do with it.
        until
            Stop time [s]: the engine suspends itself there, exactly; `resume` goes on.
        on_frame
            Called with each snapshot but that of `terminate`, on the engine's thread, between two frames.
        keep_inputs
            Whether to keep the log for `replay`; it grows with what other threads write.
        source
            The system's time [s], by default `time.monotonic`.

        Raises
        ------
        StateError
            If the state does not allow it, or the scene needs host steps and has no ``dt``.
        InvalidValueError
            If a number makes no sense.
        """
        with self._alone:
            self._surface()
            check(self, "start")
            for name, value in (("updates", updates), ("dt", dt), ("rtol", rtol), ("atol", atol)):
                if value is not None and seconds(value, name) <= 0:
                    raise InvalidValueError(f"{name} = {value}: a number above 0 is needed")
            if updates is None:
                raise InvalidValueError(
                    "updates = None: a number of frames per second is needed; frames=n counts the host's"
                )
            if dt is not None and (rtol is not None or atol is not None):
                raise InvalidValueError("give dt, or rtol and atol, not both: with dt every step has that length")
            if 1.0 / float(updates) == math.inf:
                raise InvalidValueError(f"updates = {updates}: more frames per second are needed")
            if frames is not None and (isinstance(frames, bool) or not isinstance(frames, int) or frames < 1):
                raise InvalidValueError(f"frames = {frames!r}: a whole number from 1 up is needed")
            if until is not None and seconds(until, "until") < self.time:
                raise InvalidValueError(
                    f"until = {until} s lies before the present time {self.time} s; reset() goes back to 0"
                )
            if on_frame is not None and not callable(on_frame):
                raise InvalidValueError(f"on_frame = {on_frame!r}: a function of a snapshot is needed")
            clock = RealClock(speed=speed, origin=self.time, source=source)
            Source(source).checked()
            self._check_contacts_of_steps(dt)
            begin = self._world.time
            settings = Settings(dt, rtol or RTOL, atol or ATOL)
            self._begin(settings)
            live = Live(
                clock,
                None if frames is not None else 1.0 / float(updates),
                frames or 0,
                math.inf if until is None else float(until),
                on_frame,
                keep_inputs,
                self._world.force_ids.inputs,
            )
            self._log_of = (begin, (settings.dt, settings.rtol, settings.atol))
            self._failure = None
            self._state = "running"
            clock.start()
            self._publish(live)
            self._live = self._view._live = live
            launch(self, live)

    def wait(self, until: float | None = None, timeout: float | None = None) -> bool:
        """Sleep until simulation time ``until`` [s], or without it until the end: terminated, or standing by its own doing.

        Its own doing is a stop time, or a handler's `suspend`. Returns whether that came; False if ``timeout`` [s] passed first, or
        the engine ended before ``until``.

        Raises
        ------
        StateError
            If the engine was not started, or a handler waits.
        XpheveError
            What failed in the background, or whatever else a handler raised.
        """
        goal = math.inf if until is None else seconds(until, "until")
        latest = math.inf if timeout is None else time.monotonic() + seconds(timeout, "timeout")
        live = self._live
        if live is not None and get_ident() == live.thread.ident:
            raise StateError("wait: the engine's own thread cannot wait for itself; a handler or on_frame cannot wait")
        self._surface()
        check(self, "wait")
        if live is None:
            return until is None or self.time >= goal
        with live.turn:
            live.targets.append(goal)
            live.turn.notify_all()
            try:
                while True:
                    self._surface()
                    if self._failure is not None:
                        raise self._failure
                    if self._seen(live).time >= goal:
                        return True
                    if live.closed or live.halted_itself:
                        return until is None
                    left = latest - time.monotonic()
                    if left <= 0:
                        return False
                    live.turn.wait(min(left, TIMEOUT_MAX))
            finally:
                live.targets.remove(goal)

    # Commands

    def suspend(self) -> None:
        """Stand still until `resume`; a handler that calls it stops the run after the present instant. Acts at once.

        Raises
        ------
        StateError
            If the state does not allow it (see the table of states and commands).
        """
        self._command("suspend", Control._suspend)

    def resume(self) -> None:
        """Go on after `suspend`, a stop time, or a failure, as if nothing had been. Raises `StateError`."""
        self._command("resume", Control._resume)

    def terminate(self) -> None:
        """End for good: nothing runs until `reset`. The state can still be read. What failed in the background is raised afterwards."""
        live = self._given("terminate", Control._terminate)
        if live is not None:
            live.join()
            self._surface()

    def reset(self) -> None:
        """Back to time 0 and the scene as it was when it was first started.

        Objects and laws added since are taken out (they keep their last state), those removed since come back. Raises `StateError`.
        """
        while True:
            live = self._live
            if live is not None and live.holder != get_ident():
                with live.hold():
                    if self._live is live:
                        check(self, "reset")
                        self._close(live)
                live.join()
            with self._alone:
                if self._live is None or (live is not None and live.holder == get_ident()):
                    check(self, "reset")
                    if self._authored is not None:
                        self._take_up(self._authored)
                        self._authored = None
                    self._started = False
                    self._failure = None
                    self._state = "ready"
                    break
        self._surface()

    @property
    def stop_time(self) -> float | None:
        """Simulation time [s] at which a started engine suspends itself, exactly; None for never. May be set while it runs."""
        live = self._live
        return None if live is None or live.until == math.inf else live.until

    @stop_time.setter
    def stop_time(self, value: float | None) -> None:
        goal = math.inf if value is None else seconds(value, "stop_time")
        self._command("stop_time", Control._set_stop_time, goal)

    def _command(self, name: str, obey: Callable[..., None], *args: Any) -> None:
        self._given(name, obey, *args)

    def _given(self, name: str, obey: Callable[..., None], *args: Any) -> Live | None:
        """Obey here, or on the engine's thread, which is then returned."""
        while True:
            live = self._live
            if live is None:
                with self._alone:
                    if self._live is None:
                        obey(self, *args)
                        return None
            elif live.holder == get_ident():
                obey(self, *args)
                return None
            else:
                if name != "terminate":
                    self._surface()
                with suppress(Closed):
                    live.enter(self, name, obey, args, {}, True)
                    return live  # type: ignore[no-any-return]

    def _suspend(self) -> None:
        check(self, "suspend")
        with self._world.instant():
            self._change_state("suspended")
            self._tell_paused(when.Paused)
        live = self._live
        if live is not None and not self._running:  # a command of another thread: the clock stood since then
            live.clock.pause(max(self._ordered_at, live.clock.system_at(self._world.time[0])))

    def _resume(self) -> None:
        check(self, "resume")
        live = self._live
        with self._world.instant():
            self._change_state("running" if self._running or live is not None else "ready")
            self._tell_paused(when.Resumed)
        if live is None or self._running:
            return
        self._note(live, "resume")
        if self._world.time[0] >= live.until:
            live.until = math.inf
        self._failure = None
        live.halted_itself = False
        live.source.trouble = None
        live.clock.resume(self._ordered_at)
        live.next_due = live.clock.source()

    def _tell_paused(self, kind: type[when.Condition]) -> None:
        """Tell those who wait for pauses or their ends, and a replay, which has to tell them as well."""
        wakeups = self._world.wakeups
        if wakeups.armed.hearers(kind):
            wakeups.tell_now(kind)
            if self._live is not None and not self._running:
                self._note(self._live, kind.__name__)

    def _terminate(self) -> None:
        check(self, "terminate")
        self._change_state("terminated")

    def _set_stop_time(self, goal: float) -> None:
        if self._live is None:
            raise StateError(f"stop_time = {goal}: the engine is not started; give run(until=...), or start(until=...)")
        now = self._world.time[0]
        if goal < now:
            raise InvalidValueError(f"stop_time = {goal} s lies before the present time {now} s; suspend() stops now")
        self._live.until = goal

    def _change_state(self, state: str) -> None:
        """Go to ``state``; taken back with the rest if the handler that asked for it fails."""
        before, transaction = self._state, self._world.transaction
        if transaction is not None:
            transaction.undo.append(lambda: setattr(self, "_state", before))
        self._state = state

    # What hosts ask

    @property
    def snapshot(self) -> Snapshot:
        """The scene at one instant, immutable: of a started engine the last published frame, else of now."""
        live = self._live
        if live is not None and live.holder != get_ident():
            return self._seen(live)
        if live is not None:
            return take(self._world, self._frames, self._state, math.nan, 0.0)
        with self._alone:
            return take(self._world, self._frames, self._state, math.nan, 0.0)

    def next_frame(self, after: Snapshot | None = None, timeout: float | None = None) -> Snapshot | None:
        """Sleep until there is a snapshot newer than ``after`` (default: the last one), and return it.

        None if ``timeout`` [s] passed or the engine ended. While the engine is suspended there is a new one only after a write.
        Raises what failed in the background.
        """
        live = self._live
        self._surface()
        if live is None:
            if self._state == "terminated":
                return None
            raise StateError(
                f"next_frame: the engine is {self._state}, not started; start() it first, or take engine.snapshot"
            )
        if get_ident() == live.thread.ident:
            raise StateError("next_frame: the engine's own thread cannot wait for itself")
        latest = math.inf if timeout is None else time.monotonic() + seconds(timeout, "timeout")
        with live.turn:
            number = (self._published[0] if after is None else after).number
            live.frame_waiters += 1
            live.turn.notify_all()
            try:
                while self._published[0].number <= number:
                    left = latest - time.monotonic()
                    if live.closed or left <= 0:
                        return None
                    live.turn.wait(min(left, TIMEOUT_MAX))
                    self._surface()
            finally:
                live.frame_waiters -= 1
            newest: Snapshot = self._published[0]
            return newest

    def frame_passed(self) -> None:
        """The host has shown a frame; each n-th makes an update after ``start(frames=n)``. Raises `StateError`."""
        live = self._live
        check(self, "frame_passed")
        assert live is not None
        if live.period is not None:
            raise StateError(
                "frame_passed: the engine was started with updates per second; start(frames=n) counts frames"
            )
        with live.turn:
            if self._state == "running":
                live.frames_passed += 1
                if live.frames_passed >= live.host_frames:
                    live.turn.notify_all()

    @property
    def real_time_factor(self) -> float:
        """Simulated time that passed per time of the clock over the last second or so; NaN if not started."""
        return self._published[0].real_time_factor if self._live is not None else math.nan

    @property
    def lag(self) -> float:
        """Simulation time [s] by which the last frame was behind the clock; 0 if not started."""
        return self._published[0].lag if self._live is not None else 0.0

    @property
    def inputs(self) -> Inputs:
        """What came from other threads since the last `start`, for `replay`. Raises `StateError` if it was not kept."""
        live = self._live
        if live is None:
            if self._inputs is None:
                raise StateError("inputs: none were kept: the engine was not started, or with keep_inputs=False")
            return self._inputs
        if not live.keep_inputs:
            raise StateError("inputs: the engine was started with keep_inputs=False")
        if live.holder == get_ident():
            return self._all_inputs(live)
        with live.hold():
            return self._all_inputs(live)

    def replay(self, inputs: Inputs, until: float | None = None, *, classes: tuple[type[Any], ...] = ()) -> None:
        """Run with ``inputs`` of another run, each at its instant, to ``until`` [s] (default: where that one ended).

        On a copy of the scene as it was at that run's `start` (`copy`, `restore`, or built anew) it ends in the same bits.

        Parameters
        ----------
        inputs
            From `PhysicsEngine.inputs` or `Inputs.load`.
        classes
            Classes of laws and containers that the inputs add and no pack offers.

        Raises
        ------
        StateError, InvalidValueError
            As `run`; or if the scene stands at another time than the inputs begin.
        RecordError, UnknownLawError
            If the inputs name something that is not at hand.
        """
        from xpheve.realtime.replay import replay

        check(self, "replay")
        replay(self, inputs, until, classes)

    def real_time_report(self) -> dict[str, Any] | None:
        """For `explain`: clock, rate and lag; None if not started."""
        live = self._live
        if live is None:
            return None
        shot: Snapshot = self._published[0]
        return {
            "speed": live.clock.speed,
            "updates": None if live.period is None else 1.0 / live.period,
            "frames": shot.number,
            "real_time_factor": None if math.isnan(shot.real_time_factor) else shot.real_time_factor,
            "lag": shot.lag,
            "paused": live.clock.paused,
            "stop_time": self.stop_time,
            "inputs": len(live.log),
            "failed": None if self._failure is None else str(self._failure),
        }


def seconds(value: Any, name: str) -> float:
    """``value`` as a finite float; raises `InvalidValueError`."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} = {value!r}: a number of seconds is needed") from None
    if not math.isfinite(number):
        raise InvalidValueError(f"{name} = {number}: a finite number is needed")
    return number


__all__ = ["Control", "seconds"]
