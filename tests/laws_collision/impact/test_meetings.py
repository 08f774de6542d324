"""Predictions of the loop: pure, symmetric, and those of the contact server."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.laws_collision.impact.loops import loop_of, plane, put, solid

import xpheve as xp
from xpheve.kernels.clock import elapsed
from xpheve_laws_collision.impact import rows
from xpheve_laws_collision.impact.meetings import hit, meeting
from xpheve_laws_collision.narrow_phase import Mover, family_of

ZERO, NEVER = (0.0, 0.0, 0.0), (math.inf, 0.0)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def some_pair(seed: int, pull: float) -> Any:
    rng = np.random.default_rng(seed)
    loop = loop_of(2)
    x = rng.uniform(-1.0, 1.0, (3, 2))
    x[1:] *= 0.4
    x[0, 1] += 3.0
    v = rng.uniform(-0.3, 0.3, (3, 2)) + np.array([[1.0, -1.0], [0, 0], [0, 0]])
    clock = np.array([rng.uniform(0.0, 0.3, 2), [1e-18, -1e-18]])
    put(loop, x, v, acceleration=pull * rng.normal(size=(3, 2)), radius=[0.5, 0.3], clock=clock)
    return loop


@pytest.mark.parametrize("pull", [0.0, 0.5])
def test_a_pair_is_the_same_from_both_sides_and_whenever_it_is_asked(pull: float) -> None:
    met = 0
    for seed in range(60):
        state = some_pair(seed, pull).f[rows.STATE]
        one = meeting(state, 0, 1, ZERO, ZERO, NEVER)
        assert one == meeting(state, 1, 0, ZERO, ZERO, NEVER)
        if one[2] == rows.IMPACT:
            met += 1
            assert one == meeting(state, 0, 1, ZERO, ZERO, (one[0] + 1e-9, 0.0)), "a later limit changes no bit"
            gone = meeting(state, 0, 1, ZERO, ZERO, (0.5 * one[0], 0.0))
            assert gone in (one, (math.inf, 0.0, rows.NOTHING))
    assert met > 15


@pytest.mark.parametrize("pull", [0.0, 0.5])
def test_a_pair_meets_when_the_contact_server_says(pull: float) -> None:
    family, _ = family_of("sphere", "sphere")
    for seed in range(60):
        loop = some_pair(seed, pull)
        state = loop._state
        start = max((float(one[6]), float(one[7])) for one in state)
        movers = []
        for one, radius in zip(state, (0.5, 0.3), strict=True):
            x, v, a = (tuple(one[k : k + 3].tolist()) for k in (0, 3, 8))
            mover = Mover(x, v, a, UPRIGHT, xp.Sphere(radius))  # type: ignore[arg-type]
            movers.append(mover.at(elapsed(start, (float(one[6]), float(one[7])))))
        span = family.impact_time(*movers, family.gap(*movers), math.inf)
        found = meeting(loop.f[rows.STATE], 0, 1, ZERO, ZERO, NEVER)
        assert (span < math.inf) == (found[2] == rows.IMPACT)
        if span < math.inf:
            assert elapsed(found[:2], start) == pytest.approx(span, rel=1e-13)


SCENERY = [
    (plane((0.0, 0.0, 1.0), -1.0), "plane", xp.Plane((0, 0, 1), -1.0)),
    (solid(rows.SPHERE, ZERO, (0.7,)), "sphere", xp.Sphere(0.7)),
    (solid(rows.BOX, ZERO, (0.5, 0.4, 0.3)), "box", xp.Box((1.0, 0.8, 0.6))),
    (solid(rows.CAPSULE, ZERO, (0.3, 0.5)), "capsule", xp.Capsule(0.3, 1.0)),
]


@pytest.mark.parametrize(("row", "kind", "shape"), SCENERY, ids=lambda one: one if isinstance(one, str) else "")
def test_fixed_shapes_are_met_when_the_contact_server_says(row: Any, kind: str, shape: Any) -> None:
    family, _ = family_of("sphere", kind)
    rng = np.random.default_rng(3)
    met = 0
    for _ in range(40):
        x = rng.normal(size=3)
        x = np.array([0.0, 0.0, 1.0]) + x if kind == "plane" else x * 3.0 / np.linalg.norm(x)
        v, a = rng.normal(size=3) * 0.5 - x, rng.normal(size=3) * 0.3
        loop = loop_of(1, [row])
        put(loop, x, v, radius=0.25, acceleration=a)
        vectors = [tuple(one.tolist()) for one in (x, v, a)]
        ball, ground = Mover(*vectors, UPRIGHT, xp.Sphere(0.25)), Mover(ZERO, ZERO, ZERO, UPRIGHT, shape)
        span = family.impact_time(ball, ground, family.gap(ball, ground), math.inf)
        assert loop.next_time()[0] == pytest.approx(span, rel=1e-12)
        met += span < math.inf
    assert met > 20


def test_what_touches_is_told() -> None:
    loop = loop_of(2, [plane((0, 0, 1), 0.0)])
    put(loop, [[0.0, 0.1], [0, 0], [0.05, 0.05]], [[0.0, 1.0], [0, 0], [0, 0]])
    assert meeting(loop.f[rows.STATE], 0, 1, ZERO, ZERO, NEVER) == (math.inf, 0.0, rows.TOUCHES)
    assert hit(loop.f[rows.STATE], 0, loop.f[rows.SCENERY], 0) == (math.inf, rows.TOUCHES)
    assert loop.near(0, (0.0, 0.0)) == [(1, False), (0, True)]
