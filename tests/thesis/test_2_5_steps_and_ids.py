"""Thesis 2.5: any sequence of steps gives F min(duration, elapsed); what ids promise."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError
from xpheve.scene import dumps, loads


@pytest.mark.thesis("impulse-of-any-steps")
@settings(deadline=None, max_examples=60)
@given(
    spans=st.lists(st.floats(1e-4, 0.7), min_size=1, max_size=12),
    force=st.floats(-1e3, 1e3),
    duration=st.floats(0.0, 3.0),
    mass=st.floats(0.1, 50.0),
    dt=st.none() | st.floats(0.01, 0.3),
)
def test_2_5_any_irregular_sequence_of_steps_gives_force_times_the_lesser_of_duration_and_time(
    spans: list[float], force: float, duration: float, mass: float, dt: float | None
) -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(mass=mass))
    body.add_force((force, 0, 0), duration)
    for span in spans:
        engine.run(until=engine.time + span, dt=dt)
        acted = min(duration, engine.time)
        assert mass * body.velocity[0] == pytest.approx(force * acted, rel=1e-12, abs=1e-12)
        way = force / mass * acted * (0.5 * acted + (engine.time - acted))
        assert body.position[0] == pytest.approx(way, rel=1e-11, abs=1e-12)
        assert len(body.forces) == (duration > engine.time)


@pytest.mark.thesis("force-ids/decide")
def test_2_5_1_an_unknown_id_takes_nothing_away_and_says_so() -> None:
    """Decided: 0, not an error: who lets a key go twice has nothing to repair."""
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    body.add_force((1, 0, 0), id="push")
    assert body.remove_force("pull") == 0 and body.remove_force(77) == 0
    assert len(body.forces) == 1 and body.remove_force("push") == 1 and body.remove_force("push") == 0


@pytest.mark.thesis("force-ids/decide")
def test_2_5_1_ids_are_counted_by_engine_and_go_on_wherever_the_engine_goes() -> None:
    engines = [xp.PhysicsEngine(), xp.PhysicsEngine()]
    bodies = [engine.add_object(xp.PhysicalObject(name="a")) for engine in engines]
    assert [body.add_force((1, 0, 0)).id for body in bodies] == [1, 1], "so that runs repeat"
    bodies[0].add_force((1, 0, 0), id=10)
    bodies[0].remove_force(10)
    for twin in (
        engines[0].copy(),
        xp.PhysicsEngine.restore(engines[0].checkpoint()),
        loads(dumps(engines[0])),
        engines[0],
    ):
        assert twin.new_force_id() == 11


@pytest.mark.thesis("force-ids")
def test_2_5_1_one_id_may_name_forces_on_several_objects() -> None:
    engine = xp.PhysicsEngine()
    first, second = engine.add_objects([xp.PhysicalObject(), xp.PhysicalObject()])
    ident = first.add_force((1, 0, 0)).id
    assert ident is not None
    second.add_force((1, 0, 0), id=ident)
    assert first.remove_force(ident) == 1 and len(second.forces) == 1, "a force is taken from the object that is asked"


@pytest.mark.thesis("many-forces")
def test_2_5_a_force_has_a_vector_a_duration_and_an_id_and_bad_ones_are_refused() -> None:
    for wrong in ((math.nan, 0, 0), (1, 2), "up"):
        with pytest.raises(InvalidValueError, match=r"Force\.vector"):
            xp.Force(wrong)  # type: ignore[arg-type]
    for duration in (-1, math.nan, "long"):
        with pytest.raises(InvalidValueError, match=r"Force\.duration"):
            xp.Force((1, 0, 0), duration)  # type: ignore[arg-type]
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    assert body.add_force((1, 0, 0), 0.0).duration == 0.0 and body.forces == (), "a force without duration does nothing"


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
    scale = (
        sum(abs(force) for force, _ in forces) * (1 + t) ** 2 + 1e-300
    )  # what is near the least float rounds as it can
    assert 2.0 * body.velocity[0] == pytest.approx(impulse, abs=1e-14 * scale)
    assert 2.0 * body.position[0] == pytest.approx(way, abs=1e-14 * scale)
    assert len(body.forces) == sum(duration > t for _, duration in forces)
