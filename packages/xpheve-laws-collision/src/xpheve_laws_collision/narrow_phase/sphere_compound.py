"""Sphere (or point) and compound; meshes may be among the parts if it does not turn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from xpheve.kernels.quaternion import multiply, normalize, rotate
from xpheve.kernels.vector import add
from xpheve_laws_collision.impact_time.advancement import STEPS, UndecidedError
from xpheve_laws_collision.narrow_phase import Family, Gap, Mover, family_of
from xpheve_laws_collision.narrow_phase.convex import Convex


class SphereCompound(Convex):
    """A compound of convex parts as `Convex`; with a mesh among them part by part."""

    def gap(self, a: Mover, b: Mover) -> Gap:
        if not has_mesh(b.shape):
            return super().gap(a, b)
        gaps = [family.gap(a, part) for family, part in _parts(b)]
        deepest = min(one.separation for one in gaps)
        return min((one for one in gaps if one.separation <= deepest + one.touch), key=lambda one: one.speed)

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        if not has_mesh(b.shape):
            return super().points(a, b)
        found = [gap for family, part in _parts(b) for gap in family.points(a, part)]
        level = max(min(one.separation for one in found), max(one.touch for one in found))
        return [one for one in found if one.separation <= level]

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        if not has_mesh(b.shape):
            return super().impact_time(a, b, gap, horizon)
        best = math.inf
        for family, part in _parts(b):
            best = min(best, family.impact_time(a, part, family.gap(a, part), min(horizon, best)))
        return best

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        if not has_mesh(b.shape):
            return super().leave_time(a, b, gap, horizon)
        t = 0.0 if gap.separation <= gap.touch else self.impact_time(a, b, gap, horizon)
        for _ in range(STEPS):
            if not t <= horizon or t == math.inf:
                return math.inf
            ball = a.at(t)
            stands = [(family, part, family.gap(ball, part)) for family, part in _parts(b.at(t))]
            cut = [stand for stand in stands if not _is_apart(stand[2])]
            if not cut:
                return t
            step = max(family.leave_time(ball, part, one, horizon - t) for family, part, one in cut)
            t = max(t + step, math.nextafter(t, math.inf))
        raise UndecidedError(t, "no parting")

    def apart_for(self, a: Mover, b: Mover) -> float:
        return 0.0 if has_mesh(b.shape) else super().apart_for(a, b)


def has_mesh(shape: Any) -> bool:
    """Whether a mesh is among the parts, or theirs."""
    return any(
        part.shape.kind == "mesh" or (part.shape.kind == "compound" and has_mesh(part.shape)) for part in shape.parts
    )


def _is_apart(gap: Gap) -> bool:
    opens = gap.speed > gap.still or (abs(gap.speed) <= gap.still and gap.acceleration > 0.0)
    return gap.separation > gap.touch or (gap.separation >= -gap.touch and opens)


def _parts(b: Mover) -> Iterator[tuple[Family, Mover]]:
    """The parts as movers of their own: that is what they are while the compound does not turn; a mesh refuses the rest."""
    for part in b.shape.parts:
        placed = b._replace(
            position=add(b.position, rotate(b.orientation, part.position)),
            orientation=normalize(multiply(b.orientation, part.orientation)),
            shape=part.shape,
        )
        yield family_of("sphere", part.shape.kind)[0], placed
