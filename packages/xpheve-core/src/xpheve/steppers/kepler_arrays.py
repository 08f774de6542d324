"""Many orbits at once, or one at many times: `prepare` and `moved` of `xpheve.kernels.kepler` on NumPy arrays, to the same bits.

What has no branches there is called as it is; here are its branches, each element going its own way.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels import kepler
from xpheve.kernels.elliptic import (
    pair_add,
    pair_div,
    pair_mul,
    pair_sub,
    pair_times,
    product_exact,
    sum_exact,
)

Array = NDArray[np.float64]
Pair = tuple[Array, Array]
PLACES = 35
"""Constants of an orbit."""
FEW = 24
"""Orbits that are prepared one by one."""


def prepared(d: Any, v: Any, mu: Any) -> Array:
    """The constants of orbits, (35, n): `xpheve.kernels.kepler.prepare` of each.

    Parameters
    ----------
    d, v
        Pairs of arrays (3, n): places from the centre, none of them 0, and velocities.
    mu
        A pair of arrays (n,).
    """
    n = d[0].shape[1]
    if n <= FEW:
        found = np.empty((PLACES, n))
        for k in range(n):
            place, velocity = (tuple((float(one[0][c, k]), float(one[1][c, k])) for c in range(3)) for one in (d, v))
            found[:, k] = kepler.prepare(place, velocity, (float(mu[0][k]), float(mu[1][k])))  # type: ignore[arg-type]
        return found
    with np.errstate(all="ignore"):
        return _prepared([(d[0][c], d[1][c]) for c in range(3)], [(v[0][c], v[1][c]) for c in range(3)], mu)


def _prepared(d: Any, v: Any, mu: Any) -> Array:
    zero = np.zeros_like(mu[0])
    one = (np.ones_like(zero), zero)
    length = _limited(_exponent(_largest(d)))
    time = -np.maximum(_exponent(_largest(v)) - length, (_exponent(mu[0]) - 3 * length + 1) // 2)
    time = _limited(np.where(time > 2000, 0, time))
    x, w = [_shift(part, -length) for part in d], [_shift(part, time - length) for part in v]
    gm = _shift(mu, 2 * time - 3 * length)
    r = _root(kepler.pair_dot(x, x))  # type: ignore[arg-type]
    inverse = pair_div(one, r)
    unit = kepler.pair_scale(x, inverse)  # type: ignore[arg-type]
    sigma = kepler.pair_dot(x, w)  # type: ignore[arg-type]
    beta = pair_sub(pair_mul((2.0 * gm[0], 2.0 * gm[1]), inverse), kepler.pair_dot(w, w))  # type: ignore[arg-type]
    zeta = pair_sub(gm, pair_mul(beta, r))
    two_pi: Any = (np.full_like(zero, kepler.TWO_PI[0]), np.full_like(zero, kepler.TWO_PI[1]))
    closed = (gm[0] > 0.0) & (np.asarray(beta[0]) > kepler.NO_PERIOD)
    period = _where(closed, pair_div(pair_mul(two_pi, gm), pair_mul(beta, _root(beta))), (zero, zero))
    nearest = _nearest(x, w, unit, sigma, zeta, gm, beta, one)
    falls = (nearest[0] != 0.0) & ~(nearest[3] > 0.0) & (gm[0] > 0.0)
    since, once = nearest[1], np.where(period[0] > 0.0, period[0], np.inf)
    before = np.where(falls, np.where(since > 0.0, -since, -once - since), -np.inf)
    after = np.where(falls, np.where(since > 0.0, once - since, -since), np.inf)
    units = np.ldexp(1.0, length), np.ldexp(1.0, -time), np.ldexp(1.0, _limited(length - time))
    return np.array([
        *units, gm[0], beta[0], *period, before, after, r[0], sigma[0], zeta[0], *(u[0] for u in unit), *(u[0] for u in w), *nearest,
        *(u[0] for u in x), *(u[1] for u in x),
    ])  # fmt: skip


def _nearest(x: Any, w: Any, unit: Any, sigma: Any, zeta: Any, mu: Any, beta: Any, one: Any) -> list[Array]:
    h = kepler.pair_cross(x, w)
    turned, pull = kepler.pair_cross(w, h), kepler.pair_scale(unit, mu)
    laplace = tuple(pair_sub(turned[c], pull[c]) for c in range(3))
    kappa = _root(kepler.pair_dot(laplace, laplace))  # type: ignore[arg-type]
    known = ~((mu[0] == 0.0) | (kappa[0] <= kepler.ROUND * np.abs(mu[0])))
    axis = kepler.pair_scale(laplace, pair_div(one, kappa))  # type: ignore[arg-type]
    attracted = pair_div(kepler.pair_dot(h, h), pair_add(mu, kappa))
    repelled = pair_div(pair_sub(kappa, mu), (-beta[0], -beta[1]))
    q = _where(mu[0] > 0.0, attracted, repelled)
    side = kepler.pair_cross(h, axis)
    since = _since_nearest(sigma, zeta, q, kappa, beta, known)
    found = [since[0], since[1], q[0], kappa[0], *(a[0] for a in axis), *(a[0] for a in side)]
    return [known.astype(float), *(np.where(known, part, 0.0) for part in found)]


def _since_nearest(sigma: Any, zeta: Any, q: Any, kappa: Any, beta: Any, known: Any) -> Any:
    sine, cosine = pair_div(sigma, kappa), pair_div(zeta, kappa)
    y: Any = np.zeros(len(known))
    numbers = zip(*(one.tolist() for one in (beta[0], np.asarray(sine[0]), np.asarray(cosine[0]), known)), strict=True)
    for k, (one, s, c, there) in enumerate(
        numbers
    ):  # by the functions that floats have: those of NumPy round otherwise
        if there and one > 0.0:
            y[k] = math.atan2(math.sqrt(one) * s, c) / math.sqrt(one)
        elif there:
            y[k] = math.asinh(math.sqrt(-one) * s) / math.sqrt(-one) if one < 0.0 else s
    g0, g1, g2, g3 = _pair_functions(beta, y)
    step = pair_sub(pair_mul(sine, g0), pair_mul(cosine, g1))
    g3 = pair_add(g3, pair_times(g2, step[0]))
    return pair_add(pair_mul(q, pair_add((y, np.zeros_like(y)), step)), pair_mul(kappa, g3))


def _pair_functions(beta: Any, y: Any) -> tuple[Any, Any, Any, Any]:
    zero: Any = np.zeros_like(y)
    one: Any = (np.ones_like(y), zero)
    halvings, part = np.zeros(len(y), dtype=np.int64), y
    while True:
        far = np.abs(beta[0]) * part * part > kepler.NEAR_PAIR
        if not far.any():
            break
        part = np.where(far, 0.5 * part, part)
        halvings += far
    z = pair_times(pair_times(beta, part), part)
    table = [(np.full_like(y, a), np.full_like(y, b)) for a, b in kepler.INVERSE_FACTORIALS]
    total: Any = table[11]
    for k in range(10, -1, -1):
        total = pair_sub(table[k], pair_mul(z, total))
    g3: Any = pair_mul(total, pair_times(pair_times((part, zero), part), part))
    g1: Any = pair_sub((part, zero), pair_mul(beta, g3))
    g0: Any = _root(pair_sub(one, pair_mul(beta, pair_mul(g1, g1))))
    g2: Any = pair_div(pair_mul(g1, g1), pair_add(one, g0))
    for k in range(int(halvings.max()) if len(y) else 0):
        again = halvings > k
        g3 = _where(again, _twice(pair_add(g3, pair_mul(g1, g2))), g3)
        square, product = pair_mul(g1, g1), pair_mul(g0, g1)
        g2, g1 = _where(again, _twice(square), g2), _where(again, _twice(product), g1)
        g0 = _where(again, pair_sub(one, pair_mul(beta, g2)), g0)
    return g0, g1, g2, g3


def _twice(a: Any) -> Any:
    return 2.0 * a[0], 2.0 * a[1]


def _where(which: Any, a: Any, b: Any) -> Any:
    return np.where(which, a[0], b[0]), np.where(which, a[1], b[1])


def _root(a: Any) -> Any:
    x = np.sqrt(a[0])
    rest = pair_sub(a, product_exact(x, x))
    above = a[0] > 0.0
    return _where(above | (a[0] != a[0]), sum_exact(x, rest[0] / (2.0 * x)), (np.zeros_like(x), np.zeros_like(x)))


def _shift(a: Any, k: Any) -> Any:
    return np.ldexp(a[0], k), np.ldexp(a[1], k)


def _exponent(x: Any) -> Any:
    return np.where(x != 0.0, np.frexp(x)[1].astype(np.int64), -4000)


def _largest(a: Any) -> Any:
    return np.maximum(np.maximum(np.abs(a[0][0]), np.abs(a[1][0])), np.abs(a[2][0]))


def _limited(k: Any) -> Any:
    return np.clip(k, -kepler.EXPONENT, kepler.EXPONENT)


def moved(orbits: Array, s: Array, rest: Array) -> tuple[Array, Array, Array]:
    """How places and velocities have changed a time ``s + rest`` after the beginning.

    Parameters
    ----------
    orbits
        Constants that `xpheve.kernels.kepler.prepare` gave, shape (35, n), or (35, 1) for one orbit.
    s, rest
        Times [s], shape (n,).

    Returns
    -------
    change, more, kick
        Of shape (3, n) each: change of the place, what rounding left out of it, and change of the velocity; NaN beyond a fall into the centre.
    """
    with np.errstate(all="ignore"):
        o = np.broadcast_to(orbits, (PLACES, len(s)))
        t = s * o[1], rest * o[1]
        fallen = ~((o[7] < t[0]) & (t[0] < o[8]))
        if fallen.any():
            t = np.where(fallen, 0.0, t[0]), np.where(fallen, 0.0, t[1])
        period = o[5], o[6]
        near = _reduced(t, period)
        since = _reduced(pair_add(t, (o[19], o[20])), period)  # type: ignore[arg-type]
        narrow = (o[18] != 0.0) & (np.abs(since[0]) < np.abs(near[0]))
        if narrow.all() or not narrow.any():
            found = _from(o, since if narrow.any() else near, bool(narrow.any()))
        else:
            found = np.empty((3, 3, len(s)))
            for which, pair, nearest in ((narrow, since, True), (~narrow, near, False)):
                at = np.flatnonzero(which)
                found[:, :, at] = _from(np.take(o, at, axis=1), (pair[0][at], pair[1][at]), nearest)
        free = o[3] == 0.0
        if free.any():
            for k, part in enumerate(kepler.freely(o, t[0])):  # type: ignore[arg-type]
                for c, numbers in enumerate(part):
                    found[k, c] = np.where(free, numbers, found[k, c])
        found[:, :, fallen] = np.nan
    return found[0], found[1], found[2]


def _from(o: Array, t: Pair, nearest: bool) -> Array:
    """`moved` from the nearest point, or from the beginning; shape (3, 3, n)."""
    if nearest:
        parts = kepler.from_nearest(o, *_solved(t, o[21], np.zeros(o.shape[1]), o[22], o[4]))  # type: ignore[arg-type]
    else:
        parts = kepler.from_beginning(o, *_solved(t, o[9], o[10], o[11], o[4])[1:])  # type: ignore[arg-type]
    found = np.empty((3, 3, o.shape[1]))
    for k, part in enumerate(parts):
        for c, numbers in enumerate(part):
            found[k, c] = numbers
    return found


def _reduced(s: Pair, period: Pair) -> Pair:
    beyond = (np.abs(s[0]) > 0.5 * period[0]) & (0.5 * period[0] > 0.0)
    if not beyond.any():
        return s
    turns = np.where(beyond, s[0] / period[0], 0.0)
    lost = ~(np.abs(turns) < kepler.FOREVER)
    whole = np.where(np.abs(turns) < 1e15, np.floor(turns + 0.5), turns)
    less = pair_sub(s, pair_times(period, whole))  # type: ignore[arg-type]
    return tuple(np.where(lost, 0.0, np.where(beyond, less[k], s[k])) for k in range(2))  # type: ignore[return-value]


def _functions(beta: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    part, z, halvings = y, beta * (y * y), np.zeros(len(y), dtype=np.int64)
    while True:
        far = np.abs(z) > kepler.NEAR
        if not far.any():
            break
        part, z = np.where(far, 0.5 * part, part), np.where(far, 0.25 * z, z)
        halvings += far
    square = part * part
    g2 = square * kepler.series_two(z)  # type: ignore[arg-type]
    g3 = square * part * kepler.series_three(z)  # type: ignore[arg-type]
    g1 = part - beta * g3
    g0 = 1.0 - beta * g2
    least = int(halvings.min()) if len(y) else 0
    for k in range(int(halvings.max()) if len(y) else 0):
        twice = 2.0 * (g3 + g1 * g2), 2.0 * (g1 * g1), 2.0 * (g0 * g1)
        if k < least:
            g3, g2, g1 = twice
            g0 = 1.0 - beta * g2
            continue
        again = halvings > k
        g3, g2, g1 = (np.where(again, new, old) for new, old in zip(twice, (g3, g2, g1), strict=True))
        g0 = np.where(again, 1.0 - beta * g2, g0)
    return g0, g1, g2, g3


def _first_guess(s: Array, r: Array, sigma: Array, zeta: Array, beta: Array) -> Array:
    y = np.where(r > 0.0, s / r, np.inf)
    y = np.where(sigma > 0.0, np.minimum(y, np.sqrt(2.0 * s / sigma)), y)
    third = _rough_third_root(6.0 * s / zeta)
    y = np.where(zeta > 0.0, np.minimum(y, third), y)
    open_ = (beta < 0.0) & (zeta > 0.0)
    if open_.any():
        b = np.sqrt(-beta)
        y = np.where(open_, np.minimum(y, _rough_logarithm(2.0 * (s * b * (b * b) / zeta) + 1.8) / b), y)
    found: Array = np.where(beta > 0.0, np.minimum(y, 3.5 / np.sqrt(beta)), y)
    return found


def _rough_third_root(x: Array) -> Array:
    a = np.sqrt(np.sqrt(x))
    b = np.sqrt(np.sqrt(a))
    c = np.sqrt(np.sqrt(b))
    found: Array = a * b * (c * np.sqrt(np.sqrt(c)))
    return found


def _rough_logarithm(x: Array) -> Array:
    root = x
    for _ in range(16):
        root = np.sqrt(root)
    return 131072.0 * ((root - 1.0) / (root + 1.0))


def _solved(s: Pair, r: Array, sigma: Array, zeta: Array, beta: Array) -> tuple[Array, Array, Array]:
    sign = np.where(s[0] > 0.0, 1.0, -1.0)
    found = np.zeros((3, len(sign)))
    found[0] = 1.0
    left = np.flatnonzero(s[0] != 0.0)
    time, rest, sigma = sign * s[0], sign * s[1], sign * sigma
    if len(left) < len(sign):
        time, rest, r, sigma, zeta, beta = (one[left] for one in (time, rest, r, sigma, zeta, beta))
    y = _first_guess(time, r, sigma, zeta, beta)
    low, high = np.zeros(len(left)), np.full(len(left), np.inf)
    for _ in range(kepler.STEPS):
        g0, g1, g2, g3 = _functions(beta, y)
        miss, step = kepler.step_of(time, rest, r, sigma, zeta, beta, y, g0, g1, g2, g3)  # type: ignore[arg-type]
        done = np.abs(step) <= kepler.CLOSE * y
        found[:, left] = (
            np.where(done, g0 - step * (beta * g1), g0), np.where(done, g1 + step * g0, g1), np.where(done, g2 + step * g1, g2),
        )  # fmt: skip
        if done.all():
            break
        go = ~done
        left = left[go]
        time, rest, r, sigma, zeta, beta, y, low, high, step = (
            one[go] for one in (time, rest, r, sigma, zeta, beta, y, low, high, np.asarray(step))
        )
        below = np.asarray(miss)[go] < 0.0
        high, low = np.where(below, high, y), np.where(below, y, low)
        y = y + step
        inside = (low < y) & (y < high)
        y = np.where(inside, y, np.where(high < np.inf, 0.5 * (low + high), 2.0 * low))
    return found[0], sign * found[1], found[2]
