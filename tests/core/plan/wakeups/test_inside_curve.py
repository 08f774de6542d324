"""Regions that are entered and left along curves, against the closed form of the curve and dense samples of the distance."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.plugins.registry import Registry

when = xp.when
RATE = 2.0
PLACES = st.tuples(*(st.floats(-2, 2) for _ in range(3)))


class Log(xp.PhysicalLaw):
    """Write down when it is told."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.times: list[float] = []

    def enforce_this_law(self, event: Any) -> None:
        self.times.append(event.time)


def followed(engine: xp.PhysicsEngine, region: xp.Region, **given: Any) -> tuple[Log, Log, xp.PhysicalObject]:
    """Return who hears of entering and of leaving, and a point on the spring."""
    entered, left = Log(), Log()
    for law, condition in ((entered, when.ProbeEnter(region)), (left, when.ProbeExit(region))):
        engine.add_law(law, container=xp.LawContainer(condition))
    return entered, left, engine.add_object(xp.PhysicalObject(**given), laws=["spring", entered, left])


@pytest.mark.parametrize(
    "region",
    [
        xp.Region(xp.Plane(normal=(1, 0, 0)), position=(0.5, 0, 0)),
        xp.Region(xp.Sphere(1.0), position=(-0.5, 0, 0)),
        xp.Region(xp.Box((1.0, 9.0, 9.0)), position=(0.0, 0, 0)),
    ],
    ids=["half space", "ball", "box"],
)
def test_a_region_is_entered_and_left_where_the_cosine_says(engine: xp.PhysicsEngine, region: xp.Region) -> None:
    entered, left, _ = followed(engine, region, position=(0.9, 0, 0))  # x = 0.9 cos 2t
    engine.run(until=math.pi)
    half = math.acos(0.5 / 0.9) / 2
    if isinstance(region.shape, xp.Box):
        assert entered.times == pytest.approx([half, math.pi / 2 + half], abs=2e-15)
        assert left.times == pytest.approx([math.pi / 2 - half, math.pi - half], abs=2e-15)
    else:
        assert entered.times == pytest.approx([half], abs=2e-15)
        assert left.times == pytest.approx([math.pi - half], abs=2e-15)


def test_a_circle_that_touches_a_wall_from_inside_never_leaves(engine: xp.PhysicsEngine) -> None:
    entered, left, _ = followed(engine, xp.Region(xp.Sphere(1.0 + 1e-9)), position=(1, 0, 0), velocity=(0, 2, 0))
    engine.run(until=20.0)
    assert entered.times == left.times == []


def test_a_change_is_the_first_float_at_which_the_region_is_left(engine: xp.PhysicsEngine) -> None:
    world: Any = engine._world
    entered, left, body = followed(engine, xp.Region(xp.Box((1.0, 3.0, 3.0))), position=(0.1, 0, 0), velocity=(3, 1, 0))
    engine.run(until=30.0)
    begin = world.flight(body._row).t0[0]
    inside = [t for t in (*entered.times, *left.times) if t > begin]
    for t in inside:
        x = world.read_row(body._row, "position", (t, 0.0))[0]
        assert abs(abs(x) - 0.5) < 1e-13
    assert len(left.times) == len(entered.times) + 1 == 20


def test_an_observer_meets_a_region_with_its_volume(engine: xp.PhysicsEngine) -> None:
    body = engine.add_object(xp.PhysicalObject(position=(2, 0, 0)), laws=["spring"])
    engine.add_observer(xp.Observer("who", attached=body, radius=0.25))
    region = xp.Region(xp.Box((1.0, 1.0, 1.0)))
    on, off = Log(), Log()
    for law, condition in ((on, when.RegionActive(region)), (off, when.RegionInactive(region))):
        engine.add_law(law, container=xp.LawContainer(condition))
    engine.run(until=1.5)
    half = math.acos(0.75 / 2) / 2  # 2 cos 2t = 0.75, and -0.75
    assert on.times == pytest.approx([half], abs=2e-15)
    assert off.times == pytest.approx([0.0, math.pi / 2 - half], abs=2e-15)


def _distance(region: xp.Region, x: Any) -> float:
    """Return how far ``x`` is outside, signed."""
    place = np.array(region.axes) @ (np.array(x) - np.array(region.position))
    if isinstance(region.shape, xp.Box):
        over = np.abs(place) - 0.5 * np.array(region.shape.size)
        return float(np.linalg.norm(np.maximum(over, 0.0)) + min(over.max(), 0.0))
    return float(np.linalg.norm(place)) - region.shape.radius


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(x=PLACES, v=PLACES, box=st.booleans(), law=st.sampled_from(["curves:pull", "curves:stepped_pull"]))
def test_inside_is_what_the_distance_says(registry: Registry, x: Any, v: Any, box: bool, law: str) -> None:
    """Between the instants told, the side is that of a dense sample."""
    engine = xp.PhysicsEngine(registry=registry)
    engine.add_law(law, name="spring")
    shape: Any = xp.Box((1.0, 2.0, 1.5)) if box else xp.Sphere(0.8)
    region = xp.Region(shape, position=(0.3, -0.2, 0.1), orientation=(0.8, 0.2, -0.4, 0.4))
    entered, left, _ = followed(engine, region, position=x, velocity=v)
    engine.run(until=4.0)
    changes = sorted([(t, True) for t in entered.times] + [(t, False) for t in left.times])
    assert all(a[1] != b[1] for a, b in pairwise(changes))
    inside = _distance(region, x) <= 0.0
    for t in np.linspace(0.0, 4.0, 400).tolist():
        place = np.array(x) * math.cos(RATE * t) + np.array(v) / RATE * math.sin(RATE * t)
        away = _distance(region, place)
        told = [state for when_, state in changes if when_ <= t]
        if abs(away) > 1e-7:
            assert (told[-1] if told else inside) == (away < 0.0), t


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(x=PLACES, v=PLACES, radius=st.floats(0.05, 0.6))
def test_a_volume_is_inside_where_the_distance_says(registry: Registry, x: Any, v: Any, radius: float) -> None:
    """A sphere about the point meets a box round its edges and corners."""
    engine = xp.PhysicsEngine(registry=registry)
    engine.add_law("curves:pull", name="spring")
    region = xp.Region(xp.Box((1.0, 2.0, 1.5)), position=(0.3, -0.2, 0.1), orientation=(0.8, 0.2, -0.4, 0.4))
    on, off = Log(), Log()
    for law, condition in ((on, when.RegionActive(region)), (off, when.RegionInactive(region))):
        engine.add_law(law, container=xp.LawContainer(condition))
    body = engine.add_object(xp.PhysicalObject(position=x, velocity=v), laws=["spring"])
    engine.add_observer(xp.Observer("who", attached=body, radius=radius))
    engine.run(until=3.0)
    changes = sorted([(t, True) for t in on.times] + [(t, False) for t in off.times])
    for t in np.linspace(0.0, 3.0, 300).tolist():
        place = np.array(x) * math.cos(RATE * t) + np.array(v) / RATE * math.sin(RATE * t)
        away = _distance(region, place) - radius
        told = [state for when_, state in changes if when_ <= t]
        if abs(away) > 1e-7:
            assert told[-1] == (away < 0.0), t
