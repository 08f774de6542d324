"""Friction of many contacts together: cones, energy, and what is redundant."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from xpheve.kernels.quaternion import rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, dot, norm, scale, sub
from xpheve_laws_collision import turning
from xpheve_laws_collision.rubbing import Rub, rub

Touch = tuple[int, int, Vec, Vec]
NO = (1.0, 0.0, 0.0, 0.0)


def spin_of(body: turning.Body) -> Vec:
    return rotate(body.orientation, body.spin)


def kinetic(bodies: list[turning.Body]) -> float:
    moving = [body for body in bodies if body.inverse_mass]
    return math.fsum(
        0.5 * dot(body.velocity, body.velocity) / body.inverse_mass
        + 0.5 * sum(w * w / i for w, i in zip(body.spin, body.inverse_inertia, strict=True))
        for body in moving
    )


def slip(touch: Touch, bodies: list[turning.Body]) -> Vec:
    i, j, _, point = touch
    a, b = (add(body.velocity, cross(spin_of(body), sub(point, body.position))) for body in (bodies[i], bodies[j]))
    return sub(b, a)


def kicked(bodies: list[turning.Body], touches: list[Touch], impulses: list[Vec]) -> list[turning.Body]:
    found = list(bodies)
    for (i, j, _, point), impulse in zip(touches, impulses, strict=True):
        for k, own in ((i, scale(impulse, -1.0)), (j, impulse)):
            body = found[k]
            if body.inverse_mass:
                spin = add(spin_of(body), turning.spun(body, cross(sub(point, body.position), own)))
                velocity = add(body.velocity, scale(own, body.inverse_mass))
                found[k] = body._replace(velocity=velocity, spin=rotate_inverse(body.orientation, spin))
    return found


def pushed(bodies: list[turning.Body], touches: list[Touch], e: float) -> tuple[list[Touch], list[float]]:
    """Return the contacts that push, and how much, along the normals alone."""
    pushes = [turning.push_at(i, j, bodies, n, point) for i, j, n, point in touches]
    speeds = [turning.separation_speed(push, bodies) for push in pushes]
    live = [k for k, speed in enumerate(speeds) if speed < 0]
    if not live:
        return [], []
    missing = [-speeds[k] * (1 + Fraction(e)) for k in live]
    found = turning.solve([pushes[k] for k in live], bodies, missing)
    acting = [(touches[k], float(p)) for k, p in zip(live, found, strict=True) if p > 0]
    return [touch for touch, _ in acting], [p for _, p in acting]


def rubs(
    touches: list[Touch], sizes: list[float], bodies: list[turning.Body], mu: list[float], beta: list[float]
) -> list[Rub]:
    return [
        Rub(i, j, n, sub(at, bodies[i].position), sub(at, bodies[j].position), p, slip((i, j, n, at), bodies), m, b)
        for (i, j, n, at), p, m, b in zip(touches, sizes, mu, beta, strict=True)
    ]


def random_bodies(rng: np.random.Generator) -> tuple[list[turning.Body], list[Touch]]:
    bodies = []
    for k in range(int(rng.integers(2, 5))):
        x, v, w, q = rng.normal(size=3), rng.normal(size=3), rng.normal(size=3), rng.normal(size=4)
        q /= np.linalg.norm(q)
        turns = 1.0 / rng.uniform(0.5, 1.0, 3)
        if k == 0:
            bodies.append(turning.Body(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), NO, (0.0, 0.0, 0.0)))
        else:
            parts = (tuple(one.tolist()) for one in (turns, v, w, q, x))
            bodies.append(turning.Body(1.0 / float(rng.uniform(0.1, 10.0)), *parts))
    touches: list[Touch] = []
    for _ in range(int(rng.integers(1, 7))):
        i, j = sorted(rng.choice(len(bodies), 2, replace=False).tolist())
        n, x = rng.normal(size=3), rng.normal(size=3)
        touches.append((i, j, tuple((n / np.linalg.norm(n)).tolist()), tuple(x.tolist())))
    return bodies, touches


@settings(deadline=None, max_examples=60, derandomize=True, phases=[Phase.generate])
@given(seed=st.integers(0, 10**6), e=st.sampled_from([0.0, 0.5, 1.0]))
def test_cones_are_kept_and_energy_never_rises(seed: int, e: float) -> None:
    rng = np.random.default_rng(seed)
    bodies, touches = random_bodies(rng)
    touches, sizes = pushed(bodies, touches, e)
    mu = rng.choice([0.0, 0.1, 0.5, 2.0, math.inf], size=len(touches)).tolist()
    beta = rng.choice([-1.0, 0.0, 0.5, 1.0], size=len(touches)).tolist()
    if not touches:
        return
    before = kicked(bodies, touches, [scale(n, p) for (_, _, n, _), p in zip(touches, sizes, strict=True)])
    impulses = rub(rubs(touches, sizes, before, mu, beta), before)
    after = kicked(before, touches, impulses)
    assert kinetic(after) <= kinetic(before) + 1e-12 * kinetic(bodies)
    for (_, _, n, _), size, vector, friction in zip(touches, sizes, impulses, mu, strict=True):
        whole = add(scale(n, size), vector)
        along = dot(n, whole)
        assert along >= -1e-12 * size or friction == math.inf
        assert norm(sub(whole, scale(n, along))) <= friction * along + 1e-11 * size or friction == math.inf


def flat_box(speed: float, mu: float) -> tuple[list[turning.Body], list[Touch], list[Vec]]:
    """Return a plate that slid on a floor with four corners, and the impulses that friction gave them."""
    floor = turning.Body(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), NO, (0.0, 0.0, 0.0))
    plate = turning.Body(1.0, (6.0, 6.0, 6.0), (speed, 0.0, 0.0), (0.0, 0.0, 0.0), NO, (0.0, 0.0, 0.001))
    touches: list[Touch] = [(0, 1, (0.0, 0.0, 1.0), (x, y, 0.0)) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]
    return [floor, plate], touches, rub(rubs(touches, [0.25] * 4, [floor, plate], [mu] * 4, [0.0] * 4), [floor, plate])


def test_four_corners_that_slide_share_the_friction() -> None:
    bodies, touches, impulses = flat_box(9.0, 0.3)
    after = kicked(bodies, touches, impulses)[1]
    assert after.velocity == pytest.approx((9.0 - 0.3, 0.0, 0.0), abs=1e-3)
    assert after.spin == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    for one, mirrored in ((0, 1), (2, 3)):
        x, y, z = impulses[mirrored]
        assert impulses[one] == pytest.approx((x, -y, z), abs=1e-12)


def test_four_corners_that_stick_stop_the_plate() -> None:
    bodies, touches, impulses = flat_box(0.2, 5.0)
    after = kicked(bodies, touches, impulses)[1]
    assert after.velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-13)
    assert after.spin == pytest.approx((0.0, 0.0, 0.0), abs=1e-13)


def test_what_does_not_slip_gets_nothing() -> None:
    _, _, impulses = flat_box(0.0, 5.0)
    assert impulses == [(0.0, 0.0, 0.0)] * 4


def test_the_same_from_any_order() -> None:
    rng = np.random.default_rng(5)
    bodies, touches = random_bodies(rng)
    while len(pushed(bodies, touches, 0.5)[0]) < 3:
        bodies, touches = random_bodies(rng)
    touches, sizes = pushed(bodies, touches, 0.5)
    given_ = rubs(touches, sizes, bodies, [0.4] * len(touches), [0.0] * len(touches))
    forwards, backwards = rub(given_, bodies), rub(given_[::-1], bodies)[::-1]
    for one, other in zip(forwards, backwards, strict=True):
        assert one == pytest.approx(other, abs=1e-9 * max(sizes))
