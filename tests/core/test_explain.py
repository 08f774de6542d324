"""Explain: who moves whom and why, what was evaluated, what was skipped; it changes nothing."""

from __future__ import annotations

import json
from typing import Any

import pytest

import xpheve as xp
from xpheve.steppers.core import ALONG

when = xp.when


class Quiet(xp.PhysicalLaw):
    """Do nothing."""

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


def law(engine: xp.PhysicsEngine, label: str) -> dict[str, Any]:
    """Return what is said of one law."""
    found: dict[str, Any] = next(one for one in engine.explain().data["laws"] if label in (one["id"], one["name"]))
    return found


@pytest.fixture
def engine() -> xp.PhysicsEngine:
    """Return a scene of three kinds of motion."""
    made = xp.PhysicsEngine(up="z")
    gravity = made.add_law("basic:planet_gravity")
    bounce = made.add_law("collision:elastic")
    drag = made.add_law("basic:quadratic_drag")
    spring = made.add_law("basic:spring")
    never = made.add_law(Quiet(name="never"), container=xp.LawContainer(when.Posted("never")))
    made.add_law(Quiet(name="off", enabled=False), container=xp.LawContainer(when.Elapsed(0.1, every=True)))
    made.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    made.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1)), laws=[gravity, bounce, never])
    made.add_object(
        xp.PhysicalObject(xp.Sphere(0.1), position=(3, 0, 9), velocity=(1, 0, 0), drag_area=0.5), laws=[gravity, drag]
    )
    for x in (10, 11, 12):
        made.add_object(xp.PhysicalObject(position=(x, 0, 0)), laws=[spring])
    return made


def test_groups_name_their_stepper_and_why_the_others_were_not_taken(engine: xp.PhysicsEngine) -> None:
    engine.run(until=0.1)
    groups = engine.explain().data["groups"]
    by = {group["because"]: group for group in groups}
    assert sum(group["objects"] for group in groups) == 6
    stored = next(group for text, group in by.items() if "stored forces only" in text)
    assert (
        stored["stepper"] == "collision:impact"
        and stored["objects"] == 1
        and stored["offers"]["core:midpoint"]["order"] == 2.0
    )
    drag = next(group for text, group in by.items() if "basic:quadratic_drag" in text)
    assert (
        drag["stepper"] == "core:adaptive"
        and "basic:quadratic_drag" in drag["refused"]["core:ballistic"]
        and drag["steps"] > 0
    )
    spring = next(group for text, group in by.items() if "basic:spring" in text)
    assert spring["objects"] == 3 and spring["groups"] == 1 and "joined by pair laws" in spring["because"]
    assert next(group for group in groups if group["stepper"] == "none")["objects"] == 1


def test_laws_say_how_often_they_were_evaluated_and_why_not(engine: xp.PhysicsEngine) -> None:
    engine.run(until=2.0)
    assert law(engine, "basic:planet_gravity")["how"] == "stored"
    assert law(engine, "basic:planet_gravity")["evaluations"] == 1
    assert law(engine, "basic:quadratic_drag")["evaluations"] > 1
    never = law(engine, "never")
    assert (
        never["evaluations"] == 0
        and "has not fired" in never["skipped_because"]
        and "never" in never["skipped_because"]
    )
    assert law(engine, "off")["evaluations"] == 0 and law(engine, "off")["skipped_because"] == "disabled"
    fired = {one["condition"]: one["firings"] for one in engine.explain().data["conditions"]}
    assert fired["Posted(id='never')"] == 0
    assert law(engine, "collision:elastic")["evaluations"] == engine.explain().data["contacts"]["impacts"] > 0


def test_a_law_without_objects_costs_nothing(engine: xp.PhysicsEngine) -> None:
    engine.add_law("basic:linear_drag")
    engine.run(until=1.0)
    found = law(engine, "basic:linear_drag")
    assert found["evaluations"] == 0 and found["how"] == "unmapped"


def test_a_free_form_law_without_objects_waits() -> None:
    engine = xp.PhysicsEngine()
    engine.add_law(Quiet(name="never"), container=xp.LawContainer(when.Posted("never")))
    engine.run(until=1.0)
    assert law(engine, "never")["how"] == "event" and "has not fired" in law(engine, "never")["skipped_because"]


def test_it_says_what_was_skipped() -> None:
    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0), colour=3.0))
    engine.run(until=1.0)
    data = engine.explain().data
    text = " ".join(data["skipped"])
    assert "closed form" in text and "contacts" in text and "host steps" in text
    assert data["unread_columns"] == ["colour"] and "colour" in str(engine.explain())


def test_json_is_json_and_the_text_names_what_matters(engine: xp.PhysicsEngine) -> None:
    for until in (None, 0.7):
        if until:
            engine.run(until=until)
        found = engine.explain()
        data = json.loads(found.to_json())
        assert data["objects"] == 6 and data["time"] == engine.time and len(data["laws"]) == 6
        for word in ("core:ballistic", "basic:planet_gravity", "collision:elastic", "energy", "Posted"):
            assert word in str(found)


def test_it_changes_nothing_before_and_after_the_start(engine: xp.PhysicsEngine) -> None:
    for until in (None, 0.0, 0.5, 1.5):
        if until is not None:
            engine.run(until=until)
        before = engine.checkpoint()
        first = engine.explain().to_json()
        assert engine.explain().to_json() == first
        assert engine.checkpoint() == before


def test_it_works_while_something_waits_that_cannot_be_saved() -> None:
    engine = xp.PhysicsEngine()
    engine.add_law(Quiet(name="ears"), container=xp.LawContainer(when.Posted()))
    engine.post("go", object())
    assert engine.explain().data["laws"][0]["evaluations"] == 0


def test_it_works_with_laws_that_need_arguments() -> None:
    class Odd(Quiet):
        def __init__(self, what: int) -> None:
            super().__init__(name="odd")
            self.what = what

    engine = xp.PhysicsEngine()
    engine.add_law(Odd(3), container=xp.LawContainer(when.Elapsed(1.0)))
    assert engine.explain().data["laws"][0]["evaluations"] == 0
    engine.run(until=2.0)
    assert engine.explain().data["laws"][0]["evaluations"] == 1


def test_drift_is_null_before_the_start_and_small_after(engine: xp.PhysicsEngine) -> None:
    assert engine.explain().data["energy"]["drift"] is None
    engine.run(until=1.0, rtol=1e-10, atol=1e-12)
    assert abs(engine.explain().data["energy"]["drift"]) < 1e-6
    assert engine.explain().data["energy"]["work_by"]["basic:quadratic_drag"] < 0


# Loops


def windy(count: int, compile: str = "auto", step: float | None = 0.01) -> xp.PhysicsEngine:
    """Return a scene of gravity, drag and wind on ``count`` objects, after ten steps."""
    made = xp.PhysicsEngine(up="z", compile=compile)
    laws = [made.add_law(f"basic:{name}", name=name) for name in ("planet_gravity", "quadratic_drag", "wind")]
    made.add_objects([xp.PhysicalObject(position=(k, 0, 0), drag_area=0.1) for k in range(count)], laws=laws)
    made.run(0.1, dt=step)
    return made


def group_of(engine: xp.PhysicsEngine) -> dict[str, Any]:
    """Return what is said of the only group."""
    (found,) = engine.explain().data["groups"]
    return dict(found)


def test_groups_say_how_their_loop_runs_and_why() -> None:
    few, some, many = (group_of(windy(count)) for count in (3, 30, 300))
    assert [few["tier"], some["tier"], many["tier"]] == ["interpreted", "numpy", "compiled"]
    assert few["tier_because"].startswith("3 rows and pairs: up to 12 floats one by one are fastest")
    assert many["tier_because"] == "300 rows and pairs: from 256 on it pays to compile"
    assert group_of(windy(3, "always"))["tier_because"] == 'compile="always"; 3 rows and pairs'
    assert few["kernel"]["origin"] == "interpreted" and some["kernel"] is None
    assert many["kernel"]["what"] == "basic:quadratic_drag + basic:wind" and many["kernel"]["seconds"] > 0
    assert many["kernel"]["origin"] in ("compiled", "memory", "cache")
    assert all(one["calls"].startswith("many steps in one call") for one in (few, some, many))


def test_it_says_what_was_compiled_and_from_where_it_came() -> None:
    engine = windy(3, "always")
    data, text = engine.explain().data, str(engine.explain())
    assert data["compile"] == "always"
    told = next(one for one in data["compiled"] if one["what"] == "basic:quadratic_drag + basic:wind")
    assert told.keys() == {"what", "origin", "seconds"}
    assert f"code: {told['what']}: " in text and f"compiled in this process: {told['what']}: " in text


def test_before_the_start_it_says_how_a_loop_would_run() -> None:
    engine = xp.PhysicsEngine()
    laws = [engine.add_law("basic:quadratic_drag")]
    engine.add_objects([xp.PhysicalObject(drag_area=0.1) for _ in range(300)], laws=laws)
    driven = group_of(engine)
    assert (driven["stepper"], driven["tier"], driven["kernel"]) == ("core:adaptive", "interpreted", None)
    assert driven["tier_because"] == "from 50000 evaluations of rows and pairs on it pays to compile; not run yet"
    engine.stepper = "core:midpoint"
    assert group_of(engine)["tier"] == "compiled" and group_of(engine)["tier_because"].endswith("not run yet")
    assert group_of(engine)["kernel"] is None


def test_motion_in_closed_form_has_no_loop(engine: xp.PhysicsEngine) -> None:
    engine.run(0.1, dt=0.01)
    for group in engine.explain().data["groups"]:
        assert (group["tier"] == "") == (group["stepper"] != "core:midpoint")


def test_what_steps_one_by_one_says_why(engine: xp.PhysicsEngine) -> None:
    engine.stepper = "core:midpoint"
    engine.run(0.1)
    tiers = {group["tier_because"] for group in engine.explain().data["groups"] if group["tier"] == "law by law"}
    assert tiers == {"steps follow the tolerances; with dt they are made in a loop"}
    followed = windy(3)
    law = followed.add_law(Quiet(), container=xp.LawContainer(when.Crosses(lambda body: body.position.z + 100.0)))
    followed.map(followed.objects[0], law)
    followed.run(0.2, dt=0.01)
    assert group_of(followed)["calls"] == "one step in a call: a condition follows its motion"
    stepped = windy(3)
    stepped.add_law(Quiet(), container=xp.LawContainer(when.Steps()))
    stepped.run(0.2, dt=0.01)
    assert group_of(stepped)["calls"] == "one step in a call: somebody is called at host steps"


def test_contacts_are_a_reason_to_step_one_by_one() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law(f"basic:{name}") for name in ("planet_gravity", "quadratic_drag")]
    bounce = engine.add_law("collision:elastic")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1), drag_area=0.1), laws=[*laws, bounce])
    engine.run(0.1, dt=0.01)
    (calls,) = {group["calls"] for group in engine.explain().data["groups"] if group["tier"]}
    assert calls == "one step in a call: contacts of its objects are looked for"


def test_laws_say_what_they_read_what_they_are_and_what_they_cost() -> None:
    engine = windy(30)
    drag, wind, gravity = (law(engine, name) for name in ("quadratic_drag", "wind", "planet_gravity"))
    assert drag["tier"] == wind["tier"] == "numpy" and gravity["tier"] == ""
    assert drag["reads"] == ["drag_area", "velocity"]
    assert drag["kind"].startswith("depends on velocity; not conservative")
    assert gravity["kind"] == "constant"
    assert drag["operations"]["roots"] == 1
    assert 0.0 < drag["share"] < wind["share"] and drag["share"] + wind["share"] == pytest.approx(1.0)
    assert drag["evaluations"] == wind["evaluations"] > 10
    text = str(engine.explain())
    assert "quadratic_drag [numpy]: reads drag_area, velocity" in text and "% of the operations of a step" in text


def test_a_pair_law_says_that_it_is_conservative() -> None:
    engine = xp.PhysicsEngine()
    spring = engine.add_law("basic:spring", name="spring")
    engine.add_objects([xp.PhysicalObject(position=(k, 0, 0)) for k in range(3)], laws=[spring])
    engine.run(0.1, dt=0.01)
    found = law(engine, "spring")
    assert (
        found["reads"] == ["position"] and "conservative" in found["kind"] and "not" not in found["kind"].split(";")[-2]
    )
    assert found["share"] == 1.0


def test_a_law_that_is_switched_says_so() -> None:
    engine = windy(3)
    wind = engine.law("wind")
    for k in range(3):
        wind.enabled = not wind.enabled
        engine.run(0.2 + 0.1 * k, dt=0.01)
    found = law(engine, "wind")
    assert found["switched"] and found["how"] == "disabled" and not law(engine, "quadratic_drag")["switched"]
    assert "switched by a number" in str(engine.explain())


def test_every_stepper_of_core_makes_an_offer_or_says_why_not() -> None:
    class Breeze(xp.FieldLaw):
        """A push without a potential that bends with the place."""

        strength = xp.Param(0.1, unit="N/m^2")

        def force(self, body: Any) -> Any:
            return self.strength * body.position.norm() * body.position

    engine = xp.PhysicsEngine(stepper="core:symplectic8")
    engine.add_object(xp.PhysicalObject(position=(1.0, 0.5, 0.0)), laws=[engine.add_law(Breeze)])
    engine.run(until=0.1, dt=0.01)
    (group,) = engine.explain().data["groups"]
    assert group["stepper"] == "core:midpoint"
    assert group["offers"].keys() | group["refused"].keys() >= {*ALONG, "core:ballistic", "core:midpoint"}
    assert not group["offers"].keys() & group["refused"].keys()
    assert "no potential" in group["refused"]["core:symplectic8"]
    assert all(group["refused"].values())
    said = str(engine.explain())
    assert all(f"refused: {name}: {why}" in said for name, why in group["refused"].items())
