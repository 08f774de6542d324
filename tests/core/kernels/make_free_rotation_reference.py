"""Makes the reference states of test_free_rotation.py: Taylor series of Euler's equations and of the attitude.

    python tests/core/kernels/make_free_rotation_reference.py 60 10000

It knows no elliptic function. Numbers are whole numbers of 2^-180 (54 digits); a step of 1/8 s to order 48 leaves a
remainder below (1/8 / 1.3)^48 ~ 1e-48, the nearest pole of the motion in complex time being at least 1.3 s away. Near
the middle axis the motion multiplies an error by about the inverse square of the small rates, 1e16, and by the count of
flips, so that more than 25 digits are right. At 60 s, steps of 1/16 s give the same 30 decimals. 60 s takes 3 s,
10,000 s over a minute.
"""

import sys
from operator import mul

BITS = 180
ORDER = 48
INERTIA = (1, 2, 3)
RATES = ((0.01, 2.0, 0.01), (1e-4, 2.0, 1e-4), (1e-8, 2.0, 1e-8))


def fixed(x: float) -> int:
    """``x`` as a whole number of 2^-BITS: without error for the rates above, of which the least bit is 2^-79."""
    numerator, denominator = x.as_integer_ratio()
    return (numerator << BITS) // denominator


def product(a: list[int], b: list[int]) -> int:
    """Coefficient of order len(a) - 1 of the product of two series."""
    return sum(map(mul, a, reversed(b))) >> BITS


def step(state: list[int], per_second: int) -> list[int]:
    """State (w, x, y, z, w1, w2, w3) 1 / ``per_second`` later."""
    w, x, y, z, a, b, c = ([value] for value in state)
    i1, i2, i3 = INERTIA
    for n in range(ORDER):
        qa = -product(x, a) - product(y, b) - product(z, c)
        qb = product(w, a) + product(y, c) - product(z, b)
        qc = product(w, b) + product(z, a) - product(x, c)
        qd = product(w, c) + product(x, b) - product(y, a)
        bc, ca, ab = product(b, c), product(c, a), product(a, b)
        m = (n + 1) * per_second  # the coefficients are those in units of the step
        w.append(qa // (2 * m))
        x.append(qb // (2 * m))
        y.append(qc // (2 * m))
        z.append(qd // (2 * m))
        a.append((i2 - i3) * bc // (i1 * m))
        b.append((i3 - i1) * ca // (i2 * m))
        c.append((i1 - i2) * ab // (i3 * m))
    return [sum(series) for series in (w, x, y, z, a, b, c)]


def text(value: int) -> str:
    """30 decimals."""
    sign = "-" if value < 0 else ""
    digits = str((abs(value) * 10**30) >> BITS).rjust(31, "0")
    return f"{sign}{digits[:-30]}.{digits[-30:]}"


def main() -> None:
    """Print quaternion (body to world) and body rates for every rate and each time asked for [whole seconds]."""
    times = sorted(int(t) for t in sys.argv[1:])
    per_second = 8
    for rates in RATES:
        state = [1 << BITS, 0, 0, 0, *(fixed(rate) for rate in rates)]
        done = 0
        for time in times:
            if time > 1000 and rates != RATES[0]:
                continue
            for _ in range((time - done) * per_second):
                state = step(state, per_second)
            done = time
            print(f"    ({rates}, {time}.0): (")
            for value in state:
                print(f'        "{text(value)}",')
            print("    ),", flush=True)


if __name__ == "__main__":
    main()
