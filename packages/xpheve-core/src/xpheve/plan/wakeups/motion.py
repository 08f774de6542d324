"""How what is watched moves: objects by their flights, points by the host or with the object they ride on."""

from __future__ import annotations

from typing import Any, NamedTuple

from xpheve.events import Guard
from xpheve.kernels.clock import NEVER, Instant, elapsed
from xpheve.kernels.vector import Vec
from xpheve.objects import PhysicalObject
from xpheve.observers import Probe
from xpheve.plan.wakeups.curves import Curve

FIRST = 1.0  # [s] the first window of a flight along a parabola

Subject = PhysicalObject | Probe


class Motion(NamedTuple):
    """Position x + s (v + s a / 2), s [s] since ``begin``, known for ``span`` [s]; ``guards`` say when it is void.

    With a ``curve`` that is so at the beginning only, and what comes is read from there.
    """

    begin: Instant
    span: float
    x: Vec
    v: Vec
    a: Vec
    guards: tuple[Guard, ...]
    curve: Curve | None = None

    @property
    def first_window(self) -> float:
        """How long [s] the first window is in which the motion is looked at."""
        return FIRST if self.curve is None else self.curve.first_window()


def carrier(subject: Subject) -> PhysicalObject | None:
    """The object whose flight moves ``subject``; None for a point that stands."""
    return subject if isinstance(subject, PhysicalObject) else subject.attached


def motion_of(world: Any, subject: Subject) -> Motion:
    """The motion of ``subject`` from its last change on."""
    obj = carrier(subject)
    if obj is None or obj._row < 0:
        still = (0.0, 0.0, 0.0)
        return Motion(world.time, NEVER[0], subject.position, still, still, ())
    flight = world.flight(obj._row)
    span = NEVER[0] if flight.t1 == NEVER else elapsed(flight.t1, flight.t0)
    guards = ((obj, int(world.bodies.version[obj._row])),)
    curve = None
    if flight.curved:
        curve = Curve(world, obj._row, flight.t0, span, flight.velocity, flight.acceleration, guards)
    return Motion(flight.t0, span, flight.position, flight.velocity, flight.acceleration, guards, curve)


def is_still(world: Any, obj: PhysicalObject) -> bool:
    """Whether the flight of ``obj`` is constant: no velocity, angular velocity, net force or torque."""
    bodies, row = world.bodies, obj._row
    number = int(bodies.batch[row])
    if number < 0:
        return not any(bodies.get("velocity", row)) and not any(bodies.get("angular_velocity", row))
    flight = world.flight(row)
    if any(flight.velocity) or any(flight.acceleration) or any(bodies.get("angular_velocity", row)):
        return False
    if flight.curved:
        motion = motion_of(world, obj)
        assert motion.curve is not None
        return motion.curve.is_still()
    torque = world.batches[number].state.arrays.get("torque")
    return torque is None or not torque[:, int(bodies.local[row])].any()
