"""When a sphere meets a capsule that does not turn, and how far apart they are."""

from xpheve.kernels.vector import Vec
from xpheve_laws_collision.impact_time.rounded_box import ball_box, standing


def sphere_capsule(
    d0: Vec,
    d1: Vec,
    d2: Vec,
    core_radius: float,
    half_length: float,
    radius: float,
    touch: float,
    still: float,
    horizon: float,
) -> float:
    """Time [s] in [0, horizon] until a sphere touches a capsule and approaches; infinite if it does not.

    Parameters
    ----------
    d0, d1, d2
        The sphere's centre from that of the capsule [m], its rate [m/s], its constant second rate [m/s^2]; in the capsule's own
        frame, whose z is the axis.
    core_radius, half_length
        The capsule's radius, and half the distance of its caps' centres [m].
    radius
        Of the sphere [m]; of a point 0.
    touch, still, horizon
        As `rounded_box.ball_box`, where the rest is said.
    """
    return ball_box(d0, d1, d2, (0.0, 0.0, half_length), core_radius + radius, touch, still, horizon)


def sphere_capsule_gap(
    d: Vec, core_radius: float, half_length: float, radius: float
) -> tuple[float, float, float, float]:
    """Separation [m] of sphere and capsule, and the unit normal from the sphere to the capsule, in the capsule's own frame.

    A centre on the axis is pushed out across it.
    """
    distance, x, y, z = standing(d, (0.0, 0.0, half_length))
    return (distance - (core_radius + radius), 0.0 - x, 0.0 - y, 0.0 - z)
