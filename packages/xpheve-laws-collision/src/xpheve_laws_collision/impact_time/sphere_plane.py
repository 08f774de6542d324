"""When a sphere meets a plane, under constant relative acceleration."""

import math

from xpheve.kernels.polynomial import difference_of_products


def sphere_plane(gap: float, speed: float, acceleration: float, touch: float, still: float, horizon: float) -> float:
    """Time [s] in [0, horizon] until the sphere touches the plane and approaches; infinite if it does not.

    Parameters
    ----------
    gap
        From the sphere's surface to the plane along the plane's normal [m]; negative when overlapping.
    speed, acceleration
        Rate [m/s] and constant second rate [m/s^2] of the gap; negative when closing.
    touch, still
        The gap [m] that counts as touching, the speed [m/s] that counts as none.
    horizon
        [s], may be infinite.

    Returns
    -------
    float
        0 when touching or overlapping and approaching. What touches and separates is found when it comes
        back; what overlaps and turns back before it is out, at the instant it turns. What touches or
        overlaps and is still is no impact: under a closing acceleration it is a support. Neither is a
        graze, which arrives with no speed.

    Notes
    -----
    The root of gap + speed t + acceleration t^2 / 2 is taken in the form that adds numbers of one sign, so
    its relative error is a few units in the last place.
    """
    time = math.inf
    if gap <= touch:
        if speed < -still:
            return 0.0
        if speed > still and acceleration < 0.0:
            time = return_time(gap, speed, acceleration)
    elif acceleration < 0.0:
        root = math.sqrt(speed * speed - 2.0 * acceleration * gap)
        time = 2.0 * gap / (root - speed) if speed < 0.0 else (speed + root) / -acceleration
    elif speed < 0.0:
        time = slowed_time(gap, speed, acceleration, still)
    return time if time <= horizon else math.inf


def return_time(gap: float, speed: float, acceleration: float) -> float:
    """When what leaves at ``speed`` > 0 is back; when it turns if it turns before it is out."""
    # Less than 0 only for an overlap, which the flight has to climb first.
    discriminant = difference_of_products(speed, speed, 2.0 * acceleration, gap)
    if discriminant <= 0.0:
        return speed / -acceleration
    return (speed + math.sqrt(discriminant)) / -acceleration


def slowed_time(gap: float, speed: float, acceleration: float, still: float) -> float:
    """When an approach from ``gap`` > 0 arrives that is not sped up; infinite if it turns or grazes."""
    if acceleration == 0.0:
        return gap / -speed
    discriminant = difference_of_products(speed, speed, 2.0 * acceleration, gap)
    if discriminant <= still * still:
        return math.inf
    return 2.0 * gap / (math.sqrt(discriminant) - speed)


def sphere_plane_leaves(gap: float, speed: float, acceleration: float, horizon: float) -> float:
    """Time [s] in [0, horizon] at which the gap goes from at most 0 to more; infinite if it does not.

    Units as in `sphere_plane`. A gap of exactly 0 that opens leaves at 0; a positive gap has to close first.
    To touch 0 from inside and fall back is not to leave.
    """
    time = math.inf
    discriminant = difference_of_products(speed, speed, 2.0 * acceleration, gap)
    if gap > 0.0:
        if speed < 0.0 and acceleration > 0.0 and discriminant > 0.0:
            time = (math.sqrt(discriminant) - speed) / acceleration
    elif speed > 0.0:
        if discriminant > 0.0:
            time = -2.0 * gap / (speed + math.sqrt(discriminant))
    elif acceleration > 0.0:
        time = (math.sqrt(discriminant) - speed) / acceleration
    return time if time <= horizon else math.inf
