"""When two turning bodies meet: conservative advancement along a direction that turns with what it is fixed to.

At an instant some unit vector n parts the two bodies by g > 0. Let n turn at any constant rate w from there on: as long as
it parts them they cannot touch. The gap along n between corner i of one and corner j of the other starts at g_ij with the
rate r_ij, and its second rate is not below -C, for a bound C over the window looked at. So there is no touch before the
first root of g_ij + r_ij s - C s^2 / 2 over all pairs of corners, and the search goes on from there. Where w is that of
the face or the edges that will touch, r_ij is the true rate of the gap there: the steps end like Newton's, and always
before the impact.

Advancing by what cannot happen is conservative advancement (Mirtich, Impulse-based Dynamic Simulation of Rigid Body
Systems, thesis, Berkeley 1996); directed bounds on motion are those of Zhang, Redon, Lee & Kim (ACM Trans. Graph. 26
(2007) 15). The bound of second order is made here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import ContactError
from xpheve.kernels.vector import Vec, cross, dot, norm, sub
from xpheve_laws_collision.impact_time.path import Path
from xpheve_laws_collision.impact_time.sphere_plane import sphere_plane
from xpheve_laws_collision.impact_time.sphere_sphere import sphere_sphere

if TYPE_CHECKING:
    from xpheve_laws_collision.narrow_phase import Mover

Array = NDArray[np.float64]

STEPS = 2_000  # of one search
FAST = 1e140  # [m/s]: squares of more than this are near the end of floats
INSIDE = (
    1e-2  # of a size: how finely overlapping bodies that come apart are followed; there is nothing left to pass through
)
FAR = 1.01  # bounding spheres this much larger decide how far a search may jump


class UndecidedError(ContactError):
    """A search that has shown that there is no impact before ``until`` [s], and cannot go on for ever.

    Bodies that turn near each other without end have no last instant to look at: ask again from ``until``, or with a
    horizon.
    """

    def __init__(self, until: float, what: str = "no impact") -> None:
        super().__init__(
            f"{what} within {until} s, and {STEPS} steps do not tell what comes after: "
            "bodies that turn about each other without end. Ask with a shorter horizon"
        )
        self.until = until


class Pair(Protocol):
    """What the search needs of two bodies: their paths, and how they stand."""

    path_a: Path
    path_b: Path
    reach_a: float
    reach_b: float
    """Greatest distance [m] of a corner and its radius from the centre; 0 for a plane."""
    outward: Vec | None
    """The plane's normal, if b is one that does not turn."""
    plane_offset: float

    def stand(self, s: float) -> Stand:
        """How they stand ``s`` [s] later."""
        ...


class Stand(Protocol):
    """A direction that parts the two, and the corners along it: see `narrow_phase.standing`."""

    separation: float
    touch: float
    size: float
    normal: Vec
    moved: Vec
    corners_a: Array
    corners_b: Array
    radii: float

    def turning(self) -> Vec: ...

    def pressing(self) -> tuple[float, float, float]:
        """Speed [m/s], second rate [m/s^2] and still speed [m/s] of the touching point that approaches fastest."""
        ...


def first_impact(pair: Pair, horizon: float) -> float:
    """Time [s] in [0, horizon] until the two touch and approach; infinite if they do not.

    What touches and separates is found when it comes back, be it with another corner. What touches and is still is a
    support if it is pressed together, and no impact. What overlaps and separates is found at the instant at which it
    turns back before it is out, to a hundredth of the time in which it moves by its size.

    Raises
    ------
    UndecidedError
        After `STEPS` steps.
    """
    t = 0.0
    for _ in range(STEPS):
        jump = far_jump(pair, t)
        if jump > 0.0:
            t += jump
            if not t <= horizon or t == math.inf:
                return math.inf
        stand = pair.stand(t)
        if stand.separation <= stand.touch:
            speed, rate, still = stand.pressing()
            if speed < -still:
                return arrived(pair, t, stand.separation, speed, horizon)
            if speed <= still and rate < 0.0 and t == 0.0:
                return math.inf  # a support
        s = safe_step(pair, t, stand, horizon - t)
        if stand.separation < -stand.touch:
            s = max(s, INSIDE * _crossing(pair, t, stand.size))
        if t + s == t and s < math.inf:
            # The clock cannot tell the rest of the way from none.
            if stand.pressing()[0] < 0.0:
                return t
            s = math.nextafter(t, math.inf) - t
        t += s
        if t == math.inf or t > horizon:
            return math.inf
    raise UndecidedError(t)


def _crossing(pair: Pair, t: float, size: float) -> float:
    """About how long [s] the two take to move by ``size`` [m] against each other; 0 if they do not."""
    a, b = pair.path_a.at(t), pair.path_b.at(t)
    speed = norm(sub(b.velocity, a.velocity)) + size * (norm(a.angular_velocity) + norm(b.angular_velocity))
    speed += math.sqrt(size * norm(sub(b.acceleration, a.acceleration)))
    return size / speed if 0.0 < speed < math.inf else 0.0


def arrived(pair: Pair, t: float, separation: float, speed: float, horizon: float) -> float:
    """The instant of the touch from one within ``touch`` of it: a last Newton step, if it helps."""
    if t == 0.0 or separation <= 0.0:
        return t
    refined = t + separation / -speed
    # Where it has only just turned to approach, the speed says little of the way that is left.
    if refined <= horizon and abs(pair.stand(refined).separation) <= separation:
        return refined
    return t


def far_jump(pair: Pair, t: float) -> float:
    """How long the bounding spheres stay apart [s]; 0 if they are not, infinite if they never meet."""
    return balls_apart(
        pair.path_a.at(t), pair.path_b.at(t), pair.reach_a, pair.reach_b, pair.outward, pair.plane_offset
    )


def balls_apart(a: Mover, b: Mover, reach_a: float, reach_b: float, outward: Vec | None, offset: float) -> float:
    """How long the balls of radii ``reach_a`` and ``reach_b`` [m] about two bodies stay apart [s]; 0 if they are not.

    Of a plane that does not turn ``outward`` is its unit normal and ``offset`` its level [m] in its own frame.
    """
    d, v, acceleration = sub(b.position, a.position), sub(b.velocity, a.velocity), sub(b.acceleration, a.acceleration)
    if outward is not None:
        height = -dot(outward, d) - offset
        if height <= FAR * reach_a:
            return 0.0
        gap = height - 0.5 * (1.0 + FAR) * reach_a
        return sphere_plane(gap, -dot(outward, v), -dot(outward, acceleration), 0.0, 0.0, math.inf)
    reach = reach_a + reach_b
    if not norm(d) > FAR * reach or reach == math.inf:
        return 0.0
    return sphere_sphere(d, v, acceleration, 0.5 * (1.0 + FAR) * reach, 0.0, 0.0, math.inf)


def safe_step(pair: Pair, t: float, stand: Stand, left: float) -> float:
    """A time [s] within which the two cannot touch, the longer of that of a fixed and of a turning direction."""
    fixed = _step(pair, t, stand, (0.0, 0.0, 0.0), min(left, pair.path_a.window(t), pair.path_b.window(t)))
    w = stand.turning()
    if fixed == math.inf or w == (0.0, 0.0, 0.0):
        return fixed
    a, b = pair.path_a.at(t), pair.path_b.at(t)
    v, acceleration = norm(sub(b.velocity, a.velocity)), norm(sub(b.acceleration, a.acceleration))
    # About as long as it takes to move by a size; but for that any window would do.
    window = stand.size / (v + norm(w) * stand.size + math.sqrt(acceleration * stand.size))
    return max(fixed, _step(pair, t, stand, w, min(left, window, pair.path_a.window(t), pair.path_b.window(t))))


def _step(pair: Pair, t: float, stand: Stand, w: Vec, window: float) -> float:
    a, b = pair.path_a.at(t), pair.path_b.at(t)
    n = np.array(stand.normal)
    v, acceleration = sub(b.velocity, a.velocity), sub(b.acceleration, a.acceleration)
    along = dot(stand.normal, stand.moved) - stand.radii
    rate = dot(stand.normal, sub(v, cross(w, stand.moved)))
    rates_a = stand.corners_a @ np.array(cross(stand.normal, sub(a.angular_velocity, w)))
    rates_b = stand.corners_b @ np.array(cross(stand.normal, sub(b.angular_velocity, w)))
    gaps = (along + stand.corners_b @ n)[None, :] - (stand.corners_a @ n)[:, None]
    slopes = (rate + rates_b)[None, :] - rates_a[:, None]
    bend = _bends(pair, t, window, stand, w)
    if w == (0.0, 0.0, 0.0):
        bend -= dot(stand.normal, acceleration)
    else:
        rate_w, pull = norm(w), norm(acceleration)
        far = norm(stand.moved) + window * (norm(v) + 0.5 * window * pull)
        bend += pull + 2.0 * rate_w * (norm(v) + window * pull) + rate_w * rate_w * far
    if not bend < math.inf:
        if w != (0.0, 0.0, 0.0):
            return 0.0  # the fixed direction tells
        raise ContactError(
            f"bodies turn at {a.angular_velocity} and {b.angular_velocity} rad/s: no float holds the square of such a rate, "
            "so it is not known when they touch"
        )
    gaps = np.maximum(gaps, 0.0)
    s = _first_root(gaps, slopes, bend)
    if stand.separation <= stand.touch and s * s * bend < stand.touch:
        # What counts as none may be used up: without it a graze would take for ever.
        s = _first_root(gaps + 0.5 * stand.touch, slopes, bend)
    return min(s, window if _bounded(pair, w) else math.inf)


def _bounded(pair: Pair, w: Vec) -> bool:
    """Whether the bounds hold for the window only."""
    return w != (0.0, 0.0, 0.0) or min(pair.path_a.window(0.0), pair.path_b.window(0.0)) < math.inf


def _bends(pair: Pair, t: float, window: float, stand: Stand, w: Vec) -> float:
    """Bound [m/s^2] on what turning adds to the second rate of the gap of any two corners."""
    total = 0.0
    for path, corners in ((pair.path_a, stand.corners_a), (pair.path_b, stand.corners_b)):
        omega = path.at(t).angular_velocity
        if path.steady and omega == w:
            continue  # at rest in the turning frame
        reach = math.sqrt(float((corners * corners).sum(axis=1).max()))
        rate, change = path.bounds(t, window if window < math.inf else 0.0)
        if path.steady and w == (0.0, 0.0, 0.0):
            total += norm(cross(stand.normal, omega)) * norm(omega) * reach
        else:
            most = rate + norm(w)
            total += (change + most * most) * reach
    return total


def _first_root(gaps: Array, slopes: Array, bend: float) -> float:
    """The least positive s at which some gap + slope s - bend s^2 / 2 is 0; infinite if none is."""
    fastest = float(np.abs(slopes).max())
    if FAST < fastest < math.inf:
        unit = math.ldexp(1.0, -math.frexp(fastest)[1])  # [s]
        return unit * _first_root(gaps, slopes * unit, bend * unit * unit)
    inside = slopes * slopes + 2.0 * bend * gaps
    falling = slopes < 0.0
    root = np.sqrt(np.maximum(inside, 0.0))
    times = np.full(gaps.shape, math.inf)
    meets = falling & (inside >= 0.0)
    times[meets] = 2.0 * gaps[meets] / (root[meets] - slopes[meets])
    if bend > 0.0:
        back = ~falling
        times[back] = (slopes[back] + root[back]) / bend
    return float(times.min())


def is_apart(stand: Stand) -> bool:
    """Whether what may touch or overlap is apart, or touches and opens."""
    speed, rate, still = stand.pressing()
    opens = speed > still or (abs(speed) <= still and rate > 0.0)
    return stand.separation > stand.touch or (stand.separation >= -stand.touch and opens)


def first_leave(pair: Pair, horizon: float, start: float = 0.0) -> float:
    """Time [s] in [start, horizon] at which the separation goes from at most 0 to more; infinite if it does not.

    At the start they touch or overlap.

    The separation changes no faster than the surfaces move: a depth divided by that bound is a time in which the two
    cannot come apart. The instant is right to what counts as touching.

    Raises
    ------
    UndecidedError
        After `STEPS` steps.
    """
    t = start
    for _ in range(STEPS):
        stand = pair.stand(t)
        if is_apart(stand):
            return t
        jump = deep_jump(pair, t)
        if jump > 0.0:
            t += jump
            if not t <= horizon or t == math.inf:
                return math.inf
            continue
        a, b = pair.path_a.at(t), pair.path_b.at(t)
        v, acceleration = sub(b.velocity, a.velocity), sub(b.acceleration, a.acceleration)
        if pair.outward is None:
            surface, pull = norm(v), norm(acceleration)
        else:  # only what goes along the plane's normal opens
            surface, pull = max(-dot(pair.outward, v), 0.0), max(-dot(pair.outward, acceleration), 0.0)
        surface += _spin(pair.path_a, t, pair.reach_a) + _spin(pair.path_b, t, pair.reach_b)
        depth = max(-stand.separation, stand.touch)
        if surface == 0.0 and pull == 0.0:
            return math.inf
        s = min(
            2.0 * depth / (surface + math.sqrt(surface * surface + 2.0 * pull * depth)),
            pair.path_a.window(t),
            pair.path_b.window(t),
        )
        t = max(t + s, math.nextafter(t, math.inf))
        if t > horizon:
            return math.inf
    raise UndecidedError(t, "no parting")


def deep_jump(pair: Pair, t: float) -> float:
    """How long the bounding sphere stays behind the plane [s]: 0 if it reaches it, infinite if it never comes back."""
    if pair.outward is None:
        return 0.0
    a, b = pair.path_a.at(t), pair.path_b.at(t)
    d, v, acceleration = sub(b.position, a.position), sub(b.velocity, a.velocity), sub(b.acceleration, a.acceleration)
    depth = dot(pair.outward, d) + pair.plane_offset
    if depth <= FAR * pair.reach_a:
        return 0.0
    gap = depth - 0.5 * (1.0 + FAR) * pair.reach_a
    return sphere_plane(gap, dot(pair.outward, v), dot(pair.outward, acceleration), 0.0, 0.0, math.inf)


def _spin(path: Path, t: float, reach: float) -> float:
    rate, _ = path.bounds(t, path.window(t) if path.window(t) < math.inf else 0.0)
    return rate * reach if reach < math.inf else 0.0


__all__ = ["STEPS", "UndecidedError", "balls_apart", "first_impact", "first_leave", "is_apart"]
