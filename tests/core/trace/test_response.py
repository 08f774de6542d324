"""Reading a response along all of its ways."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

import xpheve as xp
from xpheve.errors import TraceError
from xpheve.kernels.response import ASK, IMPULSE, SPEED, VELOCITIES
from xpheve.laws import Column, Contact, Impulse, ResponseLaw, Velocities
from xpheve.trace.response import Branch, Leaf, trace_response


class Ways(ResponseLaw):
    """One answer of each kind."""

    id = "test:ways"
    columns: ClassVar[dict[str, Column]] = {"b": Column(0.0), "a": Column(0.0)}
    e = xp.Param(0.5, unit="1")
    d = xp.Param((1.0, 2.0, 3.0), unit="1")

    def respond(self, contact: Contact) -> Any:
        v = contact.approach_speed
        if v > 3.0:
            return self.e * v
        if v > 2.0:
            return Impulse((self.d[2], contact.body_b["b"], contact.body_a["a"]))
        if v > 1.0:
            return Velocities(contact.body_a.velocity, (0, 0, 0))
        raise ValueError("too slow")


def test_ways_are_a_tree_of_questions_with_an_answer_at_each_end() -> None:
    trace = trace_response(Ways())
    kinds, tree = [], trace.tree
    while isinstance(tree, Branch):
        assert isinstance(tree.yes, Leaf) and tree.question.op == ">"
        kinds.append(tree.yes.kind)
        tree = tree.no
    assert [*kinds, tree.kind] == [SPEED, IMPULSE, VELOCITIES, ASK]
    assert "too slow" in tree.why == trace.partly
    assert trace.columns == ("a", "b")
    assert [(one.name, one.component) for one in trace.parameters] == [("d", 2), ("e", 0)]


def test_a_question_whose_ways_answer_alike_is_left_out() -> None:
    class Alike(ResponseLaw):
        id = "test:alike"

        def respond(self, contact: Contact) -> float:
            if contact.body_a.mass > 1.0:
                return 2.0 * contact.approach_speed
            return contact.approach_speed * 1.0 * 2.0 if contact.separation > 0.0 else 2.0 * contact.approach_speed

    tree = trace_response(Alike()).tree
    assert isinstance(tree, Branch) and isinstance(tree.yes, Leaf) and isinstance(tree.no, Branch)

    class Same(ResponseLaw):
        id = "test:same"

        def respond(self, contact: Contact) -> float:
            if contact.body_a.mass > 1.0:
                return contact.approach_speed
            return contact.approach_speed

    assert isinstance(trace_response(Same()).tree, Leaf)


def test_a_law_that_can_never_be_read_says_why() -> None:
    class Never(ResponseLaw):
        id = "test:never"

        def respond(self, contact: Contact) -> float:
            return len(contact.body_a.name)

    with pytest.raises(TraceError, match=r"test:never.respond: reads body_a.name.*test_response.py:"):
        trace_response(Never())


def test_a_law_that_says_two_things_is_no_formula() -> None:
    class Two(ResponseLaw):
        id = "test:two"

        def respond(self, contact: Contact, numbers: Any = iter(range(100))) -> float:  # noqa: B008
            return next(numbers) * contact.approach_speed

    with pytest.raises(TraceError, match="may change unseen"):
        trace_response(Two())


def test_reading_changes_nothing_of_the_law() -> None:
    law = Ways()
    before = dict(law.__dict__), dict(law.parameters)
    trace_response(law)
    assert (dict(law.__dict__), dict(law.parameters)) == before
