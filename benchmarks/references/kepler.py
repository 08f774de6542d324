"""Two bodies: Kepler's equation with 60 digits, from the float64 numbers of the start."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

DIGITS = 60


def relative_state(swarm: Any, t: float) -> tuple[Any, Any]:
    """Place of body 1 from body 0 at ``t``, as a sum of two arrays (1, 3).

    From eccentric anomaly: J. M. A. Danby, Fundamentals of Celestial Mechanics (1988), sections 6.3 (Kepler's equation by Newton's method) and 6.8
    (f and g).
    """
    with mpmath.workdps(DIGITS):
        mpf = mpmath.mpf
        x = [mpf(float(b)) - mpf(float(a)) for a, b in zip(*swarm.position, strict=True)]
        v = [mpf(float(b)) - mpf(float(a)) for a, b in zip(*swarm.velocity, strict=True)]
        mu = mpf(swarm.constant) * (mpf(float(swarm.mass[0])) + mpf(float(swarm.mass[1])))
        r0 = mpmath.sqrt(sum(c * c for c in x))
        a = 1 / (2 / r0 - sum(c * c for c in v) / mu)
        n = mpmath.sqrt(mu / a**3)
        e_cos, e_sin = 1 - r0 / a, sum(p * q for p, q in zip(x, v, strict=True)) / mpmath.sqrt(mu * a)
        e, begin = mpmath.hypot(e_cos, e_sin), mpmath.atan2(e_sin, e_cos)
        mean = begin - e_sin + n * mpf(t)
        anomaly = mean
        for _ in range(200):
            step = (anomaly - e * mpmath.sin(anomaly) - mean) / (1 - e * mpmath.cos(anomaly))
            anomaly -= step
            if abs(step) < mpf(10) ** (5 - DIGITS):
                break
        else:
            raise ArithmeticError("Kepler's equation did not converge")
        turned = anomaly - begin
        f = 1 - a / r0 * (1 - mpmath.cos(turned))
        g = mpf(t) - (turned - mpmath.sin(turned)) / n
        place = [f * p + g * q for p, q in zip(x, v, strict=True)]
        high = np.array([[float(c) for c in place]])
        return high, np.array([[float(c - mpf(float(c))) for c in place]])
