"""The same scene gives the same bits: again, in another order, looked at or not, saved and restored, in one run or in many."""

from __future__ import annotations

import hashlib
import itertools
import os
import random
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp

STATE = ("position", "velocity", "orientation", "angular_velocity")
brief = settings(deadline=None, max_examples=8)


class Breeze(xp.PhysicalLaw):
    """A free-form law of host steps that stores a force from what it reads, and counts."""

    id = "bits:breeze"
    condition = xp.when.Steps()
    initial_state: ClassVar[dict[str, Any]] = {"calls": 0}

    def enforce_this_law(self, event: Any) -> None:
        """Push against the velocity, each call a bit otherwise."""
        self.state["calls"] += 1
        for obj in event.objects:
            push = 0.01 * (1 + self.state["calls"] % 7)
            obj.add_force(tuple(-push * v for v in obj.velocity))


class Gust(xp.PhysicalLaw):
    """A free-form law of time that draws lots, and posts."""

    id = "bits:gust"
    condition = xp.when.Elapsed(0.13, every=True)
    initial_state: ClassVar[dict[str, Any]] = {"blown": 0.0}

    def enforce_this_law(self, event: Any) -> None:
        """Set a velocity, or add a force that ends."""
        for obj in event.objects:
            lot = float(self.random.normal())
            self.state["blown"] += lot
            if lot > 0.0:
                obj.add_force((lot, 0.0, 0.3), duration=0.07)
            else:
                obj.velocity = tuple(v + 0.1 * lot for v in obj.velocity)
        self.engine.post("blown", self.state["blown"])


class Echo(xp.PhysicalLaw):
    """A free-form law of posts."""

    id = "bits:echo"
    condition = xp.when.Posted("blown")

    def enforce_this_law(self, event: Any) -> None:
        """Turn what was posted into a spin."""
        for obj in event.objects:
            obj.angular_velocity = (0.1 * event.data, 0.2, 0.0)


class Counted(xp.PhysicalLaw):
    """A free-form law of impacts."""

    id = "bits:counted"
    condition = xp.when.Impact()
    initial_state: ClassVar[dict[str, Any]] = {"impacts": 0}

    def enforce_this_law(self, event: Any) -> None:
        """Count."""
        self.state["impacts"] += len(event.contacts)


OWN = (Breeze, Gust, Echo, Counted)

# Scenes: a maker each of (engine, laws by name, list of (object, names of laws)), so that they can be put in in any order.
Parts = tuple[
    dict[str, Callable[[xp.PhysicsEngine], xp.PhysicalLaw]], list[tuple[Callable[[], xp.PhysicalObject], list[str]]]
]


def law(*given: Any, **parameters: Any) -> Callable[[xp.PhysicsEngine], xp.PhysicalLaw]:
    return lambda engine: engine.add_law(*given, **parameters)


def thing(*given: Any, **parameters: Any) -> Callable[[], xp.PhysicalObject]:
    return lambda: xp.PhysicalObject(*given, **parameters)


def bouncing() -> Parts:
    """Balls over a floor, of the kind that are not told apart by a name; some come to rest."""
    chance = random.Random(5)
    laws = {
        "g": law("basic:planet_gravity"),
        "e": law("collision:elastic", restitution=0.7, resting="hold"),
        "n": law(Counted),
    }
    objects = [(thing(xp.Plane(), fixed=True), ["e", "n"])]
    for k in range(6):
        place = (0.3 * k, 0.0, 0.3 + 0.2 * chance.random())
        speed = (chance.uniform(-0.5, 0.5), 0.0, chance.uniform(-1.0, 1.0))
        objects.append((thing(xp.Sphere(0.1), mass=1.0 + 0.1 * k, position=place, velocity=speed), ["g", "e", "n"]))
    return laws, objects


def gas() -> Parts:
    chance = random.Random(9)
    laws = {"e": law("collision:elastic")}
    objects: list[Any] = [
        (thing(xp.Plane(tuple(side * (k == axis) for k in range(3)), -0.5), fixed=True), ["e"])
        for axis in range(3)
        for side in (1.0, -1.0)
    ]
    for x, y, z in itertools.product((-0.3, 0.0, 0.3), (-0.2, 0.2), (-0.2, 0.2)):
        speed = tuple(chance.uniform(-1.0, 1.0) for _ in range(3))
        objects.append((thing(xp.Sphere(0.07), position=(x, y, z), velocity=speed), ["e"]))
    return laws, objects


def stepped() -> Parts:
    """Springs, dampers, drag and gravity among bodies, with a floor to bounce off; two groups."""
    laws = {
        "g": law("basic:planet_gravity"),
        "s": law("basic:spring", stiffness=30.0, rest_length=0.5),
        "d": law("basic:damper", damping=0.2),
        "l": law("basic:linear_drag", coefficient=0.1),
        "q": law("basic:quadratic_drag"),
        "u": law("basic:universal_gravity", gravitational_constant=0.1),
        "e": law("collision:elastic", restitution=0.8),
    }
    objects: list[Any] = [(thing(xp.Plane(), fixed=True), ["e"])]
    for k in range(4):
        body = thing(xp.Sphere(0.05), mass=1.0 + k, position=(0.4 * k, 0.1 * k * k, 0.6 + 0.1 * k), drag_area=0.02)
        objects.append((body, ["g", "s", "d", "q", "e"]))
    for k in range(3):
        body = thing(
            mass=2.0 + k, position=(5.0 + k, 0.3 * k, 1.0), velocity=(0.0, 0.2 - 0.2 * k, 0.0), inertia=(1, 2, 2.5)
        )
        objects.append((body, ["u", "l"]))
    return laws, objects


def turning() -> Parts:
    """Free bodies that spin; nothing acts."""
    chance = random.Random(2)
    rates = [tuple(chance.uniform(-2.0, 2.0) for _ in range(3)) for _ in range(4)]
    return {}, [(thing(inertia=(1, 2, 2.5), angular_velocity=w, velocity=w), []) for w in rates]


def handled() -> Parts:
    """Free-form laws: timers, posts, lots, forces that end. One law of each kind, some objects alike but for where they are."""
    laws = {
        "g": law("basic:planet_gravity"),
        "e": law("collision:elastic", restitution=0.9),
        "gust": law(Gust),
        "echo": law(Echo),
        "l": law("basic:linear_drag", coefficient=0.1),
    }
    objects: list[Any] = [(thing(xp.Plane(), fixed=True), ["e"])]
    for k in range(3):
        objects.append((thing(xp.Sphere(0.1), position=(k, 0.0, 1.0)), ["g", "e", "gust", "echo", *["l"][: k % 2]]))
    return laws, objects


def by_steps() -> Parts:
    laws, objects = handled()
    laws["breeze"] = law(Breeze)
    return laws, [(make, [*names, *(["breeze"] if "gust" in names else [])]) for make, names in objects]


SCENES: dict[str, Callable[[], Parts]] = {
    "bouncing": bouncing,
    "gas": gas,
    "stepped": stepped,
    "turning": turning,
    "handled": handled,
    "by steps": by_steps,
}
STEPS = {"by steps": [1 / 60, 0.05]}  # of scenes that ask for host steps; others run with and without
UNTIL = 1.5


def runs() -> list[Any]:
    """Every scene in every way of passing time."""
    return [
        pytest.param(name, dt, id=f"{name}, {'exact' if dt is None else f'dt = {dt:.3g}'}")
        for name in SCENES
        for dt in STEPS.get(name, [None, 1 / 60])
    ]


def build(name: str, law_order: Sequence[int] = (), object_order: Sequence[int] = (), named: bool = False) -> Any:
    """The engine, and its objects as written, whatever the order in which they were put in."""
    laws, objects = SCENES[name]()
    engine = xp.PhysicsEngine(up="z", seed=7)
    keys = list(laws)
    at_work = {keys[k]: laws[keys[k]](engine) for k in law_order or range(len(keys))}
    made: dict[int, xp.PhysicalObject] = {}
    for k in object_order or range(len(objects)):
        make, names = objects[k]
        made[k] = make()
        if named:
            made[k].name = f"object {(5 * k) % 97}"
        ordered = [at_work[key] for key in at_work if key in names]
        engine.add_object(made[k], laws=ordered)
    return engine, [made[k] for k in range(len(objects))]


def go(engine: xp.PhysicsEngine, until: float, dt: float | None, **options: Any) -> None:
    """Run: by host steps, or to a tolerance that is loose enough to take no long time."""
    engine.run(until=until, **({"rtol": 1e-4, "atol": 1e-7} if dt is None else {"dt": dt}), **options)


def bits(engine: xp.PhysicsEngine, objects: Sequence[xp.PhysicalObject]) -> str:
    """A hash of everything there is to read."""
    found = hashlib.sha256(repr(engine.time).encode())
    for obj in objects:
        found.update(repr([getattr(obj, name) for name in STATE]).encode())
        found.update(repr(sorted((str(f.vector), f.duration, str(f.torque)) for f in obj.forces)).encode())
    states = sorted((one.label(), sorted(one.state.items())) for one in engine.laws)
    found.update(repr([states, engine.energy(), engine.momentum(), engine.angular_momentum()]).encode())
    return found.hexdigest()


def columns(engine: xp.PhysicsEngine) -> str:
    """A hash of all columns, in the order of serial numbers."""
    order = sorted(range(len(engine.objects)), key=lambda k: engine.objects[k].serial)
    found = hashlib.sha256(repr(engine.time).encode())
    for name in STATE:
        found.update(getattr(engine.bodies, name)[order].tobytes())
    found.update(repr([sorted(one.state.items()) for one in engine.laws]).encode())
    found.update(repr(engine.energy()).encode())
    return found.hexdigest()


def straight(name: str, dt: float | None, until: float = UNTIL) -> str:
    engine, objects = build(name)
    go(engine, until, dt)
    return bits(engine, objects)


@pytest.fixture(scope="module")
def plain() -> Callable[[str, float | None], str]:
    """The bits of a scene that ran straight to `UNTIL`."""
    known: dict[Any, str] = {}

    def find(name: str, dt: float | None) -> str:
        if (name, dt) not in known:
            known[name, dt] = straight(name, dt)
        return known[name, dt]

    return find


@pytest.mark.parametrize(("name", "dt"), runs())
def test_twice_is_the_same(plain: Any, name: str, dt: float | None) -> None:
    assert straight(name, dt) == plain(name, dt)


@pytest.mark.parametrize(("name", "dt"), runs())
def test_something_happens(plain: Any, name: str, dt: float | None) -> None:
    """The hashes tell scenes apart, so that the rest of this page says something."""
    engine, objects = build(name)
    go(engine, UNTIL * (1 - 1e-9), dt)
    assert bits(engine, objects) != plain(name, dt)


# Order


@pytest.mark.parametrize(("name", "dt"), runs())
@pytest.mark.parametrize("named", [False, True])
def test_the_order_in_which_objects_and_laws_are_put_in_does_not_matter(
    name: str, dt: float | None, named: bool
) -> None:
    laws, objects = SCENES[name]()
    engine, made = build(name, named=named)
    go(engine, UNTIL, dt)
    expected = bits(engine, made)

    @settings(deadline=None, max_examples=5)
    @given(law_order=st.permutations(range(len(laws))), object_order=st.permutations(range(len(objects))))
    def any_order(law_order: list[int], object_order: list[int]) -> None:
        engine, made = build(name, law_order, object_order, named)
        go(engine, UNTIL, dt)
        assert bits(engine, made) == expected

    any_order()


@pytest.mark.parametrize("seed", ["1", "2"])
def test_hash_seeds_do_not_matter(plain: Any, seed: str) -> None:
    """Other processes, with sets and dictionaries of another order."""
    ways = [tuple(one.values) for one in runs()]
    code = f"','.join(m.straight(name, dt) for name, dt in {ways!r})"
    assert elsewhere(code, PYTHONHASHSEED=seed).split(",") == [plain(name, dt) for name, dt in ways]


def elsewhere(code: str, **environment: str) -> str:
    """What ``code`` gives in another process, where ``m`` is this file."""
    lines = [
        "import importlib.util, sys",
        f"spec = importlib.util.spec_from_file_location('same_bits', {__file__!r})",
        "m = importlib.util.module_from_spec(spec)",
        "sys.modules['same_bits'] = m",
        "spec.loader.exec_module(m)",
        f"print({code})",
    ]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(lines)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


# Looking


@pytest.mark.parametrize(("name", "dt"), runs())
def test_looking_and_recording_do_not_matter(plain: Any, name: str, dt: float | None, tmp_path: Path) -> None:
    engine, objects = build(name)
    go(engine, UNTIL, dt, every=0.0237)
    assert bits(engine, objects) == plain(name, dt)
    engine, objects = build(name)
    go(
        engine,
        UNTIL,
        dt,
        every=0.11,
        record=tmp_path / "run.arrow",
        progress=lambda t: repr(objects[-1].position),
    )
    assert bits(engine, objects) == plain(name, dt)


@pytest.mark.parametrize(("name", "dt"), runs())
def test_one_run_or_many_is_the_same(plain: Any, name: str, dt: float | None) -> None:
    @brief
    @given(stops=st.lists(st.floats(0.0, UNTIL), max_size=5).map(sorted), look=st.booleans())
    def any_stops(stops: list[float], look: bool) -> None:
        engine, objects = build(name)
        for stop in stops:
            go(engine, stop, dt)
            if look:
                _ = (
                    engine.energy(),
                    engine.explain().data,
                    str(engine.explain()),
                    engine.checkpoint(),
                    bits(engine, objects),
                )
        go(engine, UNTIL, dt)
        assert bits(engine, objects) == plain(name, dt)

    any_stops()


@pytest.mark.parametrize("name", list(SCENES))
def test_steps_one_by_one_are_the_run(plain: Any, name: str) -> None:
    dt = 1 / 60
    engine, objects = build(name)
    for _ in range(20):
        engine.step(dt)
    assert engine.time == pytest.approx(20 * dt, rel=1e-15)
    go(engine, UNTIL, dt)
    assert bits(engine, objects) == plain(name, dt)


@pytest.mark.parametrize(("name", "dt"), runs())
def test_a_stop_at_an_event_or_a_host_step_is_no_matter(plain: Any, name: str, dt: float | None) -> None:
    """At the very floats at which something happens, each of them."""
    engine, objects = build(name)
    for when in event_times(name, dt):
        go(engine, when, dt)
    go(engine, UNTIL, dt)
    assert bits(engine, objects) == plain(name, dt)


# Saving


@pytest.mark.parametrize(("name", "dt"), runs())
def test_a_copy_goes_on_as_the_original(plain: Any, name: str, dt: float | None) -> None:
    @brief
    @given(when=st.floats(0.0, UNTIL))
    def any_time(when: float) -> None:
        engine, objects = build(name)
        go(engine, when, dt)
        twin = engine.copy()
        go(engine, UNTIL, dt)
        assert bits(engine, objects) == plain(name, dt)
        go(twin, UNTIL, dt)  # after the original, which must not have touched it
        assert columns(twin) == columns(engine)

    any_time()


@pytest.mark.parametrize(("name", "dt"), runs())
def test_after_reset_the_same_happens_again(plain: Any, name: str, dt: float | None) -> None:
    engine, objects = build(name)
    for until in (0.4, UNTIL, 0.0):
        go(engine, until, dt)
        engine.reset()
        assert engine.time == 0.0
    go(engine, UNTIL, dt)
    assert bits(engine, objects) == plain(name, dt)


def finished(path: str, until: float, dt: float | None) -> str:
    """What comes of a checkpoint, for another process."""
    engine = xp.PhysicsEngine.restore(path, laws=OWN)
    go(engine, until, dt)
    return columns(engine)


@pytest.mark.parametrize(("name", "dt"), runs())
def test_saved_at_a_random_event_and_restored_elsewhere_it_goes_on_to_the_bit(
    name: str, dt: float | None, tmp_path: Path
) -> None:
    engine, _ = build(name)
    go(engine, UNTIL, dt)
    expected = columns(engine)
    events = event_times(name, dt)
    chance = random.Random(f"{name} {dt}")
    for k in range(3):
        engine, _ = build(name)
        go(engine, chance.choice(events), dt)
        assert finished(engine.checkpoint(), UNTIL, dt) == expected  # type: ignore[arg-type]
        path = tmp_path / f"{k}.checkpoint"
        engine.checkpoint(path)
    code = f"m.finished({str(path)!r}, {UNTIL!r}, {dt!r})"
    assert elsewhere(code, PYTHONHASHSEED="3") == expected


def event_times(name: str, dt: float | None) -> list[float]:
    """When something happens in a scene: the instants of the queue, and the host steps."""
    engine, _ = build(name)
    found = [0.0]
    world = engine._world
    happen = world.happen

    def noted(due: Any) -> None:
        happen(due)
        found.append(world.time[0])

    world.happen = noted  # type: ignore[method-assign]
    go(engine, UNTIL, dt)
    steps = [] if dt is None else [k * dt for k in range(int(UNTIL / dt))]
    return sorted({t for t in found + steps if t <= UNTIL})


# Restored engines are engines


@pytest.mark.parametrize("name", list(SCENES))
def test_a_checkpoint_of_a_restored_engine_says_the_same(name: str) -> None:
    dt = STEPS.get(name, [None])[0]
    engine, _ = build(name)
    go(engine, 0.5, dt)
    once = xp.PhysicsEngine.restore(engine.checkpoint(), laws=OWN)
    twice = xp.PhysicsEngine.restore(once.checkpoint(), laws=OWN)
    assert columns(once) == columns(twice) == columns(engine)
    for one in (engine, once, twice):
        go(one, 1.0, dt)
    assert columns(once) == columns(twice) == columns(engine)


@pytest.mark.parametrize("name", list(SCENES))
def test_a_restored_or_copied_engine_can_be_reset(plain: Any, name: str) -> None:
    dt = STEPS.get(name, [None])[0]
    engine, _ = build(name)
    go(engine, UNTIL, dt)
    expected = columns(engine)
    for twin in (engine.copy(), xp.PhysicsEngine.restore(engine.checkpoint(), laws=OWN)):
        twin.reset()
        assert twin.time == 0.0
        go(twin, UNTIL, dt)
        assert columns(twin) == expected
