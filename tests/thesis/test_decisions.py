"""What the thesis leaves open, and decision 22 says: pairs, shared containers, force ids, reset, material."""

from __future__ import annotations

import math
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import StateError


class Count(xp.PhysicalLaw):
    """Be counted."""

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


def two_balls(mapped: tuple[bool, bool], fixed: bool = False) -> tuple[float, float]:
    """Return the speeds of a ball at 1 m/s and of another in its way, of which some obey the collision law."""
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    one = xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0))
    two = xp.PhysicalObject(xp.Sphere(0.5), position=(3, 0, 0), fixed=fixed)
    for obj, obeys in zip((one, two), mapped, strict=True):
        engine.add_object(obj, laws=[law] if obeys else [])
    engine.run(until=4.0)
    return one.velocity[0], two.velocity[0]


@pytest.mark.thesis("pairs", "pairs/decide")
@pytest.mark.parametrize("fixed", [False, True], ids=["both free", "scenery"])
def test_3_4_a_pair_law_acts_when_both_obey_it(fixed: bool) -> None:
    for mapped in ((True, False), (False, True), (False, False)):
        assert two_balls(mapped, fixed) == (1.0, 0.0)
    assert two_balls((True, True), fixed) == ((-1.0, 0.0) if fixed else (0.0, 1.0))
    engine = xp.PhysicsEngine()
    law = engine.add_law("collision:elastic")
    floor, ball = (engine.add_object(xp.PhysicalObject(fixed=fixed), laws=laws) for laws in ([], [law]))
    assert law.objects == (ball,) and floor.laws == ()  # who obeys can be seen


@pytest.mark.thesis("pairs/decide")
def test_3_4_between_lets_one_side_act_on_the_other() -> None:
    """A planet pulls dust; the dust does not pull itself."""
    engine = xp.PhysicsEngine()
    planet = engine.add_object(xp.PhysicalObject(mass=1e12, fixed=True))
    dust = [engine.add_object(xp.PhysicalObject(mass=1e12, position=(0, 10.0 + k, 0))) for k in (0, 1)]
    engine.add_law("basic:universal_gravity", between=([planet], dust), gravitational_constant=1e-12)
    engine.run(until=0.0)
    engine.step(1e-3)
    near, far = (obj.velocity[1] / -1e-3 for obj in dust)
    assert (near, far) == pytest.approx((1 / 100, 1 / 121), rel=1e-6)  # each other's pull would be 1


@pytest.mark.thesis("one-detection-many-laws/decide")
def test_3_2_2_3_laws_of_one_default_condition_share_a_container() -> None:
    engine = xp.PhysicsEngine()
    first, second = (engine.add_law("collision:elastic", name=name) for name in "ab")
    assert first.containers == second.containers and len(engine.containers) == 1
    started = type("OnStart", (Count,), {"condition": xp.when.Started()})
    one, two = engine.add_law(started(name="c")), engine.add_law(started(name="d"))
    assert one.containers == two.containers and len(engine.containers) == 2
    own = engine.add_law(started(name="e"), container=xp.LawContainer(xp.when.Started()))
    assert own.containers != one.containers  # a container that was given is that container
    named = engine.add_law(Count(name="f"), container=xp.LawContainer(xp.when.Posted("x"), name="mine"))
    other = engine.add_law(type("OnPost", (Count,), {"condition": xp.when.Posted("x")})())
    assert named.containers != other.containers  # nor is one with a name shared unasked
    engine.run(until=0.0)
    assert [law.evaluations for law in (one, two, own)] == [1, 1, 1]


@pytest.mark.thesis("one-detection-many-laws/decide")
def test_3_2_2_3_a_law_in_two_containers_is_enforced_by_each() -> None:
    """Once an event, and not once an instant: two conditions that fire together are two events."""
    engine = xp.PhysicsEngine()
    law = Count()
    holders = [xp.LawContainer(xp.when.Elapsed(seconds, every=True)) for seconds in (0.5, 1.0)]
    for holder in holders:
        engine.add_law(law, container=holder) if law.engine is None else engine.add_container(holder).add_law(law)
    engine.run(until=2.0)
    assert [holder.firings for holder in holders] == [4, 2] and law.evaluations == 6
    law.enabled = False
    engine.run(until=3.0)
    assert law.evaluations == 6
    holders[1].remove_law(law)
    law.enabled = True
    engine.run(until=4.0)
    assert law.evaluations == 8


@pytest.mark.thesis("force-ids", "force-ids/decide")
def test_2_5_1_ids_are_counted_by_each_engine_so_that_runs_repeat() -> None:
    def ids() -> list[Any]:
        engine = xp.PhysicsEngine()
        body = engine.add_object(xp.PhysicalObject())
        return [engine.new_force_id(), *(body.add_force((1, 0, 0)).id for _ in range(3))]

    assert ids() == ids() and len(set(ids())) == 4


@pytest.mark.thesis("force-ids/decide")
def test_2_5_1_after_a_restore_ids_go_on_where_they_were() -> None:
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject(name="body"))
    kept = body.add_force((1, 0, 0))
    gone = body.add_force((0, 1, 0), 0.5)
    engine.run(until=1.0)
    for other in (engine.copy(), xp.PhysicsEngine.restore(engine.checkpoint())):
        new = other.object("body").add_force((0, 0, 1))
        assert new.id not in (kept.id, gone.id)
        assert [force.id for force in other.object("body").forces] == [kept.id, new.id]


@pytest.mark.thesis("force-ids/decide")
def test_2_5_1_an_id_that_names_no_force_removes_none() -> None:
    """A force may have ended by itself a moment before it is let go: no error, and the count says so."""
    engine = xp.PhysicsEngine()
    body = engine.add_object(xp.PhysicalObject())
    pedal = body.add_force((1, 0, 0), 0.5)
    engine.run(until=1.0)
    assert pedal.id is not None
    assert body.remove_force(pedal.id) == 0 == body.remove_force("never")
    assert body.velocity == (0.5, 0, 0)


@pytest.mark.thesis("stop-time", "stop-time/decide")
def test_fig_5_7_reset_restores_the_scene_as_it_was_first_started() -> None:
    engine = xp.PhysicsEngine()
    gravity = engine.add_law("basic:planet_gravity", acceleration=9.8)
    started = engine.add_law(Count(), container=xp.LawContainer(xp.when.Started()))
    body = engine.add_object(xp.PhysicalObject(position=(0, 3, 0), mass=2.0, name="body"), laws=[gravity])
    body.add_force((1, 0, 0), 0.75, id="mine")
    body.mass = 3.0  # before the first run: part of what is authored
    engine.run(until=0.5)
    gravity.acceleration = 1.6  # type: ignore[attr-defined]
    body.mass, body.position = 5.0, (9, 9, 9)
    late = engine.add_object(xp.PhysicalObject(name="late"))
    engine.unmap(body, gravity)
    engine.run(until=2.0)
    engine.reset()
    assert engine.time == 0.0 and engine.state == "ready"
    assert (body.mass, body.position, body.velocity) == (3.0, (0, 3, 0), (0, 0, 0))
    assert gravity.parameters["acceleration"] == 9.8 and body.laws == (gravity,)
    assert late.engine is None and [obj.name for obj in engine.objects] == ["body"]
    users = engine.user_forces(body)
    assert [(force.vector, force.duration, force.id) for force in users] == [((1, 0, 0), 0.75, "mine")]
    engine.run(until=0.5)
    assert started.evaluations == 1 and body.velocity == pytest.approx((0.5 / 3, -4.9, 0), rel=1e-15)


@pytest.mark.thesis("states")
def test_3_1_2_each_command_acts_at_once_and_at_its_instant() -> None:
    """Suspended by a handler at 0.3 s the run ends there, though it was to go on to 1 s."""
    kind = type("Stop", (xp.PhysicalLaw,), {"enforce_this_law": lambda self, event: self.engine.suspend()})
    engine = xp.PhysicsEngine()
    engine.add_law(kind(), container=xp.LawContainer(xp.when.Elapsed(0.3)))
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    engine.run(until=1.0)
    assert (engine.state, engine.time, ball.position) == ("suspended", 0.3, (0.3, 0, 0))
    with pytest.raises(StateError, match="resume"):
        engine.run(until=1.0)
    engine.resume()
    engine.run(until=1.0)
    assert ball.position == (1, 0, 0)
    engine.terminate()
    with pytest.raises(StateError, match="reset"):
        engine.run(until=2.0)
    assert ball.position == (1, 0, 0)
    engine.reset()
    engine.run(until=0.25)
    assert ball.position == (0.25, 0, 0)


MATERIALS = {"rubber": {"density": 1100.0, "restitution": 0.8}, "lead": {"density": 11340.0, "restitution": 0.1}}


@pytest.mark.thesis("integration/decide")
def test_5_2_a_material_is_a_table_of_attributes() -> None:
    """Density gives the mass, and what laws ask for are columns; so a material needs no class of its own."""
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", combine="minimum")
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    balls = {
        name: engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.1), position=(k, 0.2, 0), velocity=(0, -1, 0), name=name, **material),
            laws=[bounce],
        )
        for k, (name, material) in enumerate(MATERIALS.items())
    }
    engine.run(until=0.2)
    for name, material in MATERIALS.items():
        assert balls[name].mass == pytest.approx(material["density"] * 4 / 3 * math.pi * 1e-3, rel=1e-14)
        assert balls[name].velocity[1] == pytest.approx(material["restitution"], abs=1e-15)


@pytest.mark.thesis("one-time-line")
def test_fig_2_14_there_is_one_time_line_and_a_change_acts_at_its_instant() -> None:
    """A change of the host lies between two runs, one of a law at its event; both act from there on, whatever the updates."""

    def end(dt: float | None) -> Any:
        push = type(
            "Push", (xp.PhysicalLaw,), {"enforce_this_law": lambda s, e: [o.add_force((1, 0, 0)) for o in e.objects]}
        )
        engine = xp.PhysicsEngine()
        law = engine.add_law(push(), container=xp.LawContainer(xp.when.Elapsed(0.37)))
        body = engine.add_object(xp.PhysicalObject(), laws=[law])
        engine.run(until=0.5, dt=dt)
        body.mass = 2.0
        engine.run(until=1.0, dt=dt)
        return body.position, body.velocity

    assert end(None) == end(0.1) == end(0.03)
    assert end(None)[1][0] == pytest.approx(0.13 + 0.25, rel=1e-14)


@pytest.mark.thesis("every-n-frames")
@pytest.mark.parametrize(("n", "calls"), [(0, 12), (1, 6), (2, 4), (5, 2)])
def test_3_2_2_1_every_n_frames_of_the_host(n: int, calls: int) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Count(), container=xp.LawContainer(xp.when.Steps(n=n)))
    engine.run(until=12 / 8, dt=1 / 8)
    assert law.evaluations == calls
    assert engine.time == 1.5


@pytest.mark.thesis("entry-while-touching")
def test_3_2_2_1_entry_armed_on_what_touches_already_is_told_once() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic", restitution=0.0)
    gravity = engine.add_law("basic:planet_gravity")
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[bounce])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0.1, 0)), laws=[bounce, gravity])
    engine.run(until=1.0)
    entry = engine.add_law(Count(), container=xp.LawContainer(xp.when.ContactBegin()))
    engine.map(floor, entry)
    engine.map(ball, entry)
    engine.run(until=2.0)
    assert entry.evaluations == 1
    engine.run(until=3.0)
    assert entry.evaluations == 1


@pytest.mark.thesis("suspended-is-deaf")
def test_3_1_3_fig_3_8_what_happens_to_a_suspended_engine_is_told_when_it_goes_on() -> None:
    """Posts, changes and new objects wake nobody meanwhile, and none is lost; a terminated engine wakes nobody."""
    conditions = (xp.when.Posted(), xp.when.Changed(), xp.when.ObjectAdded(), xp.when.Elapsed(0.25, every=True))
    engine = xp.PhysicsEngine()
    laws = [engine.add_law(Count(name=str(one)), container=xp.LawContainer(one)) for one in conditions]
    body = engine.add_object(xp.PhysicalObject(), laws=laws)
    engine.run(until=1.0)

    def counts() -> list[int]:
        return [law.evaluations for law in laws]

    def disturb() -> None:
        engine.post("now")
        body.mass += 1.0
        engine.add_object(xp.PhysicalObject(), laws=laws)

    before = counts()
    engine.suspend()
    disturb()
    assert counts() == before == [0, 0, 1, 4]
    engine.resume()
    assert counts() == before
    engine.run(until=1.125)
    assert counts() == [1, 1, 2, 4]
    engine.terminate()
    disturb()
    assert counts() == [1, 1, 2, 4]
