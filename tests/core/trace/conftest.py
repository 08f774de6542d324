"""Traced values beside NumPy's own: the same formula on both, and the graph's numbers in NumPy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from xpheve.laws import Column
from xpheve.laws.view import Batch, BodyView
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Node
from xpheve.trace.recording import Recording
from xpheve.trace.shadow import TracedBody
from xpheve.trace.values import Form, Traced

Array = NDArray[np.float64]

COUNT = 7  # objects: no number of components, so that shapes tell them apart


class Bench:
    """Bodies in NumPy, and the same bodies traced; ``wind`` is a vector parameter of both."""

    def __init__(self, seed: int = 1, count: int = COUNT, check_dimensions: bool = False) -> None:
        chance = np.random.default_rng(seed)
        self.count = count
        q = chance.normal(size=(count, 4))
        self.state: dict[str, Any] = {
            "position": chance.normal(size=(count, 3)),
            "velocity": chance.normal(size=(count, 3)),
            "orientation": q / np.linalg.norm(q, axis=1)[:, None],
            "mass": chance.uniform(0.5, 2.0, count),
            "charge": chance.normal(size=count),
            "time": 0.75,
            "up": np.array((0.0, 0.0, 1.0)),
        }
        self.body = BodyView(
            lambda name: np.copy(self.state[name]) if np.ndim(self.state[name]) else self.state[name], set(), count
        )
        self.wind = np.array((0.5, -1.0, 2.0)).view(Batch)
        self.parameters: dict[str, Any] = {"wind": self.wind}
        self.recording = Recording("test:law")
        self.recording.graph.check_dimensions = check_dimensions
        self.traced_body = TracedBody(self.recording, {"charge": Column(unit="C")}, "")
        nodes = [self.recording.graph.param("wind", k) for k in range(3)]
        self.traced_wind = Traced(self.recording, nodes, Form(False, 3), locked="self.wind")

    def shape_of(self, value: Traced) -> tuple[int, ...]:
        """Shape that ``value`` has with these bodies."""
        return (self.count,) * value.form.each + (() if value.form.width is None else (value.form.width,))

    def numbers(self, value: Traced) -> Any:
        """What the array text of ``value`` gives, in the shape of ``value``."""
        columns = [np.broadcast_to(one, (self.count,)) for one in self.run(list(value.nodes))]
        if not value.form.each:
            columns = [column[:1] for column in columns]
        return np.stack(columns, axis=1).reshape(self.shape_of(value))

    def run(self, nodes: list[Node]) -> list[Any]:
        """What the array text of ``nodes`` gives."""

        def given(node: Node) -> Any:
            if node.op == "param":
                return float(np.atleast_1d(self.parameters[node.value.name])[node.value.component])
            value = np.asarray(self.state[node.value.name])
            if node.value.name == "up":
                return value[node.value.component]
            return value[:, node.value.component] if value.ndim == 2 else value

        leaves: dict[str, Any] = {"np": np, "math": math}

        def leaf(node: Node) -> str:
            leaves[f"given{node.index}"] = given(node)
            return f"given{node.index}"

        writer = Writer(leaf, arrays=True)
        names = writer.write(nodes)
        with np.errstate(all="ignore"):
            exec("\n".join(writer.lines), leaves)
            return [eval(name, leaves) for name in names]

    def same(self, formula: Callable[[Any, Any], Any], rtol: float = 0.0) -> Any:
        """Assert that ``formula(body, wind)`` says the same in NumPy and traced, shape and bits (or to ``rtol``); return it."""
        with np.errstate(all="ignore"):
            expected = np.asarray(formula(self.body, self.wind))
        value = formula(self.traced_body, self.traced_wind)
        assert self.shape_of(value) == expected.shape
        found = self.numbers(value)
        np.testing.assert_allclose(found, expected, rtol=rtol, atol=0.0)
        return expected


@pytest.fixture
def bench() -> Bench:
    """Return a bench without dimensions checked."""
    return Bench()


@pytest.fixture(scope="session")
def make_bench() -> type[Bench]:
    """Return the class of benches."""
    return Bench
