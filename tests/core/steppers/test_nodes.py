"""The polynomials between steps go through their nodes, and are of the degree that they claim."""

from __future__ import annotations

import math

import numpy as np
import pytest

from xpheve.steppers.nodes import Node, cubic, octic


def node_of(t: float, rate: float = 1.7) -> Node:
    """Place, first and second derivative of sin(rate t) and exp(-t), which are two rows of one component."""
    parts = (
        [math.sin(rate * t), math.exp(-t)],
        [rate * math.cos(rate * t), -math.exp(-t)],
        [-(rate**2) * math.sin(rate * t), math.exp(-t)],
    )
    return Node(*(np.array([part]) for part in parts))


def row(*values: float) -> np.ndarray:
    return np.array([values])


@pytest.mark.parametrize("ago", [-0.3, 0.15])
def test_it_meets_its_nodes(ago: float) -> None:
    nodes = node_of(1.0), node_of(1.3), node_of(1.0 + ago)
    for s, node in ((0.0, nodes[0]), (0.3, nodes[1]), (ago, nodes[2])):
        place, rate = octic(*nodes, row(0.3, 0.3), row(ago, ago)).at(row(s, s))
        assert np.abs(place - node.place).max() < 1e-15 and np.abs(rate - node.rate).max() < 1e-13
    place, rate = octic(*nodes, row(0.3, 0.3), row(ago, ago)).at(row(0.0, 0.0))
    assert (place == nodes[0].place).all() and (rate == nodes[0].rate).all()


@pytest.mark.parametrize(("name", "order"), [("octic", 9), ("cubic", 4)])
def test_the_error_is_that_of_its_degree(name: str, order: int) -> None:
    def worst(h: float) -> tuple[float, float]:
        begin, end, earlier = node_of(1.0), node_of(1.0 + h), node_of(1.0 - h)
        gaps = []
        for part in (0.2, 0.5, 0.8):
            s = row(part * h, part * h)
            if name == "octic":
                place, rate = octic(begin, end, earlier, row(h, h), row(-h, -h)).at(s)
            else:
                place, rate = cubic(begin, end, row(h, h)).at(s)
            true = node_of(1.0 + part * h)
            gaps.append((np.abs(place - true.place).max(), np.abs(rate - true.rate).max()))
        return max(one for one, _ in gaps), max(one for _, one in gaps)

    coarse, fine = (worst(h) for h in ((0.8, 0.4) if order == 9 else (0.2, 0.1)))
    assert math.log2(coarse[0] / fine[0]) == pytest.approx(order, abs=0.4)
    assert math.log2(coarse[1] / fine[1]) == pytest.approx(order - 1, abs=0.4)


def test_polynomials_of_degree_8_are_met_to_rounding() -> None:
    rng = np.random.default_rng(3)
    p = np.polynomial.Polynomial(rng.normal(size=9))

    def at(t: float) -> Node:
        return Node(*(np.array([[part(t)]]) for part in (p, p.deriv(), p.deriv(2))))

    for s in (-0.1, 0.05, 0.25, 0.4):
        place, rate = octic(at(0.0), at(0.3), at(-0.2), row(0.3), row(-0.2)).at(row(s))
        assert place[0, 0] == pytest.approx(p(s), abs=3e-14)
        assert rate[0, 0] == pytest.approx(p.deriv()(s), abs=1e-12)
