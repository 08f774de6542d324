"""States to try laws at: always the same, of all sizes, within what columns and parameters allow."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

import xpheve as xp
import xpheve_laws_basic as basic
from xpheve.trace.samples import States, variants


def test_states_are_the_same_each_time() -> None:
    one, other = (States(basic.Wind(), False, 12) for _ in range(2))
    for name in ("position", "velocity", "orientation", "mass", "inertia", "time", "up", "drag_area"):
        assert one.array("", name).tobytes() == other.array("", name).tobytes()
    assert States(basic.Wind(), False, 12, seed=5).array("", "mass").tobytes() != one.array("", "mass").tobytes()


def test_states_have_all_sizes_and_some_are_at_rest() -> None:
    states = States(basic.Wind(), False, 200)
    size = np.linalg.norm(states.array("", "position"), axis=1)
    assert size.min() < 1e-2 and size.max() > 1e2 and (np.isfinite(size)).all()
    still = ~states.array("", "velocity").any(axis=1)
    assert still.sum() == 50 and [states.at_rest(row, "") for row in range(8)] == [False, False, False, True] * 2
    assert np.abs(np.linalg.norm(states.array("", "orientation"), axis=1) - 1.0).max() < 1e-15
    moments = np.sort(states.array("", "inertia"), axis=1)
    assert (moments[:, 0] + moments[:, 1] >= moments[:, 2]).all() and moments.min() > 0.0
    assert (states.array("", "since") <= states.array("", "time")).all()


def test_of_a_pair_one_side_is_at_rest_in_turn() -> None:
    states = States(basic.Spring(), True, 6)
    rest = [(states.at_rest(row, "a"), states.at_rest(row, "b")) for row in range(3)]
    assert rest == [(True, False), (False, True), (False, False)]


def test_columns_keep_their_bounds() -> None:
    class Bounded(xp.FieldLaw):
        """Has columns of all kinds."""

        id = "mine:bounded"
        columns: ClassVar[dict[str, xp.Column]] = {
            "share": xp.Column(0.5, ge=0, lt=1),
            "free": xp.Column(0.0),
            "small": xp.Column(-1.0, lt=0),
            "large": xp.Column(3.0, gt=2),
        }

        def force(self, body: Any) -> Any:
            return 0.0

    states = States(Bounded(), False, 100)
    share, free, small, large = (states.array("", name) for name in ("share", "free", "small", "large"))
    assert share.min() >= 0.0 and share.max() < 1.0 and small.max() < 0.0 and large.min() > 2.0
    assert free.min() < 0.0 < free.max()


def test_variants_keep_bounds_directions_and_what_is_no_number() -> None:
    law = basic.Thrust(thrust=(0.0, 3.0, 4.0), delay=1.0)
    first, *others = variants(law, 6)
    assert first is law and len(others) == 5
    for other in others:
        assert (
            other.parameters["duration"] is None
            and other.parameters["delay"] > 0.0
            and other.parameters["delay"] != 1.0
        )
        x, y, z = other.parameters["thrust"]
        assert x == 0.0 and abs(y / z - 0.75) < 1e-15
    assert law.parameters["delay"] == 1.0
    assert all(one.parameters["rest_length"] >= 0.0 for one in variants(basic.Spring(), 20))


def test_views_are_those_that_laws_get() -> None:
    states = States(basic.Wind(), False, 5)
    body = states.view("")
    assert (
        body.position.shape == (5, 3)
        and body.mass.shape == (5, 1)
        and body.up.shape == (3,)
        and isinstance(body.time, float)
    )
    assert np.array_equal(np.asarray(states.view("", [3, 1]).position), states.array("", "position")[[3, 1]])
