"""When a turning body of a few corners meets a plane that does not turn: conservative advancement, corner by corner.

The direction that parts the two is the plane's normal n for good, so that nothing has to be searched for. Seen from the body n turns: with
m = R^T n and w the angular velocity in the body's frame, corner v is n . x + m . v above the plane and rises at n . x' + v . (m x w). The
rest is as in `advancement`: no corner comes down before the first root of its gap + rate s - C s^2 / 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from xpheve.kernels.quaternion import rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, dot, norm, sub
from xpheve_laws_collision.impact_time.advancement import FAST, INSIDE, STEPS, UndecidedError, balls_apart
from xpheve_laws_collision.impact_time.path import Path, angular_acceleration
from xpheve_laws_collision.narrow_phase import TOUCH, ULPS, Mover, still_speed

FEW = 16  # corners; with more, arrays are faster


class PlaneSearch:
    """A body's path over a plane: corners [m] in the body's frame, their radius [m], the plane's normal and level [m]."""

    def __init__(self, path: Path, plane: Mover, corners: Sequence[Vec], radius: float, reach: float, up: Vec) -> None:
        self.path, self.plane, self.corners, self.radius, self.reach, self.up = path, plane, corners, radius, reach, up
        self.offset = float(plane.shape.offset)
        self.lift = dot(up, sub(path.start.acceleration, plane.acceleration))
        """Second rate [m/s^2] of the centre's height."""

    def centre(self, s: float) -> tuple[Mover, Vec, Vec]:
        """The body ``s`` [s] later, its place and velocity as seen from the plane's."""
        body, plane = self.path.at(s), self.plane
        if any(plane.velocity) or any(plane.acceleration):
            plane = plane.at(s)
        return body, sub(body.position, plane.position), sub(body.velocity, plane.velocity)

    def stand(self, s: float) -> tuple[list[float], list[float]]:
        """Gap [m] and rate [m/s] of each corner."""
        body, d, v = self.centre(s)
        m = rotate_inverse(body.orientation, self.up)
        c = cross(m, rotate_inverse(body.orientation, body.angular_velocity))
        height, rate = dot(self.up, d) - self.offset - self.radius, dot(self.up, v)
        return [height + dot(m, corner) for corner in self.corners], [rate + dot(c, corner) for corner in self.corners]

    def touch(self, s: float) -> float:
        """The gap [m] that is none."""
        body = self.path.at(s)
        return TOUCH * self.reach + ULPS * (norm(body.position) + norm(self.plane.position) + abs(self.offset))

    def pressing(self, s: float, gaps: list[float], rates: list[float], touch: float) -> tuple[float, float, float]:
        """Speed [m/s], second rate [m/s^2] and still speed [m/s] of the touching corner that approaches fastest."""
        level = max(min(gaps), 0.0) + touch
        speed, k = min((rate, k) for k, (gap, rate) in enumerate(zip(gaps, rates, strict=True)) if gap <= level)
        body, _, v = self.centre(s)
        q, omega = body.orientation, body.angular_velocity
        m, w = rotate_inverse(q, self.up), rotate_inverse(q, omega)
        arm = sub(self.corners[k], (self.radius * m[0], self.radius * m[1], self.radius * m[2]))
        change = rotate_inverse(q, angular_acceleration(body))
        rate = self.lift + dot(m, add(cross(change, arm), cross(w, cross(w, arm))))
        return speed, rate, still_speed(norm(v) + norm(omega) * self.reach, rate)

    def bend(self, s: float, window: float) -> float:
        """Bound [m/s^2] on how fast the rate of any corner falls."""
        omega = self.path.at(s).angular_velocity
        if self.path.steady:
            return norm(cross(self.up, omega)) * norm(omega) * self.reach - self.lift
        rate, change = self.path.bounds(s, window if window < math.inf else 0.0)
        return (change + rate * rate) * self.reach - self.lift

    def crossing_time(self, s: float) -> float:
        """About how long [s] the body takes to move by its size; 0 if it does not."""
        body, _, v = self.centre(s)
        speed = norm(v) + self.reach * norm(body.angular_velocity) + math.sqrt(self.reach * abs(self.lift))
        return self.reach / speed if 0.0 < speed < math.inf else 0.0


def first_impact_on_plane(search: PlaneSearch, horizon: float) -> float:
    """As `advancement.first_impact`.

    Raises
    ------
    UndecidedError
        After `STEPS` steps.
    """
    t = 0.0
    near = False
    for _ in range(STEPS):
        if not near:
            body, plane = search.path.at(t), search.plane if t == 0.0 else search.plane.at(t)
            jump = balls_apart(body, plane, search.reach, 0.0, search.up, search.offset)
            near = jump == 0.0
            t += jump
            if not t <= horizon or t == math.inf:
                return math.inf
        gaps, rates = search.stand(t)
        separation, touch = min(gaps), search.touch(t)
        near = separation < search.reach
        if separation <= touch:
            speed, rate, still = search.pressing(t, gaps, rates, touch)
            if speed < -still:
                return _arrived(search, t, separation, speed, horizon)
            if speed <= still and rate < 0.0 and t == 0.0:
                return math.inf  # a support
        s = _safe_step(search, t, gaps, rates, touch, horizon - t)
        if separation < -touch:
            s = max(s, INSIDE * search.crossing_time(t))
        if t + s == t and s < math.inf:
            if search.pressing(t, gaps, rates, touch)[0] < 0.0:
                return t
            s = math.nextafter(t, math.inf) - t
        t += s
        if t == math.inf or t > horizon:
            return math.inf
    raise UndecidedError(t)


def _arrived(search: PlaneSearch, t: float, separation: float, speed: float, horizon: float) -> float:
    """The instant of the touch from one within ``touch`` of it: a last Newton step, if it helps."""
    if t == 0.0 or separation <= 0.0:
        return t
    refined = t + separation / -speed
    if refined <= horizon and abs(min(search.stand(refined)[0])) <= separation:
        return refined
    return t


def _safe_step(
    search: PlaneSearch, t: float, gaps: list[float], rates: list[float], touch: float, left: float
) -> float:
    """A time [s] within which no corner can come down."""
    window = min(left, search.path.window(t))
    bend = search.bend(t, window)
    s = first_root([max(gap, 0.0) for gap in gaps], rates, bend)
    if min(gaps) <= touch and s * s * bend < touch:
        # What counts as none may be used up: without it a graze would take for ever.
        s = first_root([max(gap, 0.0) + 0.5 * touch for gap in gaps], rates, bend)
    return min(s, window if search.path.window(0.0) < math.inf else math.inf)


def first_root(gaps: list[float], slopes: list[float], bend: float) -> float:
    """The least positive s at which some gap + slope s - bend s^2 / 2 is 0; infinite if none is."""
    least = math.inf
    for gap, slope in zip(gaps, slopes, strict=True):
        inside = slope * slope + 2.0 * bend * gap
        if slope < 0.0:
            if inside >= 0.0:
                least = min(least, 2.0 * gap / (math.sqrt(inside) - slope))
        elif bend > 0.0:
            least = min(least, (slope + math.sqrt(inside)) / bend)
    return least


def is_in_reach(search: PlaneSearch) -> bool:
    """Whether squares of its speeds are floats."""
    body = search.path.start
    speed = norm(sub(body.velocity, search.plane.velocity)) + norm(body.angular_velocity) * search.reach
    return speed < FAST and search.bend(0.0, search.path.window(0.0)) < math.inf
