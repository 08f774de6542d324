"""Fixed steps that do not resolve a scene are warned of, with the step that would do."""

from __future__ import annotations

import re
import warnings
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import ResolutionWarning


def bob(stiffness: float, **how: Any) -> xp.PhysicsEngine:
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    spring = engine.add_law("basic:spring_to_point", stiffness=stiffness)
    engine.add_object(xp.PhysicalObject(position=(1.0, 0, 0), name="bob", **how), laws=[spring])
    return engine


def pythagorean() -> xp.PhysicsEngine:
    """Three bodies of 3, 4 and 5 kg at rest in the corners of a triangle (Burrau 1913): they come very close to one another."""
    engine = xp.PhysicsEngine()
    pull = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    for mass, place in ((3.0, (1, 3, 0)), (4.0, (-2, -1, 0)), (5.0, (1, -1, 0))):
        engine.add_object(xp.PhysicalObject(mass=mass, position=place), laws=[pull])
    return engine


def test_a_stiff_spring_is_warned_of_before_anything_moves_and_the_step_that_it_names_does() -> None:
    with pytest.warns(ResolutionWarning, match=r"does not resolve the forces of basic:spring_to_point on bob") as told:
        bob(1e8).run(until=1 / 60, dt=1 / 60)
    assert "rate of 1e+04 /s" in str(told[0].message) and "unstable beyond dt = 0.0002 s" in str(told[0].message)
    better = float(re.search(r"Take dt = (\S+) s", str(told[0].message)).group(1))  # type: ignore[union-attr]
    engine = bob(1e8)
    before = engine.energy().total
    engine.run(until=0.01, dt=better)
    assert abs(engine.energy().total / before - 1.0) < 1e-3


def test_a_rate_is_found_for_forces_of_velocity_too() -> None:
    engine = xp.PhysicsEngine(stepper="core:midpoint")
    drag = engine.add_law("basic:linear_drag", coefficient=1e6)
    engine.add_object(xp.PhysicalObject(velocity=(1.0, 0, 0)), laws=[drag])
    with pytest.warns(ResolutionWarning, match=r"rate of 1e\+06 /s"):
        engine.run(until=1e-4, dt=1e-4)


def test_a_scene_is_warned_of_once() -> None:
    engine = bob(1e8)
    with pytest.warns(ResolutionWarning):
        engine.run(until=1 / 60, dt=1 / 60)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        engine.run(until=2 / 60, dt=1 / 60)


def test_steps_that_are_short_enough_say_nothing_and_count_no_evaluation() -> None:
    engine = bob(100.0)
    engine.run(until=0.1, dt=0.1)  # a step of one radian: coarse, and stable
    assert engine.laws[0].evaluations == 1


def test_close_encounters_that_steps_jump_over_show_in_the_energy_after_the_run() -> None:
    with pytest.warns(
        ResolutionWarning, match=r"energy changed by 172 J up to t = 70.0 s .* Take dt = 0.001 s or less"
    ):
        pythagorean().run(until=70.0, dt=0.01)


def test_looking_at_steps_changes_no_bit_of_the_motion() -> None:
    engines = [bob(50.0, velocity=(0, 1.0, 0)) for _ in range(2)]
    engines[0].run(until=200 / 128, dt=1 / 128)
    for _ in range(200):  # runs too short to be looked at
        engines[1].step(1 / 128)
    assert engines[0].objects[0].position == engines[1].objects[0].position


def test_a_force_that_fails_is_reported_by_the_step_and_not_by_the_look() -> None:
    engine = xp.PhysicsEngine()
    pull = engine.add_law("basic:universal_gravity")
    for name in "ab":
        engine.add_object(xp.PhysicalObject(name=name), laws=[pull])
    with pytest.raises(xp.errors.LawFailedError, match="Two bodies in one place"):
        engine.run(until=1.0, dt=0.01)


@pytest.mark.parametrize("stepper", ["core:adaptive", "core:implicit"])
def test_steps_that_follow_tolerances_are_not_warned_of(stepper: str, recwarn: pytest.WarningsRecorder) -> None:
    class Hard(xp.FieldLaw):
        """A well that is far too steep for the host steps."""

        strength = xp.Param(1e6, unit="N/m^3")

        def force(self, body: Any) -> Any:
            return -self.strength * body.position.dot(body.position) * body.position

    engine = xp.PhysicsEngine(stepper=stepper, compile="never")
    engine.add_object(
        xp.PhysicalObject(position=(1.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0)), laws=[engine.add_law(Hard)]
    )
    engine.run(until=0.02, dt=0.01)
    assert not recwarn.list
