"""Spheres, boxes, capsules, hulls and compounds of them, against planes and each other.

``separation`` is the distance of the surfaces; of overlapping bodies minus the least depth. Of a compound the parts are
looked at one by one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from xpheve.kernels.quaternion import rotate
from xpheve.kernels.vector import Vec
from xpheve_laws_collision.impact_time.advancement import (
    STEPS,
    UndecidedError,
    balls_apart,
    first_impact,
    first_leave,
    is_apart,
)
from xpheve_laws_collision.impact_time.path import Path
from xpheve_laws_collision.impact_time.plane_advancement import FEW, PlaneSearch, first_impact_on_plane, is_in_reach
from xpheve_laws_collision.impact_time.sphere_plane import sphere_plane, sphere_plane_leaves
from xpheve_laws_collision.narrow_phase import Gap, Mover
from xpheve_laws_collision.narrow_phase.cores import Core, Half, cores_of
from xpheve_laws_collision.narrow_phase.standing import Standing

CONVEX = ("sphere", "box", "capsule", "hull")
SOLID = (*CONVEX, "compound")


class Convex:
    """The geometry of bodies made of convex cores, the second of which may be a plane."""

    rests = False

    def gap(self, a: Mover, b: Mover) -> Gap:
        """The deepest point of all parts; of those as deep as touching goes, the one that approaches fastest."""
        gaps = [standing.gap() for standing in _standings(a, b)]
        deepest = min(one.separation for one in gaps)
        return min((one for one in gaps if one.separation <= deepest + one.touch), key=lambda one: one.speed)

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        """The contact points of the parts that are as deep as the deepest, part by part.

        A sphere has one, a capsule that lies has two, a face on a face the corners of what they share. Left out are those
        that are farther than the deepest by more than 1e-9 of the sizes, and parts that are apart while others touch.
        """
        standings = list(_standings(a, b))
        deepest = min(standing.separation for standing in standings)
        level = max(deepest, max(standing.touch for standing in standings))
        return [gap for one in standings if one.separation <= level for gap in one.gaps()]

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        """See `impact_time.advancement.first_impact`."""
        first, least = Path(a), Path(b)
        best = math.inf
        for core_a, core_b in _core_pairs(a, b):
            found = first_impact(CorePair(first, least, core_a, core_b), min(horizon, best))
            best = min(best, found)
        return best

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        """See `impact_time.advancement.first_leave`; of compounds, when no part touches any more."""
        first, second = Path(a), Path(b)
        pairs = [CorePair(first, second, core_a, core_b) for core_a, core_b in _core_pairs(a, b)]
        t = 0.0 if gap.separation <= gap.touch else self.impact_time(a, b, gap, horizon)
        for _ in range(STEPS):
            if not t <= horizon or t == math.inf:
                return math.inf
            # While one part has not left another one may come: then it is the turn of that.
            cut = [pair for pair in pairs if not is_apart(pair.stand(t))]
            if not cut:
                return t
            t = max(first_leave(pair, horizon, t) for pair in cut)
        raise UndecidedError(t, "no parting")

    def apart_for(self, a: Mover, b: Mover) -> float:
        """How long the balls about the two are apart, or the ball about the first and the plane."""
        offset, reach_b = 0.0, 0.0
        outward: Vec | None = None
        if b.shape.kind != "plane":
            reach_b = b.shape.reach
        elif turns(b):
            return 0.0
        else:
            outward, offset = rotate(b.orientation, b.shape.normal), b.shape.offset
        return balls_apart(
            a, b, a.shape.reach if a.shape.kind != "sphere" else a.shape.radius, reach_b, outward, offset
        )


class ConvexPlane(Convex):
    """The geometry of such a body and a plane: in closed form if neither turns, since the lowest corner stays the lowest."""

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        if turns(b):
            return super().impact_time(a, b, gap, horizon)
        if turns(a):
            return self._turning_impact(a, b, gap, horizon)
        # A gap that counts as none is none: else a bounce lower than its rounding would not come back.
        separation = 0.0 if abs(gap.separation) <= gap.touch else gap.separation
        return sphere_plane(separation, gap.speed, gap.acceleration, gap.touch, gap.still, horizon)

    def _turning_impact(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        """See `impact_time.plane_advancement.first_impact_on_plane`; bodies of many corners as `Convex`."""
        path, outward = Path(a), rotate(b.orientation, b.shape.normal)
        best = math.inf
        for core in cores_of(a.shape):
            if len(core.corners) > FEW:
                return super().impact_time(a, b, gap, horizon)
            search = PlaneSearch(path, b, core.corners, core.radius, core.reach, outward)
            if not is_in_reach(search):
                return super().impact_time(a, b, gap, horizon)
            best = min(best, first_impact_on_plane(search, min(horizon, best)))
        return best

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        if turns(a) or turns(b):
            return super().leave_time(a, b, gap, horizon)
        return sphere_plane_leaves(gap.separation, gap.speed, gap.acceleration, horizon)

    def apart_for(self, a: Mover, b: Mover) -> float:
        return super().apart_for(a, b) if turns(a) or turns(b) else 0.0


def turns(mover: Mover) -> bool:
    """Whether it turns, or is about to."""
    return any(mover.angular_velocity) or (any(mover.torque) and min(mover.inertia) > 0.0)


class CorePair:
    """Two cores on their paths."""

    def __init__(self, path_a: Path, path_b: Path, core_a: Core, core_b: Core | Half) -> None:
        self.path_a, self.path_b, self.core_a, self.core_b = path_a, path_b, core_a, core_b
        self.reach_a = core_a.reach
        self.reach_b = 0.0
        self.outward: Vec | None = None
        self.plane_offset = 0.0
        if isinstance(core_b, Core):
            self.reach_b = core_b.reach
        elif path_b.start.angular_velocity == (0.0, 0.0, 0.0):
            self.outward = rotate(path_b.start.orientation, core_b.normal)
            self.plane_offset = core_b.offset
        else:
            self.reach_b = math.inf

    def stand(self, s: float) -> Standing:
        """How they stand ``s`` [s] later."""
        return Standing(self.path_a.at(s), self.path_b.at(s), self.core_a, self.core_b)


def _core_pairs(a: Mover, b: Mover) -> Iterator[tuple[Core, Core | Half]]:
    others: tuple[Core | Half, ...] = _halves(b) if b.shape.kind == "plane" else cores_of(b.shape)
    for core_a in cores_of(a.shape):
        for core_b in others:
            yield core_a, core_b


def _halves(b: Mover) -> tuple[Half]:
    return (Half(b.shape.normal, b.shape.offset),)


def _standings(a: Mover, b: Mover) -> Iterator[Standing]:
    for core_a, core_b in _core_pairs(a, b):
        yield Standing(a, b, core_a, core_b)
