"""Boxes, capsules and spheres that fly and turn: their first touch, against another method in extended precision."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest
from tests.physics.impact_scenes import listen, turn_of, vector_of
from tests.physics.turning_oracle import Turner, first_touch, gaps, long

import xpheve as xp

UNTIL = 2.0
KINDS = ["box", "capsule", "sphere"]
PAIRS = [(a, b) for a in KINDS for b in [*KINDS, "plane"] if a != "sphere" or b in ("box", "capsule")]
NEAR = 2e-12  # [m] of bodies of about 1 m: the engine finds touches to 1e-12 of the sizes


def shape_of(body: Turner) -> Any:
    return {"box": lambda s: xp.Box(s), "capsule": lambda s: xp.Capsule(*s), "sphere": lambda s: xp.Sphere(*s)}[
        body.kind
    ](body.size)


def random_body(chance: random.Random, kind: str, side: float, spin: float) -> Turner:
    """Something of about 1 m at x = ``side``, on its way to about the origin."""
    sizes: dict[str, Any] = {
        "box": [chance.uniform(0.05, 1.0) for _ in range(3)],
        "capsule": (chance.uniform(0.05, 0.3), chance.uniform(0.1, 1.0)),
        "sphere": (chance.uniform(0.05, 0.5),),
    }
    position = tuple(np.add((side, 0.0, 0.0), vector_of(chance, 0.3)).tolist())
    velocity = tuple(np.add((-side * chance.uniform(0.5, 2.0), 0.0, 0.0), vector_of(chance, 0.3)).tolist())
    return Turner(
        kind, sizes[kind], position, velocity, vector_of(chance, 0.5), turn_of(chance), vector_of(chance, spin)
    )


def engine_of(bodies: list[Turner]) -> tuple[xp.PhysicsEngine, Any]:
    """An engine with both, and what is heard of impacts; fills in the moments of inertia that the engine has."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law("collision:elastic")
    for body in bodies:
        if body.kind == "plane":
            made = xp.PhysicalObject(xp.Plane(body.size[:3], body.size[3]), fixed=True)
            engine.add_object(made, laws=[law])
            continue
        made = xp.PhysicalObject(
            shape_of(body), mass=2.0, position=body.position, velocity=body.velocity, orientation=body.orientation,
            angular_velocity=body.angular_velocity,
        )  # fmt: skip
        engine.add_object(made, laws=[law])
        made.add_force(tuple(2.0 * c for c in body.acceleration))
        body.inertia, body.orientation = made.inertia, made.orientation
    return engine, listen(engine)


def compare(kinds: tuple[str, str], seed: int, spin: float) -> bool:
    """The first impact of the engine against the oracle's; whether there was one."""
    chance = random.Random(seed)
    one = random_body(chance, kinds[0], -2.0, spin)
    other = (
        Turner("plane", (-1.0, *vector_of(chance, 0.5)[:2], -1.0))
        if kinds[1] == "plane"
        else random_body(chance, kinds[1], 2.0, spin)
    )
    engine, heard = engine_of([one, other])
    found = first_touch(one, other, UNTIL)
    engine.run(until=UNTIL if found is None else min(UNTIL, found[0] + 1e-6))
    if found is None:
        assert not heard
        return False
    time, closing = found
    assert heard
    # The gap that 64 bits leave at the engine's time is that of the method; in seconds it is as much over the speed of approach.
    assert abs(float(gaps(one, other, long([heard[0][0]]))[0])) < NEAR
    assert abs(heard[0][0] - time) * closing < NEAR
    return True


@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_the_first_touch_of_bodies_that_turn_is_that_of_another_method(kinds: tuple[str, str]) -> None:
    assert sum(compare(kinds, seed, 4.0) for seed in range(2)) >= 1


@pytest.mark.stress
@pytest.mark.parametrize("spin", [0.0, 4.0, 40.0])
@pytest.mark.parametrize("kinds", PAIRS, ids="-".join)
def test_so_it_is_of_many(kinds: tuple[str, str], spin: float) -> None:
    assert sum(compare(kinds, 100 + seed, spin) for seed in range(20)) >= 5


def test_the_oracle_knows_closed_forms() -> None:
    """A rod that turns about its middle, its end on a plane; a cube that falls on its face; a free top keeps its momentum."""
    rod = Turner(
        "capsule",
        (0.1, 1.0),
        (0.0, 0.0, 0.4),
        angular_velocity=(1.0, 0.0, 0.0),
        orientation=(math.sqrt(0.5), math.sqrt(0.5), 0, 0),
    )
    floor = Turner("plane", (0.0, 0.0, 1.0, 0.0))
    found = first_touch(rod, floor, 2.0)
    assert found is not None and found[0] == pytest.approx(math.asin(0.3 / 0.5), rel=1e-15)
    cubes = [
        Turner("box", (1, 1, 1), (0, 0, 3.0), (0, 0, -1.0)),
        Turner("box", (1, 1, 1), (0.3, 0.1, 0), orientation=(0.5, 0, 0, 1.0)),
    ]
    found = first_touch(*cubes, 4.0)
    assert found is not None and found[0] == pytest.approx(2.0, rel=1e-15) and found[1] == pytest.approx(1.0)
    top = Turner("box", (1, 1, 1), angular_velocity=(0.3, 5.0, 0.1), inertia=(1.0, 2.0, 3.0))
    top.prepare(5.0)
    _, axes = top.at(long([0.0, 5.0]))
    later, _ = top.at(long([5.0 + 1e-6])), None
    spin = (later[1][0] - axes[1]) / 1e-6 @ axes[1].T  # of the matrix, skew: the angular velocity
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    momentum = axes[1] @ (np.array([1.0, 2.0, 3.0]) * (axes[1].T @ omega))
    assert momentum.astype(float) == pytest.approx([0.3, 10.0, 0.3], abs=1e-4)
