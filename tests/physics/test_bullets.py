"""Nothing passes: bullets, spinning rods and moving walls at 10 to 10,000 m/s, against an oracle of thirty digits."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import pytest
from tests.physics.bullets import FLOATS, LONG, case, first_touch, gap, root_near

import xpheve as xp

SOME, ALL = range(24), range(1000)


class Hear(xp.PhysicalLaw):
    """Keep when and where bodies met."""

    condition = xp.when.Impact()

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.heard: list[tuple[float, Any]] = []
        self.opening: list[float] = []

    def enforce_this_law(self, event: Any) -> None:
        self.heard += [(event.time, contact) for contact in event.contacts]
        self.opening += [speed_across(contact) for contact in event.contacts]


def speed_across(contact: Any) -> float:
    """How fast the two open at the contact point now [m/s]."""

    def velocity(body: xp.PhysicalObject) -> list[float]:
        arm = [p - x for p, x in zip(contact.point, body.position, strict=True)]
        w = body.angular_velocity
        turned = (w[1] * arm[2] - w[2] * arm[1], w[2] * arm[0] - w[0] * arm[2], w[0] * arm[1] - w[1] * arm[0])
        return [v + t for v, t in zip(body.velocity, turned, strict=True)]

    a, b = (velocity(body) for body in (contact.body_a, contact.body_b))
    return math.fsum(n * (q - p) for n, p, q in zip(contact.normal, a, b, strict=True))


def check(number: int, restitution: float) -> bool:
    """Whether the two of case ``number`` met; all that was found holds."""
    striker, target, time = case(number)
    if gap(striker, target, 0.0, FLOATS) <= 0.0:
        return False
    until = 1.6 * time
    expected = first_touch(striker, target, until)
    engine = xp.PhysicsEngine()
    bounce, hear = engine.add_law("collision:elastic", restitution=restitution), engine.add_law(Hear())
    _, other = engine.add_objects([striker.made(), target.made()], laws=[bounce, hear])
    if target.driven:
        goal = [x + 2.0 * until * v for x, v in zip(target.position, target.velocity, strict=True)]
        other.carry(tuple(goal), within=2.0 * until)
    engine.run(until=until if expected == mpmath.inf else float(expected) * (1.0 + 1e-9) + 1e-11)
    if not hear.heard:
        assert expected == mpmath.inf, f"case {number}: passed at {expected}"
        return False
    found, _ = hear.heard[0]
    assert found <= expected + 1e-12, f"case {number}: late"
    exact = root_near(striker, target, found, 1e-15 * max(found, 1e-3))
    assert abs(float(exact - mpmath.mpf(found))) < 1e-12
    assert abs(float(gap(striker, target, mpmath.mpf(found), LONG))) < 1e-9
    if restitution == 0.0:
        assert abs(hear.opening[0]) < 1e-9
    return True


@pytest.mark.parametrize("restitution", [1.0, 0.0])
def test_none_passes_and_they_meet_when_the_oracle_says(restitution: float) -> None:
    met = sum(check(number, restitution) for number in SOME)
    assert 0.6 * len(SOME) < met < len(SOME), "cases of both kinds"


@pytest.mark.stress
@pytest.mark.parametrize("restitution", [1.0, 0.0])
def test_none_of_a_thousand_passes(restitution: float) -> None:
    assert sum(check(number, restitution) for number in ALL) > 600
