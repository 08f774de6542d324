"""Laws as F = A x + B v + c: which are, and their slopes with more digits than a float has."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

import xpheve as xp
from xpheve.laws import FieldLaw, Param
from xpheve.plan.affine import affine_law, evaluated
from xpheve.plan.hand_kernels import formula_of
from xpheve.trace.graph import Input, walk


class Swell(FieldLaw):
    """A spring that stiffens with time."""

    stiffness, rate = Param(1.0, unit="N/m"), Param(0.1, unit="1/s")

    def force(self, body: Any) -> Any:
        return -self.stiffness * (1.0 + self.rate * body.time) * body.position


class Thirds(FieldLaw):
    """Slopes that no float has."""

    stiffness = Param(1.0, unit="N/m")

    def force(self, body: Any) -> Any:
        return -self.stiffness / 3.0 * body.position


def law_of(ident: str, **numbers: Any) -> Any:
    return xp.PhysicsEngine().add_law(ident, **numbers)


def affine(law: Any, points: bool = False) -> Any:
    trace = formula_of(law)
    assert trace is not None
    return affine_law(law, trace, points)


@pytest.mark.parametrize(
    ("ident", "numbers", "points"),
    [
        ("basic:spring", {}, False),
        ("basic:spring_to_point", {"anchor": (1.0, 2.0, 3.0)}, False),
        ("basic:linear_drag", {}, False),
        ("basic:magnetic_field", {"field": (1.0, 2.0, 3.0)}, False),
        ("basic:electric_field", {"field": (1.0, 2.0, 3.0)}, False),
        ("basic:rotating_frame", {"angular_velocity": (1.0, 2.0, 3.0)}, True),
    ],
)
def test_laws_that_are_affine(ident: str, numbers: dict[str, Any], points: bool) -> None:
    assert affine(law_of(ident, **numbers), points) is not None


@pytest.mark.parametrize(
    ("ident", "numbers"),
    [
        ("basic:spring", {"rest_length": 1.0}),
        ("basic:quadratic_drag", {}),
        ("basic:universal_gravity", {}),
        ("basic:damper", {}),
        ("basic:rotating_frame", {"angular_velocity": (1.0, 2.0, 3.0)}),
    ],
)
def test_laws_that_are_not(ident: str, numbers: dict[str, Any]) -> None:
    assert affine(law_of(ident, **numbers)) is None


def test_a_law_that_reads_the_time_is_not() -> None:
    assert affine(Swell()) is None


def test_a_law_with_other_numbers_is_looked_at_again() -> None:
    law = law_of("basic:spring")
    first = affine(law)
    assert affine(law) is first
    law.rest_length = 0.5
    assert affine(law) is None
    law.rest_length = 0.0
    assert affine(law) is first


def test_slopes_have_thirty_digits() -> None:
    found = affine(Thirds())
    slope = evaluated(list(found.slopes["", "position"][0]), {})[0]
    exact = Fraction(float(slope.high)) + Fraction(float(slope.low))
    assert abs(exact + Fraction(1, 3)) < Fraction(1, 10**31)


def test_of_a_turntable_squares_of_the_angular_velocity_are_exact() -> None:
    law = law_of("basic:rotating_frame", angular_velocity=(0.1, 0.2, 0.3))
    found = affine(law, points=True)
    inputs = {node.value: 2.0 for node in walk(found.outputs) if node.op == "input"}
    slope = evaluated([found.slopes["", "position"][0][0]], inputs | {Input("", "mass", 0): 2.0})[0]
    exact = 2 * (Fraction(0.2) ** 2 + Fraction(0.3) ** 2)
    assert abs(Fraction(float(slope.high)) + Fraction(float(slope.low)) - exact) < Fraction(1, 10**31)


def test_which_laws_join_components() -> None:
    assert not affine(law_of("basic:spring")).crosses
    assert affine(law_of("basic:magnetic_field", field=(0.0, 0.0, 1.0))).crosses
