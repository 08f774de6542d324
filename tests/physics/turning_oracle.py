"""When two bodies that fly and turn touch first, slowly, in extended precision: what conservative advancement is measured against.

Nothing here is shared with the engine, the method neither. Rotations are Taylor series of Euler's equations, in the body's frame, to
order 24. The gap is, of boxes on boxes, the widest separation along 15 axes (Gottschalk, Lin and Manocha 1996), which has the zeros of
the distance; of round bodies the least distance of corners, edges and sides of their cores, less the radii. The first zero is looked
for on grids in time: an interval is left out only if the gaps at its ends are too wide for the greatest speed, any other is divided.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Long = NDArray[np.longdouble]
Vec = Sequence[float]

ORDER = 24
TURN = 0.25  # [rad] of a Taylor step
PARTS = 48  # of a grid
SHORTEST = 1e-7  # of the span: in less nothing that matters turns round
SIGNS = np.array(list(itertools.product((-1, 1), repeat=3)), dtype=np.longdouble)
EDGES = [(i, j) for i in range(8) for j in range(i + 1, 8) if int(abs(SIGNS[i] - SIGNS[j]).sum()) == 2]


def long(values: Any) -> Long:
    return np.array(values, dtype=np.longdouble)


def product(p: Long, q: Long) -> Long:
    """Quaternions (w, x, y, z)."""
    a, b, c, d = p
    w, x, y, z = q
    return long(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def axes_of(q: Long) -> Long:
    """Rotation matrices (n, 3, 3), body to world, of quaternions (n, 4) of about length 1."""
    w, x, y, z = (q / np.sqrt((q * q).sum(axis=1))[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


@dataclass
class Turner:
    """A body that flies and turns freely, or stands.

    ``kind``: "box" (``size`` edge lengths), "capsule" (radius, length of the cylinder, along its z), "sphere" (radius), "plane" (its
    outward normal and level). ``inertia``: principal moments; of nothing that turns not.
    """

    kind: str
    size: Vec
    position: Vec = (0.0, 0.0, 0.0)
    velocity: Vec = (0.0, 0.0, 0.0)
    acceleration: Vec = (0.0, 0.0, 0.0)
    orientation: Vec = (1.0, 0.0, 0.0, 0.0)
    angular_velocity: Vec = (0.0, 0.0, 0.0)
    inertia: Vec = (1.0, 1.0, 1.0)
    steps: list[tuple[Any, Long]] = field(default_factory=list)

    def prepare(self, until: float) -> None:
        """Make the Taylor series to ``until`` [s]."""
        q = long(self.orientation)
        inverse = long([q[0], -q[1], -q[2], -q[3]]) / (q * q).sum()
        w = product(product(inverse, long([0, *self.angular_velocity])), q)[1:]
        i = long(self.inertia)
        rates = ((i[1] - i[2]) / i[0], (i[2] - i[0]) / i[1], (i[0] - i[1]) / i[2])
        now = np.longdouble(0)
        self.steps = []
        while True:
            turn, spin = [q], [w]
            for n in range(ORDER):
                sums = [sum(spin[m][(k + 1) % 3] * spin[n - m][(k + 2) % 3] for m in range(n + 1)) for k in range(3)]
                turn.append(sum(product(turn[m], long([0, *spin[n - m]])) for m in range(n + 1)) / (2 * (n + 1)))  # type: ignore[arg-type]
                spin.append(long([rate * s for rate, s in zip(rates, sums, strict=True)]) / (n + 1))
            self.steps.append((now, long(turn)))
            fast = float(np.sqrt((w * w).sum()))
            h = np.longdouble(TURN / fast) if fast else np.longdouble(math.inf)
            if now + h >= until:
                return
            powers = h ** np.arange(ORDER + 1)
            q, w = powers @ long(turn), powers @ long(spin)
            now = now + h

    def at(self, t: Long) -> tuple[Long, Long]:
        """Centres (n, 3) and axes (n, 3, 3) at times (n,)."""
        x, v, a = (long(one) for one in (self.position, self.velocity, self.acceleration))
        s = t[:, None]
        begins = long([begin for begin, _ in self.steps])
        which = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, None)
        q = np.empty((len(t), 4), dtype=np.longdouble)
        for k in np.unique(which):
            here = which == k
            powers = (t[here] - begins[k])[:, None] ** np.arange(ORDER + 1)
            q[here] = powers @ self.steps[k][1]
        return x + s * (v + s * a / 2), axes_of(q)

    def reach(self) -> float:
        """The farthest point of the core from the centre [m]."""
        if self.kind == "box":
            return 0.5 * math.hypot(*self.size)
        return 0.5 * self.size[1] if self.kind == "capsule" else 0.0

    def greatest_turn(self) -> float:
        """A bound on |angular velocity|: the angular momentum over the least moment."""
        fast = math.hypot(*self.angular_velocity)
        return fast * max(self.inertia) / min(self.inertia)

    def radius(self) -> float:
        return 0.0 if self.kind in ("box", "plane") else self.size[0]

    def points(self, centres: Long, axes: Long) -> Long:
        """Corners of the core (n, m, 3): 8 of a box, 2 of a capsule, 1 of a sphere."""
        if self.kind == "box":
            local = SIGNS * long(self.size) / 2
        elif self.kind == "capsule":
            local = long([[0, 0, -1], [0, 0, 1]]) * np.longdouble(self.size[1]) / 2
        else:
            local = long([[0, 0, 0]])
        return centres[:, None, :] + np.einsum("nij,mj->nmi", axes, local)

    def edges(self) -> list[tuple[int, int]]:
        return EDGES if self.kind == "box" else [(0, 1)] if self.kind == "capsule" else []


def size_of(v: Long) -> Long:
    found: Long = np.sqrt((v * v).sum(axis=-1))
    return found


def point_segment(p: Long, a: Long, b: Long) -> Long:
    along = b - a
    s = np.clip(((p - a) * along).sum(axis=-1) / (along * along).sum(axis=-1), 0, 1)
    return size_of(p - a - s[..., None] * along)


def segment_segment(a: Long, b: Long, c: Long, d: Long) -> Long:
    """The least of the four ends, and of the lines where their nearest points lie within both."""
    least = np.minimum(np.minimum(point_segment(a, c, d), point_segment(b, c, d)), point_segment(c, a, b))
    least = np.minimum(least, point_segment(d, a, b))
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = ((p * q).sum(axis=-1) for p, q in ((u, u), (u, v), (v, v)))
    uw, vw = (u * w).sum(axis=-1), (v * w).sum(axis=-1)
    across = uu * vv - uv * uv
    skew = across > 1e-12 * uu * vv
    safe = np.where(skew, across, 1)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inside = skew & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    lines = size_of(w + s[..., None] * u - t[..., None] * v)
    return np.where(inside, np.minimum(least, lines), least)


def to_box(p: Long, box: Turner, centres: Long, axes: Long) -> Long:
    """Distances (n, m) of points (n, m, 3) from a solid box."""
    local = np.einsum("nji,nmj->nmi", axes, p - centres[:, None, :])
    half = long(box.size) / 2
    return size_of(np.maximum(np.abs(local) - half, 0))


def separation_of_boxes(a: Turner, b: Turner, at_a: tuple[Long, Long], at_b: tuple[Long, Long]) -> Long:
    """The widest separation along the 15 axes that can part two boxes; below 0 they overlap."""
    (xa, ra), (xb, rb) = at_a, at_b
    tried = [ra[:, :, k] for k in range(3)] + [rb[:, :, k] for k in range(3)]
    tried += [np.cross(ra[:, :, k], rb[:, :, m]) for k in range(3) for m in range(3)]
    widest = np.full(len(xa), -np.inf, dtype=np.longdouble)
    for axis in tried:
        length = size_of(axis)
        good = length > 1e-6
        n = axis / np.where(good, length, 1)[:, None]
        span = np.abs(((xb - xa) * n).sum(axis=1))
        for body, axes in ((a, ra), (b, rb)):
            span = span - (np.abs(np.einsum("nij,ni->nj", axes, n)) * long(body.size) / 2).sum(axis=1)
        widest = np.where(good, np.maximum(widest, span), widest)
    return widest


def gaps(a: Turner, b: Turner, t: Long) -> Long:
    """Gaps [m] at times (n,); their sign is right, and where it is positive so is the value but of two boxes, where it may be less."""
    at_a, at_b = a.at(t), b.at(t)
    if b.kind == "plane":
        normal = long(b.size[:3]) / np.sqrt((long(b.size[:3]) ** 2).sum())
        found: Long = (a.points(*at_a) @ normal).min(axis=1) - np.longdouble(b.size[3]) - np.longdouble(a.radius())
        return found
    if a.kind == "box" and b.kind == "box":
        return separation_of_boxes(a, b, at_a, at_b)
    pa, pb = a.points(*at_a), b.points(*at_b)
    least = np.full(len(t), np.inf, dtype=np.longdouble)
    if b.kind == "box":
        least = np.minimum(least, to_box(pa, b, *at_b).min(axis=1))
    if a.kind == "box":
        least = np.minimum(least, to_box(pb, a, *at_a).min(axis=1))
    for i, j in a.edges():
        for k, m in b.edges():
            least = np.minimum(least, segment_segment(pa[:, i], pa[:, j], pb[:, k], pb[:, m]))
    for one, other, edges in ((pa, pb, b.edges()), (pb, pa, a.edges())):
        for i, j in edges:
            for k in range(one.shape[1]):
                least = np.minimum(least, point_segment(one[:, k], other[:, i], other[:, j]))
    if not a.edges() and not b.edges():
        least = np.minimum(least, size_of(pa[:, 0] - pb[:, 0]))
    return least - np.longdouble(a.radius()) - np.longdouble(b.radius())


def greatest_speed(a: Turner, b: Turner, until: float) -> float:
    """A bound on how fast the gap changes [m/s]."""
    v = math.dist(a.velocity, b.velocity) + until * math.dist(a.acceleration, b.acceleration)
    return v + sum(one.greatest_turn() * one.reach() for one in (a, b))


def first_touch(a: Turner, b: Turner, until: float) -> tuple[float, float] | None:
    """When they touch first [s], right to 1e-17 or so, and how fast they approach then [m/s]; None if not before ``until``."""
    for one in (a, b):
        one.prepare(until)
    fast = greatest_speed(a, b, until)
    found = _first(a, b, np.longdouble(0), np.longdouble(until), fast, SHORTEST * until)
    if found is None:
        return None
    step = np.longdouble(1e-7) * until
    near = gaps(a, b, long([found - step, found]))
    return float(found), float((near[0] - near[1]) / step)


def _first(a: Turner, b: Turner, begin: Any, end: Any, fast: float, shortest: float) -> Any:
    t = begin + (end - begin) * np.arange(PARTS + 1).astype(np.longdouble) / PARTS
    g = gaps(a, b, t)
    width = (end - begin) / PARTS
    for k in range(PARTS):
        through = g[k] > 0 >= g[k + 1]
        if not through and g[k] + g[k + 1] >= fast * width:
            continue
        if width > shortest:
            inner = _first(a, b, t[k], t[k + 1], fast, shortest)
            if inner is not None:
                return inner
        elif through:
            return _root(a, b, t[k], t[k + 1])
    return None


def _root(a: Turner, b: Turner, low: Any, high: Any) -> Any:
    """Of a gap that falls through 0, by grids."""
    for _ in range(12):
        t = low + (high - low) * np.arange(PARTS + 1).astype(np.longdouble) / PARTS
        below = np.flatnonzero(gaps(a, b, t) <= 0)
        k = max(int(below[0]), 1) if len(below) else PARTS
        low, high = t[k - 1], t[k]
    return (low + high) / 2
