"""What tracing a law gives: its numbers, what it reads, and when it is done again."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp
import xpheve_laws_basic as basic
from xpheve.errors import TraceError
from xpheve.laws import PairLaw
from xpheve.laws.view import BodyView
from xpheve.trace import recorder
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Node
from xpheve.trace.recorder import trace_law, why_untraced
from xpheve.trace.shadow import as_arrays

COUNT = 6
SHIPPED: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in basic.__all__ if name not in ("BlackHoleGravity", "UniversalGravity", "Coulomb")),
    ("BlackHoleGravity", {"gravitational_constant": 1.0, "mass": 2.0, "speed_of_light": 30.0, "position": (1.0, 2.0, 3.0)}),
    ("UniversalGravity", {"gravitational_constant": 1.5, "softening": 0.5}),
    ("Coulomb", {"coulomb_constant": 1.0, "relative_permittivity": 2.0}),
    ("Buoyancy", {"surface": 0.1}),
    ("PlanetGravity", {"direction": (0.0, 1.0, -1.0)}),
    ("Thrust", {"thrust": (1.0, 2.0, 3.0), "delay": 0.2}),
    ("Thrust", {"thrust": (1.0, 2.0, 3.0), "delay": 0.2, "duration": 0.3}),
    ("RotatingFrame", {"angular_velocity": (0.1, -0.2, 0.3), "point": (1.0, 0.0, 0.0)}),
    ("ElectricField", {"field": (1.0, -2.0, 0.5)}),
    ("MagneticField", {"field": (1.0, -2.0, 0.5)}),
    ("Spring", {"rest_length": 1.0}),
]  # fmt: skip


def state(seed: int) -> dict[str, Any]:
    """Return the numbers of some bodies."""
    chance = np.random.default_rng(seed)
    found: dict[str, Any] = {
        name: chance.normal(size=(COUNT, 3)) for name in ("position", "velocity", "angular_velocity")
    }
    q = chance.normal(size=(COUNT, 4))
    found |= {name: chance.uniform(0.5, 2.0, COUNT) for name in ("mass", "volume", "charge", "drag_area", "load")}
    return found | {
        "orientation": q / np.linalg.norm(q, axis=1)[:, None],
        "inertia": chance.uniform(1.0, 2.0, (COUNT, 3)),
        "displaced_volume": np.where(chance.random(COUNT) < 0.5, np.nan, chance.uniform(0.5, 2.0, COUNT)),
        "since": chance.uniform(0.0, 1.0, COUNT),
        "time": 0.75,
        "up": np.array((0.0, 0.0, 1.0)),
    }


def views(law: Any, seed: int) -> dict[str, BodyView]:
    """Return what the methods of ``law`` are given in NumPy, by side."""

    def view(numbers: dict[str, Any]) -> BodyView:
        return BodyView(lambda name: np.copy(numbers[name]) if np.ndim(numbers[name]) else numbers[name], set(), COUNT)

    sides = ("a", "b") if isinstance(law, PairLaw) else ("",)
    return {side: view(state(seed + k)) for k, side in enumerate(sides)}


def numbers_of(law: Any, nodes: list[Node], seed: int) -> list[Any]:
    """Return what the array text of ``nodes`` gives, each of shape (COUNT,)."""
    sides = ("a", "b") if isinstance(law, PairLaw) else ("",)
    states = {side: state(seed + k) for k, side in enumerate(sides)}
    known: dict[str, Any] = {"np": np, "math": math}

    def leaf(node: Node) -> str:
        if node.op == "param":
            value = law.parameters[node.value.name]
            known[f"g{node.index}"] = value[node.value.component] if isinstance(value, tuple) else value
        else:
            value = np.asarray(states.get(node.value.side, states[sides[0]])[node.value.name])
            scene = node.value.name == "up"
            known[f"g{node.index}"] = value[..., node.value.component] if scene or value.ndim == 2 else value
        return f"g{node.index}"

    writer = Writer(leaf, arrays=True)
    names = writer.write(nodes)
    with np.errstate(all="ignore"):
        exec("\n".join(writer.lines), known)
        return [np.broadcast_to(eval(name, known), (COUNT,)) for name in names]


@pytest.mark.parametrize(
    ("name", "given"), SHIPPED, ids=lambda value: value if isinstance(value, str) else " ".join(value)
)
def test_a_traced_law_of_the_library_says_what_it_says_in_numpy(name: str, given: dict[str, Any]) -> None:
    law = getattr(basic, name)(**given)
    trace = trace_law(law, columns=())
    assert trace is not None
    seen = list(views(law, 5).values())
    with np.errstate(all="ignore"):
        for method in ("force", "torque"):
            nodes = getattr(trace, method)
            assert (nodes is not None) == law.defines(method)
            if nodes is not None:
                expected = np.broadcast_to(np.asarray(getattr(as_arrays(law), method)(*seen)), (COUNT, 3))
                found = np.stack(numbers_of(law, list(nodes), 5), axis=1)
                np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-15)
        if trace.potential is not None:
            energies = np.broadcast_to(np.asarray(as_arrays(law).potential(*seen)), (COUNT, 1))[:, 0]
            np.testing.assert_allclose(numbers_of(law, [trace.potential], 5)[0], energies, rtol=1e-14, atol=1e-15)
    assert (trace.potential is not None) == law.defines("potential")
    assert trace.pair == isinstance(law, PairLaw)


READS = {
    "QuadraticDrag": {"velocity", "drag_area"},
    "PlanetGravity": {"mass", "up"},
    "Thrust": {"orientation", "time", "since"},
    "Damper": {"position", "velocity"},
    "Magnus": {"velocity", "angular_velocity", "displaced_volume", "volume"},
}


@pytest.mark.parametrize("name", sorted(READS))
def test_a_trace_knows_what_the_law_reads(name: str) -> None:
    trace = trace_law(getattr(basic, name)())
    assert trace is not None and trace.reads == READS[name]


def test_numbers_of_parameters_are_symbols_and_what_chooses_the_formula_is_not() -> None:
    one, other = basic.Wind(), basic.Wind(velocity=(1.0, 2.0, 3.0), density=2.0)
    assert trace_law(one) is trace_law(other)
    assert [p.name for p in trace_law(one).parameters] == ["coefficient", "density", *["velocity"] * 3]  # type: ignore[union-attr]
    assert trace_law(basic.Buoyancy()) is not trace_law(basic.Buoyancy(surface=0.0))
    assert trace_law(basic.Buoyancy(surface=1.0)) is trace_law(basic.Buoyancy(surface=0.0))


class Mode(xp.FieldLaw):
    """A law that text, a switch and None choose."""

    id = "test:mode"
    kind = xp.Param("linear", choices=("linear", "quadratic"))
    back = xp.Param(True)
    b = xp.Param(2.0, unit="kg/s")
    c = xp.Param(3.0, unit="kg/m")
    along = xp.Param(None, size=3)

    def force(self, body: Any) -> Any:
        sign = -1.0 if self.back else 1.0
        v = body.velocity if self.along is None else body.velocity.dot(self.along) * self.along
        return sign * (self.b * v if self.kind == "linear" else self.c * v.norm() * v)


@pytest.mark.parametrize("given", [{}, {"kind": "quadratic"}, {"back": False}, {"along": (0.0, 0.6, 0.8)}])
def test_text_switches_and_none_choose_the_formula(given: dict[str, Any]) -> None:
    law = Mode(**given)
    trace = trace_law(law)
    assert trace is not None and trace.force is not None
    expected = as_arrays(law).force(*views(law, 1).values())
    np.testing.assert_array_equal(np.stack(numbers_of(law, list(trace.force), 1), axis=1), expected)


class Loaded(xp.FieldLaw):
    """Reads a column of another law."""

    id = "test:loaded"
    k = xp.Param(1.0, unit="N/kg")

    def force(self, body: Any) -> Any:
        return self.k * body.load * (0, 0, 1)


def test_columns_of_other_laws_have_no_known_dimension_and_must_be_there() -> None:
    trace = trace_law(Loaded())
    assert trace is not None and trace.force is not None and trace.reads == {"load"}
    assert trace.force[2].dim is None
    assert trace_law(Loaded(), columns=["charge", "load"]) is trace
    with pytest.raises(
        TraceError,
        match=r'test:loaded reads body\.load, which is no property .*at hand: .*loads\. Did you mean "loads"\?',
    ):
        trace_law(Loaded(), columns=["loads"])


def test_no_force_is_nought_and_a_number_of_the_text_is_in_newtons() -> None:
    class Nothing(xp.FieldLaw):
        id = "test:nothing"

        def force(self, body: Any) -> Any:
            return 0

        def potential(self, body: Any) -> Any:
            return 1.5

    class Push(xp.FieldLaw):
        id = "test:push"

        def force(self, body: Any) -> Any:
            return (0.0, 0.0, -2.0)

    nothing, push = trace_law(Nothing()), trace_law(Push())
    assert nothing is not None and nothing.force is not None and nothing.potential is not None
    assert push is not None and push.force is not None
    assert [node.value for node in nothing.force] == [0.0] * 3 and nothing.potential.value == 1.5
    assert [node.value for node in push.force] == [0.0, 0.0, -2.0]


class Applied(xp.FieldLaw):
    """Does what no formula does."""

    id = "test:applied"

    def apply(self, body: Any) -> Any:
        return np.sort(body.velocity, axis=0)


class ByKernel(xp.FieldLaw):
    """Has a kernel file."""

    id = "test:kernel"
    kernel: ClassVar[str] = "my_pack.kernels.drag"


def test_laws_that_are_not_traced_say_why() -> None:
    assert trace_law(Applied()) is None and "apply" in why_untraced(Applied())
    assert trace_law(ByKernel()) is None and "my_pack.kernels.drag" in why_untraced(ByKernel())
    assert "called in Python" in why_untraced(xp.PhysicalLaw())
    assert why_untraced(basic.Wind()) == ""


def test_a_law_that_failed_is_read_anew() -> None:
    known = recorder._TRACES.get(Loaded, {})
    before = dict(known)
    with pytest.raises(TraceError):
        trace_law(Loaded(), columns=())
    assert dict(recorder._TRACES.get(Loaded, {})) == before


def test_loops_over_literals_are_written_out() -> None:
    class Series(xp.FieldLaw):
        id = "test:series"
        b = xp.Param(1.0, unit="kg/s")

        def force(self, body: Any) -> Any:
            force = 0.0 * self.b * body.velocity
            for k in range(4):
                force -= self.b * body.velocity / math.factorial(k)
            return force

    law = Series()
    trace = trace_law(law)
    assert trace is not None and trace.force is not None
    found = np.stack(numbers_of(law, list(trace.force), 1), axis=1)
    np.testing.assert_allclose(found, -(1 + 1 + 1 / 2 + 1 / 6) * state(1)["velocity"], rtol=1e-15)
