"""When the spheres of two flights meet, or that of one and a fixed shape: functions of the flights, and of nothing else.

A prediction is made from the later of the two clocks, whenever it is asked for, so that cells, queues and the order of work change none of
its bits. What is quickly seen to pass, or to come after what is known already, is left out before the closed form is evaluated.
"""

from __future__ import annotations

import math
from typing import Any

from xpheve.kernels.clock import elapsed, later
from xpheve.kernels.vector import Vec, dot, norm, scale
from xpheve_laws_collision.impact.declared import solid_time
from xpheve_laws_collision.impact.limits import BRIEF, LOADED, STILL, TOUCH, ULPS, vector
from xpheve_laws_collision.impact.rows import (
    CENTRE,
    IMPACT,
    KIND,
    NOTHING,
    PLANE,
    PULL,
    RADIUS,
    REST,
    SCENERIES,
    SIZE,
    SPHERE,
    STATES,
    TIME,
    TOUCHES,
    WRAPS,
    V,
    X,
)
from xpheve_laws_collision.impact_time.sphere_plane import sphere_plane
from xpheve_laws_collision.impact_time.sphere_sphere import FAST, chord, sphere_sphere

NEAR = 4e-6  # of the square of the distance: so near, the closed form says whether they touch
SURE = 1e-13  # of its terms: a discriminant below minus this is negative


def moved(x: Vec, v: Vec, a: Vec, s: float) -> Vec:
    """Where a flight is ``s`` [s] after its clock."""
    h = 0.5 * s
    return (x[0] + s * (v[0] + h * a[0]), x[1] + s * (v[1] + h * a[1]), x[2] + s * (v[2] + h * a[2]))


def sped(v: Vec, a: Vec, s: float) -> Vec:
    """How fast it is then."""
    return (v[0] + s * a[0], v[1] + s * a[1], v[2] + s * a[2])


def sizes(a: Vec) -> float:
    """The sum of the sizes of the components."""
    return abs(a[0]) + abs(a[1]) + abs(a[2])


def meeting(state: Any, i: int, j: int, k: Vec, box: Vec, until: tuple[float, float]) -> tuple[float, float, int]:
    """When places ``i`` and ``j`` meet next, and how; later than ``until`` nobody wants to know.

    Parameters
    ----------
    state
        The flights.
    k
        By how many box lengths the image of ``j`` is off, less its own wraps.
    box
        Lengths [m] of the periodic box; 0 where it is open.
    until
        An instant. An impact that comes surely after it may be left out.

    Returns
    -------
    tuple
        The instant, and `IMPACT`, `REST` or `NOTHING`, with `TOUCHES` if they touch at the later of the two clocks.
    """
    a = STATES * i
    b = STATES * j
    clock = (state[a + TIME], state[a + TIME + 1])
    other = (state[b + TIME], state[b + TIME + 1])
    xa = vector(state, a + X)
    va = vector(state, a + V)
    aa = vector(state, a + PULL)
    xb = vector(state, b + X)
    vb = vector(state, b + V)
    ab = vector(state, b + PULL)
    s = elapsed(clock, other)
    if s > 0.0:
        xb = moved(xb, vb, ab, s)
        vb = sped(vb, ab, s)
    elif s < 0.0:
        xa = moved(xa, va, aa, -s)
        va = sped(va, aa, -s)
        clock = other
    d0 = (
        (xb[0] - xa[0]) + (k[0] - state[b + WRAPS]) * box[0],
        (xb[1] - xa[1]) + (k[1] - state[b + WRAPS + 1]) * box[1],
        (xb[2] - xa[2]) + (k[2] - state[b + WRAPS + 2]) * box[2],
    )
    d1 = (vb[0] - va[0], vb[1] - va[1], vb[2] - va[2])
    d2 = (ab[0] - aa[0], ab[1] - aa[1], ab[2] - aa[2])
    distance = state[a + RADIUS] + state[b + RADIUS]
    square = distance * distance
    far = dot(d0, d0)
    swift = dot(d1, d1)
    margin = 2.0 * ULPS * (sizes(xa) + sizes(xb))
    near = far <= square + NEAR * square + margin * (2.0 * distance + margin)
    span = math.inf
    how = NOTHING
    if not near and d2[0] == 0.0 and d2[1] == 0.0 and d2[2] == 0.0 and swift < FAST:
        along = dot(d0, d1)
        if not along < 0.0:
            return (math.inf, 0.0, NOTHING)
        left = far - square
        inside = along * along - swift * left
        if inside < -SURE * swift * far:
            return (math.inf, 0.0, NOTHING)
        about = left / (math.sqrt(max(inside, 0.0)) - along)
        if 0.999 * about > (until[0] - clock[0]) + (until[1] - clock[1]):
            return (math.inf, 0.0, NOTHING)
        root = chord(d0, d1, distance)
        if not root > STILL * (math.sqrt(dot(va, va)) + math.sqrt(dot(vb, vb))) * distance:
            return (math.inf, 0.0, NOTHING)
        r = math.sqrt(far)
        span = (r - distance) * (r + distance) / (root - along)
        how = IMPACT
    else:
        if not near:
            window = (until[0] - clock[0]) + (until[1] - clock[1])
            if sizes(d1) * window + 0.5 * sizes(d2) * window * window < 0.999 * (math.sqrt(far) - distance):
                return (math.inf, 0.0, NOTHING)
        span, how = closely(d0, d1, d2, distance, xa, va, aa, xb, vb, ab)
    if span == math.inf:
        return (math.inf, 0.0, how)
    high, low = later(clock, span)
    return (high, low, how)


def closely(
    d0: Vec, d1: Vec, d2: Vec, distance: float, xa: Vec, va: Vec, aa: Vec, xb: Vec, vb: Vec, ab: Vec
) -> tuple[float, int]:
    """When two spheres meet, [s] from now, and how, with all cases of touching and rest."""
    length = norm(d0)
    normal = scale(d0, 1.0 / length) if length > 0.0 else (0.0, 0.0, 1.0)
    speed = dot(normal, d1)
    bend = max((dot(d1, d1) - speed * speed) / length, 0.0) if length > 0.0 else 0.0
    closing = dot(normal, d2) + bend
    touch = TOUCH * distance + ULPS * (norm(xa) + norm(xb))
    still = STILL * (norm(va) + norm(vb)) + BRIEF * max(0.0, -closing)
    gap = length - distance
    how = TOUCHES if abs(gap) <= touch else NOTHING
    if gap <= touch and abs(speed) <= still and closing < 0.0 and distance > 0.0:
        if -closing > LOADED * (norm(aa) + norm(ab) + (dot(va, va) + dot(vb, vb)) / distance):
            return (0.0, how + REST)
    if how == TOUCHES and speed > still:
        d0 = scale(normal, distance)  # a gap that counts as none is none
    span = sphere_sphere(d0, d1, d2, distance, touch, still, math.inf)
    return (span, how + IMPACT) if span < math.inf else (span, how)


def hit(state: Any, i: int, shape: Any, row: int) -> tuple[float, int]:
    """When place ``i`` meets the fixed shape ``row`` next, [s] after its clock, and how: as in `meeting`."""
    a = STATES * i
    c = SCENERIES * row
    kind = int(shape[c + KIND])
    x = vector(state, a + X)
    v = vector(state, a + V)
    pull = vector(state, a + PULL)
    radius = state[a + RADIUS]
    if kind == PLANE:
        return plane_hit(vector(shape, c + CENTRE), shape[c + SIZE], x, v, pull, radius)
    centre = vector(shape, c + CENTRE)
    if kind != SPHERE:
        return solid_time(shape, c, x, v, pull, radius)
    zero = (0.0, 0.0, 0.0)
    d0 = (centre[0] - x[0], centre[1] - x[1], centre[2] - x[2])
    d1 = (0.0 - v[0], 0.0 - v[1], 0.0 - v[2])
    d2 = (0.0 - pull[0], 0.0 - pull[1], 0.0 - pull[2])
    return closely(d0, d1, d2, radius + shape[c + SIZE], x, v, pull, centre, zero, zero)


def plane_hit(n: Vec, level: float, x: Vec, v: Vec, pull: Vec, radius: float) -> tuple[float, int]:
    """`hit` of a plane."""
    gap = dot(n, x) - level - radius
    speed = dot(n, v)
    closing = dot(n, pull)
    if speed >= 0.0 and closing >= 0.0 and gap > radius * NEAR + 2.0 * ULPS * (sizes(x) + abs(level)):
        return (math.inf, NOTHING)
    touch = TOUCH * radius + ULPS * (norm(x) + abs(level))
    still = STILL * norm(v) + BRIEF * max(0.0, -closing)
    how = TOUCHES if abs(gap) <= touch else NOTHING
    if gap <= touch and abs(speed) <= still and closing < 0.0:
        if -closing > LOADED * (norm(pull) + (dot(v, v) / radius if radius > 0.0 else 0.0)):
            return (0.0, how + REST)
    span = sphere_plane(0.0 if how == TOUCHES else gap, speed, closing, touch, still, math.inf)
    return (span, how + IMPACT) if span < math.inf else (span, how)


def touch_of(shape: Any, row: int, x: Vec, radius: float) -> float:
    """The gap [m] to a fixed shape that counts as touching."""
    c = SCENERIES * row
    if int(shape[c + KIND]) == PLANE:
        level: float = shape[c + SIZE]
        return TOUCH * radius + ULPS * (norm(x) + abs(level))
    size: float = shape[c + SIZE + 3] if int(shape[c + KIND]) != SPHERE else shape[c + SIZE]
    return TOUCH * (radius + size) + ULPS * (norm(x) + norm(vector(shape, c + CENTRE)))
