"""Wrong laws that look right as expressions: only their numbers show it. Each is caught, and told what is wrong with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import PotentialError, TraceError
from xpheve.trace.check import check_law, quick_check, require_law


class Field(xp.FieldLaw):
    """What most of these share: a spring to the origin."""

    stiffness = xp.Param(3.0, unit="N/m", doc="k.")
    other = xp.Param(3.0, unit="N/m", doc="Not k.")
    drag = xp.Param(0.1, unit="kg/s", doc="b.")

    def force(self, body: Any) -> Any:
        return -self.stiffness * body.position


class AsksForItsType(Field):
    """Twice the drag on arrays."""

    id = "zoo:asks_for_its_type"

    def force(self, body: Any) -> Any:
        if isinstance(body.velocity, np.ndarray):
            return -2.0 * self.drag * body.velocity
        return -self.drag * body.velocity


class MeanField(Field):
    """Pulls to the middle of all, but only on arrays."""

    id = "zoo:mean_field"

    def force(self, body: Any) -> Any:
        x = body.position
        if isinstance(x, np.ndarray):
            x = x - np.asarray(x).mean(axis=0)
        return -self.stiffness * x


SEEN: dict[type, Any] = {}


class Remembers(Field):
    """Keeps the first velocities for ever."""

    id = "zoo:remembers"

    def force(self, body: Any) -> Any:
        first = SEEN.setdefault(type(body.velocity), body.velocity)
        return -self.drag * (first if isinstance(first, np.ndarray) else body.velocity)


class Tires(Field):
    """Grows weaker with every call on arrays."""

    id = "zoo:tires"

    def force(self, body: Any) -> Any:
        weaker = 1.0
        if isinstance(body.position, np.ndarray):
            CALLS.append(weaker)
            weaker = 1.0 / len(CALLS)
        return -self.stiffness * weaker * body.position


CALLS: list[float] = []


class WrongSign(Field):
    """U = -k x^2/2."""

    id = "zoo:wrong_sign"

    def potential(self, body: Any) -> Any:
        return -0.5 * self.stiffness * body.position.dot(body.position)


class WrongFactor(Field):
    """U = k x^2."""

    id = "zoo:wrong_factor"

    def potential(self, body: Any) -> Any:
        return self.stiffness * body.position.dot(body.position)


class TermLeftOut(Field):
    """A spring with a rest length, the potential without."""

    id = "zoo:term_left_out"

    rest_length = xp.Param(0.5, unit="m", doc="L.")

    def force(self, body: Any) -> Any:
        r = body.position.norm()
        return -self.stiffness * (r - self.rest_length) * body.position / r

    def potential(self, body: Any) -> Any:
        return 0.5 * self.stiffness * body.position.dot(body.position)


class OtherParameter(Field):
    """The potential of another stiffness."""

    id = "zoo:other_parameter"

    def potential(self, body: Any) -> Any:
        return 0.5 * self.other * body.position.dot(body.position)


class KineticPotential(Field):
    """Kinetic energy in the potential."""

    id = "zoo:kinetic_potential"

    def potential(self, body: Any) -> Any:
        return 0.5 * self.stiffness * body.position.dot(body.position) + 0.5 * body.mass * body.velocity.dot(
            body.velocity
        )


class DragInIt(Field):
    """A potential, and drag beside it."""

    id = "zoo:drag_in_it"

    def force(self, body: Any) -> Any:
        return -self.stiffness * body.position - self.drag * body.velocity

    def potential(self, body: Any) -> Any:
        return 0.5 * self.stiffness * body.position.dot(body.position)


class Lame(Field):
    """A potential without a force that does work."""

    id = "zoo:lame"

    def force(self, body: Any) -> Any:
        return self.drag * body.velocity.cross((0.0, 0.0, 1.0))

    def potential(self, body: Any) -> Any:
        return 0.5 * self.stiffness * body.position.dot(body.position)


class NoForce(xp.FieldLaw):
    """A potential, and nothing that acts."""

    id = "zoo:no_force"

    stiffness = xp.Param(3.0, unit="N/m", doc="k.")

    def potential(self, body: Any) -> Any:
        return 0.5 * self.stiffness * body.position.dot(body.position)


class Plane(Field):
    """One of three axes left out."""

    id = "zoo:plane"

    def potential(self, body: Any) -> Any:
        x = body.position
        return 0.5 * self.stiffness * (x.x**2 + x.y**2)


class Compass(xp.FieldLaw):
    """A magnetic moment that turns the wrong way."""

    id = "zoo:compass"

    moment = xp.Param((2.0, 0.0, 0.5), unit="A*m^2", doc="m, body frame.")
    field = xp.Param((0.0, 0.3, 0.1), unit="T", doc="B.")

    def torque(self, body: Any) -> Any:
        return -body.to_world(self.moment).cross(self.field)

    def potential(self, body: Any) -> Any:
        return -body.to_world(self.moment).dot(self.field)


class OneSided(xp.PairLaw):
    """A pair's potential that does not follow b."""

    id = "zoo:one_sided"

    stiffness = xp.Param(3.0, unit="N/m", doc="k.")

    def force(self, a: Any, b: Any) -> Any:
        return -self.stiffness * (a.position - b.position)

    def potential(self, a: Any, b: Any) -> Any:
        return 0.5 * self.stiffness * (a.position.dot(a.position) - 2.0 * a.position.dot(b.position))


class FirstCounts(xp.PairLaw):
    """A force in proportion to the first one's mass."""

    id = "zoo:first_counts"

    stiffness = xp.Param(3.0, unit="N/(m kg)", doc="k.")

    def force(self, a: Any, b: Any) -> Any:
        return -self.stiffness * a.mass * (a.position - b.position)


class Direction(Field):
    """Has no direction at rest."""

    id = "zoo:direction"

    push = xp.Param(2.0, unit="N", doc="f.")

    def force(self, body: Any) -> Any:
        return -self.push * body.velocity / body.velocity.norm()


class ShortTable(Field):
    """A table that most heights are outside of."""

    id = "zoo:short_table"

    strength = xp.Table((0.0, 10.0), (1.0, 0.0), unit_x="m", unit="N")

    def force(self, body: Any) -> Any:
        return self.strength(body.position.z) * body.up


class Counts(Field):
    """Divides by the number of objects."""

    id = "zoo:counts"

    def force(self, body: Any) -> Any:
        return -self.stiffness * body.position / body.count


def says(law: type[xp.FieldLaw] | type[xp.PairLaw]) -> str:
    """Return the message of the first error of the full check."""
    with pytest.raises(TraceError) as wrong:
        require_law(law())
    return str(wrong.value)


@pytest.mark.parametrize(
    ("law", "parts"),
    [
        (AsksForItsType, ("zoo:asks_for_its_type.force: called with arrays it gives (", "isinstance on a value")),
        (MeanField, ("zoo:mean_field.force: called with arrays it gives (", "at position (")),
        (
            Remembers,
            (
                "zoo:remembers.force: called again, with other objects, it raised ValueError",
                "keeps something of an earlier call",
            ),
        ),
        (Tires, ("zoo:tires.force gives (", "when the same objects come in another order and number")),
        (Counts, ("zoo:counts.force", "body.count")),
    ],
)
def test_a_law_that_does_what_no_expression_says_is_caught(law: type[xp.FieldLaw], parts: tuple[str, ...]) -> None:
    SEEN.clear()
    CALLS.clear()
    said = says(law)
    assert all(part in said for part in parts), said


@pytest.mark.parametrize(
    ("law", "parts"),
    [
        (
            WrongSign,
            (
                "zoo:wrong_sign.potential does not match force: at position (",
                "the force is not -dU/dx. Its sign is wrong",
            ),
        ),
        (WrongFactor, ("It is 2 times what it should be. Check the factor",)),
        (
            TermLeftOut,
            ("zoo:term_left_out.potential does not match force", "Check signs, factors, parameters and terms left out"),
        ),
        (OtherParameter, ("It is ", " times what it should be. Check the factor", " with other=", "stiffness=")),
        (KineticPotential, ("zoo:kinetic_potential.potential reads velocity, but a potential is an energy of places",)),
        (DragInIt, ("zoo:drag_in_it.potential does not match force", "velocity (")),
        (Lame, ("The force does no work at all: it lacks what the potential says",)),
        (NoForce, ("zoo:no_force.potential does not match force: at position (", "The force does no work at all")),
        (Plane, ("zoo:plane.potential does not match force", "terms left out")),
        (
            Compass,
            ("zoo:compass.potential does not match force: at orientation (", "angular_velocity (", "Its sign is wrong"),
        ),
        (OneSided, ("zoo:one_sided.potential does not match force: at a.position (", "It is right for a, not for b")),
    ],
)
def test_a_potential_that_does_not_match_is_caught(law: type[xp.FieldLaw], parts: tuple[str, ...]) -> None:
    with pytest.raises(PotentialError) as wrong:
        require_law(law())
    said = str(wrong.value)
    assert all(part in said for part in parts), said
    if law is not KineticPotential:
        assert " W, so that the potential should change by " in said and " J/s, but it changes by " in said, said


@pytest.mark.parametrize(
    "law",
    [
        WrongSign,
        WrongFactor,
        TermLeftOut,
        KineticPotential,
        DragInIt,
        Lame,
        Plane,
        Compass,
        OneSided,
        AsksForItsType,
        MeanField,
    ],
)
def test_the_quick_check_catches_what_does_not_hang_on_other_parameters(law: type[xp.FieldLaw]) -> None:
    with pytest.raises(TraceError, match=law.id):
        quick_check(law())


def test_the_power_and_the_change_in_the_message_are_those_of_the_law() -> None:
    said = says(WrongFactor)
    power = float(said.partition("the power is ")[2].partition(" W")[0])
    change = float(said.partition("but it changes by ")[2].partition(" J/s")[0])
    assert change == pytest.approx(-2.0 * power, rel=1e-5)


@pytest.mark.parametrize(
    ("law", "kind", "parts"),
    [
        (
            FirstCounts,
            "order",
            ("zoo:first_counts.force: on a it is (", "if a and b change places", "between=(these, those)"),
        ),
        (Direction, "finite", ("zoo:direction.force is (nan, nan, nan) at velocity (0, 0, 0)", "say in `singular`")),
        (
            ShortTable,
            "finite",
            ("zoo:short_table.force", "<zoo:short_table.strength: linear, 2 points, 0.0 to 10.0 m> ends there"),
        ),
    ],
)
def test_what_may_be_meant_is_remarked_and_not_refused(
    law: type[xp.FieldLaw], kind: str, parts: tuple[str, ...]
) -> None:
    found = check_law(law())
    assert [one.kind for one in found] == [kind] and found[0].error is None
    assert all(part in found[0].message for part in parts), found[0].message
    require_law(law())
    quick_check(law())


def test_what_the_author_says_in_singular_is_not_remarked() -> None:
    class Known(Direction):
        id = "zoo:known"
        singular = "What rests has no direction"

    assert check_law(Known()) == []
