"""Movers for the tests of convex bodies."""

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

import xpheve as xp
from xpheve.kernels.quaternion import normalize
from xpheve_laws_collision.narrow_phase import Gap, Mover, family_of

Vector = tuple[float, float, float]
NONE: Vector = (0.0, 0.0, 0.0)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
SHAPES: dict[str, Any] = {
    "sphere": xp.Sphere(0.3),
    "box": xp.Box((1.0, 0.6, 0.4)),
    "plate": xp.Box((1.0, 1.0, 0.01)),
    "capsule": xp.Capsule(0.2, 0.9),
    "hull": xp.Hull(
        [(0.7, 0, 0), (-0.4, 0.5, 0), (-0.3, -0.6, 0.1), (0, 0.1, 0.8), (0.1, -0.1, -0.5), (0.4, 0.4, 0.4)]
    ),
    "prism": xp.Hull(
        [(math.cos(k * math.pi / 3), math.sin(k * math.pi / 3), z) for k in range(6) for z in (-0.2, 0.3)]
    ),
    "compound": xp.Compound([(xp.Sphere(0.2), (0.5, 0, 0)), (xp.Box((1.0, 0.2, 0.2)), (0, 0, 0))]),
}
PLANE = xp.Plane((0, 0, 1))

unit_range = st.floats(-1, 1).map(lambda x: x if abs(x) > 1e-6 else 0.0)
vectors = st.tuples(unit_range, unit_range, unit_range)
quaternions = (
    st.tuples(unit_range, unit_range, unit_range, unit_range).filter(lambda q: math.hypot(*q) > 0.1).map(normalize)
)
kinds = st.sampled_from(sorted(SHAPES))


def body(
    shape: Any,
    position: Any = NONE,
    velocity: Any = NONE,
    acceleration: Any = NONE,
    orientation: Any = UPRIGHT,
    angular_velocity: Any = NONE,
) -> Mover:
    """A mover of mass 1 with the moments of its shape."""
    inertia = shape.inertia(1.0) if shape.kind != "plane" else NONE
    return Mover(
        tuple(map(float, position)),  # type: ignore[arg-type]
        tuple(map(float, velocity)),  # type: ignore[arg-type]
        tuple(map(float, acceleration)),  # type: ignore[arg-type]
        orientation,
        shape,
        tuple(map(float, angular_velocity)),  # type: ignore[arg-type]
        tuple(map(float, inertia)),  # type: ignore[arg-type]
    )


def floor(height: float = 0.0) -> Mover:
    return body(PLANE, (0.0, 0.0, height))


def gap_of(a: Mover, b: Mover) -> Gap:
    """The gap, as seen from ``a``."""
    family, swapped = family_of(a.shape.kind, b.shape.kind)
    if not swapped:
        return family.gap(a, b)
    gap = family.gap(b, a)
    return gap._replace(normal=tuple(-c for c in gap.normal))


def points_of(a: Mover, b: Mover) -> list[Gap]:
    family, swapped = family_of(a.shape.kind, b.shape.kind)
    return family.points(b, a) if swapped else family.points(a, b)


def impact(a: Mover, b: Mover, horizon: float = math.inf) -> float:
    family, swapped = family_of(a.shape.kind, b.shape.kind)
    first, second = (b, a) if swapped else (a, b)
    return family.impact_time(first, second, family.gap(first, second), horizon)


def leave(a: Mover, b: Mover, horizon: float = math.inf) -> float:
    family, swapped = family_of(a.shape.kind, b.shape.kind)
    first, second = (b, a) if swapped else (a, b)
    return family.leave_time(first, second, family.gap(first, second), horizon)


def corners(mover: Mover) -> list[tuple[Any, float]]:
    """By part, its corners (n, 3) in the world and its radius: worked out here, apart from the pack."""
    return _corners(mover.shape, mover.position, mover.orientation)


def _corners(shape: Any, position: Any, orientation: Any) -> list[tuple[Any, float]]:
    w, x, y, z = orientation
    turn = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )

    def placed(points: Any) -> Any:
        return np.asarray(points, dtype=float) @ turn.T + np.array(position)

    if shape.kind == "sphere":
        return [(placed([NONE]), shape.radius)]
    if shape.kind == "capsule":
        return [(placed([(0, 0, -shape.length / 2), (0, 0, shape.length / 2)]), shape.radius)]
    if shape.kind == "box":
        half = np.array(shape.size) / 2
        return [(placed([half * s for s in np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T]), 0.0)]
    if shape.kind == "hull":
        return [(placed(shape.vertices), 0.0)]
    found = []
    for part in shape.parts:
        from xpheve.kernels.quaternion import multiply

        center = turn @ np.array(part.position) + np.array(position)
        found += _corners(part.shape, center, multiply(orientation, part.orientation))
    return found
