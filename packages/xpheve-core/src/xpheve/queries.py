"""What hosts may ask of the objects of a scene, as they stand now: rays, nearest points, overlaps, sweeps; and the answers.

The contract of ``engine.queries``. Core asks for the scene, a pack answers: that whose contact server says how (`ContactServer.queries`).
"""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from xpheve.laws import PhysicalLaw
    from xpheve.objects import PhysicalObject
    from xpheve.shapes.base import Shape

Vec = tuple[float, float, float]
F = TypeVar("F", bound=Callable[..., Any])


class RayHit(NamedTuple):
    """Where a ray comes to an object: way [m] along it, point of the surface [m], unit normal outwards; world frame."""

    object: PhysicalObject
    distance: float
    point: Vec
    normal: Vec


@dataclass(frozen=True)
class RayHits:
    """Where each of n rays comes to its first object.

    ``rows`` (n,) are places in ``engine.objects``, -1 where nothing is hit; ``distances`` (n,) [m], infinite there; ``points`` and
    ``normals`` (n, 3), NaN there. ``objects`` are those of the engine when it was asked.
    """

    rows: NDArray[np.int64]
    distances: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    objects: tuple[PhysicalObject, ...]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, k: int) -> RayHit | None:
        """The hit of ray ``k``, or None."""
        row = int(self.rows[k])
        if row < 0:
            return None
        x, y, z = self.points[k].tolist()
        a, b, c = self.normals[k].tolist()
        return RayHit(self.objects[row], float(self.distances[k]), (x, y, z), (a, b, c))


class SurfacePoint(NamedTuple):
    """The point of an object's surface that is nearest to a place: distance [m], negative inside; unit normal outwards; world frame."""

    object: PhysicalObject
    distance: float
    point: Vec
    normal: Vec


class Separation(NamedTuple):
    """How two objects stand: distance [m], of overlapping ones minus their depth; nearest points of both [m]; unit normal from a to b."""

    distance: float
    point_a: Vec
    point_b: Vec
    normal: Vec


class SweepHit(NamedTuple):
    """What a moved shape comes to first: at which part of its way, where they touch [m], unit normal of the object outwards."""

    object: PhysicalObject
    fraction: float
    point: Vec
    normal: Vec


def asked(method: F) -> F:
    """Mark a method of `Queries`: on a thread that does not hold the scene it waits until the scene stands between two frames."""

    @functools.wraps(method)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        return self.engine.look_at(lambda: method(self, *args, **kwargs))

    return cast(F, call)


Objects = Iterable["PhysicalObject"]
Laws = Iterable["PhysicalLaw | str"]


class Queries(ABC):
    """What hosts may ask of the objects as they stand at the engine's time. Asking changes nothing.

    All methods take the same filters: ``objects``, only these; ``laws``, only what obeys one of these (laws, or their names);
    ``exclude``, not these. Objects without a shape are points. What is inside a plane is behind it.
    """

    def __init__(self, engine: Any) -> None:
        self.engine = engine

    @abstractmethod
    def ray_cast(
        self,
        origin: Sequence[float],
        direction: Sequence[float],
        length: float = math.inf,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> RayHit | None:
        """The first object on the way from ``origin`` [m] along ``direction`` (of any length above 0), at most ``length`` [m] on.

        A ray that begins inside a solid hits it where it begins, with a normal against the ray. One that only grazes, or meets a point, goes by.
        """

    @abstractmethod
    def ray_cast_all(
        self,
        origin: Sequence[float],
        direction: Sequence[float],
        length: float = math.inf,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> tuple[RayHit, ...]:
        """All objects on the way, each where the ray first comes to it, the nearest first."""

    @abstractmethod
    def ray_casts(
        self,
        origins: Any,
        directions: Any,
        length: Any = math.inf,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> RayHits:
        """`ray_cast` of many rays at once: ``origins`` and ``directions`` (n, 3), or (3,) for all; ``length`` one, or (n,)."""

    @abstractmethod
    def closest_point(self, obj: PhysicalObject, point: Sequence[float]) -> SurfacePoint:
        """The point of the surface of ``obj`` that is nearest to ``point`` [m]."""

    @abstractmethod
    def nearest(
        self,
        point: Sequence[float],
        within: float = math.inf,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> SurfacePoint | None:
        """The object whose surface is nearest to ``point``, or that it is deepest in; None if none is ``within`` [m]."""

    @abstractmethod
    def distance(self, a: PhysicalObject, b: PhysicalObject) -> Separation:
        """How far ``a`` and ``b`` are apart, and where they are nearest."""

    @abstractmethod
    def overlap(
        self,
        shape: Shape | None,
        position: Sequence[float],
        orientation: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        margin: float = 0.0,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> tuple[PhysicalObject, ...]:
        """The objects whose distance from ``shape`` (None: a point), standing there, is at most ``margin`` [m]; in the order of ``objects``."""

    @abstractmethod
    def overlaps(
        self,
        margin: float = 0.0,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> tuple[tuple[PhysicalObject, PhysicalObject], ...]:
        """The pairs of objects whose distance is at most ``margin`` [m], in the order of ``engine.objects``."""

    @abstractmethod
    def sweep(
        self,
        shape: Shape | None,
        position: Sequence[float],
        motion: Sequence[float],
        orientation: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        turn: Sequence[float] = (0.0, 0.0, 0.0),
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> SweepHit | None:
        """What ``shape`` comes to first when it is moved from there by ``motion`` [m], straight, turning evenly by the vector ``turn`` [rad].

        What it overlaps at the start is hit there, at fraction 0; what it touches and leaves is not hit.
        """


__all__ = ["Queries", "RayHit", "RayHits", "Separation", "SurfacePoint", "SweepHit", "asked"]
