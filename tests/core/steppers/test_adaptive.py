"""The adaptive stepper in an engine: against closed forms, between events, at any look, in any tier."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import LawFailedError, NoStepperError
from xpheve.loop.drivers import radau15
from xpheve.steppers.adaptive import Adaptive

TIGHT = {"rtol": 1e-13, "atol": 1e-13}


class Wave(xp.FieldLaw):
    """A push that swings with time."""

    id = "adaptive:wave"
    rate = xp.Param(3.0, unit="1/s")
    push = xp.Param((1.0, 0.0, 0.0), unit="N")

    def force(self, body: Any) -> Any:
        """Push [N]."""
        return np.sin(self.rate * body.time) * self.push


class Quartic(xp.FieldLaw):
    """A potential well that is no parabola."""

    id = "adaptive:quartic"
    strength = xp.Param(1.0, unit="N/m^3")

    def force(self, body: Any) -> Any:
        """Towards the origin [N]."""
        return -self.strength * body.position.dot(body.position) * body.position

    def potential(self, body: Any) -> Any:
        """Energy [J]."""
        square = body.position.dot(body.position)
        return 0.25 * self.strength * square * square


class Weight(xp.FieldLaw):
    """A top whose lowest point is held, as a torque: the weight, at the body's ``arm`` from there."""

    id = "adaptive:weight"
    arm = xp.Param((0.0, 0.0, 0.5), unit="m")
    weight = xp.Param((0.0, 0.0, -4.0), unit="N")

    def torque(self, body: Any) -> Any:
        """Of the weight about the point that is held [N m]."""
        return body.to_world(self.arm).cross(self.weight)


class Tide(xp.FieldLaw):
    """A point mass at the origin pulls a satellite, and turns it by the gradient of its pull (MacCullagh)."""

    id = "adaptive:tide"
    strength = xp.Param(1.0, unit="m^3/s^2")

    def force(self, body: Any) -> Any:
        """Pull on the centre [N]."""
        square = body.position.dot(body.position)
        return -self.strength * body.mass / (square * np.sqrt(square)) * body.position

    def torque(self, body: Any) -> Any:
        """3 mu / r^5 times r cross I r [N m]."""
        square = body.position.dot(body.position)
        own = body.to_body(body.position)
        return 3.0 * self.strength / (square * square * np.sqrt(square)) * body.to_world(own.cross(body.inertia * own))


def scene(stepper: str = "core:adaptive", **options: Any) -> xp.PhysicsEngine:
    return xp.PhysicsEngine(stepper=stepper, **options)


def bodies(engine: xp.PhysicsEngine, count: int = 3, together: bool = True) -> list[xp.PhysicalObject]:
    """Bodies under gravity of one another, on wide orbits."""
    found = []
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    for k in range(count):
        angle = 2.0 * math.pi * k / count
        place = (math.cos(angle), math.sin(angle), 0.1 * k)
        speed = (-0.7 * math.sin(angle), 0.6 * math.cos(angle), 0.01)
        body = xp.PhysicalObject(mass=1.0 + 0.1 * k, position=place, velocity=speed, name=f"body {k}")
        found.append(engine.add_object(body, laws=[law]))
    return [body for body in engine.objects]


def state_of(engine: xp.PhysicsEngine) -> list[Any]:
    return [(tuple(body.position), tuple(body.velocity)) for body in engine.objects]


def served_by(engine: xp.PhysicsEngine) -> str:
    return str(engine.explain())


def test_forces_that_balance_to_rounding_make_no_step_shorter() -> None:
    """The body in the middle is drawn to both sides alike; a fall at its final speed is steady: what is left of their forces is rounding."""
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:universal_gravity", gravitational_constant=1.0, softening=0.1)
    bodies = [xp.PhysicalObject(mass=1.0, position=(k, 0.0, 0.1 * k)) for k in range(3)]
    engine.add_objects(bodies, laws=[gravity])
    engine.run(until=0.3)
    assert steps_of(engine) < 40
    assert bodies[1].position == pytest.approx((1.0, 0.0, 0.1), abs=1e-12)
    assert bodies[0].position[0] + bodies[2].position[0] == pytest.approx(2.0, abs=1e-12)

    engine = xp.PhysicsEngine(up="z")
    laws = [
        engine.add_law("basic:planet_gravity", acceleration=10.0),
        engine.add_law("basic:quadratic_drag", density=1.0),
    ]
    stone = engine.add_object(xp.PhysicalObject(mass=1.0, drag_area=0.2), laws=laws)
    engine.run(until=1000.0)
    assert stone.velocity[2] == pytest.approx(-math.sqrt(2.0 * 10.0 / (0.47 * 0.2)), rel=1e-6)
    assert steps_of(engine) < 2000


def steps_of(engine: xp.PhysicsEngine) -> int:
    """How many steps its groups have made."""
    return sum(group["steps"] for group in engine.explain().data["groups"])


def test_it_serves_what_has_no_closed_form_to_tolerances_and_leaves_host_steps_to_others() -> None:
    engine = xp.PhysicsEngine()
    bodies(engine)
    engine.run(until=0.1)
    assert "core:adaptive: 3 objects" in served_by(engine)
    engine = xp.PhysicsEngine()
    bodies(engine)
    engine.run(until=0.1, dt=0.01)
    assert "core:midpoint" in served_by(engine)
    assert "host steps were asked for" in served_by(engine)
    engine = scene()
    bodies(engine)
    engine.run(until=0.1, dt=0.01)
    assert "core:adaptive: 3 objects" in served_by(engine)


def test_tiers_looks_and_pieces_do_not_change_a_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(tmp_path / "cache"))
    ends = []
    for tier in ("never", "always"):
        engine = scene(compile=tier)
        bodies(engine)
        engine.run(until=2.0, **TIGHT)
        ends.append(state_of(engine))
    engine = scene(compile="never")
    bodies(engine)
    for k in range(1, 41):
        engine.run(until=0.05 * k, **TIGHT)
        engine.energy()
        assert [body.velocity for body in engine.objects]
    ends.append(state_of(engine))
    engine = scene(compile="never")
    bodies(engine)
    engine.run(until=0.77, **TIGHT)
    engine.checkpoint(tmp_path / "point")
    again = xp.PhysicsEngine.restore(tmp_path / "point")
    assert state_of(again) == state_of(engine)
    again.run(until=2.0, **TIGHT)
    ends.append(state_of(again))
    assert ends[0] == ends[1] == ends[2] == ends[3]


def test_a_push_that_swings_with_time() -> None:
    """v' = sin(w t): x = x0 + (v0 + 1/w) t - sin(w t)/w^2."""
    engine = scene()
    body = xp.PhysicalObject(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.2, 0.0, 0.0))
    engine.add_object(body, laws=[engine.add_law(Wave)])
    engine.run(until=7.0, **TIGHT)
    assert body.position[0] == pytest.approx(1.0 + (0.2 + 1 / 3) * 7.0 - math.sin(21.0) / 9.0, rel=1e-14)
    assert body.velocity[0] == pytest.approx(0.2 + (1 - math.cos(21.0)) / 3.0, rel=1e-14)


def test_a_charge_in_a_field_that_bends_it_and_drag_that_slows_it() -> None:
    """Forces of velocity: a magnetic field turns, linear drag slows; both in closed form."""
    engine = scene()
    field = engine.add_law("basic:magnetic_field", field=(0.0, 0.0, 2.0))
    drag = engine.add_law("basic:linear_drag", coefficient=0.3)
    body = xp.PhysicalObject(mass=1.0, charge=1.5, velocity=(1.0, 0.0, 0.5))
    engine.add_object(body, laws=[field, drag])
    engine.run(until=4.0, **TIGHT)
    shrunk, angle = math.exp(-0.3 * 4.0), -1.5 * 2.0 * 4.0
    expected = (shrunk * math.cos(angle), shrunk * math.sin(angle), 0.5 * shrunk)
    assert body.velocity == pytest.approx(expected, abs=1e-14)


def test_the_books_balance_at_any_look() -> None:
    """Quadratic drag has no potential: its work, by the steps' own nodes, is what kinetic and potential energy lose."""
    engine = scene()
    laws = [engine.add_law(Quartic), engine.add_law("basic:quadratic_drag")]
    body = xp.PhysicalObject(mass=1.0, drag_area=0.2, position=(1.0, 0.2, 0.0), velocity=(0.0, 2.0, 0.1))
    engine.add_object(body, laws=laws)
    start = engine.energy()
    total = start.kinetic + start.potential
    for t in (0.1, 0.35, 0.5, 1.7, 3.0):
        engine.run(until=t, **TIGHT)
        now = engine.energy()
        assert now.work < 0.0
        assert now.kinetic + now.potential - now.work == pytest.approx(total, rel=4e-15)
        if t == 0.5:  # a push in the midst of a step: what was done before it stays booked
            body.velocity = (1.0, 0.0, 0.0)
            after = engine.energy()
            assert after.work == pytest.approx(now.work, rel=1e-14)
            total = after.kinetic + after.potential - after.work


@pytest.mark.parametrize("what", ["push", "velocity", "law", "newcomer", "removal"])
def test_the_books_balance_whatever_happens_to_one_of_two(what: str) -> None:
    """Two bodies under drag share a step; in its midst something happens to one. What changes at that instant is no work of the drag."""
    engine = scene(compile="never")
    laws = [engine.add_law(Quartic), engine.add_law("basic:quadratic_drag")]

    def dropped(x: float) -> xp.PhysicalObject:
        body = xp.PhysicalObject(mass=1.0, drag_area=0.2, position=(x, 0.2, 0.0), velocity=(0.0, 2.0, 0.1))
        engine.add_object(body, laws=laws)
        return body

    def balance() -> float:
        energy = engine.energy()
        return energy.kinetic + energy.potential - energy.work

    one, _ = dropped(1.0), dropped(1.2)
    start = balance()
    engine.run(until=0.5, **TIGHT)
    assert balance() == pytest.approx(start, rel=4e-15)
    if what == "push":
        one.add_force(xp.Force((1.0, 0.0, 0.0), duration=0.4))
        assert balance() == pytest.approx(start, rel=4e-15)
    elif what == "velocity":
        one.velocity = (1.0, 0.0, 0.0)
    elif what == "law":
        engine.map(one, engine.add_law("basic:planet_gravity"))
    elif what == "newcomer":
        dropped(0.7)
    else:
        engine.remove_object(one)
    start = balance()
    engine.run(until=1.7, **TIGHT)
    assert balance() == pytest.approx(start, rel=8e-15)


def test_an_event_in_the_midst_of_a_step_begins_a_new_one_there() -> None:
    """A body whose velocity is written at t = 0.5 goes on as one that starts there."""
    engine = scene()
    quartic = engine.add_law(Quartic)
    body = xp.PhysicalObject(mass=1.0, position=(1.0, 0.2, 0.0), velocity=(0.0, 2.0, 0.1))
    engine.add_object(body, laws=[quartic])
    engine.run(until=0.5, **TIGHT)
    place = body.position
    body.velocity = (1.0, -0.5, 0.25)
    assert body.position == place
    engine.run(until=2.0, **TIGHT)
    other = scene()
    law = other.add_law(Quartic)
    fresh = xp.PhysicalObject(mass=1.0, position=place, velocity=(1.0, -0.5, 0.25))
    other.add_object(fresh, laws=[law])
    other.run(until=1.5, **TIGHT)
    assert body.position == pytest.approx(fresh.position, abs=1e-14)
    assert body.velocity == pytest.approx(fresh.velocity, abs=1e-14)


def test_an_event_restarts_its_own_group_only() -> None:
    """Two bodies in wells of their own: a push on one changes no bit of the other."""
    ends = []
    for pushed in (False, True):
        engine = scene()
        law = engine.add_law(Quartic)
        first = xp.PhysicalObject(mass=1.0, position=(1.0, 0.2, 0.0), velocity=(0.0, 2.0, 0.1))
        second = xp.PhysicalObject(mass=1.0, position=(0.5, -0.2, 0.3), velocity=(0.5, 0.3, 0.1))
        for body in (first, second):
            engine.add_object(body, laws=[law])
        engine.run(until=0.51, **TIGHT)
        if pushed:
            second.velocity = (5.0, 0.0, 0.0)
        engine.run(until=0.6, **TIGHT)
        ends.append((tuple(first.position), tuple(first.velocity)))
    assert ends[0] == ends[1]


def test_errors_follow_the_tolerances() -> None:
    """Kepler's orbit of eccentricity 0.6 over ten turns: looser is never much better, and the error is below a thousand tolerances."""
    errors = []
    for rtol in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13):
        engine = scene(compile="never")
        law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
        sun = xp.PhysicalObject(mass=1.0, fixed=True)
        body = xp.PhysicalObject(mass=1e-3, position=(0.4, 0.0, 0.0), velocity=(0.0, 2.0, 0.0))
        for one in (sun, body):
            engine.add_object(one, laws=[law])
        engine.run(until=10 * math.tau, rtol=rtol, atol=rtol)
        errors.append(math.dist(body.position, (0.4, 0.0, 0.0)))
        assert errors[-1] < 1000 * rtol
    for looser, tighter in itertools.pairwise(errors):
        assert tighter < 2.0 * looser + 2e-13  # where rounding is met
    assert errors[-1] < 5e-13


def test_a_heavy_top_keeps_its_energy_and_momenta() -> None:
    """A symmetric top about a fixed point: the energy, the momentum about the vertical, and that about its own axis stay."""
    engine = scene(up="z", compile="never")
    law = engine.add_law(Weight)
    inertia, spin = np.array([1.0, 1.0, 0.4]), np.array([0.3, 0.0, 12.0])
    half = 0.3
    body = xp.PhysicalObject(mass=1.0, inertia=tuple(inertia), orientation=(math.cos(half), math.sin(half), 0.0, 0.0))
    engine.add_object(body, laws=[law])

    body.angular_velocity = tuple(turn_of(body) @ spin)

    def kept() -> Any:
        turn = turn_of(body)
        own = turn.T @ np.array(body.angular_velocity)
        momentum = turn @ (inertia * own)
        return np.array([0.5 * (inertia * own * own).sum() + 2.0 * turn[2, 2], momentum[2], own[2]])

    start = kept()
    engine.run(until=5.0, **TIGHT)
    assert kept() == pytest.approx(start, rel=1e-12)
    assert sum(c * c for c in body.orientation) == pytest.approx(1.0, abs=1e-15)
    assert abs(body.angular_velocity[0]) > 1e-3


def test_rotation_under_torques_has_the_order_of_translation(monkeypatch: pytest.MonkeyPatch) -> None:
    """At steps of a given length the attitude of a satellite, and its spin, err as h^15, as places do (`test_radau15`)."""
    packed = Adaptive._pack

    def satellite(steps: int) -> Any:
        def fixed(self: Adaptive, *given: Any) -> Any:
            s, d = packed(self, *given)
            s[radau15.FIXED] = 6.0 / steps
            return s, d

        monkeypatch.setattr(Adaptive, "_pack", fixed)
        engine = scene(compile="never")
        body = xp.PhysicalObject(
            inertia=(1.0, 2.0, 2.5), position=(1.0, 0, 0), velocity=(0, 1.1, 0.1), angular_velocity=(0.9, 4.5, -1.2)
        )
        engine.add_object(body, laws=[engine.add_law(Tide)])
        engine.run(until=6.0, rtol=1e-15, atol=1e-15)
        return np.array([*body.orientation, *body.angular_velocity])

    exact, coarse, fine = satellite(80), satellite(16), satellite(24)
    for part in (slice(0, 4), slice(4, 7)):
        errors = [float(np.abs(one - exact)[part].max()) for one in (coarse, fine)]
        assert errors[0] < 1e-7
        assert math.log(errors[0] / errors[1]) / math.log(1.5) == pytest.approx(15.0, abs=1.0)


def turn_of(body: xp.PhysicalObject) -> Any:
    """The matrix that takes vectors from the body to the world."""
    w, x, y, z = body.orientation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_a_satellite_under_the_gradient_of_gravity_keeps_its_energy() -> None:
    """On a circle of radius 1 about a point mass: H = 1/2 w J w - n . J w + 3/2 r J r stays (Hughes, Spacecraft Attitude Dynamics, 9.1)."""
    engine = scene(up="z", compile="never")
    inertia = np.array([0.02, 0.05, 0.06])
    body = xp.PhysicalObject(
        mass=1.0, inertia=tuple(inertia), position=(1.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0),
        orientation=(math.cos(0.2), math.sin(0.2) * 0.6, math.sin(0.2) * 0.8, 0.0), angular_velocity=(0.2, 0.1, 0.9),
    )  # fmt: skip
    engine.add_object(body, laws=[engine.add_law(Tide)])

    def hamiltonian() -> float:
        turn = turn_of(body)
        spin = np.array(body.angular_velocity)
        tensor = turn @ np.diag(inertia) @ turn.T
        r = np.array(body.position)
        return float(0.5 * spin @ tensor @ spin - np.array([0.0, 0.0, 1.0]) @ tensor @ spin + 1.5 * r @ tensor @ r)

    start = hamiltonian()
    engine.run(until=15.0, **TIGHT)
    assert hamiltonian() == pytest.approx(start, rel=1e-12)
    assert math.hypot(*body.position) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize(("rtol", "steps"), [(1e-3, 100), (1e-6, 200), (1e-13, 1000)])
def test_a_place_where_forces_vanish_to_third_order_is_passed(rtol: float, steps: int) -> None:
    """x'' = -x^3 on a line: a period from rest at 1 is sqrt(8) times K(1/2), Jacobi's lemniscate."""
    engine = scene(compile="never")
    body = xp.PhysicalObject(position=(1.0, 0.0, 0.0))
    engine.add_object(body, laws=[engine.add_law(Quartic)])
    engine.run(until=7.416298709205487, rtol=rtol, atol=rtol)
    assert body.position == pytest.approx((1.0, 0.0, 0.0), abs=10 * rtol)
    (batch,) = [one for one in engine._world.batches if one.state.count]
    assert batch.state.numbers["steps"] < steps


def test_points_that_meet_are_named_with_a_way_out() -> None:
    engine = scene(compile="never")
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    for place in (-0.5, 0.5):
        engine.add_object(xp.PhysicalObject(mass=1.0, position=(place, 0.0, 0.0)), laws=[law])
    with pytest.raises((NoStepperError, LawFailedError), match=r"Soften the forces|softening|Look at"):
        engine.run(until=2.0, rtol=1e-9, atol=1e-9)
    assert engine.time == pytest.approx(math.pi / 4, abs=1e-5)


def test_a_body_at_rest_without_force_stays_where_it_is() -> None:
    engine = scene()
    body = xp.PhysicalObject(mass=1.0)
    engine.add_object(body, laws=[engine.add_law(Quartic)])
    engine.run(until=100.0, **TIGHT)
    assert body.position == (0.0, 0.0, 0.0)


def test_forces_that_rounding_alone_changes_do_not_shorten_steps() -> None:
    engine = scene()
    drag = engine.add_law("basic:linear_drag", coefficient=5.0)
    laws = [engine.add_law("basic:planet_gravity", acceleration=10.0), drag]
    ends = [xp.PhysicalObject(mass=0.1, position=(1.0 + 0.01 * k, 0.0, 0.0), velocity=(0.0, -0.2, 0.0)) for k in (0, 1)]
    engine.add_objects(ends, laws=laws)
    # Both fall at their final speed, so that all that is left of the forces is what a stiff spring makes of the last digits of places.
    engine.add_law("basic:spring", stiffness=1e8, rest_length=0.01, pairs=[tuple(ends)])
    engine.run(until=0.1)
    assert [body.velocity[1] for body in ends] == pytest.approx([-0.2, -0.2], abs=1e-9)
    assert [body.position[1] for body in ends] == pytest.approx([-0.02, -0.02], abs=1e-9)
    assert engine.explain().data["groups"][0]["steps"] < 50_000


class Floor(xp.FieldLaw):
    """A weight above a floor that gives way: the force bends where the floor is met."""

    weight = xp.Param(1.0, unit="N")
    stiffness = xp.Param(100.0, unit="N/m")

    def force(self, body: Any) -> Any:
        """Force [N]."""
        return (self.stiffness * np.maximum(-body.position.x, 0.0) - self.weight) * xp.vector(1.0, 0.0, 0.0)

    def potential(self, body: Any) -> Any:
        """Potential energy [J]."""
        depth = np.maximum(-body.position.x, 0.0)
        return self.weight * body.position.x + 0.5 * self.stiffness * depth * depth


@pytest.mark.parametrize(("stiffness", "rtol"), [(100.0, 1e-6), (100.0, 1e-13), (1e6, 1e-6), (1e6, 1e-13)])
def test_forces_with_a_bend_are_met_in_shorter_steps(stiffness: float, rtol: float) -> None:
    engine = xp.PhysicsEngine(stepper="core:adaptive")
    floor = engine.add_law(Floor, stiffness=stiffness)
    engine.add_object(xp.PhysicalObject(mass=1.0, position=(1.0, 0, 0)), laws=[floor])
    for second in range(
        1, 21
    ):  # seven bounces; without a look at the force at the end of a step the energy was off by 6.5 J
        engine.run(until=float(second), rtol=rtol, atol=rtol)
        assert abs(engine.energy().total - 1.0) < max(10 * rtol, 1e-10)
    assert engine.explain().data["groups"][0]["rejected"] > 0
