"""Vectors of three floats."""

import math

Vec = tuple[float, float, float]


def add(a: Vec, b: Vec) -> Vec:
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec, b: Vec) -> Vec:
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec, s: float) -> Vec:
    """s a."""
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a: Vec, b: Vec) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec, b: Vec) -> Vec:
    """a x b, right-handed."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Vec) -> float:
    """|a|, whatever its size: vectors whose square would leave the range of a float are scaled first."""
    square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    if 1e-280 < square < 1e300:  # inside, no square that counts has lost a digit
        return math.sqrt(square)
    largest = max(abs(a[0]), abs(a[1]), abs(a[2]))
    if not 0.0 < largest < math.inf:
        return largest + abs(a[0]) + abs(a[1]) + abs(a[2])  # 0, infinity, or not a number
    x, y, z = a[0] / largest, a[1] / largest, a[2] / largest
    return largest * math.sqrt(x * x + y * y + z * z)
