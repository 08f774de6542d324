"""Fixed boxes and planes by the hundred: few are asked, none is missed, and nothing comes out otherwise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve_laws_collision import what_is_ahead

SIDE = 12.0


def scene(boxes: int, planes: int, seed: int = 1) -> tuple[xp.PhysicsEngine, xp.PhysicalObject]:
    """A ball thrown among leaning boxes and planes, between six walls."""
    rng = np.random.default_rng(seed)
    engine = xp.PhysicsEngine(up="z", stepper="core:ballistic")
    bounce, gravity = engine.add_law("collision:elastic"), engine.add_law("basic:planet_gravity", acceleration=10.0)
    fixed = []
    for normal in [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]:
        fixed.append(xp.PhysicalObject(xp.Plane(normal, -0.5 * SIDE), fixed=True))
    for _ in range(planes):
        normal = rng.normal(size=3)
        fixed.append(
            xp.PhysicalObject(xp.Plane(tuple((normal / np.linalg.norm(normal)).tolist()), -0.7 * SIDE), fixed=True)
        )
    for _ in range(boxes):
        q, place = rng.normal(size=4), rng.uniform(-0.5 * SIDE, 0.5 * SIDE, 3)
        if math.hypot(*place) > 1.5:
            shape = xp.Box(tuple(rng.uniform(0.2, 0.8, 3).tolist()))
            turned = tuple((q / np.linalg.norm(q)).tolist())
            fixed.append(xp.PhysicalObject(shape, position=tuple(place.tolist()), orientation=turned, fixed=True))
    engine.add_objects(fixed, laws=[bounce])
    return engine, engine.add_object(xp.PhysicalObject(xp.Sphere(0.2), velocity=(3, 2, 1)), laws=[bounce, gravity])


def ends(boxes: int, planes: int) -> tuple[Any, ...]:
    engine, ball = scene(boxes, planes)
    engine.run(until=5.0)
    contacts = engine.explain().data["contacts"]
    return ball.position, ball.velocity, contacts["impacts"], contacts["predictions"]


def test_what_is_far_ahead_is_not_asked_and_nothing_comes_out_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    found = ends(150, 60)
    monkeypatch.setattr(what_is_ahead, "FEW", 10**9)
    every = ends(150, 60)
    assert found[:3] == every[:3] and found[2] >= 4
    assert found[3] < 15 * found[2] + 250 < every[3], "once for each fixed body, then a few an impact"


def test_no_time_is_later_than_the_impact() -> None:
    engine, ball = scene(120, 40, seed=5)
    engine.run(until=0.01)
    server = engine._world.contacts  # type: ignore[union-attr]
    ahead = {other: earliest for earliest, other in server.broad_phase.fixed.ahead(ball, math.inf)}
    start = engine._world.bodies.clock_of(ball._row)  # type: ignore[union-attr]
    one = server._mover(ball, start)
    met = 0
    for other in engine.objects:
        if other is ball:
            continue
        family, swapped = server._family(ball, other)
        assert not swapped
        two = server._mover(other, start)
        time = family.impact_time(one, two, family.gap(one, two), math.inf)
        if time < math.inf:
            met += 1
            assert ahead[other] <= time
    assert met > 12 and len(ahead) < len(engine.objects)


def test_beyond_a_plane_that_nobody_answers_the_ball_meets_what_is_there() -> None:
    engine = xp.PhysicsEngine(stepper="core:ballistic")
    bounce = engine.add_law("collision:elastic")
    heard: list[Any] = []
    kind = type(
        "Hear",
        (xp.PhysicalLaw,),
        {"condition": xp.when.Impact(), "enforce_this_law": lambda self, event: heard.extend(event.contacts)},
    )
    hear = engine.add_law(kind())
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(-5, 0, 0), velocity=(1, 0, 0))
    engine.add_object(ball, laws=[bounce, hear])
    engine.add_object(xp.PhysicalObject(xp.Plane((-1, 0, 0)), fixed=True), laws=[hear])
    for k in range(40):
        place = (3.0 + 0.5 * (k % 7), 1.0 * (k // 7 - 3), 0.0)
        engine.add_object(xp.PhysicalObject(xp.Box((0.2, 0.2, 0.2)), fixed=True, position=place), laws=[bounce])
    engine.run(until=20.0)
    assert len(heard) == 1
    assert ball.velocity == (-1.0, 0.0, 0.0) and ball.position[0] == pytest.approx(-9.4, abs=1e-13)
