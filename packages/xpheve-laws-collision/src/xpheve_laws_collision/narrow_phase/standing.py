"""How two cores, or a core and a plane, stand at an instant: what gaps, contact points and impact times are made of."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import add, cross, dot, norm, scale, sub
from xpheve_laws_collision.impact_time.path import angular_acceleration
from xpheve_laws_collision.narrow_phase import TOUCH, ULPS, Gap, Mover, Vec, still_speed
from xpheve_laws_collision.narrow_phase.axes import EDGES, FACE_A, FACE_B, POINTS, Axis, widest
from xpheve_laws_collision.narrow_phase.clipping import common_points
from xpheve_laws_collision.narrow_phase.cores import Array, Core, Half, matrix
from xpheve_laws_collision.narrow_phase.gjk import nearest

NEAR = 1e-8  # of the sizes: nearer than this a direction comes from faces and edges, not from the nearest points
LEVEL = 1e-9  # of the sizes: contact points this much farther than the deepest one are none


class Standing:
    """Core (or half space) b against core a, in world directions about a's centre.

    ``separation`` [m] is that of the surfaces, ``normal`` points from a to b; ``kind`` says what it is fixed to.
    """

    __slots__ = (
        "a",
        "axis",
        "b",
        "core_a",
        "core_b",
        "corners_a",
        "corners_b",
        "moved",
        "normal",
        "radii",
        "separation",
        "size",
        "touch",
        "witness",
    )  # fmt: skip

    def __init__(self, a: Mover, b: Mover, core_a: Core, core_b: Core | Half) -> None:
        self.a, self.b, self.core_a, self.core_b = a, b, core_a, core_b
        self.moved: Vec = sub(b.position, a.position)
        turn_a = matrix(a.orientation)
        self.corners_a: Array = core_a.vertices @ turn_a.T
        self.witness: Vec | None = None
        """The nearest point of core a, about a's centre, where the nearest points say it."""
        if isinstance(core_b, Half):
            self._against_plane(core_b)
        else:
            self._against_core(core_b, turn_a)
        self.normal: Vec = _vec(self.axis.normal)
        self.radii = core_a.radius + (core_b.radius if isinstance(core_b, Core) else 0.0)

    def _against_plane(self, half: Half) -> None:
        outward = rotate(self.b.orientation, half.normal)
        self.corners_b: Array = np.array([scale(outward, half.offset)])
        normal = -np.array(outward)
        self.size = self.core_a.reach
        height = float((self.corners_a @ -normal).min()) - (dot(outward, self.moved) + half.offset)
        self.axis = Axis(height, normal, FACE_B)
        self.separation = height - self.core_a.radius
        self.touch = TOUCH * self.size + ULPS * (norm(self.a.position) + norm(self.b.position) + abs(half.offset))

    def _against_core(self, core: Core, turn_a: Array) -> None:
        turn_b = matrix(self.b.orientation)
        self.corners_b = core.vertices @ turn_b.T
        self.size = self.core_a.reach + core.reach
        placed = self.corners_b + np.array(self.moved)
        found = nearest(self.corners_a, placed, self.size)
        if found is not None and found.distance > NEAR * self.size:
            self.axis = self._fixed_to(found.distance, found.normal, found.corners)
            self.witness = found.on_a
        else:
            self.axis = widest(self.core_a, core, turn_a, turn_b, self.corners_a, placed)
            if self.axis.distance == -math.inf:
                self.axis = Axis(0.0, np.array((0.0, 0.0, 1.0)), POINTS)  # two points at one place
        self.separation = self.axis.distance - self.core_a.radius - core.radius
        self.touch = TOUCH * self.size + ULPS * (norm(self.a.position) + norm(self.b.position))

    def _fixed_to(self, distance: float, normal: Vec, corners: int) -> Axis:
        """The direction of the nearest points, with what it turns with."""
        n = np.array(normal)
        level = 1e-9 * self.size
        heights, depths = self.corners_a @ n, self.corners_b @ n
        top = np.flatnonzero(heights >= heights.max() - level)
        low = np.flatnonzero(depths <= depths.min() + level)
        if len(top) > 2 and corners > 2:
            return Axis(distance, n, FACE_A)
        if len(low) > 2 and corners > 2:
            return Axis(distance, n, FACE_B)
        first = _along(self.corners_a, top) if len(top) == 2 else None
        second = _along(self.corners_b, low) if len(low) == 2 else None
        return Axis(distance, n, POINTS if first is None and second is None else EDGES, (first, second))

    # Rates

    def turning(self) -> Vec:
        """Angular velocity [rad/s] at which the direction turns with what it is fixed to; 0 where that is not known."""
        if self.axis.kind == FACE_A:
            return self.a.angular_velocity
        if self.axis.kind == FACE_B:
            return self.b.angular_velocity
        if self.axis.kind == EDGES:
            return self._turning_of_edges(*self.axis.edges)
        return (0.0, 0.0, 0.0)

    def _turning_of_edges(self, first: Array | None, second: Array | None) -> Vec:
        """w with (w x n) . e = -n . (omega x e) for each edge e: n stays across."""
        n = self.normal
        e, p = self._leaning(first, self.a)
        f, q = self._leaning(second, self.b)
        cosine = dot(e, f)
        sine = norm(cross(e, f)) ** 2
        if first is None or second is None or sine < 1e-8:
            rate = scale(e, p) if first is not None else scale(f, q)
        else:
            rate = add(scale(e, (p - cosine * q) / sine), scale(f, (q - cosine * p) / sine))
        return cross(n, rate)

    def _leaning(self, edge: Array | None, mover: Mover) -> tuple[Vec, float]:
        """The edge, and the rate at which n has to lean along it."""
        if edge is None:
            return (0.0, 0.0, 0.0), 0.0
        e = _vec(edge)
        return e, -dot(self.normal, cross(mover.angular_velocity, e))

    def speed_at(self, place: Vec) -> float:
        """Rate [m/s] of the gap at ``place`` (about a's centre), of the material there."""
        velocity = sub(self.b.velocity, self.a.velocity)
        turned = sub(
            cross(self.b.angular_velocity, sub(place, self.moved)),
            cross(self.a.angular_velocity, place),
        )
        return dot(self.normal, velocity) + dot(self.normal, turned)

    def acceleration_at(self, place: Vec) -> float:
        """Second rate [m/s^2] of the gap of the material at ``place``, along the normal as it stands.

        What the turning of the normal and the sliding of the contact point add is left out: for bodies that do not turn it
        is exact, else it serves to tell what is pressed together from what is not.
        """
        total = sub(self.b.acceleration, self.a.acceleration)
        total = add(total, sub(_bent(self.b, sub(place, self.moved)), _bent(self.a, place)))
        return dot(self.normal, total)

    # Gaps

    def gaps(self) -> list[Gap]:
        """The contact points, deepest ones and those level with them."""
        n = self.normal
        places = common_points(self)
        deepest = min(separation for _, separation in places)
        kept = [(place, separation) for place, separation in places if separation <= deepest + LEVEL * self.size]
        return [self._gap(place, separation, n) for place, separation in kept]

    def _gap(self, place: Vec, separation: float, n: Vec) -> Gap:
        acceleration = self.acceleration_at(place)
        return Gap(
            separation,
            self.speed_at(place),
            acceleration,
            n,
            add(self.a.position, place),
            self.touch,
            still_speed(self.speeds(), acceleration),
        )

    def pressing(self) -> tuple[float, float, float]:
        """Speed [m/s], second rate [m/s^2] and still speed [m/s] of the touching point that approaches fastest."""
        gap = self.gap()
        return gap.speed, gap.acceleration, gap.still

    def speeds(self) -> float:
        """The speeds [m/s] at hand."""
        turning = norm(self.a.angular_velocity) * self.core_a.reach
        if isinstance(self.core_b, Core):
            turning += norm(self.b.angular_velocity) * self.core_b.reach
        return norm(self.a.velocity) + norm(self.b.velocity) + turning

    def gap(self) -> Gap:
        """The deepest point; of those as deep as touching goes, the one that approaches fastest."""
        found = self.gaps()
        deepest = min(one.separation for one in found)
        return min(
            (one for one in found if one.separation <= max(deepest, 0.0) + self.touch or one.separation == deepest),
            key=lambda one: one.speed,
        )


def _along(corners: Array, two: Any) -> Array:
    """Unit vector along the edge of ``two`` corners."""
    edge: Array = corners[two[1]] - corners[two[0]]
    return np.asarray(edge / np.linalg.norm(edge))


def _bent(mover: Mover, arm: Vec) -> Vec:
    """Acceleration [m/s^2] of the point at ``arm`` from the centre by turning."""
    omega = mover.angular_velocity
    return add(cross(angular_acceleration(mover), arm), cross(omega, cross(omega, arm)))


def _vec(row: Array) -> Vec:
    return (float(row[0]), float(row[1]), float(row[2]))
