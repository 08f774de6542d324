"""Impacts beside peers: the loop by hand is right, the answers are exact by another road, all build the same scene, each scene runs."""

from __future__ import annotations

import importlib
import json
import math
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


def load(name: str) -> Any:
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    return importlib.import_module(f"benchmarks.{name}")


command, front, ours, pages, peers, stages, turns = (
    load(name) for name in ("impacts.__main__", "front", "impacts.ours", "pages", "peers", "impacts.stage", "turns")
)
plain = load("impacts.plain_loop")
bounces, bullets, cradles, hard_spheres, spheres, scenery, superball, tumbling = (
    load(f"scenes.{name}")
    for name in (
        "bounces",
        "s09_bullets",
        "s10_cradles",
        "hard_spheres",
        "s05_elastic_spheres",
        "scenery",
        "superball",
        "tumbling",
    )
)
Thing, Stage = stages.Thing, stages.Stage


# The loop by hand.


def in_a_cube(n: int, seed: int = 3) -> Any:
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    places = (grid[random.permutation(64)[:n]] + 0.5) * 0.25
    return plain.Spheres(places, random.normal(size=(n, 3)), 0.2, 1.0, periodic=False)


def meeting(x: Any, v: Any, square: float) -> float:
    b, a, c = x @ v, v @ v, x @ x - square
    d = b * b - a * c
    return math.inf if b >= 0 or d < 0 else max(0.0, (-b - math.sqrt(d)) / a)


def all_pairs(start: Any, until: float) -> tuple[Any, Any, int, int]:
    """The same from event to event by looking at all pairs and walls each time."""
    x, v, r, t, met, walls = start.position.copy(), start.velocity.copy(), 0.5 * start.diameter, 0.0, 0, 0
    while True:
        events = [(meeting(x[i] - x[j], v[i] - v[j], start.diameter**2), i, j) for i in range(len(x)) for j in range(i)]
        for i, k in np.ndindex(*x.shape):
            wall = start.edge - r if v[i, k] > 0 else r
            events.append((max(0.0, (wall - x[i, k]) / v[i, k]), i, -1 - k))
        step, i, j = min(events)
        if t + step > until:
            return x + v * (until - t), v, met, walls
        x, t = x + v * step, t + step
        if j < 0:
            v[i, -1 - j] *= -1.0
            walls += 1
        else:
            n = (x[i] - x[j]) / np.linalg.norm(x[i] - x[j])
            push = ((v[i] - v[j]) @ n) * n
            v[i], v[j], met = v[i] - push, v[j] + push, met + 1


def test_the_loop_by_hand_does_what_looking_at_all_pairs_does() -> None:
    start, found = in_a_cube(12), in_a_cube(12)
    x, v, met, walls = all_pairs(start, 0.6)
    plain.run(found, until=0.6)
    assert (found.impacts, found.walls) == (met, walls) and met > 5 and walls > 10
    assert np.abs(found.position - x).max() < 1e-9 and np.abs(found.velocity - v).max() < 1e-9


@pytest.mark.parametrize("a_cell", [0.35, 4.0])
def test_the_loop_by_hand_keeps_energy_and_lets_no_spheres_overlap(a_cell: float) -> None:
    found = in_a_cube(40)
    before = (found.velocity**2).sum()
    plain.run(found, impacts=20_000, a_cell=a_cell)
    assert found.impacts == 20_000
    assert abs((found.velocity**2).sum() / before - 1.0) < 1e-12
    assert plain.closest(found.position, 0.2, 1.0, False) > 0.2 - 1e-13
    assert found.position.min() > 0.1 - 1e-13 and found.position.max() < 0.9 + 1e-13


@pytest.mark.parametrize(("n", "packing"), [(500, 0.1), (500, 0.3), (500, 0.45)])
def test_the_rate_of_impacts_of_a_fluid_is_enskogs(n: int, packing: float) -> None:
    fluid = plain.fluid(n, packing)
    momentum = fluid.velocity.sum(axis=0)
    plain.run(fluid, impacts=60_000)
    assert fluid.impacts / fluid.time / plain.enskog_rate(n, packing) == pytest.approx(1.0, abs=0.02)
    assert np.abs(fluid.velocity.sum(axis=0) - momentum).max() < 1e-10
    assert plain.closest(fluid.position, 1.0, fluid.edge, True) > 1.0 - 1e-13


def test_a_large_fluid_is_put_together_of_copies_that_go_apart() -> None:
    fluid = plain.fluid(8000, 0.3)
    assert fluid.n == 8000 and fluid.periodic and fluid.time == 0.0
    assert fluid.n * math.pi / 6 / fluid.edge**3 == pytest.approx(0.3)
    assert plain.closest(fluid.position, 1.0, fluid.edge, True) > 1.0 - 1e-13
    assert (fluid.velocity**2).sum() == pytest.approx(3 * 8000)
    half = fluid.edge / 2
    left = np.sort(fluid.position[(fluid.position < half).all(axis=1)], axis=0)
    assert len(left) and not np.allclose(left[:50], np.sort(np.mod(fluid.position, half), axis=0)[:50])


def test_spheres_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        plain.lattice(100, 0.74)
    narrow = plain.Spheres(np.full((1, 3), 0.5), np.ones((1, 3)), 1.0, 2.5, periodic=True)
    with pytest.raises(ValueError, match="too narrow"):
        plain.run(narrow, until=1.0)


# Stages.


def test_a_thing_has_the_inertia_that_our_shapes_have() -> None:
    for one in (
        Thing("sphere", (0.3,), mass=2.0),
        Thing("box", (0.1, 0.2, 0.4), mass=3.0),
        Thing("capsule", (0.2, 0.7), mass=1.5),
    ):
        assert one.inertia == pytest.approx(ours.shape(one).inertia(one.mass), rel=1e-14)


def test_the_energy_of_a_stage_is_that_of_the_engine() -> None:
    stage = tumbling.stage("box")
    engine = ours.new_engine()
    ours.fill(engine, stage)
    engine.run(until=0.0)
    assert float(stage.energy(stage.start)) == pytest.approx(engine.energy().total, rel=1e-14)
    faster = stage.start._replace(velocity=2.0 * stage.start.velocity)
    assert stage.drift(faster) > 0.01


@pytest.mark.parametrize(
    ("position", "depth"),
    [
        ((0.0, 0.0, 0.45), 0.05),  # on the face
        ((0.0, 0.0, 0.51), 0.0),
        ((0.3, 0.3, 0.4), 0.0),  # off the edge: sqrt(0.02) away
        ((0.24, 0.27, 0.0), 0.05),  # 3-4-5 with the upright edge at (0.2, 0.24): 0.05 away
    ],
)
def test_the_depth_of_a_sphere_in_a_box_is_told(position: Any, depth: float) -> None:
    box = Thing("box", (0.2, 0.24, 0.4))
    stage = Stage([box, Thing("sphere", (0.1,), position, mass=1.0)])
    expected = 0.05 if depth else 0.0
    assert stage.overlap(stage.start) == pytest.approx(expected, abs=1e-12)


def test_the_depth_of_spheres_in_turned_boxes_planes_and_one_another_is_told() -> None:
    half = math.sqrt(0.5)
    turned = Thing("box", (1.0, 0.1, 1.0), (0.0, 0.0, 5.0), orientation=(half, half, 0.0, 0.0))  # flat in z now
    stage = Stage([turned, Thing("sphere", (0.2,), (0.5, 0.5, 5.25), mass=1.0)])
    assert stage.overlap(stage.start) == pytest.approx(0.05)
    floor = Stage([Thing("plane", (0.0, 0.0, 1.0), (0, 0, 1.0)), Thing("sphere", (0.5,), (3.0, 0.0, 1.3), mass=1.0)])
    assert floor.overlap(floor.start) == pytest.approx(0.2)
    pair = Stage([Thing("sphere", (0.5,), (float(k) * 0.9, 0, 0), mass=1.0) for k in range(2)])
    assert pair.overlap(pair.start) == pytest.approx(0.1)
    assert math.isinf(pair.overlap(pair.start._replace(position=np.full((2, 3), np.nan))))


def test_the_scenery_has_two_thousand_things_and_nothing_overlaps_at_first() -> None:
    stage = scenery.stage()
    assert (len(stage.scenery), len(stage.movers)) == (2000, 666)
    assert stage.overlap(stage.start) == 0.0
    seen = [stage.start, stage.start._replace(velocity=1.5 * stage.start.velocity)]
    assert scenery.watched(stage, seen)["energy rises by at most"] > 0


@pytest.mark.parametrize("name", ["mujoco", "pybullet", "rapier3d", "dartpy"])
def test_a_peer_that_is_installed_begins_where_the_stage_does_and_falls_as_we_do(name: str) -> None:
    adapter = peers.adapter(name, peers.IMPACTS)
    if adapter is None:
        pytest.skip(f"{name} is not installed")
    high = [
        Thing("plane", (0.0, 0.0, 1.0)),
        Thing("sphere", (0.1,), (0, 0, 9.0), (1, 0, 0), mass=1.0),
        Thing("box", (0.1, 0.2, 0.3), (0, 3.0, 9.0), (0, 1, 0), (0.5, 0.5, 0.5, 0.5), (1.0, 2.0, 3.0), 2.0),
    ]
    stage = Stage(high, 1.0, 9.81)
    for setting in ("default", "tuned"):
        world = adapter.World(stage, setting, 1 / 1000)
        for found, expected in zip(world.read(), stage.start, strict=True):
            assert np.abs(np.asarray(found) - expected).max() < 1e-6
        world.advance(100)
        end = world.read()
        assert np.abs(end.position[:, 2] - (9.0 - 0.5 * 9.81 * 0.01)).max() < 2e-3
        assert abs(stage.drift(end)) < 1e-3


# Answers.


def test_a_superball_keeps_energy_and_what_the_contact_keeps() -> None:
    """Between two impacts at one plate the angular momentum about the contact point is kept, in fractions to nothing."""
    start, count = superball.exact(0.0)
    assert count == 0 and [float(c) for c in start[3:6]] == list(superball.VELOCITY)

    def energy(state: Any) -> Fraction:
        moment = Fraction(2, 5) * Fraction(superball.RADIUS) ** 2
        return sum(c * c for c in state[3:6]) + moment * sum(c * c for c in state[6:])  # type: ignore[no-any-return]

    for span in (0.2, 1.0, 2.0):
        state, count = superball.exact(span)
        assert energy(state) == energy(start) and count >= 1
    after, count = superball.exact(0.1)
    assert count == 1
    r = Fraction(superball.RADIUS)
    for along, spin, sign in ((3, 7, 1), (4, 6, -1)):  # about the floor: r v_x + 2/5 r^2 w_y, and -r v_y + 2/5 r^2 w_x

        def about(s: Any, along: int = along, spin: int = spin, sign: int = sign) -> Fraction:
            return sign * r * s[along] + Fraction(2, 5) * r * r * s[spin]  # type: ignore[no-any-return]

        assert about(after) == about(start)


def test_the_answer_of_a_cradle_is_that_as_many_leave_as_struck() -> None:
    assert cradles.exact(5, 1).tolist() == [0, 0, 0, 0, 1, 0]
    assert cradles.exact(5, 2).tolist() == [0, 0, 0, 1, 1, 0, 0]
    assert cradles.exact(2, 3).tolist() == [1, 1, 1, 0, 0]  # the foremost striker goes on
    assert cradles.off(np.zeros((6, 3)), 5, 1) == 1.0
    assert math.isinf(cradles.off(np.full((6, 3), np.nan), 5, 1))


def test_our_cradles_are_exact_and_our_bullets_stopped() -> None:
    assert max(cradles.mine(n, k) for n, k in ((2, 1), (5, 3), (3, 5))) <= 1e-12
    assert bullets.ended(1000.0, 0.0)[0] == pytest.approx(-0.015, abs=1e-9)
    assert bullets.instant_error(1000.0) < 1e-12


def test_our_balls_bounce_as_the_closed_form_says() -> None:
    for problem in bounces.PROBLEMS:
        contender = ours.contender(problem, problem.ours[0])
        go, end = contender.make()
        go()
        assert problem.error(end()) < 1e-11 and abs(problem.drift(end())) < 1e-13


def test_our_spheres_on_the_way_keep_energy_and_apart() -> None:
    problem = spheres.QUICK[0]
    seen = problem.watched(ours.contender(problem, problem.ours[0]).watch())
    assert seen["deepest overlap [m]"] < 1e-12 and seen["largest energy error"] < 1e-13
    seen = problem.watched(spheres.plain(problem).watch())
    assert seen["deepest overlap [m]"] < 1e-12 and seen["largest energy error"] < 1e-13


def test_a_tumbling_box_comes_back() -> None:
    stage = tumbling.stage("box")
    span, tumble = tumbling.until_impacts(stage, 2)
    assert tumble.times[1] < span < tumble.times[2]
    assert tumbling.momentum_error(stage, span) < 1e-10
    assert tumbling.way_back(stage, 1) < 1e-8


# Tables.


def point(engine: str, seconds: float, error: float, **more: Any) -> dict[str, Any]:
    return load("measure").Row("scene", engine, "-", None, seconds, 0.0, error, None, "", more).plain()  # type: ignore[no-any-return]


def test_what_is_aside_counts_where_a_bar_names_it_and_on_no_front() -> None:
    bar = load("problem").Bar
    rows = [point("xPheve", 2.0, 1e-15, ours=True), point("plain", 1.0, 1e-16, aside=True), point("peer", 50.0, 1e-3)]
    assert [row["engine"] for row in front.front(rows)] == ["xPheve"]
    assert front.standings(rows)[0].beaten_by == []
    assert front.judge(bar("", "ratio", ratio=0.1), rows).met is True
    assert front.judge(bar("", "ratio", peer="plain", ratio=1.3), rows).met is False
    assert front.judge(bar("", "ratio", peer="plain", ratio=2.0), rows).met is True


def test_the_finest_peer_is_the_one_of_least_error() -> None:
    bar = load("problem").Bar
    rows = [point("xPheve", 2.0, 1e-15, ours=True), point("fast", 1.0, 1e-1), point("fine", 100.0, 1e-6)]
    assert front.judge(bar("", "ratio", ratio=1 / 30, finest=True), rows).met is True
    assert front.judge(bar("", "ratio", ratio=1 / 30), rows).met is False


def test_what_is_watched_may_be_the_error() -> None:
    problem = scenery.QUICK[0]
    contender = ours.contender(problem, problem.ours[0])
    contender.watch = lambda: [problem.stage.start._replace(position=problem.stage.start.position - (0, 0, 1.8))]
    rows = turns.take_turns(problem, [contender], 1)
    assert rows[0].error > 0.01 and "energy rises by at most" in rows[0].more["measures"]


def test_a_special_that_fails_is_a_bar_that_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any) -> Any:
        raise LookupError("not here")

    monkeypatch.setattr(cradles, "measure", broken)
    results = command.COMMAND.collect(["s10_cradles"], {}, quick=True)
    assert pages.verdicts(results)[0][1].met is False
    assert "not here" in pages.table(results)


@pytest.mark.parametrize("name", ["s05_elastic_spheres", "scenery", "s10_cradles", "s12_contacts", "hard_spheres"])
def test_a_quick_run_without_peers_writes_its_files(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command.main(["--quick", "--peer", "none", "--scene", name, "--out", str(tmp_path)])
    assert "| xPheve |" in capsys.readouterr().out or name == "hard_spheres"
    results = json.loads((tmp_path / "impacts.json").read_text())
    assert "it runs" not in [bar["text"] for special in results["specials"] for bar in special["bars"]]
    for scene in results["scenes"]:
        assert all(row["seconds"] for row in scene["rows"]), scene["rows"]
    assert pages.table(results) == (tmp_path / "impacts.md").read_text()


def test_the_page_and_the_table_are_made_from_the_results_in_the_repository() -> None:
    folder = ROOT / "benchmarks" / "results"
    text = (folder / "impacts.md").read_text(encoding="utf-8")
    assert pages.table(json.loads((folder / "impacts.json").read_text(encoding="utf-8"))) == text
    assert text in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
