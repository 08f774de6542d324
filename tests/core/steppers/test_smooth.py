"""What holds for every stepper whose rows move on curves: what is written on the way counts from then on."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

import xpheve as xp

STEPPERS = ("core:adaptive", "core:implicit", "core:midpoint", "core:symplectic2", "core:symplectic8")
HOW = {name: {"rtol": 1e-12, "atol": 1e-12} for name in STEPPERS[:2]}
WRITTEN = ("mass", "charge", "the fixed one's charge", "velocity", "force")


class Tie(xp.PairLaw):
    """A force between charges that no closed form knows."""

    id = "smooth:tie"
    columns: ClassVar = {"charge": xp.Column(1.0, unit="N^0.5*m^0.5")}
    softening = xp.Constant(0.3, unit="m^2")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -a.charge * b.charge * d / (d.dot(d) + self.softening)


class Two:
    """A body that is tied to another and to a fixed one."""

    def __init__(self, stepper: str, states: list[tuple[Any, ...]]) -> None:
        self.engine = xp.PhysicsEngine(stepper=stepper, compile="never")
        tie = self.engine.add_law(Tie)
        self.bodies = [
            xp.PhysicalObject(mass=mass, position=place, velocity=speed, charge=charge, fixed=k == 2)
            for k, (mass, place, speed, charge) in enumerate(states)
        ]
        for body in self.bodies:
            self.engine.add_object(body, laws=[tie])
        self.how = HOW.get(stepper, {"dt": 1.0 / 64})

    def write(self, what: str) -> None:
        body = self.bodies[0]
        if what == "mass":
            body.mass = 3.0
        elif what == "charge":
            body["charge"] = 2.0
        elif what == "velocity":
            body.velocity = (0.0, 0.5, 0.5)
        elif what == "force":
            body.add_force(xp.Force((0.1, 0.2, 0.0)))
        else:
            self.bodies[2]["charge"] = 3.0

    def states(self) -> list[tuple[Any, ...]]:
        return [(one.mass, tuple(one.position), tuple(one.velocity), one["charge"]) for one in self.bodies]

    def run(self, until: float) -> None:
        self.engine.run(until=until, **self.how)


@pytest.mark.parametrize("what", WRITTEN)
@pytest.mark.parametrize("stepper", STEPPERS)
def test_what_is_written_on_the_way_counts_from_then_on(stepper: str, what: str) -> None:
    """The same as in an engine that begins with what was written."""
    begin = [
        (1.0, (1.0, 0.0, 0.1), (0.0, 0.4, 0.0), 1.0),
        (2.0, (-1.0, 0.2, 0.0), (0.1, -0.4, 0.0), 0.7),
        (1.0, (0.0, -2.0, 0.0), (0.0, 0.0, 0.0), 0.5),
    ]
    run = Two(stepper, begin)
    run.run(1.0)
    untouched = Two(stepper, run.states())
    run.write(what)
    fresh = Two(stepper, run.states())
    if what == "force":
        fresh.write(what)
    run.run(2.0)
    for other in (fresh, untouched):
        other.run(1.0)
    gaps = [
        max(
            abs(x - y)
            for a, b in zip(run.states(), other.states(), strict=True)
            for x, y in zip(a[1] + a[2], b[1] + b[2], strict=True)
        )
        for other in (fresh, untouched)
    ]
    assert gaps[0] < 1e-11
    assert gaps[1] > 1e-3


class Well(xp.FieldLaw):
    """A potential well that is no parabola, and turns nothing."""

    id = "smooth:well"
    strength = xp.Constant(1.0, unit="N/m^3")

    def force(self, body: Any) -> Any:
        return -self.strength * body.position.dot(body.position) * body.position

    def potential(self, body: Any) -> Any:
        square = body.position.dot(body.position)
        return 0.25 * self.strength * square * square


@pytest.mark.parametrize("stepper", ["core:adaptive", "core:midpoint", "core:symplectic4"])
def test_a_copy_goes_on_to_the_bit_after_a_torque_is_over(stepper: str) -> None:
    """Rotation that was made in steps stays so, for those who know of the torque as for those who never saw it."""
    engine = xp.PhysicsEngine(stepper=stepper, compile="never")
    body = xp.PhysicalObject(
        inertia=(1.0, 1.2, 0.4), position=(1.0, 0.2, 0.0), velocity=(0.0, 1.0, 0.1), angular_velocity=(0.5, 1.0, -2.0)
    )
    engine.add_object(body, laws=[engine.add_law(Well)])
    body.add_force(xp.Force((0.0, 0.0, 0.0), torque=(0.1, 0.2, 0.3), duration=0.3))
    how = HOW.get(stepper, {"dt": 1.0 / 64})
    engine.run(until=1.0, **how)
    copy = engine.copy()
    (twin,) = copy.objects
    spin, kinetic = engine.angular_momentum(), engine.energy().kinetic
    for one in (engine, copy):
        one.run(until=2.0, **how)
    for name in ("position", "velocity", "orientation", "angular_velocity"):
        assert tuple(getattr(body, name)) == tuple(getattr(twin, name))
    assert sum(c * c for c in body.orientation) == pytest.approx(1.0, abs=1e-14)
    assert engine.energy().kinetic != kinetic and engine.angular_momentum() == pytest.approx(spin, abs=1e-2)


def test_a_torque_is_left_to_those_who_carry_rotation() -> None:
    engine = xp.PhysicsEngine(stepper="core:implicit", compile="never")
    body = xp.PhysicalObject(inertia=(1.0, 1.0, 1.0), position=(1.0, 0.0, 0.0))
    engine.add_object(body, laws=[engine.add_law(Well)])
    engine.run(until=1.0)
    (group,) = engine.explain().data["groups"]
    assert group["stepper"] == "core:implicit"
    body.add_force(xp.Force((0.0, 0.0, 0.0), torque=(0.5, 0.0, 0.0)))
    engine.run(until=2.0)
    (group,) = engine.explain().data["groups"]
    assert group["stepper"] == "core:adaptive" and "carries no rotation" in str(group)
    assert tuple(body.angular_velocity) == pytest.approx((0.5, 0.0, 0.0), abs=1e-12)
