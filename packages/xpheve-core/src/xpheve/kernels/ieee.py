"""Operations that Python refuses where IEEE 754 has an answer: none raises, none turns complex.

Where a result is infinite or no number, that is what comes out; signs of zero count. Compiled, `xpheve.compile` puts the machine's own
operation, or the very function of the C library that ``math`` calls, in the place of most of these.

Source: IEEE Std 754-2019, 5.4, 6 and 9.2; C17, annex F.10, for powers.
"""

import math

WHOLE = 4503599627370496.0  # 2^52: from here on every float is a whole number


def divide(a: float, b: float) -> float:
    """a / b; infinite for b = 0, with the sign of both, and NaN for 0 / 0."""
    try:
        return a / b
    except ZeroDivisionError:
        if a == 0.0 or a != a:
            return math.nan
        return math.copysign(math.inf, a) * math.copysign(1.0, b)


def sqrt(x: float) -> float:
    """Square root; NaN below zero."""
    return math.sqrt(x) if x >= 0.0 else math.nan


def cbrt(x: float) -> float:
    """Cube root, of either sign."""
    return math.cbrt(x)


def power(a: float, b: float) -> float:
    """a^b; NaN for a fraction's power of a negative number, infinite where it overflows and for 0^b, b < 0."""
    try:
        return math.pow(a, b)
    except OverflowError:
        return -math.inf if a < 0.0 and abs(math.fmod(b, 2.0)) == 1.0 else math.inf
    except ValueError:
        if a != 0.0:
            return math.nan
        return math.copysign(math.inf, a) if abs(math.fmod(b, 2.0)) == 1.0 else math.inf


def exp(x: float) -> float:
    """e^x."""
    try:
        return math.exp(x)
    except OverflowError:
        return math.inf


def expm1(x: float) -> float:
    """e^x - 1."""
    try:
        return math.expm1(x)
    except OverflowError:
        return math.inf


def log(x: float) -> float:
    """Natural logarithm; -inf at 0, NaN below."""
    if x > 0.0:
        return math.log(x)
    return -math.inf if x == 0.0 else math.nan


def log1p(x: float) -> float:
    """log(1 + x); -inf at -1, NaN below."""
    if x > -1.0:
        return math.log1p(x)
    return -math.inf if x == -1.0 else math.nan


def sin(x: float) -> float:
    """Sine of ``x`` [rad]; NaN of infinity."""
    return math.sin(x) if x - x == 0.0 else math.nan


def cos(x: float) -> float:
    """Cosine of ``x`` [rad]; NaN of infinity."""
    return math.cos(x) if x - x == 0.0 else math.nan


def tan(x: float) -> float:
    """Tangent of ``x`` [rad]; NaN of infinity."""
    return math.tan(x) if x - x == 0.0 else math.nan


def asin(x: float) -> float:
    """Arc sine [rad]; NaN outside -1 to 1."""
    return math.asin(x) if -1.0 <= x <= 1.0 else math.nan


def acos(x: float) -> float:
    """Arc cosine [rad]; NaN outside -1 to 1."""
    return math.acos(x) if -1.0 <= x <= 1.0 else math.nan


def sinh(x: float) -> float:
    """Hyperbolic sine."""
    try:
        return math.sinh(x)
    except OverflowError:
        return math.copysign(math.inf, x)


def cosh(x: float) -> float:
    """Hyperbolic cosine."""
    try:
        return math.cosh(x)
    except OverflowError:
        return math.inf


def floor(x: float) -> float:
    """The greatest whole number not above ``x``, as a float; -0 stays -0, infinity and NaN stay."""
    if not abs(x) < WHOLE:
        return x
    return math.copysign(float(math.floor(x)), x)


def hypot(a: float, b: float) -> float:
    """Square root of a^2 + b^2, whatever their size; infinite where either is.

    In plain arithmetic, because ``math.hypot`` and the C library's round differently.
    """
    a = abs(a)
    b = abs(b)
    square = a * a + b * b
    if 1e-280 < square < 1e300:  # inside, no square that counts has lost a digit
        return math.sqrt(square)
    if a == math.inf or b == math.inf:
        return math.inf
    largest = a if a > b else b
    if not largest > 0.0:
        return a + b  # 0, or not a number
    x = a / largest
    y = b / largest
    return largest * math.sqrt(x * x + y * y)


def minimum(a: float, b: float) -> float:
    """The lesser; NaN where either is."""
    return a if a <= b or a != a else b


def maximum(a: float, b: float) -> float:
    """The greater; NaN where either is."""
    return a if a >= b or a != a else b


def sign(x: float) -> float:
    """-1, 0 or 1; NaN of NaN."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else (0.0 if x == 0.0 else x))
