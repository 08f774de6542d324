"""Flows of matrices against exponentials of 60 and more digits, and by what nature asks of them."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xpheve.steppers.linear_flow import Flow, LadderFlow, ModalFlow, eigenvectors, flow_of, parts_of
from xpheve.steppers.wide import Wide

ROUNDINGS = 1e-14
Maker = Callable[[], tuple[Wide, Wide, np.ndarray]]


def after(flow: Flow, velocity: np.ndarray, pull: np.ndarray, span: float) -> tuple[np.ndarray, np.ndarray]:
    """Way and velocity of one object."""
    start = flow.begin(Wide(velocity[:, None]), Wide(pull[:, None]))
    way, speed = flow.end(start, [(span, 0.0)], flow.coefficients((span, 0.0))[:, :, None])
    return way[:, 0], speed[:, 0]


def number(one: Wide, *place: int) -> mpmath.mpf:
    return mpmath.mpf(float(one.high[place])) + mpmath.mpf(float(one.low[place]))


def reference(
    k: Wide, d: Wide, mass: np.ndarray, velocity: np.ndarray, pull: np.ndarray, span: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same by scaling and squaring of the augmented matrix in as many digits as it takes."""
    n = len(mass)
    with mpmath.workdps(60):
        f = mpmath.zeros(3 * n)
        for i in range(n):
            f[i, n + i] = f[n + i, 2 * n + i] = 1
            for j in range(n):
                f[n + i, j] = number(k, i, j) / mpmath.mpf(float(mass[i]))
                f[n + i, n + j] = number(d, i, j) / mpmath.mpf(float(mass[i]))
        halvings = max(0, int(mpmath.ceil(mpmath.log(mpmath.mnorm(f, 1) * span + 1, 2)))) + 4
    with mpmath.workdps(70 + halvings):
        x = f * (mpmath.mpf(span) / 2**halvings)
        total, term = mpmath.eye(3 * n), mpmath.eye(3 * n)
        for order in range(1, 80):
            term = term * x / order
            total += term
            if mpmath.mnorm(term, 1) < mpmath.mpf(10) ** -mpmath.mp.dps:
                break
        for _ in range(halvings):
            total = total * total
        given = mpmath.matrix([mpmath.mpf(0)] * n + [mpmath.mpf(float(one)) for one in (*velocity, *pull)])
        found = np.array([float(one) for one in total * given])
    return found[:n], found[n : 2 * n]


def net(springs: list[tuple[int, int, float]], n: int) -> Wide:
    """K of springs between places, or from a place to a wall (-1)."""
    k = Wide(np.zeros((n, n)))
    for i, j, stiffness in springs:
        for a, b in ((i, j), (j, i)):
            if a >= 0:
                k[a, a] = k[a, a] - Wide(stiffness)
                if b >= 0:
                    k[a, b] = k[a, b] + Wide(stiffness)
    return k


def chain(n: int, stiffness: float, walls: bool) -> Wide:
    links = [(i, i + 1, stiffness) for i in range(n - 1)]
    return net([*links, *([(-1, 0, stiffness), (n - 1, -1, stiffness)] if walls else [])], n)


def cross(w: tuple[float, float, float]) -> Wide:
    """v x w as a matrix."""
    x, y, z = w
    return Wide(np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]))


NONE = Wide(np.zeros((4, 4)))
MASSES = np.array([0.013, 47.0, 1.0, 3e3])


def damped(damper: float) -> tuple[Wide, Wide, np.ndarray]:
    d = NONE.copy()
    d[0, 0] = Wide(-damper)
    return chain(4, 1e8, True), d, MASSES


CASES: dict[str, tuple[type[Flow], Maker]] = {
    "a chain between walls": (ModalFlow, lambda: (chain(4, 1e8, True), NONE, np.ones(4))),
    "a free chain": (ModalFlow, lambda: (chain(4, 1e8, False), NONE, MASSES)),
    "damped in proportion": (ModalFlow, lambda: (chain(4, 1e8, False), chain(4, 3.0, False), MASSES)),
    "damped by its masses": (ModalFlow, lambda: (chain(4, 1e4, True), Wide(np.diag(-0.25 * MASSES)), MASSES)),
    "drag alone": (ModalFlow, lambda: (NONE, chain(4, 3.0, False), MASSES)),
    "springs of 1 and 1e12": (
        ModalFlow,
        lambda: (net([(0, 1, 1e12), (1, 2, 1.0), (2, 3, 1e12)], 4), NONE, np.array([1.0, 2.0, 3.0, 4.0])),
    ),
    "equal eigenvalues": (
        ModalFlow,
        lambda: (net([(i, j, 5e3) for i in range(4) for j in range(i)], 4), NONE, np.ones(4)),
    ),
    "one damper": (LadderFlow, lambda: damped(50.0)),
    "one strong damper": (LadderFlow, lambda: damped(1e6)),
    "negative stiffness": (ModalFlow, lambda: (net([(0, 1, 4.0), (1, 2, -1.0), (2, 3, 4.0)], 4), NONE, np.ones(4))),
    "a magnetic field": (ModalFlow, lambda: (Wide(np.zeros((3, 3))), cross((3.0, -2.0, 1.0)), np.full(3, 0.01))),
    "a magnetic field and a spring": (
        ModalFlow,
        lambda: (Wide(-np.eye(3) * 1e4), cross((3.0, -2.0, 1.0)), np.full(3, 0.01)),
    ),
    "a field across two springs": (
        LadderFlow,
        lambda: (Wide(np.diag([-1e4, -2e4, -3e4])), cross((3.0, -2.0, 1.0)), np.full(3, 0.01)),
    ),
    "a plane": (ModalFlow, lambda: (Wide(np.zeros((2, 2))), Wide(np.array([[0.0, 7.0], [-7.0, 0.0]])), np.ones(2))),
    "a turntable": (
        ModalFlow,
        lambda: (-(cross((30.0, 20.0, -10.0)) @ cross((30.0, 20.0, -10.0))), cross((60.0, 40.0, -20.0)), np.ones(3)),
    ),
    "a force across, not along": (
        LadderFlow,
        lambda: (Wide(np.array([[-2.0, 1.0], [-3.0, -1.0]])), Wide(np.zeros((2, 2))), np.ones(2)),
    ),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("span", [1e-9, 1.0 / 60.0, 40.0])
def test_a_flow_is_exact_to_rounding(name: str, span: float) -> None:
    kind, make = CASES[name]
    k, d, mass = make()
    flow = flow_of(k, d, mass)
    assert type(flow) is kind
    rng = np.random.default_rng(1)
    velocity, pull = rng.normal(size=len(mass)), rng.normal(size=len(mass)) * 1e3
    for found, exact in zip(
        after(flow, velocity, pull, span), reference(k, d, mass, velocity, pull, span), strict=True
    ):
        assert np.abs(found - exact).max() <= ROUNDINGS * np.abs(exact).max()


def test_long_spans_of_a_stiff_net_keep_phase_and_drift() -> None:
    k, mass = chain(6, 1e8, False), np.array([1.0, 0.1, 10.0, 1.0, 3.0, 0.2])
    rng = np.random.default_rng(2)
    velocity, pull = rng.normal(size=6), 1e8 * rng.normal(size=6)
    pull[5] = -(mass[:5] * pull[:5]).sum() / mass[5]  # inner forces alone: their sum is nearly 0
    flow = flow_of(k, Wide(np.zeros((6, 6))), mass)
    for found, exact in zip(
        after(flow, velocity, pull, 1e4),
        reference(k, Wide(np.zeros((6, 6))), mass, velocity, pull, 1e4),
        strict=True,
    ):
        assert np.abs(found - exact).max() <= ROUNDINGS * np.abs(exact).max()


def test_slow_modes_beside_stiff_ones_have_all_their_digits() -> None:
    """Two bodies held by a spring 1e16 times as stiff as that to the wall: the pair swings as one."""
    k = net([(0, 1, 1e12), (0, -1, 1e-4)], 2)
    flow = flow_of(k, Wide(np.zeros((2, 2))), np.ones(2))
    assert isinstance(flow, ModalFlow)
    with mpmath.workdps(60):
        exact = min(
            abs(one) for one in mpmath.eigsy(mpmath.matrix([[number(k, i, j) for j in (0, 1)] for i in (0, 1)]))[0]
        )
        slow = min(abs(mode.constants[0][0][0]) for mode in flow.modes)
        assert abs(slow - exact) <= 1e-14 * exact


def test_eigenvectors_make_a_matrix_diagonal_in_thirty_digits() -> None:
    rng = np.random.default_rng(4)
    for a in (rng.normal(size=(30, 30)), np.ones((8, 8)), np.diag([1.0, 1.0 + 1e-14, 2.0]) + 1e-15, np.eye(4)):
        w = Wide(a + a.T)
        x = eigenvectors(w)
        turned = x.transposed @ (w @ x)
        left = np.abs(turned.high - np.diag(turned.high.diagonal())).max()
        assert left <= 1e-26 * np.abs(w.high).sum(axis=1).max()
        assert np.abs((x.transposed @ x - Wide(np.eye(len(a)))).high).max() < 1e-26


def test_parts_are_coordinates_that_act_on_one_another() -> None:
    k, d = Wide(np.zeros((5, 5))), Wide(np.zeros((5, 5)))
    k.high[0, 3], d.high[3, 1], k.high[2, 2] = 1.0, 1.0, 1.0
    assert [one.tolist() for one in parts_of(k, d)] == [[0, 1, 3], [2], [4]]


SIZES = st.floats(-12.0, 12.0)


@given(SIZES, SIZES, st.floats(-4.0, 4.0), st.sampled_from([0.0, 0.01, 1.0, 50.0]))
@settings(max_examples=40, deadline=None)
def test_two_spans_are_their_sum_whatever_the_scales(
    stiffness: float, mass: float, span: float, damping: float
) -> None:
    k, m = chain(3, 10.0**stiffness, True), 10.0**mass * np.array([1.0, 3.0, 0.5])
    rate = np.sqrt(10.0**stiffness / 10.0**mass)
    d = Wide(np.diag([-damping * rate * m[0], 0.0, 0.0]))
    flow = flow_of(k, d, m)
    s = float(2.0 ** round(np.log2(10.0**span / rate)))  # sums of spans are exact
    v = np.array([1.0, -2.0, 0.5])
    x0 = v / rate

    def pull(x: np.ndarray) -> np.ndarray:
        return (k.high @ x) / m

    way, speed = after(flow, v, pull(x0), s)
    more, there = after(flow, speed, pull(x0 + way), 2.0 * s)
    whole, end = after(flow, v, pull(x0), 3.0 * s)
    amplitude = np.abs(v).max() / rate * np.sqrt(m.max() / m.min())
    # what rounds at the half way is turned by the rest of the flow as anything else is
    assert np.abs(way + more - whole).max() <= 1e-13 * amplitude
    assert np.abs(there - end).max() <= 1e-13 * amplitude * rate * np.sqrt(m.max() / m.min()) * 10.0


@given(SIZES, st.floats(-6.0, 6.0), st.floats(-2.0, 5.0))
@settings(max_examples=40, deadline=None)
def test_an_undamped_net_turns_back_and_keeps_its_energy(stiffness: float, ratio: float, span: float) -> None:
    k = chain(3, 10.0**stiffness, True)
    m = np.array([1.0, 10.0**ratio, 10.0**-ratio])
    flow = flow_of(k, Wide(np.zeros((3, 3))), m)
    v = np.array([1.0, -2.0, 0.5]) / np.sqrt(m)
    s = 10.0**span / np.sqrt(10.0**stiffness)
    way, speed = after(flow, v, np.zeros(3), s)
    energy, before = 0.5 * (m * speed * speed).sum() - 0.5 * way @ (k.high @ way), 0.5 * (m * v * v).sum()
    assert abs(energy - before) <= 1e-12 * before
    _, home = after(flow, -speed, (k @ Wide(way)).high / m, s)
    assert np.abs(np.sqrt(m) * (home + v)).max() <= 1e-11 * np.sqrt(before)


def test_the_flow_solves_what_scipy_solves() -> None:
    integrate = pytest.importorskip("scipy.integrate")
    k, d, m = chain(4, 400.0, True), Wide(np.diag([-3.0, 0.0, 0.0, -0.1])), np.array([1.0, 2.0, 0.5, 1.5])
    v = np.array([1.0, 0.0, -1.0, 2.0])
    way, speed = after(flow_of(k, d, m), v, np.zeros(4), 2.0)

    def slope(t: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate([z[4:], (k.high @ z[:4] + d.high @ z[4:]) / m])

    found = integrate.solve_ivp(slope, (0.0, 2.0), np.concatenate([np.zeros(4), v]), "DOP853", rtol=1e-12, atol=1e-13)
    assert np.abs(found.y[:, -1] - np.concatenate([way, speed])).max() < 1e-9
