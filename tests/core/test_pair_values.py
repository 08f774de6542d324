"""Values of single pairs of objects: set, combined, saved, forgotten, and refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError, ParameterError, SceneError


def scene(law: str = "collision:elastic", **numbers: Any) -> tuple[xp.PhysicsEngine, Any, list[xp.PhysicalObject]]:
    """Return two balls that fall on one floor at 1 m/s."""
    engine = xp.PhysicsEngine(up="z")
    bounce = engine.add_law(law, name="bounce", **numbers)
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=[bounce])
    balls = [
        xp.PhysicalObject(xp.Sphere(0.1), position=(x, 0, 1), velocity=(2.0, 0, -1), name=name)
        for x, name in ((0, "one"), (9, "two"))
    ]
    engine.add_objects(balls, laws=[bounce])
    return engine, bounce, [floor, *balls]


def speeds(engine: xp.PhysicsEngine) -> tuple[float, float]:
    engine.run(until=1.0)
    return engine.object("one").velocity[2], engine.object("two").velocity[2]


def test_the_value_of_a_pair_holds_for_that_pair_either_way_round() -> None:
    engine, bounce, (floor, one, _) = scene(restitution=1.0)
    bounce.set_pair(one, floor, restitution=0.25)
    assert bounce.pair_values == {frozenset((floor, one)): {"restitution": 0.25}}
    assert speeds(engine) == (0.25, 1.0)


@pytest.mark.parametrize("rule", ["average", "minimum", "maximum", "multiply", "geometric"])
def test_it_stands_above_what_the_objects_have_of_their_own(rule: str) -> None:
    engine, bounce, (floor, one, _) = scene(restitution=0.9, combine=rule)
    floor["restitution"] = one["restitution"] = 0.5
    bounce.set_pair(floor, one, restitution=0.3)
    assert speeds(engine)[0] == 0.3


def test_friction_has_values_of_pairs_too() -> None:
    engine, rub, (floor, one, two) = scene("collision:friction", friction=0.1)
    rub.set_pair(floor, one, friction=0.0, restitution=0.5)
    engine.run(until=1.0)
    assert one.velocity == (2.0, 0.0, 0.5)
    assert two.velocity == pytest.approx((1.8, 0.0, 1.0), abs=1e-15)


def test_values_are_added_changed_and_taken_back_in_the_course_of_a_run() -> None:
    engine, bounce, (floor, one, _) = scene("collision:friction", restitution=1.0, friction=0.0)
    bounce.set_pair(floor, one, friction=0.5)
    bounce.set_pair(floor, one, restitution=0.5)
    assert bounce.pair_values[frozenset((floor, one))] == {"friction": 0.5, "restitution": 0.5}
    bounce.set_pair(floor, one, friction=None, restitution=None)
    assert not bounce.pair_values
    engine.run(until=0.5)
    bounce.set_pair(floor, one, restitution=0.25)
    assert speeds(engine) == (0.25, 1.0)


def test_a_handler_that_fails_takes_the_values_back() -> None:
    engine, bounce, (floor, one, _) = scene()

    class Slip(xp.PhysicalLaw):
        def enforce_this_law(self, event: xp.Event) -> None:
            bounce.set_pair(floor, one, restitution=0.0)
            raise ValueError("no")

    engine.add_law(Slip(), xp.LawContainer(xp.when.Elapsed(0.5)))
    with pytest.raises(xp.errors.LawFailedError):
        engine.run(until=1.0)
    assert not bounce.pair_values


def test_checkpoints_copies_and_reset_keep_them() -> None:
    engine, bounce, (floor, one, two) = scene()
    bounce.set_pair(floor, one, restitution=0.25)
    engine.run(until=0.5)
    for other in (xp.PhysicsEngine.restore(engine.checkpoint()), engine.copy()):
        assert speeds(other) == (0.25, 1.0)
    bounce.set_pair(floor, two, restitution=0.5)
    engine.reset()
    assert list(bounce.pair_values) == [frozenset((floor, one))]
    assert speeds(engine) == (0.25, 1.0)


@pytest.mark.parametrize("form", ["toml", "json"])
def test_scene_files_keep_them(tmp_path: Path, form: str) -> None:
    engine, bounce, (floor, one, _) = scene()
    bounce.set_pair(floor, one, restitution=0.25)
    engine.save_scene(tmp_path / f"s.{form}")
    assert "for_pairs" in (tmp_path / f"s.{form}").read_text()
    assert speeds(xp.PhysicsEngine.load_scene(tmp_path / f"s.{form}")) == (0.25, 1.0)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ('[{ objects = ["one", "flor"], restitution = 0.5 }]', "flor"),
        ('[{ objects = ["one", "floor"], restitution = 2.0 }]', "restitution"),
        ('[{ objects = ["one", "floor"], bounce = 0.5 }]', "bounce"),
        ('[{ objects = ["one", "two"], restitution = 0.5 }]', "not mapped"),
        ('[{ objects = ["one"], restitution = 0.5 }]', "two objects"),
        ('[{ objects = ["one", "floor"] }]', "two objects and values"),
        ("0.5", "a list of tables"),
    ],
)
def test_a_scene_file_that_is_wrong_says_where(tmp_path: Path, wrong: str, says: str) -> None:
    text = f"""xpheve = 1
[[laws]]
id = "collision:elastic"
name = "bounce"
for_pairs = {wrong}
[[objects]]
name = "floor"
fixed = true
shape = {{ kind = "plane" }}
laws = ["bounce"]
[[objects]]
name = "one"
laws = ["bounce"]
position = [0, 3, 0]
[[objects]]
name = "two"
"""
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(SceneError, match=says):
        xp.PhysicsEngine.load_scene(tmp_path / "s.toml")


def test_a_law_without_contacts_takes_none_in_a_scene_file(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        'xpheve = 1\n[[laws]]\nid = "basic:planet_gravity"\nfor_pairs = [{objects = ["a", "b"], x = 1}]'
    )
    with pytest.raises(SceneError, match="answers no contacts"):
        xp.PhysicsEngine.load_scene(tmp_path / "s.toml")


def test_what_is_unmapped_or_removed_is_forgotten() -> None:
    engine, bounce, (floor, one, two) = scene()
    bounce.set_pair(floor, one, restitution=0.25)
    bounce.set_pair(floor, two, restitution=0.5)
    engine.unmap(one, bounce)
    assert list(bounce.pair_values) == [frozenset((floor, two))]
    engine.remove_object(two)
    assert not bounce.pair_values


def test_what_cannot_be_set_is_refused_and_nothing_changes() -> None:
    engine, bounce, (floor, one, _) = scene()
    stranger = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 9)))
    for pair, error, says in (
        ((floor, stranger), InvalidValueError, "not mapped"),
        ((one, one), InvalidValueError, "no pair"),
        ((one, "floor"), InvalidValueError, "no object"),
    ):
        with pytest.raises(error, match=says):
            bounce.set_pair(*pair, restitution=0.5)
    for values, says in (
        ({"restitution": 1.5}, "<= 1"),
        ({"bounce": 0.5}, "no parameter"),
        ({"resting": "hold"}, "no parameter"),
    ):
        with pytest.raises(ParameterError, match=says):
            bounce.set_pair(floor, one, **values)
    with pytest.raises(InvalidValueError, match="not mapped"):
        type(bounce)().set_pair(floor, one, restitution=0.5)
    assert not bounce.pair_values


def test_a_law_of_a_stranger_has_them_without_knowing() -> None:
    class Dull(xp.ResponseLaw):
        container = "collision:exact"
        left = xp.Param(0.5, unit="1", ge=0, le=1)

        def respond(self, contact: xp.Contact) -> float:
            return self.left * contact.approach_speed

    engine = xp.PhysicsEngine(up="z")
    dull = engine.add_law(Dull())
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[dull])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1), velocity=(0, 0, -1)), laws=[dull])
    dull.set_pair(floor, ball, left=0.75)
    engine.run(until=1.0)
    assert ball.velocity[2] == 0.75
