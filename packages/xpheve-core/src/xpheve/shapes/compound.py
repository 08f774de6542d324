"""Several shapes that move as one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

from xpheve.errors import InvalidValueError
from xpheve.kernels.principal_axes import Rows, to_rows
from xpheve.kernels.quaternion import conjugate, rotate
from xpheve.orientation import NOWHERE, Pose, Quat, compose, from_pose, inverse, unit
from xpheve.shapes.base import Shape, Vec, one_factor, positive
from xpheve.shapes.polyhedron import body_frame


class Part:
    """A shape and where it is in a compound. Immutable.

    Parameters
    ----------
    shape
        Any bounded shape, another compound included.
    position, orientation
        Of the shape's centre of mass [m] and principal axes (w, x, y, z), as an object's.
    density
        [kg/m^3]; given for all parts of a compound or for none.
    pose
        Instead of the two, the matrix (4, 4) of the frame in which the shape was authored.
    """

    __slots__ = ("density", "orientation", "position", "shape")

    def __init__(
        self,
        shape: Shape,
        position: Sequence[float] = NOWHERE[0],
        orientation: Sequence[float] = NOWHERE[1],
        density: float | None = None,
        *,
        pose: Any = None,
    ) -> None:
        if not isinstance(shape, Shape):
            raise InvalidValueError(f"Part.shape = {shape!r} is no shape; give one such as xpheve.Sphere(0.1)")
        if math.isinf(shape.reach):
            raise InvalidValueError(
                f"Part.shape = {shape!r}: a {shape.kind} has no end, so it is part of nothing; make it an object of its own"
            )
        self.shape = shape
        try:
            x, y, z = (float(component) for component in position)
        except (TypeError, ValueError):
            raise InvalidValueError(f"Part.position = {position!r}: three numbers [m] are needed") from None
        if not all(map(math.isfinite, (x, y, z))):
            raise InvalidValueError(f"Part.position = {(x, y, z)}: finite numbers [m] are needed")
        self.position: Vec = (x, y, z)
        self.orientation: Quat = unit(orientation, "Part.orientation")
        if pose is not None:
            if self._pose != NOWHERE:
                raise InvalidValueError("Part: pose= and position= or orientation=: give one of them")
            self.position, self.orientation = compose(from_pose(pose, "Part.pose"), inverse(shape.frame))
        self.density = None if density is None else positive(density, "Part.density", "density", "kg/m^3")

    @property
    def _pose(self) -> Pose:
        return self.position, self.orientation

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Part) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[Any, ...]:
        return self.shape, self.position, self.orientation, self.density

    def __repr__(self) -> str:
        density = "" if self.density is None else f", density={self.density!r}"
        return f"Part({self.shape!r}, {self.position}, {self.orientation}{density})"


class Compound(Shape):
    """Any number of shapes moving as one, such as the body, doors and wheels of a car.

    Parts that overlap count twice. Compounds in compounds are taken apart, so that ``parts`` holds plain shapes only.

    Parameters
    ----------
    parts
        Each a `Part`, or (shape, position, orientation, density) with the last ones left out, or (shape, 4x4 matrix).
        All in one frame of the author's choice; ``compound.frame`` is its pose in the body frame.

    Raises
    ------
    InvalidValueError
        If there are no parts, one has no end (a plane), or some have a density and others have none.
    """

    kind: ClassVar[str] = "compound"
    __slots__ = ("_authored", "_frame", "_mass", "_moments", "_reach", "_repr", "_volume", "parts")

    def __init__(self, parts: Iterable[Any]) -> None:
        try:
            given = tuple(parts)
        except TypeError:
            raise InvalidValueError(f"Compound: parts = {parts!r}: a list of parts is needed") from None
        flat = tuple(leaf for k, part in enumerate(given) for leaf in _leaves(_part(part, k)))
        if not flat:
            raise InvalidValueError("Compound: no parts; give at least one shape")
        dense = [part for part in flat if part.density is not None]
        if dense and len(dense) != len(flat):
            hollow = next(part for part in flat if part.density is None)
            raise InvalidValueError(
                f"Compound: {hollow!r} has no density, yet others have; give it to all parts or none"
            )
        self._authored = flat
        self._volume = math.fsum(part.shape.volume for part in flat)
        weights = [part.shape.volume * (part.density or 1.0) for part in flat]
        self._mass = math.fsum(weights) if dense else None
        self._frame: Pose = NOWHERE
        self._moments: Vec | None = None
        if all(part.shape.solid for part in flat):
            self._moments, self._frame = _balance(flat, weights)
        self.parts: tuple[Part, ...] = tuple(
            part if self._frame == NOWHERE else Part(part.shape, *compose(self._frame, part._pose), part.density)
            for part in flat
        )
        self._reach = max(part.shape.reach_from(inverse((part.position, part.orientation))[0]) for part in self.parts)
        self._repr = f"Compound({list(flat)!r})"

    @property
    def solid(self) -> bool:
        return self._moments is not None

    def why_hollow(self) -> str:
        return next(part.shape.why_hollow() for part in self._authored if not part.shape.solid)

    @property
    def frame(self) -> Pose:
        return self._frame

    @property
    def mass(self) -> float | None:
        return self._mass

    @property
    def authored_parts(self) -> tuple[Part, ...]:
        """The parts, nested ones taken apart, in the frame they were given in."""
        return self._authored

    @property
    def volume(self) -> float:
        return self._volume

    @property
    def reach(self) -> float:
        return self._reach

    def reach_from(self, point: Vec) -> float:
        x, y, z = point
        away: list[float] = []
        for part in self.parts:
            offset = (x - part.position[0], y - part.position[1], z - part.position[2])
            away.append(part.shape.reach_from(rotate(conjugate(part.orientation), offset)))
        return max(away)

    def inertia(self, mass: float) -> Vec:
        if self._moments is None:
            raise InvalidValueError(self.why_hollow())
        a, b, c = self._moments
        return mass * a, mass * b, mass * c

    def scaled(self, s: float | Sequence[float]) -> Shape:
        size = one_factor(s, self.kind)
        return Compound(
            Part(
                part.shape.scaled(size),
                (size * part.position[0], size * part.position[1], size * part.position[2]),
                part.orientation,
                part.density,
            )
            for part in self._authored
        )

    def describe(self) -> dict[str, Any]:
        return {"kind": self.kind, "parts": [_described(part) for part in self._authored]}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Compound) and other._authored == self._authored

    def __hash__(self) -> int:
        return hash(self._repr)

    def __repr__(self) -> str:
        return self._repr

    def __reduce__(self) -> tuple[Any, ...]:
        return Compound, (self._authored,)


def _part(given: Any, k: int) -> Part:
    if isinstance(given, Part):
        return given
    if isinstance(given, Shape):
        return Part(given)
    try:
        values = tuple(given)
        if len(values) >= 2 and getattr(values[1], "shape", None) == (4, 4):
            return Part(values[0], pose=values[1], density=values[2] if len(values) > 2 else None)
        return Part(*values)
    except TypeError:
        raise InvalidValueError(
            f"Compound: part {k} is {given!r}: a Part, or (shape, position, orientation, density), is needed"
        ) from None


def _leaves(part: Part) -> list[Part]:
    """The plain shapes of a part, in the frame of the part."""
    if not isinstance(part.shape, Compound):
        return [part]
    inner = part.shape.parts
    if part.density is not None:
        if part.shape.mass is not None:
            raise InvalidValueError(f"{part!r}: its own parts have densities already; give one or the other")
        density = part.density
        return [Part(leaf.shape, *compose(part._pose, leaf._pose), density) for leaf in inner]
    return [Part(leaf.shape, *compose(part._pose, leaf._pose), leaf.density) for leaf in inner]


def _balance(parts: Sequence[Part], weights: Sequence[float]) -> tuple[Vec, Pose]:
    """Principal moments for mass 1, and the pose of the authored frame: parallel axes, part by part (Steiner)."""
    total = math.fsum(weights)
    centre = [
        math.fsum(weight * part.position[k] for part, weight in zip(parts, weights, strict=True)) / total
        for k in range(3)
    ]
    extent = max(math.hypot(*part.position) + part.shape.reach for part in parts)
    x, y, z = (0.0 if abs(component) <= 1e-15 * extent else component for component in centre)
    terms = [_tensor(part, weight / total, (x, y, z)) for part, weight in zip(parts, weights, strict=True)]
    rows = [[math.fsum(term[i][j] for term in terms) for j in range(3)] for i in range(3)]
    a, b, c = ((row[0], row[1], row[2]) for row in rows)
    return body_frame((x, y, z), (a, b, c))


def _tensor(part: Part, mass: float, about: Vec) -> Rows:
    """Inertia tensor of one part about a point, along the axes in which the part is placed."""
    moments = part.shape.inertia(mass)
    turn = to_rows(part.orientation)
    d = (part.position[0] - about[0], part.position[1] - about[1], part.position[2] - about[2])
    square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]

    def element(i: int, j: int) -> float:
        own = turn[i][0] * moments[0] * turn[j][0] + turn[i][1] * moments[1] * turn[j][1]
        own += turn[i][2] * moments[2] * turn[j][2]
        return own + mass * ((square if i == j else 0.0) - d[i] * d[j])

    a, b, c = (tuple(element(*sorted((i, j))) for j in range(3)) for i in range(3))
    return (a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2])


def _described(part: Part) -> dict[str, Any]:
    found: dict[str, Any] = {"shape": part.shape.describe(), "position": list(part.position)}
    if part.orientation != NOWHERE[1]:
        found["orientation"] = list(part.orientation)
    if part.density is not None:
        found["density"] = part.density
    return found
