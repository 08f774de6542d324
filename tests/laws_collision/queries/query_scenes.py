"""Scenes for the tests of queries, and answers found by looking at many points."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.kernels.quaternion import multiply, normalize, rotate
from xpheve.orientation import from_axis_angle

CUBE = [(x, y, z) for x in (-0.4, 0.4) for y in (-0.3, 0.3) for z in (-0.5, 0.5)]
FACES = [
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip
SHAPES: dict[str, Any] = {
    "sphere": xp.Sphere(0.3),
    "box": xp.Box((1.0, 0.6, 0.4)),
    "capsule": xp.Capsule(0.2, 0.9),
    "hull": xp.Hull(
        [(0.7, 0, 0), (-0.4, 0.5, 0), (-0.3, -0.6, 0.1), (0, 0.1, 0.8), (0.1, -0.1, -0.5), (0.4, 0.4, 0.4)]
    ),
    "compound": xp.Compound([(xp.Sphere(0.2), (0.5, 0, 0)), (xp.Box((1.0, 0.2, 0.2)), (0, 0, 0))]),
    "mesh": xp.Mesh(CUBE, FACES),
    "plane": xp.Plane((0.0, 0.6, 0.8), 0.1),
}
SOLID = sorted(SHAPES.keys() - {"mesh", "plane"})
BOUNDED = sorted(SHAPES.keys() - {"plane"})

few = settings(max_examples=25)
unit = st.floats(-1, 1).map(lambda x: x if abs(x) > 1e-6 else 0.0)
vectors = st.tuples(unit, unit, unit)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 0.1)
quaternions = st.tuples(unit, unit, unit, unit).filter(lambda q: np.linalg.norm(q) > 0.1).map(normalize)


def scene(*placed: tuple[Any, Any, Any]) -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """An engine with fixed objects of the shapes at their positions and orientations."""
    engine = xp.PhysicsEngine(up="z")
    objects = [xp.PhysicalObject(shape, position=x, orientation=q, fixed=True) for shape, x, q in placed]
    return engine, list(engine.add_objects(objects))


def crowd(seed: int, count: int, size: float = 3.0, kinds: list[str] = SOLID) -> Any:
    """A scene of ``count`` bodies of ``kinds``, anywhere in a cube of half edge ``size``, turned anyhow."""
    rng = np.random.default_rng(seed)
    turns = rng.normal(size=(count, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    names = rng.choice(kinds, count)
    places = rng.uniform(-size, size, (count, 3))
    return scene(*((SHAPES[name], x, q) for name, x, q in zip(names, places.tolist(), turns.tolist(), strict=True)))


def moved(x: Any, q: Any, shift: Any, turn: Any) -> tuple[Any, Any]:
    """A pose after the whole world was turned and shifted."""
    return tuple(a + b for a, b in zip(rotate(turn, x), shift, strict=True)), normalize(multiply(turn, q))


def pose_along(x: Any, q: Any, motion: Any, turn: Any, part: float) -> tuple[Any, Any]:
    """Where a shape is at a part of its way."""
    angle = float(np.linalg.norm(turn))
    there = tuple(a + part * b for a, b in zip(x, motion, strict=True))
    return there, q if angle == 0.0 else normalize(multiply(from_axis_angle(turn, part * angle), q))
