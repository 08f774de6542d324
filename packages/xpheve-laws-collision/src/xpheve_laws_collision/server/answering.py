"""Answers to contacts that somebody else found: a polled container, at the instant it looked."""

from __future__ import annotations

from collections.abc import Sequence

from xpheve.laws import Contact, ResponseLaw
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.mass import immovable
from xpheve_laws_collision.narrow_phase import ULPS, Gap, flipped, still_speed
from xpheve_laws_collision.server.generations import Generations
from xpheve_laws_collision.server.pairs import Pair
from xpheve_laws_collision.server.saving import Saving


class Answers(Generations):
    """One law and the contacts it was given; nobody else is asked, and no table of the server changes."""

    counts = 0  # `PhysicalLaw.enforce` has counted

    def __init__(self, server: Saving, law: ResponseLaw, contacts: Sequence[Contact]) -> None:
        super().__init__(server)
        self._law = law
        for contact in contacts:
            pair = server._pair(contact.body_a, contact.body_b)
            if not (immovable(pair[0]) and immovable(pair[1])):
                gap = _gap_of(contact)
                self.points.setdefault(pair, []).append(gap if pair[0] is contact.body_a else flipped(gap))

    def law(self, pair: Pair) -> ResponseLaw:
        return self._law

    def find_points(self, pair: Pair) -> list[Gap]:
        return self.points[pair]

    def around(self, moved: set[PhysicalObject], pairs: list[Pair]) -> list[Pair]:
        return list(self.points)


class Answering(Saving):
    """The room of those answers."""

    def answer(self, law: ResponseLaw, contacts: Sequence[Contact]) -> None:
        self._keep()
        answers = Answers(self, law, contacts)
        answers.solve(list(answers.points))
        answers.write()


def _gap_of(contact: Contact) -> Gap:
    size = sum(abs(c) for c in contact.point)
    speed = -contact.approach_speed
    return Gap(contact.separation, speed, 0.0, contact.normal, contact.point, ULPS * size, still_speed(abs(speed), 0.0))
