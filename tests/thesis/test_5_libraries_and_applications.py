"""Thesis 1.5, 3.2.1, 4.2, 5 and 6: packages of laws, integration, saved scenes, order, platforms."""

from __future__ import annotations

import ast
import inspect
import json
import random
import re
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.plugins import Registry

ROOT = Path(__file__).parents[2]


@pytest.mark.thesis("plug-in")
def test_fig_3_10_a_law_and_a_container_plug_in_with_no_change_elsewhere(tmp_path: Path) -> None:
    """They are classes of this file; saved, restored and explained like all others."""

    class Above(xp.LawContainer):
        """Fires when an object of its laws is above 1 m."""

        id = "here:above"
        period = 0.125

        def detect(self) -> Any:
            """Look."""
            high = tuple(obj for law in self.laws for obj in law.objects if obj.position[1] > 1.0)
            return xp.Event(self.engine.time, objects=high) if high else None

    class Stop(xp.PhysicalLaw):
        """Stops what is too high."""

        id = "here:stop"
        initial_state: ClassVar[dict[str, Any]] = {"stopped": 0}

        def enforce_this_law(self, event: Any) -> None:
            """Stop."""
            for obj in event.objects:
                obj.velocity = (0, 0, 0)
                self.state["stopped"] += 1

    def scene() -> tuple[xp.PhysicsEngine, Any]:
        engine = xp.PhysicsEngine()
        law = engine.add_law(Stop, container=Above())
        return engine, engine.add_object(xp.PhysicalObject(velocity=(0, 1, 0), name="balloon"), laws=[law])

    engine, balloon = scene()
    engine.run(until=0.75)
    other = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Stop], containers=[Above])
    for one in (engine, other):
        one.run(until=3.0)
    assert balloon.position == (0, 1.125, 0) == other.object("balloon").position
    assert engine.laws[0].state["stopped"] == other.laws[0].state["stopped"] > 0
    assert "here:stop" in str(engine.explain())


class Bounds(xp.LawContainer):
    """Looks each 10 ms whether the boxes around two spheres meet."""

    period = 0.01

    def detect(self) -> Any:
        """Look."""
        a, b = self.laws[0].objects
        reach = a.shape.radius + b.shape.radius
        near = all(abs(p - q) <= reach for p, q in zip(a.position, b.position, strict=True))
        return xp.Event(self.engine.time, objects=(a, b)) if near else None


class Stand(xp.PhysicalLaw):
    """Stops both: the cheapest response of all."""

    def enforce_this_law(self, event: Any) -> None:
        """Stop."""
        for obj in event.objects:
            obj.velocity = (0, 0, 0)


@pytest.mark.thesis("precision-by-choice")
def test_5_2_precision_is_chosen_by_container_and_law() -> None:
    """Head-on at 1 m/s each, a gap of 1.005 m: a look each 10 ms is late by up to 2 cm, the exact container by nothing."""

    def places(cheap: bool) -> tuple[float, float]:
        engine = xp.PhysicsEngine()
        law = (
            engine.add_law(Stand(), container=Bounds())
            if cheap
            else engine.add_law("collision:elastic", restitution=0.0)
        )
        pair = [
            engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), velocity=(v, 0, 0)), laws=[law])
            for x, v in ((0.0, 1.0), (2.005, -1.0))
        ]
        engine.run(until=2.0)
        return pair[0].position[0], pair[1].position[0]

    left, right = places(cheap=True)
    assert 0.98 < right - left < 1.0
    left, right = places(cheap=False)
    assert right - left == pytest.approx(1.0, abs=1e-12)


@pytest.mark.thesis("packages-of-laws")
def test_5_3_every_law_comes_with_interface_cost_and_where_it_holds_beside_similar_ones() -> None:
    registry = Registry.default()
    infos = [info for info in registry.laws() if info.pack in ("basic", "collision")]
    assert len(infos) >= 9
    page = (ROOT / "docs" / "laws.md").read_text(encoding="utf-8")
    for info in infos:
        doc = inspect.getdoc(registry.law(info.id)) or ""
        assert re.search(r"\bholds?\b|\bvalid\b", doc, re.IGNORECASE), info.id
        assert re.search(r"\bcosts?\b", doc, re.IGNORECASE), f"{info.id}: say what it costs"
        assert "Source:" in doc, info.id
        assert f"## {info.id}" in page, info.id


@pytest.mark.thesis("packages-of-laws")
def test_5_3_packs_are_written_without_the_engines_source() -> None:
    """They import contracts only: laws, shapes, errors and the like, never what plans or runs."""
    inner = ("xpheve.plan", "xpheve.engine", "xpheve.scene", "xpheve.cli")
    for path in sorted((ROOT / "packages").glob("xpheve-laws-*/src/**/*.py")):
        for module in imported(path):
            assert not module.startswith(inner), f"{path.name} imports {module}"


def imported(path: Path) -> list[str]:
    """Return the modules that a file imports."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.append(node.module)
    return found


BOUND = {
    "_winapi", "crypt", "curses", "fcntl", "grp", "msvcrt", "nt", "ossaudiodev", "posix", "pty", "pwd", "resource", "spwd",
    "syslog", "termios", "tty", "winreg", "winsound",
}  # fmt: skip


@pytest.mark.thesis("platforms")
def test_1_5_nothing_is_bound_to_one_operating_system() -> None:
    for path in sorted((ROOT / "packages").glob("*/src/**/*.py")):
        assert not BOUND & {name.partition(".")[0] for name in imported(path)}, path
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"os\.(fork|mkfifo)\b|[\"']/(tmp|usr|etc|dev)/", text), path
        assert "os.getuid" not in text or 'hasattr(os, "getuid")' in text, path
    for path in sorted((ROOT / "packages").glob("*/pyproject.toml")):
        assert "flit_core.buildapi" in path.read_text(encoding="utf-8")  # pure Python: one wheel for all


@pytest.mark.thesis("integration")
def test_5_2_the_page_of_integration_has_the_four_decisions_and_the_seven_steps() -> None:
    """That its program runs is held by the test of the pages."""
    text = (ROOT / "docs" / "integration.md").read_text(encoding="utf-8")
    for word in ("first", "second", "third", "fourth"):
        assert re.search(rf"\b{word}\b", text, re.IGNORECASE)
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    steps = [int(number) for number in re.findall(r"# (\d)[.:]", code)]
    assert steps[:7] == [1, 2, 3, 4, 5, 6, 7]
    assert "assert" in code and "step(" in code


def edited() -> xp.PhysicsEngine:
    """Return a scene that was built, run, edited while it ran, and run again."""
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8, name="gravity")
    bounce = engine.add_law("collision:elastic", restitution=0.8, name="bounce")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 1, 0), name="ball"), laws=[gravity, bounce])
    ball.add_force((0.3, 0, 0), 0.7, id="wind")
    engine.run(until=0.33)
    gravity.acceleration = 1.62  # type: ignore[attr-defined]
    ball.mass = 1.5
    ball.add_force((0, 0, 0.1), 2.0)
    late = engine.add_object(xp.PhysicalObject(xp.Sphere(0.2), position=(2, 3, 0.1), name="late"), laws=[gravity])
    engine.map(late, bounce)
    engine.run(until=0.5)
    return engine


@pytest.mark.thesis("edited-scene")
@pytest.mark.parametrize("form", ["toml", "json"])
def test_fig_5_5_a_scene_edited_live_comes_back_to_the_same_bits(form: str, tmp_path: Path) -> None:
    engine = edited()
    path = tmp_path / f"scene.{form}"
    engine.save_scene(path)
    other = xp.PhysicsEngine.load_scene(path)
    ball, again = engine.object("ball"), other.object("ball")
    mine = [force for force in ball.forces if force.id == "wind"]
    assert [(f.vector, f.duration) for f in mine] == [((0.3, 0, 0), pytest.approx(0.2, abs=1e-15))]
    other.run(until=other.time)

    def state(one: xp.PhysicsEngine) -> Any:
        return [
            (obj.name, obj.mass, obj.position, obj.velocity, [law.name for law in obj.laws])
            for obj in sorted(one.objects, key=lambda obj: obj.name)
        ]

    assert state(other) == state(engine)
    users = [[(f.vector, f.duration, f.id) for f in one.engine.user_forces(one)] for one in (ball, again)]
    assert users[0] == users[1] and len(users[0]) == 2
    assert other.law("gravity").parameters == engine.law("gravity").parameters
    path_again = tmp_path / f"again.{form}"
    other.save_scene(path_again)
    texts = [re.sub(r'Written by [^\n"]*', "", one.read_text(encoding="utf-8")) for one in (path, path_again)]
    assert texts[0] == texts[1]  # but for the line that says when it was written


@pytest.mark.thesis("order-of-laws")
def test_6_laws_are_enforced_in_the_order_that_they_ask_for() -> None:
    def called(**asked: dict[str, Any]) -> list[str]:
        calls: list[str] = []
        kinds = [
            type(
                name,
                (xp.PhysicalLaw,),
                {
                    "id": f"order:{name}",
                    "enforce_this_law": lambda self, e: calls.append(self.id[6:]),
                    **asked.get(name, {}),
                },
            )
            for name in "abc"
        ]
        random.Random(3).shuffle(kinds)
        engine = xp.PhysicsEngine()
        holder = xp.LawContainer(xp.when.Started())
        for kind in kinds:
            engine.add_law(kind(), container=holder)
        engine.run(until=0.0)
        return calls

    assert called() == ["a", "b", "c"]  # by id, not as added
    assert called(c={"before": ("order:a",)}) == ["b", "c", "a"]
    assert called(a={"after": ("order:c",)}) == ["b", "c", "a"]
    assert called(b={"priority": 1}) == ["b", "a", "c"]
    assert called(b={"priority": -1}) == ["a", "c", "b"]


@pytest.mark.thesis("order-of-laws", "order-of-laws/measurements")
def test_6_the_measurements_say_time_beside_error() -> None:
    results = json.loads((ROOT / "benchmarks" / "results" / "results.json").read_text(encoding="utf-8"))
    ours = [row for row in results["rows"] if row["engine"] == "xPheve"]
    assert {row["scene"] for row in ours} >= {"S1", "S2", "S2b", "S12"}
    assert all(row["seconds"] > 0 and row["error"] is not None for row in ours)


@pytest.mark.thesis("other-gravities")
@pytest.mark.parametrize(("planet", "g"), [("Earth", 9.81), ("Moon", 1.62), ("Mars", 3.71), ("Jupiter", 24.79)])
def test_4_2_other_planets_are_other_accelerations(planet: str, g: float) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:planet_gravity", acceleration=g, name=planet)
    body = engine.add_object(xp.PhysicalObject(), laws=[law])
    engine.run(until=2.0)
    assert body.position == pytest.approx((0, -2 * g, 0), rel=1e-15)


@pytest.mark.thesis("other-gravities")
def test_4_2_universal_gravity_holds_a_moon_on_its_circle() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    engine.add_object(xp.PhysicalObject(mass=1.0, fixed=True), laws=[law])
    moon = engine.add_object(xp.PhysicalObject(mass=1e-3, position=(1, 0, 0), velocity=(0, 1, 0)), laws=[law])
    engine.run(until=6.283185307179586, dt=1e-2)
    assert moon.position == pytest.approx((1, 0, 0), abs=1e-3)


@pytest.mark.thesis("impulse-of-any-steps")
@settings(deadline=None, max_examples=60)
@given(
    steps=st.lists(st.floats(1e-4, 0.5), min_size=1, max_size=12),
    forces=st.lists(st.tuples(st.floats(-50, 50), st.floats(1e-4, 2.0)), min_size=1, max_size=5),
)
def test_2_5_any_sequence_of_steps_gives_force_times_the_lesser_of_duration_and_time(
    steps: list[float], forces: list[tuple[float, float]]
) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(mass=2.0))
    for force, duration in forces:
        body.add_force((force, 0, 0), duration)
    for step in steps:
        engine.run(until=engine.time + step)
    t = engine.time
    impulse = sum(force * min(duration, t) for force, duration in forces)
    way = sum(force * min(duration, t) * (t - min(duration, t) / 2) for force, duration in forces)
    scale = sum(abs(force) for force, _ in forces) * (1 + t) ** 2
    assert 2.0 * body.velocity[0] == pytest.approx(impulse, abs=1e-14 * scale)
    assert 2.0 * body.position[0] == pytest.approx(way, abs=1e-14 * scale)
    assert len(body.forces) == sum(duration > t for _, duration in forces)


@pytest.mark.thesis("five-balls")
def test_4_3_1_fig_4_12_five_balls_each_touching_pair_once_with_normal_and_point() -> None:
    heard: list[Any] = []
    hear = type("Hear", (xp.PhysicalLaw,), {"enforce_this_law": lambda self, event: heard.extend(event.contacts)})
    engine = xp.PhysicsEngine()
    laws = [engine.add_law(hear(), container=xp.LawContainer(xp.when.Impact())), engine.add_law("collision:elastic")]
    middle = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5)), laws=laws)
    ways = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1)]
    others = [
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), position=[3 * c for c in way], velocity=[-c for c in way]), laws=laws
        )
        for way in ways
    ]
    engine.run(until=2.5)
    assert sorted(id(one.body_a if one.body_b is middle else one.body_b) for one in heard) == sorted(map(id, others))
    for one in heard:
        other, sign = (one.body_b, 1.0) if one.body_a is middle else (one.body_a, -1.0)
        way = ways[others.index(other)]
        assert [sign * c for c in one.normal] == pytest.approx(way, abs=1e-15)
        assert one.point == pytest.approx([0.5 * c for c in way], abs=1e-12)


@pytest.mark.thesis("live-changes")
def test_2_8_objects_laws_and_mappings_change_while_it_runs() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    body = engine.add_object(xp.PhysicalObject())
    engine.run(until=1.0)
    engine.map(body, gravity)
    engine.run(until=2.0)
    wind = engine.add_law("basic:planet_gravity", acceleration=2.0, direction=(1, 0, 0), name="wind")
    engine.map(body, wind)
    engine.run(until=3.0)
    engine.unmap(body, gravity)
    other = engine.add_object(xp.PhysicalObject(), laws=[gravity])
    engine.run(until=4.0)
    engine.remove_law(wind)
    gone = engine.remove_object(other)
    engine.run(until=5.0)
    assert body.velocity == (4.0, -20.0, 0.0) and gone.velocity == (0.0, -10.0, 0.0)


@pytest.mark.thesis("only-when-needed")
def test_1_4_the_saving_is_a_number_beside_a_run_where_every_law_runs_at_each_update() -> None:
    """How the numbers are found is held by tests/benchmarks/test_noope.py."""
    rows = json.loads((ROOT / "benchmarks" / "results" / "noope.json").read_text(encoding="utf-8"))["rows"]
    for scene in ("busy", "quiet"):
        needed, *others = (row for row in rows if row["scene"] == scene)
        assert needed["setting"] == "when needed" and needed["error"] < 1e-12
        assert len(others) >= 2
        assert all(row["asked"] > 100 * needed["asked"] and row["error"] > 1e-4 for row in others)
