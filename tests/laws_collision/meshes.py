"""Meshes for the tests of contacts, and distances worked out triangle by triangle, apart from the pack."""

import math
from typing import Any

import numpy as np

import xpheve as xp

FACES = [
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip
HALF = (2.0, 3.0, 1.0)
"""Half the size of the room."""


def room(scale: float = 1.0) -> xp.Mesh:
    x, y, z = (scale * half for half in HALF)
    return xp.Mesh([(a, b, c) for a in (-x, x) for b in (-y, y) for c in (-z, z)], FACES)


def walls(scale: float = 1.0) -> list[tuple[Any, tuple[float, float, float]]]:
    """The planes of the room, and where they are."""
    found = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            inward = tuple(-sign if k == axis else 0.0 for k in range(3))
            found.append((xp.Plane(inward), tuple(sign * scale * HALF[k] if k == axis else 0.0 for k in range(3))))
    return found


def grid(heights: Any, size: float) -> xp.Mesh:
    """A surface over a square grid, open at its border."""
    n = len(heights)
    places = np.linspace(-size, size, n)
    x, y = np.meshgrid(places, places, indexing="ij")
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return xp.Mesh(np.stack([x, y, np.asarray(heights, dtype=float)], -1).reshape(-1, 3), faces)


def terrain(n: int, scale: float = 1.0, seed: int = 0) -> xp.Mesh:
    """Hills between -2 and 2 over a square from -10 to 10, times ``scale``."""
    rough = np.random.default_rng(seed).uniform(-0.3, 0.3, (n, n))
    x, y = np.meshgrid(np.linspace(-3, 3, n), np.linspace(-4, 4, n), indexing="ij")
    return grid(scale * (1.5 * np.sin(x) * np.cos(y) + rough), 10.0 * scale)


def ball_mesh(rings: int = 8) -> xp.Mesh:
    """A tessellated unit sphere."""
    count = 2 * rings
    places = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    for k in range(1, rings):
        p = math.pi * k / rings
        places += [
            (
                math.sin(p) * math.cos(2 * math.pi * j / count),
                math.sin(p) * math.sin(2 * math.pi * j / count),
                math.cos(p),
            )
            for j in range(count)
        ]
    faces = []
    for j in range(count):
        n = (j + 1) % count
        faces.append((0, 2 + j, 2 + n))
        last = 2 + (rings - 2) * count
        faces.append((1, last + n, last + j))
        for k in range(rings - 2):
            a, b = 2 + k * count, 2 + (k + 1) * count
            faces += [(a + j, b + j, b + n), (a + j, b + n, a + n)]
    return xp.Mesh(places, faces)


def distance(mesh: xp.Mesh, point: Any) -> float:
    """Of a point from the surface, by barycentric coordinates and edges: every triangle is looked at."""
    p = np.asarray(point, dtype=float)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    wu, wv = (w * u).sum(1), (w * v).sum(1)
    area = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    off = w - s[:, None] * u - t[:, None] * v
    best = np.where(inside, np.sqrt((off * off).sum(1)), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        e = end - start
        share = np.clip(((p - start) * e).sum(1) / (e * e).sum(1), 0.0, 1.0)
        off = p - start - share[:, None] * e
        best = np.minimum(best, np.sqrt((off * off).sum(1)))
    return float(best.min())
