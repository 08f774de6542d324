"""Distance of two convex point sets: Gilbert, Johnson & Keerthi (IEEE J. Robot. Autom. 4 (1988) 193).

The point of a simplex nearest to the origin is found by signed volumes (Montanari, Petrinic & Barbieri, ACM Trans. Graph.
36 (2017) 30): which part of the simplex it lies on is decided before anything is divided, so that the search ends on
the nearest vertices, edges or faces themselves, and the distance is right to a few roundings of the sizes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from xpheve.kernels.vector import add, cross, dot, norm, scale, sub
from xpheve_laws_collision.narrow_phase import Vec
from xpheve_laws_collision.narrow_phase.cores import Array

ROUNDS = 200  # in exact arithmetic it ends; by rounding it may circle among vertices that serve as well
NOISE = 16.0 * 2.0**-52

Weights = list[tuple[int, float]]


class Nearest(NamedTuple):
    """Nearest points of two point sets: distance [m], unit vector from a to b, the two points, how many corners they rest on."""

    distance: float
    normal: Vec
    on_a: Vec
    on_b: Vec
    corners: int


def nearest(a: Array, b: Array, size: float) -> Nearest | None:
    """Nearest points of the hulls of ``a`` (n, 3) and ``b`` (m, 3); None where they overlap, to rounding of ``size``."""
    points: list[Vec] = []
    pairs: list[tuple[int, int]] = []
    direction = np.asarray(b.mean(axis=0) - a.mean(axis=0))
    best: tuple[float, Vec, list[tuple[int, int]], Weights, list[Vec]] | None = None
    for _ in range(ROUNDS):
        pair = int(np.argmax(a @ direction)), int(np.argmin(b @ direction))
        new = _difference(a, b, pair)
        if best is not None:
            v = best[1]
            if pair in pairs or dot(v, sub(v, new)) <= NOISE * best[0] * max(best[0], 1e-3 * size):
                break
        pairs.append(pair)
        points.append(new)
        weights = nearest_in_simplex(points)
        points = [points[k] for k, _ in weights]
        pairs = [pairs[k] for k, _ in weights]
        v = _combined(points, weights)
        length = norm(v)
        if len(points) == 4 or length <= NOISE * size:
            return None
        if best is not None and length >= best[0]:
            break
        best = (length, v, list(pairs), [(k, w) for k, (_, w) in enumerate(weights)], list(points))
        direction = np.array(scale(v, 1.0 / length))
    assert best is not None
    return _result(a, b, best)


def _result(a: Array, b: Array, best: tuple[float, Vec, list[tuple[int, int]], Weights, list[Vec]]) -> Nearest:
    length, v, pairs, weights, points = best
    on_a = _combined([_vec(a[i]) for i, _ in pairs], weights)
    on_b = _combined([_vec(b[j]) for _, j in pairs], weights)
    normal = scale(v, 1.0 / length)
    if len(points) == 3:
        # The normal of the triangle of differences: right even where v itself is all rounding.
        n = cross(sub(points[1], points[0]), sub(points[2], points[0]))
        across = norm(n)
        if across > 1e-9 * norm(sub(points[1], points[0])) * norm(sub(points[2], points[0])):
            n = scale(n, (1.0 if dot(n, v) > 0.0 else -1.0) / across)
            normal, length = n, dot(n, points[0])
    return Nearest(length, normal, on_a, on_b, len(points))


def _vec(row: Array) -> Vec:
    return (float(row[0]), float(row[1]), float(row[2]))


def _difference(a: Array, b: Array, pair: tuple[int, int]) -> Vec:
    return _vec(b[pair[1]] - a[pair[0]])


def _combined(points: list[Vec], weights: Weights) -> Vec:
    total: Vec = (0.0, 0.0, 0.0)
    for point, (_, weight) in zip(points, weights, strict=True):
        total = add(total, scale(point, weight))
    return total


def nearest_in_simplex(s: list[Vec]) -> Weights:
    """The corners that the point nearest to the origin lies between, with their weights."""
    indices = list(range(len(s)))
    if len(s) == 1:
        return [(0, 1.0)]
    if len(s) == 2:
        return _on_edge(s, indices)
    if len(s) == 3:
        return _on_triangle(s, indices)
    return _in_tetrahedron(s, indices)


def _distance(s: list[Vec], weights: Weights) -> float:
    return norm(_combined([s[k] for k, _ in weights], weights))


def _on_edge(s: list[Vec], at: list[int]) -> Weights:
    p, q = s[at[0]], s[at[1]]
    along = sub(q, p)
    square = dot(along, along)
    if square == 0.0:
        return [(at[0], 1.0)]
    part = -dot(p, along)
    if part <= 0.0:
        return [(at[0], 1.0)]
    rest = dot(q, along)
    if rest <= 0.0:
        return [(at[1], 1.0)]
    return [(at[0], rest / (part + rest)), (at[1], part / (part + rest))]


def _least(s: list[Vec], found: list[Weights]) -> Weights:
    best, least = found[0], math.inf
    for weights in found:
        distance = _distance(s, weights)
        if distance < least:
            best, least = weights, distance
    return best


def _on_triangle(s: list[Vec], at: list[int]) -> Weights:
    p, q, r = (s[k] for k in at)
    n = cross(sub(q, p), sub(r, p))
    square = dot(n, n)
    edges = [[at[1], at[2]], [at[2], at[0]], [at[0], at[1]]]
    if square == 0.0:
        return _least(s, [_on_edge(s, edge) for edge in edges])
    foot = scale(n, dot(p, n) / square)
    k = max(range(3), key=lambda axis: abs(n[axis]))
    i, j = (k + 1) % 3, (k + 2) % 3
    corners = [(c[i] - foot[i], c[j] - foot[j]) for c in (p, q, r)]
    areas = [
        corners[1][0] * corners[2][1] - corners[1][1] * corners[2][0],
        corners[2][0] * corners[0][1] - corners[2][1] * corners[0][0],
        corners[0][0] * corners[1][1] - corners[0][1] * corners[1][0],
    ]
    whole = n[k]
    if all(area * whole > 0.0 for area in areas):
        total = areas[0] + areas[1] + areas[2]
        return [(index, area / total) for index, area in zip(at, areas, strict=True)]
    out = [edge for edge, area in zip(edges, areas, strict=True) if not area * whole > 0.0]
    return _least(s, [_on_edge(s, edge) for edge in out])


def _in_tetrahedron(s: list[Vec], at: list[int]) -> Weights:
    p, q, r, t = (s[k] for k in at)
    volumes = [
        dot(q, cross(r, t)),
        -dot(p, cross(r, t)),
        dot(p, cross(q, t)),
        -dot(p, cross(q, r)),
    ]
    whole = dot(sub(q, p), cross(sub(r, p), sub(t, p)))
    if whole != 0.0 and all(volume * whole > 0.0 for volume in volumes):
        total = sum(volumes)
        return [(index, volume / total) for index, volume in zip(at, volumes, strict=True)]
    faces = [[at[1], at[2], at[3]], [at[0], at[2], at[3]], [at[0], at[1], at[3]], [at[0], at[1], at[2]]]
    out = [face for face, volume in zip(faces, volumes, strict=True) if not volume * whole > 0.0]
    return _least(s, [_on_triangle(s, face) for face in out])
