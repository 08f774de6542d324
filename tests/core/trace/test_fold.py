"""Graphs with the numbers of parameters in them: what follows is taken out, what is arithmetic of numbers is left."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.laws import FieldLaw, Param
from xpheve.trace.derivative import is_zero
from xpheve.trace.fold import folded
from xpheve.trace.graph import Input, Node, walk
from xpheve.trace.nature import AFFINE, degrees
from xpheve.trace.numpy_text import array_function
from xpheve.trace.recorder import trace_law
from xpheve.trace.samples import parameters_of


class Reach(FieldLaw):
    """A spring that was written in another order, with a push that comes and goes by a switch."""

    stiffness = Param(2.0, unit="N/m")
    length = Param(0.0, unit="m")
    push = Param(0.0, unit="N")

    def force(self, body: Any) -> Any:
        far = body.position.norm()
        pushed = np.where(
            self.push > 0.0,
            self.push * body.position / np.maximum(far, 1e-9 * far),
            0.0 * body.velocity * self.stiffness,
        )
        return -self.stiffness * (far - self.length) * (body.position / far) + pushed * 0.0


class Direction(FieldLaw):
    """A push of one strength along the place: not linear, however short |d| may be."""

    strength = Param(2.0, unit="N")

    def force(self, body: Any) -> Any:
        far = body.position.norm()
        return self.strength * (far / np.maximum(far, 1e-150 * far)) * (1.0, 0.0, 0.0)


def nodes_of(law: FieldLaw, inputs: dict[Input, float] | None = None) -> list[Node]:
    trace = trace_law(law)
    assert trace is not None
    return folded(trace.motion, parameters_of(law, trace.parameters), inputs)[1]


def test_a_spring_without_rest_length_is_linear_and_with_one_it_is_not() -> None:
    basic = xp.PhysicsEngine()
    for rest, linear in ((0.0, True), (0.5, False)):
        law = basic.add_law("basic:spring_to_point", stiffness=3.0, rest_length=rest)
        assert (max(degrees(nodes_of(law))) <= AFFINE) is linear


def test_a_length_goes_out_in_whatever_order_it_was_written() -> None:
    assert max(degrees(nodes_of(Reach()))) <= AFFINE
    assert max(degrees(nodes_of(Reach(length=0.1)))) > AFFINE


def test_a_folded_force_is_the_force() -> None:
    law = xp.PhysicsEngine().add_law("basic:spring_to_point", stiffness=3.0, anchor=(1.0, 2.0, 3.0))
    trace = trace_law(law)
    x = np.random.default_rng(0).normal(size=(3, 20))
    places = {Input("", "position", k): x[k] for k in range(3)}
    plain = array_function(trace.motion)(places, parameters_of(law, trace.parameters))
    found = array_function(nodes_of(law))(places, {})
    assert np.allclose(plain, found, rtol=1e-14)


def test_nothing_times_anything_is_nothing_and_arithmetic_of_numbers_is_left_standing() -> None:
    law = xp.PhysicsEngine().add_law("basic:rotating_frame", angular_velocity=(0.0, 0.0, 0.1))
    points = {Input("", "inertia", k): 0.0 for k in range(3)}
    assert all(map(is_zero, nodes_of(law, points)[3:])), "a point feels no torque"
    assert not all(map(is_zero, nodes_of(law)[3:]))
    along = nodes_of(law, points)[2]
    assert is_zero(along)
    assert any(node.op == "const" and node.value == 0.1 for node in walk(nodes_of(law, points)[:2]))


def test_a_ratio_stays_where_no_small_factor_is_beside_it() -> None:
    """u / max(u, tiny) is 0 at u = 0: only beside d, |d| <= u, it may count as 1."""
    assert max(degrees(nodes_of(Direction()))) > AFFINE


def test_a_switch_by_numbers_is_decided() -> None:
    assert not any(node.op == "where" for node in walk(nodes_of(Reach())))


@pytest.mark.parametrize("name", ["quadratic_drag", "universal_gravity", "coulomb"])
def test_what_is_not_linear_stays_so(name: str) -> None:
    law = xp.PhysicsEngine().add_law(f"basic:{name}")
    assert max(degrees(nodes_of(law))) > AFFINE
