"""The driver of Gauss and Radau against nature: two and three bodies, oscillators, drag; interpreted and compiled."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from xpheve.compile import Kernel, assemble, compiled, interpreted
from xpheve.kernels import radau
from xpheve.loop.drivers import driver_text
from xpheve.loop.drivers import radau15 as driver
from xpheve.steppers.adaptive import PACE, TERMS, driver_places, series_weights, tables

BODIES = """
def forces(f, n, x, v, a, w, now):
    s = f[0]
    p = f[1]
    rows = n[0][1]
    for i in range(3 * rows):
        s[a + i] = 0.0
    for i in range(rows):
        for j in range(i + 1, rows):
            dx = s[x + i] - s[x + j]
            dy = s[x + rows + i] - s[x + rows + j]
            dz = s[x + 2 * rows + i] - s[x + 2 * rows + j]
            square = dx * dx + dy * dy + dz * dz
            k = ieee__divide(1.0, square * ieee__sqrt(square))
            a_i = p[j] * k
            a_j = p[i] * k
            s[a + i] -= a_i * dx
            s[a + rows + i] -= a_i * dy
            s[a + 2 * rows + i] -= a_i * dz
            s[a + j] += a_j * dx
            s[a + rows + j] += a_j * dy
            s[a + 2 * rows + j] += a_j * dz
    return rows
"""
OSCILLATORS = """
def forces(f, n, x, v, a, w, now):
    s = f[0]
    p = f[1]
    for i in range(3 * n[0][1]):
        s[a + i] = -p[0] * s[x + i] - p[1] * s[v + i]
        s[w + i] = -p[1] * s[v + i]
    return n[0][1]
"""


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache of compiled loops of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


def kernel(forces: str, tier: Callable[[str], Kernel] = interpreted) -> Kernel:
    """The driver with ``forces``."""
    return tier(assemble(forces + driver_text("radau15")))


@pytest.fixture(scope="module")
def bodies() -> Kernel:
    """The driver under Newton's gravity, compiled."""
    return kernel(BODIES, compiled)


class Run:
    """Rows on their way: what the stepper does with the driver, by hand."""

    def __init__(
        self, run: Kernel, x: Any, v: Any, numbers: Any, fixed: float = 0.0, rtol: float = 1e-14, **flags: int
    ) -> None:
        x, v = np.asarray(x, dtype=float), np.asarray(v, dtype=float)
        rows = len(x)
        self.run, self.rows = run, rows
        self.at = driver_places(rows, 3)
        self.s, self.d = np.zeros(self.at.total), np.zeros(driver.WORST + 1, dtype=np.int64)
        s = self.s
        s[driver.NODE : driver.HEAD] = tables()
        s[self.at.kept[0]], s[self.at.kept[2]] = x.T, v.T
        s[driver.WALL], s[driver.RTOL], s[driver.ATOL] = math.inf, rtol, rtol
        self.s[driver.KNOWN] = math.inf
        s[driver.PACE], s[driver.FIXED], s[driver.LEAST] = PACE, fixed, 1e-20
        self.d[1] = 2**62
        for name, value in flags.items():
            self.d[getattr(driver, name)] = value
        self.f = [s, np.array(numbers, dtype=float)]
        self.n = [np.array([1, rows, rows, 0]), np.zeros(1, dtype=np.int64), self.d]

    def to(self, t: float, rest: float = 0.0) -> int:
        self.s[driver.NEED], self.s[driver.NEED_REST] = t, rest
        return self.run(self.f, self.n)

    def state(self) -> tuple[Any, Any]:
        """Places and velocities with their remainders at the beginning of the present step."""
        x, x_rest, v, v_rest = (self.s[self.at.kept[k]].T.astype(np.longdouble) for k in range(4))
        return x + x_rest, v + v_rest

    def read(self, t: float, rest: float = 0.0) -> tuple[Any, Any]:
        """Places and velocities (rows, 3) at ``t``."""
        s, kept = self.s, self.at.kept
        span, dt = (t - s[driver.T]) + (rest - s[driver.T_REST]), s[driver.SPAN]
        once, twice = series_weights(span / dt)
        gain = sum(once[k] * s[self.at.curve[k]] for k in range(TERMS))
        way = sum(twice[k] * s[self.at.curve[k]] for k in range(TERMS))
        x = s[kept[0]] + (s[kept[1]] + (span * s[kept[2]] + dt * dt * way))
        return x.T, (s[kept[2]] + (s[kept[3]] + dt * gain)).T


def test_its_weights_integrate_polynomials_of_degree_14() -> None:
    """Nodes are rounded, weights are theirs: exact to degree 7, and further but for what the nodes lack."""
    nodes = [Fraction(node) for node in radau.NODES]
    weights = [Fraction(one) + Fraction(rest) for one, rest in zip(radau.WEIGHTS, radau.WEIGHTS_REST, strict=True)]
    for degree in range(15):
        wrong = sum(w * node**degree for w, node in zip(weights, nodes, strict=True)) - Fraction(1, degree + 1)
        assert abs(wrong) < (1e-31 if degree < 8 else 1e-16)
    for node, places, speeds in zip(nodes[1:], radau.PLACES[1:], radau.SPEEDS[1:], strict=True):
        for power in range(1, 8):
            place = sum(Fraction(w) * other**power for w, other in zip(places, nodes[1:], strict=True))
            assert abs(place - node**power / ((power + 1) * (power + 2))) < 1e-16
            speed = sum(Fraction(w) * other**power for w, other in zip(speeds, nodes[1:], strict=True))
            assert abs(speed - node**power / (power + 1)) < 2e-16


def two_bodies() -> tuple[Any, Any, list[float]]:
    """A planet of a thousandth on an orbit of eccentricity 0.9, from its pericentre."""
    m = 1e-3
    fast = math.sqrt(1.001 * 1.9 / 0.1)
    x = [[-0.1 * m / 1.001, 0, 0], [0.1 / 1.001, 0, 0]]
    v = [[0, -fast * m / 1.001, 0], [0, fast / 1.001, 0]]
    return np.array(x), np.array(v), [1.0, m]


def period(x: Any, v: Any, masses: Any, count: int) -> tuple[float, float]:
    """``count`` periods of two bodies that start as they do [s], as two floats (Kepler's third law)."""
    with localcontext() as context:
        context.prec = 50
        r = [Decimal(float(b)) - Decimal(float(a)) for a, b in zip(x[0], x[1], strict=True)]
        u = [Decimal(float(b)) - Decimal(float(a)) for a, b in zip(v[0], v[1], strict=True)]
        mu = Decimal(masses[0]) + Decimal(masses[1])
        axis = 1 / (2 / sum(one * one for one in r).sqrt() - sum(one * one for one in u) / mu)
        turn = 2 * Decimal("3.14159265358979323846264338327950288419716939937511")
        whole = count * turn * (axis**3 / mu).sqrt()
        high = float(whole)
        return high, float(whole - Decimal(high))


@pytest.mark.parametrize(("orbits", "bar"), [(100, 5e-11), (1000, 1.5e-9)])
def test_an_eccentric_orbit_closes(bodies: Kernel, orbits: int, bar: float) -> None:
    """After whole periods all is where it was. Rounding walks at random: by 1e-11 in 100 orbits, by 3e-10 in 1,000 (30 times as much)."""
    x, v, masses = two_bodies()
    run = Run(bodies, x, v, masses)
    end = period(x, v, masses, orbits)
    assert run.to(*end) == driver.REACHED
    found, _ = run.read(*end)
    assert np.abs((found[1] - found[0]) - (x[1] - x[0])).max() < bar


EIGHT = 10 * 6.32591398
AFTER_EIGHT = [
    [0.9700042137564637, -0.24308766531606052, 0.0],
    [-0.9700045060162731, 0.24308739631772916, 0.0],
    [2.9225980930988435e-07, 2.689983313762015e-07, 0.0],
]
"""The figure eight after ten periods, from 33 digits (heyoka, quadruple precision), from the same float64 start."""


def figure_eight() -> tuple[Any, Any, list[float]]:
    one, speed = np.array([0.97000436, -0.24308753, 0.0]), np.array([-0.93240737, -0.86473146, 0.0])
    return np.array([one, -one, 0.0 * one]), np.array([-speed / 2, -speed / 2, speed]), [1.0, 1.0, 1.0]


def test_the_figure_eight_is_right_to_6e_14_after_ten_periods(bodies: Kernel) -> None:
    run = Run(bodies, *figure_eight())
    assert run.to(EIGHT) == driver.REACHED
    x, _ = run.read(EIGHT)
    assert np.abs(x - AFTER_EIGHT).max() < 6e-14


def test_three_bodies_that_meet_closely_keep_more_digits_than_rounded_places_have(bodies: Kernel) -> None:
    """Pythagoras' three bodies to t = 70: encounters amplify errors by 1e14. Rounding that does not cancel leaves about 1e-2."""
    x = np.array([[1.0, 3, 0], [-2, -1, 0], [1, -1, 0]])
    run = Run(bodies, x, np.zeros((3, 3)), [3.0, 4.0, 5.0])
    assert run.to(70.0) == driver.REACHED
    found, _ = run.read(70.0)
    expected = np.array(
        [
            [6.933463599011887, 20.261804305951713, 0.0],
            [-2.003006002605984, -6.872463435824545, 0.0],
            [-2.557673357322345, -6.659111834911393, 0.0],
        ]
    )
    assert np.abs((found - found[0]) - (expected - expected[0])).max() < 6e-3


def test_the_order_is_15() -> None:
    """At fixed steps h of an oscillator's radians the error after 36 rad goes as h^15."""
    run = kernel(OSCILLATORS)
    steps, errors = (14, 17, 20), []
    for count in steps:
        one = Run(run, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], [1.0, 0.0], fixed=36.0 / count)
        assert one.to(36.0 - 1e-9) == driver.REACHED
        x, v = one.read(36.0)
        errors.append(math.hypot(x[0, 0] - math.cos(36.0), v[0, 0] + math.sin(36.0)))
        assert one.d[driver.STEPS] == count
    for k in range(2):
        order = math.log(errors[k] / errors[k + 1]) / math.log(steps[k + 1] / steps[k])
        assert order == pytest.approx(15.0, abs=1.2)


def test_the_same_bits_interpreted_and_compiled(bodies: Kernel) -> None:
    runs = [Run(one, *two_bodies()) for one in (bodies, kernel(BODIES))]
    for run in runs:
        run.to(0.7)
    assert runs[0].s.tobytes() == runs[1].s.tobytes()
    assert runs[0].d.tolist() == runs[1].d.tolist()


def test_calls_do_not_change_the_steps(bodies: Kernel) -> None:
    """One call to the end, a step a call, or many calls that are over soon: the same bits."""
    whole, single, small = (Run(bodies, *figure_eight(), MOST=most) for most in (0, 1, 0))
    whole.to(2.0)
    while single.to(2.0) == driver.PAUSED:
        pass
    for k in range(1, 101):
        small.to(0.02 * k)
    kept = whole.at.kept
    assert whole.s[kept].tobytes() == single.s[kept].tobytes() == small.s[kept].tobytes()
    assert whole.read(1.95)[0].tobytes() == small.read(1.95)[0].tobytes()


def test_within_a_step_motion_is_as_good_as_at_its_end() -> None:
    one = Run(kernel(OSCILLATORS), [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], [1.0, 0.0])
    one.to(1.0)
    begin, dt = one.s[driver.T], one.s[driver.SPAN]
    for h in np.linspace(0.0, 1.0, 23):
        t = begin + h * dt
        x, v = one.read(t)
        assert x[0] == pytest.approx([math.cos(t), math.sin(t), 0.0], abs=8e-16)
        assert v[0] == pytest.approx([-math.sin(t), math.cos(t), 0.0], abs=8e-16)


def test_forces_of_velocity_and_their_work() -> None:
    """x'' = -x - x'/4 in closed form, and the work of the drag, which is the energy that is lost."""
    one = Run(kernel(OSCILLATORS), [[1.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]], [1.0, 0.25], SPEEDY=1, WORKING=1)
    one.to(9.0)
    one.d[driver.MOST] = 1
    t = one.s[driver.T]
    w, damp = math.sqrt(1.0 - 0.125**2), math.exp(-0.125 * t)
    place = damp * (math.cos(w * t) + 0.125 / w * math.sin(w * t))
    x, v = one.s[one.at.kept[0][0, 0]], one.s[one.at.kept[2][0, 0]]
    assert x == pytest.approx(place, abs=1e-15)
    assert one.s[one.at.work] == pytest.approx(0.5 * (x * x + v * v) - 0.5, abs=1e-15)


def test_without_forces_motion_is_uniform_and_rest_is_rest() -> None:
    one = Run(kernel(OSCILLATORS), [[0.3, 0.0, 0.0], [7.0, 0.1, 0.2]], [[0.1, 0.0, 0.0], [0.0, 0.0, 0.0]], [0.0, 0.0])
    assert one.to(1000.0) == driver.REACHED
    x, v = one.read(1000.0)
    assert x[0, 0] == pytest.approx(0.3 + 0.1 * 1000.0, rel=1e-15)
    assert x[1].tolist() == [7.0, 0.1, 0.2]
    assert v.tolist() == [[0.1, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert one.d[driver.STEPS] < 30


def test_an_oscillator_that_passes_its_rest_is_not_slowed_down() -> None:
    """Where the force is 0 its time scale is not."""
    one = Run(kernel(OSCILLATORS), [[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], [1.0, 0.0])
    one.to(20 * math.tau)
    assert one.d[driver.STEPS] < 20 * math.tau / PACE * 1.2 + 20


def test_two_points_that_fall_into_one_another_stop_the_run(bodies: Kernel) -> None:
    """Free fall from rest at distance 1: they meet after pi / 4 (masses 1 and 1)."""
    one = Run(bodies, [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], np.zeros((2, 3)), [1.0, 1.0])
    assert one.to(2.0) in (driver.TOO_SHORT, driver.NOT_FINITE)
    assert one.s[driver.T] == pytest.approx(math.pi / 4, abs=1e-6)


@pytest.mark.stress
def test_energy_walks_at_random_over_a_million_steps(bodies: Kernel) -> None:
    """Brouwer's law: over 20 starts an ulp apart the energy's error grows with the root of the number of steps, at most with its 0.55th power."""
    random = np.random.default_rng(5)
    x, v, masses = two_bodies()
    times = [float(2.0 * math.pi * orbits) for orbits in (30, 100, 300, 1000, 3000, 11000)]
    errors = []
    for _ in range(20):
        one = Run(bodies, x * (1 + random.integers(-3, 4, x.shape) * 2.0**-52), v, masses)
        start = energy(*one.state(), masses)
        errors.append([])
        for t in times:
            one.to(t)
            errors[-1].append(float((energy(*one.state(), masses) - start) / start))
        assert one.d[driver.STEPS] > 900_000
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    slope = np.polyfit(np.log(times), np.log(rms), 1)[0]
    assert slope <= 0.55
    assert rms[-1] < 1e-13


def energy(x: Any, v: Any, masses: Any) -> Any:
    """Energy of two bodies, in more digits than a float has where there are some."""
    x, v = np.asarray(x, dtype=np.longdouble), np.asarray(v, dtype=np.longdouble)
    m = np.asarray(masses, dtype=np.longdouble)
    return 0.5 * (m * (v**2).sum(1)).sum() - m[0] * m[1] / np.sqrt(((x[0] - x[1]) ** 2).sum())
