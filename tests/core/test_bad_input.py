"""What cannot be is refused with one clear error, and nothing has changed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import (
    ConflictError,
    InvalidValueError,
    LawDefinitionError,
    NotAcceptedError,
    OrderError,
    OwnershipError,
    ParameterError,
    RecordError,
    StaleHandleError,
    StateError,
    UnknownLawError,
    XpheveError,
)

NAN, INF = math.nan, math.inf


@contextmanager
def refused(engine: xp.PhysicsEngine, error: type[Exception], match: str | None = None) -> Iterator[None]:
    """Expect ``error``, of xPheve's own, and the engine as before to the bit."""
    before, bodies = engine.checkpoint(), engine.bodies.position.copy()
    with pytest.raises(error, match=match) as caught:
        yield
    assert isinstance(caught.value, XpheveError)
    assert engine.checkpoint() == before
    assert np.array_equal(engine.bodies.position, bodies)


class Free(xp.PhysicalLaw):
    """Do nothing."""

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


class Heavy(xp.FieldLaw):
    """Pull down."""

    pull = xp.Param(1.0, unit="m/s^2", gt=0, doc="How much.")
    columns = {"charge": xp.Column(0.0, unit="C", le=5.0)}  # noqa: RUF012

    def force(self, body: Any) -> Any:
        """Weight."""
        return (0.0, -1.0, 0.0) * body.mass * self.pull


@pytest.fixture(params=["fresh", "moving"])
def engine(request: pytest.FixtureRequest) -> xp.PhysicsEngine:
    """Return an engine with a law, a container and two objects; once as put together, once in the midst of its motion."""
    made = xp.PhysicsEngine()
    law = made.add_law(Heavy(name="heavy"))
    made.add_law(Free(name="free"), container=xp.LawContainer(xp.when.Elapsed(1.0, every=True), name="clock"))
    made.add_object(xp.PhysicalObject(xp.Sphere(0.5), name="ball", velocity=(1, 2, 3)), laws=[law])
    made.add_object(xp.PhysicalObject(name="point", position=(9, 9, 9)))
    if request.param == "moving":
        made.object("ball").add_force((1, 0, 0), 5.0)
        made.run(until=2.5)
    return made


# Values


@pytest.mark.parametrize("bad", [NAN, INF, -INF], ids=str)
@pytest.mark.parametrize("name", ["position", "velocity", "orientation", "angular_velocity", "inertia"])
def test_a_property_that_is_not_finite_is_refused_before_and_after_adding(
    engine: xp.PhysicsEngine, name: str, bad: float
) -> None:
    value = [1.0] * (4 if name == "orientation" else 3)
    value[1] = bad
    with pytest.raises(InvalidValueError, match=name):
        xp.PhysicalObject(**{name: tuple(value)})
    with refused(engine, InvalidValueError, name):
        setattr(engine.object("ball"), name, tuple(value))


@pytest.mark.parametrize("bad", [NAN, INF, -INF, -1.0, 0.0, -0.0, "heavy", None, (1, 2), 1j], ids=str)
def test_a_mass_that_cannot_be_is_refused(engine: xp.PhysicsEngine, bad: Any) -> None:
    if bad is not None:
        with pytest.raises(InvalidValueError, match="mass"):
            xp.PhysicalObject(mass=bad)
    with refused(engine, InvalidValueError, "mass"):
        engine.object("ball").mass = bad


@pytest.mark.parametrize("name", ["position", "velocity", "angular_velocity", "inertia", "orientation"])
@pytest.mark.parametrize(
    "bad", [(1, 2), (1, 2, 3, 4, 5), (), "abc", None, ((1, 2, 3),), ("a", "b", "c"), 1j, (1j, 0, 0)], ids=str
)
def test_a_vector_of_the_wrong_shape_is_refused(engine: xp.PhysicsEngine, name: str, bad: Any) -> None:
    if not (bad is None and name == "inertia"):
        with pytest.raises(InvalidValueError, match=name):
            xp.PhysicalObject(**{name: bad})
    with refused(engine, InvalidValueError, name):
        setattr(engine.object("ball"), name, bad)


def test_a_zero_quaternion_turns_nothing(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "orientation"):
        engine.object("ball").orientation = (0, 0, 0, 0)


@pytest.mark.parametrize("bad", [(1, 1, 2.1), (3, 1, 1), (0, 1, 1), (-1, 1, 1), -1.0, NAN], ids=str)
def test_no_body_has_such_inertia(engine: xp.PhysicsEngine, bad: Any) -> None:
    with pytest.raises(InvalidValueError, match="inertia"):
        xp.PhysicalObject(inertia=bad)
    with refused(engine, InvalidValueError, "inertia"):
        engine.object("ball").inertia = bad


def test_the_flattest_inertia_is_taken() -> None:
    assert xp.PhysicalObject(inertia=(1, 1, 2)).inertia == (1, 1, 2)


@pytest.mark.parametrize(
    "make",
    [
        lambda: xp.Sphere(0),
        lambda: xp.Sphere(-1),
        lambda: xp.Sphere(NAN),
        lambda: xp.Sphere(INF),
        lambda: xp.Sphere("wide"),
        lambda: xp.Box((1, 2)),
        lambda: xp.Box((1, 2, 0)),
        lambda: xp.Box((1, NAN, 1)),
        lambda: xp.Box(1.0),
        lambda: xp.Box(None),
        lambda: xp.Capsule(0, 1),
        lambda: xp.Capsule(1, -1),
        lambda: xp.Capsule(1, NAN),
        lambda: xp.Plane((0, 0, 0)),
        lambda: xp.Plane((0, NAN, 1)),
        lambda: xp.Plane((0, INF, 1)),
        lambda: xp.Plane((0, 1)),
        lambda: xp.Plane(3.0),
        lambda: xp.Plane("up!"),
        lambda: xp.Plane(offset=NAN),
        lambda: xp.Plane(offset="high"),
    ],
)
def test_a_shape_that_cannot_be_is_refused(make: Callable[[], Any]) -> None:
    with pytest.raises(InvalidValueError):
        make()


def test_what_an_object_cannot_be() -> None:
    with pytest.raises(InvalidValueError, match="fixed"):
        xp.PhysicalObject(xp.Plane())
    with pytest.raises(InvalidValueError, match="fixed"):
        xp.PhysicalObject(fixed=True, velocity=(1, 0, 0))
    with pytest.raises(InvalidValueError, match="fixed"):
        xp.PhysicalObject(fixed=True, angular_velocity=(0, 0, 1))
    with pytest.raises(InvalidValueError, match="density"):
        xp.PhysicalObject(density=1000.0)
    with pytest.raises(InvalidValueError, match="density"):
        xp.PhysicalObject(xp.Plane(), density=1000.0, fixed=True)
    with pytest.raises(InvalidValueError, match="give one"):
        xp.PhysicalObject(xp.Sphere(1), density=1000.0, mass=1.0)
    for bad in (NAN, -1.0, 0.0, INF):
        with pytest.raises(InvalidValueError, match="density"):
            xp.PhysicalObject(xp.Sphere(1), density=bad)
    with pytest.raises(InvalidValueError, match="shape"):
        xp.PhysicalObject(3.0)  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="name"):
        xp.PhysicalObject(name=7)  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="velocity"):
        xp.PhysicalObject(velocty=(1, 0, 0))  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="charge"):
        xp.PhysicalObject(charge=NAN)


def test_a_density_is_a_number() -> None:
    with pytest.raises(InvalidValueError, match="density"):
        xp.PhysicalObject(xp.Sphere(1), density="thick")  # type: ignore[arg-type]


def test_what_is_fixed_stays_fixed() -> None:
    engine = xp.PhysicsEngine()
    wall = engine.add_object(xp.PhysicalObject(fixed=True))
    for name in ("velocity", "angular_velocity"):
        with refused(engine, InvalidValueError, "fixed"):
            setattr(wall, name, (1, 0, 0))
    wall.velocity = (0, 0, 0)
    wall.add_force((100, 0, 0))
    engine.run(until=1.0)
    assert wall.position == (0, 0, 0) and wall.velocity == (0, 0, 0)


# Forces


@pytest.mark.parametrize("bad", [-1.0, -1e-300, NAN, -INF, "long", None, 1j], ids=str)
def test_a_duration_that_cannot_be_names_inf(engine: xp.PhysicsEngine, bad: Any) -> None:
    with pytest.raises(InvalidValueError, match="duration"):
        xp.Force((1, 0, 0), bad)
    with refused(engine, InvalidValueError, "duration"):
        engine.object("ball").add_force((1, 0, 0), bad)
    if isinstance(bad, float):
        with pytest.raises(InvalidValueError, match=r"math\.inf"):
            xp.Force((1, 0, 0), bad)


@pytest.mark.parametrize("bad", [(1, NAN, 0), (INF, 0, 0), (1, 2), "abc", None, 5.0], ids=str)
def test_a_force_that_is_no_vector(engine: xp.PhysicsEngine, bad: Any) -> None:
    with refused(engine, InvalidValueError, "vector"):
        engine.object("ball").add_force(bad)
    with pytest.raises(InvalidValueError, match="torque"):
        xp.Force(torque=bad)


def test_a_force_id_is_a_number_or_a_text(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "id"):
        engine.object("ball").add_force((1, 0, 0), id=1.5)  # type: ignore[arg-type]


def test_a_torque_turns_no_point(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "inertia"):
        engine.object("point").add_force(xp.Force(torque=(0, 0, 1)))


def test_forces_need_an_engine() -> None:
    with pytest.raises(OwnershipError, match="no engine"):
        xp.PhysicalObject().add_force((1, 0, 0))
    with pytest.raises(OwnershipError, match="no engine"):
        xp.PhysicalObject().remove_force(1)


def test_inertia_is_not_taken_away_under_a_torque(engine: xp.PhysicsEngine) -> None:
    ball = engine.object("ball")
    ball.add_force(xp.Force(torque=(0, 0, 1), duration=100.0))
    with refused(engine, InvalidValueError, "inertia"):
        ball.inertia = (0, 0, 0)


def test_sums_that_overflow_are_refused(engine: xp.PhysicsEngine) -> None:
    ball = engine.object("ball")
    ball.add_force((1.7e308, 0, 0))
    with refused(engine, InvalidValueError):
        ball.add_force((1.7e308, 0, 0))


# Whose is it


def test_an_object_is_in_one_engine_once(engine: xp.PhysicsEngine) -> None:
    other = xp.PhysicsEngine()
    foreign = other.add_object(xp.PhysicalObject())
    fresh = xp.PhysicalObject()
    with refused(engine, OwnershipError, "another engine"):
        engine.add_object(foreign)
    with refused(engine, OwnershipError, "this engine"):
        engine.add_object(engine.object("ball"))
    with refused(engine, OwnershipError, "twice"):
        engine.add_objects([fresh, fresh])
    with refused(engine, OwnershipError, "another engine"):
        engine.add_objects([fresh, foreign])
    assert fresh.engine is None and foreign.engine is other
    for call in (engine.remove_object, lambda obj: engine.map(obj, "heavy"), lambda obj: engine.unmap(obj, "heavy")):
        with refused(engine, OwnershipError, "not in this engine"):
            call(foreign)
        with refused(engine, OwnershipError, "not in this engine"):
            call(fresh)
    with refused(engine, OwnershipError):
        engine.add_force(foreign, xp.Force((1, 0, 0)))


@pytest.mark.parametrize("bad", [None, 3, "ball", xp.PhysicalObject], ids=str)
def test_what_is_no_object_is_not_added(engine: xp.PhysicsEngine, bad: Any) -> None:
    with refused(engine, InvalidValueError, "no PhysicalObject"):
        engine.add_objects([xp.PhysicalObject(), bad])
    with refused(engine, OwnershipError):
        engine.remove_object(bad)
    with refused(engine, OwnershipError):
        engine.map(bad, "heavy")


def test_names_are_unique(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "'ball'"):
        engine.add_object(xp.PhysicalObject(name="ball"))
    with refused(engine, InvalidValueError, "'twin'"):
        engine.add_objects([xp.PhysicalObject(name="twin"), xp.PhysicalObject(name="twin")])
    with refused(engine, InvalidValueError, "'heavy'"):
        engine.add_law(Heavy(name="heavy"))
    with refused(engine, InvalidValueError, "'bal'.*ball"):
        engine.object("bal")


def test_names_of_containers_are_unique(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "clock"):
        engine.add_container(xp.LawContainer(xp.when.Started(), name="clock"))


def test_a_name_set_later_is_unique_too(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "'ball'"):
        engine.object("point").name = "ball"


def test_a_stale_handle_is_refused(engine: xp.PhysicsEngine) -> None:
    """Forged on purpose: a handle that says it stands for another's row."""
    ball, point = engine.object("ball"), engine.object("point")
    point._row = ball._row
    for look in ("position", "velocity", "mass", "forces", "laws"):
        with pytest.raises(StaleHandleError, match=r"engine\.objects"):
            getattr(point, look)
    with pytest.raises(StaleHandleError):
        point.velocity = (9, 9, 9)
    with pytest.raises(StaleHandleError):
        point.add_force((9, 9, 9))
    assert ball.velocity != (9, 9, 9)


def test_a_removed_handle_writes_to_nobody(engine: xp.PhysicsEngine) -> None:
    ball, point = engine.object("ball"), engine.object("point")
    engine.remove_object(ball)
    before = engine.checkpoint()
    ball.velocity = (7, 7, 7)
    assert engine.checkpoint() == before
    assert point.velocity == (0, 0, 0) and ball.velocity == (7, 7, 7)
    with pytest.raises(OwnershipError):
        ball.add_force((1, 0, 0))
    with refused(engine, OwnershipError):
        engine.remove_object(ball)


def test_laws_and_containers_belong_to_one_engine(engine: xp.PhysicsEngine) -> None:
    other = xp.PhysicsEngine()
    law = other.add_law(Heavy())
    holder = other.add_container(xp.LawContainer(xp.when.Started()))
    with refused(engine, OwnershipError, "another engine"):
        engine.add_law(law)
    with refused(engine, OwnershipError, "this engine"):
        engine.add_law(engine.law("heavy"))
    with refused(engine, OwnershipError, "another engine"):
        engine.add_law(Free(), container=holder)
    with refused(engine, OwnershipError, "another engine"):
        engine.add_container(holder)
    with refused(engine, OwnershipError):
        engine.add_object(xp.PhysicalObject(), laws=[law])
    with refused(engine, OwnershipError):
        engine.map(engine.object("point"), law)
    with refused(engine, OwnershipError):
        engine.unmap(engine.object("point"), law)
    with refused(engine, OwnershipError):
        engine.remove_law(law)
    with refused(engine, OwnershipError):
        engine.remove_container(holder)
    with refused(engine, OwnershipError):
        engine.add_object(xp.PhysicalObject(), laws=[Heavy()])
    assert law.engine is other and holder.engine is other and not holder.laws


def test_a_law_of_another_engine_does_not_slip_in_through_a_container(engine: xp.PhysicsEngine) -> None:
    other = xp.PhysicsEngine()
    law = other.add_law(Free(), container=xp.LawContainer(xp.when.Started()))
    held = xp.LawContainer(xp.when.Started(), name="smuggler")
    held.add_law(law)
    with refused(engine, OwnershipError, "another engine"):
        engine.add_container(held)
    clock = next(c for c in engine.containers if c.name == "clock")
    with refused(engine, OwnershipError, "another engine"):
        clock.add_law(law)


def test_a_law_put_into_a_live_container_is_in_the_engine(engine: xp.PhysicsEngine) -> None:
    clock = next(c for c in engine.containers if c.name == "clock")
    law = Free(name="late")
    try:
        clock.add_law(law)
    except XpheveError:
        assert law not in clock.laws and not law.containers
    else:
        assert law.engine is engine and law in engine.laws
        engine.run(until=engine.time + 2.0)
        assert law.evaluations == 2


def test_unknown_laws_and_parameters(engine: xp.PhysicsEngine) -> None:
    with refused(engine, UnknownLawError, "basic:planet_gravity"):
        engine.add_law("basic:planet_gravty")
    with refused(engine, UnknownLawError, "ocean"):
        engine.add_law("ocean:buoyancy")
    with refused(engine, UnknownLawError):
        engine.add_law("nonsense")
    with refused(engine, UnknownLawError):
        engine.add_law("")
    with refused(engine, UnknownLawError, "at hand: heavy, free"):
        engine.law("wind")
    with refused(engine, UnknownLawError):
        engine.add_object(xp.PhysicalObject(), laws=["wind"])
    with refused(engine, UnknownLawError):
        engine.remove_law("wind")
    with refused(engine, UnknownLawError):
        engine.add_law(Free(), container="collision:exakt")
    with refused(engine, ParameterError, "did you mean|Did you mean"):
        engine.add_law("basic:planet_gravity", acceleraton=1.0)
    with refused(engine, InvalidValueError, "force"):
        engine.add_law("basic:planet_gravity", acceleration="9.81 N")
    for bad in (NAN, INF, -1.0, "fast", None, (1, 2), True):
        with refused(engine, InvalidValueError, "acceleration"):
            engine.add_law("basic:planet_gravity", acceleration=bad)
    heavy = engine.law("heavy")
    for bad in (NAN, 0.0, "3 kg", None, (1.0,)):
        with refused(engine, InvalidValueError, "pull"):
            heavy.pull = bad  # type: ignore[attr-defined]
    assert heavy.pull == 1.0  # type: ignore[attr-defined]


@pytest.mark.parametrize("bad", [None, 7, int, xp.PhysicalObject(), xp.LawContainer], ids=str)
def test_what_is_no_law_is_not_added(engine: xp.PhysicsEngine, bad: Any) -> None:
    with refused(engine, InvalidValueError, "no law"):
        engine.add_law(bad)


@pytest.mark.parametrize("bad", [7, int, xp.PhysicalObject()], ids=str)
def test_what_is_no_container_holds_nothing(engine: xp.PhysicsEngine, bad: Any) -> None:
    with refused(engine, XpheveError, "container"):
        engine.add_law(Free(), container=bad)
    with refused(engine, XpheveError, "container"):
        engine.add_container(bad)
    with refused(engine, XpheveError, "container"):
        engine.remove_container(bad)


def test_a_law_that_does_not_say_when(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "LawContainer"):
        engine.add_law(Free())
    with refused(engine, InvalidValueError, "condition"):
        engine.add_container(xp.LawContainer())
    with pytest.raises(InvalidValueError, match="condition"):
        xp.LawContainer("now")  # type: ignore[arg-type]


def test_a_made_law_takes_no_more_parameters(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "made already"):
        engine.add_law(Heavy(), pull=3.0)


def test_a_container_refuses_what_does_not_fit_its_role(engine: xp.PhysicsEngine) -> None:
    with refused(engine, NotAcceptedError, "role"):
        engine.add_law(Heavy(), container="collision:exact")
    only = type("Only", (xp.LawContainer,), {"accepts": xp.FieldLaw, "condition": xp.when.Started()})
    with refused(engine, NotAcceptedError, "FieldLaw"):
        engine.add_law(Free(), container=only)


def test_two_exclusive_laws_on_one_object(engine: xp.PhysicsEngine) -> None:
    first = engine.add_law("collision:elastic", name="first")
    second = engine.add_law("collision:elastic", name="second", restitution=0.5)
    ball = engine.object("ball")
    with refused(engine, ConflictError, "first.*second|second.*first"):
        engine.add_object(xp.PhysicalObject(xp.Sphere(1)), laws=[first, second])
    engine.map(ball, first)
    with refused(engine, ConflictError, "Map only one"):
        engine.map(ball, second)
    first.enabled = False
    engine.map(ball, second)
    with refused(engine, ConflictError):
        first.enabled = True
    assert not first.enabled


def test_between_names_objects_of_this_engine(engine: xp.PhysicsEngine) -> None:
    stranger = xp.PhysicalObject()
    with refused(engine, OwnershipError, "between"):
        engine.add_law("basic:spring", between=(engine.object("ball"), stranger))


def test_between_is_two_sides(engine: xp.PhysicsEngine) -> None:
    for bad in (engine.object("ball"), (engine.object("ball"),), (1, 2), "ab"):
        with refused(engine, XpheveError):
            engine.add_law("basic:spring", between=bad)


def test_law_classes_that_contradict_themselves(engine: xp.PhysicsEngine) -> None:
    with pytest.raises(LawDefinitionError, match="final"):
        type("Cheat", (xp.PhysicalLaw,), {"enforce": lambda self, event: None})
    with pytest.raises(LawDefinitionError):
        xp.Param("a", choices=("b", "c"))
    with refused(engine, LawDefinitionError):
        engine.add_law(xp.FieldLaw)
    with refused(engine, LawDefinitionError):
        engine.add_law(xp.PhysicalLaw, container=xp.LawContainer(xp.when.Started()))


def test_a_column_out_of_bounds_is_refused(engine: xp.PhysicsEngine) -> None:
    with refused(engine, InvalidValueError, "charge"):
        engine.object("ball")["charge"] = 6.0
    with refused(engine, InvalidValueError, "charge"):
        engine.object("ball")["charge"] = NAN
    with refused(engine, InvalidValueError, "charge"):
        engine.add_object(xp.PhysicalObject(charge=6.0), laws=["heavy"])
    free = engine.add_object(xp.PhysicalObject(charge=6.0))
    with refused(engine, InvalidValueError, "charge"):
        engine.map(free, "heavy")
    with refused(engine, InvalidValueError, "charg"):
        engine.object("ball")["charg"]
    with refused(engine, InvalidValueError, "at hand"):
        engine.bodies["charg"]


def test_arrays_of_bodies_are_read_only(engine: xp.PhysicsEngine) -> None:
    before = engine.checkpoint()
    for name in ("position", "velocity", "orientation", "angular_velocity", "mass", "inertia", "fixed"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(engine.bodies, name)[...] = 0
    with pytest.raises(ValueError, match="read-only"):
        engine.bodies["charge"][...] = 0
    assert engine.checkpoint() == before


def test_a_container_that_fails_when_told_changes_nothing(engine: xp.PhysicsEngine) -> None:
    def fail(self: Any, law: Any, what: str, obj: Any = None) -> None:
        raise RuntimeError("not me")

    law = engine.add_law(
        Free(), container=type("Deaf", (xp.LawContainer,), {"condition": xp.when.Started(), "law_changed": fail})
    )
    point = engine.object("point")
    with pytest.raises((RuntimeError, XpheveError)):
        engine.map(point, law)
    assert point.laws == ()


# Order


def test_a_ring_of_before_and_after_is_named_and_nothing_runs() -> None:
    class Egg(Free):
        before = ("Hen",)
        condition = xp.when.Started()

    class Hen(Free):
        before = ("Egg",)
        condition = xp.when.Started()

    engine = xp.PhysicsEngine()
    engine.add_law(Egg())
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
    with pytest.raises(OrderError, match=r"Egg -> Hen -> Egg|Hen -> Egg -> Hen"):
        engine.add_law(Hen())
        engine.run(until=1.0)
    assert ball.position == (0, 0, 0) and engine.time == 0.0 and engine.state == "ready"


def test_a_ring_can_be_got_out_of() -> None:
    one = type("One", (Free,), {"before": ("Two",), "condition": xp.when.Started()})
    two = type("Two", (Free,), {"before": ("One",), "condition": xp.when.Started()})
    engine = xp.PhysicsEngine()
    engine.add_law(one())
    try:
        law = engine.add_law(two())
    except OrderError:
        pass
    else:
        with pytest.raises(OrderError):
            engine.run(until=1.0)
        with pytest.raises(OrderError):
            engine.run(until=1.0)
        engine.remove_law(law)
    engine.run(until=1.0)
    assert engine.time == 1.0


# Time


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"until": NAN}, "until"),
        ({"until": INF}, "until"),
        ({"until": "late"}, "until"),
        ({"until": None}, "until"),
        ({"until": -1.0}, "past|before"),
        ({"until": 9.0, "dt": 0.0}, "dt"),
        ({"until": 9.0, "dt": -0.1}, "dt"),
        ({"until": 9.0, "dt": NAN}, "dt"),
        ({"until": 9.0, "dt": INF}, "dt"),
        ({"until": 9.0, "dt": "short"}, "dt"),
        ({"until": 9.0, "dt": 0.1, "rtol": 1e-6}, "not both"),
        ({"until": 9.0, "dt": 0.1, "atol": 1e-6}, "not both"),
        ({"until": 9.0, "rtol": 0.0}, "rtol"),
        ({"until": 9.0, "rtol": -1.0}, "rtol"),
        ({"until": 9.0, "atol": NAN}, "atol"),
        ({"until": 9.0, "every": 0.0}, "every"),
        ({"until": 9.0, "every": -1.0}, "every"),
        ({"until": 9.0, "every": NAN}, "every"),
        ({"until": 9.0, "record": "run"}, "every"),
    ],
    ids=str,
)
def test_a_run_that_makes_no_sense(engine: xp.PhysicsEngine, arguments: dict[str, Any], match: str) -> None:
    with refused(engine, InvalidValueError, match):
        engine.run(**arguments)
    assert engine.state == "ready"


def test_a_record_that_cannot_be_written(engine: xp.PhysicsEngine, tmp_path: Any) -> None:
    state = engine.state
    ball, time = engine.object("ball").position, engine.time
    with pytest.raises(RecordError):
        engine.run(until=9.0, every=1.0, record=tmp_path / "no" / "such" / "folder" / "run")
    assert (engine.state, engine.time, engine.object("ball").position) == (state, time, ball)


@pytest.mark.parametrize("bad", [0.0, -1.0, NAN, INF, "x", None], ids=str)
def test_a_step_that_makes_no_sense(engine: xp.PhysicsEngine, bad: Any) -> None:
    with refused(engine, InvalidValueError, "dt"):
        engine.step(bad)


def test_no_run_into_the_past(engine: xp.PhysicsEngine) -> None:
    engine.run(until=engine.time + 3.0)
    with refused(engine, InvalidValueError, "reset"):
        engine.run(until=math.nextafter(engine.time, 0.0))


@pytest.mark.parametrize("state", ["suspended", "terminated"])
def test_no_time_passes_while_the_engine_does_not_run(engine: xp.PhysicsEngine, state: str) -> None:
    {"suspended": engine.suspend, "terminated": engine.terminate}[state]()
    with refused(engine, StateError, state):
        engine.run(until=9.0)
    with refused(engine, StateError, state):
        engine.step(0.1)
    assert engine.state == state


def test_illegal_moves(engine: xp.PhysicsEngine) -> None:
    with refused(engine, StateError, "resume"):
        engine.resume()
    engine.suspend()
    with refused(engine, StateError, "suspend"):
        engine.suspend()
    engine.resume()
    engine.terminate()
    for call in (engine.suspend, engine.resume):
        with refused(engine, StateError, "terminated"):
            call()


@pytest.mark.parametrize("condition", [xp.when.Steps(), xp.when.Steps(3, at="middle"), xp.when.ContactStay()], ids=str)
def test_host_steps_need_dt(engine: xp.PhysicsEngine, condition: Any) -> None:
    engine.add_law(Free(), container=xp.LawContainer(condition))
    with refused(engine, StateError, "dt=.*Elapsed"):
        engine.run(until=9.0)


def test_a_polled_container_without_a_period_needs_dt(engine: xp.PhysicsEngine) -> None:
    class Polled(xp.LawContainer):
        def detect(self) -> None:
            return None

    engine.add_law(Free(), container=Polled())
    with refused(engine, StateError, "dt="):
        engine.run(until=9.0)


@pytest.mark.parametrize("bad", [0.0, -1.0, NAN, INF, "soon"], ids=str)
def test_a_period_that_cannot_be(engine: xp.PhysicsEngine, bad: Any) -> None:
    class Polled(xp.LawContainer):
        period = bad

        def detect(self) -> None:
            return None

    with refused(engine, InvalidValueError, "period"):
        engine.add_law(Free(), container=Polled())
        engine.run(until=9.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: xp.when.Elapsed(0.0),
        lambda: xp.when.Elapsed(-1.0),
        lambda: xp.when.Elapsed(NAN),
        lambda: xp.when.Elapsed(INF),
        lambda: xp.when.Elapsed("1"),  # type: ignore[arg-type]
        lambda: xp.when.Steps(-1),
        lambda: xp.when.Steps(1.5),  # type: ignore[arg-type]
        lambda: xp.when.Steps(0, at="end"),
    ],
)
def test_conditions_that_cannot_be(make: Callable[[], Any]) -> None:
    with pytest.raises(InvalidValueError):
        make()


@pytest.mark.parametrize(
    "settings",
    [{"up": "w"}, {"up": 2}, {"seed": -1}, {"seed": 1.5}, {"seed": None}, {"on_law_error": "ignore"}],
    ids=str,
)
def test_settings_that_cannot_be(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        xp.PhysicsEngine(**settings)


# Posts of anything


@pytest.mark.parametrize(
    "data", [None, 3, "text", [1, 2], {"a": 1}, object(), lambda: 0, {1, 2}, NAN, b"raw"], ids=repr
)
def test_anything_may_be_posted(data: Any) -> None:
    """What is posted arrives as it is; a checkpoint that cannot hold it says so, and the engine runs on."""
    heard: list[Any] = []

    class Listen(xp.PhysicalLaw):
        condition = xp.when.Posted()

        def enforce_this_law(self, event: Any) -> None:
            heard.append((event.id, event.data))

    engine = xp.PhysicsEngine()
    engine.add_law(Listen())
    engine.run(until=0.5)
    engine.post("id", data)
    try:
        engine.checkpoint()
    except RecordError as error:
        assert "post" in str(error)
    engine.run(until=1.0)
    assert heard[0][0] == "id" and heard[0][1] is data
    engine.checkpoint()


def test_a_torn_checkpoint_is_refused(tmp_path: Any, engine: xp.PhysicsEngine) -> None:
    whole = engine.checkpoint()
    for bad in (b"", b"rubbish", whole[:-1], whole[: len(whole) // 2], whole[10:]):
        with pytest.raises(RecordError):
            xp.PhysicsEngine.restore(bad, laws=[Heavy, Free])
    with pytest.raises(RecordError):
        xp.PhysicsEngine.restore(tmp_path / "none")
    with pytest.raises(UnknownLawError, match=r"laws=\[Heavy\]"):
        xp.PhysicsEngine.restore(whole)
