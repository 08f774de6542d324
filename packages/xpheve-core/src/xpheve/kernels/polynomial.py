"""Where a polynomial of degree at most four first falls to zero."""

import math

SPLITTER = 134217729.0  # 2^27 + 1 cuts a float into two halves whose products are exact (Dekker 1971)
HORNER_ERROR = 2.0**-49  # twice the bound 8 u of Horner's rule in degree four, u = 2^-53 (Higham 2002, section 5.1)
ULP = 2.0**-52
MOST_STEPS = 400  # never reached: every second step halves the bracket, or its exponents where it spans many


def product_error(a: float, b: float, product: float) -> float:
    """``a * b - product`` without error, where ``product`` is the rounded ``a * b`` (Dekker 1971, no overflow)."""
    t = SPLITTER * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = SPLITTER * b
    b_high = t - (t - b)
    b_low = b - b_high
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def difference_of_products(a: float, b: float, c: float, d: float) -> float:
    """``a b - c d`` to two units in the last place, however much cancels (Kahan; Jeannerod et al. 2013)."""
    first = a * b
    second = c * d
    return (first - second) + (product_error(a, b, first) - product_error(c, d, second))


def compensated_value(c: tuple[float, float, float, float, float], x: float) -> float:
    """The polynomial at ``x`` as if computed in twice the precision (Graillat, Langlois, Louvet 2009)."""
    r = c[4]
    error = 0.0
    for i in range(3, -1, -1):
        product = r * x
        total = product + c[i]
        t = total - product
        lost = (product - (total - t)) + (c[i] - t)
        error = error * x + (product_error(r, x, product) + lost)
        r = total
    return r + error


def value(c: tuple[float, float, float, float, float], x: float) -> float:
    """c0 + c1 x + c2 x^2 + c3 x^3 + c4 x^4, with the right sign unless it is within about 1e-31 of the terms' sizes."""
    r = (((c[4] * x + c[3]) * x + c[2]) * x + c[1]) * x + c[0]
    y = abs(x)
    size = (((abs(c[4]) * y + abs(c[3])) * y + abs(c[2])) * y + abs(c[1])) * y + abs(c[0])
    if abs(r) > HORNER_ERROR * size or not max(size, y) < 1e290:  # beyond, the halves of a float overflow
        return r
    return compensated_value(c, x)


def derivative(c: tuple[float, float, float, float, float]) -> tuple[float, float, float, float, float]:
    """The coefficients of the derivative."""
    return (c[1], 2.0 * c[2], 3.0 * c[3], 4.0 * c[4], 0.0)


def quadratic_roots(c0: float, c1: float, c2: float) -> tuple[float, float]:
    """The real roots of c0 + c1 x + c2 x^2 in rising order; infinite where there are fewer."""
    largest = max(abs(c0), abs(c1), abs(c2))
    if largest == 0.0 or not largest < math.inf:
        return (math.inf, math.inf)
    n = -math.frexp(largest)[1]
    a = math.ldexp(c2, n)
    h = math.ldexp(c1, n - 1)
    c = math.ldexp(c0, n)
    if a == 0.0:
        if h == 0.0:
            return (math.inf, math.inf)
        return (-0.5 * c / h, math.inf)
    discriminant = difference_of_products(h, h, a, c)
    if discriminant < 0.0:
        return (math.inf, math.inf)
    # h and the root are added with one sign; the other solution follows from the product of both, c / a.
    t = -(h + math.copysign(math.sqrt(discriminant), h))
    if t == 0.0:
        return (0.0, 0.0)
    x = t / a
    y = c / t
    return (min(x, y), max(x, y))


def middle(a: float, b: float) -> float:
    """A point between ``a`` < ``b`` that halves the bracket: its length, or its exponents where it spans many."""
    if a < 0.0 < b:
        return 0.0
    low = min(abs(a), abs(b))
    high = max(abs(a), abs(b))
    if high <= 4.0 * low:
        return a + 0.5 * (b - a)
    if low == 0.0:
        m = high / 4096.0  # down to the smallest float in 90 steps
    else:
        m = math.sqrt(low) * math.sqrt(high)
    return m if b > 0.0 else -m


def sign_change(c: tuple[float, float, float, float, float], low: float, high: float) -> float:
    """Where the polynomial, monotone on [low, high], changes between positive and not; ``high`` where it does not.

    The first float beyond the change, by Newton steps kept inside a bracket (Press et al., section 9.4).
    """
    if not low < high:
        return high
    at_low = value(c, low)
    at_high = value(c, high)
    rising = at_high > 0.0
    if (at_low > 0.0) == rising:
        return high
    slopes = derivative(c)
    a = low
    b = high
    x = a + (b - a) * (at_low / (at_low - at_high)) if abs(at_low - at_high) < math.inf else middle(a, b)
    if not a < x < b:
        x = middle(a, b)
    last = b - a
    for _ in range(MOST_STEPS):
        if not a < x < b:
            return b
        f = value(c, x)
        if f == 0.0:
            return x
        if (f > 0.0) == rising:
            b = x
        else:
            a = x
        slope = (((slopes[4] * x + slopes[3]) * x + slopes[2]) * x + slopes[1]) * x + slopes[0]
        step = -f / slope if slope != 0.0 else math.inf
        if abs(step) < 1e-9 * abs(x):
            # A unit further than Newton says, so that the bracket closes from the other side too.
            step += math.copysign(ULP * abs(x), step)
        # A step that does not at least halve the one before is not trusted (also no NaN).
        if abs(step) <= 0.5 * last and a < x + step < b:
            last = abs(step)
            x += step
        else:
            x = middle(a, b)
            last = b - a
    return b


def root_bound(c: tuple[float, float, float, float, float]) -> float:
    """A bound on the absolute values of all roots (Fujiwara 1916); 0 for a constant."""
    n = 4
    while n > 0 and c[n] == 0.0:
        n -= 1
    bound = 0.0
    for i in range(n):
        power = 1.0 / (n - i)
        bound = max(bound, abs(c[i]) ** power / abs(c[n]) ** power)  # each apart: their ratio may leave the range
    return min(2.0 * bound * (1.0 + 1e-9), 1e300)  # the powers are rounded


def first_crossing(coefficients: tuple[float, float, float, float, float], start: float, end: float) -> float:
    """The first s in (start, end] at which c0 + c1 s + c2 s^2 + c3 s^3 + c4 s^4 goes from positive to not positive.

    The roots of the second derivative part (start, end] so that the first derivative is monotone between
    them; its roots part it so that the polynomial is.

    Parameters
    ----------
    coefficients
        (c0, c1, c2, c3, c4), finite; leading ones may be 0.
    start, end
        ``end`` may be infinite.

    Returns
    -------
    float
        The first float at or beyond the root, so that the polynomial is not positive there; infinite where
        there is none. A touch from above counts if the polynomial is really not positive at the float
        nearest to the minimum: values are taken as in twice the precision. A start that is not positive is
        no crossing; the polynomial has to become positive first.
    """
    if not start < end:
        return math.inf
    high = min(end, root_bound(coefficients))
    if not start < high:
        return math.inf
    slopes = derivative(coefficients)
    bend, second_bend = quadratic_roots(slopes[1], 2.0 * slopes[2], 3.0 * slopes[3])
    bend = min(max(bend, start), high)
    second_bend = min(max(second_bend, start), high)
    positive = value(coefficients, start) > 0.0
    here = start
    for piece in range(4):
        if piece == 0:
            there = sign_change(slopes, start, bend)
        elif piece == 1:
            there = sign_change(slopes, bend, second_bend)
        elif piece == 2:
            there = sign_change(slopes, second_bend, high)
        else:
            there = high
        if there > here:
            positive_there = value(coefficients, there) > 0.0
            if positive and not positive_there:
                return sign_change(coefficients, here, there)
            positive = positive_there
            here = there
    return math.inf
