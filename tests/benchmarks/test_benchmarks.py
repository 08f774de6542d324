"""The benchmarks say what is true: the exact answers are exact, our errors are under the bars, the page shows the results."""

from __future__ import annotations

import decimal
import importlib
import json
import random
import sys
from fractions import Fraction
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def load(name: str):
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    return importlib.import_module(name)


BALLS = load("benchmarks.scenes").BALLS
free_spheres = load("benchmarks.scenes.s12_free_spheres")


def flown(ball, span: float) -> tuple[list[decimal.Decimal], list[decimal.Decimal]]:
    """The ball's motion by another road: from arrival to arrival, each found by bisection, in 60 decimal digits."""
    with decimal.localcontext(decimal.Context(prec=60)):
        dec = decimal.Decimal
        x, v = [dec(c) for c in ball.position], [dec(c) for c in ball.velocity]
        g, radius, left = dec(ball.gravity), dec(ball.radius), dec(span)

        def height(s: decimal.Decimal) -> decimal.Decimal:
            return x[2] + v[2] * s - g * s * s / 2

        while ball.restitution is not None:
            low = max(v[2] / g, dec(0))  # the top of the flight is before the floor
            high = low + 10
            assert height(low) > radius > height(high)
            while high - low > dec(10) ** -50:
                middle = (low + high) / 2
                low, high = (middle, high) if height(middle) > radius else (low, middle)
            if high >= left:
                break
            x = [x[0] + v[0] * high, x[1] + v[1] * high, radius]
            v = [v[0], v[1], -dec(ball.restitution) * (v[2] - g * high)]
            left -= high
        return [x[0] + v[0] * left, x[1] + v[1] * left, height(left)], [v[0], v[1], v[2] - g * left]


@pytest.mark.parametrize("ball", BALLS, ids=lambda ball: ball.id)
@pytest.mark.parametrize("part", [0.01, 0.2, 0.47, 0.71, 1.0])
def test_the_exact_answer_of_a_ball_is_that_of_another_method(ball, part: float) -> None:
    span = ball.span * part
    x, v = ball.exact(span)
    x_other, v_other = flown(ball, span)
    for ours, other in zip([*x, *v], [*x_other, *v_other], strict=True):
        # 40 digits asked for, of numbers up to 100.
        assert abs(decimal.Decimal(load("mpmath").nstr(ours, 40)) - other) < decimal.Decimal("1e-36")


def test_a_lossy_ball_lies_still_after_its_last_bounce() -> None:
    lossy = next(ball for ball in BALLS if ball.id == "S2b")
    x, v = lossy.exact(4.1)  # at rest from 4.06 s on
    assert float(x[2]) == 0.1
    assert float(v[2]) == 0.0


def test_the_exact_answer_of_free_spheres_is_that_of_fractions_stepped() -> None:
    places, velocities = free_spheres.start(10_000)
    for k in (0, 17, 9_999):
        x, v, h = [Fraction(c) for c in places[k]], [Fraction(c) for c in velocities[k]], Fraction(1, 64)
        for _ in range(64):
            x = [a + b * h for a, b in zip(x, v, strict=True)]
            x[2] -= Fraction(free_spheres.GRAVITY) * h * h / 2
            v[2] -= Fraction(free_spheres.GRAVITY) * h
        for ours, other in zip(free_spheres.exact(places[k], velocities[k], 1.0), x, strict=True):
            assert abs(float(ours) - float(other)) <= 1e-15 * abs(float(other))
            assert abs(Fraction(str(load("mpmath").nstr(ours, 40))) - other) < Fraction(1, 10**34)


def test_what_numpy_does_by_hand_is_right() -> None:
    for components_first in (False, True):
        x, _ = free_spheres.by_hand(100, components_first=components_first)(1.0)
        assert free_spheres.worst_error(x.T if components_first else x, 100, 1.0) < 1e-12


@pytest.mark.parametrize("ball", BALLS, ids=lambda ball: ball.id)
def test_our_error_is_under_its_bar_at_any_time_not_only_at_the_end(ball) -> None:
    for part in sorted(random.Random(2).random() for _ in range(12)):
        engine, body = ball.build()
        t = ball.span * part
        engine.run(until=t)
        with load("mpmath").workdps(40):
            for ours, exact in zip(body.position, ball.exact(t)[0], strict=True):
                assert abs(ours - exact) <= ball.error_bar


@pytest.mark.parametrize("ball", BALLS, ids=lambda ball: ball.id)
def test_host_steps_that_nobody_hears_change_no_bit(ball) -> None:
    found = []
    for dt in (None, 1 / 60, 1 / 240, 1 / 1000):
        engine, body = ball.build()
        engine.run(until=ball.span, dt=dt)
        found.append((body.position, body.velocity))
    assert found == [found[0]] * len(found)


def test_a_quick_run_without_peers_writes_its_files_and_is_under_its_bars(tmp_path: Path, capsys) -> None:
    run = load("benchmarks.run")
    assert run.main(["--quick", "--peer", "none", "--scene", "S1", "--scene", "S2", "--out", str(tmp_path)]) == 0
    assert "S2: a sphere bounces" in capsys.readouterr().out
    results = json.loads((tmp_path / "results.json").read_text())
    bars = {"S1": (1e-12 * 100.0, 1e-12), "S2": (1e-11, 1e-13)}
    assert {row["scene"] for row in results["rows"]} == set(bars)
    for row in results["rows"]:
        assert row["engine"] == "xPheve"
        assert row["error"] <= bars[row["scene"]][0]
        assert abs(row["drift"]) <= bars[row["scene"]][1]
        assert row["seconds"] > 0
    assert (tmp_path / "results.csv").read_text().startswith("scene,engine")
    assert (tmp_path / "results.md").exists()


def test_a_peer_that_is_not_installed_is_a_row_that_says_so() -> None:
    run = load("benchmarks.run")
    rows = run.ball_rows(BALLS[0], {"mujoco": None}, 1, (1 / 60,))
    assert [row.note for row in rows if row.engine == "mujoco"] == ["not installed"]


def test_nothing_is_computed_between_reads_of_free_spheres() -> None:
    engine = free_spheres.build(50)
    before = free_spheres.counters(engine)
    for k in range(1, 61):
        engine.run(until=k / 60)
        assert engine.bodies.position.shape == (50, 3)
    assert free_spheres.counters(engine) == before
    assert before["evaluations"] == [1]
    assert free_spheres.worst_error(engine.bodies.position, 50, engine.time) <= free_spheres.ERROR_BAR


def test_the_page_shows_the_results_that_are_in_the_repository() -> None:
    results = ROOT / "benchmarks" / "results" / "results.md"
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert results.read_text(encoding="utf-8").strip() in page


def test_the_table_in_the_repository_is_made_from_the_results_beside_it() -> None:
    folder = ROOT / "benchmarks" / "results"
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert load("benchmarks.report").table(results) == (folder / "results.md").read_text(encoding="utf-8")
