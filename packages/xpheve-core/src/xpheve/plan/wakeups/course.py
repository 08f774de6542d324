"""The value of a traced expression along one motion of its object."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import LawFailedError
from xpheve.kernels.clock import later
from xpheve.plan.evaluation import volume_of
from xpheve.plan.wakeups.motion import Motion
from xpheve.trace.expression_trace import ExpressionTrace, place_of
from xpheve.trace.graph import Input, at

Array = NDArray[np.float64]

TURNING = ("orientation", "angular_velocity")
FLYING = ("position", "velocity")


class Course:
    """``trace`` along ``motion`` of ``subject``; called with times [s] since it began.

    Raises
    ------
    LawFailedError
        If the object has not what is read of it, or a value is not finite.
    """

    def __init__(self, world: Any, trace: ExpressionTrace, subject: Any, motion: Motion) -> None:
        self.world, self.trace, self.subject, self.motion = world, trace, subject, motion
        self.fixed: dict[Input, float] = {
            node.value: self._fixed(node.value) for node in trace.inputs if _is_fixed(node)
        }
        """What does not change along the motion."""

    def __call__(self, s: Array) -> Array:
        """Values at the times ``s``, shape (n,)."""
        turned: dict[str, Array] = {}
        given = [self._given(one, s, turned) for one in self.trace.arrays.inputs]
        values = np.broadcast_to(np.asarray(self.trace.arrays.run(*given)[0], dtype=float), s.shape)
        if not np.isfinite(values).all():
            k = int(np.flatnonzero(~np.isfinite(values))[0])
            self._refuse(float(values[k]), float(s[k]))
        return values

    def at(self, s: float) -> float:
        """The value at the time ``s``."""
        turned: dict[str, Any] = {}
        value = float(self.trace.floats.run(*[self._given(one, s, turned) for one in self.trace.floats.inputs])[0])
        if not math.isfinite(value):
            self._refuse(value, s)
        return value

    def coefficients(self) -> tuple[float, float, float, float, float]:
        """Those of the polynomial in s that the value is; the trace says whether it is one."""
        made = self.trace.polynomial
        assert made is not None
        motion = self.motion
        begun = {"position": motion.x, "velocity": motion.v, "acceleration": motion.a, "time": motion.begin}
        given = [begun[one.name][one.component] if one.name in begun else self.fixed[one] for one in made.inputs]
        c = tuple(map(float, made.run(*given)))
        if not all(map(math.isfinite, c)):
            self._refuse(next(one for one in c if not math.isfinite(one)), 0.0)
        return c  # type: ignore[return-value]

    def _given(self, one: Input, s: Any, turned: dict[str, Any]) -> Any:
        """An input of the expression ``s`` [s] after the motion began; a number, or one a time where ``s`` is an array.

        ``turned`` keeps what was read at these times, by name, for the other components.
        """
        if one in self.fixed:
            return self.fixed[one]
        k, motion = one.component, self.motion
        if one.name == "time":
            return motion.begin[0] + s
        if one.name == "position" and motion.curve is None:
            return motion.x[k] + s * (motion.v[k] + (0.5 * s) * motion.a[k])
        if one.name == "velocity" and motion.curve is None:
            return motion.v[k] + s * motion.a[k]
        if one.name not in turned:
            world, row = self.world, self.subject._row
            if isinstance(s, np.ndarray):
                times = [later(motion.begin, t) for t in s.tolist()]
                turned[one.name] = world.read_times(row, one.name, times)
            else:
                turned[one.name] = world.read_row(row, one.name, later(motion.begin, s))
        return turned[one.name][k]

    def _fixed(self, one: Input) -> float:
        bodies, row = self.world.bodies, self.subject._row
        if one.name == "mass":
            return float(bodies.arrays["mass"][0, row])
        if one.name == "inertia":
            return float(bodies.arrays["inertia"][one.component, row])
        if one.name == "up":
            return float(self.world.up_vector[one.component])
        if one.name == "volume":
            return volume_of(self.subject)
        if one.name in bodies.columns:
            return float(bodies.columns[one.name][row])
        raise LawFailedError(
            f"{self.trace.label} reads body.{one.name}, which is no property, and no column that a law here declares; for {self.subject!r}. "
            f"{at(place_of(self.trace, one.name))}".rstrip()
        )

    def _refuse(self, value: float, s: float) -> None:
        when = later(self.motion.begin, s)[0]
        raise LawFailedError(
            f"{self.trace.label} gave {value} for {self.subject!r} at t = {when} s. {at(self.trace.value.place)}".rstrip()
        )


def _is_fixed(node: Any) -> bool:
    return node.value.name not in (*FLYING, *TURNING, "time")
