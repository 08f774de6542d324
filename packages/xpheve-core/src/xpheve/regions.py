"""Regions of space that wakeup conditions watch: a solid sphere, a box, or a half space, at a pose."""

from __future__ import annotations

from collections.abc import Sequence

from xpheve.errors import InvalidValueError
from xpheve.forces import vector
from xpheve.kernels.quaternion import rotate
from xpheve.objects import quaternion
from xpheve.shapes import Box, Plane, Shape, Sphere

Vec = tuple[float, float, float]


class Region:
    """Space inside ``shape`` at a pose in the world. Immutable; nothing touches it, only conditions see it.

    Parameters
    ----------
    shape
        `xpheve.Sphere`, `xpheve.Box`, or `xpheve.Plane`: the half space behind the plane, where what is solid would lie. The plane
        needs a normal of its own.
    position
        Of the shape's centre [m], shape (3,).
    orientation
        Quaternion (w, x, y, z), shape to world.

    Raises
    ------
    InvalidValueError
        If the shape is of another kind, or a number is not finite.
    """

    __slots__ = ("orientation", "position", "shape")
    shape: Shape
    position: Vec
    orientation: tuple[float, float, float, float]

    def __init__(
        self,
        shape: Shape,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        orientation: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
    ) -> None:
        if not isinstance(shape, (Sphere, Box, Plane)):
            raise InvalidValueError(f"Region: shape = {shape!r}: give a Sphere, a Box or a Plane")
        if isinstance(shape, Plane) and shape.normal is None:
            raise InvalidValueError("Region: the plane needs a normal of its own: Plane(normal=(0, 0, 1))")
        set_ = object.__setattr__
        set_(self, "shape", shape)
        set_(self, "position", vector(position, "Region: position"))
        set_(self, "orientation", quaternion(orientation, "Region: orientation"))

    def __setattr__(self, name: str, value: object) -> None:
        raise InvalidValueError(f"Region.{name} = {value!r}: a region stays as it is; make another")

    @property
    def axes(self) -> tuple[Vec, Vec, Vec]:
        """The shape's own axes, as unit vectors of the world."""
        q = self.orientation
        return rotate(q, (1.0, 0.0, 0.0)), rotate(q, (0.0, 1.0, 0.0)), rotate(q, (0.0, 0.0, 1.0))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Region) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash((self.position, self.orientation))

    def _key(self) -> tuple[object, ...]:
        return self.shape, self.position, self.orientation

    def __repr__(self) -> str:
        turned = "" if self.orientation == (1.0, 0.0, 0.0, 0.0) else f", orientation={self.orientation}"
        return f"Region({self.shape!r}, position={self.position}{turned})"
