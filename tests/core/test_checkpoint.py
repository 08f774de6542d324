"""Checkpoints hold all that a run depends on; what is no checkpoint is refused before anything changes."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import RecordError, UnknownLawError, XpheveError
from xpheve.record.checkpoint import pack, unpack


class Pulse(xp.PhysicalLaw):
    """A local law of time that keeps a list."""

    condition = xp.when.Elapsed(0.25, every=True)
    initial_state: ClassVar[dict[str, Any]] = {"seen": [], "last": 0.0}

    def enforce_this_law(self, event: Any) -> None:
        """Keep the time, push for a while."""
        self.state["seen"].append(event.time)
        self.state["last"] = event.time
        for obj in event.objects:
            obj.add_force((0.0, 0.1, 0.0), duration=0.1, id="pulse")


class Holder(xp.LawContainer):
    """A local container."""

    condition = xp.when.Posted("go")


class Nudge(xp.PhysicalLaw):
    """A local law without a condition of its own."""

    def enforce_this_law(self, event: Any) -> None:
        """One more unit of speed."""
        for obj in event.objects or self.objects:
            obj.velocity = (obj.velocity[0] + 1.0, *obj.velocity[1:])


class Counting(xp.LawContainer):
    """A local container that polls."""

    period = 0.2

    def detect(self) -> Any:
        """Never anything."""
        return None


def scene() -> xp.PhysicsEngine:
    """A scene with something of everything."""
    engine = xp.PhysicsEngine(up="z", seed=3)
    gravity = engine.add_law("basic:planet_gravity", name="down", acceleration=9.81)
    bounce = engine.add_law("collision:elastic", restitution=0.6, combine="minimum")
    spring = engine.add_law("basic:spring", stiffness=7.0, rest_length=0.5)
    pulse = engine.add_law(Pulse(name="pulse"))
    nudge = engine.add_law(Nudge(), container=Holder(name="holder"))
    off = engine.add_law("basic:linear_drag", enabled=False)
    engine.add_container(Counting())
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"), laws=[bounce])
    balls = [
        xp.PhysicalObject(
            xp.Sphere(0.1), mass=1.0 + k, position=(k, 0, 0.3 + 0.2 * k), name=f"ball {k}", restitution=0.5
        )
        for k in range(3)
    ]
    engine.add_objects(balls, laws=[gravity, bounce, pulse, nudge, off])
    boxes = [
        xp.PhysicalObject(xp.Box((0.1, 0.2, 0.3)), position=(k, 5, 1), angular_velocity=(1, 2, k)) for k in range(2)
    ]
    engine.add_objects(boxes, laws=[spring])
    engine.add_object(xp.PhysicalObject(xp.Capsule(0.1, 0.5), density=700.0, position=(0, 9, 0), inertia=(1, 2, 2.5)))
    balls[0].add_force((0.2, 0.0, 0.0), duration=0.9, id="tow")
    balls[1].add_force(xp.Force((0.0, 0.1, 0.0), torque=(0.0, 0.0, 0.01)))
    return engine


def revived(data: Any, **options: Any) -> xp.PhysicsEngine:
    return xp.PhysicsEngine.restore(data, laws=[Pulse, Nudge], containers=[Holder, Counting], **options)


def everything(engine: xp.PhysicsEngine) -> Any:
    """All that can be asked of an engine, as plain values."""
    objects = []
    for obj in engine.objects:
        state = (obj.position, obj.velocity, obj.orientation, obj.angular_velocity, obj.mass, obj.inertia)
        shape = None if obj.shape is None else obj.shape.describe()
        names = [law.name or law.label() for law in obj.laws]
        objects.append((obj.name, obj.serial, obj.fixed, shape, state, obj.columns, obj.forces, names))
    laws = [(law.label(), law.name, law.enabled, law.parameters, law.state, law.evaluations) for law in engine.laws]
    containers = [
        (c.label(), c.name, str(c.condition), [law.label() for law in c.laws], c.firings) for c in engine.containers
    ]
    return (engine.time, engine.up, engine.seed, engine.energy(), engine.momentum(), objects, laws, containers)


@pytest.mark.parametrize("when", [0.0, 0.25, 0.33, 1.0])
def test_all_there_is_comes_back(when: float) -> None:
    engine = scene()
    if when:
        engine.run(until=when)
    assert everything(revived(engine.checkpoint())) == everything(engine)


def test_it_goes_on_as_the_original_and_makes_new_things_alike() -> None:
    engine = scene()
    engine.run(until=0.6)
    twin = revived(engine.checkpoint())
    for one in (engine, twin):
        one.post("go")
        force = one.object("ball 2").add_force((1.0, 0.0, 0.0))
        assert isinstance(force.id, int)
        one.add_object(
            xp.PhysicalObject(xp.Sphere(0.1), position=(3, 0, 2)), laws=[one.law("down"), one.law("collision:elastic")]
        )
        one.remove_object(one.object("ball 0"))
        one.run(until=2.0)
    assert everything(twin) == everything(engine)
    assert twin.object("ball 2").velocity[0] > 1.0


def test_a_post_on_its_way_arrives_after_restoring() -> None:
    engine = scene()
    engine.run(until=0.5)
    engine.post("go")
    twin = revived(engine.checkpoint())
    engine.run(until=1.0)
    twin.run(until=1.0)
    assert twin.object("ball 1").velocity == engine.object("ball 1").velocity
    assert engine.object("ball 1").velocity[0] == 1.0


def test_what_fired_once_stays_spent() -> None:
    def build() -> xp.PhysicsEngine:
        engine = xp.PhysicsEngine()
        law = engine.add_law(Nudge(), container=xp.LawContainer(xp.when.Elapsed(0.5)))
        engine.add_object(xp.PhysicalObject(), laws=[law])
        engine.run(until=0.7)
        return engine

    twin = xp.PhysicsEngine.restore(build().checkpoint(), laws=[Nudge])
    twin.run(until=3.0)
    assert twin.objects[0].velocity == (1.0, 0.0, 0.0)


def test_the_grid_of_host_steps_goes_on() -> None:
    class Steady(Nudge):
        condition = xp.when.Steps(2)

    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(Steady())])
    engine.run(until=0.55, dt=0.1)
    twin = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Steady])
    engine.run(until=2.05, dt=0.1)
    twin.run(until=2.05, dt=0.1)
    assert twin.objects[0].velocity == engine.objects[0].velocity == (7.0, 0.0, 0.0)  # at 0, 0.3, ..., 1.8
    assert twin.objects[0].position == engine.objects[0].position


def test_a_ball_at_rest_and_one_that_is_about_to_come_to_rest_go_on() -> None:
    engine = xp.PhysicsEngine(up="z")
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("collision:elastic", restitution=0.5)]
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=laws[1:])
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 1.1)), laws=laws)
    rest = (2.0 / 9.81) ** 0.5 * 3.0
    for when in (rest - 1e-9, rest - 1e-10, rest - 3e-11, rest - 1e-12, rest + 1e-9, rest + 1.0):
        engine.run(until=when)
        twin = xp.PhysicsEngine.restore(engine.checkpoint())
        twin.run(until=rest + 10.0)
        assert twin.objects[1].position == (0.0, 0.0, 0.1)
        assert twin.objects[1].velocity == (0.0, 0.0, 0.0)
        twin.objects[1].velocity = (0.0, 0.0, 1.0)
        twin.run(until=rest + 10.05)
        assert twin.objects[1].velocity[2] == pytest.approx(1.0 - 9.81 * 0.05, abs=1e-14)
    assert ball.velocity == (0.0, 0.0, 0.0)


def test_the_same_state_gives_the_same_bytes() -> None:
    one, other = scene(), scene()
    for engine in (one, other):
        engine.run(until=0.7)
    assert one.checkpoint() == one.checkpoint() == other.checkpoint()
    assert revived(one.checkpoint()).checkpoint() == one.checkpoint()


def test_taking_one_changes_nothing() -> None:
    one, other = scene(), scene()
    for k in range(20):
        one.run(until=0.1 * k)
        one.checkpoint()
    one.run(until=2.0)
    other.run(until=2.0)
    assert everything(one) == everything(other)


# Files


def test_a_file_is_written_aside_and_renamed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "state"
    engine = scene()
    assert path.write_bytes(b"old")
    seen = []
    replace = os.replace

    def look(source: Any, target: Any) -> None:
        seen.append(path.read_bytes())
        replace(source, target)

    monkeypatch.setattr(os, "replace", look)
    data = engine.checkpoint(path)
    assert seen == [b"old"]
    assert path.read_bytes() == data
    assert [p.name for p in tmp_path.iterdir()] == ["state"]
    assert everything(revived(path)) == everything(revived(str(path))) == everything(engine)


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "state"
    path.write_bytes(b"old")

    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises((RecordError, OSError)):
        scene().checkpoint(path)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["state"]


def test_what_is_no_checkpoint_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "other.npz"
    np.savez(other, x=np.zeros(3))
    for bad in (b"", b"xpheve", b"PK\x03\x04", other, tmp_path, tmp_path / "missing", other.read_bytes()):
        with pytest.raises(RecordError):
            xp.PhysicsEngine.restore(bad)


def test_nothing_in_a_checkpoint_is_executed() -> None:
    """Arrays of objects (pickles) are refused, and so is an unknown condition or shape."""
    header, arrays = unpack(scene().checkpoint())
    arrays["bodies.mass"] = np.array([[print] * 7], dtype=object)
    with pytest.raises((XpheveError, ValueError)):
        pack((header, arrays))


def test_a_torn_checkpoint_is_refused(tmp_path: Path) -> None:
    data = scene().checkpoint()
    for length in range(0, len(data), max(1, len(data) // 97)):
        with pytest.raises(RecordError):
            xp.PhysicsEngine.restore(data[:length])


def test_a_newer_version_is_refused_by_name() -> None:
    header, arrays = unpack(scene().checkpoint())
    header["version"] += 1
    with pytest.raises(RecordError, match="version"):
        revived(pack((header, arrays)))


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.too_slow])
@example(place=0.00390625, bit=0)  # NumPy's own reader of headers stumbles
@given(place=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7))
@example(place=0.9680664454884426, bit=0)  # a method of compression that is none
def test_a_flipped_bit_is_an_error_or_no_matter(place: float, bit: int) -> None:
    """Zip archives carry checksums: what is damaged is found."""
    data = bytearray(DATA)
    data[int(place * len(data))] ^= 1 << bit
    try:
        engine = revived(bytes(data))
    except XpheveError:
        return
    assert everything(engine) == WHOLE  # the flip was in a date, or such


def _data() -> tuple[bytes, Any]:
    engine = scene()
    engine.run(until=0.3)
    return engine.checkpoint(), everything(engine)


DATA, WHOLE = _data()

broken = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 5) | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=3,
)


def places(value: Any, path: tuple[Any, ...] = ()) -> Any:
    """Every path into nested lists and dictionaries."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inner:
        yield (*path, key)
        yield from places(one, (*path, key))


@settings(deadline=None, max_examples=200, report_multiple_bugs=False, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_nonsense_in_a_header_is_a_clear_error(data: st.DataObject) -> None:
    """Whatever stands where: restored, or an error of ours that says what; never another one, never half an engine."""
    header, arrays = unpack(DATA)
    all_places = sorted(places(header), key=repr)
    path = data.draw(st.sampled_from(all_places))
    holder: Any = header
    for key in path[:-1]:
        holder = holder[key]
    if data.draw(st.booleans()) and isinstance(holder, dict):
        del holder[path[-1]]
    else:
        holder[path[-1]] = data.draw(broken)
    json.dumps(header)
    try:
        engine = revived(pack((header, arrays)))
    except XpheveError as wrong:
        assert str(wrong)
    else:
        assert len(engine.objects) == engine.bodies.position.shape[0] == len(header["objects"])


@pytest.mark.parametrize("time", [[0.3, None], [None, 0.0], [0.3], "now", {"base": 0.3}])
def test_a_time_that_is_no_instant_is_a_damaged_checkpoint(time: Any) -> None:
    header, arrays = unpack(DATA)
    header["time"] = time
    with pytest.raises(RecordError):
        revived(pack((header, arrays)))


def test_a_class_that_is_not_at_hand_is_named() -> None:
    data = scene().checkpoint()
    with pytest.raises(UnknownLawError, match=r"Pulse.*laws=\[Pulse\]"):
        xp.PhysicsEngine.restore(data, laws=[Nudge], containers=[Holder, Counting])
    with pytest.raises(UnknownLawError, match=r"Holder.*containers=\[Holder\]"):
        xp.PhysicsEngine.restore(data, laws=[Pulse, Nudge], containers=[Counting])


def test_what_cannot_be_written_is_named() -> None:
    engine = scene()
    engine.run(until=0.1)
    engine.post("go", data=object())
    with pytest.raises(RecordError, match="plain values"):
        engine.checkpoint()
    engine.run(until=1.0)  # delivered, and gone
    engine.checkpoint()


def test_a_restored_engine_is_in_nobodys_way() -> None:
    """Its objects are its own; the original goes on."""
    engine = scene()
    engine.run(until=0.5)
    before = everything(engine)
    twin = revived(engine.checkpoint())
    twin.run(until=5.0)
    twin.remove_object(twin.objects[0])
    twin.law("down").acceleration = 1.0
    assert everything(engine) == before
    assert not set(engine.objects) & set(twin.objects)
    assert all(obj.engine is twin for obj in twin.objects)


def test_a_checkpoint_in_the_midst_of_an_instant_is_refused() -> None:
    """An engine in the middle of an instant has no state to save."""

    class Saver(xp.PhysicalLaw):
        condition = xp.when.Elapsed(0.5)

        def enforce_this_law(self, event: Any) -> None:
            self.engine.checkpoint()  # type: ignore[union-attr]

    engine = xp.PhysicsEngine()
    engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(Saver())])
    with pytest.raises(XpheveError):
        engine.run(until=1.0)
