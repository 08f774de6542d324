"""A law that fails leaves the engine just before the event, whatever it had done by then; and running again fails again."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import (
    LawDefinitionError,
    LawFailedError,
    ParameterError,
    PotentialError,
    StateError,
    TraceError,
    XpheveWarning,
)
from xpheve.record.checkpoint import unpack

when = xp.when
Act = Callable[["Handler", Any], None]


class Handler(xp.PhysicalLaw):
    """Do what the test says."""

    strength = xp.Param(1.0, doc="Something to change.")
    initial_state = {"count": 0, "seen": []}  # noqa: RUF012
    acts: tuple[Act, ...] = ()

    def enforce_this_law(self, event: Any) -> None:
        for act in type(self).acts:
            act(self, event)


class Quiet(xp.PhysicalLaw):
    """Count."""

    def enforce_this_law(self, event: Any) -> None:
        """Do nothing."""


class Pull(xp.FieldLaw):
    """Pull down with the mass."""

    g = xp.Param(2.0, unit="m/s^2", doc="How much.")

    def force(self, body: Any) -> Any:
        return (0.0, -1.0, 0.0) * body.mass * self.g


def steady(checkpoint: bytes) -> str:
    """Return what a checkpoint holds but for counters of calls, as text."""
    header, arrays = unpack(checkpoint)
    header.pop("events")
    header.pop("epoch")
    for law in header["laws"]:
        law.pop("evaluations")
    for container in header["containers"]:
        container.pop("counts")
    if header["contacts"] is not None:
        header["contacts"].pop("counts")
    return repr(header) + repr({name: (array.shape, array.tobytes()) for name, array in sorted(arrays.items())})


def handler(*acts: Act, **contents: Any) -> Handler:
    """Return a law that does ``acts`` one after another."""
    kind: type[Handler] = type("Handler", (Handler,), {"acts": acts, **contents})
    return kind(name="handler")


def boom(law: Handler, event: Any) -> None:
    """Fail."""
    raise RuntimeError("boom")


def ball(law: Handler) -> xp.PhysicalObject:
    """Return the object that the tests look at."""
    return law.engine.object("ball")  # type: ignore[union-attr]


def write_velocity(law: Handler, event: Any) -> None:
    ball(law).velocity = (-9, -9, -9)


def write_everything(law: Handler, event: Any) -> None:
    one = ball(law)
    one.position, one.velocity, one.mass = (7, 7, 7), (8, 8, 8), 5.0
    one.orientation, one.angular_velocity, one.inertia = (0, 1, 0, 0), (1, 1, 1), (1, 1, 1)


def push(law: Handler, event: Any) -> None:
    ball(law).add_force((100, 0, 0))


def push_for_a_while(law: Handler, event: Any) -> None:
    ball(law).add_force((100, 0, 0), 0.25, id="while")


def post(law: Handler, event: Any) -> None:
    law.engine.post("more", 1)  # type: ignore[union-attr]


def add(law: Handler, event: Any) -> None:
    law.engine.add_object(xp.PhysicalObject(name="late"))  # type: ignore[union-attr]


def remove(law: Handler, event: Any) -> None:
    law.engine.remove_object(ball(law))  # type: ignore[union-attr]


def change_parameter(law: Handler, event: Any) -> None:
    law.strength = 4.0  # type: ignore[assignment]


def change_gravity(law: Handler, event: Any) -> None:
    law.engine.law("pull").g = 7.0  # type: ignore[union-attr]


def switch_gravity(law: Handler, event: Any) -> None:
    law.engine.law("pull").enabled = False  # type: ignore[union-attr]


def unmap(law: Handler, event: Any) -> None:
    law.engine.unmap(ball(law), "pull")  # type: ignore[union-attr]


def keep(law: Handler, event: Any) -> None:
    law.state["count"] += 1
    law.state["seen"].append(event.time)


def draw(law: Handler, event: Any) -> None:
    law.random.random()


def add_a_law(law: Handler, event: Any) -> None:
    law.engine.add_law(Quiet(name="new"), container=xp.LawContainer(when.Elapsed(0.125)))  # type: ignore[union-attr]


def remove_a_law(law: Handler, event: Any) -> None:
    law.engine.remove_law("quiet")  # type: ignore[union-attr]


def give_a_new_id(law: Handler, event: Any) -> None:
    law.engine.new_force_id()  # type: ignore[union-attr]


def new_key(law: Handler, event: Any) -> None:
    law.state["new"] = 1


def suspend(law: Handler, event: Any) -> None:
    law.engine.suspend()  # type: ignore[union-attr]


ACTS = [
    write_velocity, write_everything, push, push_for_a_while, post, add, remove, change_parameter, change_gravity, switch_gravity,
    unmap, keep, draw, give_a_new_id, add_a_law, remove_a_law, new_key, suspend,
]  # fmt: skip

WAKES = {
    "elapsed": when.Elapsed(0.75),
    "elapsed once": when.Elapsed(0.75, once=True),
    "every": when.Elapsed(0.75, every=True),
    "posted": when.Posted("go"),
    "posted once": when.Posted("go", once=True),
    "expired": when.ForceExpired("short"),
    "changed": when.Changed("mass"),
    "started": when.Started(),
    "steps": when.Steps(2),
    "middle": when.Steps(2, at="middle"),
    "begin": when.ContactBegin(),
    "end": when.ContactEnd(),
    "impact": when.Impact(),
}


def scene(condition: Any, law: xp.PhysicalLaw) -> xp.PhysicsEngine:
    """Return an engine in which each of `WAKES` fires within 2 s."""
    engine = xp.PhysicsEngine(seed=3)
    pull = engine.add_law(Pull(name="pull"))
    quiet = engine.add_law(Quiet(name="quiet"), container=xp.LawContainer(when.Elapsed(0.5, every=True)))
    engine.add_law(law, container=xp.LawContainer(condition))
    engine.add_law("collision:elastic", name="bounce")
    one = engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), name="ball", velocity=(1, 2, 3)), laws=[pull, quiet, "handler", "bounce"]
    )
    engine.add_object(
        xp.PhysicalObject(xp.Sphere(0.5), name="wall", position=(2.75, 3.0 - 2.25, 4.5 + 0.75), fixed=True),
        laws=["handler", "bounce"],
    )
    one.add_force((0.5, 0, 0), 0.75, id="short")
    engine.run(until=0.0, dt=0.25) if not isinstance(condition, when.Started) else None
    engine.post("go")
    if isinstance(condition, when.Changed):
        one.mass = 3.0
    return engine


def state_of(engine: xp.PhysicsEngine) -> tuple[Any, ...]:
    """Return all that a law could have spoilt, as values."""
    laws = [(law.name, law.enabled, dict(law.parameters), repr(law.state), law.containers) for law in engine.laws]
    objects = [
        (
            obj.name,
            obj.position,
            obj.velocity,
            obj.orientation,
            obj.angular_velocity,
            obj.mass,
            obj.inertia,
            obj.forces,
            obj.laws,
        )
        for obj in engine.objects
    ]
    return engine.time, engine.state, objects, laws, engine.energy(), engine.momentum()


def just_before(engine: xp.PhysicsEngine) -> tuple[LawFailedError, bytes]:
    """Run into the failure; return it, and a checkpoint of what it left."""
    with pytest.raises(LawFailedError) as caught:
        engine.run(until=2.0, dt=0.25)
    return caught.value, engine.checkpoint()


@pytest.mark.parametrize("wake", WAKES)
@pytest.mark.parametrize("act", ACTS)
def test_a_handler_that_fails_has_done_nothing(wake: str, act: Act) -> None:
    plain = scene(WAKES[wake], handler(boom))
    acted = scene(WAKES[wake], handler(act, boom))
    first, _ = just_before(plain)
    second, _ = just_before(acted)
    assert state_of(acted)[:2] == state_of(plain)[:2]
    for one, other in zip(state_of(acted)[2:], state_of(plain)[2:], strict=True):
        assert repr(one) == repr(other)
    assert "boom" in str(second) and "Handler" in str(second) and f"t = {acted.time} s" in str(second)
    assert str(first) == str(second)
    assert isinstance(second.__cause__, RuntimeError)


@pytest.mark.parametrize("wake", WAKES)
def test_running_again_fails_again_and_changes_nothing(wake: str) -> None:
    engine = scene(WAKES[wake], handler(keep, write_everything, push, post, boom))
    first, before = just_before(engine)
    second, after = just_before(engine)
    assert str(first) == str(second)
    assert steady(after) == steady(before)


@pytest.mark.parametrize("wake", WAKES)
def test_counters_are_taken_back(wake: str) -> None:
    engine = scene(WAKES[wake], handler(keep, write_everything, push, post, boom))
    assert just_before(engine)[1] == just_before(engine)[1]


@pytest.mark.parametrize("wake", WAKES)
def test_a_checkpoint_of_what_is_left_fails_again_elsewhere(wake: str) -> None:
    law = handler(keep, write_everything, push, post, boom)
    engine = scene(WAKES[wake], law)
    first, before = just_before(engine)
    twin = xp.PhysicsEngine.restore(before, laws=[type(law), Quiet, Pull])
    second, after = just_before(twin)
    assert str(first) == str(second)
    assert steady(after) == steady(before)


@pytest.mark.parametrize("wake", WAKES)
def test_once_mended_the_run_goes_on_as_if_nothing_had_happened(wake: str) -> None:
    mended = handler(write_velocity, boom)
    broken, whole = scene(WAKES[wake], mended), scene(WAKES[wake], handler(write_velocity))
    just_before(broken)
    type(mended).acts = (write_velocity,)
    broken.run(until=2.0, dt=0.25)
    whole.run(until=2.0, dt=0.25)
    for one, other in zip(state_of(broken)[:3], state_of(whole)[:3], strict=True):
        assert repr(one) == repr(other)


def test_two_handlers_of_one_event_are_one_transaction() -> None:
    """The second fails: what the first wrote is gone too, and both are called again."""
    engine = xp.PhysicsEngine()
    holder = xp.LawContainer(when.Elapsed(1.0))
    good = type("A", (Handler,), {"acts": (write_velocity,)})()
    bad = type("B", (Handler,), {"acts": (boom,)})()
    engine.add_law(good, container=holder)
    engine.add_law(bad, container=holder)
    one = engine.add_object(xp.PhysicalObject(name="ball", velocity=(1, 0, 0)), laws=[good, bad])
    for _ in range(3):
        with pytest.raises(LawFailedError, match="B raised"):
            engine.run(until=2.0)
        assert one.velocity == (1, 0, 0) and one.position == (1, 0, 0) and engine.time == 1.0


def test_a_law_that_fails_at_a_write_from_outside_does_not_undo_the_write() -> None:
    """A handler of `Changed` runs when time goes on, not inside the assignment."""
    law = handler(boom)
    engine = xp.PhysicsEngine()
    engine.add_law(law, container=xp.LawContainer(when.Changed()))
    one = engine.add_object(xp.PhysicalObject(name="ball"), laws=[law])
    engine.run(until=1.0)
    one.velocity = (1, 0, 0)
    assert one.velocity == (1, 0, 0)
    with pytest.raises(LawFailedError):
        engine.run(until=2.0)
    assert engine.time == 1.0 and one.velocity == (1, 0, 0)


# Values that laws return


def field(result: Callable[[Any], Any], method: str = "apply") -> xp.FieldLaw:
    """Return a field law whose ``method`` gives ``result(body)``, and reads a velocity so that it is not stored."""
    kind: type[xp.FieldLaw] = type("Wrong", (xp.FieldLaw,), {method: lambda self, body: result(body)})
    return kind()


WRONG = {
    "nan": lambda body: body.velocity * math.nan,
    "inf": lambda body: body.velocity + math.inf,
    "complex": lambda body: body.velocity * 1j,
    "shape": lambda body: body.velocity[:, :2],
    "scalar per object": lambda body: np.zeros((len(body.velocity) + 1, 3)),
    "none": lambda body: (body.velocity, None)[1],
    "text": lambda body: (body.velocity, "strong")[1],
    "ragged": lambda body: (body.velocity, [[1, 2, 3], [1]])[1],
    "raises": lambda body: 1 / (0 * int(body.velocity.size)),
    "unknown": lambda body: body.colour * body.velocity,
    "writes": lambda body: body.velocity.__setitem__(0, 1.0),
    "sets": lambda body: setattr(body, "velocity", 0),
}


@pytest.mark.parametrize("dt", [None, 0.1], ids=["tolerance", "steps"])
@pytest.mark.parametrize("wrong", WRONG)
def test_a_field_law_that_is_called_and_gives_what_cannot_be(wrong: str, dt: float | None) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(field(WRONG[wrong]))
    one = engine.add_object(xp.PhysicalObject(name="kite", velocity=(1, 0, 0)), laws=[law])
    with pytest.raises(LawFailedError, match="Wrong") as caught:
        engine.run(until=1.0, dt=dt)
    assert "kite" in str(caught.value) or "shape" in str(caught.value) or "reads" in str(caught.value)
    assert one.velocity == (1, 0, 0) and engine.time == 0.0 and engine.state == "ready"
    before = engine.checkpoint()
    with pytest.raises(LawFailedError, match="Wrong") as again:
        engine.run(until=1.0, dt=dt)
    assert str(again.value) == str(caught.value)
    assert steady(engine.checkpoint()) == steady(before)


NUMBERS = {
    "nan": lambda body: body.velocity * body.mass * math.nan,
    "inf": lambda body: body.velocity * body.mass * math.inf,
    "unknown": lambda body: body.colour * body.velocity,
}


@pytest.mark.parametrize("wrong", [one for one in WRONG if one not in NUMBERS])
def test_a_formula_that_gives_what_cannot_be_is_refused_when_it_is_added(wrong: str) -> None:
    engine = xp.PhysicsEngine()
    ball = engine.add_object(xp.PhysicalObject(name="kite", velocity=(1, 0, 0)))
    before = engine.checkpoint()
    for add in (
        lambda law: engine.add_law(law),
        lambda law: engine.add_law(law, container=xp.LawContainer(when.Elapsed(0.1))),
        lambda law: engine.add_law(type(law)),
    ):
        law = field(WRONG[wrong], "force")
        with pytest.raises(TraceError, match="Wrong"):
            add(law)
        assert law.engine is None and engine.laws == () and engine.containers == ()
    holder = xp.LawContainer(when.Elapsed(0.1))
    holder.add_law(field(WRONG[wrong], "force"))
    with pytest.raises(TraceError, match="Wrong"):
        engine.add_container(holder)
    assert holder.engine is None and engine.containers == () and engine.checkpoint() == before
    engine.run(until=1.0)
    assert ball.position == (1, 0, 0)


@pytest.mark.parametrize("dt", [None, 0.1], ids=["tolerance", "steps"])
@pytest.mark.parametrize("wrong", NUMBERS)
def test_a_formula_whose_numbers_cannot_be_stops_the_run(wrong: str, dt: float | None) -> None:
    class Wrong(xp.FieldLaw):
        rate = xp.Constant(1.0, unit="1/s")

        def force(self, body: Any) -> Any:
            return NUMBERS[wrong](body) * self.rate

    engine = xp.PhysicsEngine()
    law = engine.add_law(Wrong())
    one = engine.add_object(xp.PhysicalObject(name="kite", velocity=(1, 0, 0)), laws=[law])
    for _ in range(2):
        with pytest.raises(LawFailedError, match="Wrong") as caught:
            engine.run(until=1.0, dt=dt)
        assert "kite" in str(caught.value) or "reads" in str(caught.value)
        assert one.velocity == (1, 0, 0) and engine.time == 0.0 and engine.state == "ready"
    law.enabled = False
    engine.run(until=1.0, dt=dt)
    assert one.position == pytest.approx((1, 0, 0), rel=1e-14)


class Slope(xp.FieldLaw):
    """Its potential has the wrong sign."""

    stiffness = xp.Param(2.0, unit="N/m", doc="k.")

    def force(self, body: Any) -> Any:
        return -self.stiffness * body.position

    def potential(self, body: Any) -> Any:
        return -0.5 * self.stiffness * body.position.dot(body.position)


@pytest.mark.parametrize("dt", [None, 0.1], ids=["tolerance", "steps"])
def test_a_potential_that_is_not_that_of_the_force_is_refused_before_the_run_starts(dt: float | None) -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Slope())
    one = engine.add_object(xp.PhysicalObject(position=(1, 0, 0), velocity=(1, 0, 0)), laws=[law])
    before = engine.checkpoint()
    for _ in range(2):
        with pytest.raises(PotentialError, match=r"Slope.potential.* Its sign is wrong"):
            engine.run(until=1.0, dt=dt)
        assert engine.state == "ready" and engine.time == 0.0 and engine.checkpoint() == before
    engine.remove_law(law)
    engine.run(until=1.0, dt=dt)
    assert one.position == pytest.approx((2, 0, 0), rel=1e-14)


def test_a_law_that_is_found_wrong_when_it_first_acts_is_disabled_if_that_was_asked_for() -> None:
    engine = xp.PhysicsEngine(on_law_error="disable")
    law = engine.add_law(Slope())
    one = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[law])
    with pytest.warns(XpheveWarning, match=r"Its sign is wrong.*the law is disabled from here on"):
        engine.run(until=1.0)
    assert not law.enabled and one.position == (1, 0, 0)


def test_a_wrong_law_mapped_in_the_midst_of_a_run_leaves_it_just_there() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(Slope())
    one = engine.add_object(xp.PhysicalObject(position=(1, 0, 0)))
    engine.run(until=1.0)
    engine.map(one, law)
    with pytest.raises(PotentialError):
        engine.run(until=2.0)
    assert engine.time == 1.0 and one.position == (1, 0, 0)
    engine.unmap(one, law)
    engine.run(until=2.0)
    assert engine.time == 2.0


@pytest.mark.parametrize("wrong", ["nan", "raises", "shape"])
def test_a_constant_law_that_gives_what_cannot_be(wrong: str) -> None:
    answers = {
        "nan": lambda body: (0, math.nan, 0) * body.mass,
        "raises": lambda body: 1 / 0,
        "shape": lambda body: body.mass,
    }
    if wrong == "shape":
        answers["shape"] = lambda body: np.zeros((7, 2))
    engine = xp.PhysicsEngine()
    law = engine.add_law(field(answers[wrong]))
    ball = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[law])
    for _ in range(2):
        with pytest.raises(LawFailedError, match="Wrong"):
            engine.run(until=1.0)
        assert ball.position == (0, 0, 0) and engine.time == 0.0
    engine.unmap(ball, law)
    engine.run(until=1.0)
    assert ball.position == (1, 0, 0)


def test_a_law_that_turns_bad_under_way_stops_the_run_at_a_finite_state() -> None:
    class Cliff(xp.FieldLaw):
        edge, strength = xp.Constant(1.0, unit="m"), xp.Constant((1.0, 1.0, 1.0), unit="N")

        def force(self, body: Any) -> Any:
            return np.where(body.position.x < self.edge, 1.0, math.nan) * self.strength

    engine = xp.PhysicsEngine()
    law = engine.add_law(Cliff())
    one = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[law])
    with pytest.raises(LawFailedError, match="Cliff"):
        engine.run(until=5.0, dt=0.01)
    assert 0.5 < engine.time < 1.0 and all(map(math.isfinite, one.position)) and one.position[0] < 1.01
    time, state = engine.time, engine.checkpoint()
    with pytest.raises(LawFailedError, match="Cliff"):
        engine.run(until=5.0, dt=0.01)
    assert engine.time == time and steady(engine.checkpoint()) == steady(state)


@pytest.mark.parametrize(
    "answer",
    [math.nan, math.inf, -1.0, -1e-300, None, "fast", (1, 0, 0), 1j, NotImplemented],
    ids=str,
)
def test_a_response_that_cannot_be(answer: Any) -> None:
    class Odd(xp.ResponseLaw):
        def respond(self, contact: Any) -> Any:
            return answer

    engine = xp.PhysicsEngine()
    law = engine.add_law(Odd())
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), name="one", velocity=(1, 0, 0)), laws=[law])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), name="two", position=(3, 0, 0)), laws=[law])
    with pytest.raises(LawFailedError, match=r"Odd.*one.*two|Odd.*two.*one") as caught:
        engine.run(until=5.0)
    assert engine.time == 2.0 and one.position == (2, 0, 0) and one.velocity == (1, 0, 0)
    before = engine.checkpoint()
    with pytest.raises(LawFailedError) as again:
        engine.run(until=5.0)
    assert str(again.value) == str(caught.value) and steady(engine.checkpoint()) == steady(before)


def test_a_response_that_raises_or_does_not_part_the_pair() -> None:
    for respond, match in (
        (lambda self, contact: 1 / 0, "ZeroDivisionError"),
        (lambda self, contact: xp.Impulse((0, 0, 0)), "still approach"),
        (lambda self, contact: xp.Impulse((math.nan, 0, 0)), "finite"),
        (lambda self, contact: xp.Impulse((1, 0)), "three"),
    ):
        engine = xp.PhysicsEngine()
        law = engine.add_law(type("Odd", (xp.ResponseLaw,), {"respond": respond})())
        one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0)), laws=[law])
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(3, 0, 0)), laws=[law])
        with pytest.raises(LawFailedError, match=match):
            engine.run(until=5.0)
        assert engine.time == 2.0 and one.velocity == (1, 0, 0)


def test_a_container_whose_detect_fails_or_gives_nonsense() -> None:
    for detect in (lambda self: 1 / 0, lambda self: "yes", lambda self: True):
        kind = type("Polled", (xp.LawContainer,), {"detect": detect, "period": 0.5})
        engine = xp.PhysicsEngine()
        engine.add_law(Quiet(), container=kind())
        one = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)))
        with pytest.raises(LawFailedError, match="Polled"):
            engine.run(until=2.0)
        before = engine.checkpoint()
        assert engine.time == 0.5 and one.position == (0.5, 0, 0)
        with pytest.raises(LawFailedError, match="Polled"):
            engine.run(until=2.0)
        assert steady(engine.checkpoint()) == steady(before)


# What a handler must not do


@pytest.mark.parametrize(
    "call",
    [
        lambda engine: engine.run(until=9.0),
        lambda engine: engine.step(0.1),
        lambda engine: engine.reset(),
    ],
)
def test_a_handler_cannot_run_the_engine(call: Callable[[Any], None]) -> None:
    law = handler(lambda law, event: call(law.engine))
    engine = xp.PhysicsEngine()
    engine.add_law(law, container=xp.LawContainer(when.Elapsed(1.0)))
    with pytest.raises(LawFailedError, match="running") as caught:
        engine.run(until=2.0)
    assert isinstance(caught.value.__cause__, StateError) and engine.time == 1.0


def test_bad_values_in_a_handler_name_the_law() -> None:
    law = handler(write_velocity, lambda law, event: setattr(ball(law), "mass", -1.0))
    engine = xp.PhysicsEngine()
    engine.add_law(law, container=xp.LawContainer(when.Elapsed(1.0)))
    one = engine.add_object(xp.PhysicalObject(name="ball"), laws=[law])
    with pytest.raises(LawFailedError, match=r"Handler raised InvalidValueError.*mass"):
        engine.run(until=2.0)
    assert one.velocity == (0, 0, 0)


def test_laws_that_wake_one_another_without_end_are_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("xpheve.plan.world.BUSY_INSTANT", 100)
    law = handler(lambda law, event: law.engine.post("again"))
    engine = xp.PhysicsEngine()
    engine.add_law(law, container=xp.LawContainer(when.Posted("again")))
    engine.post("again")
    with pytest.raises(StateError, match="without end"):
        engine.run(until=1.0)
    assert engine.time == 0.0


def twice(law: Handler, event: Any) -> None:
    for obj in [xp.PhysicalObject()] * 2:
        law.engine.add_object(obj)  # type: ignore[union-attr]


def same_name(law: Handler, event: Any) -> None:
    for _ in range(2):
        law.engine.add_object(xp.PhysicalObject(name="same"))  # type: ignore[union-attr]


def two_responses(law: Handler, event: Any) -> None:
    for name in ("first", "second"):
        law.engine.map(ball(law), name)  # type: ignore[union-attr]


@pytest.mark.parametrize("act", [twice, same_name, two_responses])
def test_structural_calls_in_a_handler_are_checked_together(act: Act) -> None:
    law = handler(write_velocity, act)
    engine = xp.PhysicsEngine()
    engine.add_law(law, container=xp.LawContainer(when.Elapsed(1.0)))
    engine.add_law("collision:elastic", name="first")
    engine.add_law("collision:elastic", name="second")
    one = engine.add_object(xp.PhysicalObject(name="ball", velocity=(1, 0, 0)), laws=[law])
    for _ in range(2):
        with pytest.raises(LawFailedError, match="Handler"):
            engine.run(until=2.0)
        assert engine.objects == (one,) and one.laws == (law,)
        assert engine.time == 1.0 and one.velocity == (1, 0, 0)


def test_an_object_taken_away_and_written_by_one_handler() -> None:
    law = handler(remove, remove, write_velocity, push)
    engine = xp.PhysicsEngine()
    engine.add_law(law, container=xp.LawContainer(when.Elapsed(1.0)))
    one = engine.add_object(xp.PhysicalObject(name="ball"), laws=[law])
    engine.run(until=2.0)
    assert engine.objects == () and one.engine is None and one.velocity == (-9, -9, -9) and one.position == (0, 0, 0)


# Disabled laws, and what the option does


def test_on_law_error_disable_goes_on_without_the_law() -> None:
    engine = xp.PhysicsEngine(on_law_error="disable")
    law = handler(write_velocity, push, boom)
    quiet = Quiet()
    engine.add_law(law, container=xp.LawContainer(when.Elapsed(1.0, every=True)))
    engine.add_law(quiet, container=xp.LawContainer(when.Elapsed(1.0, every=True), name="other"))
    one = engine.add_object(xp.PhysicalObject(name="ball", velocity=(1, 0, 0)), laws=[law])
    with pytest.warns(XpheveWarning, match="disabled"):
        engine.run(until=3.0)
    assert not law.enabled and one.velocity == (1, 0, 0) and one.position == (3, 0, 0) and one.forces == ()
    assert engine.time == 3.0
    assert quiet.evaluations >= 3  # counters_after_failure


def test_the_record_is_marked() -> None:
    engine = xp.PhysicsEngine(on_law_error="disable")
    engine.add_law(handler(boom), container=xp.LawContainer(when.Elapsed(1.0)))
    with pytest.warns(XpheveWarning, match="disabled"):
        record = engine.run(until=3.0, every=1.0)
    again = engine.run(until=4.0, every=1.0)
    assert "Handler" in str(record.metadata) or "Handler" in str(again.metadata)


def test_on_law_error_disable_holds_for_laws_along_the_way_and_responses() -> None:
    engine = xp.PhysicsEngine(on_law_error="disable")
    law = engine.add_law(field(lambda body: body.velocity * math.nan))
    one = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[law])
    with pytest.warns(XpheveWarning, match="disabled"):
        engine.run(until=3.0)
    assert not law.enabled and one.position == (3, 0, 0)

    engine = xp.PhysicsEngine(on_law_error="disable")
    odd = engine.add_law(type("Odd", (xp.ResponseLaw,), {"respond": lambda self, contact: 1 / 0})())
    one = engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), velocity=(1, 0, 0)), laws=[odd])
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(3, 0, 0)), laws=[odd])
    with pytest.warns(XpheveWarning, match="disabled"):
        engine.run(until=3.0)
    assert not odd.enabled and one.position == (3, 0, 0)


def test_a_disabled_law_does_nothing_by_hand_either() -> None:
    law = handler(boom)
    law.enabled = False
    law.enforce(None)  # type: ignore[arg-type]
    assert law.evaluations == 0
    law.enabled = True
    with pytest.raises(RuntimeError):
        law.enforce(None)  # type: ignore[arg-type]


def test_enforce_is_final_and_a_law_says_something() -> None:
    with pytest.raises(LawDefinitionError, match="final"):
        type("Cheat", (xp.PhysicalLaw,), {"enforce": lambda self, event: None})
    with pytest.raises(LawDefinitionError, match="enforce_this_law"):
        xp.PhysicalLaw().enforce(None)  # type: ignore[arg-type]


def test_laws_are_enabled_unless_told_otherwise() -> None:
    assert Quiet().enabled and not Quiet(enabled=False).enabled


def test_a_class_of_no_pack_needs_no_id() -> None:
    class Once(Quiet):
        condition = when.Started()

    engine = xp.PhysicsEngine()
    law = engine.add_law(Once, name="it")
    engine.run(until=1.0)
    assert law.evaluations == 1 and law.name == "it"


def test_random_numbers_repeat_with_the_seed_and_not_without() -> None:
    def numbers(seed: int) -> list[float]:
        drawn: list[float] = []
        law = handler(lambda law, event: drawn.append(law.random.random()))
        engine = xp.PhysicsEngine(seed=seed)
        engine.add_law(law, container=xp.LawContainer(when.Elapsed(0.1, every=True)))
        engine.run(until=1.0)
        return drawn

    assert numbers(1) == numbers(1) != numbers(2)
    assert len(set(numbers(1))) == len(numbers(1)) >= 9


def test_a_class_with_both_an_expression_and_apply_is_refused() -> None:
    class Expression(xp.FieldLaw):
        def force(self, body: Any) -> Any:
            return 0

    with pytest.raises(LawDefinitionError, match=r"Both has both force and apply.*Keep one of them"):
        type("Both", (Expression,), {"apply": lambda self, body: 0})
    with pytest.raises(LawDefinitionError, match=r"has both torque and apply"):
        type("Both", (xp.FieldLaw,), {"apply": lambda self, body: 0, "torque": lambda self, body: 0})


def test_a_law_says_what_happens_by_force_torque_apply_or_a_kernel() -> None:
    said: dict[str, dict[str, Any]] = {
        "force": {"force": lambda self, body: 0},
        "torque": {"torque": lambda self, body: 0},
        "apply": {"apply": lambda self, body: 0},
        "kernel": {"kernel": "pack.kernels.drag"},
    }
    for name, body in said.items():
        kind = type(name.title(), (xp.FieldLaw,), body)
        assert kind.is_concrete()
        assert [method for method in ("force", "torque", "apply") if kind.defines(method)] == [name][: name != "kernel"]
    assert not xp.FieldLaw.is_concrete() and not xp.PairLaw.is_concrete()


def test_a_constant_is_a_number_or_a_vector_that_nobody_sets() -> None:
    class Fixed(xp.FieldLaw):
        id = "test:fixed"
        least = xp.Constant("1 mm", unit="m")
        axis = xp.Constant((0, 3, 4), unit="m")

        def force(self, body: Any) -> Any:
            return 0

    law = Fixed()
    assert law.least == 0.001 and law.axis.norm() == 5.0
    assert "least" not in law.params
    with pytest.raises(ParameterError, match=r"test:fixed\.least = 2: it is a constant of the class"):
        law.least = 2
    with pytest.raises(LawDefinitionError, match=r"nan: a finite number in m is needed"):
        xp.Constant(float("nan"), unit="m")
