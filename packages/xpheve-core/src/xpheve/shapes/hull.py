"""Convex polyhedron."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from xpheve.errors import InvalidValueError
from xpheve.shapes.base import Shape, factors
from xpheve.shapes.polyhedron import (
    Array,
    Indices,
    Polyhedron,
    check_areas,
    checked_faces,
    checked_vertices,
    is_closed,
    mass_properties,
)

FLAT = 1e-9
"""A hull thinner than this part of its extent is refused, and vertices may lie this far before a face that is given."""


class Hull(Polyhedron):
    """The solid convex hull of ``points`` (n, 3) [m].

    ``vertices`` are those points that are corners, in the body frame. With ``faces`` given (as files do) the points must be
    the corners already, and the faces convex and outward.

    Raises
    ------
    InvalidValueError
        For points that are not finite, or all in one plane to rounding; for faces that are not convex.
    """

    kind: ClassVar[str] = "hull"
    __slots__ = ()

    def __init__(self, points: Any, faces: Any = None) -> None:
        given = checked_vertices(points, "Hull.points", 4)
        if faces is None:
            vertices, triangles = _hull(given)
        else:
            vertices, triangles = given, checked_faces(faces, len(given), "Hull.faces")
            _check_corners(vertices, triangles)
            _check_convex(vertices, triangles)
        mass = mass_properties(vertices, triangles)
        if not mass.volume > 0.0:
            raise InvalidValueError(f"Hull of {len(given)} points has the volume {mass.volume:.3g} m^3: no solid")
        self._set(vertices, triangles, mass)

    @classmethod
    def _again(cls, vertices: Array, faces: Indices, extra: dict[str, Any]) -> Any:
        return cls(vertices, faces)

    def describe(self) -> dict[str, Any]:
        found = super().describe()
        found["points"] = found.pop("vertices")
        return found

    def scaled(self, s: float | Sequence[float]) -> Shape:
        return Hull(self._authored * np.array(factors(s)), self.faces)


def _hull(points: Array) -> tuple[Array, Indices]:
    """Corners in the order given, and outward triangles: Quickhull (Barber, Dobkin and Huhdanpaa 1996)."""
    from scipy.spatial import ConvexHull, QhullError

    _, first = np.unique(points, axis=0, return_index=True)
    places = points[np.sort(first)]
    extent, middle = _check_thick(places, len(points))
    try:
        found = ConvexHull((places - middle) / extent)
    except QhullError as error:
        raise InvalidValueError(f"Hull of {len(points)} points: {str(error).splitlines()[0]}") from None
    faces = _outward(places, found.simplices.astype(np.int64), found.equations[:, :3])
    corners = np.unique(faces)
    faces = np.searchsorted(corners, faces)
    faces = np.stack([np.roll(face, -int(face.argmin())) for face in faces])
    faces = faces[np.lexsort(faces.T[::-1])]
    return places[corners], faces


def _check_thick(places: Array, count: int) -> tuple[float, Array]:
    """Extent [m] and middle of ``places``; raises `InvalidValueError` if they lie in one plane, to rounding."""
    extent = float(np.ptp(places, axis=0).max())
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    singular = np.linalg.svd((places - middle) / max(extent, 1e-300), compute_uv=False)
    if len(places) < 4 or singular[-1] <= FLAT * singular[0]:
        raise InvalidValueError(f"Hull of {count} points that lie in one plane, to rounding: it has no volume")
    return extent, middle


def _check_corners(vertices: Array, faces: Indices) -> None:
    """Raise `InvalidValueError` unless each vertex is the corner of a face, and of another place than the others."""
    _, first, count = np.unique(vertices, axis=0, return_index=True, return_counts=True)
    stray = np.setdiff1d(np.arange(len(vertices)), faces)
    if len(stray) or (count > 1).any():
        k = int(stray[0]) if len(stray) else int(first[count > 1].min())
        why = "no face has it as a corner" if len(stray) else "another one lies at the same place"
        raise InvalidValueError(
            f"Hull.points: vertex {k} is {vertices[k].tolist()}: {why}; with faces the points are the corners, each once. "
            "Leave the faces out to have them made"
        )


def _outward(places: Array, faces: Indices, normals: Array) -> Indices:
    a, b, c = (places[faces[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * normals).sum(axis=1) < 0.0
    faces = np.where(inward[:, None], faces[:, ::-1], faces)
    if not is_closed(places, faces):
        raise InvalidValueError(
            f"Hull of {len(places)} points that are too close to one another or to one plane for their hull to be told"
        )
    return faces


def _check_convex(vertices: Array, faces: Indices) -> None:
    check_areas(vertices, faces, "Hull.faces")
    if not is_closed(vertices, faces):
        raise InvalidValueError("Hull.faces leave a gap: they do not bound a volume; leave them out to have them made")
    _check_thick(vertices, len(vertices))
    a = vertices[faces[:, 0]]
    normal = np.cross(vertices[faces[:, 1]] - a, vertices[faces[:, 2]] - a)
    normal /= np.sqrt((normal * normal).sum(axis=1))[:, None]
    extent = float(np.ptp(vertices, axis=0).max())
    for n, at in zip(normal, a, strict=True):
        before = float(((vertices - at) * n).sum(axis=1).max())
        if before > FLAT * extent:
            raise InvalidValueError(
                f"Hull.faces are not convex or not outward: a vertex lies {before:.3g} m before one; "
                "leave them out to have them made"
            )
