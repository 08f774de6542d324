"""How a started engine makes a frame: time passes to what the clock reads, then comes what others asked for, then a snapshot."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from xpheve.laws import conditions as when
from xpheve.realtime.encode import encode
from xpheve.realtime.idle import still_until
from xpheve.realtime.inputs import Input, Inputs, kinds_of
from xpheve.realtime.snapshot import Snapshot, take

if TYPE_CHECKING:
    from xpheve.bodies import BodiesView
    from xpheve.kernels.clock import Instant
    from xpheve.objects import PhysicalObject
    from xpheve.plan.world import World
    from xpheve.realtime.live import Entry, Live
    from xpheve.steppers.contract import Settings

COMMANDS = frozenset({"suspend", "resume", "terminate", "stop_time"})


class Update:
    """The part of `PhysicsEngine` that its own thread runs."""

    _world: World
    _view: BodiesView
    _state: str
    _running: bool
    _started: bool
    _authored: Any

    if TYPE_CHECKING:  # what the rest of the engine brings

        @property
        def time(self) -> float: ...
        def _begin(self, settings: Settings) -> None: ...
        def _pass_time(self, end: Instant) -> bool: ...
        def _check_contacts_of_steps(self, dt: float | None) -> None: ...
        def _check_own(self, obj: PhysicalObject) -> None: ...
        def _tell_paused(self, kind: type[when.Condition]) -> None: ...
        def _take_up(self, saved: Any) -> None: ...

    def _prepare_control(self) -> None:
        """Not started yet."""
        self._live: Any = None
        self._alone = threading.RLock()
        """Of the thread that changes or looks at the scene while the engine is not started."""
        self._published: tuple[Any, float] = (None, 0.0)
        """The last snapshot, and until when nothing changes after it."""
        self._frames = 0
        self._trouble: list[BaseException] = []
        """What failed in the background and was told to nobody yet."""
        self._failure: BaseException | None = None
        self._ordered_at = 0.0
        self._inputs: Inputs | None = None
        self._log_of: tuple[Instant, tuple[Any, Any, Any]] = ((0.0, 0.0), (None, 0.0, 0.0))

    def _surface(self) -> None:
        """Raise what failed in the background, once."""
        if self._trouble:
            try:
                error = self._trouble.pop(0)
            except IndexError:  # another thread was told
                return
            raise error

    def _halted(self) -> bool:
        """Whether time is to stop passing: a handler stopped the engine, or a frame has taken long enough."""
        return self._state != "running" or (self._live is not None and self._live.overdue())

    def _make_frame(self, live: Live) -> None:
        """One turn of the engine's thread."""
        entries = live.begin_frame()
        try:
            if self._state == "running":
                self._advance(live, entries)
            self._carry_out(entries)
            self._settle(live)
        except BaseException as error:
            self._fail(live, error)
        finally:
            live.end_frame(entries)
        if live.on_frame is not None and not live.closed:
            live.calling_back = True
            try:
                live.on_frame(self._published[0])
            except BaseException as error:
                with live.hold():
                    if live.closed:  # meanwhile, by another thread
                        self._trouble.append(error)
                    else:
                        self._fail(live, error)
                        self._publish(live)
            finally:
                live.calling_back = False

    def _settle(self, live: Live) -> None:
        """What the others see after a frame, or after the last one."""
        if self._state == "terminated":
            self._close(live)
        else:
            self._publish(live)

    def _advance(self, live: Live, entries: list[Entry]) -> None:
        """To what the clock reads, or read when somebody stopped it; not beyond the stop time; cut if it takes too long."""
        clock, world = live.clock, self._world
        asked = [entry.system for entry in entries if entry.name in ("suspend", "terminate")]
        target = min(clock.at(min(asked) if asked else clock.source()), live.until)
        live.passes += 1
        self._running = True
        try:
            if live.source.trouble is not None:
                raise live.source.trouble
            self._pass_time(max((target, 0.0), world.time))
            if self._state == "running" and world.time[0] < target:
                # Cut after an event: the rest of its instant belongs to this frame, as to any run that ends there.
                live.finish_instant()
                self._pass_time(max((world.time[0], 0.0), world.time))
        except BaseException as error:
            self._fail(live, error)
            return
        finally:
            self._running = False
        if self._state == "running" and world.time[0] >= live.until:
            self._state = "suspended"
            try:
                self._tell_paused(when.Paused)
            except BaseException as error:
                self._fail(live, error)
                return
        if self._state != "running":
            live.halted_itself = True
            clock.pause(clock.system_at(world.time[0]))

    def _carry_out(self, entries: list[Entry]) -> None:
        """What other threads asked for, in their order, at the present instant."""
        live, world = self._live, self._world
        for entry in entries:
            try:
                if entry.name in COMMANDS:
                    self._ordered_at = entry.system
                    entry.result = entry.method(self, *entry.args)
                    continue
                if entry.name in ("write_object", "write_column"):
                    self._check_own(entry.args[0])
                instant = world.time
                arguments: tuple[Any, ...] = ()
                options: tuple[tuple[str, Any], ...] = ()
                if live.keep_inputs:  # as they are before it is done
                    arguments = tuple(encode(self, value) for value in entry.args)
                    options = tuple((name, encode(self, value)) for name, value in entry.kwargs.items())
                entry.result = entry.method(self, *entry.args, **entry.kwargs)
                if live.keep_inputs:
                    live.log.append(Input(instant, live.passes, entry.name, arguments, options))
            except BaseException as error:
                if entry.waits:
                    entry.error = error
                else:
                    self._trouble.append(_named(error, entry, world.time[0]))

    def _fail(self, live: Live, error: BaseException) -> None:
        """Stand just before what failed, and tell in the next call of the host."""
        self._state = "failed"
        self._failure = error
        self._trouble.append(error)
        live.clock.pause(live.clock.system_at(self._world.time[0]))
        self._note(live, "failed", (("error", kinds_of(error)),))

    def _note(self, live: Live, what: str, options: tuple[tuple[str, Any], ...] = ()) -> None:
        """Log what a replay must know beside the inputs."""
        if live.keep_inputs:
            live.log.append(Input(self._world.time, live.passes, what, (), options))

    def _publish(self, live: Live) -> None:
        """Make the present state the one that other threads see."""
        world = self._world
        self._frames += 1
        factor, lag = live.rate(world.time[0])
        shot = take(world, self._frames, self._state, factor, lag, self._published[0])
        still = still_until(world) if self._state == "running" else world.time[0]
        live.still = still
        live.going = self._state == "running"
        self._published = (shot, still)

    def _seen(self, live: Live) -> Snapshot:
        """The last snapshot; while nothing changes, at the time that the clock reads."""
        shot: Snapshot
        shot, still = self._published
        if still > shot.time and live.period is not None:
            now = min(live.clock.time, still, live.until)
            if now > shot.time:
                return shot.later(now)
        return shot

    def _close(self, live: Live) -> None:
        """No thread any more: what is still in the queue is done first, so that nothing is lost."""
        while True:
            late = live.close_if_empty()
            if not late:
                break
            self._carry_out(late)
            for entry in late:
                entry.done = True
        self._inputs = self._all_inputs(live) if live.keep_inputs else None
        self._publish(live)
        self._live = self._view._live = None

    def _leave_clock(self, live: Live) -> None:
        """No thread and no clock any more; the scene stays as it stands, for `run` or another `start`."""
        self._inputs = self._all_inputs(live) if live.keep_inputs else None
        self._live = self._view._live = None
        self._state = "ready" if self._state == "running" else "suspended"

    def _all_inputs(self, live: Live) -> Inputs:
        begin, settings = self._log_of
        passed = not live.log or live.passes > live.log[-1].group
        return Inputs(tuple(live.log), begin, self._world.time, settings, passed)


def _named(error: BaseException, entry: Entry, time: float) -> BaseException:
    """``error`` saying which write it was."""
    given = ", ".join([*map(repr, entry.args), *(f"{name}={value!r}" for name, value in entry.kwargs.items())])
    first = error.args[0] if error.args else ""
    error.args = (f"{entry.name}({given}), done at t = {time} s: {first}", *error.args[1:])
    return error


__all__ = ["Update"]
