"""A machine of random live edits: whatever is changed in a running scene, what an engine promises still holds."""

from __future__ import annotations

import math
from typing import Any

import hypothesis.strategies as st
from hypothesis import HealthCheck, given, settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import xpheve as xp
from xpheve.errors import ConflictError
from xpheve.scene import dumps, loads

numbers = st.integers(-8, 8).map(lambda k: k / 4)
vectors = st.tuples(numbers, numbers, numbers)
spans = st.sampled_from([0.125, 0.1, 1 / 3, 0.75])


class Pull(xp.FieldLaw):
    """A constant pull without a potential, so that its work is booked."""

    strength = xp.Param(1.0, unit="N", doc="how strong")

    def force(self, body: Any) -> Any:
        """Along x."""
        return (self.strength, 0.0, 0.0)


def bits(engine: xp.PhysicsEngine) -> tuple[Any, ...]:
    """All that can be read of ``engine``, to the bit, by serial number."""
    found = []
    for obj in sorted(engine.objects, key=lambda one: one.serial):
        state = [obj.position, obj.velocity, obj.orientation, obj.angular_velocity, obj.inertia, (obj.mass,)]
        forces = sorted((str(f.id), f.vector, f.duration) for f in obj.forces)
        laws = sorted(law.name for law in obj.laws)
        found.append(
            (obj.serial, obj.name, [[x.hex() for x in one] for one in state], forces, laws, obj.driven, repr(obj.shape))
        )
    laws = sorted((law.name, law.enabled, repr(law.parameters)) for law in engine.laws)
    return engine.time, found, laws


def saved(engine: xp.PhysicsEngine) -> list[Any]:
    """What a scene file keeps of each object, by name."""
    found = []
    for obj in sorted(engine.objects, key=lambda one: one.name):
        state = [obj.position, obj.velocity, obj.orientation, obj.angular_velocity, obj.inertia, (obj.mass,)]
        forces = [(one.vector, one.duration.hex(), one.id) for one in engine.user_forces(obj)]
        laws = sorted((law.name, law.enabled, repr(law.parameters)) for law in obj.laws)
        found.append(
            (
                obj.name,
                [[x.hex() for x in one] for one in state],
                forces,
                laws,
                obj.driven,
                obj._density,
                repr(obj.shape),
            )
        )
    return found


class LiveEdits(RuleBasedStateMachine):
    """Closed-form scenes (constant laws, no contacts), so that the balance of energy holds to rounding."""

    @initialize()
    def begin(self) -> None:
        self.engine = xp.PhysicsEngine(up="z")
        self.count = 0
        self.forces: dict[str, list[tuple[Any, tuple[float, ...], float]]] = {}
        self.drift = 0.0
        self.scale = 1.0
        self.add_law(True)
        self.add_object((0, 0, 0), (1, 0, 0))

    def pick(self, data: Any, what: Any) -> Any:
        return data.draw(st.sampled_from(sorted(what, key=lambda one: one.name)))

    def edited(self, act: Any) -> Any:
        """Do ``act`` and count the jump of the balance as ours: who sets a velocity or a mass brings energy in."""
        before = self.engine.energy().balance
        result = act()
        self.drift += self.engine.energy().balance - before
        return result

    # Edits

    @rule(planet=st.booleans())
    def add_law(self, planet: bool) -> None:
        if len(self.engine.laws) < 4:
            self.count += 1
            law = "basic:planet_gravity" if planet else Pull
            self.engine.add_law(law, name=f"law{self.count}")

    @rule(position=vectors, velocity=vectors)
    def add_object(self, position: Any, velocity: Any) -> None:
        if len(self.engine.objects) < 5:
            self.count += 1
            obj = xp.PhysicalObject(
                xp.Box((1, 2, 3)),
                density=0.5,
                position=position,
                velocity=velocity,
                angular_velocity=velocity,
                name=f"obj{self.count}",
            )
            self.edited(lambda: self.engine.add_object(obj, self.engine.laws[:1]))
            self.forces[obj.name] = []

    @precondition(lambda self: len(self.engine.objects) > 1)
    @rule(data=st.data())
    def remove_object(self, data: Any) -> None:
        obj = self.pick(data, self.engine.objects)
        self.edited(lambda: self.engine.remove_object(obj))
        assert obj.engine is None and not obj.driven
        del self.forces[obj.name]

    @precondition(lambda self: len(self.engine.laws) > 1)
    @rule(data=st.data())
    def remove_law(self, data: Any) -> None:
        law = self.pick(data, self.engine.laws)
        self.edited(lambda: self.engine.remove_law(law))

    @rule(data=st.data())
    def map_or_unmap(self, data: Any) -> None:
        obj, law = self.pick(data, self.engine.objects), self.pick(data, self.engine.laws)
        self.edited(lambda: (self.engine.unmap if law in obj.laws else self.engine.map)(obj, law))

    @rule(data=st.data())
    def switch(self, data: Any) -> None:
        law = self.pick(data, self.engine.laws)
        self.edited(lambda: setattr(law, "enabled", not law.enabled))

    @rule(data=st.data(), value=st.integers(1, 20))
    def set_parameter(self, data: Any, value: int) -> None:
        law = self.pick(data, self.engine.laws)
        name = "strength" if isinstance(law, Pull) else "acceleration"
        self.edited(lambda: setattr(law, name, value / 4))

    @rule(data=st.data(), value=st.integers(1, 20))
    def set_mass(self, data: Any, value: int) -> None:
        self.edited(lambda: setattr(self.pick(data, self.engine.objects), "mass", value / 4))

    @rule(data=st.data(), size=st.integers(1, 4))
    def set_shape(self, data: Any, size: int) -> None:
        obj = self.pick(data, self.engine.objects)
        shape = xp.Box((size, 1, 2)) if size % 2 else xp.Sphere(size / 4)
        self.edited(lambda: setattr(obj, "shape", shape))
        if obj._density is not None:
            assert obj.mass == obj._density * shape.volume
        assert obj.shape is shape

    @rule(data=st.data(), vector=vectors, duration=st.sampled_from([0.125, 0.3, 2.0, math.inf]))
    def add_force(self, data: Any, vector: Any, duration: float) -> None:
        obj = self.pick(data, self.engine.objects)
        force = obj.add_force(vector, duration)
        assert all(one[0] != force.id for held in self.forces.values() for one in held), "ids are not given twice"
        self.forces[obj.name].append((force.id, force.vector, self.engine.time + duration))

    @rule(data=st.data())
    def remove_force(self, data: Any) -> None:
        obj = self.pick(data, self.engine.objects)
        live = [one for one in self.forces[obj.name] if one[2] > self.engine.time]
        if live:
            assert obj.remove_force(live[0][0]) == 1
            self.forces[obj.name].remove(live[0])
        assert obj.remove_force("never given") == 0

    @rule(data=st.data(), how=st.integers(0, 3), vector=vectors, within=spans)
    def hand(self, data: Any, how: int, vector: Any, within: float) -> None:
        obj = self.pick(data, self.engine.objects)
        if how == 3 and not obj.driven:
            return
        act = (
            obj.hold,
            lambda: obj.carry(vector, (0.6, 0, 0, 0.8), within=within),
            lambda: obj.drive(vector),
            lambda: obj.release(),
        )[how]
        if obj.rank < 0:
            self.edited(act)
        else:
            act()  # its work is booked

    # Time, and going back

    @rule(span=spans, look=st.booleans())
    def run(self, span: float, look: bool) -> None:
        self.engine.run(until=self.engine.time + span, every=span / 3 if look else None)

    @rule(span=spans)
    def restored_and_copied_engines_go_on_to_the_same_bits(self, span: float) -> None:
        others = [self.engine.copy(), xp.PhysicsEngine.restore(self.engine.checkpoint(), laws=[Pull])]
        for one in (self.engine, *others):
            one.run(until=one.time + span)
        assert bits(others[0]) == bits(others[1]) == bits(self.engine)

    @precondition(lambda self: not any(isinstance(law, Pull) for law in self.engine.laws))
    @rule(form=st.sampled_from(["toml", "json"]), span=spans)
    def a_scene_file_gives_the_same_bits_of_state(self, form: str, span: float) -> None:
        engine, text = self.engine, dumps(self.engine, form)
        twin = loads(text, form)
        again = loads(dumps(twin, form), form)
        assert saved(twin) == saved(again) == saved(engine)
        for one in (twin, again):
            one.run(until=span)
        assert saved(twin) == saved(again)
        assert twin.new_force_id() > max((one[0] for held in self.forces.values() for one in held), default=0)

    @rule()
    def reset_goes_back_to_what_was_first_started(self) -> None:
        twin = self.engine.copy()
        if twin._authored is None:
            return
        twin.reset()
        first = bits(twin)
        assert twin.time == 0.0
        twin.run(until=0.5)
        for obj in twin.objects:
            obj.shape = xp.Sphere(0.5)
            obj.hold()
        for law in twin.laws:
            law.enabled = False
        twin.run(until=0.75)
        twin.reset()
        assert bits(twin) == first

    # What always holds

    @invariant()
    def one_stored_force_for_each_constant_law_and_object_and_the_users_stay(self) -> None:
        engine = self.engine
        if engine._world.dirty:
            return
        for obj in engine.objects:
            held = engine._world.forces.on(obj)
            for law in engine.laws:
                mine = [one for one in held if one.owner is law]
                assert len(mine) == (1 if law.enabled and law in obj.laws else 0), (obj, law)
            users = sorted((one.force.id, one.force.vector) for one in held if one.owner is None)
            assert users == sorted((one[0], one[1]) for one in self.forces[obj.name] if one[2] > engine.time)

    @invariant()
    def the_balance_of_energy_holds(self) -> None:
        energy = self.engine.energy()
        self.scale = max(self.scale, *map(abs, energy), abs(self.drift))
        assert abs(energy.balance - self.drift) <= 1e-9 * self.scale

    @invariant()
    def looking_never_fails_and_changes_nothing(self) -> None:
        before = bits(self.engine)
        str(self.engine.explain())
        self.engine.frame()
        assert bits(self.engine) == before


LiveEdits.TestCase.settings = settings(
    max_examples=25, stateful_step_count=14, deadline=None, suppress_health_check=list(HealthCheck)
)
TestLiveEdits = LiveEdits.TestCase


def test_the_order_of_edits_that_do_not_meet_does_not_matter() -> None:
    """Objects, laws and mappings in either order, some held, give the same bits at the same names."""
    ends = []
    for order in (1, -1):
        engine = xp.PhysicsEngine(up="z")
        gravity = engine.add_law("basic:planet_gravity", name="g")
        spring = engine.add_law("basic:spring", name="s", stiffness=3.0)
        for k in list(range(6))[::order]:
            engine.add_object(xp.PhysicalObject(position=(k, k * k, 1), name=f"o{k}"))
        for k in list(range(6))[::order]:
            for law in (gravity, spring)[::order]:
                engine.map(engine.object(f"o{k}"), law)
        for k in [1, 4][::order]:
            engine.object(f"o{k}").carry((0, 0, k), within=0.3)
        engine.run(until=0.5, dt=0.01)
        ends.append({obj.name: (obj.position, obj.velocity) for obj in engine.objects})
    assert ends[0] == ends[1]


def test_exclusive_laws_of_one_pair_are_refused_with_the_ways_out() -> None:
    engine = xp.PhysicsEngine()
    soft = engine.add_law("collision:elastic", restitution=0.1, name="soft")
    hard = engine.add_law("collision:elastic", restitution=0.9, name="hard")
    ball = engine.add_object(xp.PhysicalObject(xp.Sphere(1)), laws=[soft])
    try:
        engine.map(ball, hard)
    except ConflictError as error:
        text = str(error)
    for word in ("soft", "hard", "contact-response", "only one", "enabled = False", "unmap"):
        assert word in text
    soft.enabled = False
    engine.map(ball, hard)


finite = st.floats(allow_nan=False, allow_infinity=False, width=64)
names = st.text(st.characters(exclude_categories=["Cs"]), max_size=12).filter(lambda text: not text.startswith("#"))


@settings(deadline=None, max_examples=60)
@given(
    position=st.tuples(finite, finite, finite),
    name=names,
    ident=names | st.integers(0, 2**62),
    duration=st.floats(min_value=5e-324, max_value=1e308),
    form=st.sampled_from(["toml", "json"]),
)
def test_floats_names_and_ids_go_through_a_file_to_the_bit(
    position: Any, name: str, ident: Any, duration: float, form: str
) -> None:
    engine = xp.PhysicsEngine()
    obj = engine.add_object(xp.PhysicalObject(position=position, velocity=(5e-324, 1e308, -0.0), name=name))
    obj.add_force((1e-308, 5e-324, 0), duration, ident)
    twin = loads(dumps(engine, form), form).objects[0]
    assert [x.hex() for x in (*twin.position, *twin.velocity)] == [x.hex() for x in (*obj.position, *obj.velocity)]
    assert twin.name == name and twin.forces[0].id == ident and twin.forces[0].duration.hex() == duration.hex()
