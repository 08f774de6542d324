"""All places where a polynomial of degree at most four changes between positive and not."""

import math

from xpheve.kernels.polynomial import derivative, quadratic_roots, root_bound, sign_change, value

Quartic = tuple[float, float, float, float, float]


def sign_changes(c: Quartic, start: float, end: float) -> list[float]:
    """The rising s in (start, end] at each of which the polynomial has changed between positive and not positive.

    Each is the first float at or beyond the change. The zeros of the second derivative part the range so that the first is monotone
    between them; its zeros part it so that the polynomial is. ``end`` may be infinite.
    """
    high = min(end, root_bound(c))
    if not start < high:
        return []
    slopes = derivative(c)
    bends = [min(max(s, start), high) for s in quadratic_roots(slopes[1], 2.0 * slopes[2], 3.0 * slopes[3])]
    turns = [sign_change(slopes, low, top) for low, top in ((start, bends[0]), (bends[0], bends[1]), (bends[1], high))]
    found, here = [], start
    for there in (*turns, high):
        if there > here:
            if (value(c, here) > 0.0) != (value(c, there) > 0.0):
                found.append(sign_change(c, here, there))
            here = there
    return found


def between(low: float, high: float) -> float:
    """A number inside (low, high), ``high`` possibly infinite; ``low`` if there is none."""
    if math.isinf(high):
        return 2.0 * low + 1.0
    middle = 0.5 * (low + high)
    return middle if low < middle < high else low
