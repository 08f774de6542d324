"""Conditions of space: observers and probes in regions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.laws.conditions.base import Condition


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


__all__ = ["ObserverEnter", "ObserverExit", "ProbeEnter", "ProbeExit", "RegionActive", "RegionInactive"]
