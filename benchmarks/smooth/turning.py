"""Rigid bodies in the formulas that peers get: quaternion (w, x, y, z), body to world, and angular velocity in the body frame."""

from __future__ import annotations

from typing import Any

import numpy as np


def quaternion_rate(q: Any, w: Any) -> tuple[Any, Any, Any, Any]:
    """q' = q (0, w) / 2."""
    return (
        -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]),
        0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]),
        0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2]),
        0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]),
    )


def to_body(q: Any, v: Any) -> tuple[Any, Any, Any]:
    """``v`` of the world frame in that of the body, of a unit quaternion."""
    t0 = 2.0 * (q[3] * v[1] - q[2] * v[2])
    t1 = 2.0 * (q[1] * v[2] - q[3] * v[0])
    t2 = 2.0 * (q[2] * v[0] - q[1] * v[1])
    return (
        v[0] + q[0] * t0 + q[3] * t1 - q[2] * t2,
        v[1] + q[0] * t1 + q[1] * t2 - q[3] * t0,
        v[2] + q[0] * t2 + q[2] * t0 - q[1] * t1,
    )


def to_world(q: Any, v: Any) -> tuple[Any, Any, Any]:
    """``v`` of the body frame in that of the world."""
    return to_body((q[0], -q[1], -q[2], -q[3]), v)


def angle(found: Any, high: Any, low: Any) -> float:
    """How far the orientation ``found`` is turned from ``high + low`` [rad]; the length of neither matters."""
    long = np.longdouble
    q, p = np.asarray(found, long).reshape(4), np.asarray(high, long) + np.asarray(low, long)
    w = q @ p
    u = p[0] * q[1:] - q[0] * p[1:] - np.cross(p[1:], q[1:])
    return float(2 * np.arctan2(np.sqrt(u @ u), abs(w)))
