"""The driver of compositions: any cut of a run into calls gives the same bits, and the nodes are where they belong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xpheve.compile import assemble, compiled, interpreted
from xpheve.loop.drivers import driver_text
from xpheve.steppers.symplectic import COMPOSED_8, LEAPFROG, Method

# Two rows of which the first moves: an oscillator about the place of the second.
FORCES = """
def forces(f, n, x, v, a, w, now):
    s = f[0]
    for c in range(3):
        s[a + 2 * c] = s[x + 2 * c + 1] - s[x + 2 * c]
        s[a + 2 * c + 1] = 0.0
    return 1
"""
TEXT = assemble(FORCES + driver_text("composition"))
SIZES = (6, 6, 6, 6, 6, 6, 6, 6, 12, 54)
START = (1.0, 0.25, 0.0, 0.0, 0.0, 0.0)


class Run:
    """Buffers for the oscillator, and what became of them."""

    def __init__(self, method: Method, kernel: Any) -> None:
        weights = [0.0] * (2 * len(method.kicks) - 1)
        weights[::2], weights[1::2] = method.kicks, method.drifts
        head = [0.0, 0.0, 0.1, *weights, *method.turns]
        places = len(head) + np.cumsum([0, *SIZES])
        self.s = np.concatenate([head, START, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0], np.zeros(sum(SIZES[2:]))])
        shared = [0, 0, 0, 0, 0, 0, 0, 0]
        self.d = np.array([*shared, 0, 0, len(method.drifts), len(method.turns), 3, *places[:-1]], dtype=np.int64)
        self.nodes = int(places[-2])
        self.kernel, self.made, self.calls = kernel, 0, 0

    def go(self, steps: int, budget: int = 1_000_000) -> Run:
        """Make ``steps`` more, in calls of at least ``budget`` evaluations."""
        end, none = self.made + steps, np.zeros(1)
        while self.made < end:
            self.d[1], self.d[8], self.s[1] = self.d[0] + budget, end - self.made, float(self.made)
            counts, nothing = np.array([0, 2, 1, 0]), np.zeros(1, dtype=np.int64)
            self.made += self.kernel([self.s, none, none, none, none], [counts, nothing, self.d])
            self.calls += 1
        return self

    def state(self) -> list[float]:
        """Places, velocities, and what their sums have left over, and the three nodes."""
        found: list[float] = self.s[int(self.d[13]) : int(self.d[13]) + 12].tolist()
        return found + self.s[int(self.d[17]) : int(self.d[19])].tolist() + self.s[self.nodes :].tolist()


@pytest.mark.parametrize("method", [LEAPFROG, COMPOSED_8], ids=["kick first", "drift first"])
def test_any_cut_of_a_run_gives_the_same_bits(method: Method) -> None:
    kernel = interpreted(TEXT)
    whole = Run(method, kernel).go(30)
    assert whole.calls == 1
    for pieces, budget in (([1] * 30, 10**6), ([7, 1, 22], 10**6), ([30], 40), ([30], 1), ([29, 1], 100)):
        run = Run(method, kernel)
        for steps in pieces:
            run.go(steps, budget)
        assert run.state() == whole.state()


@pytest.mark.parametrize("method", [LEAPFROG, COMPOSED_8], ids=["kick first", "drift first"])
def test_interpreted_and_compiled_give_the_same_bits(method: Method) -> None:
    runs = [
        Run(method, make(TEXT)).go(50, 77).state() for make in (interpreted, lambda text: compiled(text, what="test"))
    ]
    assert runs[0] == runs[1]


def test_nodes_are_the_states_around_the_last_two_steps() -> None:
    run = Run(COMPOSED_8, interpreted(TEXT)).go(20)
    nodes = run.s[run.nodes :].reshape(3, 3, 3, 2)[:, :, 0, 0]
    for node, t in zip(nodes, (1.8, 1.9, 2.0), strict=True):
        exact = 0.25 + 0.75 * np.cos(t), -0.75 * np.sin(t), -0.75 * np.cos(t)
        assert np.abs(node - exact).max() < 4e-14


def test_what_only_acts_stays() -> None:
    run = Run(LEAPFROG, interpreted(TEXT)).go(100)
    assert run.state()[1] == 0.25 and run.state()[7] == 0.0
