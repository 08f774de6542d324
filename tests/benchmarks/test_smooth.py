"""Smooth motion beside its peers: the answers are exact by another road, fronts and bars are told as they are, each scene runs."""

from __future__ import annotations

import importlib
import json
import math
import sys
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


def load(name: str) -> Any:
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    return importlib.import_module(f"benchmarks.{name}")


command, problems, front, report = (load(name) for name in ("smooth.__main__", "smooth.problem", "front", "pages"))
references, turning, ours_module, measure = (
    load("references"),
    load("smooth.turning"),
    load("smooth.ours"),
    load("turns"),
)
free_spin, kepler = load("references.free_spin"), load("references.kepler")
PROBLEMS = [problem for name in command.SCENES for problem in load(f"scenes.{name}").PROBLEMS]
IDS = [problem.id for problem in PROBLEMS]
by_id = dict(zip(IDS, PROBLEMS, strict=True))


# The answers, held against another road to them.


def test_keplers_equation_gives_the_orbit_that_taylor_series_of_newtons_law_give() -> None:
    swarm = load("scenes.kepler").start()
    with mpmath.workdps(30):
        x = [mpmath.mpf(float(b)) - mpmath.mpf(float(a)) for a, b in zip(*swarm.position, strict=True)]
        v = [mpmath.mpf(float(b)) - mpmath.mpf(float(a)) for a, b in zip(*swarm.velocity, strict=True)]
        mu = mpmath.mpf(float(swarm.mass[0])) + mpmath.mpf(float(swarm.mass[1]))

        def newton(t: Any, y: Any) -> Any:
            cube = mpmath.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2) ** 3
            return [*y[3:], *(-mu * c / cube for c in y[:3])]

        solved = mpmath.odefun(newton, 0, [*x, *v])(mpmath.mpf(0.1))
        high, low = kepler.relative_state(swarm, 0.1)
        for k in range(3):
            assert abs(solved[k] - mpmath.mpf(high[0, k]) - mpmath.mpf(low[0, k])) < mpmath.mpf(10) ** -25


def test_the_reference_of_an_orbit_comes_round() -> None:
    scene = load("scenes.kepler")
    swarm = scene.start()
    high, low = kepler.relative_state(swarm, scene.PERIOD)
    assert (
        problems.distance(problems.relative(swarm.position), high, low) < 1e-11
    )  # a is 1 to the last digits only, and pericentre is fast


@pytest.mark.parametrize("span", [0.7, 3.1])
def test_the_closed_form_of_a_free_body_solves_eulers_equations(span: float) -> None:
    spin = by_id["S4 60 s"].spin
    with mpmath.workdps(30):
        slope = by_id["S4 60 s"].slope

        def right(t: Any, y: Any) -> Any:
            return list(slope.make(mpmath.sqrt)(t, y))

        solved = mpmath.odefun(right, 0, [mpmath.mpf(c) for c in slope.start])(mpmath.mpf(span))
        exact = free_spin.orientation(spin.inertia, spin.turning, span)
        sign = 1 if solved[0] * exact[0] + solved[1] * exact[1] > 0 else -1
        for a, b in zip(solved[:4], exact, strict=True):
            assert abs(a - sign * b) < mpmath.mpf(10) ** -24


def test_the_stored_orientations_are_those_of_the_closed_form_now() -> None:
    spin = by_id["S4 60 s"].spin
    for known in references.load("free_spin"):
        exact = free_spin.orientation(spin.inertia, spin.turning, known.span)
        with mpmath.workdps(40):
            for high, low, e in zip(known.high, known.low, exact, strict=True):
                assert abs(mpmath.mpf(high) + mpmath.mpf(low) - e) < 1e-30


def test_the_reference_of_the_heavy_top_nutates_as_elliptic_functions_say() -> None:
    """u = cos(angle to the vertical): u' ^2 is a cubic; u = u2 + (u1 - u2) sn^2 (Landau and Lifshitz, section 35)."""
    scene = load("scenes.heavy_top")
    known = references.load("heavy_top")[0]
    with mpmath.workdps(40):
        mpf = mpmath.mpf
        up = [mpf(c) for c in scene.UP]
        weight = mpmath.sqrt(sum(c * c for c in up))
        i1, i3, w3 = mpf(scene.INERTIA[0]), mpf(scene.INERTIA[2]), mpf(scene.TURNING[2])
        u0 = up[2] / weight  # let go with nothing but the spin: p_phi = i3 w3 u0
        a, b, alpha = i3 * w3 / i1, 2 * weight / i1, 2 * weight / i1 * u0
        # u'^2 = (alpha - b u)(1 - u^2) - a^2 (u0 - u)^2 = (u0 - u) (b (1 - u^2) - a^2 (u0 - u))
        assert alpha == b * u0
        half = a * a / (2 * b)
        root = mpmath.sqrt(half * half - 2 * half * u0 + 1)
        low, high = half - root, half + root
        # from u0 down to ``low``: u = low + (u0 - low) cn^2-like; with s from u0
        m = (u0 - low) / (high - low)
        rate = mpmath.sqrt(b * (high - low)) / 2
        sn = mpmath.ellipfun("sn", mpmath.ellipk(m) + rate * mpf(known.span), m=m)
        u = low + (u0 - low) * sn * sn
        q = [mpf(h) + mpf(low_part) for h, low_part in zip(known.high[:4], known.low[:4], strict=True)]
        axis = [2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]), 1 - 2 * (q[1] ** 2 + q[2] ** 2)]
        assert abs(sum(x * c for x, c in zip(axis, up, strict=True)) / weight - u) < mpf(10) ** -28


@pytest.mark.parametrize(
    ("name", "least"), [("figure_eight", 1e-29), ("pythagorean", 1e-26), ("outer_solar_system", 1e-27)]
)
def test_the_references_of_bodies_in_quadruple_precision_keep_energy_and_momentum(name: str, least: float) -> None:
    scene = load(f"scenes.{name}")
    swarms = getattr(scene, "SWARMS", None) or [scene.SWARM]
    data = json.loads((references.FOLDER / f"{name}.json").read_text())["answers"]
    assert len(data) == len(swarms)
    for swarm, one in zip(swarms, data, strict=True):
        start = [float.fromhex(c) for c in one["start"]]
        assert start == [*swarm.position.ravel().tolist(), *swarm.velocity.ravel().tolist()]
        with mpmath.workdps(40):
            begin = conserved(swarm, [mpmath.mpf(c) for c in start])
            end = conserved(swarm, [mpmath.mpf(c) for c in one["end"]])
            for a, b in zip(begin, end, strict=True):
                assert abs(a - b) < least * max(1, abs(begin[0])), name


def conserved(swarm: Any, state: list[Any]) -> list[Any]:
    """Energy, momentum, angular momentum with many digits."""
    n = swarm.n
    x, v = ([state[part + 3 * i : part + 3 * i + 3] for i in range(n)] for part in (0, 3 * n))
    m = [mpmath.mpf(float(one)) for one in swarm.mass]
    energy = sum(m[i] * sum(c * c for c in v[i]) for i in range(n)) / 2
    for i in range(n):
        for j in range(i):
            r = mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(x[i], x[j], strict=True)))
            energy -= mpmath.mpf(swarm.constant) * m[i] * m[j] / r
    spin = sum(m[i] * (x[i][0] * v[i][1] - x[i][1] * v[i][0]) for i in range(n))
    return [energy, *(sum(m[i] * v[i][c] for i in range(n)) for c in range(3)), spin]


def test_the_references_of_stiff_scenes_agree_with_another_solver() -> None:
    integrate = pytest.importorskip("scipy.integrate")
    for name, state in (("van_der_pol", [0]), ("robertson", [0, 1, 2])):
        problem = load(f"scenes.{name}").PROBLEMS[0]
        formula, known = problem.slope.make(math.sqrt), references.load(name)[0]
        solved = integrate.solve_ivp(
            lambda t, y, formula=formula: np.array(formula(t, y)),
            (0.0, problem.span),
            problem.slope.start,
            method="Radau",
            rtol=1e-7,
            atol=1e-13,
            jac=problem.slope.jacobian,
        )
        assert np.abs(solved.y[state, -1] / known.high[state] - 1.0).max() < 1e-6


def test_the_bottle_keeps_the_speed_and_the_gradient_the_momentum_in_their_references() -> None:
    bottle, gradient = load("scenes.magnetic_bottle"), load("scenes.gravity_gradient")
    v = references.load("magnetic_bottle")[0].high[3:]
    assert abs(v @ v - 2.0) < 1e-15
    end = gradient.ends(references.load("gravity_gradient")[0].high)
    assert abs(gradient.drift(end)) < 1e-15 and gradient.momentum(end) < 1e-15
    assert bottle.error(bottle.ends(references.load("magnetic_bottle")[0].high)) < 1e-15


def test_the_chain_in_modes_is_the_chain_in_matrices() -> None:
    chain = load("scenes.stiff_chain")
    high, _ = chain.exact()
    n, t = chain.N, chain.SPAN
    stiffness = chain.STIFFNESS * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    squares, shapes = np.linalg.eigh(stiffness)
    omega = np.sqrt(squares - 100.0)
    moved = np.exp(-10.0 * t) * (np.cos(omega * t) + 10.0 / omega * np.sin(omega * t)) * (shapes.T @ chain.START)
    assert np.abs(shapes @ moved - high).max() < 1e-9


def test_the_overdamped_spring_falls_at_the_slow_rate() -> None:
    spring = load("scenes.stiff_spring")
    x, v = spring.exact(spring.STRONG, 0.1)
    assert abs(float(x) - math.exp(-1.0)) < 1e-4 and float(v) < 0


# What peers and we are given is the same.


@pytest.mark.parametrize(
    "name", ["S4 60 s", "heavy top", "gravity gradient", "van der Pol", "Robertson", "gyration", "magnetic bottle"]
)
def test_the_slope_that_peers_get_is_that_of_our_laws(name: str) -> None:
    problem = by_id[name]
    import xpheve as xp

    engine = xp.PhysicsEngine()
    bodies = problem.build(engine)
    h = {"van der Pol": 1e-7, "Robertson": 1e-5}.get(name, 1e-4)
    engine.run(until=h, dt=h / 4)
    found = ours_module.read(bodies)
    formula = problem.slope.make(math.sqrt)
    y = np.array(problem.slope.start)
    for _ in range(4):  # the midpoint rule, too
        middle = y + h / 8 * np.array(formula(0.0, y))
        y = y + h / 4 * np.array(formula(0.0, middle))
    expected, start = problem.slope.end(y), problem.slope.end(problem.slope.start)
    for ours, theirs, before in zip(found, expected, start, strict=True):
        if theirs is not None:
            moved = np.abs(np.asarray(theirs) - np.asarray(before)).max()
            assert np.abs(np.asarray(ours) - theirs).max() <= 1e-3 * moved + 1e-15


def test_turning_a_vector_into_the_body_and_back_changes_nothing() -> None:
    q = np.array([0.1, -0.5, 0.7, 0.2]) / math.sqrt(0.79)
    v = (0.3, -2.0, 1.1)
    assert np.allclose(turning.to_world(q, turning.to_body(q, v)), v, rtol=1e-15, atol=1e-15)
    assert turning.angle(q, -q, 0 * q) < 1e-18
    half = math.sin(5e-9)
    assert turning.angle([math.cos(5e-9), half, 0, 0], np.array([1.0, 0, 0, 0]), np.zeros(4)) == pytest.approx(
        1e-8, rel=1e-9
    )


def test_starts_shifted_by_an_ulp_differ_and_by_no_more() -> None:
    swarms = load("scenes.pythagorean").SWARMS
    assert len({swarm.position.tobytes() for swarm in swarms}) == len(swarms) == 20
    for swarm in swarms:
        assert np.all(np.abs(swarm.position - swarms[0].position) <= np.spacing(np.abs(swarms[0].position)))


# Each scene runs.


@pytest.mark.parametrize("problem", PROBLEMS, ids=IDS)
def test_each_scene_runs_with_each_stepper_that_is_there(problem: Any) -> None:
    seen = set()
    for one in problem.ours:
        if one.method in seen:
            continue
        seen.add(one.method)
        try:
            engine, bodies = ours_module.built(problem, one, compile="never")
        except LookupError:
            continue
        run = dict(one.run)
        until = min(problem.short, 30 * run.get("dt", problem.short))
        engine.run(until=until, **run)
        end = ours_module.read(bodies)
        assert all(np.isfinite(part).all() for part in end)
        assert any(not np.array_equal(a, b) for a, b in zip(end, ours_module.read(problem.build(fresh())), strict=True))


def fresh() -> Any:
    import xpheve as xp

    return xp.PhysicsEngine()


def test_running_a_little_before_changes_no_bit_of_the_end() -> None:
    problem = by_id["figure eight"]
    one = problems.Ours("midpoint", "core:midpoint", {"dt": 0.05})
    ends = []
    for begun in (False, True):
        engine, bodies = ours_module.built(problem, one, compile="never")
        if begun:
            engine.run(until=ours_module.BEGUN * problem.span, **one.run)
        engine.run(until=3.0, **one.run)
        ends.append(ours_module.read(bodies).position.tolist())
    assert ends[0] == ends[1]


@pytest.mark.parametrize("name", ["rebound", "heyoka", "scipy", "mujoco", "pybullet"])
def test_a_peer_that_is_installed_follows_a_scene(name: str) -> None:
    peers = load("peers")
    adapter = peers.adapter(name, peers.SMOOTH)
    if adapter is None:
        pytest.skip(f"{name} is not installed")
    problem = by_id["Kepler 100" if name == "rebound" else "S4 60 s"]
    rows = measure.take_turns(problem, adapter.smooth(problem)[:2], 1)
    assert rows and all(row.seconds and row.error is not None and row.error < 4.0 for row in rows)


# Fronts and bars.


def point(
    engine: str, seconds: float | None, error: float | None, setting: str = "-", ours: bool = False, **more: Any
) -> dict[str, Any]:
    row = load("measure").Row("scene", engine, setting, None, seconds, 0.0, error, 1e-13, "", {"ours": ours, **more})
    return row.plain()


PEERS = [point("fast", 1.0, 1e-3), point("fine", 10.0, 1e-9), point("poor", 20.0, 1e-2), point("none", None, None)]


def test_the_front_is_what_nobody_beats_in_both() -> None:
    assert [row["engine"] for row in front.front(PEERS)] == ["fast", "fine"]
    twin = point("twin", 1.0, 1e-3)
    assert len(front.front([*PEERS, twin])) == 2


@pytest.mark.parametrize(
    ("seconds", "error", "beaten"),
    [
        (0.5, 1.0, []),
        (5.0, 1e-4, []),
        (5.0, 1e-2, ["fast"]),
        (30.0, 0.1, ["fast", "fine", "poor"]),
        (10.0, 1e-9, []),
        (11.0, 1e-9, []),
    ],
)
def test_a_point_is_beaten_only_by_what_is_faster_and_more_accurate(
    seconds: float, error: float, beaten: list[str]
) -> None:
    found = front.standing(point("xPheve a", seconds, error, ours=True), PEERS)
    assert [row["engine"] for row in found.beaten_by] == beaten


def test_how_far_ahead_is_told_against_the_fastest_that_is_as_accurate() -> None:
    found = front.standing(point("xPheve a", 2.0, 1e-8, ours=True), PEERS)
    assert found.rival["engine"] == "fine" and found.ahead == 5.0
    assert front.standing(point("xPheve a", 2.0, 1e-12, ours=True), PEERS).ahead == math.inf


def judged(bar: Any, *rows: dict[str, Any]) -> Any:
    return front.judge(bar, [*rows, *PEERS])


def test_bars_are_met_missed_or_untold() -> None:
    bar = problems.Bar
    good, bad = (
        point("xPheve a", 2.0, 1e-10, "rtol 1e-09", True, measures={"phase": 1e-8}),
        point("xPheve a", 0.5, 1e-2, "rtol 1e-03", True),
    )
    assert judged(bar("", "error", error=1e-9), good, bad).met is True
    assert judged(bar("", "all errors", error=1e-9), good, bad).met is False
    assert judged(bar("", "all errors", error=1e-9, setting="rtol 1e-09"), good, bad).met is True
    assert judged(bar("", "all errors", error=1e-9, method="b"), good, bad).met is None
    assert judged(bar("", "front", error=1e-9), good, bad).met is True
    assert judged(bar("", "front", error=1e-11), good, bad).met is False
    assert judged(bar("", "front"), good, bad).met is True
    slow = point("xPheve a", 2.0, 1e-2, ours=True)
    assert judged(bar("", "front"), slow).met is False
    assert judged(bar("", "front", peer="poor"), slow).met is True
    assert judged(bar("", "front", peer="nobody"), slow).met is None
    rough = judged(bar("", "front", peer="fine"), point("xPheve a", 2.0, 1e-5, ours=True))
    assert rough.met is True and "Below our least error, 1.0e-05, is only the peer: 1.0e-09" in rough.found
    assert judged(bar("", "ratio", peer="fine", ratio=0.3), good, bad).met is True
    assert judged(bar("", "ratio", peer="fine", ratio=0.3, error=1e-9), good, bad).met is True
    assert judged(bar("", "ratio", peer="fine", ratio=0.1, error=1e-9), good, bad).met is False
    assert judged(bar("", "ratio", peer="fine", ratio=0.3, no_larger=True), bad).met is False
    assert judged(bar("", "value", key="phase", ratio=1e-9), good).met is False
    assert judged(bar("", "drift", error=1e-12), good).met is True


def test_what_fails_is_a_row_that_says_so_and_has_no_time() -> None:
    problem = by_id["S4 60 s"]

    def broken() -> Any:
        raise LookupError("not here")

    rows = measure.take_turns(problem, [measure.Contender(measure.row(problem, "xPheve x", "-"), broken)], 2)
    assert rows[0].seconds is None and "not here" in rows[0].note
    assert front.counted([row.plain() for row in rows]) == []


def test_many_starts_are_one_row_with_the_median_error() -> None:
    variants = load("scenes.pythagorean").VARIANTS[:3]
    made = []

    def contender(k: int) -> Any:
        def make() -> Any:
            made.append(k)
            return (lambda: sum(range(2000))), (lambda: k)

        return measure.Contender(measure.row(variants[0], "x", "-"), make)

    one = measure.together([contender(k) for k in range(3)])
    go, end = one.make()
    go()
    assert end() == (0, 1, 2) and one.parts == 3 and made == [0, 1, 2]


def test_the_slope_of_a_random_walk_is_a_half() -> None:
    growth = load("scenes.energy_growth")
    steps = [10, 100, 1000, 10_000]
    assert growth.slope(steps, [1e-16 * math.sqrt(n) for n in steps]) == pytest.approx(0.5)
    assert growth.slope(steps, [1e-16 * n for n in steps]) == pytest.approx(1.0)


def test_a_quick_run_without_peers_writes_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command.main(["--quick", "--peer", "none", "--scene", "s04_free_spin", "--out", str(tmp_path)])
    assert "S4 60 s: a free asymmetric body" in capsys.readouterr().out
    results = json.loads((tmp_path / "smooth.json").read_text())
    assert [row["error"] < 1e-11 for scene in results["scenes"] for row in scene["rows"]] == [True] * 6
    assert (tmp_path / "smooth.csv").read_text().startswith("scene,engine")
    assert report.table(results) == (tmp_path / "smooth.md").read_text()


def test_pictures_are_small(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    rows = [point("xPheve a", 10.0**k, 10.0 ** (-3 * k), ours=True) for k in range(4)] + PEERS
    path = tmp_path / "one.png"
    assert load("plots").draw("a title", "error", rows, path)
    assert 2_000 < path.stat().st_size < 60_000
    assert not load("plots").draw("a title", "error", [PEERS[-1]], path)


def test_the_page_and_the_table_are_made_from_the_results_in_the_repository() -> None:
    folder = ROOT / "benchmarks" / "results"
    text = (folder / "smooth.md").read_text(encoding="utf-8")
    assert report.table(json.loads((folder / "smooth.json").read_text(encoding="utf-8"))) == text
    assert text.strip() in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    for picture in (folder / "smooth").glob("*.png"):
        assert picture.stat().st_size < 60_000


def test_the_page_shows_the_sums_over_many_that_are_in_the_repository() -> None:
    text = (ROOT / "benchmarks" / "results" / "long_range.md").read_text(encoding="utf-8")
    assert text.strip() in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
