"""The story of a run: checked, begun, carried to its end frame by frame and host step by host step."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

from xpheve.engine.saving import Saving
from xpheve.errors import InvalidValueError, LawFailedError, StateError
from xpheve.kernels.clock import NEVER, Instant, elapsed, multiple
from xpheve.laws import Event
from xpheve.laws import conditions as when
from xpheve.realtime.control import ATOL, RTOL, seconds
from xpheve.realtime.states import check
from xpheve.steppers.contract import Settings


class Running(Saving):
    """The part of `PhysicsEngine` in which time passes."""

    def run(
        self,
        until: float,
        *,
        dt: float | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        every: float | None = None,
        record: str | os.PathLike[str] | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Any:
        """Carry the scene to simulation time ``until`` [s], events at ``until`` included.

        Parameters
        ----------
        dt
            Length [s] of a host step; without it motion is exact or kept to the tolerances.
        rtol, atol
            Relative and absolute tolerance in SciPy's meaning, where motion is not exact; not with ``dt``.
        every
            Keep a record with a frame each ``every`` [s]; it never changes the motion.
        record
            A file for the record in place of memory.
        progress
            Called with the time [s] after each frame.

        Returns
        -------
        xpheve.record.Record or None
            With ``every`` the record, else None.

        Raises
        ------
        StateError
            If the engine is suspended, terminated or running, or the scene needs steps and has none.
        InvalidValueError
            If ``until`` lies in the past, or a number makes no sense.
        LawFailedError, ContactError, NoStepperError
            From the scene; the engine then stands just before the failing event.
        """
        end, settings = self._check_run(until, dt, rtol, atol, every)
        if record is not None and every is None:
            raise InvalidValueError("record= needs every=: how often [s] to keep a frame")
        self._begin(settings)
        watch = self._look_at_steps(end)
        recorder = None
        try:
            self._running = True
            self._state = "running"
            if every is not None:
                from xpheve.record import Recorder

                recorder = Recorder(self, record, self._metadata(every))
            self._carry(end, every, recorder, progress)
        finally:
            self._running = False
            if self._state == "running":
                self._state = "ready"
            failed = {law.label(): what for law, what in self._world.failed.items()}
            note: dict[str, Any] = {"disabled_by_error": failed} if failed else {}
            if self._world.tiers:
                note["tiers"] = {" + ".join(one.laws): tier for one, tier in self._world.tiers.items()}
            found = recorder.close(note or None) if recorder is not None else None
        if watch is not None:
            watch.report()
        return found

    def _look_at_steps(self, end: Instant) -> Any:
        """Warn of host steps that are too long for the forces; returns the `xpheve.plan.resolution.Watch` of a run that has steps."""
        world = self._world
        if world.settings.dt is None or not any(one.signature.laws and one.state.count for one in world.batches):
            return None
        from xpheve.plan.resolution import Watch, warn_of_steps

        try:
            world.plan()
        except LawFailedError:  # time will not pass, and who waits for it is told
            return None
        warn_of_steps(world)
        return Watch(world, end)

    def step(self, dt: float) -> None:
        """One host step: to the next point of the grid of ``dt`` [s]; the same grid as ``run(dt=...)``."""
        self._surface()
        check(self, "step")
        if seconds(dt, "dt") <= 0:
            raise InvalidValueError(f"dt = {dt}: a number above 0 is needed")
        self._begin(Settings(dt, RTOL, ATOL))
        end = self._next_host_step(self._world.time)
        try:
            self._running, self._state = True, "running"
            self._pass_time(end)
        finally:
            self._running = False
            if self._state == "running":
                self._state = "ready"

    def _check_run(
        self, until: float, dt: float | None, rtol: float | None, atol: float | None, every: float | None
    ) -> tuple[Instant, Settings]:
        self._surface()
        check(self, "run")
        end = seconds(until, "until")
        if end < self.time:
            raise InvalidValueError(
                f"until = {end} s lies before the present time {self.time} s; reset() goes back to 0"
            )
        for value, name in ((dt, "dt"), (rtol, "rtol"), (atol, "atol"), (every, "every")):
            if value is not None and seconds(value, name) <= 0:
                raise InvalidValueError(f"{name} = {value}: a number above 0 is needed")
        if dt is not None and (rtol is not None or atol is not None):
            raise InvalidValueError("give dt, or rtol and atol, not both: with dt every step has that length")
        self._check_contacts_of_steps(dt)
        return (max((end, 0.0), self._world.time)), Settings(dt, rtol or RTOL, atol or ATOL)

    def _check_contacts_of_steps(self, dt: float | None) -> None:
        listeners = self._world.host_step_listeners(demanding=True)
        if dt is None and listeners:
            raise StateError(
                f"{listeners[0]!r} asks for host steps, and run(until=...) has none; event-driven motion has no steps. "
                "Give run(until=..., dt=...), or a condition in time such as Elapsed(seconds, every=True)"
            )

    def _begin(self, settings: Settings) -> None:
        """What happens once before time passes."""
        world = self._world
        before = world.settings
        world.set_out(settings)
        if not self._started:
            try:
                world.plan()
            except LawFailedError as error:
                world.settings = before
                world.give_up(error)
                self._begin(settings)
                return
            except BaseException:
                world.settings = before
                raise
            self._authored = self._save()
            self._started = True
            world.tell(when.Started, lambda container, condition: True, Event(self.time, objects=()))
        if settings.dt is not None and (world.grid is None or world.grid[1] != settings.dt):
            world.grid = (world.time, settings.dt, -1)

    def _carry(
        self, end: Instant, every: float | None, recorder: Any, progress: Callable[[float], None] | None
    ) -> None:
        """To ``end``, with a frame each ``every``."""
        begin, k = self._world.time, 0
        while every is not None:
            sample = multiple(begin, k, every)
            if sample[0] > end[0]:
                break
            if not self._pass_time(min(sample, end)):  # a frame that reads as the end is the end: looking moves nothing
                return
            recorder.sample()
            if progress is not None:
                progress(self.time)
            k += 1
        if (
            self._pass_time(end)
            and recorder is not None
            and (k == 0 or multiple(begin, k - 1, every or 0.0)[0] < end[0])
        ):
            recorder.sample()
        if progress is not None:
            progress(self.time)

    def _pass_time(self, end: Instant) -> bool:
        """To ``end``, host step by host step if somebody listens to them; False if a handler stopped the engine."""
        world = self._world
        while world.settings.dt is not None and world.host_step_listeners():
            origin, dt, done = world.grid  # type: ignore[misc]
            start = multiple(origin, done + 1, dt)
            if start[0] < world.time[0]:  # steps went by while nobody listened
                number = max(done + 1, int(elapsed(world.time, origin) / dt) - 1)
                while multiple(origin, number, dt)[0] < world.time[0]:
                    number += 1
                world.grid = (origin, dt, number - 1)
                continue
            if start[0] >= end[0]:
                end = min(end, start)  # a step that begins as the run ends is the next run's, at its own exact instant
                break
            world.pass_time(start, self._next_host_step)
            if self._halted():
                return False
            try:
                world.plan()
                world.host_step(done + 1, dt)
            except LawFailedError as error:
                world.give_up(error)
                continue
            world.grid = (origin, dt, done + 1)
            if self._halted():
                return False
        world.pass_time(end, self._next_host_step)
        return self._state == "running"

    def _next_host_step(self, t: Instant) -> Instant:
        """The first host step after ``t``; never, without ``dt``."""
        world = self._world
        if world.settings.dt is None or world.grid is None:
            return NEVER
        origin, dt, _ = world.grid
        number = max(0, int(elapsed(t, origin) / dt) - 1)
        while multiple(origin, number, dt) <= t:
            number += 1
        return multiple(origin, number, dt)

    def _periodic_metadata(self) -> dict[str, Any]:
        """Of periodic scenes only, so that records of others stay as they were."""
        box = self._world.periodic
        return {} if box is None else {"periodic": [edge if edge < math.inf else None for edge in box]}

    def _metadata(self, every: float) -> dict[str, Any]:
        from xpheve import __version__

        choices = {batch.stepper.id: batch.state.count for batch in self._world.batches if batch.state.count}
        return {
            "xpheve": __version__,
            "up": self.up,
            "seed": self.seed,
            **self._periodic_metadata(),
            "every": every,
            "steppers": choices,
            "compile": self.compile,
        }


__all__ = ["Running"]
