"""Fast spheres, spinning rods and moving walls, and an oracle that knows when they touch to thirty digits.

The oracle shares nothing with the engine: bodies fly straight and turn as symmetric tops do (two steady turns, one about the angular
momentum, one about the axis of symmetry), and what is asked is the distance of two shapes at an instant, in one line for each pair. The
same lines serve in floats, to look through the whole flight, and in mpmath, to find the root.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

import xpheve as xp

DIGITS = 30
LOOKS = 1500
Row = tuple[Any, Any, Any]


class Numbers:
    """Arithmetic of the oracle: floats, or mpmath's."""

    def __init__(self, number: Any, module: Any) -> None:
        self.number = number
        self.sqrt, self.sin, self.cos = module.sqrt, module.sin, module.cos

    def vector(self, row: Any) -> Row:
        return tuple(self.number(x) for x in row)  # type: ignore[return-value]


FLOATS = Numbers(float, math)
LONG = Numbers(mpmath.mpf, mpmath)


def dot(a: Row, b: Row) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Row, b: Row) -> Row:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def combined(a: Row, s: Any, b: Row) -> Row:
    """a + s b."""
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


def spun(v: Row, w: Row, t: Any, n: Numbers) -> Row:
    """``v`` turned for ``t`` at the constant angular velocity ``w`` (Rodrigues)."""
    rate = n.sqrt(dot(w, w))
    if rate == 0:
        return v
    axis = (w[0] / rate, w[1] / rate, w[2] / rate)
    c, s = n.cos(rate * t), n.sin(rate * t)
    aside, along = cross(axis, v), dot(axis, v) * (1 - c)
    return (
        c * v[0] + s * aside[0] + along * axis[0],
        c * v[1] + s * aside[1] + along * axis[1],
        c * v[2] + s * aside[2] + along * axis[2],
    )


def turned(q: Any, v: Any, n: Numbers) -> Row:
    """``v`` turned by the quaternion ``q``, brought to length 1 in these numbers."""
    w, x, y, z = (n.number(c) for c in q)
    size = w * w + x * x + y * y + z * z
    u, vector = (x, y, z), n.vector(v)
    aside = cross(u, vector)
    twice = cross(u, aside)
    return (
        vector[0] + 2 * (w * aside[0] + twice[0]) / size,
        vector[1] + 2 * (w * aside[1] + twice[1]) / size,
        vector[2] + 2 * (w * aside[2] + twice[2]) / size,
    )


@dataclass
class Body:
    """One side of a case. ``inertia`` [kg m^2] has two equal first moments, or ``spin`` is about one axis of the body."""

    shape: Any
    position: Any
    velocity: Any
    orientation: Any = (1.0, 0.0, 0.0, 0.0)
    spin: Any = (0.0, 0.0, 0.0)
    fixed: bool = False
    mass: float = 1.0
    driven: bool = False
    """Whether a hand moves it."""

    def made(self) -> xp.PhysicalObject:
        """The engine's object."""
        return xp.PhysicalObject(
            self.shape,
            mass=self.mass,
            position=tuple(self.position),
            velocity=tuple(self.velocity),
            orientation=tuple(self.orientation),
            angular_velocity=tuple(self.spin),
            fixed=self.fixed,
        )

    def centre(self, t: Any, n: Numbers) -> Row:
        return combined(n.vector(self.position), t, n.vector(self.velocity))

    def arrow(self, local: Any, t: Any, n: Numbers) -> Row:
        """Where the arrow ``local`` of the body's frame points at ``t``."""
        start, w = turned(self.orientation, local, n), n.vector(self.spin)
        if self.fixed or not any(self.spin):
            return start
        if self.shape.kind == "sphere":
            return spun(start, w, t, n)
        around, _, own = (n.number(i) for i in self.shape.inertia(self.mass))
        axis = turned(self.orientation, (0.0, 0.0, 1.0), n)
        about = dot(w, axis)
        momentum = combined((around * w[0], around * w[1], around * w[2]), (own - around) * about, axis)
        # In the frame that goes about the momentum the body turns about its own axis.
        steady = (momentum[0] / around, momentum[1] / around, momentum[2] / around)
        rest = about - dot(steady, axis)
        return spun(spun(start, (axis[0] * rest, axis[1] * rest, axis[2] * rest), t, n), steady, t, n)


def ends(body: Body, t: Any, n: Numbers) -> tuple[Row, Row]:
    """The two centres of a capsule's caps."""
    axis, middle = body.arrow((0.0, 0.0, 1.0), t, n), body.centre(t, n)
    half = n.number(body.shape.length) / 2
    return combined(middle, -half, axis), combined(middle, half, axis)


def corners(body: Body, t: Any, n: Numbers) -> list[Row]:
    x, y, z = (n.number(edge) / 2 for edge in body.shape.size)
    ex, ey, ez = (body.arrow(unit, t, n) for unit in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    middle = body.centre(t, n)
    return [
        combined(combined(combined(middle, i * x, ex), j * y, ey), k * z, ez)
        for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)
    ]  # fmt: skip


def length(a: Row, n: Numbers) -> Any:
    return n.sqrt(dot(a, a))


def between(low: Any, x: Any, high: Any) -> Any:
    return low if x < low else high if x > high else x


def to_segment(p: Row, a: Row, b: Row, n: Numbers) -> Any:
    along, away = combined(b, -1, a), combined(p, -1, a)
    part = between(0, dot(away, along) / dot(along, along), 1)
    return length(combined(away, -part, along), n)


def of_segments(a: Row, b: Row, c: Row, d: Row, n: Numbers) -> Any:
    """Distance of two segments: that of the lines where it lies within both, else the least from an end."""
    u, v, w = combined(b, -1, a), combined(d, -1, c), combined(a, -1, c)
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    found = [to_segment(a, c, d, n), to_segment(b, c, d, n), to_segment(c, a, b, n), to_segment(d, a, b, n)]
    across = uu * vv - uv * uv
    if across > 0:
        s, t = (uv * vw - vv * uw) / across, (uu * vw - uv * uw) / across
        if 0 < s < 1 and 0 < t < 1:
            found.append(length(combined(combined(w, s, u), -t, v), n))
    return min(found)


def to_box(p: Row, box: Body, t: Any, n: Numbers) -> Any:
    """Distance of a point outside from a box."""
    away = combined(p, -1, box.centre(t, n))
    rest = []
    for unit, edge in zip(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), box.shape.size, strict=True):
        x, half = dot(away, box.arrow(unit, t, n)), n.number(edge) / 2
        rest.append(x - between(-half, x, half))
    return length((rest[0], rest[1], rest[2]), n)


def gap(a: Body, b: Body, t: Any, n: Numbers) -> Any:
    """Distance [m] of the surfaces of two bodies that are apart."""
    kinds = (a.shape.kind, b.shape.kind)
    ball = n.number(a.shape.radius) if hasattr(a.shape, "radius") else n.number(0)
    if is_face(a, b):
        # Of a wall only the one large face is met.
        outward = n.vector(b.shape.normal) if kinds[1] == "plane" else b.arrow((1.0, 0.0, 0.0), t, n)
        thick = n.number(0) if kinds[1] == "plane" else n.number(b.shape.size[0]) / 2
        low = b.centre(t, n)
        points = {"sphere": lambda: [a.centre(t, n)], "capsule": lambda: ends(a, t, n), "box": lambda: corners(a, t, n)}
        return min(dot(combined(p, -1, low), outward) for p in points[kinds[0]]()) - thick - ball
    if kinds == ("sphere", "sphere"):
        return length(combined(a.centre(t, n), -1, b.centre(t, n)), n) - ball - n.number(b.shape.radius)
    if kinds == ("sphere", "box"):
        return to_box(a.centre(t, n), b, t, n) - ball
    if kinds == ("sphere", "capsule"):
        return to_segment(a.centre(t, n), *ends(b, t, n), n) - ball - n.number(b.shape.radius)
    if kinds == ("capsule", "capsule"):
        return of_segments(*ends(a, t, n), *ends(b, t, n), n) - ball - n.number(b.shape.radius)
    if kinds == ("capsule", "sphere"):
        return to_segment(b.centre(t, n), *ends(a, t, n), n) - ball - n.number(b.shape.radius)
    assert kinds == ("box", "sphere")
    return to_box(b.centre(t, n), a, t, n) - n.number(b.shape.radius)


def is_face(a: Body, b: Body) -> bool:
    """Whether of the second one plane face is met, large beside all else."""
    return b.shape.kind == "plane" or (a.shape.kind != "sphere" and b.shape.kind == "box")


def close_by(a: Body, b: Body, until: float) -> tuple[float, float]:
    """Times between which the bounding balls overlap, or the ball about the first is at the face of the second."""
    d = np.array(b.position, dtype=float) - np.array(a.position, dtype=float)
    v = np.array(b.velocity, dtype=float) - np.array(a.velocity, dtype=float)
    if is_face(a, b):
        plane = b.shape.kind == "plane"
        n = np.array(b.shape.normal if plane else b.arrow((1.0, 0.0, 0.0), 0.0, FLOATS))
        height, speed = -float(n @ d) - (0.0 if plane else 0.5 * b.shape.size[0]), float(n @ v)
        return max(0.0, (height - a.shape.reach) / speed), min(until, (height + a.shape.reach) / speed)
    far = a.shape.reach + b.shape.reach
    middle, speed = -float(d @ v), float(v @ v)
    inside = middle * middle - speed * (float(d @ d) - far * far)
    if inside <= 0.0:
        return until, until
    root = math.sqrt(inside)
    return max(0.0, (middle - root) / speed), min(until, (middle + root) / speed)


def first_touch(a: Body, b: Body, until: float) -> Any:
    """When they touch first, to thirty digits, or infinite: looked for in floats, found in mpmath."""
    start, end = close_by(a, b, until)
    if not start < end:
        return mpmath.inf
    times = [start + (end - start) * k / LOOKS for k in range(LOOKS + 1)]
    gaps = [math.inf, math.inf]
    for k, t in enumerate(times):
        gaps = [gaps[-2], gaps[-1], gap(a, b, t, FLOATS)]
        if gaps[2] <= 0.0 and k:
            return root_between(a, b, times[k - 1], t)
        if gaps[0] > gaps[1] < gaps[2] and k > 1:
            low = lowest(a, b, times[k - 2], t)
            if gap(a, b, low, FLOATS) <= 0.0:
                return root_between(a, b, times[k - 2], low)
    return mpmath.inf


def lowest(a: Body, b: Body, low: float, high: float) -> float:
    """Where the gap is least, by thirds."""
    for _ in range(80):
        one, two = low + (high - low) / 3, high - (high - low) / 3
        if gap(a, b, one, FLOATS) < gap(a, b, two, FLOATS):
            high = two
        else:
            low = one
    return 0.5 * (low + high)


def root_between(a: Body, b: Body, low: float, high: float) -> Any:
    with mpmath.workdps(DIGITS):
        under, over = mpmath.mpf(low), mpmath.mpf(high)
        for _ in range(30):  # to a bracket so small that the gap is smooth in it
            middle = (under + over) / 2
            if gap(a, b, middle, LONG) > 0:
                under = middle
            else:
                over = middle
        return root_near(a, b, (under + over) / 2, (over - under) / 2)


def root_near(a: Body, b: Body, t: Any, step: Any) -> Any:
    """The root of the gap next to ``t``, by secants."""
    with mpmath.workdps(DIGITS):
        x, y = mpmath.mpf(t) - step, mpmath.mpf(t)
        fx, fy = gap(a, b, x, LONG), gap(a, b, y, LONG)
        for _ in range(8):
            if fx == fy or abs(fy) < mpmath.mpf(10) ** (5 - DIGITS):
                break
            x, y, fx = y, y - fy * (y - x) / (fy - fx), fy
            fy = gap(a, b, y, LONG)
        return y


# Cases


def unit(rng: np.random.Generator) -> Any:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def quaternion(rng: np.random.Generator) -> Any:
    q = rng.normal(size=4)
    return tuple((q / np.linalg.norm(q)).tolist())


def facing(normal: Any, rng: np.random.Generator) -> Any:
    """An orientation that turns x to ``normal``."""
    x = np.array((1.0, 0.0, 0.0))
    q = np.array((1.0 + float(x @ normal), *np.cross(x, normal)))
    return tuple((q / np.linalg.norm(q)).tolist())


STRIKERS = ("sphere", "sphere", "sphere", "capsule", "capsule", "box")
TARGETS = {
    "sphere": ("plane", "sphere", "plate", "capsule", "wall", "driven wall", "spun plate"),
    "capsule": ("plane", "sphere", "capsule", "wall", "driven wall"),
    "box": ("plane", "sphere", "wall", "driven wall"),
}


def case(number: int) -> tuple[Body, Body, float]:
    """Striker, target, and the time in which the striker passes the middle of the target."""
    rng = np.random.default_rng((9, number))
    kind = STRIKERS[int(rng.integers(len(STRIKERS)))]
    speed = float(10.0 ** rng.uniform(1.0, 4.0))
    size = float(10.0 ** rng.uniform(-3.0, -0.3))
    spin = unit(rng) * float(10.0 ** rng.uniform(0.0, 2.5))
    shape: Any = xp.Sphere(size)
    if kind == "capsule":
        shape = xp.Capsule(size, float(rng.uniform(0.5, 10.0)) * size)
    elif kind == "box":
        edge = float(rng.uniform(0.1, 1.0)) * size
        shape = xp.Box((edge, edge, float(rng.uniform(0.1, 4.0)) * size))
    direction = unit(rng)
    target = _target(TARGETS[kind][int(rng.integers(len(TARGETS[kind])))], direction, size, speed, rng)
    distance = float(10.0 ** rng.uniform(0.5, 3.0)) * (size + 0.1)
    time = distance / speed
    aside = np.cross(direction, unit(rng)) * size * float(rng.uniform(0.0, 2.5))
    goal = np.array(target.position) + np.array(target.velocity) * time + aside
    striker = Body(shape, goal - direction * distance, direction * speed, quaternion(rng), spin)
    return striker, target, time


def _target(name: str, direction: Any, size: float, speed: float, rng: np.random.Generator) -> Body:
    middle = rng.normal(size=3)
    still = (0.0, 0.0, 0.0)
    lean = -direction + 0.6 * unit(rng)
    lean = lean / np.linalg.norm(lean)
    if name == "plane":
        return Body(xp.Plane(tuple(lean.tolist())), middle, still, fixed=True)
    if name == "sphere":
        return Body(xp.Sphere(float(rng.uniform(0.3, 3.0)) * size), middle, unit(rng) * speed * 0.1, mass=2.0)
    if name == "capsule":
        shape = xp.Capsule(float(rng.uniform(0.2, 1.0)) * size, float(rng.uniform(1.0, 6.0)) * size)
        return Body(
            shape, middle, unit(rng) * speed * 0.1, quaternion(rng), unit(rng) * float(10.0 ** rng.uniform(0.0, 2.5))
        )
    if name == "plate":
        return Body(xp.Box((1e-3, 4.0 * size, 3.0 * size)), middle, still, quaternion(rng), fixed=True)
    if name == "spun plate":
        shape = xp.Box((3.0 * size, 3.0 * size, 0.05 * size))
        return Body(
            shape, middle, unit(rng) * speed * 0.05, quaternion(rng), unit(rng) * float(10.0 ** rng.uniform(0.0, 2.5))
        )
    shape = xp.Box((0.02, 1e3 * (size + 0.1), 1e3 * (size + 0.1)))
    return Body(shape, middle, unit(rng) * speed * 0.3, facing(lean, rng), mass=1e6, driven=name == "driven wall")
