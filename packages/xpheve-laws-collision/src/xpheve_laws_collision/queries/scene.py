"""The queries of one engine: what hosts ask, checked, filtered and answered from the objects as they stand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError
from xpheve.forces import vector
from xpheve.kernels.vector import Vec
from xpheve.laws import PhysicalLaw
from xpheve.objects import PhysicalObject, quaternion
from xpheve.queries import Laws, Objects, Queries, RayHit, RayHits, Separation, SurfacePoint, SweepHit, asked
from xpheve.shapes.base import Shape
from xpheve_laws_collision.queries import images
from xpheve_laws_collision.queries.casting import cast
from xpheve_laws_collision.queries.meeting import near_pairs, within
from xpheve_laws_collision.queries.moving import Way, first_stop
from xpheve_laws_collision.queries.places import OTHER, Places, Table, plain
from xpheve_laws_collision.queries.rows import Array, Mask, Rows, lengths
from xpheve_laws_collision.queries.separation import separation
from xpheve_laws_collision.queries.surface import Posed, feet
from xpheve_laws_collision.queries.tree import inverses, meets

FEW = 100_000  # pairs of a ray and an object that are looked at without a tree
AT_ONCE = 2048  # rays


class SceneQueries(Queries):
    """See `xpheve.queries.Queries`. Arrays of the objects are made when they are asked for, and kept until time or state moves on."""

    def __init__(self, engine: Any) -> None:
        super().__init__(engine)
        self._table: Table | None = None
        self._key: Any = None
        self._held: Places | None = None

    # The objects

    def _places(self) -> Places:
        world = self.engine._world
        key = (id(world), world.time, world.bodies.change)
        if self._held is None or key != self._key:
            shapes = [obj._shape for obj in world.bodies.objects]
            if self._table is None or self._table.shapes != shapes:
                self._table = Table(shapes, world.up_vector)
            position, orientation = (
                np.ascontiguousarray(world.show_all(name).T) for name in ("position", "orientation")
            )
            self._held, self._key = Places(self._table, position, orientation), key
        return self._held

    @property
    def _objects(self) -> list[PhysicalObject]:
        found: list[PhysicalObject] = self.engine._world.bodies.objects
        return found

    def _mask(self, objects: Objects | None, laws: Laws | None, exclude: Objects) -> Mask:
        """Who is asked for, by row."""
        count = self.engine._world.bodies.count
        mask = np.ones(count, dtype=bool)
        if objects is not None:
            mask[:] = False
            mask[[self._row(obj) for obj in _many(objects)]] = True
        if laws is not None:
            obeying = np.zeros(count, dtype=bool)
            for law in [laws] if isinstance(laws, (str, PhysicalLaw)) else laws:
                members = self.engine.objects_of(self.engine._own_law(law))
                obeying[[obj._row for obj in members]] = True
            mask &= obeying
        mask[[self._row(obj) for obj in _many(exclude)]] = False
        return mask

    def _row(self, obj: PhysicalObject) -> int:
        self.engine._check_own(obj)
        return obj._row

    def _check_images(self, places: Places, rows: Any) -> Any:
        """The box of a periodic scene, in which all of ``rows`` have images; None without one."""
        box = self.engine._world.periodic
        if box is not None:
            images.check(places, rows, self._objects, box)
        return box

    # Rays

    @asked
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
        ray = _rays(vector(origin, "ray_cast: origin"), vector(direction, "ray_cast: direction"), length, "ray_cast")
        return self._cast(ray, self._mask(objects, laws, exclude))[0]

    @asked
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
        what = "ray_cast_all"
        start, along, limit = _rays(
            vector(origin, f"{what}: origin"), vector(direction, f"{what}: direction"), length, what
        )
        _, rows, ways, normals = self._pairs((start, along, limit), self._mask(objects, laws, exclude))
        kept = np.lexsort((rows, ways))
        first: dict[int, RayHit] = {}
        for k in kept.tolist():  # of several images of an object the nearest
            point = _vec(start[0] + ways[k] * along[0])
            first.setdefault(int(rows[k]), RayHit(self._objects[rows[k]], float(ways[k]), point, _vec(normals[k])))
        return tuple(first.values())

    @asked
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
        return self._cast(_rays(origins, directions, length, "ray_casts"), self._mask(objects, laws, exclude))

    def _cast(self, rays: Rays, mask: Mask) -> RayHits:
        """The first hit of each ray; of objects as far away as each other the first in ``engine.objects``."""
        origin, direction, length = rays
        n = len(origin)
        rows, ways = np.full(n, -1, dtype=np.int64), np.full(n, math.inf)
        normals = np.full((n, 3), math.nan)
        for begin in range(0, n, AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            ray, row, way, normal = self._pairs((origin[part], direction[part], length[part]), mask)
            order = np.lexsort((row, way, ray))
            first = order[np.unique(ray[order], return_index=True)[1]]
            at = begin + ray[first]
            rows[at], ways[at], normals[at] = row[first], way[first], normal[first]
        points = np.full((n, 3), math.nan)
        hit = rows >= 0
        points[hit] = origin[hit] + ways[hit, None] * direction[hit]
        for array in (rows, ways, points, normals):
            array.flags.writeable = False
        return RayHits(rows, ways, points, normals, tuple(self._objects))

    def _pairs(self, rays: Rays, mask: Mask) -> tuple[Rows, Rows, Array, Array]:
        """All pairs of a ray and an object that it hits within its length: rays, rows, ways [m], normals."""
        places = self._places()
        origin, direction, length = rays
        parent = np.arange(len(origin))
        box = self._check_images(places, np.flatnonzero(mask))
        if box is not None:
            parent, origin = images.of_rays(places, rays, box)
            direction, length = direction[parent], length[parent]
        ray, row = _candidates(places, origin, direction, length, mask)
        planes = places.planes[mask[places.planes]]
        ray = np.concatenate([ray, np.tile(np.flatnonzero(_first(parent)), len(planes))])
        row = np.concatenate([row, np.repeat(planes, int(_first(parent).sum()))])
        way, normal = cast(places, row, origin[ray], direction[ray])
        hit = (way <= length[ray]) & (way < math.inf)
        return parent[ray[hit]], row[hit], way[hit], normal[hit]

    # Points

    @asked
    def closest_point(self, obj: PhysicalObject, point: Sequence[float]) -> SurfacePoint:
        place = vector(point, "closest_point: point")
        rows = np.array([self._row(obj)])
        return self._foot(rows, place)[0]

    @asked
    def nearest(
        self,
        point: Sequence[float],
        within: float = math.inf,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> SurfacePoint | None:
        place = vector(point, "nearest: point")
        limit = _number(within, "nearest: within")
        places = self._places()
        rows = np.flatnonzero(self._mask(objects, laws, exclude))
        simple = rows[places.kind[rows] != OTHER]
        best = min(self._foot(simple, place), key=lambda one: one.distance, default=None)
        others = rows[places.kind[rows] == OTHER]
        bounds = lengths(places.position[others] - np.array(place)) - places.reach[others]
        for k in np.argsort(bounds, kind="stable").tolist():
            if bounds[k] > (limit if best is None else best.distance):
                break
            found = self._foot(others[k : k + 1], place)[0]
            if best is None or found.distance < best.distance:
                best = found
        return best if best is not None and best.distance <= limit else None

    def _foot(self, rows: Rows, point: Vec) -> list[SurfacePoint]:
        """The nearest points of ``rows``; of many only the nearest of them."""
        places = self._places()
        box = self._check_images(places, rows)
        if box is not None:
            places = images.beside(places, np.array(point), box)
        if not len(rows):
            return []
        distance, foot, normal = feet(places, rows, np.tile(np.array(point), (len(rows), 1)))
        k = int(np.argmin(distance))
        return [SurfacePoint(self._objects[rows[k]], float(distance[k]), _vec(foot[k]), _vec(normal[k]))]

    # Objects and shapes

    @asked
    def distance(self, a: PhysicalObject, b: PhysicalObject) -> Separation:
        rows = np.array([self._row(a), self._row(b)])
        if a is b:
            raise InvalidValueError(f"distance: {a!r} twice; two objects are needed")
        places = self._places()
        box = self._check_images(places, rows)
        if box is not None:
            places = images.beside(places, places.position[rows[0]], box)
        one, two = (Posed(places.shape(row), *places.pose(row)) for row in rows.tolist())
        return separation(one, two)

    @asked
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
        posed = self._posed(shape, position, orientation, "overlap")
        gap = _number(margin, "overlap: margin")
        places = self._places()
        rows = np.flatnonzero(self._mask(objects, laws, exclude))
        box = self._check_images(places, rows)
        if box is not None:
            images.check_shape(posed.shape, box)
            places = images.beside(places, np.array(posed.position), box)
        return tuple(self._objects[row] for row in within(places, rows, posed, gap))

    @asked
    def overlaps(
        self,
        margin: float = 0.0,
        *,
        objects: Objects | None = None,
        laws: Laws | None = None,
        exclude: Objects = (),
    ) -> tuple[tuple[PhysicalObject, PhysicalObject], ...]:
        gap = _number(margin, "overlaps: margin")
        places = self._places()
        rows = np.flatnonzero(self._mask(objects, laws, exclude))
        box = self._check_images(places, rows)
        found = near_pairs(places, rows, gap) if box is None else images.near_pairs(places, rows, gap, box)
        return tuple((self._objects[i], self._objects[j]) for i, j in found)

    @asked
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
        posed = self._posed(shape, position, orientation, "sweep")
        if posed.shape.kind == "plane":
            raise InvalidValueError(
                f"sweep: shape = {shape!r}: a plane has no end, so it cannot move; give a bounded shape"
            )
        way = Way(posed, vector(motion, "sweep: motion"), vector(turn, "sweep: turn"))
        places = self._places()
        rows = np.flatnonzero(self._mask(objects, laws, exclude))
        box = self._check_images(places, rows)
        if box is not None:
            images.check_shape(posed.shape, box)
            places, rows, of = images.of_way(places, rows, way, box)
            found = first_stop(places, rows, way)
            return None if found is None else SweepHit(self._objects[of[found.row]], *found[1:])
        found = first_stop(places, rows, way)
        return None if found is None else SweepHit(self._objects[found.row], *found[1:])

    def _posed(self, shape: Shape | None, position: Any, orientation: Any, what: str) -> Posed:
        if shape is not None and not isinstance(shape, Shape):
            raise InvalidValueError(
                f"{what}: shape = {shape!r} is no shape; give one such as xpheve.Sphere(0.1), or None for a point"
            )
        place, turned = vector(position, f"{what}: position"), quaternion(orientation, f"{what}: orientation")
        return Posed(plain(shape, self.engine._world.up_vector), place, turned)


Rays = tuple[Array, Array, Array]
"""Origins (n, 3) [m], unit vectors (n, 3), lengths (n,) [m]."""


def _candidates(places: Places, origin: Array, direction: Array, length: Array, mask: Mask) -> tuple[Rows, Rows]:
    """Pairs of a ray and a row of bounded objects whose boxes it meets."""
    bounded = places.bounded
    wanted = bounded[mask[bounded]]
    places.asked += len(origin) * len(wanted)
    if places.asked <= FEW:  # else a tree has paid, if not now then with the next rays
        ray, row = np.repeat(np.arange(len(origin)), len(wanted)), np.tile(wanted, len(origin))
        low, high = places.boxes
        hit = meets(origin[ray], inverses(direction)[ray], length[ray], low[row], high[row])
        return ray[hit], row[hit]
    ray, box = places.tree.met_by(origin, direction, length)
    row = bounded[box]
    return ray[mask[row]], row[mask[row]]


def _first(parent: Rows) -> Mask:
    """The first of the rows that have one parent."""
    found = np.ones(len(parent), dtype=bool)
    found[1:] = parent[1:] != parent[:-1]
    return found


def _rays(origins: Any, directions: Any, length: Any, what: str) -> Rays:
    """Rays in arrays. Raises `InvalidValueError` naming the first that is none."""
    origin, direction = _vectors(origins, f"{what}: origin"), _vectors(directions, f"{what}: direction")
    try:
        limit = np.asarray(length, dtype=float)
        n = np.broadcast_shapes(origin.shape[:-1], direction.shape[:-1], limit.shape)
    except (TypeError, ValueError):
        raise InvalidValueError(
            f"{what}: {origin.shape} origins, {direction.shape} directions and length = {length!r}: one for all, or n of each, are needed"
        ) from None
    count = n[0] if n else 1
    origin, direction = (np.ascontiguousarray(np.broadcast_to(one, (count, 3))) for one in (origin, direction))
    limit = np.broadcast_to(limit, (count,))
    wrong = np.flatnonzero(~(limit > 0.0))
    if len(wrong):
        raise InvalidValueError(f"{what}: length = {limit[wrong[0]]}: a length above 0 m is needed")
    largest = np.abs(direction).max(axis=1, initial=0.0)
    wrong = np.flatnonzero(largest == 0.0)
    if len(wrong):
        raise InvalidValueError(f"{what}: direction {wrong[0]} is (0, 0, 0): a direction is needed")
    direction = direction / largest[:, None]
    return origin, direction / lengths(direction)[:, None], limit


def _vectors(values: Any, what: str) -> Array:
    """``values`` as finite vectors, (3,) or (n, 3)."""
    try:
        found = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.ndim not in (1, 2) or found.shape[-1] != 3:
        raise InvalidValueError(f"{what} = {values!r:.80}: three numbers, or rows of three (n, 3), are needed")
    wrong = np.argwhere(~np.isfinite(found))
    if len(wrong):
        raise InvalidValueError(
            f"{what}{list(wrong[0][:-1]) or ''} = {found[tuple(wrong[0][:-1])]}: finite numbers are needed"
        )
    return found


def _number(value: Any, what: str) -> float:
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = math.nan
    if math.isnan(found):
        raise InvalidValueError(f"{what} = {value!r}: a number of metres is needed")
    return found


def _many(objects: Any) -> Iterable[PhysicalObject]:
    """``objects``, or the one that was given alone."""
    return (objects,) if isinstance(objects, PhysicalObject) else objects


def _vec(row: Array) -> Vec:
    x, y, z = row.tolist()
    return x, y, z


__all__ = ["SceneQueries"]
