"""Where two cores touch: the corners of what their touching faces, edges or corners have in common.

Seen along the normal, the touching features are polygons, segments or points; a face is cut by the sides of the other one
(Sutherland & Hodgman, Commun. ACM 17 (1974) 32).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from xpheve.errors import ContactError
from xpheve_laws_collision.narrow_phase import Vec
from xpheve_laws_collision.narrow_phase.cores import Array, Half

if TYPE_CHECKING:
    from xpheve_laws_collision.narrow_phase.standing import Standing

Flat = tuple[float, float]
SAME = 1e-9  # of the sizes: contact points this close are one; a feature may lean by this much


def common_points(s: Standing) -> list[tuple[Vec, float]]:
    """Contact points about a's centre (halfway between the surfaces) and the separation [m] at each; at least one."""
    n = s.axis.normal
    level = SAME * s.size
    heights = s.corners_a @ n
    top = np.flatnonzero(heights >= heights.max() - level)
    if isinstance(s.core_b, Half):
        plane = float(s.corners_b[0] @ n) + float(np.array(s.moved) @ n)
        return [_between(s.corners_a[k], n, plane - float(heights[k]), s.core_a.radius, 0.0) for k in top]
    corners_b = s.corners_b + np.array(s.moved)
    depths = corners_b @ n
    low = np.flatnonzero(depths <= depths.min() + level)
    if not (len(top) and len(low)):
        raise ContactError(
            f"bodies {math.hypot(*s.moved):.3g} m apart, of sizes about {s.size:.3g} m: no float holds where they touch; "
            "bring them nearer to one another and to the origin"
        )
    u, v = _across(n)
    feature_a = _outline([(float(p @ u), float(p @ v), float(p @ n)) for p in s.corners_a[top]], level)
    feature_b = _outline([(float(p @ u), float(p @ v), float(p @ n)) for p in corners_b[low]], level)
    radius_a, radius_b = s.core_a.radius, s.core_b.radius
    found: list[tuple[Vec, float]] = []
    for x, y in _distinct(_meeting(feature_a, feature_b, level), level):
        below, above = _height(feature_a, x, y), _height(feature_b, x, y)
        found.append(_between(x * u + y * v + below * n, n, above - below, radius_a, radius_b))
    if found:
        return found
    if s.witness is not None:
        return [_between(np.array(s.witness), n, s.axis.distance, radius_a, radius_b)]
    x, y = _nearest_of_outlines(feature_a, feature_b)
    return [_between(x * u + y * v + float(heights.max()) * n, n, s.axis.distance, radius_a, radius_b)]


def _between(core_point: Array, n: Array, distance: float, radius_a: float, radius_b: float) -> tuple[Vec, float]:
    separation = distance - radius_a - radius_b
    p = core_point + (radius_a + 0.5 * separation) * n
    return (float(p[0]), float(p[1]), float(p[2])), separation


def _across(n: Array) -> tuple[Array, Array]:
    u = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    u = u / np.linalg.norm(u)
    return u, np.cross(n, u)


Corner = tuple[float, float, float]


def _outline(corners: list[Corner], level: float) -> list[Corner]:
    """The convex outline seen along the normal, counter-clockwise: one corner, two, or more."""
    order = sorted(corners)
    if len(order) < 3:
        return order

    def chain(points: list[Corner]) -> list[Corner]:
        found: list[Corner] = []
        for p in points:
            while len(found) >= 2 and _left(found[-2], found[-1], p) <= level * math.dist(found[-2][:2], p[:2]):
                found.pop()
            found.append(p)
        return found[:-1]

    return chain(order) + chain(order[::-1])


def _left(a: Corner | Flat, b: Corner | Flat, c: Corner | Flat) -> float:
    """Twice the area of the triangle; above 0 where c is left of a to b."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _meeting(a: list[Corner], b: list[Corner], level: float) -> list[Flat]:
    """Corners of the common part of two outlines."""
    if len(a) == 1:
        return [a[0][:2]]
    if len(b) == 1:
        return [b[0][:2]]
    if len(b) > 2:
        return _clipped([p[:2] for p in a], b, level)
    if len(a) > 2:
        return _clipped([p[:2] for p in b], a, level)
    return _of_segments(a, b, level)


def _clipped(subject: list[Flat], window: list[Corner], level: float) -> list[Flat]:
    """What of ``subject`` lies within the convex ``window``."""
    points = subject
    for k, start in enumerate(window):
        end = window[(k + 1) % len(window)]
        slack = level * math.dist(start[:2], end[:2])
        sides = [_left(start, end, p) for p in points]
        cut: list[Flat] = []
        closed = len(subject) > 2
        for i, p in enumerate(points):
            if sides[i] >= -slack:
                cut.append(p)
            j = (i + 1) % len(points)
            if (closed or j > i) and (
                (sides[i] > slack and sides[j] < -slack) or (sides[i] < -slack and sides[j] > slack)
            ):
                part = sides[i] / (sides[i] - sides[j])
                q = points[j]
                cut.append((p[0] + part * (q[0] - p[0]), p[1] + part * (q[1] - p[1])))
        points = cut
        if not points:
            break
    return points


def _of_segments(a: list[Corner], b: list[Corner], level: float) -> list[Flat]:
    """Where two segments cross, or the ends of what they share."""
    along = (a[1][0] - a[0][0], a[1][1] - a[0][1])
    other = (b[1][0] - b[0][0], b[1][1] - b[0][1])
    length = math.hypot(*along)
    sine = along[0] * other[1] - along[1] * other[0]
    if abs(sine) <= 1e-6 * length * math.hypot(*other):
        at = [((p[0] - a[0][0]) * along[0] + (p[1] - a[0][1]) * along[1]) / length for p in b]
        low, high = max(0.0, min(at)), min(length, max(at))
        if high < low - level:
            return []
        return [(a[0][0] + t / length * along[0], a[0][1] + t / length * along[1]) for t in (low, max(low, high))]
    part = _left(b[0], b[1], a[0]) / (_left(b[0], b[1], a[0]) - _left(b[0], b[1], a[1]))
    part = max(0.0, min(1.0, part))
    return [(a[0][0] + part * along[0], a[0][1] + part * along[1])]


def _distinct(points: list[Flat], level: float) -> list[Flat]:
    found: list[Flat] = []
    for p in points:
        if all(math.dist(p, q) > level for q in found):
            found.append(p)
    return found


def _height(feature: list[Corner], x: float, y: float) -> float:
    """How high the feature is at (x, y): its corners lie level but for a small lean, taken linear."""
    if len(feature) == 1:
        return feature[0][2]
    if len(feature) == 2:
        p, q = feature
        along = (q[0] - p[0], q[1] - p[1])
        square = along[0] ** 2 + along[1] ** 2
        part = ((x - p[0]) * along[0] + (y - p[1]) * along[1]) / square if square > 0.0 else 0.0
        return p[2] + max(0.0, min(1.0, part)) * (q[2] - p[2])
    for p in feature:
        if p[0] == x and p[1] == y:
            return p[2]
    p = feature[0]
    q, r = max(
        ((feature[i], feature[j]) for i in range(1, len(feature)) for j in range(i + 1, len(feature))),
        key=lambda pair: abs(_left(p, pair[0], pair[1])),
    )
    area = _left(p, q, r)
    if area == 0.0:
        return p[2]
    second, third = _left(p, (x, y), r) / area, _left(p, q, (x, y)) / area
    return p[2] + second * (q[2] - p[2]) + third * (r[2] - p[2])


def _nearest_of_outlines(a: list[Corner], b: list[Corner]) -> Flat:
    """Halfway between the middles, where outlines that should meet do not by rounding."""
    x = 0.5 * (sum(p[0] for p in a) / len(a) + sum(p[0] for p in b) / len(b))
    y = 0.5 * (sum(p[1] for p in a) / len(a) + sum(p[1] for p in b) / len(b))
    return x, y
