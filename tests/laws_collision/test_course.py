"""Ways as functions of time: curves are interpolated to rounding, piece by piece, as far as is asked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from xpheve.errors import StateError
from xpheve.kernels.clock import Instant, elapsed, later
from xpheve_laws_collision.impact_time.course import Course, Parabola, Since, segments

BEGIN: Instant = (2.0, 1e-17)


def circle(rate: float) -> Any:
    """A point that goes round, read as a stepper reads."""

    def read(name: str, at: Sequence[Instant]) -> Any:
        angle = rate * np.array([elapsed(t, BEGIN) for t in at])
        x, y = np.cos(angle), np.sin(angle)
        return np.array([x, y, 0 * x]) if name == "position" else rate * np.array([-y, x, 0 * x])

    return read


@pytest.mark.parametrize("rate", [1.0, 50.0])
def test_a_curve_is_known_to_rounding_between_its_points(rate: float) -> None:
    course = Course(circle(rate), BEGIN, later(BEGIN, 3.0))
    for piece in course.pieces():
        s = np.linspace(piece.low, piece.high, 41)[1:-1]
        track = Since(course, 0.0)
        assert np.abs(track.place(s) - circle(rate)("position", [later(BEGIN, c) for c in s])).max() < 1e-13
        assert np.abs(track.speed(s) - circle(rate)("velocity", [later(BEGIN, c) for c in s])).max() < 1e-13 * rate
    assert course.most() >= rate * rate * (1.0 - 1e-12)
    found = course.acceleration(1.0)
    assert (
        found is not None
        and math.dist(found, (-rate * rate * math.cos(rate), -rate * rate * math.sin(rate), 0.0)) < 1e-9 * rate**2
    )


def test_pieces_are_made_from_left_to_right_as_far_as_is_asked() -> None:
    course = Course(circle(200.0), BEGIN, later(BEGIN, 3.0))
    first = course.piece_at(0.0)
    assert first is not None and first.low == 0.0 and first.high < 0.2
    assert course.reads < 25 * 10


def test_what_cannot_be_read_ends_the_course_before() -> None:
    def read(name: str, at: Sequence[Instant]) -> Any:
        s = np.array([1.0 - elapsed(t, BEGIN) for t in at])
        if (s <= 0.0).any():
            raise StateError("fallen into the centre")
        root = np.sqrt(s)
        return np.array([root, 0 * s, 0 * s]) if name == "position" else np.array([-0.5 / root, 0 * s, 0 * s])

    course = Course(read, BEGIN, later(BEGIN, 2.0))
    end = list(segments([Since(course, 0.0)], 0.0, 2.0))[-1][1]
    assert 0.9 < end <= 1.0
    assert course.most() == math.inf


def test_boxes_hold_all_places() -> None:
    course = Since(Course(circle(3.0), BEGIN, later(BEGIN, 1.0)), 0.25)
    fall = Parabola((0.0, 1.0, 0.0), (1.0, 2.0, 3.0), (0.0, 0.0, -9.81))
    s = np.linspace(0.0, 0.5, 33)
    for track in (course, fall):
        middle, edges = track.box(0.0, 0.5)
        assert (np.abs(track.place(s) - middle[:, None]) <= edges[:, None] * (1.0 + 1e-12) + 1e-15).all()


def test_segments_end_where_a_piece_of_either_does() -> None:
    one, two = (Since(Course(circle(rate), BEGIN, later(BEGIN, 3.0)), 0.0) for rate in (20.0, 33.0))
    parts = list(segments([one, two, Parabola((0.0,) * 3, (0.0,) * 3, (0.0,) * 3)], 0.1, 2.9))
    assert parts[0][0] == 0.1 and parts[-1][1] == 2.9
    assert all(a[1] == b[0] for a, b in pairwise(parts))
    ends = {piece.high for track in (one, two) for piece in track.course.pieces()}
    assert all(high in ends for _, high in parts[:-1])
