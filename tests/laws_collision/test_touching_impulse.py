"""The impulse of one contact in plain arithmetic: what the server, which solves many together, gives for one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.laws.event import Contact
from xpheve_laws_collision.rubbing import Rub, rub
from xpheve_laws_collision.touching_impulse import touching_impulse
from xpheve_laws_collision.turning import Body


def random_contact(seed: int, fixed: bool) -> Contact:
    """Return a contact of two random bodies that approach at a random point."""
    rng = np.random.default_rng(seed)
    objects = []
    for k in range(2):
        q, moments = rng.normal(size=4), rng.uniform(0.5, 1.0, 3)
        moving: dict[str, Any] = {} if fixed and k == 0 else {
            "velocity": tuple(rng.normal(size=3)), "angular_velocity": tuple(rng.normal(size=3)),
        }  # fmt: skip
        objects.append(
            xp.PhysicalObject(
                xp.Box((1, 1, 1)),
                mass=float(rng.uniform(0.1, 5.0)),
                inertia=tuple(moments * rng.uniform(0.1, 2)),
                position=tuple(rng.normal(size=3)),
                orientation=tuple(q / np.linalg.norm(q)),
                fixed=fixed and k == 0,
                **moving,
            )
        )
    a, b = objects
    point, n = rng.normal(size=3), rng.normal(size=3)
    n /= np.linalg.norm(n)
    u = np.subtract(speed(b, point), speed(a, point))
    if n @ u > 0:
        n = -n
    normal = (float(n[0]), float(n[1]), float(n[2]))
    return Contact(a, b, normal, tuple(point.tolist()), 0.0, float(-n @ u))


def speed(obj: xp.PhysicalObject, point: Any) -> Any:
    return np.array(obj.velocity) + np.cross(obj.angular_velocity, np.subtract(point, obj.position))


def body(obj: xp.PhysicalObject) -> Body:
    from xpheve.kernels.quaternion import rotate_inverse

    q = obj.orientation
    turned = rotate_inverse(q, obj.angular_velocity)
    if obj.fixed:
        return Body(0.0, (0.0, 0.0, 0.0), obj.velocity, turned, q, obj.position)
    a, b, c = obj.inertia
    return Body(1 / obj.mass, (1 / a, 1 / b, 1 / c), obj.velocity, turned, q, obj.position)


def matrix(contact: Contact) -> Any:
    """Return how fast (columns) the bodies part at the point for a unit impulse along each axis."""
    from xpheve_laws_collision.turning import turned_by

    found = np.zeros((3, 3))
    for k in range(3):
        unit = tuple(float(k == j) for j in range(3))
        for obj in (contact.body_a, contact.body_b):
            if not obj.fixed:
                turn = turned_by(body(obj), unit, contact.point)  # type: ignore[arg-type]
                found[:, k] += np.array(unit) / obj.mass + np.cross(turn, np.subtract(contact.point, obj.position))
    return found


@settings(deadline=None, max_examples=60, derandomize=True, phases=[Phase.generate])
@given(
    seed=st.integers(0, 10**6),
    fixed=st.booleans(),
    e=st.sampled_from([0.0, 0.4, 1.0]),
    mu=st.sampled_from([0.0, 0.1, 0.7, 5.0, None]),
    beta=st.sampled_from([-1.0, 0.0, 0.7, 1.0]),
)
def test_it_keeps_newtons_law_coulombs_cone_and_energy(
    seed: int, fixed: bool, e: float, mu: float | None, beta: float
) -> None:
    contact = random_contact(seed, fixed)
    impulse = np.array(touching_impulse(contact, e, mu, beta))
    n, k = np.array(contact.normal), matrix(contact)
    u = np.subtract(speed(contact.body_b, contact.point), speed(contact.body_a, contact.point))
    after = u + k @ impulse
    assert n @ after == pytest.approx(e * contact.approach_speed, abs=1e-12)
    along = float(n @ impulse)
    across = float(np.linalg.norm(impulse - along * n))
    if mu is None or across < mu * along * (1 - 1e-9):
        free = np.linalg.inv(k)  # sticks: the slip that no normal impulse changes is reversed by beta
        assert np.cross(n, free @ (after + beta * u)) == pytest.approx(0.0, abs=1e-10)
    else:
        assert across == pytest.approx(mu * along, rel=1e-10, abs=1e-14)
    gained = float(impulse @ (u + after)) / 2
    assert gained <= 1e-13 * float(u @ np.linalg.inv(k) @ u)


@settings(deadline=None, max_examples=40, derandomize=True, phases=[Phase.generate])
@given(
    seed=st.integers(0, 10**6),
    e=st.sampled_from([0.0, 0.4, 1.0]),
    mu=st.sampled_from([0.1, 0.7, 5.0, None]),
    beta=st.sampled_from([0.0, 0.7, 1.0]),
)
def test_the_server_solves_one_contact_alike(seed: int, e: float, mu: float | None, beta: float) -> None:
    contact = random_contact(seed, seed % 2 == 0)
    a, b, n = body(contact.body_a), body(contact.body_b), np.array(contact.normal)
    arms = [tuple(np.subtract(contact.point, obj.position).tolist()) for obj in (contact.body_a, contact.body_b)]
    k = matrix(contact)
    push = (1 + e) * contact.approach_speed / float(n @ k @ n)
    slip = np.subtract(speed(contact.body_b, contact.point), speed(contact.body_a, contact.point)) + k @ (push * n)
    limit = math.inf if mu is None else mu
    one = Rub(0, 1, contact.normal, arms[0], arms[1], push, tuple(slip.tolist()), limit, beta)
    (more,) = rub([one], [a, b])
    if mu is None:
        for same in rub([one, one._replace(i=2, j=3)], [a, b, a, b]):  # as one of many
            assert same == pytest.approx(more, rel=1e-10, abs=1e-10 * push)
    both = push * n + np.array(more)
    assert touching_impulse(contact, e, mu, beta) == pytest.approx(both, rel=1e-11, abs=1e-11 * push)


@pytest.mark.parametrize("law", ["collision:friction", "collision:rough", "collision:stick"])
def test_laws_answer_one_contact_by_it(law: str) -> None:
    engine = xp.PhysicsEngine(up="z")
    rub_law: Any = engine.add_law(law)
    floor = engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True), laws=[rub_law])
    ball = xp.PhysicalObject(xp.Sphere(0.1), position=(0, 0, 0.1), velocity=(1, 0, -2), angular_velocity=(0, -30, 5))
    engine.add_object(ball, laws=[rub_law])
    contact = Contact(floor, ball, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0, 2.0)
    impulse = rub_law.respond(contact).vector
    engine.run(until=0.01)
    assert ball.velocity == pytest.approx(np.add((1, 0, -2), np.array(impulse) / ball.mass), abs=1e-14)
