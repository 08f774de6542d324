"""The sign of an expression of the state of an object, followed along its flight."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from xpheve.errors import LawFailedError, XpheveError
from xpheve.kernels.clock import NEVER, later
from xpheve.laws import conditions as when
from xpheve.laws.view import BodyView
from xpheve.plan.wakeups.crossings import window
from xpheve.plan.wakeups.motion import Motion, Subject, is_still
from xpheve.plan.wakeups.watches import FIRST, Outlook, Record, Watch


class CrossWatch(Watch):
    """The sign of an expression of the state of an object."""

    def __init__(self, world: Any, expression: Callable[[Any], Any]) -> None:
        super().__init__(world)
        self.expression = expression

    def outlook(self, subject: Subject, motion: Motion, record: Record, now: float) -> Outlook:
        if record.begin != motion.begin:
            record.begin, record.start, record.wish = motion.begin, 0.0, FIRST
        reads: set[str] = set()
        limit = motion.span

        def f(s: Any) -> Any:
            return self._values(subject, motion, s, reads)

        if motion.span == 0.0:
            return Outlook([(0.0, int(np.sign(f(np.zeros(1))[0])))])
        while True:
            stop, wish, states = window(f, record.start, record.wish, limit)
            if not reads & {"time"} and is_still(self.world, subject):  # type: ignore[arg-type]
                return Outlook(states)
            if stop > now or stop >= limit:
                return Outlook(states, stop if stop < limit else NEVER[0], wish)
            record.start, record.wish = stop, wish

    def _values(self, subject: Any, motion: Motion, s: Any, reads: set[str]) -> Any:
        """The expression at times ``s`` [s] of the flight, shape (n,)."""
        view = BodyView(lambda name: self._fetch(subject, motion, s, name), reads, len(s))
        name = str(when.Crosses(self.expression))
        try:
            with np.errstate(all="ignore"):
                given = np.asarray(self.expression(view))
            if given.dtype == bool:
                raise LawFailedError(
                    f"{name} gave True or False, which goes through no zero: give a difference, such as body.position.z - 2.0 for z > 2"
                )
            if given.size not in (1, len(s)):
                raise LawFailedError(
                    f"{name} gave an array of shape {given.shape} for {len(s)} times; shape ({len(s)}, 1) is needed: one number for each, "
                    "such as body.position.z or body.velocity.norm()"
                )
            found = given.astype(float)
            values = np.broadcast_to(found.reshape(-1) if found.size == len(s) else found, (len(s),))
        except XpheveError:
            raise
        except Exception as error:
            raise LawFailedError(f"{name} raised {type(error).__name__}: {error}; for {subject!r}") from error
        if not np.isfinite(values).all():
            k = int(np.flatnonzero(~np.isfinite(values))[0])
            raise LawFailedError(
                f"{name} gave {values[k]} for {subject!r} at t = {later(motion.begin, float(s[k]))[0]} s"
            )
        return values

    def _fetch(self, subject: Any, motion: Motion, s: Any, name: str) -> Any:
        world, n = self.world, len(s)
        bodies, row = world.bodies, subject._row
        if name == "position":
            return np.stack(
                [x + s * (v + (0.5 * s) * a) for x, v, a in zip(motion.x, motion.v, motion.a, strict=True)], 1
            )
        if name == "velocity":
            return np.stack([v + s * a for v, a in zip(motion.v, motion.a, strict=True)], axis=1)
        if name in ("orientation", "angular_velocity"):
            return np.array([world.read_row(row, name, later(motion.begin, one)) for one in s.tolist()])
        if name == "mass":
            return np.full(n, bodies.arrays["mass"][0, row])
        if name == "inertia":
            return np.tile(bodies.arrays["inertia"][:, row], (n, 1))
        if name == "time":
            return motion.begin[0] + s
        if name == "up":
            return np.array(world.up_vector)
        if name in bodies.columns:
            return np.full(n, bodies.columns[name][row])
        raise AttributeError(f"body.{name} is no property, and no column that a law here declares")
