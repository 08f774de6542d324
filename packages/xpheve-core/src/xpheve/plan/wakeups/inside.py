"""When a point, or a sphere about it, is inside a region along a flight: by the signs of polynomials of the fourth degree at most."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from xpheve.kernels.sign_changes import Quartic, between, sign_changes
from xpheve.kernels.vector import Vec, dot
from xpheve.regions import Region
from xpheve.shapes import Box, Plane, Sphere

State = tuple[float, Any]
"""From when [s] since a flight began, and what holds from then on."""


def inside(region: Region, radius: float, x: Vec, v: Vec, a: Vec, end: float) -> list[State]:
    """From when on a sphere of ``radius`` [m] about x + s (v + s a / 2) meets ``region``, and from when on not, for s in [0, ``end``]."""
    gap, changes = (
        _box(region, radius, x, v, a, end) if isinstance(region.shape, Box) else _smooth(region, radius, x, v, a, end)
    )
    return by_sign(gap, changes, end)


def by_sign(outside: Callable[[float], bool], changes: list[float], end: float) -> list[State]:
    """What holds between neighbouring ``changes``, asked in the middle; changes that change nothing are left out."""
    edges = [0.0, *changes]
    found: list[State] = []
    for k, edge in enumerate(edges):
        top = edges[k + 1] if k + 1 < len(edges) else end
        state = not outside(between(edge, top) if top > edge else edge)
        if not found or found[-1][1] != state:
            found.append((edge, state))
    return found


def _value(c: Quartic, s: float) -> float:
    return (((c[4] * s + c[3]) * s + c[2]) * s + c[1]) * s + c[0]


def _smooth(
    region: Region, radius: float, x: Vec, v: Vec, a: Vec, end: float
) -> tuple[Callable[[float], bool], list[float]]:
    """Sphere and half space: the gap is one polynomial."""
    p = (x[0] - region.position[0], x[1] - region.position[1], x[2] - region.position[2])
    if isinstance(region.shape, Plane):
        assert region.shape.normal is not None
        n = turned(region, region.shape.normal)
        c: Quartic = (dot(n, p) - region.shape.offset - radius, dot(n, v), 0.5 * dot(n, a), 0.0, 0.0)
    else:
        assert isinstance(region.shape, Sphere)
        reach = region.shape.radius + radius
        c = _square(p, v, a, -reach * reach)
    # So asked that a gap beyond all floats, which may end as NaN, is outside.
    return (lambda s: not _value(c, s) <= 0.0), sign_changes(c, 0.0, end)


def _square(p: Vec, v: Vec, a: Vec, less: float) -> Quartic:
    """|p + s v + s^2 a / 2|^2 + ``less`` as a polynomial."""
    size = math.sqrt(-less) if less < 0.0 else 0.0
    distance = math.sqrt(dot(p, p))
    first = (distance - size) * (distance + size)  # without the cancellation of squares
    return (first, 2.0 * dot(p, v), dot(v, v) + dot(p, a), dot(v, a), 0.25 * dot(a, a))


def turned(region: Region, vector: Vec) -> Vec:
    """``vector`` of the region's axes in those of the world."""
    e, f, g = region.axes
    return (
        vector[0] * e[0] + vector[1] * f[0] + vector[2] * g[0],
        vector[0] * e[1] + vector[1] * f[1] + vector[2] * g[1],
        vector[0] * e[2] + vector[1] * f[2] + vector[2] * g[2],
    )


def _box(
    region: Region, radius: float, x: Vec, v: Vec, a: Vec, end: float
) -> tuple[Callable[[float], bool], list[float]]:
    """A box: where each coordinate passes a face; between these the square of the distance to the box is one polynomial."""
    p = (x[0] - region.position[0], x[1] - region.position[1], x[2] - region.position[2])
    axes = region.axes
    local = [(dot(e, p), dot(e, v), dot(e, a)) for e in axes]
    assert isinstance(region.shape, Box)
    half = [0.5 * edge for edge in region.shape.size]

    def outside(s: float) -> bool:
        square = 0.0
        for (q, u, b), h in zip(local, half, strict=True):
            over = abs(q + s * (u + 0.5 * s * b)) - h
            if radius == 0.0 and over > 0.0:
                return True
            square += over * over if over > 0.0 else 0.0  # ** raises where a product is infinite
        return square > radius * radius

    faces: set[float] = set()
    for (q, u, b), h in zip(local, half, strict=True):
        for side in (h, -h):
            # Both ways: the first float beyond is then one or the other side's, whichever way it goes.
            faces.update(sign_changes((q - side, u, 0.5 * b, 0.0, 0.0), 0.0, end))
            faces.update(sign_changes((side - q, -u, -0.5 * b, 0.0, 0.0), 0.0, end))
    changes = set(faces)
    if radius > 0.0:
        edges = [0.0, *sorted(faces)]
        for k, low in enumerate(edges):
            top = edges[k + 1] if k + 1 < len(edges) else end
            c = _corner(local, half, between(low, top), radius)
            changes.update(s for s in sign_changes(c, low, top))
    return outside, sorted(changes)


def _corner(local: list[Vec], half: list[float], s: float, radius: float) -> Quartic:
    """Square of the distance to the box less that of ``radius``, as the polynomial that it is about ``s``."""
    p, v, a = [0.0] * 3, [0.0] * 3, [0.0] * 3
    for k, ((q, u, b), h) in enumerate(zip(local, half, strict=True)):
        at = q + s * (u + 0.5 * s * b)
        if abs(at) > h:
            p[k], v[k], a[k] = q - math.copysign(h, at), u, b
    return _square((p[0], p[1], p[2]), (v[0], v[1], v[2]), (a[0], a[1], a[2]), -radius * radius)
