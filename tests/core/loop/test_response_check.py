"""Contacts on which a response is tried."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

import xpheve_laws_collision as collision
from xpheve.kernels import response as layout
from xpheve.laws import Column, Contact, Impulse, ResponseLaw, Velocities
from xpheve.loop.response_check import contacts, difference, python_answer, same, scratch_of
from xpheve.trace.response import trace_response


def test_contacts_approach_along_unit_normals_and_some_bodies_are_fixed() -> None:
    made = list(contacts(collision.Elastic(), ("restitution",), 24))
    for contact in made:
        a, b, n = contact.body_a, contact.body_b, contact.normal
        closing = -math.fsum((q - p) * c for p, q, c in zip(a.velocity, b.velocity, n, strict=True))
        assert abs(math.hypot(*n) - 1.0) < 1e-15
        assert contact.approach_speed > 0.0 and math.isclose(closing, contact.approach_speed, rel_tol=1e-9)
        assert not (a.fixed and b.fixed)
    assert any(c.body_a.fixed for c in made) and any(c.body_b.fixed for c in made)
    own = [obj["restitution"] for c in made for obj in (c.body_a, c.body_b)]
    assert any(map(math.isnan, own)) and all(0.0 <= one <= 1.0 for one in own if not math.isnan(one))


def test_the_same_contacts_each_time() -> None:
    one, other = (
        [scratch_of(contact, ("restitution",)) for contact in contacts(collision.Elastic(), ("restitution",), 6)]
        for _ in range(2)
    )
    assert np.array_equal(one, other, equal_nan=True)


def test_the_scratch_has_what_the_contact_has() -> None:
    contact = list(contacts(collision.Elastic(), ("restitution",), 2))[1]
    found = scratch_of(contact, ("restitution",))
    a, b = contact.body_a, contact.body_b
    assert tuple(found[layout.NORMAL : layout.NORMAL + 3]) == contact.normal
    assert found[layout.APPROACH] == contact.approach_speed
    assert tuple(found[layout.BODY_A + layout.VELOCITY :][:3]) == a.velocity
    assert tuple(found[layout.BODY_B + layout.INERTIA :][:3]) == b.inertia
    assert found[layout.BODY_A + layout.INVERSE_MASS] == 0.0 and a.fixed
    assert found[layout.BODY_B + layout.INVERSE_MASS] == 1.0 / b.mass
    assert found[layout.BODY_B + layout.COLUMNS] == b["restitution"] or math.isnan(b["restitution"])


def test_answers_in_python_are_numbers_of_a_kind() -> None:
    class Any(ResponseLaw):
        id = "test:any"
        answer: object = 1

        def respond(self, contact: Contact) -> object:  # type: ignore[override]
            if isinstance(self.answer, Exception):
                raise self.answer
            return self.answer

    law = Any()
    (contact,) = contacts(law, (), 1)
    for answer, expected in (
        (2, (layout.SPEED, (2.0,))),
        (Impulse((1, 2, 3)), (layout.IMPULSE, (1.0, 2.0, 3.0))),
        (Velocities((1, 2, 3), (4, 5, 6)), (layout.VELOCITIES, (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))),
        (-1.0, (layout.ASK, ())),
        (math.nan, (layout.ASK, ())),
        (None, (layout.ASK, ())),
        (ValueError("no"), (layout.ASK, ())),
    ):
        law.__dict__["answer"] = answer
        assert python_answer(law, contact) == expected
    assert same((0, (0.0,)), (0, (0.0,))) and not same((0, (0.0,)), (0, (-0.0,)))


def test_a_text_that_is_not_what_the_law_says_is_found() -> None:
    class Honest(ResponseLaw):
        id = "test:honest"
        columns: ClassVar[dict[str, Column]] = {"e": Column(0.5, ge=0)}

        def respond(self, contact: Contact) -> float:
            return contact.body_a["e"] * contact.approach_speed

    class Liar(Honest):
        def respond(self, contact: Contact) -> float:
            return contact.body_b["e"] * contact.approach_speed

    trace = trace_response(Honest())
    assert difference(Honest(), trace) == ""
    assert "answers" in difference(Liar(), trace)
