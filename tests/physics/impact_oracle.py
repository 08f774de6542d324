"""Spheres that fly parabolas among fixed shapes, from impact to impact, slowly and in 40 digits: what the engine is measured against.

Nothing here is shared with the engine, the method neither. A fixed box, capsule or sphere, and another ball, are all the points within
R of a core, a box of half edges h (0, 0, 0 for a point; 0, 0, l for a segment). In the core's frame the squared distance is

    sum over axes of max(|x_i(t)| - h_i, 0)^2,

piece by piece a polynomial in t of degree 4. The pieces meet where a coordinate passes a side of the core; the touches are the roots
of each piece at which the distance falls. Roots are found all at once, by Durand's and Kerner's method.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import mpmath as mp

Vec = Sequence[float]
Big = tuple[Any, Any, Any]

DIGITS = 40
REAL = mp.mpf(10) ** -18  # an imaginary part below this is rounding
LEAST = mp.mpf(10) ** -32  # a term of a polynomial below this share of the others is rounding of a zero


@dataclass(frozen=True)
class Ball:
    """A sphere that flies; ``force`` [N] is constant. A radius of 0 is a point."""

    radius: float
    mass: float
    position: Vec
    velocity: Vec
    force: Vec = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Wall:
    """What is fixed.

    ``kind`` is "plane" (``size`` is its normal, any length, and its level on it), "box" (edge lengths), "capsule" (radius, length of
    the cylinder, along its z) or "sphere" (radius). ``orientation`` is a quaternion of any length.
    """

    kind: str
    size: Vec
    position: Vec = (0.0, 0.0, 0.0)
    orientation: Vec = (1.0, 0.0, 0.0, 0.0)


@dataclass
class Flier:
    """A ball under way: where it was at ``clock`` [s]."""

    radius: Any
    mass: Any
    position: Big
    velocity: Big
    acceleration: Big
    clock: Any

    def at(self, time: Any) -> tuple[Big, Big]:
        """Position and velocity at ``time`` [s]."""
        s = time - self.clock
        x, v, a = self.position, self.velocity, self.acceleration
        place = tuple(x[k] + s * (v[k] + s * a[k] / 2) for k in range(3))
        return place, tuple(v[k] + s * a[k] for k in range(3))  # type: ignore[return-value]


@dataclass(frozen=True)
class Outcome:
    """What came of a scene: impacts (time, body, other), in order; positions and velocities at the end, (balls, 3) mpf."""

    impacts: tuple[tuple[Any, int, int], ...]
    positions: tuple[Big, ...]
    velocities: tuple[Big, ...]


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return mp.fsum(x * y for x, y in zip(a, b, strict=True))


def minus(a: Sequence[Any], b: Sequence[Any]) -> Big:
    return tuple(x - y for x, y in zip(a, b, strict=True))  # type: ignore[return-value]


def rows_of(orientation: Vec) -> tuple[Big, Big, Big]:
    """The body's axes in the world: the columns of its rotation matrix."""
    w, x, y, z = (mp.mpf(c) for c in orientation)
    n = w * w + x * x + y * y + z * z
    w2, x2, y2, z2 = w * w / n, x * x / n, y * y / n, z * z / n
    xy, xz, yz, wx, wy, wz = (2 * c / n for c in (x * y, x * z, y * z, w * x, w * y, w * z))
    return (
        (w2 + x2 - y2 - z2, xy + wz, xz - wy),
        (xy - wz, w2 - x2 + y2 - z2, yz + wx),
        (xz + wy, yz - wx, w2 - x2 - y2 + z2),
    )


def core_of(wall: Wall) -> tuple[Big, Any]:
    """Half edges of the core [m], and the radius around it."""
    zero = mp.mpf(0)
    if wall.kind == "box":
        return tuple(mp.mpf(c) / 2 for c in wall.size), zero  # type: ignore[return-value]
    if wall.kind == "capsule":
        return (zero, zero, mp.mpf(wall.size[1]) / 2), mp.mpf(wall.size[0])
    return (zero, zero, zero), mp.mpf(wall.size[0])


def real_roots(coefficients: list[Any], span: Any) -> list[Any]:
    """The real roots in [0, span] of sum of c_k t^k, ascending."""
    sizes = [abs(c) * span**k for k, c in enumerate(coefficients)]
    top = max(sizes)
    while coefficients and sizes[len(coefficients) - 1] <= LEAST * top:
        coefficients = coefficients[:-1]
    if len(coefficients) < 2:
        return []
    scaled = [c * span**k / top for k, c in enumerate(coefficients)]  # of t / span
    real = [root.real * span for root in complex_roots(scaled) if abs(root.imag) <= REAL * (1 + abs(root.real))]
    return sorted(root for root in real if -REAL * span <= root <= span)


def complex_roots(coefficients: Sequence[Any]) -> list[Any]:
    """All roots of sum of c_k t^k, by Durand's and Kerner's method: all are corrected at once, each as if the others were right.

    A multiple root is found slowly, to half of the digits or fewer: it is a graze, and none is asked for here.
    """
    with mp.extradps(DIGITS):
        monic = [c / coefficients[-1] for c in coefficients]
        if len(monic) == 2:
            return [-monic[0]]
        if len(monic) == 3:
            half = -monic[1] / 2
            root = mp.sqrt(half * half - monic[0])
            return [half - root, half + root]
        bound = 1 + max(map(abs, monic[:-1]))
        roots = [bound * mp.expjpi(mp.mpf(2 * k) / (len(monic) - 1) + mp.mpf("0.37")) for k in range(len(monic) - 1)]
        for _ in range(500):
            most = mp.mpf(0)
            for k, root in enumerate(roots):
                step = value(monic, root) / mp.fprod(root - other for m, other in enumerate(roots) if m != k)
                roots[k] = root - step
                most = max(most, abs(step))
            if most < mp.mpf(10) ** (-DIGITS - 5):
                break
        return roots


def squared(c: Sequence[Any]) -> list[Any]:
    """The square of c_0 + c_1 t + c_2 t^2."""
    return [c[0] ** 2, 2 * c[0] * c[1], c[1] ** 2 + 2 * c[0] * c[2], 2 * c[1] * c[2], c[2] ** 2]


def value(coefficients: Sequence[Any], t: Any) -> Any:
    total = mp.mpf(0)
    for c in reversed(coefficients):
        total = total * t + c
    return total


def slope(coefficients: Sequence[Any], t: Any) -> Any:
    return value([k * c for k, c in enumerate(coefficients)][1:], t)


def touch_of_core(way: Sequence[Sequence[Any]], half: Big, reach: Any, span: Any) -> Any:
    """First time in [0, span] at which a point comes within ``reach`` of the core; None if it does not.

    ``way``: its coordinates in the frame of the core, each c_0 + c_1 t + c_2 t^2.
    """
    breaks = {mp.mpf(0), span}
    for c, h in zip(way, half, strict=True):
        if h != 0:
            for side in (h, -h):
                breaks.update(t for t in real_roots([c[0] - side, c[1], c[2]], span) if t > 0)
    ends = sorted(breaks)
    for begin, end in itertools.pairwise(ends):
        middle = (begin + end) / 2
        total = [mp.mpf(0)] * 5
        for c, h in zip(way, half, strict=True):
            x = value(c, middle)
            if abs(x) > h:
                shifted = [c[0] - mp.sign(x) * h, c[1], c[2]]
                total = [a + b for a, b in zip(total, squared(shifted), strict=True)]
        near = REAL * span
        if reach == 0 and not any(total) and end - begin > near:
            return begin  # a point that comes into a box, which has no skin: the distance has no sign there
        if reach == 0 or not any(total):
            continue
        total[0] -= reach * reach
        for root in real_roots(total, span):
            if begin - near <= root <= end + near and slope(total, root) < 0:
                return max(root, mp.mpf(0))
    return None


def touch_of_plane(gap: Sequence[Any], span: Any) -> Any:
    """First time in [0, span] at which c_0 + c_1 t + c_2 t^2 falls through 0."""
    for root in real_roots(list(gap), span):
        if slope(gap, root) < 0:
            return max(root, mp.mpf(0))
    return None


def unit(vector: Sequence[Any]) -> Big:
    length = mp.sqrt(dot(vector, vector))
    return tuple(c / length for c in vector)  # type: ignore[return-value]


class CollapseError(Exception):
    """Impacts without end: something comes to rest."""


class Oracle:
    """Balls among walls, carried from impact to impact.

    Parameters
    ----------
    balls, walls
        The scene. Balls are 0, 1, ..., walls follow them.
    restitution
        Of all pairs.
    nudge
        Added to the positions and velocities of the balls, (balls, 6), in m and m/s.
    """

    def __init__(
        self, balls: Sequence[Ball], walls: Sequence[Wall], restitution: float = 1.0, nudge: Any = None
    ) -> None:
        self.walls = walls
        self.restitution = mp.mpf(restitution)
        self.fliers = []
        for k, ball in enumerate(balls):
            extra = [mp.mpf(c) for c in nudge[k]] if nudge is not None else [mp.mpf(0)] * 6
            self.fliers.append(
                Flier(
                    mp.mpf(ball.radius),
                    mp.mpf(ball.mass),
                    tuple(mp.mpf(c) + extra[i] for i, c in enumerate(ball.position)),  # type: ignore[arg-type]
                    tuple(mp.mpf(c) + extra[3 + i] for i, c in enumerate(ball.velocity)),  # type: ignore[arg-type]
                    tuple(mp.mpf(c) / mp.mpf(ball.mass) for c in ball.force),  # type: ignore[arg-type]
                    mp.mpf(0),
                )
            )

    def run(self, until: float, most: int = 1000) -> Outcome:
        """Carry the scene to ``until`` [s]; a `CollapseError` after ``most`` impacts."""
        with mp.workdps(DIGITS):
            end, now = mp.mpf(until), mp.mpf(0)
            count = len(self.fliers)
            pairs = [(i, j) for i in range(count) for j in range(i + 1, count + len(self.walls))]
            due = {pair: self._next(*pair, now, end) for pair in pairs}
            impacts: list[tuple[Any, int, int]] = []
            while True:
                coming = [(time, pair) for pair, time in due.items() if time is not None]
                if not coming or min(coming)[0] > end:
                    break
                now, (i, j) = min(coming)
                impacts.append((now, i, j))
                if len(impacts) > most:
                    raise CollapseError(f"{most} impacts until {now} s")
                self._answer(i, j, now)
                for pair in pairs:
                    if i in pair or (j in pair and j < count):
                        due[pair] = self._next(*pair, now, end)
            states = [flier.at(end) for flier in self.fliers]
            return Outcome(tuple(impacts), tuple(x for x, _ in states), tuple(v for _, v in states))

    def _next(self, i: int, j: int, now: Any, end: Any) -> Any:
        """When the pair touches next, or None."""
        span = end - now
        if span <= 0:
            return None
        one = self.fliers[i]
        x, v = one.at(now)
        a = one.acceleration
        half: Big = (mp.mpf(0), mp.mpf(0), mp.mpf(0))
        if j < len(self.fliers):
            other = self.fliers[j]
            y, u = other.at(now)
            x, v, a = minus(x, y), minus(v, u), minus(a, other.acceleration)
            way = [[x[k], v[k], a[k] / 2] for k in range(3)]
            found = touch_of_core(way, half, one.radius + other.radius, span)
        else:
            wall = self.walls[j - len(self.fliers)]
            if wall.kind == "plane":
                normal, level = self._plane(wall)
                gap = [dot(normal, x) - level - one.radius, dot(normal, v), dot(normal, a) / 2]
                found = touch_of_plane(gap, span)
            else:
                half, reach = core_of(wall)
                x = minus(x, [mp.mpf(c) for c in wall.position])
                way = [[dot(axis, x), dot(axis, v), dot(axis, a) / 2] for axis in rows_of(wall.orientation)]
                found = touch_of_core(way, half, reach + one.radius, span)
        return None if found is None else now + found

    @staticmethod
    def _plane(wall: Wall) -> tuple[Big, Any]:
        return unit([mp.mpf(c) for c in wall.size[:3]]), mp.mpf(wall.size[3])

    def _normal(self, i: int, j: int, now: Any) -> Big:
        """Unit vector from ball ``i`` to the other."""
        x, _ = self.fliers[i].at(now)
        if j < len(self.fliers):
            return unit(minus(self.fliers[j].at(now)[0], x))
        wall = self.walls[j - len(self.fliers)]
        if wall.kind == "plane":
            return tuple(-c for c in self._plane(wall)[0])  # type: ignore[return-value]
        half, _ = core_of(wall)
        one_point = self.fliers[i].radius == 0
        axes = rows_of(wall.orientation)
        local = [dot(axis, minus(x, [mp.mpf(c) for c in wall.position])) for axis in axes]
        if wall.kind == "box" and one_point:
            deep = [abs(c) - h for c, h in zip(local, half, strict=True)]
            out = [mp.sign(c) if d == max(deep) else mp.mpf(0) for c, d in zip(local, deep, strict=True)]
        else:
            out = [c - max(-h, min(h, c)) for c, h in zip(local, half, strict=True)]
        return unit([-mp.fsum(out[k] * axes[k][m] for k in range(3)) for m in range(3)])

    def _answer(self, i: int, j: int, now: Any) -> None:
        """Newton's law of impact."""
        n = self._normal(i, j, now)
        one = self.fliers[i]
        one.position, one.velocity = one.at(now)
        one.clock = now
        weight = 1 / one.mass
        other = self.fliers[j] if j < len(self.fliers) else None
        closing = dot(n, one.velocity)
        if other is not None:
            other.position, other.velocity = other.at(now)
            other.clock = now
            closing -= dot(n, other.velocity)
            weight += 1 / other.mass
        impulse = (1 + self.restitution) * closing / weight
        one.velocity = tuple(v - impulse * c / one.mass for v, c in zip(one.velocity, n, strict=True))  # type: ignore[assignment]
        if other is not None:
            other.velocity = tuple(v + impulse * c / other.mass for v, c in zip(other.velocity, n, strict=True))  # type: ignore[assignment]


def outcome(
    balls: Sequence[Ball], walls: Sequence[Wall], until: float, restitution: float = 1.0, most: int = 1000
) -> Outcome:
    """What comes of the scene, to some 35 digits less what its impacts amplify."""
    with mp.workdps(DIGITS):
        return Oracle(balls, walls, restitution).run(until, most)


def growth(
    balls: Sequence[Ball], walls: Sequence[Wall], until: float, restitution: float, plain: Outcome, way: int = 1
) -> tuple[float, float, float]:
    """How much a small deviation of the start has become in times, positions, velocities; infinite if the order of impacts changed.

    By a second run, started 1e-24 off in all coordinates (m and m/s), with signs that ``way`` chooses.
    """
    with mp.workdps(DIGITS):
        off = mp.mpf(10) ** -24
        signs = [
            [1 if (way * 2654435761 >> (5 + (6 * k + c) % 25)) & 1 else -1 for c in range(6)] for k in range(len(balls))
        ]
        moved = Oracle(balls, walls, restitution, [[s * off for s in row] for row in signs]).run(until)
        if [(i, j) for _, i, j in moved.impacts] != [(i, j) for _, i, j in plain.impacts]:
            return (float("inf"),) * 3
        times = max((abs(a[0] - b[0]) for a, b in zip(moved.impacts, plain.impacts, strict=True)), default=mp.mpf(0))
        places, speeds = (
            max(abs(a - b) for one, two in zip(p, q, strict=True) for a, b in zip(one, two, strict=True))
            for p, q in ((moved.positions, plain.positions), (moved.velocities, plain.velocities))
        )
        return float(times / off), float(places / off), float(speeds / off)


def backwards(balls: Sequence[Ball], end: Outcome) -> list[Ball]:
    """The balls at the end, rounded to floats, their velocities reversed."""
    return [
        replace(ball, position=tuple(map(float, x)), velocity=tuple(-float(c) for c in v))
        for ball, x, v in zip(balls, end.positions, end.velocities, strict=True)
    ]
