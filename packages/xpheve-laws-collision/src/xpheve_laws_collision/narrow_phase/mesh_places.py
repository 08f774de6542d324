"""Where the surface of a mesh is nearest to the centre of a ball."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels.vector import Vec, add, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.sphere_mesh import Ball, corner_is_nearest, edge_frame, edge_is_nearest, over
from xpheve_laws_collision.narrow_phase.mesh_features import Array, Features, Indices

ONE = 1e-9  # of the radius: contact points this close are one

FACE, EDGE, CORNER = range(3)


class Place(NamedTuple):
    """A point of the surface that is nearer than those around it.

    Kind and number of the feature (of a face, a triangle), distance [m] of the centre, unit vector towards it, the point itself.
    """

    kind: int
    number: int
    distance: float
    outward: Vec
    point: Vec


def nearest_places(features: Features, ball: Ball, x: Vec, within: float) -> list[Place]:
    """The nearest places of the surface to ``x``, and all others within the distance ``within`` [m].

    Faces, then edges, then corners, each in the order of the features. Places at one point are one.
    """
    triangles, distances = _near(features, np.array(x), within + ball.touch, ball.touch)
    limit = max(float(distances.min()), within) + ball.touch
    near = [int(k) for k in np.sort(triangles[distances <= limit])]
    found: list[Place] = []
    planes: set[int] = set()
    for triangle in near:
        plane = int(features.plane[triangle])
        if plane not in planes and over(features, triangle, x, ball.slack):
            planes.add(plane)
            found.append(_on_face(features, triangle, x))
    edges = np.unique(features.sides[near])
    found += [one for k in edges[features.sharp[edges]] if (one := _on_edge(features, int(k), ball, x))]
    corners = np.unique(features.triangles[near])
    found += [one for k in corners[features.pointed[corners]] if (one := _on_corner(features, int(k), ball, x))]
    found = [one for one in found if one.distance <= limit]
    if not found:  # between the tolerances of all of them
        found = [_on_face(features, int(triangles[np.argmin(distances)]), x)]
    return _distinct(found, ONE * ball.radius + 2.0 * ball.slack)


def _distinct(places: list[Place], one: float) -> list[Place]:
    kept: list[Place] = []
    for place in places:
        if all(norm(sub(place.point, other.point)) > one for other in kept):
            kept.append(place)
    return kept


def _on_face(features: Features, triangle: int, x: Vec) -> Place:
    normal = _vec(features.normals[triangle])
    height = dot(normal, x) - float(features.levels[triangle])
    outward = normal if height >= 0.0 else scale(normal, -1.0)
    return Place(FACE, triangle, abs(height), outward, sub(x, scale(normal, height)))


def _on_edge(features: Features, edge: int, ball: Ball, x: Vec) -> Place | None:
    start, e, length = edge_frame(features, edge)
    away = sub(x, start)
    along = dot(e, away)
    if not -ball.slack <= along <= length + ball.slack:
        return None
    away = sub(away, scale(e, along))
    distance = norm(away)
    if distance == 0.0 or not edge_is_nearest(features, edge, away, ball):
        return None
    return Place(EDGE, edge, distance, scale(away, 1.0 / distance), add(start, scale(e, along)))


def _on_corner(features: Features, corner: int, ball: Ball, x: Vec) -> Place | None:
    point = _vec(features.places[corner])
    away = sub(x, point)
    distance = norm(away)
    if distance == 0.0 or not corner_is_nearest(features, corner, away, ball):
        return None
    return Place(CORNER, corner, distance, scale(away, 1.0 / distance), point)


def _near(features: Features, x: Array, within: float, band: float) -> tuple[Indices, Array]:
    """Triangles among which are all that are within ``band`` of the nearest or ``within`` reach, and their distances."""
    bound = np.inf

    def test(lows: Array, highs: Array) -> NDArray[np.bool_]:
        nonlocal bound
        nearest = x - np.clip(x, lows, highs)
        farthest = np.maximum(np.abs(x - lows), np.abs(x - highs))
        # Each box has a triangle in it: the nearest one is no farther than its far corner.
        bound = min(bound, float(np.sqrt((farthest * farthest).sum(axis=1).min(initial=np.inf))))
        passed: NDArray[np.bool_] = np.sqrt((nearest * nearest).sum(axis=1)) <= max(
            bound * (1.0 + 1e-12) + band, within
        )
        return passed

    found = features.within(test)
    return found, distances_to(features.corners[found], x)


def distances_to(corners: Array, x: Array) -> Array:
    """The distances [m] of the point ``x`` from triangles, corners (n, 3, 3)."""
    away = x - corners
    along = np.roll(corners, -1, axis=1) - corners
    share = (away * along).sum(axis=2) / (along * along).sum(axis=2)
    off = away - np.clip(share, 0.0, 1.0)[:, :, None] * along
    border = np.sqrt((off * off).sum(axis=2)).min(axis=1)
    normal = np.cross(along[:, 0], along[:, 1])
    normal /= np.sqrt((normal * normal).sum(axis=1))[:, None]
    inside = ((np.cross(normal[:, None, :], along) * away).sum(axis=2) >= 0.0).all(axis=1)
    height = np.abs((normal * away[:, 0]).sum(axis=1))
    found: Array = np.where(inside, height, border)
    return found


def _vec(row: Array) -> Vec:
    return (float(row[0]), float(row[1]), float(row[2]))
