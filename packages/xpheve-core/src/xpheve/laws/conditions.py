"""Wakeup conditions: *when* the laws of a container are enforced.

A condition is a frozen value and may be shared. It does nothing by itself: the plan gives each armed condition one
server (the event queue, the engine, or the scene's contact server); a condition nobody armed costs nothing.
All conditions stay armed after firing; ``once=True`` disarms them at their first event. ``a | b``, ``a & b``, ``~a`` and ``AllNow(a, b)`` make
one condition of several; see `xpheve.laws.combinations`.

A *level* condition holds for a while (an observer is near); it fires when it becomes true, and once when it is armed while true.
The others are events.

Source: the wakeup criteria of Java3D as used in Nourian (2004), 3.2.2.1, with simulation time for wall time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError


@dataclass(frozen=True)
class Condition:
    """What every wakeup condition is; with ``once`` it fires at its first event only, until a `reset`."""

    once: bool = field(default=False, kw_only=True)

    served_by: ClassVar[str] = "engine"
    """``"engine"``, ``"queue"``, ``"steps"``, ``"contacts"`` or ``"flights"``: who finds its events."""
    original: ClassVar[str] = "-"
    """The criterion of Java3D that it stands for."""
    difference: ClassVar[str] = ""
    """What is other than there."""

    @property
    def is_level(self) -> bool:
        """Whether it holds for a while, rather than at instants."""
        return False

    def __or__(self, other: Any) -> AnyOf:
        return AnyOf(self, other)

    def __and__(self, other: Any) -> AllOf:
        return AllOf(self, other)

    def __invert__(self) -> Not:
        return Not(self)

    def __str__(self) -> str:
        shown = [
            f"{f.name}={getattr(self, f.name)!r}"
            for f in fields(self)
            if getattr(self, f.name) not in (f.default, None)
        ]
        return f"{type(self).__name__}({', '.join(shown)})"


@dataclass(frozen=True)
class Started(Condition):
    """The engine starts: once at the first run, and again after each `reset`; a `resume` is no start."""


@dataclass(frozen=True)
class ObjectAdded(Condition):
    """An object comes under a law of the container: added with it, or mapped to it later.

    Parameters
    ----------
    law
        A law, or its name or id, in place of those of the container.
    """

    law: Any = None

    def __post_init__(self) -> None:
        _check_law(self)


@dataclass(frozen=True)
class ObjectRemoved(Condition):
    """An object leaves a law of the container: removed from the engine, or unmapped.

    Parameters
    ----------
    law
        A law, or its name or id, in place of those of the container.
    """

    law: Any = None

    def __post_init__(self) -> None:
        _check_law(self)


@dataclass(frozen=True)
class Changed(Condition):
    """Somebody *set* a property of an object under a law of the container; moving in flight is no change.

    Parameters
    ----------
    what
        ``"mass"``, ``"position"``, ``"velocity"``, ... or the name of a column; ``""`` for any.
    obj
        Only this object, whatever laws it obeys; None for all under a law of the container.
    """

    what: str = ""
    obj: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.what, str):
            raise InvalidValueError(f"Changed(what={self.what!r}): the name of a property or column is needed")
        _check_object(self, "obj")


@dataclass(frozen=True)
class PoseChanged(Condition):
    """Somebody *set* the position or orientation of an object, and it went further than ``tol``; flight and impacts are no change.

    Parameters
    ----------
    obj
        Only this object; None for all under a law of the container.
    tol
        How far [m], or by what angle [rad], it must have been moved; >= 0.
    """

    original: ClassVar[str] = "WakeupOnTransformChange"
    difference: ClassVar[str] = "a body in flight does not wake it, being set does; nothing is polled"

    obj: Any = None
    tol: float = 0.0

    def __post_init__(self) -> None:
        _check_object(self, "obj")
        if isinstance(self.tol, bool) or not (isinstance(self.tol, (int, float)) and 0 <= self.tol < math.inf):
            raise InvalidValueError(
                f"PoseChanged(tol={self.tol!r}): a finite length [m] or angle [rad] from 0 up is needed"
            )


@dataclass(frozen=True)
class Elapsed(Condition):
    """Simulation time has gone by since the condition was armed, at the exact instant.

    Parameters
    ----------
    seconds
        Length [s] of the wait; > 0.
    every
        Again after each further wait of the same length.
    clock
        ``"sim"``: the engine's time, which stands still while the engine does. There is no other: a law that wakes at wall time could
        not be repeated to the bit. A host that runs the engine by the wall clock gets both.
    """

    original: ClassVar[str] = "WakeupOnElapsedTime"
    difference: ClassVar[str] = "simulation time and exact, where Java3D has wall time and may be late; persistent"

    seconds: float
    every: bool = False
    clock: str = "sim"
    served_by: ClassVar[str] = "queue"

    def __post_init__(self) -> None:
        if not (isinstance(self.seconds, (int, float)) and 0 < self.seconds < math.inf):
            raise InvalidValueError(f"Elapsed(seconds={self.seconds!r}): a finite time above 0 s is needed")
        if self.clock != "sim":
            raise InvalidValueError(
                f"Elapsed(clock={self.clock!r}): choose 'sim', simulation time; wall time would not repeat to the bit"
            )


@dataclass(frozen=True)
class Steps(Condition):
    """Host steps: the start of each step of ``run(until=..., dt=...)`` or ``step(dt)``.

    The handler is called at the *start* of the step and reads the state half a step ahead under the last forces
    (``event.time`` says so); a force that it stores acts over the whole step: second order for smooth forces. A velocity that it sets acts
    at the start, first order, unless ``at="middle"`` puts the event itself into the middle of the step.

    Parameters
    ----------
    n
        Steps left out between two calls: 0 is every step.
    at
        ``"start"`` or ``"middle"``.
    passive
        Do not ask for steps: without ``dt`` the run goes on, and this condition waits.
    """

    original: ClassVar[str] = "WakeupOnElapsedFrames"
    difference: ClassVar[str] = (
        "a frame is a host step; all are synchronous; the handler is called at the start of the step"
    )

    n: int = 0
    at: str = "start"
    passive: bool = False
    served_by: ClassVar[str] = "steps"

    def __post_init__(self) -> None:
        if not (isinstance(self.n, int) and self.n >= 0):
            raise InvalidValueError(f"Steps(n={self.n!r}): a whole number from 0 is needed")
        if self.at not in ("start", "middle"):
            raise InvalidValueError(f"Steps(at={self.at!r}): choose 'start' or 'middle'")


@dataclass(frozen=True)
class Posted(Condition):
    """``engine.post(id, data, source=...)`` was called; every post is delivered, in order.

    Parameters
    ----------
    id
        The id waited for; None for any.
    source
        The law, container or object that posts; None for any.
    """

    original: ClassVar[str] = "WakeupOnBehaviorPost"
    difference: ClassVar[str] = "every post is delivered, in order, with its data; there only the last id can be read"

    id: Any = None
    source: Any = None


@dataclass(frozen=True)
class ForceExpired(Condition):
    """A force with a duration came to its end; at that exact instant.

    Parameters
    ----------
    id
        The force's id; None for any.
    """

    id: Any = None
    served_by: ClassVar[str] = "queue"


@dataclass(frozen=True)
class Impact(Condition):
    """Two objects under a law of the container touch and approach one another."""

    served_by: ClassVar[str] = "contacts"


@dataclass(frozen=True)
class _OfContacts(Condition):
    """What conditions of contacts share: which pairs they take."""

    a: Any = None
    b: Any = None
    served_by: ClassVar[str] = "contacts"

    def __post_init__(self) -> None:
        _check_object(self, "a")
        _check_object(self, "b")

    def takes(self, contact: Any) -> bool:
        """Whether the condition waits for ``contact``: its pair is ``a`` and ``b``, either way round; None is any."""
        one, two = contact.body_a, contact.body_b
        return any(self.a in (None, x) and self.b in (None, y) for x, y in ((one, two), (two, one)))


@dataclass(frozen=True)
class ContactBegin(_OfContacts):
    """The gap between two objects closes; once when armed on a pair that touches already.

    Parameters
    ----------
    a, b
        Only contacts of these objects; None for any under a law of the container.
    """

    original: ClassVar[str] = "WakeupOnCollisionEntry"
    difference: ClassVar[str] = (
        "all pairs of the instant are handed over, with normal and point; both objects obey a law of the container"
    )


@dataclass(frozen=True)
class ContactStay(_OfContacts):
    """Two objects touch: at the start of each host step for as long as they do.

    Parameters
    ----------
    a, b
        Only contacts of these objects; None for any under a law of the container.
    moving
        Only while one of the two moves or turns.
    """

    original: ClassVar[str] = "WakeupOnCollisionMovement"
    difference: ClassVar[str] = "``ContactStay(moving=True)``; asked at host steps"

    moving: bool = False

    def takes(self, contact: Any) -> bool:
        if not super().takes(contact):
            return False
        bodies = (contact.body_a, contact.body_b)
        return not self.moving or any(any(obj.velocity) or any(obj.angular_velocity) for obj in bodies)


@dataclass(frozen=True)
class ContactEnd(_OfContacts):
    """Two touching objects come apart; for a bounce in the same instant, after the impact.

    Parameters
    ----------
    a, b
        Only contacts of these objects; None for any under a law of the container.
    """

    original: ClassVar[str] = "WakeupOnCollisionExit"
    difference: ClassVar[str] = "for each pair; `ContactClear` is for none left"


@dataclass(frozen=True)
class ContactClear(ContactEnd):
    """The last contact of an object ended: it touches nothing any more.

    Parameters
    ----------
    a
        Only this object; None for any under a law of the container.
    """

    difference: ClassVar[str] = "as there: no contact is left; not told of an object that never touched"

    b: Any = field(default=None, init=False, repr=False)


@dataclass(frozen=True)
class _OfRegion(Condition):
    """What conditions of regions share."""

    region: Any
    served_by: ClassVar[str] = "flights"

    def __post_init__(self) -> None:
        from xpheve.regions import Region

        if not isinstance(self.region, Region):
            raise InvalidValueError(
                f"{type(self).__name__}(region={self.region!r}): give a region such as Region(Sphere(1.0), position=(0, 0, 0))"
            )


@dataclass(frozen=True)
class RegionActive(_OfRegion):
    """The volume of an observer meets the region. A level condition.

    Parameters
    ----------
    region
        A `xpheve.Region`.
    """

    original: ClassVar[str] = "WakeupOnActivation"
    difference: ClassVar[str] = "at the exact instant; a level, so it can be negated, and combined with `AllNow`"

    @property
    def is_level(self) -> bool:
        return True


@dataclass(frozen=True)
class RegionInactive(_OfRegion):
    """The volume of no observer meets the region. A level condition, the opposite of `RegionActive`.

    Parameters
    ----------
    region
        A `xpheve.Region`.
    """

    original: ClassVar[str] = "WakeupOnDeactivation"
    difference: ClassVar[str] = "as `RegionActive`"

    @property
    def is_level(self) -> bool:
        return True


@dataclass(frozen=True)
class ObserverEnter(_OfRegion):
    """The centre of an observer comes into the region, at that exact instant.

    Parameters
    ----------
    region
        A `xpheve.Region`.
    """

    original: ClassVar[str] = "WakeupOnViewPlatformEntry"
    difference: ClassVar[str] = "exact instant; ``event.source`` is the observer"


@dataclass(frozen=True)
class ObserverExit(_OfRegion):
    """The centre of an observer leaves the region, at that exact instant.

    Parameters
    ----------
    region
        A `xpheve.Region`.
    """

    original: ClassVar[str] = "WakeupOnViewPlatformExit"
    difference: ClassVar[str] = "exact instant; ``event.source`` is the observer"


@dataclass(frozen=True)
class _OfProbe(_OfRegion):
    """What conditions of probes share."""

    probe: Any = None

    def __post_init__(self) -> None:
        from xpheve.objects import PhysicalObject
        from xpheve.observers import Probe

        super().__post_init__()
        if self.probe is not None and not isinstance(self.probe, (PhysicalObject, Probe)):
            raise InvalidValueError(f"{type(self).__name__}(probe={self.probe!r}): give an object or a Probe")


@dataclass(frozen=True)
class ProbeEnter(_OfProbe):
    """A probe comes into the region: the centre of an object, or a point that the host moves; at that exact instant.

    Parameters
    ----------
    region
        A `xpheve.Region`; its surface belongs to it.
    probe
        An object or a `xpheve.Probe`; None for all objects under a law of the container, and all probes.
    """

    original: ClassVar[str] = "WakeupOnSensorEntry"
    difference: ClassVar[str] = "any object or point may be the sensor; exact instant, from its flight"


@dataclass(frozen=True)
class ProbeExit(_OfProbe):
    """A probe leaves the region, at that exact instant.

    Parameters
    ----------
    region
        A `xpheve.Region`; its surface belongs to it.
    probe
        An object or a `xpheve.Probe`; None for all objects under a law of the container, and all probes.
    """

    original: ClassVar[str] = "WakeupOnSensorExit"
    difference: ClassVar[str] = "any object or point may be the sensor; exact instant, from its flight"


@dataclass(frozen=True)
class Input(Condition):
    """``engine.input(kind, data)`` was called; all inputs of one instant are handed over together, in order.

    Parameters
    ----------
    kind
        The kind waited for, a text such as ``"key"``.
    match
        None for any data; a value that the data equals; or a mapping whose keys the data, a mapping too, has with these values.
    """

    original: ClassVar[str] = "WakeupOnAWTEvent"
    difference: ClassVar[str] = "fed by the host, so it works without a window; at the simulation time of the call"

    kind: str
    match: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str) or not self.kind:
            raise InvalidValueError(f"Input(kind={self.kind!r}): a text such as 'key' is needed")
        if isinstance(self.match, dict):
            object.__setattr__(self, "match", tuple(sorted(self.match.items())))
        try:
            hash(self.match)
        except TypeError:
            raise InvalidValueError(
                f"Input(match={self.match!r}): a plain value, or a mapping of plain values"
            ) from None

    def takes(self, kind: str, data: Any) -> bool:
        """Whether the condition waits for this input."""
        if kind != self.kind or self.match is None:
            return kind == self.kind
        if isinstance(data, dict):
            wanted = self.match if isinstance(self.match, tuple) else ()
            return bool(wanted) and all(key in data and bool(data[key] == value) for key, value in wanted)
        return bool(data == self.match)


@dataclass(frozen=True)
class Paused(Condition):
    """`PhysicsEngine.suspend` was called; told at once, before anything else happens."""


@dataclass(frozen=True)
class Resumed(Condition):
    """`PhysicsEngine.resume` was called; told at once."""


@dataclass(frozen=True)
class Crosses(Condition):
    """An expression of the state of an object goes through zero, at that exact instant of its flight.

    The expression is interpolated along the flight in windows by Chebyshev polynomials of degree 24, each halved until its last
    coefficients are below 1e-11 of the largest; all zeros in a window come from the colleague matrix, and each change of sign is then
    narrowed down on the expression itself to neighbouring floats of time since the flight began.

    What can be missed: two zeros between which the expression stays below 1e-15 of its largest value in the window (about 1e-7 of the
    window's length apart); and what an expression that is not smooth does between the samples. A touch of zero without a change of sign is
    no crossing. A jump over zero, as a velocity makes at an impact, is one.

    Parameters
    ----------
    expression
        Takes what `FieldLaw.force` takes, ``body.position``, ``body.mass``, ``body.time``, columns, and returns one number for each row. It
        is called with one object at many times, so ``body.time`` is an array (n, 1) like the others.
    direction
        1 for upwards only, -1 for downwards only, 0 for both.
    obj
        Only this object; None for all under a law of the container.

    Source: Boyd, SIAM J. Numer. Anal. 40 (2002) 1666 (zeros by Chebyshev expansion); Good, Quart. J. Math. 12 (1961) 61 (colleague matrix).
    """

    expression: Callable[[Any], Any]
    direction: int = 0
    obj: Any = None
    served_by: ClassVar[str] = "flights"

    def __post_init__(self) -> None:
        if not callable(self.expression):
            raise InvalidValueError(f"Crosses(expression={self.expression!r}): a function of a body is needed")
        if self.direction not in (-1, 0, 1) or isinstance(self.direction, bool):
            raise InvalidValueError(f"Crosses(direction={self.direction!r}): choose -1, 0 or 1")
        _check_object(self, "obj")

    def __str__(self) -> str:
        # Not the function's address: listings and ranks are the same in every process.
        name = getattr(self.expression, "__qualname__", type(self.expression).__name__)
        more = f", direction={self.direction}" if self.direction else ""
        return f"Crosses({name}{more}{'' if self.obj is None else f', obj={self.obj!r}'}{', once=True' if self.once else ''})"


@dataclass(frozen=True)
class _OfSleep(Condition):
    """What conditions of sleep share."""

    obj: Any = None
    served_by: ClassVar[str] = "flights"

    def __post_init__(self) -> None:
        _check_object(self, "obj")

    @property
    def is_level(self) -> bool:
        return self.obj is not None


@dataclass(frozen=True)
class Asleep(_OfSleep):
    """An object came to rest: no velocity, no angular velocity, no net force or torque; told at the end of the instant.

    Parameters
    ----------
    obj
        Only this object: a level condition. None for the event, of any object under a law of the container.
    """


@dataclass(frozen=True)
class Awake(_OfSleep):
    """An object at rest began to move, or a net force or torque to act on it; told at the end of the instant.

    Parameters
    ----------
    obj
        Only this object: a level condition. None for the event, of any object under a law of the container.
    """


def _check_object(condition: Condition, name: str) -> None:
    """Raise unless field ``name`` is None or an object."""
    from xpheve.objects import PhysicalObject

    value = getattr(condition, name)
    if value is not None and not isinstance(value, PhysicalObject):
        raise InvalidValueError(f"{type(condition).__name__}({name}={value!r}): a PhysicalObject, or None, is needed")


def _check_law(condition: Any) -> None:
    """Raise unless ``law`` is None, a law, or a name."""
    from xpheve.laws.law import PhysicalLaw

    if condition.law is not None and not isinstance(condition.law, (PhysicalLaw, str)):
        raise InvalidValueError(
            f"{type(condition).__name__}(law={condition.law!r}): a law, its name, or None, is needed"
        )


from xpheve.laws.combinations import AllNow, AllOf, AnyOf, Not  # noqa: E402 : combinations are conditions of these

__all__ = [
    "AllNow",
    "AllOf",
    "AnyOf",
    "Asleep",
    "Awake",
    "Changed",
    "Condition",
    "ContactBegin",
    "ContactClear",
    "ContactEnd",
    "ContactStay",
    "Crosses",
    "Elapsed",
    "ForceExpired",
    "Impact",
    "Input",
    "Not",
    "ObjectAdded",
    "ObjectRemoved",
    "ObserverEnter",
    "ObserverExit",
    "Paused",
    "PoseChanged",
    "Posted",
    "ProbeEnter",
    "ProbeExit",
    "RegionActive",
    "RegionInactive",
    "Resumed",
    "Started",
    "Steps",
]
