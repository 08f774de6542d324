"""When a sphere meets a box that does not turn, and how far apart they are."""

from xpheve.kernels.vector import Vec
from xpheve_laws_collision.impact_time.rounded_box import ball_box, standing


def sphere_box(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    hx: float,
    hy: float,
    hz: float,
    radius: float,
    touch: float,
    still: float,
    horizon: float,
) -> float:
    """Time [s] in [0, horizon] until a sphere touches a box and approaches; infinite if it does not.

    Parameters
    ----------
    d0, d1, d2
        The sphere's centre from that of the box [m], its rate [m/s], its constant second rate [m/s^2]; in the box's own frame.
    hx, hy, hz
        Half edges [m].
    radius
        Of the sphere [m]; of a point 0.
    touch, still, horizon
        As `rounded_box.ball_box`, where the rest is said.
    """
    return ball_box(d0, d1, d2, (hx, hy, hz), radius, touch, still, horizon)


def sphere_box_gap(d: Vec, hx: float, hy: float, hz: float, radius: float) -> tuple[float, float, float, float]:
    """Separation [m] of sphere and box, and the unit normal from the sphere to the box, in the box's own frame.

    Of a centre inside the box it is minus the least way out, along the normal of that face.
    """
    distance, x, y, z = standing(d, (hx, hy, hz))
    return (distance - radius, 0.0 - x, 0.0 - y, 0.0 - z)
