"""Periodic scenes: places in the box, motion untouched, and what knows one image only refused by name."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, LawDefinitionError, SceneError
from xpheve.periodic import near_image, shortest, shortest_rows, wrap_rows, wrapped
from xpheve.record import Record
from xpheve.scene import dumps, loads

BOX = (1.0, 2.0, math.inf)
PLACES = st.floats(-1e6, 1e6)


class Swirl(xp.FieldLaw):
    """A force that reads positions, of a field that is periodic itself."""

    periodic = True
    rate = xp.Param(1.0, unit="1/s")

    def force(self, body: Any) -> Any:
        """Towards smaller x."""
        return -body.mass * self.rate * self.rate * body.position


class Silent(Swirl):
    """The same, which does not say so."""

    periodic = False


class Plain(xp.FieldLaw):
    """A force in NumPy, of which nobody knows what it reads."""

    def apply(self, body: Any) -> Any:
        """Nothing."""
        return np.zeros_like(body.velocity)


def drifting(box: Any = (1.0, 2.0, None)) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """A ball that flies out of the box along x and along z."""
    engine = xp.PhysicsEngine(up="z", periodic=box)
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0.9, 0.5, 0.25), velocity=(0.5, -0.25, -1.0), name="ball")
    return engine, engine.add_object(ball)


@given(PLACES, PLACES, PLACES)
def test_a_place_is_taken_into_the_box_alone_and_in_arrays_to_the_same_bits(x: float, y: float, z: float) -> None:
    one = wrapped((x, y, z), BOX)
    assert 0.0 <= one[0] < 1.0 and 0.0 <= one[1] < 2.0 and one[2] == z
    assert wrap_rows(np.array([[x], [y], [z]]), BOX)[:, 0].tolist() == list(one)
    for k in (0, 1):
        away = (x, y)[k] - one[k]
        assert abs(away - round(away / BOX[k]) * BOX[k]) <= 1e-9


def test_a_place_a_little_below_zero_is_in_the_box_too() -> None:
    assert wrapped((-1e-30, -0.0, 1.0), BOX) == (0.0, 0.0, 1.0)
    assert wrap_rows(np.array([[-1e-30], [-0.0], [1.0]]), BOX)[:, 0].tolist() == [0.0, 0.0, 1.0]


@given(PLACES, PLACES, PLACES)
def test_the_way_to_the_nearest_image_is_at_most_half_a_period(x: float, y: float, z: float) -> None:
    way = shortest((x, y, z), BOX)
    assert abs(way[0]) <= 0.5 and abs(way[1]) <= 1.0 and way[2] == z
    rows = shortest_rows(np.array([[x, y, z]]), BOX)[0]
    assert np.allclose(np.abs(rows), np.abs(way), rtol=0.0, atol=0.0)
    there = near_image((0.25, 0.5, 0.0), (x, y, z), BOX)
    assert abs(there[0] - x) <= 0.5 + 1e-9 and abs(there[1] - y) <= 1.0 + 1e-9


def test_places_are_in_the_box_wherever_they_are_read_and_velocities_are_as_ever(tmp_path: Path) -> None:
    engine, ball = drifting()
    engine.run(until=3.0, every=1.5, record=tmp_path / "record.arrow")
    assert ball.position == pytest.approx((0.4, 1.75, -2.75), abs=1e-12)
    assert ball.velocity == (0.5, -0.25, -1.0)
    assert engine.bodies.position[0].tolist() == list(ball.position)
    record = Record.open(tmp_path / "record.arrow")
    assert record.metadata["periodic"] == [1.0, 2.0, None]
    assert record["ball"].position[:, 0] == pytest.approx([0.9, 0.65, 0.4], abs=1e-12)
    engine.remove_object(ball)
    assert ball.position == pytest.approx((0.4, 1.75, -2.75), abs=1e-12)


def test_reading_and_flying_through_a_face_change_no_bit_of_the_motion() -> None:
    engine, ball = drifting()
    free, other = drifting(None)
    for k in range(1, 8):
        engine.run(until=0.7 * k)
        free.run(until=0.7 * k)
        assert ball.position == wrapped(other.position, BOX)


def test_an_object_written_outside_is_taken_in_and_one_written_where_it_is_stays_as_it_is() -> None:
    engine, ball = drifting()
    engine.run(until=1.0)
    version = int(engine._world.bodies.version[0])
    ball.position = ball.position
    assert int(engine._world.bodies.version[0]) == version
    ball.position = (-0.25, 7.0, -3.0)
    assert ball.position == (0.75, 1.0, -3.0)
    added = engine.add_object(xp.PhysicalObject(position=(5.25, -0.5, 9.0)))
    assert added.position == (0.25, 1.5, 9.0)


def test_a_carried_object_takes_the_way_through_the_nearest_face() -> None:
    engine, ball = drifting()
    ball.position, ball.velocity = (0.9, 0.5, 0.0), (0.0, 0.0, 0.0)
    ball.carry((0.1, 0.5, 0.0), within=1.0)
    assert ball.velocity == pytest.approx((0.2, 0.0, 0.0), abs=1e-15)
    engine.run(until=0.5)
    assert min(ball.position[0], 1.0 - ball.position[0]) < 1e-12
    engine.run(until=2.0)
    assert ball.position == pytest.approx((0.1, 0.5, 0.0), abs=1e-15)


@pytest.mark.parametrize(
    "bad", [1.0, "xyz", (1.0, 2.0), (1.0, 0.0, 2.0), (1.0, -1.0, 2.0), (math.nan, 1, 1), (True, 1, 1)]
)
def test_a_box_that_is_none_is_refused(bad: Any) -> None:
    with pytest.raises(InvalidValueError, match="periodic"):
        xp.PhysicsEngine(periodic=bad)


def test_no_period_at_all_is_no_periodic_scene_and_the_setting_stays() -> None:
    assert xp.PhysicsEngine(periodic=(None, math.inf, None)).periodic is None
    engine = xp.PhysicsEngine(periodic=(1, 2, None))
    assert engine.periodic == BOX
    with pytest.raises(AttributeError):
        engine.periodic = None  # type: ignore[misc]
    assert engine.explain().data["periodic"] == [1.0, 2.0, None]
    assert "periodic: 1 m, 2 m, none" in str(engine.explain())
    assert xp.PhysicsEngine().explain().data["periodic"] is None


@pytest.mark.parametrize("law", ["basic:spring_to_point", "basic:universal_gravity", "basic:rotating_frame", Plain])
def test_a_law_that_reads_positions_is_refused_before_anything_changes(law: Any) -> None:
    engine, _ = drifting()
    with pytest.raises(LawDefinitionError, match="periodic = True"):
        engine.add_law(law)
    assert not engine.laws
    with pytest.raises(LawDefinitionError, match="periodic"):
        engine.add_container(xp.LawContainer(xp.when.Elapsed(1.0))).add_law(Silent())
    assert not engine.laws


@pytest.mark.parametrize(
    "law", ["basic:planet_gravity", "basic:linear_drag", "basic:wind", "basic:magnetic_field", Swirl]
)
def test_laws_that_read_no_position_and_those_that_say_so_act(law: Any) -> None:
    engine, ball = drifting()
    ball["drag_area"] = 0.1
    engine.add_law(law, name="law")
    engine.map(ball, "law")
    engine.run(until=0.5)
    assert all(map(math.isfinite, ball.position)) and 0.0 <= ball.position[0] < 1.0


def test_energy_is_kept_by_what_falls_along_a_periodic_axis() -> None:
    engine = xp.PhysicsEngine(up="z", periodic=(1.0, 1.0, 1.0))
    law = engine.add_law("basic:planet_gravity")
    ball = engine.add_object(xp.PhysicalObject(position=(0.0, 0.0, 0.5)), [law])
    engine.run(until=5.0)
    assert engine.explain().data["energy"]["drift"] < 1e-14
    assert ball.velocity[2] == pytest.approx(5.0 * -law.parameters["acceleration"], rel=1e-12)


@pytest.mark.parametrize(
    "condition",
    [
        xp.when.ProbeEnter(xp.Region(xp.Sphere(0.2), position=(0.5, 0.5, 0.5))),
        xp.when.RegionActive(xp.Region(xp.Sphere(0.2), position=(0.5, 0.5, 0.5))) & xp.when.Started(),
        xp.when.Crosses("body.position.z - 2.0"),
    ],
)
def test_conditions_at_a_place_are_refused(condition: Any) -> None:
    engine, _ = drifting()
    with pytest.raises(InvalidValueError, match="periodic"):
        engine.add_container(xp.LawContainer(condition))
    assert not engine.containers
    engine.add_container(xp.LawContainer(xp.when.Crosses("body.velocity.z - 2.0")))


@pytest.mark.parametrize("kind", ["collision:bounding_box", "collision:picking"])
def test_containers_that_look_at_one_image_are_refused(kind: str) -> None:
    engine, _ = drifting()
    with pytest.raises(InvalidValueError, match="one image"):
        engine.add_container(engine.registry.container(kind)())


def test_a_plane_across_a_periodic_axis_is_refused_and_one_along_it_is_not() -> None:
    engine, _ = drifting()
    with pytest.raises(InvalidValueError, match="across x"):
        engine.add_object(xp.PhysicalObject(xp.Plane((1, 0, 0)), fixed=True))
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True))
    with pytest.raises(InvalidValueError, match="across y"):
        floor.shape = xp.Plane((0, 1, 0))
    assert floor.shape == xp.Plane()


def test_copies_resets_and_checkpoints_are_periodic_too(tmp_path: Path) -> None:
    engine, ball = drifting()
    engine.run(until=3.0)
    for other in (engine.copy(), xp.PhysicsEngine.restore(engine.checkpoint())):
        assert other.periodic == BOX
        assert other.bodies.position.tobytes() == engine.bodies.position.tobytes()
        other.run(until=4.0)
        assert other.bodies.position[0, 0] == pytest.approx(0.9)
    engine.reset()
    assert engine.periodic == BOX and ball.position == (0.9, 0.5, 0.25)


@pytest.mark.parametrize("form", ["toml", "json"])
def test_scene_files_say_it_and_come_back_to_the_same_text(form: str) -> None:
    engine, _ = drifting()
    engine.run(until=3.0)
    text = dumps(engine, form, run={"until": 1.0})
    read = loads(text, form)
    assert read.periodic == BOX
    assert read.object("ball").position == engine.object("ball").position
    engine.reset()
    assert dumps(loads(dumps(engine, form), form), form) == dumps(engine, form)
    assert "periodic" not in dumps(xp.PhysicsEngine(), form)


@pytest.mark.parametrize("bad", ["3.0", "[1.0, 2.0]", '[1.0, "no", 2.0]', "[1.0, 0.0, 2.0]", "[1.0, -1.0, 1.0]"])
def test_a_scene_file_with_a_box_that_is_none_is_refused_by_its_line(bad: str) -> None:
    with pytest.raises(SceneError, match=r":2: periodic"):
        loads(f"xpheve = 1\nperiodic = {bad}\n")


def test_lengths_in_scene_files_have_units() -> None:
    assert loads('xpheve = 1\nperiodic = ["50 cm", "none", 2]\n').periodic == (0.5, math.inf, 2.0)


def test_a_copy_of_an_object_is_where_it_was_seen_and_explain_is_plain_json() -> None:
    engine, ball = drifting()
    engine.run(until=3.0)
    assert copy.copy(ball).position == ball.position
    assert json.loads(engine.explain().to_json())["periodic"] == [1.0, 2.0, None]
