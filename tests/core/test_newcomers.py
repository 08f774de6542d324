"""What somebody who comes from another engine writes first, and must not be answered with a wrong result in silence."""

from __future__ import annotations

import math
import random
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import (
    InvalidValueError,
    LawFailedError,
    ResolutionWarning,
    TraceError,
    UnknownLawError,
    XpheveWarning,
)


def pushed(force: Callable[[Any], Any], count: int, method: str = "force") -> list[Any]:
    """Return objects after 0.1 s under a law whose ``method`` is ``force``."""
    Law = type("Law", (xp.FieldLaw,), {"id": "mine:law", method: lambda self, body: force(body)})
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law(Law)
    objects = engine.add_objects(
        [xp.PhysicalObject(position=(k + 1, 0, 2 * k + 1), mass=k + 1.0) for k in range(count)], laws=[law]
    )
    engine.run(until=0.1, dt=0.1)
    return list(objects)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize(
    "force",
    [
        lambda body: -body.position.z,
        lambda body: -body.position[:, 2],
        lambda body: -1.0,
        lambda body: body.mass,
        lambda body: (-body.position.x, 0, 0),
    ],
    ids=["column", "slice", "number", "mass", "tuple"],
)
def test_what_is_no_vector_is_refused_however_many_objects_there_are(force: Any, count: int) -> None:
    with pytest.raises(LawFailedError, match=rf"(?s)returned .*shape \({count}, 3\) or \(3,\) are needed"):
        pushed(force, count, "apply")
    with pytest.raises(TraceError, match=r"mine:law.force returned .*shape \(n, 3\) or \(3,\) are needed"):
        pushed(force, count)


@pytest.mark.parametrize("count", [1, 3, 5])
def test_the_row_of_one_object_is_not_taken_for_a_component_of_all(count: int) -> None:
    with pytest.raises(LawFailedError, match=r"\[2\] of a batch .* write \.z"):
        pushed(lambda body: -body.position[2], count, "apply")
    with pytest.raises(TraceError, match=r"\[2\] of .* write \.z"):
        pushed(lambda body: -body.position[2], count)


@pytest.mark.parametrize("count", [1, 3])
def test_rows_can_be_had_by_a_loop_and_by_asarray(count: int) -> None:
    by_loop = pushed(lambda body: [-row for row in body.position], count, "apply")
    by_row = pushed(lambda body: [-np.asarray(body.position)[k] for k in range(body.count)], count, "apply")
    plain = pushed(lambda body: -body.position, count, "apply")
    assert [o.velocity for o in by_loop] == [o.velocity for o in by_row] == [o.velocity for o in plain]


def test_no_force_may_be_said_by_the_number_0_and_one_vector_for_all_by_three() -> None:
    assert [one.velocity for one in pushed(lambda body: 0.0, 3)] == [(0.0, 0.0, 0.0)] * 3
    assert [one.velocity[2] for one in pushed(lambda body: -6.0 * body.up, 3, "apply")] == pytest.approx(
        [-0.6, -0.3, -0.2]
    )


def test_a_potential_that_is_no_number_an_object_is_refused_with_its_shape() -> None:
    class Law(xp.FieldLaw):
        id = "mine:law"

        stiffness = xp.Constant(1.0, unit="N/m")

        def force(self, body: Any) -> Any:
            return -self.stiffness * body.position

        def potential(self, body: Any) -> Any:
            return 0.5 * self.stiffness * body.position**2

    engine = xp.PhysicsEngine()
    with pytest.raises(TraceError, match=r"potential returned an array of shape \(n, 3\); .* \(n, 1\) are needed"):
        engine.add_law(Law)

    class Called(xp.FieldLaw):
        id = "mine:called"

        def apply(self, body: Any) -> Any:
            return -body.position

        def potential(self, body: Any) -> Any:
            return 0.5 * body.position**2

    engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[engine.add_law(Called)])
    with pytest.raises(LawFailedError, match=r"potential returned an array of shape \(1, 3\); .* \(1, 1\) are needed"):
        engine.energy()


def crossing(expression: Any) -> list[float]:
    """Return when ``expression`` of a ball thrown upwards at 8 m/s went through zero."""
    times: list[float] = []

    class Law(xp.PhysicalLaw):
        id = "mine:heard"

        def enforce_this_law(self, event: Any) -> None:
            times.append(event.time)

    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=10.0)
    heard = engine.add_law(Law, xp.LawContainer(xp.when.Crosses(expression)))
    engine.add_object(xp.PhysicalObject(velocity=(0, 0, 8.0)), laws=[gravity, heard])
    engine.run(until=3.0)
    return times


ROOTS = [0.8 - math.sqrt(0.24), 0.8 + math.sqrt(0.24)]  # z = 8 t - 5 t^2 = 2


def test_a_comparison_goes_through_no_zero_and_is_refused() -> None:
    with pytest.raises(TraceError, match=r"gave True or False.* give a difference"):
        crossing(lambda body: body.position.z > 2.0)


def test_an_expression_of_wrong_shape_is_told_what_is_needed() -> None:
    with pytest.raises(
        TraceError, match=r"returned an array of shape \(n, 3\); one number an object is needed, of shape \(n, 1\)"
    ):
        crossing(lambda body: body.position - 2.0)


def test_an_expression_that_jumps_is_followed_to_its_jumps_and_ends() -> None:
    found = crossing(lambda body: np.where(body.position.z > 2.0, 1.0, -1.0))
    assert found == pytest.approx(ROOTS, abs=1e-14)


def test_a_shape_is_not_changed_in_place() -> None:
    body = xp.PhysicalObject(xp.Sphere(0.1))
    with pytest.raises(InvalidValueError, match=r"give the object a new one: obj\.shape = Sphere\(\.\.\.\)"):
        body.shape.radius = 0.5  # type: ignore[union-attr]
    assert body.shape == xp.Sphere(0.1)


def test_moments_of_the_solid_shape_follow_the_mass_and_those_given_by_hand_stay() -> None:
    engine = xp.PhysicsEngine()
    solid = xp.PhysicalObject(xp.Sphere(0.1), mass=1.0)
    solid.mass = 2.0
    assert solid.inertia == xp.Sphere(0.1).inertia(2.0)
    given = xp.PhysicalObject(xp.Sphere(0.1), mass=1.0, inertia=7.0)
    engine.add_objects([solid, given])
    engine.run(until=1.0)
    solid.mass = given.mass = 5.0
    assert solid.inertia == xp.Sphere(0.1).inertia(5.0)
    assert given.inertia == (7.0, 7.0, 7.0)
    solid.shape = xp.Box((1, 2, 3))
    assert solid.inertia == xp.Box((1, 2, 3)).inertia(5.0)


@pytest.mark.parametrize(("name", "way"), [("static", "fixed=True"), ("pos", "position="), ("quat", "orientation=")])
def test_names_of_other_engines_are_answered_with_those_of_this_one(name: str, way: str) -> None:
    with pytest.raises(InvalidValueError, match=f"{name} = 1: here that is {way}"):
        xp.PhysicalObject(**{name: 1})


def test_calls_of_other_engines_are_answered_with_those_of_this_one() -> None:
    body = xp.PhysicalObject()
    with pytest.raises(AttributeError, match=r"here that is obj\.add_force"):
        body.apply_force((1, 0, 0))  # type: ignore[operator]
    with pytest.raises(AttributeError, match='Did you mean "velocity"'):
        print(body.velocty)


def test_a_misspelt_column_is_warned_of_when_its_law_is_met() -> None:
    engine = xp.PhysicsEngine()
    bounce = engine.add_law("collision:elastic")
    with pytest.warns(XpheveWarning, match="no law of it reads column 'restituton'; did you mean 'restitution'"):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), restituton=0.5), laws=[bounce])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.1), position=(1, 0, 0), restitution=0.5, colour=3), laws=[bounce]
        )


def test_a_parameter_without_unit_is_said_without_one() -> None:
    with pytest.raises(InvalidValueError, match=r"restitution = 1\.5: must be <= 1"):
        xp.PhysicsEngine().add_law("collision:elastic", restitution=1.5)


# Slips of the pen at the engine's own doors


@pytest.mark.parametrize(
    "slip", [lambda a, b: a and b, lambda a, b: a or b, lambda a, b: not a], ids=["and", "or", "not"]
)
def test_conditions_are_not_joined_by_words(slip: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"a & b"):
        slip(xp.when.Started(), xp.when.Elapsed(1.0))


def test_an_engine_refuses_what_it_has_not() -> None:
    engine = xp.PhysicsEngine()
    with pytest.raises(InvalidValueError, match=r"no 'gravity'.*add_law"):
        engine.gravity = 1.0

    class Mine(xp.PhysicsEngine):
        pass

    mine = Mine()
    mine.score = 3
    assert mine.score == 3


def test_arguments_the_wrong_way_round_say_so() -> None:
    engine = xp.PhysicsEngine()
    ball = xp.PhysicalObject()
    with pytest.raises(InvalidValueError, match="add_object takes one"):
        engine.add_objects(ball)
    law = engine.add_law("basic:planet_gravity")
    engine.add_object(ball)
    with pytest.raises(InvalidValueError, match="the object comes first"):
        engine.map(law, ball)
    with pytest.raises(InvalidValueError, match=r"LawContainer\(Impact"):
        engine.add_law("collision:elastic", container=xp.when.Impact())
    with pytest.raises(UnknownLawError, match=r"Add it first: engine.add_law\('basic:wind'\)"):
        engine.add_object(xp.PhysicalObject(), laws=["basic:wind"])


# Slips of the pen, and the way out that the message shows


def told(error: type[Exception] = TraceError, base: type[Any] = xp.FieldLaw, **members: Any) -> str:
    """What is said when a law with ``members`` is added."""
    own = {"id": "mine:slip", "c": xp.Param(1.0), "k": xp.Param(1.0, unit="N/m"), "near": xp.Param(1.0, unit="m")}
    with pytest.raises(error) as said:
        xp.PhysicsEngine(up="z").add_law(type("Slip", (base,), own | members))
    return str(said.value)


SLIPS: dict[str, tuple[Callable[..., Any], str]] = {
    "forgotten self": (lambda self, body: -k * body.position, r"name 'k' is not defined\. Write self\.k\."),  # type: ignore[name-defined]  # noqa: F821
    "forgotten body": (lambda self, body: -self.k * position, r"Write body\.position\."),  # type: ignore[name-defined]  # noqa: F821
    "parameter": (lambda self, body: -self.neer * body.position, r"declares: c, k, near\. Did you mean \"near\"\?"),
    "one argument": (
        lambda self: self.k,
        r"takes 1 positional argument but 2 were given\. .*At test_newcomers\.py:\d+: ",
    ),
    "abbreviation": (lambda self, body: -self.k * body.pos, r"Did you mean \"position\"\?"),
    "all bodies": (lambda self, body: [-self.k * one.position for one in body], r"leave the loop out"),
    "no keepdims": (
        lambda self, body: self.k * np.linalg.norm(body.position, axis=1) * body.position,
        r"with axis=1; .*v\.norm\(\) or keepdims=True",
    ),
    "list of three": (lambda self, body: [-self.k * body.position.x, 0, 0], r"xp\.vector\(fx, fy, fz\)\. At test_new"),
    "a number": (lambda self, body: 5.0, r"returned 5\.0; .* At test_newcomers\.py:\d+: .a number.: "),
    "nothing": (lambda self, body: None, r"is a `return` missing\? .* At test_newcomers\.py:\d+: .nothing.: "),
    "random": (
        lambda self, body: self.k * random.random() * body.position,
        r"random numbers.* At test_newcomers\.py:\d+: lambda self, body: self\.k \* random",
    ),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_told_with_its_line_and_the_way_out(slip: str) -> None:
    force, expected = SLIPS[slip]
    assert re.search(expected, told(force=force)), told(force=force)


def test_a_method_without_self_is_told_how_it_begins() -> None:
    def force(body: Any) -> Any:
        return body.k * body.position

    assert re.search(r"Write def force\(self, body\)\. At test_newcomers\.py:\d+: def force\(body", told(force=force))


def test_a_parameter_without_a_unit_is_told_the_unit() -> None:
    said = told(xp.errors.DimensionError, force=lambda self, body: -self.c * body.velocity.norm() * body.velocity)
    assert "Hint: kg/m is missing, and c has no unit: Param(..., unit='kg/m')" in said


def test_a_number_of_the_text_is_told_the_unit_that_it_needs() -> None:
    said = told(xp.errors.DimensionError, force=lambda self, body: body.mass * (0, 0, -9.81))
    assert "Constant(9.81, unit='m/s^2')" in said


def test_a_chain_of_comparisons_is_shown_unchained() -> None:
    def force(self: Any, body: Any) -> Any:
        return xp.where(0 < body.position.z < self.near, -self.k * body.position, 0)

    def branch(self: Any, body: Any) -> Any:
        if 0 < body.position.z < self.near:
            return -self.k * body.position
        return 0

    assert "(0 < body.position.z) & (body.position.z < self.near)" in told(xp.errors.TracedBranchError, force=force)
    assert "np.where((0 < body.position.z) & (body" in told(xp.errors.TracedBranchError, force=branch)


def test_filling_a_numpy_array_is_told_of_vector() -> None:
    def force(self: Any, body: Any) -> Any:
        found = np.zeros(3)
        found[2] = -self.k * body.position.z
        return found

    assert "xp.vector(x, y, z)" in told(xp.errors.TracedBranchError, force=force)


def test_a_formula_may_be_printed_with_a_format(capsys: pytest.CaptureFixture[str]) -> None:
    def force(self: Any, body: Any) -> Any:
        print(f"{body.position.z:.3f}")
        return -self.k * body.position

    xp.PhysicsEngine().add_law(
        type("Talks", (xp.FieldLaw,), {"id": "mine:talks", "k": xp.Param(1.0, unit="N/m"), "force": force})
    )
    assert "<traced value of shape (n, 1)>" in capsys.readouterr().out


def test_a_law_whose_init_forgets_its_parent_is_told_so() -> None:
    assert "begin it with super().__init__" in told(
        xp.errors.LawDefinitionError, __init__=lambda self: None, force=lambda self, body: 0
    )


def test_text_is_no_default_of_a_number() -> None:
    with pytest.raises(xp.errors.LawDefinitionError, match=r"Param\(1.0, unit='N/m'\)"):
        xp.Param("1 N/m", unit="N/m")


def test_a_slip_in_the_name_of_a_live_parameter_is_no_new_attribute() -> None:
    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity")
    with pytest.raises(xp.errors.ParameterError, match=r'no parameter .aceleration.; .* Did you mean "acceleration"'):
        gravity.aceleration = 1.62  # type: ignore[attr-defined]
    gravity.colour = "blue"  # type: ignore[attr-defined]
    gravity.acceleration = 1.62  # type: ignore[attr-defined]
    assert gravity.parameters["acceleration"] == 1.62 and not hasattr(gravity, "aceleration")


@pytest.mark.parametrize(("unit", "meant"), [("Nm", "N*m"), ("kg*m/s2", "s^2"), ("N m-1", "m^-1")])
def test_units_as_they_are_often_typed_are_told_how_to_write_them(unit: str, meant: str) -> None:
    with pytest.raises(xp.errors.UnitError, match=re.escape(meant)):
        xp.units.parse(unit)


def test_a_column_that_nobody_declares_is_told_how_to_declare_it() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(type("Push", (xp.FieldLaw,), {"id": "mine:push", "E": xp.Param((1.0, 0.0, 0.0), unit="V/m"),
                                                       "force": lambda self, body: body.loading * self.E}))  # fmt: skip
    engine.add_object(xp.PhysicalObject(), laws=[law])
    with pytest.raises(LawFailedError, match=r'columns = \{"loading": xp\.Column'):
        engine.run(until=1.0, dt=0.1)


def test_torque_along_the_way_is_not_said_to_be_none() -> None:
    engine = xp.PhysicsEngine()
    law = engine.add_law(
        type("Magnet", (xp.FieldLaw,), {"id": "mine:magnet", "m": xp.Param((1.0, 0.0, 0.0), unit="N m"),
                                        "torque": lambda self, body: body.to_world((1, 0, 0)).cross(self.m)})
    )  # fmt: skip
    engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), orientation=(0.8, 0, 0, 0.6)), laws=[law])
    engine.run(until=0.1, dt=0.01)
    assert engine.explain().data["groups"][0]["because"] == "laws along the way: mine:magnet; no stored torque"


@pytest.mark.parametrize("compile", ["never", "always"])
def test_who_leaves_a_table_is_told_its_ends(compile: str) -> None:
    class Thin(xp.FieldLaw):
        """Air that is known up to 1 km."""

        id = "mine:thin"
        density = xp.Table((0, 1), (1.2, 1.1), unit_x="km", unit="kg/m^3")
        area = xp.Param(1.0, unit="m^2")

        def force(self, body: Any) -> Any:
            return -self.density(body.position.z) * self.area * body.velocity.norm() * body.velocity

    engine = xp.PhysicsEngine(up="z", compile=compile)
    engine.add_object(xp.PhysicalObject(position=(0, 0, 5000), velocity=(1, 0, 0)), laws=[engine.add_law(Thin)])
    with pytest.raises(LawFailedError, match=r'density goes from 0 to 1000 m, unless it has outside="hold"'):
        engine.run(until=0.1, dt=0.01)


def test_a_table_that_is_not_called_is_told_of() -> None:
    class Bare(xp.FieldLaw):
        """A table, taken for a number."""

        id = "mine:bare"
        density = xp.Table((0, 1), (1.2, 1.1), unit_x="km", unit="kg/m^3")

        def force(self, body: Any) -> Any:
            return -self.density * body.velocity

    with pytest.raises(TraceError, match=r"A table is called like a function: self\.table\(x\)"):
        xp.PhysicsEngine().add_law(Bare)


@pytest.mark.parametrize(
    ("body", "whole"),
    [
        ("if velocity[0] > 0.0:\n        return velocity", False),
        ("if velocity[0] > 0.0:\n        return velocity\n    else:\n        return (0.0, 0.0, 0.0)", True),
        ("while True:\n        return velocity", True),
        ("while True:\n        break", False),
        ("for k in range(3):\n        return velocity", False),
    ],
)
def test_a_kernel_file_that_may_end_without_a_return_is_refused_in_every_tier(
    body: str, whole: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "halfway.py").write_text(f"def force(velocity):\n    {body}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    engine = xp.PhysicsEngine()
    law = type("Half", (xp.FieldLaw,), {"id": "mine:half", "kernel": "halfway"})

    def run() -> None:
        engine.add_object(xp.PhysicalObject(velocity=(-1, 0, 0)), laws=[engine.add_law(law)])
        engine.run(until=0.1, dt=0.01)

    if whole:
        run()
    else:
        with pytest.raises(
            xp.errors.LawDefinitionError, match=r"halfway\.py:1: force may come to its end without a `return`"
        ):
            run()


def test_a_class_of_ones_own_that_a_checkpoint_lacks_is_asked_for() -> None:
    engine = xp.PhysicsEngine()
    push = {"id": "mine:push", "F": xp.Param((1.0, 0.0, 0.0), unit="N"), "force": lambda self, body: self.F}
    engine.add_law(type("Push", (xp.FieldLaw,), push))
    with pytest.raises(UnknownLawError, match=r"restore\(\.\.\., laws=\[TheClass\]\)"):
        xp.PhysicsEngine.restore(engine.checkpoint())


@pytest.mark.parametrize("compile", ["never", "always"])
def test_who_flies_off_in_steps_that_are_too_long_is_told_so(compile: str) -> None:
    engine = xp.PhysicsEngine(compile=compile, stepper="core:midpoint")
    spring = engine.add_law("basic:spring_to_point", stiffness=1e6)
    engine.add_object(xp.PhysicalObject(position=(1, 0, 0)), laws=[spring])
    with (
        pytest.warns(ResolutionWarning, match=r"unstable beyond dt = 0.002 s"),
        pytest.raises(LawFailedError, match=r"dt may be too long for this law"),
    ):
        engine.run(until=100.0, dt=0.1)
