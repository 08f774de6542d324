"""Solids of triangles: their mass properties in closed form, and what hulls and meshes share."""

from __future__ import annotations

import base64
import hashlib
import math
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import InvalidValueError
from xpheve.kernels.principal_axes import NO_TURN, Rows, principal_axes, to_rows
from xpheve.kernels.quaternion import conjugate, rotate
from xpheve.orientation import NOWHERE, Pose
from xpheve.shapes.base import Shape, Vec

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

INLINE = 512
"""Arrays of up to so many numbers are described as lists; larger ones as base64 of their bytes."""
_BYTES = "base64:"


class Mass(NamedTuple):
    """Volume [m^3], centre of mass [m], and inertia tensor about it for density 1 [m^5]."""

    volume: float
    centre: Vec
    tensor: Rows


def mass_properties(vertices: Array, faces: Indices) -> Mass:
    """Of the solid that closed, outward triangles bound.

    Each triangle spans a tetrahedron with a point near the middle; volume and moments are sums of polynomials of its corners
    (Mirtich 1996; Eberly, Polyhedral Mass Properties Revisited, 2009), exact but for the rounding of each term: the sums are exact.
    """
    corners = vertices[faces]
    middle = 0.5 * (corners.reshape(-1, 3).min(axis=0) + corners.reshape(-1, 3).max(axis=0))
    volume, first, _ = _moments(corners - middle)
    if not volume > 0.0:
        return Mass(volume, (0.0, 0.0, 0.0), ((0.0,) * 3,) * 3)
    centre = middle + np.array(first) / volume
    extent = float(np.abs(corners).max())
    centre[np.abs(centre) <= 1e-15 * extent] = 0.0
    volume, _, second = _moments(corners - centre)
    xx, yy, zz, xy, yz, zx = second
    tensor = ((yy + zz, -xy, -zx), (-xy, zz + xx, -yz), (-zx, -yz, xx + yy))
    x, y, z = centre.tolist()
    return Mass(volume, (x, y, z), tensor)


def _moments(corners: Array) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
    """Volume, its first moments, and the second moments xx, yy, zz, xy, yz, zx, of the tetrahedra with the origin."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    bend = np.stack([b[:, (k + 1) % 3] * c[:, (k + 2) % 3] - b[:, (k + 2) % 3] * c[:, (k + 1) % 3] for k in range(3)])
    six = a[:, 0] * bend[0] + a[:, 1] * bend[1] + a[:, 2] * bend[2]
    total = a + b + c
    first = tuple(math.fsum((six * total[:, k]).tolist()) / 24.0 for k in range(3))
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
    second = tuple(
        math.fsum(
            (six * (total[:, i] * total[:, j] + a[:, i] * a[:, j] + b[:, i] * b[:, j] + c[:, i] * c[:, j])).tolist()
        )
        / 120.0
        for i, j in pairs
    )
    return math.fsum(six.tolist()) / 6.0, first, second


def is_closed(vertices: Array, faces: Indices) -> bool:
    """Whether every edge is passed as often one way as the other: the triangles then bound a volume.

    Corners at the same place count as one.
    """
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    at = same.reshape(-1)[faces]
    edges = np.concatenate([at[:, (0, 1)], at[:, (1, 2)], at[:, (2, 0)]])
    forth = edges[:, 0] * len(vertices) + edges[:, 1]
    back = edges[:, 1] * len(vertices) + edges[:, 0]
    return bool(np.array_equal(np.sort(forth), np.sort(back)))


def checked_vertices(value: Any, what: str, least: int) -> Array:
    """``value`` as finite places, shape (n, 3), n at least ``least``; raises `InvalidValueError`."""
    try:
        found = np.array(_decoded(value, np.float64), dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(f"{what}: places of shape (n, 3) [m] are needed") from None
    if found.ndim != 2 or found.shape[1] != 3 or len(found) < least:
        raise InvalidValueError(f"{what} of shape {found.shape}: places of shape (n, 3) are needed, n at least {least}")
    bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
    if len(bad):
        raise InvalidValueError(f"{what}: vertex {bad[0]} is {found[bad[0]].tolist()}: finite numbers are needed")
    if float(np.abs(found).max()) > 1e50:
        raise InvalidValueError(f"{what}: coordinates above 1e50 m overflow in the moments of inertia")
    return found + 0.0


def checked_faces(value: Any, count: int, what: str) -> Indices:
    """``value`` as triangles of indices below ``count``, shape (m, 3); raises `InvalidValueError`."""
    try:
        given = np.array(_decoded(value, np.int64))
        if given.size and given.dtype.kind not in "iu":
            raise ValueError
        found = given.astype(np.int64)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(
            f"{what}: whole numbers of shape (m, 3) are needed, three vertices a triangle"
        ) from None
    if found.ndim != 2 or found.shape[1] != 3 or not len(found):
        raise InvalidValueError(f"{what} of shape {found.shape}: triangles of shape (m, 3) are needed, m at least 1")
    bad = np.flatnonzero(((found < 0) | (found >= count)).any(axis=1))
    if len(bad):
        raise InvalidValueError(
            f"{what}: triangle {bad[0]} is {found[bad[0]].tolist()}, yet there are {count} vertices"
        )
    return found


def check_areas(vertices: Array, faces: Indices, what: str) -> None:
    """Raise `InvalidValueError` for a triangle without an area."""
    flat = np.flatnonzero(~(doubled_areas(vertices, faces) > 0.0))
    if len(flat):
        raise InvalidValueError(
            f"{what}: triangle {flat[0]}, {faces[flat[0]].tolist()}, has no area ({len(flat)} such); leave them out, "
            "or let xpheve.meshes.repaired do it"
        )


def doubled_areas(vertices: Array, faces: Indices) -> Array:
    """Twice the area [m^2] of each triangle, shape (m,)."""
    a = vertices[faces[:, 0]]
    normal = np.cross(vertices[faces[:, 1]] - a, vertices[faces[:, 2]] - a)
    found: Array = np.sqrt((normal * normal).sum(axis=1))
    return found


def body_frame(centre: Vec, tensor: Rows) -> tuple[Vec, Pose]:
    """Principal values of ``tensor``, and the pose of the authored frame in the frame of the centre and principal axes."""
    values, turn = principal_axes(tensor)
    back = conjugate(turn)
    x, y, z = rotate(back, centre)
    return values, ((0.0 - x, 0.0 - y, 0.0 - z), NO_TURN if turn == NO_TURN else back)


def in_body(vertices: Array, centre: Vec, frame: Pose) -> Array:
    """Authored ``vertices`` in the body frame; their very bits where that is the authored one."""
    moved = vertices - np.array(centre) if any(centre) else vertices
    if frame[1] == NO_TURN:
        return moved.copy()
    rows = to_rows(frame[1])
    return np.stack([moved[:, 0] * r[0] + moved[:, 1] * r[1] + moved[:, 2] * r[2] for r in rows], axis=1)


def described(array: NDArray[Any]) -> Any:
    """``array`` as plain values: a list, or text if it is large."""
    if array.size <= INLINE:
        return array.tolist()
    little = array.astype("<f8" if array.dtype.kind == "f" else "<i8")
    return _BYTES + base64.b64encode(little.tobytes()).decode("ascii")


def _decoded(value: Any, kind: Any) -> Any:
    """What `described` gave, as numbers; anything else as it is."""
    if not isinstance(value, str):
        return value
    if not value.startswith(_BYTES):
        raise ValueError
    data = base64.b64decode(value.removeprefix(_BYTES), validate=True)
    if len(data) % 24:
        raise ValueError
    return np.frombuffer(data, dtype="<f8" if kind is np.float64 else "<i8").reshape(-1, 3)


class Polyhedron(Shape):
    """A shape of triangles. ``vertices`` (n, 3) [m] are in the body frame; ``faces`` (m, 3) wind anticlockwise seen from outside."""

    __slots__ = ("_authored", "_digest", "_frame", "_moments", "_reach", "_volume", "faces", "vertices")
    kind: ClassVar[str] = ""

    vertices: Array
    faces: Indices

    def _set(self, authored: Array, faces: Indices, mass: Mass | None) -> None:
        """Fill in what follows from the authored vertices; without ``mass`` the authored frame is the body frame."""
        self._frame: Pose = NOWHERE
        self._moments: Vec | None = None
        self._volume = 0.0 if mass is None else mass.volume
        centre = (0.0, 0.0, 0.0)
        if mass is not None:
            centre = mass.centre
            (a, b, c), self._frame = body_frame(centre, mass.tensor)
            self._moments = (a / mass.volume, b / mass.volume, c / mass.volume)
        self._authored = authored
        self.vertices = in_body(authored, centre, self._frame)
        self.faces = faces
        used = self.vertices[np.unique(faces)]
        self._reach = math.sqrt(float((used * used).sum(axis=1).max()))
        digest = hashlib.sha256(repr(self._extra()).encode())
        digest.update(authored.astype("<f8").tobytes())
        digest.update(faces.astype("<i8").tobytes())
        self._digest = digest.hexdigest()
        for array in (self._authored, self.vertices, self.faces):
            array.flags.writeable = False

    def _extra(self) -> dict[str, Any]:
        """Parameters besides vertices and faces."""
        return {}

    @property
    def solid(self) -> bool:
        return self._moments is not None

    @property
    def frame(self) -> Pose:
        return self._frame

    @property
    def authored_vertices(self) -> Array:
        """The vertices as they were given, shape (n, 3) [m]."""
        return self._authored

    @property
    def volume(self) -> float:
        return self._volume

    @property
    def reach(self) -> float:
        return self._reach

    def reach_from(self, point: Vec) -> float:
        away = self.vertices[np.unique(self.faces)] - np.array(point)
        return math.sqrt(float((away * away).sum(axis=1).max()))

    def inertia(self, mass: float) -> Vec:
        if self._moments is None:
            raise InvalidValueError(self.why_hollow())
        a, b, c = self._moments
        return mass * a, mass * b, mass * c

    def describe(self) -> dict[str, Any]:
        return {
            "kind": self.kind,
            "vertices": described(self._authored),
            "faces": described(self.faces),
            **self._extra(),
        }

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and isinstance(other, Polyhedron) and other._digest == self._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self.vertices)} vertices, {len(self.faces)} faces, #{self._digest[:16]})"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self)._again, (self._authored, self.faces, self._extra())

    @classmethod
    def _again(cls, vertices: Array, faces: Indices, extra: dict[str, Any]) -> Any:
        return cls(vertices, faces, **extra)  # type: ignore[call-arg]
