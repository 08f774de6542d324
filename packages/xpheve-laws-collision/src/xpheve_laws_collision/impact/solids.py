"""Fixed boxes and capsules: when a sphere meets them, and how it stands to them. Both are boxes of whose edges some may be 0, rounded."""

from __future__ import annotations

import math
from typing import Any

from xpheve.kernels.vector import Vec, dot, norm
from xpheve_laws_collision.impact.limits import BRIEF, LOADED, STILL, TOUCH, ULPS, vector
from xpheve_laws_collision.impact.rows import CAPSULE, CENTRE, IMPACT, KIND, NOTHING, REST, SIZE, TOUCHES, TURN
from xpheve_laws_collision.impact_time.rounded_box import ball_box, second_rate, standing


def inward(shape: Any, c: int, a: Vec) -> Vec:
    """A vector of the world in the frame of the shape."""
    t = c + TURN
    return (
        shape[t] * a[0] + shape[t + 3] * a[1] + shape[t + 6] * a[2],
        shape[t + 1] * a[0] + shape[t + 4] * a[1] + shape[t + 7] * a[2],
        shape[t + 2] * a[0] + shape[t + 5] * a[1] + shape[t + 8] * a[2],
    )


def outward(shape: Any, c: int, a: Vec) -> Vec:
    """A vector of the frame of the shape in the world."""
    t = c + TURN
    return (
        shape[t] * a[0] + shape[t + 1] * a[1] + shape[t + 2] * a[2],
        shape[t + 3] * a[0] + shape[t + 4] * a[1] + shape[t + 5] * a[2],
        shape[t + 6] * a[0] + shape[t + 7] * a[1] + shape[t + 8] * a[2],
    )


def rounded(shape: Any, c: int, radius: float) -> tuple[Vec, float]:
    """Half edges [m] of the box, and the radius [m] of the ball that meets it."""
    if int(shape[c + KIND]) == CAPSULE:
        return ((0.0, 0.0, shape[c + SIZE + 1]), shape[c + SIZE] + radius)
    return (vector(shape, c + SIZE), radius)


def seen(shape: Any, c: int, x: Vec) -> Vec:
    """Where a point is in the frame of the shape."""
    return inward(shape, c, (x[0] - shape[c + CENTRE], x[1] - shape[c + CENTRE + 1], x[2] - shape[c + CENTRE + 2]))


def solid_time(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, int]:
    """When a sphere meets the shape, [s] from now, and how."""
    d0 = seen(shape, c, x)
    d1 = inward(shape, c, v)
    d2 = inward(shape, c, pull)
    half, reach = rounded(shape, c, radius)
    distance, nx, ny, nz = standing(d0, half)
    gap = distance - reach
    speed = nx * d1[0] + ny * d1[1] + nz * d1[2]
    rate = second_rate(d0, d1, d2, half)
    size = norm(half) + reach
    touch = TOUCH * size + ULPS * (norm(x) + norm(vector(shape, c + CENTRE)))
    still = STILL * norm(v) + BRIEF * max(0.0, 0.0 - rate)
    how = TOUCHES if abs(gap) <= touch else NOTHING
    if gap <= touch and abs(speed) <= still and rate < 0.0:
        if 0.0 - rate > LOADED * (norm(pull) + dot(v, v) / size):
            return (0.0, how + REST)
    span = ball_box(d0, d1, d2, half, reach, touch, still, math.inf)
    return (span, how + IMPACT) if span < math.inf else (span, how)


def solid_gap(shape: Any, c: int, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, Vec, float]:
    """How far they are apart, the unit normal towards the shape, and the second rate of the gap."""
    d0 = seen(shape, c, x)
    half, reach = rounded(shape, c, radius)
    distance, nx, ny, nz = standing(d0, half)
    rate = second_rate(d0, inward(shape, c, v), inward(shape, c, pull), half)
    return (distance - reach, outward(shape, c, (0.0 - nx, 0.0 - ny, 0.0 - nz)), rate)
