"""One-sided laws: sources are moved on first and feel nothing; targets ask where they are, at any instant."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError, SceneError

GM = 1.0


class Pull(xp.PairLaw):
    """F = -m_b GM r / |r|^3 on what feels it; GM is that of each source of 1 kg."""

    id = "test:pull"
    g = xp.Constant(1.0, unit="m^3/kg/s^2")

    def force(self, a: Any, b: Any) -> Any:
        r = b.position - a.position
        return self.g * a.mass * b.mass * r / r.norm() ** 3

    def potential(self, a: Any, b: Any) -> Any:
        return -self.g * a.mass * b.mass / (b.position - a.position).norm()


class Field(xp.FieldLaw):
    """The same field, its centre at rest at the origin."""

    id = "test:field"
    g = xp.Constant(1.0, unit="m^3/s^2")

    def force(self, body: Any) -> Any:
        return -self.g * body.mass * body.position / body.position.norm() ** 3


class Wave(xp.FieldLaw):
    """A force that changes with time, so that steps are made: a = (cos t, 0, 0)."""

    id = "test:wave"
    rate, strength = xp.Constant(1.0, unit="1/s"), xp.Constant(1.0, unit="m/s^2")

    def force(self, body: Any) -> Any:
        return self.strength * body.mass * np.cos(self.rate * body.time) * xp.vector(1, 0, 0)


class Log(xp.PhysicalLaw):
    """Do something when told."""

    def __init__(self, act: Any, **given: Any) -> None:
        super().__init__(**given)
        self.act = act

    def enforce_this_law(self, event: Any) -> None:
        self.act()


def batch_of(engine: xp.PhysicsEngine, obj: xp.PhysicalObject) -> Any:
    """Return the batch that moves ``obj``."""
    world: Any = engine._world
    return world.batches[int(world.bodies.batch[obj._row])]


def sun_and_dust(
    count: int = 3, wave: bool = False, moving: bool = True, **given: Any
) -> tuple[xp.PhysicsEngine, xp.PhysicalObject, list[xp.PhysicalObject], Any]:
    """Return an engine with a source and targets on circles about it, and the law."""
    engine = xp.PhysicsEngine(**given)
    velocity = (0.3, 0.0, -0.1) if moving else (0, 0, 0)
    laws = [engine.add_law(Wave)] if wave else []
    sun = engine.add_object(xp.PhysicalObject(name="sun", velocity=velocity), laws=laws)
    dust = []
    for k in range(count):
        r, turn = 1.0 + 0.25 * k, 2 * math.pi * k / max(count, 1)
        x = (r * math.cos(turn), r * math.sin(turn), 0.0)
        v = tuple(c / math.sqrt(r) + u for c, u in zip((-math.sin(turn), math.cos(turn), 0.0), velocity, strict=True))
        dust.append(engine.add_object(xp.PhysicalObject(name=f"d{k}", mass=1e-3, position=x, velocity=v)))
    law = engine.add_law(Pull(between=([sun], dust), one_sided=True))
    return engine, sun, dust, law


def away(sun: xp.PhysicalObject, one: xp.PhysicalObject) -> float:
    """Return the distance of the two [m]."""
    return math.dist(sun.position, one.position)


def test_a_source_feels_nothing_and_flies_on_in_closed_form() -> None:
    engine, sun, dust, _ = sun_and_dust()
    engine.run(until=2.0, dt=0.01)
    assert sun.position == (0.6, 0.0, -0.2)
    assert batch_of(engine, sun).stepper.id == "core:ballistic"
    assert all(batch_of(engine, one) is batch_of(engine, dust[0]) for one in dust)
    assert engine.momentum()[0] != pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("moving", [False, True])
def test_targets_circle_about_their_source(moving: bool) -> None:
    engine, sun, dust, _ = sun_and_dust(moving=moving)
    errors = []
    for dt in (0.02, 0.01):
        engine, sun, dust, _ = sun_and_dust(moving=moving)
        engine.run(until=5.0, dt=dt)
        errors.append(max(abs(away(sun, one) - (1.0 + 0.25 * k)) for k, one in enumerate(dust)))
    assert errors[1] < 1e-4 and errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_tolerances_are_kept_along_a_moving_source() -> None:
    engine, sun, dust, _ = sun_and_dust()
    engine.run(until=1.0, rtol=1e-8, atol=1e-8)
    assert max(abs(away(sun, one) - (1.0 + 0.25 * k)) for k, one in enumerate(dust)) < 1e-6


def test_a_resting_source_is_a_field_to_the_last_digits() -> None:
    engine, _, dust, _ = sun_and_dust(moving=False)
    twin = xp.PhysicsEngine()
    law = twin.add_law(Field)
    alone = [
        twin.add_object(xp.PhysicalObject(mass=1e-3, position=d.position, velocity=d.velocity), laws=[law])
        for d in dust
    ]
    for one in (engine, twin):
        one.run(until=2.0, dt=0.01)
    for a, b in zip(dust, alone, strict=True):
        assert a.position == pytest.approx(b.position, abs=1e-13)


@pytest.mark.parametrize("settings", [{"dt": 0.01}, {"rtol": 1e-8, "atol": 1e-8}], ids=["dt", "tolerances"])
def test_targets_change_no_bit_of_a_source_that_is_stepped(settings: dict[str, float]) -> None:
    engine, sun, dust, _ = sun_and_dust(wave=True)
    alone, lonely, _, _ = sun_and_dust(count=0, wave=True)
    engine.run(until=1.5, **settings)
    alone.run(until=1.5, **settings)
    assert (sun.position, sun.velocity) == (lonely.position, lonely.velocity)
    assert batch_of(engine, sun) is not batch_of(engine, dust[0])
    # in the frame of a source that is shaken, the targets feel its shaking the other way
    assert away(sun, dust[0]) != pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("settings", [{"dt": 0.005}, {"rtol": 1e-8, "atol": 1e-8}], ids=["dt", "tolerances"])
def test_a_stepped_source_is_felt_where_it_is_at_each_moment(settings: dict[str, float]) -> None:
    """The target of a source whose way is known, against the same field carried along by a formula."""

    class Carried(xp.FieldLaw):
        """The field of a source at x = 1 - cos t."""

        id = "test:carried"
        g, rate = xp.Constant(1.0, unit="m^3/s^2"), xp.Constant(1.0, unit="1/s")
        size = xp.Constant(1.0, unit="m")

        def force(self, body: Any) -> Any:
            r = body.position - xp.vector(
                self.size * (1.0 - np.cos(self.rate * body.time)), self.size * 0, self.size * 0
            )
            return -self.g * body.mass * r / r.norm() ** 3

    engine = xp.PhysicsEngine()
    sun = engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(Wave)])
    dust = engine.add_object(xp.PhysicalObject(position=(0, 1.5, 0), velocity=(0.9, 0, 0)))
    engine.add_law(Pull(between=(sun, dust), one_sided=True))
    twin = xp.PhysicsEngine()
    other = twin.add_object(xp.PhysicalObject(position=(0, 1.5, 0), velocity=(0.9, 0, 0)), laws=[twin.add_law(Carried)])
    for one in (engine, twin):
        one.run(until=2.0, **settings)
    assert sun.position[0] == pytest.approx(1.0 - math.cos(2.0), abs=1e-5)
    assert dust.position == pytest.approx(other.position, abs=2e-5)


def test_an_event_at_a_source_is_felt_from_that_instant_on() -> None:
    """The source jumps in the midst of a step: as if it had been two runs."""
    engine, sun, dust, _ = sun_and_dust(moving=False)
    engine.add_law(
        Log(lambda: setattr(sun, "velocity", (0, 0.5, 0))),
        container=xp.LawContainer(xp.when.Elapsed(1.2345, once=True)),
    )
    engine.run(until=2.0, dt=0.01)
    twin, other, their, _ = sun_and_dust(moving=False)
    twin.run(until=1.2345, rtol=1e-8, atol=1e-8)
    other.velocity = (0, 0.5, 0)
    twin.run(until=2.0, rtol=1e-8, atol=1e-8)
    assert sun.position == pytest.approx((0, 0.5 * (2.0 - 1.2345), 0), abs=1e-15)
    for a, b in zip(dust, their, strict=True):
        assert a.position == pytest.approx(b.position, abs=3e-4)


def test_an_event_at_a_stepped_source_restarts_its_targets() -> None:
    engine, sun, dust, _ = sun_and_dust(wave=True)
    engine.add_law(
        Log(lambda: setattr(sun, "velocity", (0, 0.5, 0))),
        container=xp.LawContainer(xp.when.Elapsed(0.1234, once=True)),
    )
    engine.run(until=0.1234, dt=0.1)
    version = [int(engine._world.bodies.version[one._row]) for one in dust]
    engine.run(until=0.15, dt=0.1)
    assert batch_of(engine, sun).signature.level == 0 and batch_of(engine, dust[0]).signature.level == 1
    assert all(after > before for before, after in zip([v - 1 for v in version], version, strict=True))
    engine.run(until=1.0, dt=0.001)
    assert math.isfinite(dust[0].position[0])


def test_an_event_at_a_target_restarts_nobody_else() -> None:
    engine, sun, dust, _ = sun_and_dust(wave=True)
    engine.run(until=0.55, dt=0.1)
    seen = {one: int(engine._world.bodies.version[one._row]) for one in (sun, *dust)}
    dust[1].velocity = (0, 0, 0)
    now = {one: int(engine._world.bodies.version[one._row]) for one in (sun, *dust)}
    assert [one for one in seen if now[one] != seen[one]] == [dust[1]]


def chain(engine: xp.PhysicsEngine, closed: bool) -> list[xp.PhysicalObject]:
    """Return three bodies, each the target of the one before; ``closed``: the first that of the last."""
    bodies = [engine.add_object(xp.PhysicalObject(name=f"b{k}", position=(2.0 * k, 0.3 * k, 0))) for k in range(3)]
    for k in range(3 if closed else 2):
        engine.add_law(Pull(between=(bodies[k], bodies[(k + 1) % 3]), one_sided=True))
    return bodies


def test_a_chain_is_moved_in_the_order_of_dependence() -> None:
    engine = xp.PhysicsEngine()
    bodies = chain(engine, closed=False)
    engine.run(until=1.0, dt=0.01)
    assert [batch_of(engine, one).signature.level for one in bodies] == [0, 1, 2]
    assert bodies[0].position == (0, 0, 0) and bodies[2].velocity != (0, 0, 0)


def test_a_ring_of_dependence_is_one_group() -> None:
    engine = xp.PhysicsEngine()
    bodies = chain(engine, closed=True)
    engine.run(until=0.5, dt=0.01)
    assert engine._world.group_of(bodies[0]) == bodies
    assert len({id(batch_of(engine, one)) for one in bodies}) == 1
    # a pair that pulls one another by two one-sided laws is a pair that a two-sided law joins
    ends = []
    for ring in (True, False):
        engine = xp.PhysicsEngine(stepper="core:midpoint")
        a, b = (engine.add_object(xp.PhysicalObject(position=(k, 0, 0), velocity=(0, k - 0.5, 0))) for k in (0, 1))
        if ring:
            engine.add_law(Pull(between=(a, b), one_sided=True)), engine.add_law(Pull(between=(b, a), one_sided=True))
        else:
            engine.add_law(Pull(between=(a, b)))
        engine.run(until=1.0, dt=0.01)
        ends.append((*a.position, *b.position))
        assert engine.energy().balance == pytest.approx(0.25 - (0 if ring else 1.0), abs=1e-3)
    assert ends[0] == pytest.approx(ends[1], abs=1e-13)


def test_energy_counts_the_field_of_what_rests_and_the_work_of_what_moves() -> None:
    fixed = xp.PhysicsEngine()
    rock = fixed.add_object(xp.PhysicalObject(fixed=True))
    mote = fixed.add_object(xp.PhysicalObject(position=(1, 0, 0), velocity=(0, 1.1, 0)))
    fixed.add_law(Pull(between=(rock, mote), one_sided=True))
    fixed.run(until=1.0, dt=1e-3)
    assert fixed.energy().potential == pytest.approx(-1.0 / away(rock, mote), rel=1e-15)
    assert fixed.energy().total == pytest.approx(0.5 * 1.21 - 1.0, abs=1e-6) and fixed.energy().work == 0.0
    for moving in (False, True):
        engine, *_ = sun_and_dust(moving=moving)
        before = engine.energy().balance
        engine.run(until=0.5, dt=1e-3)
        assert engine.energy().potential == 0.0
        assert engine.energy().balance == pytest.approx(before, abs=1e-9)
        if moving:
            assert engine.explain().data["energy"]["work_by"]["sources"] != 0.0


def test_a_source_that_is_removed_or_switched_off_lets_go() -> None:
    engine, sun, dust, law = sun_and_dust()
    engine.run(until=0.25, dt=0.1)
    law.enabled = False
    kept = dust[0].velocity
    engine.run(until=0.5, dt=0.1)
    assert dust[0].velocity == kept
    law.enabled = True
    engine.run(until=0.75, dt=0.1)
    assert dust[0].velocity != kept
    engine.remove_object(sun)
    kept = dust[0].velocity
    engine.run(until=1.0, dt=0.1)
    assert dust[0].velocity == kept


def test_a_checkpoint_goes_on_to_the_bit() -> None:
    engine, *_ = sun_and_dust(wave=True)
    engine.run(until=0.777, dt=0.01)
    twin = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Pull, Wave])
    for one in (engine, twin):
        one.run(until=2.0, dt=0.01)
    assert twin.checkpoint() == engine.checkpoint()
    assert engine.copy().checkpoint() == engine.checkpoint()


def test_explain_says_who_acts_on_whom() -> None:
    engine, *_ = sun_and_dust(wave=True)
    engine.run(until=0.1, dt=0.01)
    data = engine.explain().data
    told = next(law for law in data["laws"] if law["id"] == "test:pull")
    assert "1 sources act on 3 objects" in str(told)
    assert any("moved on after what acts on it" in group["because"] for group in data["groups"])


def test_a_scene_file_keeps_who_acts(tmp_path: Any) -> None:
    from xpheve.plugins.registry import Registry

    registry = Registry()
    registry.register([Pull, Wave], name="test")
    engine, *_ = sun_and_dust(registry=registry)
    path = tmp_path / "scene.toml"
    engine.save_scene(path)
    assert "one_sided = true" in path.read_text()
    twin = xp.PhysicsEngine.load_scene(path, registry=registry)
    engine.run(until=1.0, dt=0.01), twin.run(until=1.0, dt=0.01)
    ends = [{obj.name: obj.position for obj in one.objects} for one in (engine, twin)]
    assert ends[0] == ends[1] and len(ends[0]) == 4
    bad = tmp_path / "bad.toml"
    bad.write_text(path.read_text().replace("between = ", "# between = "))
    with pytest.raises(SceneError, match=r"one_sided says who acts on whom: give between"):
        xp.PhysicsEngine.load_scene(bad, registry=registry)


def test_bad_sides_are_refused() -> None:
    a, b = xp.PhysicalObject(name="a"), xp.PhysicalObject(name="b")
    with pytest.raises(InvalidValueError, match=r"give between=\(sources, targets\)"):
        Pull(one_sided=True)
    with pytest.raises(InvalidValueError, match="among the sources and the targets"):
        Pull(between=([a, b], [b]), one_sided=True)
    with pytest.raises(InvalidValueError, match="one_sided = 1"):
        Pull(between=(a, b), one_sided=1)  # type: ignore[arg-type]
