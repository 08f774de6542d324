"""Triangle mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from xpheve.errors import InvalidValueError
from xpheve.shapes.base import Shape, factors
from xpheve.shapes.polyhedron import (
    Mass,
    Polyhedron,
    check_areas,
    checked_faces,
    checked_vertices,
    is_closed,
    mass_properties,
)


class Mesh(Polyhedron):
    """Any triangle mesh. Closed and wound outwards it is solid; else it is a skin without mass properties.

    Parameters
    ----------
    vertices
        Places [m], shape (n, 3), in a frame of the author's choice; ``mesh.frame`` is that frame's pose in the body frame.
    faces
        Indices of three vertices a triangle, shape (m, 3), anticlockwise seen from outside.
    solid
        ``"hull"`` takes volume and inertia from the convex hull, for meshes with holes; ``"none"`` takes none, so that the
        authored frame is the body frame and a moving object needs ``mass`` and ``inertia``. By default those of the volume
        that the triangles bound, if they bound one.

    Raises
    ------
    InvalidValueError
        For places that are not finite, indices of no vertex, triangles without area, or a closed mesh wound inwards.
    """

    kind: ClassVar[str] = "mesh"
    __slots__ = ("_solid",)

    def __init__(self, vertices: Any, faces: Any, solid: str = "") -> None:
        authored = checked_vertices(vertices, "Mesh.vertices", 3)
        triangles = checked_faces(faces, len(authored), "Mesh.faces")
        check_areas(authored, triangles, "Mesh.faces")
        if solid not in ("", "hull", "none"):
            raise InvalidValueError(f"Mesh.solid = {solid!r}: 'hull' or 'none', or nothing for the volume inside")
        self._solid = solid
        self._set(authored, triangles, self._mass(authored, triangles))

    def _mass(self, vertices: Any, faces: Any) -> Mass | None:
        if self._solid == "none":
            return None
        if self._solid == "hull":
            from xpheve.shapes.hull import Hull

            hull = Hull(vertices[np.unique(faces)])
            return mass_properties(hull.authored_vertices, hull.faces)
        if not is_closed(vertices, faces):
            return None
        found = mass_properties(vertices, faces)
        extent = float(np.ptp(vertices[np.unique(faces)], axis=0).max())
        if abs(found.volume) <= 1e-14 * extent**3:
            return None
        if found.volume < 0.0:
            raise InvalidValueError(
                f"Mesh.faces wind inwards: their volume is {found.volume:.6g} m^3; turn each triangle round, "
                "faces[:, ::-1], or let xpheve.meshes.repaired do it"
            )
        return found

    def _extra(self) -> dict[str, Any]:
        return {"solid": self._solid} if self._solid else {}

    def why_hollow(self) -> str:
        if self._solid == "none":
            why = "was made with solid='none'"
        else:
            why = "is not closed" if not is_closed(self._authored, self.faces) else "encloses nothing"
        return (
            f"{self!r} {why}, so it has no volume: give mass= and inertia= about the origin of its vertices, or take those "
            "of its convex hull, Mesh(vertices, faces, solid='hull'); what never moves needs neither, fixed=True"
        )

    def scaled(self, s: float | Sequence[float]) -> Shape:
        return Mesh(self._authored * np.array(factors(s)), self.faces, self._solid)
