"""Which groups are proved to be two bodies under inverse-square forces, why others are not, and how strongly they attract."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import pytest

import xpheve as xp
from xpheve.plan.forms import is_two_bodies, why_not_two_bodies


class Pull(xp.FieldLaw):
    """The pull of a fixed centre."""

    id = "test:forms_pull"
    mu = xp.Param(1.0, unit="m^3/s^2", doc="G M.")
    place = xp.Param((0.0, 0.0, 0.0), unit="m", doc="Of the centre.")

    def force(self, body: Any) -> Any:
        d = body.position - self.place
        return -self.mu * body.mass * d / d.norm() ** 3

    def potential(self, body: Any) -> Any:
        return -self.mu * body.mass / (body.position - self.place).norm()


class Workless(Pull):
    """The same without a potential."""

    id = "test:forms_workless"
    potential = xp.FieldLaw.potential


def reason(engine: Any, *group: Any) -> str:
    """Why the group of ``group`` is not two bodies, planned as it is now."""
    engine.run(until=engine.time, dt=0.1)
    world = engine._world
    assert set(world.group_of(group[0])) == set(group)
    why = why_not_two_bodies(world, world.group_of(group[0]))
    assert is_two_bodies(world, world.group_of(group[0])) is (not why)
    return why


def scene(*bodies: dict[str, Any], law: str = "basic:universal_gravity", **parameters: Any) -> tuple[Any, ...]:
    """An engine, a law, and bodies one metre apart under it."""
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law(law, **parameters)]
    found = [xp.PhysicalObject(position=(float(k), 0, 0), **body) for k, body in enumerate(bodies)]
    engine.add_objects(found, laws=laws)
    return (engine, laws[0], *found)


def test_two_that_move_are() -> None:
    engine, _, a, b = scene({"mass": 2.0}, {})
    assert reason(engine, a, b) == ""


def test_one_that_moves_about_a_fixed_one_is() -> None:
    engine, _, _, b = scene({"mass": 2.0, "fixed": True}, {})
    assert reason(engine, b) == ""


def test_one_about_a_centre_is_and_two_are_two_groups() -> None:
    engine, _, a, b = scene({"velocity": (0, 1, 0), "mass": 2.0}, {}, law=Pull, place=(0.0, 5.0, 0.0))  # type: ignore[arg-type]
    assert reason(engine, a) == reason(engine, b) == ""


def test_two_laws_of_the_kind_between_the_same_two_are() -> None:
    engine, _, a, b = scene({"charge": 1.0}, {"charge": 1.0})
    engine.add_law("basic:coulomb", pairs=[(a, b)])
    assert reason(engine, a, b) == ""


def test_three_are_not() -> None:
    engine, _, a, b, c = scene({}, {}, {})
    assert reason(engine, a, b, c) == "more than two bodies move"


def test_two_and_a_fixed_one_are_not() -> None:
    engine, _, a, b, _ = scene({}, {}, {"fixed": True})
    assert reason(engine, a, b) == "more than one place attracts"


def test_one_and_two_fixed_ones_are_not() -> None:
    engine, _, a, _, _ = scene({}, {"fixed": True}, {"fixed": True})
    assert reason(engine, a) == "more than one place attracts"


def test_two_and_a_centre_are_not() -> None:
    engine = xp.PhysicsEngine()
    laws = [engine.add_law(Pull, place=(0, 9.0, 0)), engine.add_law("basic:universal_gravity")]
    pair = [engine.add_object(xp.PhysicalObject(position=(k, 0, 0)), laws=laws) for k in (1.0, 2.0)]
    assert reason(engine, *pair) == "more than one place attracts"


def test_one_alone_under_a_pair_law_is_not() -> None:
    engine, _, a = scene({})
    assert reason(engine, a) == "nothing attracts"


def test_softened_ones_are_not() -> None:
    engine, law, a, b = scene({}, {}, softening=0.1)
    assert reason(engine, a, b) == "basic:universal_gravity is softened"
    law.softening = 0.0
    assert reason(engine, a, b) == ""


def test_other_forces_beside_are_named() -> None:
    engine = xp.PhysicsEngine()
    laws = [engine.add_law("basic:universal_gravity"), engine.add_law("basic:linear_drag", coefficient=0.1)]
    pair = [engine.add_object(xp.PhysicalObject(position=(k, 0, 0)), laws=laws) for k in (1.0, 2.0)]
    assert reason(engine, *pair) == "basic:linear_drag is not proven to fall with the square of the distance"


class Slow(xp.FlowLaw):
    """Drag, exactly."""

    id = "test:forms_slow"

    def flow(self, body: Any, dt: float) -> Any:
        return {"velocity": body.velocity * math.exp(-dt)}


def test_a_flow_beside_is_no_such_force() -> None:
    engine = xp.PhysicsEngine()
    laws = [engine.add_law("basic:universal_gravity"), engine.add_law(Slow)]
    pair = [engine.add_object(xp.PhysicalObject(position=(k, 0, 0)), laws=laws) for k in (1.0, 2.0)]
    assert reason(engine, *pair) == "test:forms_slow is not proven to fall with the square of the distance"


def test_what_a_moving_source_of_a_one_sided_law_acts_on_is_not() -> None:
    engine = xp.PhysicsEngine()
    sun, dust = xp.PhysicalObject(mass=10.0, velocity=(1.0, 0, 0)), xp.PhysicalObject(position=(1.0, 0, 0))
    engine.add_objects([sun, dust])
    engine.add_law("basic:universal_gravity", between=([sun], [dust]), one_sided=True)
    assert reason(engine, dust) == "what attracts moves, and feels nothing of it"
    still = xp.PhysicsEngine()
    sun, dust = xp.PhysicalObject(mass=10.0, fixed=True), xp.PhysicalObject(position=(1.0, 0, 0), velocity=(0, 1.0, 0))
    still.add_objects([sun, dust])
    still.add_law("basic:universal_gravity", gravitational_constant=0.1, between=([sun], [dust]), one_sided=True)
    assert reason(still, dust) == ""
    still.run(until=2.0 * math.pi)
    assert math.dist(dust.position, (1.0, 0.0, 0.0)) < 1e-15


def test_two_that_pull_dust_and_feel_nothing_of_it_are_two_bodies_still() -> None:
    engine = xp.PhysicsEngine()
    suns = [xp.PhysicalObject(mass=2.0), xp.PhysicalObject(mass=1.0, position=(1.0, 0, 0), velocity=(0, 1.7, 0))]
    dust = [xp.PhysicalObject(position=(0, 5.0 + k, 0), velocity=(0.7, 0, 0)) for k in range(3)]
    engine.add_objects([*suns, *dust])
    engine.add_law("basic:universal_gravity", gravitational_constant=1.0, pairs=[tuple(suns)])
    engine.add_law("basic:universal_gravity", gravitational_constant=1.0, between=(suns, dust), one_sided=True)
    assert reason(engine, *suns) == ""
    alone = xp.PhysicsEngine()
    twins = [xp.PhysicalObject(mass=2.0), xp.PhysicalObject(mass=1.0, position=(1.0, 0, 0), velocity=(0, 1.7, 0))]
    law = alone.add_law("basic:universal_gravity", gravitational_constant=1.0)
    alone.add_objects(twins, laws=[law])
    for one in (engine, alone):
        one.run(until=5.0, dt=0.1)
    assert [one.position for one in suns] == [one.position for one in twins]


def test_dust_of_a_fixed_sun_and_a_moving_one_is_not() -> None:
    engine = xp.PhysicsEngine()
    still, passing = (
        xp.PhysicalObject(mass=10.0, fixed=True),
        xp.PhysicalObject(velocity=(1.0, 0, 0), position=(9.0, 0, 0)),
    )
    dust = xp.PhysicalObject(position=(1.0, 0, 0))
    engine.add_objects([still, passing, dust])
    engine.add_law("basic:universal_gravity", pairs=[(still, dust)])
    engine.add_law("basic:universal_gravity", between=([passing], [dust]), one_sided=True)
    assert reason(engine, dust) == "more than one place attracts"


def test_a_law_without_a_potential_is_left_to_others() -> None:
    engine, _, a, b = scene({"velocity": (0, 1, 0), "mass": 2.0}, {}, law=Workless, place=(0.0, 5.0, 0.0))  # type: ignore[arg-type]
    assert "no potential" in reason(engine, a) and "no potential" in reason(engine, b)


def test_driven_ones_are_not() -> None:
    engine, _, a, b = scene({}, {})
    b.hold()
    assert reason(engine, a) == "the host moves a body"


def test_stored_forces_must_accelerate_both_alike() -> None:
    engine, _, a, b = scene({"mass": 3.0}, {"mass": 0.7})
    for obj in (a, b):
        obj.add_force((0.1 * obj.mass, 0.0, -9.81 * obj.mass))
    assert reason(engine, a, b) == ""
    b.add_force((1e-9, 0.0, 0.0))
    assert reason(engine, a, b) == "stored forces accelerate the bodies differently"


def test_a_force_on_one_about_a_fixed_one_is_too_much() -> None:
    engine, _, _, b = scene({"fixed": True}, {})
    b.add_force((0.0, 0.0, 1.0))
    assert reason(engine, b) == "stored forces accelerate the bodies differently"


def attractions(engine: Any, *objects: Any) -> Any:
    """What attracts ``objects``, which are in one batch."""
    engine.run(until=engine.time)
    world = engine._world
    (batch,) = [one for one in world.batches if one.state.count]
    found = world.sources(batch).attractions([obj._row for obj in objects])
    return [found.get(obj._row) for obj in objects]


def rate(one: Any) -> Fraction:
    return Fraction(one.mu[0]) + Fraction(one.mu[1])


def test_how_strongly_two_attract_is_right_to_thirty_digits() -> None:
    engine, law, a, b = scene({"mass": 2e30}, {"mass": 6e24 / 7.0})
    first, second = attractions(engine, a, b)
    right = Fraction(law.gravitational_constant) * (Fraction(a.mass) + Fraction(b.mass))
    assert abs(rate(first) / right - 1) < Fraction(1, 10**30) and first.mu == second.mu
    assert (first.row, second.row) == (b._row, a._row) and first.laws == "basic:universal_gravity"


def test_a_fixed_one_has_no_share() -> None:
    engine, law, a, b = scene({"mass": 3.0, "fixed": True}, {"mass": 5.0})
    (one,) = attractions(engine, b)
    assert rate(one) == pytest.approx(Fraction(law.gravitational_constant) * 3)
    assert (one.row, one.place) == (-1, a.position)


def test_strengths_of_two_laws_are_added() -> None:
    engine, gravity, a, b = scene({"mass": 2.0, "charge": 0.3}, {"mass": 0.1, "charge": -0.7})
    coulomb = engine.add_law("basic:coulomb", pairs=[(a, b)], relative_permittivity=3.0)
    first, _ = attractions(engine, a, b)
    k = Fraction(coulomb.coulomb_constant / 3.0)
    right = Fraction(gravity.gravitational_constant) * (Fraction(2.0) + Fraction(0.1))
    right += k * Fraction(0.3) * Fraction(0.7) * (1 / Fraction(2.0) + 1 / Fraction(0.1))
    assert abs(rate(first) / right - 1) < Fraction(1, 10**30)


def test_of_a_centre_the_place_is_known() -> None:
    engine, law, a = scene({"mass": 3.0}, law=Pull, place=(1.0, 2.0, 3.0), mu=0.1)  # type: ignore[arg-type]
    (one,) = attractions(engine, a)
    assert one == (-1, (1.0, 2.0, 3.0), (0.1, 0.0), "test:forms_pull", law)


def test_what_is_of_another_form_by_now_is_left_out() -> None:
    engine, law, a, b = scene({}, {})
    assert None not in attractions(engine, a, b)
    law.softening = 1.0
    assert attractions(engine, a, b) == [None, None]
    engine, _, a, b, c = scene({}, {}, {})
    assert attractions(engine, a, b, c) == [None, None, None]
