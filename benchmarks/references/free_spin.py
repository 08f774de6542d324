"""The free asymmetric rigid body in closed form, with many digits.

Jacobi's elliptic functions and the elliptic integral of the third kind.

L. D. Landau, E. M. Lifshitz, Mechanics (3rd ed. 1976), section 37: rates, equations 37.8 to 37.10; precession about
the angular momentum, equations 37.13 to 37.16, its rate integrated by NIST Handbook of Mathematical Functions (2010),
19.2.7.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mpmath

from benchmarks.references import save

DIGITS = 70


def orientation(inertia: Any, turning: Any, t: float) -> list[Any]:
    """The quaternion (w, x, y, z), body to world, at ``t`` of a body that begins at the identity.

    ``inertia`` ascending, ``turning`` in the body frame with positive components, and L^2 > 2 E I2: the third axis goes round L.
    """
    with mpmath.workdps(DIGITS):
        mpf = mpmath.mpf
        i1, i2, i3 = map(mpf, inertia)
        w = [mpf(c) for c in turning]
        twice, square = (
            i1 * w[0] ** 2 + i2 * w[1] ** 2 + i3 * w[2] ** 2,
            (i1 * w[0]) ** 2 + (i2 * w[1]) ** 2 + (i3 * w[2]) ** 2,
        )
        if not (0 < i1 < i2 < i3 and min(w) > 0 and square > twice * i2):
            raise ValueError(f"no such case: inertia {inertia}, turning {turning}")
        a1 = mpmath.sqrt((twice * i3 - square) / (i1 * (i3 - i1)))
        a2 = mpmath.sqrt((twice * i3 - square) / (i2 * (i3 - i2)))
        a3 = mpmath.sqrt((square - twice * i1) / (i3 * (i3 - i1)))
        rate = mpmath.sqrt((i3 - i2) * (square - twice * i1) / (i1 * i2 * i3))
        m = (i2 - i1) * (twice * i3 - square) / ((i3 - i2) * (square - twice * i1))
        length = mpmath.sqrt(square)
        begin = mpmath.ellipf(mpmath.atan2(w[1] / a2, w[0] / a1), m)
        u = begin + rate * mpf(t)
        sn, cn, dn = (mpmath.ellipfun(kind, u, m=m) for kind in ("sn", "cn", "dn"))
        then = (a1 * cn, a2 * sn, a3 * dn)
        a = square - (i3 * a3) ** 2
        n = -m * (i3 * a3) ** 2 / a
        third = _third(n, u, m) - _third(n, begin, m)
        turned = length * mpf(t) / i3 + length * (twice - square / i3) / (a * rate) * third
        first = _euler(mpf(0), [i * c for i, c in zip((i1, i2, i3), w, strict=True)], length)
        last = _euler(turned, [i * c for i, c in zip((i1, i2, i3), then, strict=True)], length)
        return _product([first[0], *(-c for c in first[1:])], last)


def _third(n: Any, u: Any, m: Any) -> Any:
    """The integral of 1 / (1 - n sn^2) from 0 to ``u``."""
    whole = mpmath.ellipk(m)
    half_turns = mpmath.nint(u / (2 * whole))
    rest = u - 2 * whole * half_turns
    return 2 * half_turns * mpmath.ellippi(n, m) + mpmath.ellippi(n, mpmath.asin(mpmath.ellipfun("sn", rest, m=m)), m)


def _euler(phi: Any, spin: Any, length: Any) -> list[Any]:
    """The quaternion of Rz(phi) Rx(theta) Rz(psi), where ``spin`` is the angular momentum in the body frame."""
    theta, psi = mpmath.acos(spin[2] / length), mpmath.atan2(spin[0], spin[1])
    about = [
        [mpmath.cos(phi / 2), 0, 0, mpmath.sin(phi / 2)],
        [mpmath.cos(theta / 2), mpmath.sin(theta / 2), 0, 0],
        [mpmath.cos(psi / 2), 0, 0, mpmath.sin(psi / 2)],
    ]
    return _product(_product(about[0], about[1]), about[2])


def _product(p: Any, q: Any) -> list[Any]:
    """Of quaternions."""
    return [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ]


def make(inertia: Any, turning: Any, spans: Any) -> Path:
    """Store the orientations at ``spans``."""
    answers = []
    for span in spans:
        q = orientation(inertia, turning, span)
        with mpmath.workdps(DIGITS):
            answers.append((span, turning, [mpmath.nstr(c, 34) for c in q]))
    return save("free_spin", "closed form with 70 digits: benchmarks/references/free_spin.py", answers)
