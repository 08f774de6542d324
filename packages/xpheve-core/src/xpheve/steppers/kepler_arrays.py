"""Many orbits at once, or one at many times: `xpheve.kernels.kepler.moved` on NumPy arrays, to the same bits.

What has no branches there is called as it is; here are its branches, each element going its own way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels import kepler
from xpheve.kernels.elliptic import pair_add, pair_sub, pair_times

Array = NDArray[np.float64]
Pair = tuple[Array, Array]
PLACES = 35
"""Constants of an orbit."""


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
        found = np.empty((3, 3, len(s)))
        wide = ~narrow
        for which, nearest in ((narrow, True), (wide, False)):
            if which.any():
                found[:, :, which] = _from(
                    o if which.all() else o[:, which], _of(since if nearest else near, which), nearest
                )
        free = o[3] == 0.0
        if free.any():
            for k, part in enumerate(kepler.freely(o, t[0])):  # type: ignore[arg-type]
                for c, numbers in enumerate(part):
                    found[k, c] = np.where(free, numbers, found[k, c])
        found[:, :, fallen] = np.nan
    return found[0], found[1], found[2]


def _of(pair: Pair, which: NDArray[np.bool_]) -> Pair:
    return pair[0][which], pair[1][which]


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
