"""What a response is given while it is read."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import pytest

import xpheve as xp
from xpheve.errors import TraceError
from xpheve.laws import Column, Contact, ResponseLaw
from xpheve.trace.plain_python import Doors
from xpheve.trace.response_shadow import TracedContact, response_shadow
from xpheve.trace.values import Traced


class Law(ResponseLaw):
    """Attributes of all kinds."""

    id = "test:shadow"
    columns: ClassVar[dict[str, Column]] = {"heat": Column(300.0, unit="K")}
    e = xp.Param(0.5, unit="1")
    wind = xp.Param((1.0, 2.0, 3.0), unit="m/s")
    mode = xp.Param("soft", choices=("soft", "hard"))
    limit = xp.Constant(4.0, unit="m/s")
    table = {"a": 1}  # noqa: RUF012

    def respond(self, contact: Contact) -> float:
        return 0.0

    def helper(self, x: Any) -> Any:
        return self.e * x

    @property
    def twice(self) -> Any:
        return 2.0 * self.e

    @staticmethod
    def root(x: Any) -> Any:
        return math.sqrt(x)


@pytest.fixture
def doors() -> Doors:
    return Doors()


@pytest.fixture
def contact(doors: Doors) -> Any:
    return TracedContact(doors.recording, Law(), ["heat"], doors)


@pytest.fixture
def shadow(doors: Doors) -> Any:
    return response_shadow(Law(), doors.recording, doors)


def test_vectors_are_tuples_as_those_of_objects_are(contact: Any, shadow: Any) -> None:
    assert isinstance(contact.normal, tuple) and len(contact.normal) == 3
    assert len(contact.body_a.position + contact.body_b.velocity) == 6
    assert len(contact.body_a.orientation) == 4 and len(shadow.wind) == 3


def test_numbers_are_inputs_of_their_side(contact: Any) -> None:
    assert str(contact.approach_speed.nodes[0].value.name) == "approach_speed"
    node = contact.body_b.velocity[1].nodes[0]
    assert (node.value.side, node.value.name, node.value.component) == ("b", "velocity", 1)
    assert contact.body_a["heat"].nodes[0] is contact.body_a.heat.nodes[0]


def test_what_is_fixed_is_asked_of_the_inverse_mass_and_nothing_is_driven(contact: Any) -> None:
    assert contact.body_a.fixed.is_truth and contact.body_a.fixed.nodes[0].args[0].value.name == "inverse_mass"
    assert contact.body_a.driven is False


def test_a_radius_is_there_if_the_shape_has_one(contact: Any, doors: Doors) -> None:
    doors.recording.ways[0].prefix = [False]
    assert isinstance(contact.body_a.shape.radius, Traced)
    doors.recording.ways[0].prefix = [False, True]
    with pytest.raises(TraceError, match="no sphere"):
        _ = contact.body_b.shape.radius


def test_impulses_are_not_yet_known(contact: Any) -> None:
    assert math.isnan(contact.impulse)


@pytest.mark.parametrize(
    ("use", "said"),
    [
        (lambda c: c.body_a.name, "body_a.name"),
        (lambda c: c.body_a["cold"], "'cold'"),
        (lambda c: c.body_a.shape.half_edges, "shape.half_edges"),
        (lambda c: c.depth, "contact.depth"),
        (lambda c: c.body_a == c.body_b, "compares"),
        (lambda c: setattr(c.body_a, "mass", 1.0), "changes"),
        (lambda c: c.body_a.add_force(1), "add_force"),
        (lambda c: setattr(c, "normal", 1.0), "contact"),
        (lambda c: c == 1, "contact"),
    ],
)
def test_what_compiled_code_does_not_have_is_refused(use: Any, said: str, contact: Any) -> None:
    with pytest.raises(TraceError, match=said):
        use(contact)


def test_parameters_are_traced_and_choices_are_not(shadow: Any) -> None:
    assert shadow.e.nodes[0].op == "param" and shadow.mode == "soft" and shadow.limit.nodes[0].value == 4.0


def test_methods_run_on_the_shadow(shadow: Any) -> None:
    assert shadow.helper(2.0).nodes[0].op == "*"
    assert shadow.twice.nodes[0].op == "*"
    assert shadow.root(shadow.e).nodes[0].op == "sqrt"


@pytest.mark.parametrize("name", ["random", "state", "engine", "objects", "evaluations", "parameters", "table", "name"])
def test_what_is_no_formula_is_refused(name: str, shadow: Any) -> None:
    with pytest.raises(TraceError, match=f"self.{name}"):
        getattr(shadow, name)


def test_a_law_is_not_set(shadow: Any) -> None:
    with pytest.raises(TraceError, match=r"sets self\.count"):
        shadow.count = 1
