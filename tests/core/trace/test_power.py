"""Power and change of potential, as numbers that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

import xpheve_laws_basic as basic
from xpheve.trace.graph import Input, Parameter
from xpheve.trace.numpy_text import array_function
from xpheve.trace.power import balance
from xpheve.trace.recorder import trace_law
from xpheve.trace.samples import States


def test_the_power_of_a_spring_is_what_its_potential_loses() -> None:
    trace = trace_law(basic.Spring())
    assert trace is not None
    found = balance(trace)
    given = {Input(side, name, k): np.zeros(1) for side in "ab" for name in ("position", "velocity") for k in range(3)}
    given[Input("a", "position", 0)] = np.array([3.0])
    given[Input("a", "velocity", 0)] = np.array([2.0])
    given[Input("b", "velocity", 0)] = np.array([-1.0])
    power, rate = array_function([found.power, found.rate])(
        given, {Parameter("stiffness", 0): 5.0, Parameter("rest_length", 0): 1.0}
    )
    assert float(power[0]) == pytest.approx(-5.0 * (3.0 - 1.0) * (2.0 + 1.0)) and float(rate[0]) == -float(power[0])


def test_a_quaternion_turns_as_angular_velocity_says() -> None:
    """The rate of an orientation-dependent energy is its change over a small turn about the world axis w."""
    from xpheve.kernels.quaternion import from_rotation_vector, multiply
    from xpheve.trace.graph import Graph
    from xpheve.trace.law_trace import LawTrace

    graph = Graph()
    q = [graph.input("orientation", k) for k in range(4)]
    weights = (0.3, -1.2, 0.7, 2.0)
    energy = graph.const(0.0)
    for weight, one in zip(weights, q, strict=True):
        energy = graph.op("+", energy, graph.op("*", graph.const(weight), graph.op("*", one, one)))
    found = balance(LawTrace("mine:turned", False, graph, None, None, energy))
    states = States(basic.Thrust(), False, 5)
    run = array_function([found.rate, energy])
    w = states.array("", "angular_velocity") / 1e3
    inputs = {Input("", "orientation", k): states.array("", "orientation")[:, k] for k in range(4)}
    inputs |= {Input("", "angular_velocity", k): w[:, k] for k in range(3)}
    rate = run(inputs, {})[0]
    h = 1e-4
    for row in range(5):
        energies = []
        for sign in (1.0, -1.0):
            turn = from_rotation_vector((sign * h * w[row, 0], sign * h * w[row, 1], sign * h * w[row, 2]))
            turned = multiply(turn, tuple(states.array("", "orientation")[row].tolist()))  # type: ignore[arg-type]
            energies.append(sum(weight * one * one for weight, one in zip(weights, turned, strict=True)))
        assert rate[row] == pytest.approx((energies[0] - energies[1]) / (2 * h), abs=1e-9)


def test_a_torque_that_the_potential_does_not_know_is_kept_apart() -> None:
    trace = trace_law(basic.RotatingFrame())
    assert trace is not None
    found = balance(trace)
    names = {one.name for one in array_function([found.power, found.rate]).inputs}
    assert names == {"position", "velocity", "mass"}
    assert "orientation" in {one.name for one in array_function([found.turning]).inputs}
