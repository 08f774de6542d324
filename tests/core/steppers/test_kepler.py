"""Two bodies in closed form, through the engine: bars, conservation, events on the way, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mpf
from tests.core.kernels.test_kepler import EPSILON, apart, length, reference

import xpheve as xp
from xpheve.errors import LawFailedError, XpheveWarning
from xpheve.kernels.clock import later

Vec = tuple[float, float, float]
KEPLER = "core:kepler"


class Pull(xp.FieldLaw):
    """The pull of a fixed centre."""

    id = "test:kepler_pull"
    mu = xp.Param(1.0, unit="m^3/s^2", doc="G M.")
    place = xp.Param((0.0, 0.0, 0.0), unit="m", doc="Of the centre.")

    def force(self, body: Any) -> Any:
        d = body.position - self.place
        return -self.mu * body.mass * d / d.norm() ** 3

    def potential(self, body: Any) -> Any:
        return -self.mu * body.mass / (body.position - self.place).norm()


def pair(
    x: Vec,
    v: Vec,
    heavy: float = 0.999,
    light: float = 1e-3,
    at: Vec = (0.0, 0.0, 0.0),
    drift: Vec = (0.0, 0.0, 0.0),
    field: float | None = None,
    **how: Any,
) -> tuple[xp.PhysicsEngine, Any, Any, Any]:
    """A heavy body at ``at`` that drifts, and a light one ``x`` from it with the velocity ``v`` beside it, under G = 1, and in a ``field``."""
    engine = xp.PhysicsEngine(**how)
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    laws = [law] if field is None else [law, engine.add_law("basic:planet_gravity", acceleration=field)]
    one = engine.add_object(xp.PhysicalObject(mass=heavy, position=at, velocity=drift, name="heavy"), laws=laws)
    there, fast = (tuple(a + b for a, b in zip(*both, strict=True)) for both in ((x, at), (v, drift)))
    other = engine.add_object(xp.PhysicalObject(mass=light, position=there, velocity=fast, name="light"), laws=laws)
    return engine, law, one, other


def exact_states(one: Any, other: Any, s: float, g: float = 1.0) -> Any:
    """Places and velocities of both after ``s``, to 50 digits, from what they have now."""
    m, n = mpf(one.mass), mpf(other.mass)
    states = [[[mpf(c) for c in getattr(obj, name)] for name in ("position", "velocity")] for obj in (one, other)]
    d, w = ([b - a for a, b in zip(states[0][k], states[1][k], strict=True)] for k in (0, 1))
    d1, w1 = reference(d, w, g * (m + n), mpf(s))  # type: ignore[arg-type]
    centre, drift = (
        [(m * a + n * b) / (m + n) for a, b in zip(states[0][k], states[1][k], strict=True)] for k in (0, 1)
    )
    found = []
    for share in (-n / (m + n), m / (m + n)):
        found.append((
            [c + mpf(s) * u + share * a for c, u, a in zip(centre, drift, d1, strict=True)],
            [u + share * a for u, a in zip(drift, w1, strict=True)],
        ))  # fmt: skip
    return found


def stepper_of(engine: Any) -> list[str]:
    return [group["stepper"] for group in engine.explain().data["groups"]]


@pytest.mark.parametrize(("orbits", "bar"), [(1, 5e-12), (100, 5e-12), (1000, 1e-10), (10**6, 1e-8)])
def test_an_orbit_of_eccentricity_nine_tenths_meets_the_bar_by_far(orbits: int, bar: float) -> None:
    engine, _, sun, planet = pair((0.1, 0.0, 0.0), (0.0, math.sqrt(19.0), 0.0))
    until = 2.0 * math.pi * (orbits + 0.3)
    with mpmath.workdps(60):
        (a, _), (b, _) = exact_states(sun, planet, until)
        engine.run(until=until)
        right = [p - q for p, q in zip(b, a, strict=True)]
        found = [p - q for p, q in zip(planet.position, sun.position, strict=True)]
        assert apart(found, right) < min(bar, 4e-15 if orbits <= 1000 else bar)
        size = length([*a, *b])
        assert apart(sun.position, a) < 4 * EPSILON * size and apart(planet.position, b) < 4 * EPSILON * size
    assert stepper_of(engine) == [KEPLER]


@given(
    e=st.floats(0.0, 0.95),
    scale=st.floats(-9.0, 12.0),
    ratio=st.floats(-12.0, 12.0),
    span=st.floats(-12.0, 6.0),
    drift=st.floats(-1.0, 1.0),
)
@settings(max_examples=25)
def test_both_bodies_are_right_at_all_scales_and_mass_ratios(
    e: float, scale: float, ratio: float, span: float, drift: float
) -> None:
    size, heavy = 10.0**scale, 2.0
    light = heavy * 10.0**ratio
    speed = math.sqrt((heavy + light) / size * (1.0 - e))
    engine, _, one, other = pair(
        (0.6 * size, 0.0, 0.8 * size), (0.0, speed, 0.0), heavy, light, drift=(0.0, 0.0, drift * speed)
    )
    until = 10.0**span * size / speed
    with mpmath.workdps(50):
        right = exact_states(one, other, until)
        engine.run(until=until)
        for obj, (place, velocity) in zip((one, other), right, strict=True):
            assert apart(obj.position, place) <= 12 * EPSILON * (length(place) + size)
            assert apart(obj.velocity, velocity) <= 40 * EPSILON * (length(velocity) + speed / math.sqrt(1.0 - e) ** 3)


def test_energy_momentum_and_angular_momentum_stay() -> None:
    engine, _, _, _ = pair((0.6, 0.2, 0.0), (0.0, 1.2, 0.3), 3.0, 0.5, at=(1.0, -2.0, 0.5), drift=(0.1, 0.2, -0.1))
    before = engine.energy().total, engine.momentum(), engine.angular_momentum()
    for until in (1e-9, 0.7, 20.0, 1e4, 1e6):  # it goes away meanwhile, so that places are rounded ever more coarsely
        engine.run(until=until)
        assert engine.energy().total == pytest.approx(before[0], rel=1e-15 * (20.0 + until))
        assert engine.momentum() == pytest.approx(before[1], rel=1e-14)
        assert math.dist(engine.angular_momentum(), before[2]) < 1e-15 * (10.0 + until)  # about a centre that goes away
    assert stepper_of(engine) == [KEPLER]


def test_reading_on_the_way_changes_no_bit() -> None:
    one, other = (pair((0.3, 0.1, 0.0), (0.0, 1.5, 0.1)) for _ in range(2))
    one[0].run(until=50.0)
    other[0].run(until=50.0, every=0.37)
    for k in (2, 3):
        assert one[k].position == other[k].position and one[k].velocity == other[k].velocity


def test_host_steps_change_no_bit_either() -> None:
    one, other = (pair((0.3, 0.1, 0.0), (0.0, 1.5, 0.1)) for _ in range(2))
    one[0].run(until=50.0)
    other[0].run(until=50.0, dt=0.5)
    assert stepper_of(other[0]) == [KEPLER]
    assert one[3].position == other[3].position and one[2].velocity == other[2].velocity


def test_one_body_about_a_fixed_one() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    engine.add_object(xp.PhysicalObject(mass=4.0, position=(1.0, 2.0, 3.0), fixed=True), laws=[law])
    moon = engine.add_object(xp.PhysicalObject(mass=7.0, position=(2.0, 2.0, 3.0), velocity=(0, 2.5, 0)), laws=[law])
    engine.run(until=100.0)
    with mpmath.workdps(50):
        right, speed = reference((1.0, 0.0, 0.0), (0.0, 2.5, 0.0), 4.0, 100.0)
        assert apart(moon.position, [a + b for a, b in zip(right, (1, 2, 3), strict=True)]) < 1e-14
        assert apart(moon.velocity, speed) < 1e-14
    assert stepper_of(engine) == [KEPLER, "none"]


def test_a_fixed_one_that_is_put_elsewhere_draws_from_there() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:universal_gravity", gravitational_constant=1.0)
    sun = engine.add_object(xp.PhysicalObject(mass=1.0, fixed=True), laws=[law])
    moon = engine.add_object(xp.PhysicalObject(position=(1.0, 0, 0), velocity=(0, 1.0, 0)), laws=[law])
    engine.run(until=1.0)
    sun.position = (0.0, -1.0, 0.5)
    d, v = tuple(a - b for a, b in zip(moon.position, sun.position, strict=True)), moon.velocity
    engine.run(until=3.0)
    with mpmath.workdps(50):
        right, _ = reference(d, v, 1.0, 2.0)  # type: ignore[arg-type]
        assert apart(moon.position, [a + b for a, b in zip(right, sun.position, strict=True)]) < 1e-14


def test_many_bodies_about_a_centre_are_one_batch() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Pull, place=(0.0, 0.0, 1.0))
    bodies = [xp.PhysicalObject(position=(1.0 + 0.1 * k, 0, 0), velocity=(0, 1.0 - 0.01 * k, 0.1)) for k in range(40)]
    engine.add_objects(bodies, laws=[law])
    before = engine.energy().total
    engine.run(until=123.0)
    assert engine.energy().total == pytest.approx(before, rel=1e-13)
    (group,) = engine.explain().data["groups"]
    assert group["stepper"] == KEPLER and group["objects"] == 40
    with mpmath.workdps(50):
        for k in (0, 7, 39):
            right, _ = reference((1.0 + 0.1 * k, 0.0, -1.0), (0.0, 1.0 - 0.01 * k, 0.1), 1.0, 123.0)
            assert apart(bodies[k].position, [a + b for a, b in zip(right, (0, 0, 1), strict=True)]) < 1e-13


def test_many_pairs_are_one_batch_and_each_body_reads_alike_alone_and_with_all() -> None:
    engine = xp.PhysicsEngine()
    ones = [xp.PhysicalObject(mass=1.0 + k, position=(100.0 * k, 0, 0)) for k in range(20)]
    others = [xp.PhysicalObject(mass=2.0, position=(100.0 * k, 1.0, 0), velocity=(0.5, 0, 0.1 * k)) for k in range(20)]
    engine.add_objects([*ones, *others])
    pairs = list(zip(ones, others, strict=True))
    engine.add_law("basic:universal_gravity", gravitational_constant=1.0, pairs=pairs)
    with mpmath.workdps(50):
        right = [exact_states(*both, 31.4) for both in pairs]
        engine.run(until=31.4)
        assert stepper_of(engine) == [KEPLER]
        together = np.array(engine.bodies.position)
        for k, both in enumerate(pairs):
            for obj, (place, _), row in zip(both, right[k], (k, 20 + k), strict=True):
                assert apart(obj.position, place) < 1e-15 * (100.0 * k + 300.0)
                assert tuple(together[row]) == obj.position


def test_opposite_charges_circle_and_equal_ones_fly_apart() -> None:
    for sign in (-1.0, 1.0):
        engine = xp.PhysicsEngine()
        laws = [
            engine.add_law("basic:coulomb", coulomb_constant=10.0),
            engine.add_law("basic:universal_gravity", gravitational_constant=0.5),
        ]
        one = engine.add_object(xp.PhysicalObject(mass=2.0, charge=0.5, position=(0, 0, 0)), laws=laws)
        other = engine.add_object(
            xp.PhysicalObject(mass=3.0, charge=sign * 0.25, position=(1.0, 0, 0), velocity=(0, 1.0, 0)), laws=laws
        )
        before = engine.energy().total
        with mpmath.workdps(50):
            strength = (mpf(0.5) * 6 - mpf(10) * mpf(0.5) * mpf(0.25) * mpf(sign)) * (1 / mpf(2) + 1 / mpf(3))
            right, _ = reference((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), strength, 40.0)  # type: ignore[arg-type]
            engine.run(until=40.0)
            found = [b - a for a, b in zip(one.position, other.position, strict=True)]
            assert apart(found, right) < 1e-13
        assert engine.energy().total == pytest.approx(before, rel=1e-13) and stepper_of(engine) == [KEPLER]


def test_a_uniform_field_beside_makes_both_fall() -> None:
    engine, _, one, other = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, 0.3, field=9.81, up="z")
    with mpmath.workdps(50):
        right = exact_states(one, other, 30.0)
        engine.run(until=30.0)
        assert stepper_of(engine) == [KEPLER]
        for obj, (place, velocity) in zip((one, other), right, strict=True):
            place[2] -= mpf(9.81) * 30**2 / 2
            velocity[2] -= mpf(9.81) * 30
            assert apart(obj.position, place) < 1e-12 and apart(obj.velocity, velocity) < 1e-13


def test_spin_is_free_beside() -> None:
    engine, _, _, _ = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    lone = xp.PhysicsEngine()
    top = engine.object("light")
    top.inertia, top.angular_velocity = (1, 2, 3), (0.1, 2, 0.1)
    alone = lone.add_object(xp.PhysicalObject(inertia=(1, 2, 3), angular_velocity=(0.1, 2, 0.1)))
    engine.run(until=5.0)
    lone.run(until=5.0)
    assert top.orientation == alone.orientation and top.angular_velocity == alone.angular_velocity
    assert KEPLER in stepper_of(engine)


def test_a_kick_begins_a_new_orbit() -> None:
    engine, _, sun, planet = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    engine.run(until=2.5)
    planet.velocity = (0.3, -1.1, 0.2)
    with mpmath.workdps(50):
        right = exact_states(sun, planet, 7.5)
        engine.run(until=10.0)
        assert apart(sun.position, right[0][0]) < 1e-15 and apart(planet.position, right[1][0]) < 1e-14


def test_another_strength_and_another_mass_begin_new_orbits() -> None:
    engine, law, sun, planet = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    engine.run(until=2.5)
    law.gravitational_constant = 2.0
    with mpmath.workdps(50):
        right = exact_states(sun, planet, 2.5, 2.0)
        engine.run(until=5.0)
        assert apart(planet.position, right[1][0]) < 1e-14
        planet.mass = 0.5
        right = exact_states(sun, planet, 2.5, 2.0)
        engine.run(until=7.5)
        assert apart(planet.position, right[1][0]) < 1e-14 and apart(sun.position, right[0][0]) < 1e-14
    law.enabled = False
    engine.run(until=8.0)
    here, fast = planet.position, planet.velocity
    engine.run(until=10.0)
    assert planet.position == pytest.approx([x + 2.0 * v for x, v in zip(here, fast, strict=True)], rel=1e-14)


def test_softening_on_the_way_ends_the_closed_form() -> None:
    engine, law, _, _ = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    engine.run(until=1.0)
    assert stepper_of(engine) == [KEPLER]
    law.softening = 0.1
    before = engine.energy().total
    engine.run(until=2.0)
    assert KEPLER not in stepper_of(engine)
    assert engine.energy().total == pytest.approx(before, rel=1e-3)


def test_a_force_on_one_of_them_ends_the_closed_form_and_its_end_brings_it_back() -> None:
    engine, _, _, planet = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    engine.run(until=1.0)
    planet.add_force((1e-3, 0.0, 0.0), duration=0.5)
    engine.run(until=1.2)
    assert KEPLER not in stepper_of(engine)
    engine.run(until=2.0)
    assert engine.momentum()[0] == pytest.approx(0.5e-3, rel=1e-9)


def test_a_third_body_ends_the_closed_form() -> None:
    engine, law, _, _ = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    engine.run(until=1.0)
    engine.add_object(xp.PhysicalObject(mass=0.1, position=(5.0, 0, 0)), laws=[law])
    engine.run(until=1.1)
    assert KEPLER not in stepper_of(engine)


def test_a_straight_fall_is_served_up_to_the_centre_and_refused_there() -> None:
    engine, _, sun, planet = pair((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.75, 0.25)
    engine.run(until=3.14159)
    assert 0.0 < planet.position[0] - sun.position[0] < 1e-3
    with pytest.raises(
        LawFailedError, match=r"basic:universal_gravity: .*heavy.* and .*light.* meet at t = 3\.14159265"
    ) as caught:
        engine.run(until=4.0)
    assert "softening" in str(caught.value)
    assert engine.time == pytest.approx(math.pi, rel=1e-11)
    assert math.isfinite(planet.position[0])


def test_a_fall_into_a_fixed_centre_is_refused_by_name() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Pull)
    engine.add_object(xp.PhysicalObject(position=(0, 2.0, 0), name="rock"), laws=[law])
    with pytest.raises(LawFailedError, match=r"test:kepler_pull: .*rock.* falls into the centre of its force"):
        engine.run(until=10.0)


def test_two_bodies_in_one_place_are_refused() -> None:
    engine, _, _, _ = pair((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    with pytest.raises(LawFailedError, match="basic:universal_gravity"):
        engine.run(until=1.0)


def test_two_put_into_one_place_on_the_way_are_refused_when_time_passes() -> None:
    engine, _, sun, planet = pair((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    engine.run(until=1.0)
    planet.position = sun.position
    with pytest.raises(LawFailedError, match="in one place"):
        engine.run(until=2.0)
    assert engine.time == 1.0
    planet.position = (5.0, 0.0, 0.0)
    engine.run(until=2.0)
    assert stepper_of(engine) == [KEPLER] and math.dist(planet.position, sun.position) > 1.0


def test_a_law_that_fails_is_given_up_if_that_is_asked_for() -> None:
    engine, law, sun, planet = pair((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.75, 0.25, on_law_error="disable")
    with pytest.warns(XpheveWarning, match="meet at t = 3.14159"):
        engine.run(until=4.0)
    assert not law.enabled and engine.time == 4.0
    assert planet.position[0] < sun.position[0]  # through one another, with nothing to hold them


class Log(xp.PhysicalLaw):
    """Write down when it is told."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.times: list[float] = []

    def enforce_this_law(self, event: Any) -> None:
        self.times.append(event.time)


@pytest.mark.parametrize("count", [1, 20])
def test_a_handler_that_writes_one_of_two_reads_the_other_where_it_is(count: int) -> None:
    engine = xp.PhysicsEngine()
    ones = [xp.PhysicalObject(mass=1.0, position=(100.0 * k, 0, 0)) for k in range(count)]
    others = [xp.PhysicalObject(mass=2.0, position=(100.0 * k, 1.0, 0), velocity=(1.5, 0, 0.1)) for k in range(count)]
    engine.add_objects([*ones, *others])
    engine.add_law("basic:universal_gravity", gravitational_constant=1.0, pairs=list(zip(ones, others, strict=True)))
    seen: list[Any] = []

    class Kick(xp.PhysicalLaw):
        """Write one, and look at all before and after."""

        id = "test:kepler_kick"

        def enforce_this_law(self, event: Any) -> None:
            seen.append(np.array(engine.bodies.position))
            ones[0].velocity = (0.0, 0.0, 1.0)
            seen.append(np.array(engine.bodies.position))
            seen.append(np.array([obj.position for obj in (*ones, *others)]))

    engine.add_law(Kick, container=xp.LawContainer(xp.when.Elapsed(7.0)))
    engine.run(until=8.0)
    assert stepper_of(engine) == [KEPLER] and len(seen) == 3
    assert np.array_equal(seen[0], seen[1]) and np.array_equal(seen[0], seen[2])


def test_one_that_comes_later_is_read_where_it_stands() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Pull)
    engine.add_objects(
        [xp.PhysicalObject(position=(1.0 + k, 0, 0), velocity=(0, 0.7, 0)) for k in range(12)], laws=[law]
    )
    engine.run(until=3.0)
    before = np.array(engine.bodies.position)
    engine.add_object(xp.PhysicalObject(position=(0, 3.0, 0), velocity=(0.5, 0, 0)), laws=[law])
    engine.run(until=3.0)
    after = np.array(engine.bodies.position)
    assert np.array_equal(after[:12], before) and after[12].tolist() == [0.0, 3.0, 0.0]


def test_conditions_are_found_on_the_orbit_and_leave_it_as_it_is() -> None:
    found = []
    for listens in (True, False):
        engine = xp.PhysicsEngine()
        pull, log = engine.add_law(Pull), Log()
        engine.add_law(log, container=xp.LawContainer(xp.when.Crosses("body.position.y", direction=1)))
        laws = [pull, log] if listens else [pull]
        body = engine.add_object(xp.PhysicalObject(position=(0.1, 0, 0), velocity=(0, math.sqrt(19.0), 0)), laws=laws)
        engine.run(until=40.0)
        assert stepper_of(engine) == [KEPLER]
        found.append((body.position, log.times))
    (place, times), (unheard, _) = found
    assert place == unheard
    a = 1.0 / (2.0 / 0.1 - math.sqrt(19.0) ** 2)
    assert times == pytest.approx([k * 2.0 * math.pi * a**1.5 for k in range(1, 7)], rel=1e-13)


def test_a_checkpoint_goes_on_to_the_same_bits() -> None:
    engine, _, sun, planet = pair((0.3, 0.0, 0.0), (0.0, 1.5, 0.0))
    engine.run(until=7.0)
    other = xp.PhysicsEngine.restore(engine.checkpoint())
    for one in (engine, other):
        one.run(until=100.0)
    assert other.object("light").position == planet.position and other.object("heavy").velocity == sun.velocity
    assert stepper_of(other) == [KEPLER]


def test_one_that_leaves_changes_no_bit_of_the_others() -> None:
    found = []
    for leaves in (False, True):
        engine = xp.PhysicsEngine()
        law = engine.add_law(Pull)
        bodies = [xp.PhysicalObject(position=(1.0 + k, 0, 0), velocity=(0, 0.7, 0.1)) for k in range(12)]
        engine.add_objects(bodies, laws=[law])
        engine.run(until=3.0)
        if leaves:
            engine.remove_object(bodies[2])
            engine.add_object(xp.PhysicalObject(position=(0, 3.0, 0), velocity=(0.5, 0, 0)), laws=[law])
        engine.run(until=40.0)
        assert stepper_of(engine) == [KEPLER]
        found.append([obj.position for k, obj in enumerate(bodies) if k != 2])
    assert found[0] == found[1]


@pytest.mark.parametrize("fixed", [True, False])
def test_what_has_no_force_flies_straight(fixed: bool) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law("basic:coulomb")
    engine.add_object(xp.PhysicalObject(fixed=fixed, charge=0.0), laws=[law])
    other = engine.add_object(xp.PhysicalObject(velocity=(1.0, 2.0, 0), position=(0.0, 0, 0), charge=1.0), laws=[law])
    engine.run(until=10.0)
    assert other.position == (10.0, 20.0, 0.0) and KEPLER in stepper_of(engine)


def test_many_times_are_read_at_once_to_the_same_bits() -> None:
    engine, _, one, other = pair((0.1, 0.0, 0.02), (0.0, 4.2, 0.1), drift=(0.3, -0.1, 0.0), field=0.2)
    engine.run(until=0.3)
    world = engine._world
    times = [later((0.3, 0.0), s) for s in np.random.default_rng(1).uniform(0.0, 50.0, 100).tolist()]
    for body in (one, other):
        for name in ("position", "velocity", "orientation"):
            together = world.read_times(body._row, name, times)
            assert together.tolist() == np.array([world.read_row(body._row, name, t) for t in times]).T.tolist()
    other.velocity = (0.0, 4.0, 0.0)
    engine.run(until=0.4)
    again = world.read_times(other._row, "position", [(1.0, 0.0)])
    assert again[:, 0].tolist() == list(world.read_row(other._row, "position", (1.0, 0.0)))
