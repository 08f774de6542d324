"""One reading of a response: what is decided, what is joined, and what may be refused."""

from __future__ import annotations

from typing import Any

import pytest

from xpheve.errors import TraceError
from xpheve.trace.response_recording import MOST_DECISIONS, ResponseRecording, Way
from xpheve.trace.values import NUMBER, Traced


@pytest.fixture
def recording() -> ResponseRecording:
    return ResponseRecording("test:law")


def number(recording: ResponseRecording, name: str) -> Traced:
    return Traced(recording, [recording.graph.input(name)], NUMBER)


def test_a_way_follows_its_prefix_and_then_says_yes(recording: ResponseRecording) -> None:
    recording.ways = [Way([False])]
    x, y = number(recording, "x"), number(recording, "y")
    assert not (x > 0.0)
    assert x > 1.0
    assert x < y
    assert [answer for _, answer in recording.ways[0].taken] == [False, True, True]
    assert list(recording.ways[0].others()) == [[False, False], [False, True, False]]


def test_the_same_question_has_the_same_answer(recording: ResponseRecording) -> None:
    recording.ways = [Way([False])]
    x = number(recording, "x")
    assert [bool(x > 0.0) for _ in range(3)] == [False] * 3
    assert bool(~(x > 0.0))
    assert len(recording.ways[0].taken) == 1


def test_questions_of_numbers_alone_are_answered(recording: ResponseRecording) -> None:
    two = Traced(recording, [recording.graph.const(2.0)], NUMBER)
    assert two > 1.0 and not two < 1.0 and not (two != 2.0)
    assert not recording.ways[0].taken


def test_and_and_or_ask_for_their_parts(recording: ResponseRecording) -> None:
    recording.ways = [Way([True, False])]
    x, y = number(recording, "x"), number(recording, "y")
    assert not ((x > 0.0) & (y > 0.0))
    assert (x > 0.0) | (y > 0.0)
    assert len(recording.ways[0].taken) == 2


def test_a_vector_is_neither_true_nor_false(recording: ResponseRecording) -> None:
    x = number(recording, "x")
    with pytest.raises(TraceError, match="components"):
        bool(Traced(recording, [x.nodes[0]] * 3, NUMBER))


def test_there_is_an_end_to_deciding(recording: ResponseRecording) -> None:
    x = number(recording, "x")

    def go_on() -> None:
        for k in range(MOST_DECISIONS + 1):
            assert x > float(k)

    with pytest.raises(TraceError, match="more than 64 times"):
        go_on()


def test_ways_through_a_call_are_joined_to_one_value(recording: ResponseRecording) -> None:
    x = number(recording, "x")

    def call() -> Any:
        return (1.0, x) if x > 0.0 else (2.0, -x)

    one, other = recording.joined(call)
    assert one.nodes[0].op == other.nodes[0].op == "where"
    assert not recording.ways[0].taken


def test_truths_are_joined_to_truths_and_equals_to_themselves(recording: ResponseRecording) -> None:
    x = number(recording, "x")
    assert recording.joined(lambda: bool(x > 0.0)).is_truth
    assert recording.joined(lambda: ("low", "high")[0 if x > 0.0 else -2]) == "low"
    assert recording.joined(lambda: 2.0) == 2.0


def test_what_cannot_be_joined_is_decided_outside(recording: ResponseRecording) -> None:
    x = number(recording, "x")
    assert recording.joined(lambda: "yes" if x > 0.0 else None) == "yes"
    assert len(recording.ways[0].taken) == 1


def test_an_error_on_a_side_way_is_an_error_only_where_one_goes(recording: ResponseRecording) -> None:
    x = number(recording, "x")

    def call() -> float:
        if x > 0.0:
            return 1.0
        raise RuntimeError("below")

    assert recording.joined(call) == 1.0
    assert recording.error is None and len(recording.ways) == 1
    other = ResponseRecording("test:law", prefix=[False])
    y = number(other, "y")

    def refused() -> float:
        if y > 0.0:
            return 1.0
        other.refuse("no")

    with pytest.raises(TraceError):
        other.joined(refused)
    assert other.error is not None


def test_what_python_may_refuse_is_noted_with_the_condition_under_which_it_is_reached(
    recording: ResponseRecording,
) -> None:
    x = number(recording, "x")
    quotient = 1.0 / x

    def call() -> Any:
        return 0.0 if x > 0.0 else 2.0 / x

    recording.joined(call)
    (first, always), (second, condition) = recording.checks.values()
    assert first is quotient.nodes[0] and always is None
    assert second.op == "/" and condition is not None and condition.op == "not"


def test_powers_are_those_of_the_c_library(recording: ResponseRecording) -> None:
    assert (number(recording, "x") ** 2).nodes[0].op == "pow"


def test_whole_parts_are_refused(recording: ResponseRecording) -> None:
    with pytest.raises(TraceError, match="//"):
        number(recording, "x") // 2.0
