"""Scenes under linear forces: exact at any time, stiffness and dt, whatever happens in between."""

from __future__ import annotations

import itertools
import math
from typing import Any

import mpmath
import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import LawFailedError, StateError
from xpheve.kernels.clock import NEVER
from xpheve.laws import PairLaw, Param

ROUNDINGS = 1e-12


class Dashpot(PairLaw):
    """A damper that knows no direction."""

    damping = Param(0.7, unit="kg/s")

    def force(self, a: Any, b: Any) -> Any:
        return -self.damping * (a.velocity - b.velocity)


def steppers_of(engine: xp.PhysicsEngine) -> list[str]:
    return [group["stepper"] for group in engine.explain().data["groups"]]


def bob(laws: list[tuple[str, dict[str, Any]]], **state: Any) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    engine = xp.PhysicsEngine()
    found = [engine.add_law(ident, **numbers) for ident, numbers in laws]
    return engine, engine.add_object(xp.PhysicalObject(**state), laws=found)


def net(
    seed: int = 0, count: int = 5, damping: float = 3.0, fixed: bool = False
) -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """A net of springs, and dampers if there is ``damping``, in which each holds each."""
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine()
    laws: list[Any] = [engine.add_law("basic:spring", stiffness=1e4)]
    if damping:
        laws.append(engine.add_law(Dashpot(damping=damping)))
    objects = [
        engine.add_object(
            xp.PhysicalObject(
                mass=float(10.0 ** rng.uniform(-1.0, 1.0)),
                position=rng.normal(size=3),
                velocity=rng.normal(size=3) * (not (fixed and k == 0)),
                fixed=fixed and k == 0,
            ),
            laws=laws,
        )
        for k in range(count)
    ]
    return engine, objects


# The bars


@pytest.mark.parametrize("share", [0.0, 0.01, 1.0, 1.5])
@pytest.mark.parametrize("dt", [1.0 / 60.0, 1e-3, None])
def test_a_stiff_damped_spring_is_exact_at_any_dt(share: float, dt: float | None) -> None:
    laws: list[tuple[str, dict[str, Any]]] = [("basic:spring_to_point", {"stiffness": 1e8})]
    if share:
        laws.append(("basic:linear_drag", {"coefficient": 2e4 * share}))
    engine, body = bob(laws, position=(1.0, 0.0, 0.0), velocity=(0.0, 1e4, 0.0))
    end = 0.1
    engine.run(until=end, **({} if dt is None else {"dt": dt}))
    assert steppers_of(engine) == ["core:linear"]
    with mpmath.workdps(60):
        mean, rate = mpmath.mpf(-1e4 * share), mpmath.mpf(10) ** 4
        gap = mpmath.sqrt(mpmath.mpc(mean * mean - rate * rate))
        grown = mpmath.exp(mean * end)
        sine = grown * (mpmath.sinh(gap * end) / gap if gap != 0 else end)
        cosine = grown * mpmath.cosh(gap * end)
        place = (cosine - mean * sine).real
        push = sine.real
    assert body.position == pytest.approx((float(place), float(push * 10**4), 0.0), rel=0, abs=ROUNDINGS)


def test_the_bits_do_not_depend_on_dt_nor_on_who_looked() -> None:
    found = set()
    for dt, looks in ((None, 0), (0.01, 0), (1.0 / 60.0, 0), (None, 7)):
        engine, objects = net()
        how = {} if dt is None else {"dt": dt}
        for k in range(1, looks):
            engine.run(until=0.3 * k / looks, **how)
            assert all(math.isfinite(one) for obj in objects for one in obj.position)
        engine.run(until=0.3, **how)
        found.add(tuple(one for obj in objects for one in (*obj.position, *obj.velocity)))
    assert len(found) == 1


@pytest.mark.parametrize("end", [1.0 / 60.0, 1.0, 1000.0])
def test_a_hundred_stiff_springs_in_a_row_are_exact(end: float) -> None:
    """Equal masses and springs between walls: the modes are sines (Rayleigh, The Theory of Sound, section 120)."""
    count, stiffness, mass = 99, 1e8, 0.5
    rng = np.random.default_rng(0)
    engine = xp.PhysicsEngine()
    walls = [engine.add_object(xp.PhysicalObject(fixed=True)) for _ in range(2)]
    x, v = rng.normal(size=(count, 3)), 1e3 * rng.normal(size=(count, 3))
    row = [engine.add_object(xp.PhysicalObject(mass=mass, position=x[k], velocity=v[k])) for k in range(count)]
    line = [walls[0], *row, walls[1]]
    spring = engine.add_law("basic:spring", stiffness=stiffness, pairs=list(itertools.pairwise(line)))
    for obj in line:
        engine.map(obj, spring)
    engine.run(until=end)
    found = np.array([obj.position for obj in row])
    with mpmath.workdps(40):
        angle = [mpmath.pi * (j + 1) / (count + 1) for j in range(count)]
        shape = np.array([[mpmath.sin(a * (i + 1)) for a in angle] for i in range(count)], dtype=object)
        rates = [2 * mpmath.sqrt(mpmath.mpf(stiffness) / mpmath.mpf(mass)) * mpmath.sin(a / 2) for a in angle]
        cosines = np.array([mpmath.cos(w * mpmath.mpf(end)) for w in rates], dtype=object)
        sines = np.array([mpmath.sin(w * mpmath.mpf(end)) / w for w in rates], dtype=object)
        share = mpmath.mpf(2) / (count + 1)
        places = shape.T.dot(np.vectorize(mpmath.mpf, otypes=[object])(x)) * share
        speeds = shape.T.dot(np.vectorize(mpmath.mpf, otypes=[object])(v)) * share
        exact = shape.dot(cosines[:, None] * places + sines[:, None] * speeds).astype(float)
    assert np.abs(found - exact).max() < ROUNDINGS


@pytest.mark.parametrize("dt", [None, 0.37, 1.0 / 60.0])
def test_a_thousand_gyrations_keep_their_phase(dt: float | None) -> None:
    field = (0.3, -0.4, 1.2)
    engine, body = bob([("basic:magnetic_field", {"field": field})], mass=2.0, charge=3.0, velocity=(1.0, 2.0, -0.5))
    strength = math.hypot(*field)
    end = 1000.0 * 2.0 * math.pi * 2.0 / (3.0 * strength)
    engine.run(until=end, **({} if dt is None else {"dt": dt}))
    with mpmath.workdps(40):
        b = mpmath.matrix([mpmath.mpf(one) for one in field])
        size = mpmath.norm(b)
        n, v = b / size, mpmath.matrix([1, 2, mpmath.mpf(-0.5)])
        along = n * sum(n[k] * v[k] for k in range(3))
        across = v - along
        side = mpmath.matrix(
            [
                across[1] * n[2] - across[2] * n[1],
                across[2] * n[0] - across[0] * n[2],
                across[0] * n[1] - across[1] * n[0],
            ]
        )
        turned = mpmath.mpf(end) * 3 * size / 2
        exact = along + across * mpmath.cos(turned) + side * mpmath.sin(turned)
    assert body.velocity == pytest.approx([float(one) for one in exact], rel=0, abs=1e-12)


def test_a_free_body_flies_straight_as_seen_from_a_turntable_and_beside_it() -> None:
    w, end = 0.7, 5000.0
    engine, body = bob(
        [("basic:rotating_frame", {"angular_velocity": (0.0, 0.0, w)})],
        position=(1.0, 0.0, 0.0),
        velocity=(0.0, 1.0, 0.2),
    )
    engine.run(until=end)
    with mpmath.workdps(40):
        turned = mpmath.mpf(w) * mpmath.mpf(end)
        x, y = mpmath.mpf(1), mpmath.mpf(end) * (1 + mpmath.mpf(w))  # in the frame at rest
        exact = (
            x * mpmath.cos(turned) + y * mpmath.sin(turned),
            y * mpmath.cos(turned) - x * mpmath.sin(turned),
            mpmath.mpf(0.2) * mpmath.mpf(end),
        )
    assert steppers_of(engine) == ["core:linear"]
    assert body.position == pytest.approx([float(one) for one in exact], rel=1e-14, abs=ROUNDINGS)


# Reading


def test_one_row_reads_as_all_rows_do_to_the_bit() -> None:
    engine, objects = net()
    laws = [
        engine.add_law("basic:linear_drag", coefficient=0.3),
        engine.add_law("basic:magnetic_field", field=(0.1, 0.2, 1.0)),
    ]
    rng = np.random.default_rng(5)
    more = [
        xp.PhysicalObject(
            mass=1.0 + (k % 3), charge=float(k % 2), position=rng.normal(size=3), velocity=rng.normal(size=3)
        )
        for k in range(40)
    ]
    for k, obj in enumerate(more):
        engine.add_object(obj, laws=laws[: 1 + k % 2])
    engine.run(until=0.1)
    more[3].velocity = (1.0, 0.0, 0.0)
    objects[1].velocity = (0.0, 0.0, 1.0)
    engine.run(until=0.2)
    world = engine._world
    for t in ((0.2, 0.0), (0.25, 1e-18), (17.0, 0.0)):
        for name in ("position", "velocity", "orientation", "angular_velocity"):
            whole = world.read_all(name, t)
            for obj in (*objects, *more):
                assert tuple(whole[:, obj._row].tolist()) == world.read_row(obj._row, name, t)


def test_many_rows_of_other_numbers_have_the_bits_of_each_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for many in (10, 10**9):
        monkeypatch.setattr("xpheve.steppers.mode_table.MANY", many)
        engine = xp.PhysicsEngine()
        laws = [
            engine.add_law("basic:magnetic_field", field=(0.0, 0.0, 2.0)),
            engine.add_law("basic:spring_to_point", stiffness=5.0),
        ]
        for k in range(30):
            engine.add_object(xp.PhysicalObject(mass=1.0 + 0.1 * k, charge=1.0, position=(1.0, 2.0, 3.0)), laws=laws)
        engine.run(until=3.0)
        found.append(engine.bodies.position.copy())
    assert (found[0] == found[1]).all()


def test_nothing_is_evaluated_between_reads() -> None:
    engine, _ = bob([("basic:spring_to_point", {"stiffness": 100.0})], position=(1.0, 0.0, 0.0))
    engine.run(until=100.0, dt=0.01)
    assert [law.evaluations for law in engine.laws] == [1]
    world = engine._world
    assert all(batch.stepper.covered(batch.state) == NEVER for batch in world.batches if batch.state.count)


def test_a_body_spins_freely_beside_its_swing() -> None:
    engine, _ = bob(
        [("basic:spring_to_point", {})],
        position=(1.0, 0.0, 0.0),
        inertia=(1.0, 2.0, 3.0),
        angular_velocity=(0.1, 2.0, 0.1),
    )
    spin, kinetic = engine.angular_momentum(), engine.energy().total
    engine.run(until=1e3)
    assert math.dist(engine.angular_momentum(), spin) < 1e-11
    assert abs(engine.energy().total - kinetic) < 1e-11
    assert steppers_of(engine) == ["core:linear"]


# Energy


def test_an_undamped_net_keeps_energy_momentum_and_spin() -> None:
    engine, _ = net(damping=0.0)
    before, push = engine.energy().total, engine.momentum()
    engine.run(until=50.0)
    assert abs(engine.energy().total - before) < 1e-12 * before
    assert math.dist(engine.momentum(), push) < 1e-11 * math.sqrt(before)


def test_work_of_dampers_and_drag_is_the_integral_of_their_power() -> None:
    engine, objects = net(damping=5.0)
    drag = engine.add_law("basic:linear_drag", coefficient=2.0)
    for obj in objects[:2]:
        engine.map(obj, drag)
    end, dash = 0.2, next(law for law in engine.laws if isinstance(law, Dashpot))
    balance = engine.energy().balance
    power = []
    nodes, weights = np.polynomial.legendre.leggauss(400)
    for node in nodes:
        engine.run(until=0.5 * end * (1.0 + node))
        v = np.array([obj.velocity for obj in objects])
        pairs = sum(((v[a] - v[b]) ** 2).sum() for a in range(len(v)) for b in range(a))
        power.append(-dash.damping * pairs - drag.coefficient * (v[:2] ** 2).sum())
    engine.run(until=end)
    exact = 0.5 * end * float(np.dot(weights, power))
    assert engine.energy().work == pytest.approx(exact, rel=1e-12)
    assert engine.energy().balance == pytest.approx(balance, rel=1e-14)


def test_work_stays_booked_through_events() -> None:
    engine, objects = net(damping=5.0)
    start, extra = engine.energy().balance, 0.0
    engine.run(until=0.1)
    kinetic = engine.energy().total
    objects[2].velocity = (0.0, 0.0, 1.0)
    extra += engine.energy().total - kinetic
    engine.run(until=0.15)
    objects[1].add_force(xp.Force((100.0, -20.0, 5.0), duration=0.03))
    engine.run(until=0.2)
    kinetic = engine.energy().total
    engine.remove_object(objects[3])
    extra += engine.energy().total - kinetic
    engine.run(until=0.3, dt=0.01)
    assert engine.energy().balance - extra == pytest.approx(start, rel=1e-13)


# What happens in between


def test_numbers_of_laws_change_while_it_swings() -> None:
    engine, body = bob([("basic:spring_to_point", {"stiffness": 100.0})], position=(1.0, 0.0, 0.0))
    spring = engine.laws[0]
    engine.run(until=1.0, dt=0.01)
    spring.stiffness = 400.0
    x, v = body.position[0], body.velocity[0]
    engine.run(until=1.5, dt=0.01)
    assert body.position[0] == pytest.approx(x * math.cos(10.0) + v / 20.0 * math.sin(10.0), abs=1e-14)
    spring.rest_length = 0.1
    engine.run(until=1.6, dt=0.01)
    assert "core:linear" not in steppers_of(engine)
    spring.rest_length = 0.0
    engine.run(until=1.7, dt=0.01)
    assert steppers_of(engine) == ["core:linear"]


def test_masses_and_columns_change_while_it_gyrates() -> None:
    engine, body = bob([("basic:magnetic_field", {"field": (0.0, 0.0, 2.0)})], charge=1.0, velocity=(1.0, 0.0, 0.0))
    engine.run(until=1.0)
    body.mass = 4.0
    engine.run(until=2.0)
    body["charge"] = 8.0
    engine.run(until=3.0)
    turned = 2.0 + 0.5 + 4.0
    assert body.velocity == pytest.approx((math.cos(turned), -math.sin(turned), 0.0), abs=1e-14)


def test_what_holds_a_spring_is_put_elsewhere() -> None:
    engine = xp.PhysicsEngine()
    spring = engine.add_law("basic:spring", stiffness=4.0)
    post = engine.add_object(xp.PhysicalObject(fixed=True), laws=[spring])
    body = engine.add_object(xp.PhysicalObject(position=(1.0, 0.0, 0.0)), laws=[spring])
    engine.run(until=0.25 * math.pi)
    post.position = (0.0, 3.0, 0.0)
    engine.run(until=0.5 * math.pi)
    assert body.position == pytest.approx((-1.0, 3.0, 0.0), abs=1e-14)


def test_a_far_place_costs_no_digits() -> None:
    far = 1e9
    engine, body = bob(
        [("basic:spring_to_point", {"stiffness": 1e8, "anchor": (far, 0.0, 0.0)})], position=(far + 1.0, 0.0, 0.0)
    )
    engine.run(until=0.1)
    with mpmath.workdps(40):
        exact = float(mpmath.cos(mpmath.mpf(0.1) * 10**4))
    assert body.position[0] - far == pytest.approx(exact, abs=2e-7), "a unit of the last place of the place"
    assert body.velocity[0] == pytest.approx(-1e4 * math.sin(1000.0), rel=1e-12)


def test_a_body_that_begins_to_turn_with_the_frame_is_served_by_another() -> None:
    engine, body = bob([("basic:rotating_frame", {"angular_velocity": (0.0, 0.0, 1.0)})], velocity=(1.0, 0.0, 0.0))
    engine.run(until=0.5, dt=0.01)
    assert steppers_of(engine) == ["core:linear"]
    body.inertia = (1.0, 2.0, 3.0)
    engine.run(until=0.6, dt=0.01)
    assert "core:linear" not in steppers_of(engine)


def test_a_partner_that_comes_later_joins_the_net() -> None:
    engine, objects = net(damping=0.0)
    engine.run(until=0.1)
    energy = engine.energy().total
    late = engine.add_object(xp.PhysicalObject(position=objects[0].position))
    engine.map(late, engine.laws[0])
    more = engine.energy().total
    assert more > energy
    engine.run(until=0.5)
    assert engine.energy().total == pytest.approx(more, rel=1e-13)
    assert set(steppers_of(engine)) == {"core:linear"}


def test_a_restored_engine_goes_on_to_the_bit() -> None:
    engine, objects = net()
    engine.run(until=0.1)
    objects[2].velocity = (0.0, 0.0, 1.0)
    engine.run(until=0.123)
    twin = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Dashpot])
    assert [obj.position for obj in twin.objects] == [obj.position for obj in engine.objects]
    for one in (engine, twin):
        one.run(until=0.3)
    assert [obj.position for obj in twin.objects] == [obj.position for obj in engine.objects]
    assert twin.energy() == engine.energy()


def test_a_height_is_passed_at_the_exact_time() -> None:
    engine, body = bob([("basic:spring_to_point", {"stiffness": 4.0})], position=(1.0, 0.0, 0.0))
    engine.run(until=0.25 * math.pi)
    assert body.position[0] == pytest.approx(0.0, abs=1e-15)


# Refusals


def test_what_grows_without_bound_is_told_of() -> None:
    class Push(xp.FieldLaw):
        rate = Param(1.0, unit="N/m")

        def force(self, body: Any) -> Any:
            return self.rate * body.position

    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(position=(1.0, 0.0, 0.0)), laws=[engine.add_law(Push())])
    engine.run(until=10.0)
    assert body.position[0] == pytest.approx(math.cosh(10.0), rel=1e-14)
    assert body.position[1] == 0.0
    engine.run(until=1e4)
    with pytest.raises(StateError, match="beyond the range of a float at t = 10000"):
        _ = body.position


def test_a_missing_charge_is_told_of_as_ever() -> None:
    engine, _ = bob([("basic:magnetic_field", {"field": (0.0, 0.0, 2.0)})], velocity=(1.0, 0.0, 0.0))
    with pytest.raises(LawFailedError, match="has no charge"):
        engine.run(until=1.0)


def test_refusals_say_why() -> None:
    engine, _ = bob([("basic:quadratic_drag", {})], velocity=(1.0, 0.0, 0.0), drag_area=1.0)
    engine.run(until=0.1, dt=0.01)
    group = engine.explain().data["groups"][0]
    assert "linear" in group["refused"]["core:linear"]
