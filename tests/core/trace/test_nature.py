"""What kind of law a trace is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
import xpheve_laws_basic as basic
from xpheve.trace.check import nature_of
from xpheve.trace.nature import Nature, nature
from xpheve.trace.recorder import trace_law


def of(law: Any) -> Nature:
    found = nature_of(law)
    assert found is not None
    return found


def formula(force: Any, **members: Any) -> Nature:
    """Return the nature of a law with this method."""
    given = {
        "k": xp.Param(2.0, unit="N/m", doc="k."),
        "c": xp.Param(2.0, unit="N*s/m", doc="c."),
        "f": xp.Param((1.0, 2.0, 3.0), unit="N", doc="f."),
    }
    return of(type("Made", (xp.FieldLaw,), {"id": "mine:made", "force": force, **given, **members})())


@pytest.mark.parametrize(
    ("law", "constant", "linear", "conservative"),
    [
        (basic.PlanetGravity(), True, True, "yes"),
        (basic.ElectricField(), True, True, "yes"),
        (basic.LinearDrag(), False, True, "no"),
        (basic.MagneticField(), False, True, "yes"),
        (basic.QuadraticDrag(), False, False, "no"),
        (basic.Wind(), False, False, "no"),
        (basic.SpringToPoint(), False, False, "yes"),
        (basic.UniversalGravity(), False, False, "yes"),
        (basic.Damper(), False, False, "no"),
        (basic.Buoyancy(), True, True, "yes"),
        (basic.Thrust(duration=3.0), False, False, "no"),
        (basic.RotatingFrame(), False, False, "no"),
    ],
    ids=lambda value: getattr(value, "id", None),
)
def test_laws_of_the_library_are_what_their_docs_say(law: Any, constant: bool, linear: bool, conservative: str) -> None:
    found = of(law)
    assert (found.constant, found.linear, found.conservative) == (constant, linear, conservative)


@pytest.mark.parametrize(
    ("force", "linear"),
    [
        (lambda self, body: -self.k * body.position - self.c * body.velocity + self.f, True),
        (lambda self, body: -self.k * (body.position - body.position.dot(body.up) * body.up), True),
        (lambda self, body: body.position / self.k * self.k * self.k, True),
        (lambda self, body: self.f * xp.where(body.mass > 1.0 * body.mass, 1.0, 2.0) - self.k * body.position, True),
        (lambda self, body: self.f * (body.time / (1.0 * body.since)) - self.k * body.position, True),
        (lambda self, body: -self.k * body.position * (body.time / body.since), False),
        (
            lambda self, body: (
                -self.k * xp.where(body.position.z > 0.0 * body.position.z, body.position, 2.0 * body.position)
            ),
            False,
        ),
        (lambda self, body: self.f * xp.where(body.position.z > body.position.x, 1.0, 2.0), False),
        (lambda self, body: -self.k * body.position * (body.position.x / body.position.y), False),
        (lambda self, body: self.k * self.k * self.k / self.k / self.k * abs(body.position), False),
    ],
)
def test_linear_is_proven_from_the_expression(force: Any, linear: bool) -> None:
    assert formula(force).linear is linear


def pair(force: Any) -> Nature:
    given = {"k": xp.Param(2.0, unit="N/m", doc="k."), "c": xp.Param(2.0, unit="N*s/m", doc="c.")}
    return of(type("Pair", (xp.PairLaw,), {"id": "mine:pair", "force": force, **given})())


def test_a_pair_law_that_reads_differences_only_is_the_same_everywhere() -> None:
    spring = pair(lambda self, a, b: -self.k * (a.position - b.position))
    assert (
        spring.translation
        and spring.galilean
        and spring.linear
        and spring.reads == {"a": {"position"}, "b": {"position"}}
    )
    damped = pair(lambda self, a, b: -self.k * (a.position - b.position) + self.c * (b.velocity - a.velocity))
    assert damped.translation and damped.galilean and damped.velocity_dependent
    stuck = pair(lambda self, a, b: -self.k * (a.position - b.position) - self.c * a.velocity)
    assert (
        stuck.translation
        and not stuck.galilean
        and stuck.depends_on("velocity", "a")
        and not stuck.depends_on("velocity", "b")
    )
    middle = pair(lambda self, a, b: -self.k * (a.position + b.position))
    assert not middle.translation and not middle.galilean
    assert not of(basic.SpringToPoint()).translation and of(basic.Wind()).translation and not of(basic.Wind()).galilean


def test_what_does_no_work_is_told_from_what_does() -> None:
    across = formula(lambda self, body: self.c * body.velocity.cross((0.0, 0.0, 1.0)))
    assert across.conservative == "workless" and "does no work" in across.words()
    assert formula(lambda self, body: -self.c * body.velocity).conservative == "no"
    assert formula(lambda self, body: -self.k * body.position).conservative == "unknown"
    curl = formula(lambda self, body: xp.vector(self.k * body.position.y, 0.0, 0.0))
    assert curl.conservative == "no", "its Jacobian is not symmetric"


def test_reads_are_those_of_force_and_torque() -> None:
    trace = trace_law(basic.PlanetGravity())
    assert trace is not None
    found = nature(trace)
    assert found.names == {"mass"} | (found.names & {"up"}) and found.constant and not found.time_dependent
    assert found.conservative == "unknown", "numbers have to say it"
    assert of(basic.Thrust(duration=2.0)).time_dependent


def test_operations_are_counted_by_kind() -> None:
    drag = of(basic.QuadraticDrag()).operations
    assert (drag.roots, drag.divisions, drag.functions, drag.tables) == (1, 0, 0, 0) and 8 <= drag.plain <= 12
    gravity = of(basic.UniversalGravity()).operations
    assert (gravity.roots, gravity.divisions) == (1, 1)
    waves = formula(lambda self, body: self.f * np.sin(body.time / body.since)).operations
    assert (waves.plain, waves.divisions, waves.functions) == (3, 1, 1)
    assert str(waves) == "3 operations, 1 division, 1 function"


def test_words_are_for_people() -> None:
    assert (
        of(basic.LinearDrag()).words()
        == "depends on velocity; linear; not conservative: its work is reported; 3 operations"
    )
    assert of(basic.PlanetGravity()).words().startswith("constant; conservative; ")
    assert (
        of(basic.Damper())
        .words()
        .startswith("depends on position and velocity; the same everywhere and at any common speed; not conservative")
    )
