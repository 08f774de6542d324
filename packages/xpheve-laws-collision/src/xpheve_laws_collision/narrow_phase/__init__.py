"""Where two shapes touch: one file a pair of shapes, each with its predictors; found by kind, in either order."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from xpheve.errors import ContactError
from xpheve_laws_collision.impact.limits import BRIEF as BRIEF
from xpheve_laws_collision.impact.limits import STILL as STILL
from xpheve_laws_collision.impact.limits import TOUCH as TOUCH
from xpheve_laws_collision.impact.limits import ULPS as ULPS

Vec = tuple[float, float, float]
Quat = tuple[float, float, float, float]


class Mover(NamedTuple):
    """One side of a pair at an instant: position [m], velocity [m/s], acceleration [m/s^2] of the centre, orientation, shape.

    Then what turns it: angular velocity [rad/s] and torque [N m] in the world frame, principal moments [kg m^2]. The
    acceleration and the torque are constant until the flight changes.
    """

    position: Vec
    velocity: Vec
    acceleration: Vec
    orientation: Quat
    shape: Any
    angular_velocity: Vec = (0.0, 0.0, 0.0)
    inertia: Vec = (0.0, 0.0, 0.0)
    torque: Vec = (0.0, 0.0, 0.0)

    def at(self, s: float) -> Mover:
        """The mover ``s`` [s] later, where the steppers have it."""
        from xpheve_laws_collision.impact_time.path import Path

        return Path(self).at(s)


class Gap(NamedTuple):
    """How two shapes stand at an instant: separation [m] and its two rates, unit normal from a to b, point [m].

    ``touch`` [m] and ``still`` [m/s] are what counts as none.
    """

    separation: float
    speed: float
    acceleration: float
    normal: Vec
    point: Vec
    touch: float
    still: float


def still_speed(speeds: float, acceleration: float) -> float:
    """Speed [m/s] along the normal that counts as none, beside ``speeds`` and under ``acceleration`` along the normal.

    Only a closing acceleration turns anything back: that of a fast body flying past curves away, and grows with its speed squared.
    """
    return STILL * speeds + BRIEF * max(0.0, -acceleration)


class Family(Protocol):
    """The geometry of one pair of kinds of shape."""

    rests: bool
    """Whether one may rest on the other in closed form."""

    def gap(self, a: Mover, b: Mover) -> Gap:
        """How they stand: at the deepest point, of several equally deep ones at that which approaches fastest."""
        ...

    def points(self, a: Mover, b: Mover) -> list[Gap]:
        """Where a touching pair touches, each point with its own separation and speed, in an order that bits decide."""
        ...

    def impact_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        """Time [s] until they touch and approach, at most ``horizon``; else infinite."""
        ...

    def leave_time(self, a: Mover, b: Mover, gap: Gap, horizon: float) -> float:
        """Time [s] until a touching or overlapping pair is apart; else infinite."""
        ...

    def apart_for(self, a: Mover, b: Mover) -> float:
        """Time [s] for which they are surely apart, told much faster than `impact_time`; 0 where that is fast, infinite if for ever."""
        ...


def family_of(kind_a: str, kind_b: str) -> tuple[Family, bool]:
    """The family of two kinds of shape, and whether it knows them the other way round.

    Raises
    ------
    ContactError
        If no file here knows the pair.
    """
    from xpheve_laws_collision.narrow_phase import (
        convex,
        sphere_box,
        sphere_compound,
        sphere_mesh,
        sphere_plane,
        sphere_sphere,
    )

    families: dict[tuple[str, str], Family] = {
        ("sphere", "plane"): sphere_plane.SpherePlane(),
        ("sphere", "sphere"): sphere_sphere.SphereSphere(),
        ("sphere", "box"): sphere_box.SphereBox(),
        ("sphere", "capsule"): sphere_box.SphereBox(),
        ("sphere", "compound"): sphere_compound.SphereCompound(),
        ("sphere", "mesh"): sphere_mesh.SphereMesh(),
    }
    for k, kind in enumerate(convex.SOLID):
        families.setdefault((kind, "plane"), convex.ConvexPlane())
        for other in convex.SOLID[k:]:
            families.setdefault((kind, other), convex.Convex())
    if (kind_a, kind_b) in families:
        return families[kind_a, kind_b], False
    if (kind_b, kind_a) in families:
        return families[kind_b, kind_a], True
    known = ", ".join(f"{a}-{b}" for a, b in sorted(families))
    wayout = "Give the object another shape, or do not map both objects to the collision law"
    if "mesh" in (kind_a, kind_b):
        wayout = (
            "A mesh meets spheres and points only: make it a Hull, or a Compound of convex parts, or do not map both objects "
            "to the collision law"
        )
    raise ContactError(f"no impact time is known between {kind_a} and {kind_b}; known: {known}. {wayout}")


def flipped(gap: Gap) -> Gap:
    """The same, seen from the other side."""
    x, y, z = gap.normal
    return gap._replace(normal=(0.0 - x, 0.0 - y, 0.0 - z))
