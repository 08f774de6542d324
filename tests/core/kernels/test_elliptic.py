"""Elliptic functions and integrals against mpmath's, worked to 60 digits and more."""

import math
import random

import mpmath
import pytest

from xpheve.kernels.elliptic import (
    carlson_rc,
    carlson_rf,
    carlson_rj,
    complete_k,
    complete_k_h,
    incomplete_f,
    incomplete_h,
    incomplete_pi,
    pair_div,
    pair_mul,
    pair_sqrt,
    product_exact,
    sn_cn_dn,
    sum_exact,
)

PARAMETERS = [1e-100, 1e-30, 1e-16, 1e-12, 1e-8, 1e-4, 0.01, 0.3, 0.5, 0.9, 1.0 - 1e-9, 1.0]
SHARES = [1e-12, 1e-6, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 1.0 - 1e-6, 1.0 - 1e-12]
ROUNDINGS = 1e-15  # nine halves of a unit of the last place: what a chain of some twenty operations leaves


def parameter(m1: float) -> mpmath.mpf:
    """m = 1 - m1 in full; the caller sets the digits."""
    return 1 - mpmath.mpf(m1)


def functions(u: float, m1: float) -> tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf]:
    """sn, cn, dn of the exact floats."""
    sn, cn, dn = (mpmath.ellipfun(name, u=u, m=parameter(m1)) for name in ("sn", "cn", "dn"))
    return sn, cn, dn


@pytest.mark.parametrize("m1", PARAMETERS)
def test_sn_cn_and_dn(m1: float) -> None:
    with mpmath.workdps(60 if m1 > 1e-40 else 240):
        for share in SHARES:
            u = share * complete_k(m1)
            sn, cn, dn = sn_cn_dn(u, m1)
            s, c, d = functions(u, m1)
            # Each to its own size and to what a rounding of u does to it, so that small cn and dn keep their digits.
            assert abs(sn - s) <= ROUNDINGS * abs(s)
            assert abs(cn - c) <= ROUNDINGS * (abs(c) + abs(u * s * d))
            assert abs(dn - d) <= ROUNDINGS * (abs(d) + abs(u * s * c))
            assert sn_cn_dn(-u, m1) == (-sn, cn, dn)


def test_sn_cn_and_dn_end_in_tanh_and_sech() -> None:
    for u in (0.0, 1e-300, 1e-9, 0.1, 3.0, 40.0, 700.0, 1e6):
        sn, cn, dn = sn_cn_dn(u, 0.0)
        assert sn == math.tanh(u)
        assert cn == dn
        with mpmath.workdps(30):
            assert cn == pytest.approx(float(mpmath.sech(u)), rel=ROUNDINGS)


def test_sn_cn_and_dn_end_in_sine_and_cosine() -> None:
    for u in (1e-300, 1e-9, 0.1, 1.0, 1.5):
        assert sn_cn_dn(u, 1.0) == pytest.approx((math.sin(u), math.cos(u), 1.0), rel=ROUNDINGS)


def test_carlsons_integrals() -> None:
    rng = random.Random(1)
    with mpmath.workdps(40):
        for n in range(200):
            x, y, z, p = (10.0 ** rng.uniform(-8.0, 8.0) for _ in range(4))
            if n % 5 == 0:
                x = 0.0
            close = y * (1.0 + rng.uniform(-2e-3, 2e-3))
            assert carlson_rf(x, y, z) == pytest.approx(float(mpmath.elliprf(x, y, z)), rel=ROUNDINGS)
            assert carlson_rj(x, y, z, p) == pytest.approx(float(mpmath.elliprj(x, y, z, p)), rel=2 * ROUNDINGS)
            assert carlson_rc(x, y) == pytest.approx(float(mpmath.elliprc(x, y)), rel=ROUNDINGS)
            assert carlson_rc(y, close) == pytest.approx(float(mpmath.elliprc(y, close)), rel=ROUNDINGS)


@pytest.mark.parametrize("m1", PARAMETERS[1:])
def test_legendres_integrals(m1: float) -> None:
    with mpmath.workdps(60):
        m = parameter(m1)
        assert complete_k(m1) == pytest.approx(float(mpmath.ellipk(m)), rel=ROUNDINGS)
        for share in (1e-6, 0.1, 0.5, 0.9, 0.999):
            u = share * complete_k(m1)
            exact = functions(u, m1)
            s, c, d = (float(x) for x in exact)
            assert incomplete_f(s, c, d) == pytest.approx(u, rel=2 * ROUNDINGS)  # s, c and d are rounded as well
            for n in (-7.0, -0.1, 0.0, 0.5):
                expected = float(mpmath.ellippi(n, mpmath.asin(exact[0]), m))
                assert incomplete_pi(s, c, d, n) == pytest.approx(expected, rel=3 * ROUNDINGS)


@pytest.mark.parametrize("m1", [1e-30, 1e-10, 0.3, 0.99999, 1.0])
@pytest.mark.parametrize("nu", [0.0, 1e-9, 0.3, 7.0, 1e6, 1e12])
def test_the_third_kind_of_the_rigid_body(m1: float, nu: float) -> None:
    with mpmath.workdps(80):
        m, exact_nu = parameter(m1), mpmath.mpf(nu) + mpmath.mpf(10) ** -30 * (nu == 0.0)
        whole = mpmath.ellipk(m)
        h_whole = whole - (1 + exact_nu) * (whole - mpmath.ellippi(-exact_nu, m)) / exact_nu
        k_high, k_low, h_high, h_low = complete_k_h((m1, 0.0), sum_exact(1.0, nu))
        # Pairs have 31 digits; 1 - S / 2 in H loses as many as there are in nu / m1-free units: at most those of nu.
        assert abs((mpmath.mpf(k_high) + k_low) / whole - 1) < 1e-30
        assert abs((mpmath.mpf(h_high) + h_low) / h_whole - 1) < 1e-28 * (1 + nu)
        for share in (1e-6, 0.01, 0.3, 0.6, 0.9, 0.99):
            u = share * k_high
            exact = functions(u, m1)
            s, c, d = (float(x) for x in exact)
            third = mpmath.ellippi(-exact_nu, mpmath.asin(exact[0]), m)
            expected = u - (1 + exact_nu) * (u - third) / exact_nu
            assert incomplete_h(s, c, d, m1, nu) == pytest.approx(float(expected), rel=2 * ROUNDINGS)


def test_pairs_carry_thirty_digits() -> None:
    rng = random.Random(2)
    with mpmath.workdps(50):
        for _ in range(200):
            a = product_exact(rng.uniform(1.0, 2.0), rng.uniform(1.0, 2.0))
            b = product_exact(rng.uniform(1.0, 2.0), 10.0 ** rng.uniform(-9.0, 9.0))
            x, y = mpmath.mpf(a[0]) + a[1], mpmath.mpf(b[0]) + b[1]
            for found, expected in (
                (pair_mul(a, b), x * y),
                (pair_div(a, b), x / y),
                (pair_sqrt(a), mpmath.sqrt(x)),
            ):
                assert abs((mpmath.mpf(found[0]) + found[1]) / expected - 1) < 1e-30
