"""Which laws are proven to fall with the square of the distance, and with which numbers."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.trace import trace_law
from xpheve.trace.inverse_square import Centre, InverseSquare, centre, inverse_square
from xpheve.trace.samples import States, parameters_of


def found_of(law: Any) -> Any:
    trace = trace_law(law)
    return (inverse_square if trace.pair else centre)(trace, law)


def engine_law(name: str, **parameters: float) -> Any:
    return xp.PhysicsEngine().add_law(name, **parameters)


class Pull(xp.PairLaw):
    """Gravity, written plainly; children write it in other ways."""

    id = "test:pull"
    g = xp.Param(2.0, unit="m^3/(kg s^2)", doc="G.")
    s = xp.Param(0.0, unit="m", ge=0, doc="Softening.")
    exponent = xp.Param(3.0, unit="1", doc="Of the distance.")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * d / d.norm() ** 3


class ByUnitVector(Pull):
    """Unit vector."""

    id = "test:unit_vector"

    def force(self, a: Any, b: Any) -> Any:
        d = b.position - a.position
        r = d.norm()
        return self.g * a.mass * b.mass / r**2 * (d / r)


class ByPower(Pull):
    """Power."""

    id = "test:power"

    def force(self, a: Any, b: Any) -> Any:
        d = b.position - a.position
        return a.mass * (b.mass * ((d.dot(d) + self.s**2) ** -1.5 * self.g)) * d


class ByLinalg(Pull):
    """Linalg."""

    id = "test:linalg"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        r = np.linalg.norm(2.0 * d, axis=1, keepdims=True)
        return -8.0 * self.g * a.mass * b.mass * d / (r * r * r)


class ByHypot(Pull):
    """Hypot."""

    id = "test:hypot"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        r = np.hypot(np.hypot(d.x, d.y), d.z)
        return -self.g * a.mass * b.mass / r**3 * d


class ByAccelerations(Pull):
    """Accelerations."""

    id = "test:accelerations"

    def force(self, a: Any, b: Any) -> Any:
        field = (b.position - a.position) * self.g * b.mass
        r = np.sqrt((a.position - b.position).dot(a.position - b.position) + self.s * self.s)
        return field / r / r / np.abs(r) * a.mass


class ByComponents(Pull):
    """Components."""

    id = "test:components"

    def force(self, a: Any, b: Any) -> Any:
        x, y, z = a.position.x - b.position.x, b.position.y - a.position.y, a.position.z - b.position.z
        k = -self.g * a.mass * b.mass / np.sqrt((x**2 + y**2 + z**2) ** 3)
        return xp.vector(k * x, -k * y, k * z)


class Switched(Pull):
    """Switched."""

    id = "test:switched"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        k = xp.where(self.s > 0.0, d.dot(d) + self.s**2, d.dot(d))
        return -self.g * a.mass * b.mass / k**1.5 * d


class OfExponent(Pull):
    """Exponent."""

    id = "test:exponent"
    unit = xp.Constant(1.0, unit="m")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        r = d.norm() / self.unit
        return -self.g * a.mass * b.mass / self.unit**3 * d / r**self.exponent


class Alike(Pull):
    """No charge at all."""

    id = "test:alike"
    k = xp.Param(3.0, unit="N m^2", doc="k.")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.k * d / d.norm() ** 3


WAYS = [Pull, ByUnitVector, ByPower, ByLinalg, ByHypot, ByAccelerations, ByComponents, Switched, OfExponent]


@pytest.mark.parametrize("way", WAYS)
def test_gravity_is_found_however_it_is_written(way: type[Pull]) -> None:
    strength, charge, softening = found_of(way())
    assert strength == pytest.approx(2.0, rel=1e-15)
    assert (charge, softening) == ("mass", 0.0)


@pytest.mark.parametrize("way", [ByPower, ByAccelerations, Switched])
@given(g=st.floats(1e-20, 1e20), s=st.floats(1e-100, 1e100))
def test_the_numbers_are_those_of_the_parameters_now(way: type[Pull], g: float, s: float) -> None:
    strength, _, softening = found_of(way(g=g, s=s))
    assert strength == pytest.approx(g, rel=1e-15)
    assert softening == pytest.approx(s, rel=1e-15)


@pytest.mark.parametrize("way", WAYS)
def test_what_is_found_is_the_force(way: type[Pull]) -> None:
    law = way(g=0.7, s=0.0 if way not in (ByPower, ByAccelerations, Switched) else 1.3)
    trace = trace_law(law)
    found = inverse_square(trace, law)
    assert trace is not None and found is not None
    states = States(law, True, 40)
    run = trace.motion_arrays
    force = np.array(run(states.inputs(run.inputs), parameters_of(law, run.parameters)))
    d = (states.array("a", "position") - states.array("b", "position")).T
    c = found.strength * states.array("a", found.charge)[:, 0] * states.array("b", found.charge)[:, 0]
    np.testing.assert_allclose(force, -c * d / ((d * d).sum(axis=0) + found.softening**2) ** 1.5, rtol=1e-13)


def test_laws_that_come_with_the_engine() -> None:
    assert found_of(engine_law("basic:universal_gravity")) == InverseSquare(6.67430e-11, "mass", 0.0)
    assert found_of(engine_law("basic:universal_gravity", softening=0.1)) == InverseSquare(6.67430e-11, "mass", 0.1)
    coulomb = engine_law("basic:coulomb", relative_permittivity=80.0, softening=2.0)
    assert found_of(coulomb) == InverseSquare(-8.9875517923e9 / 80.0, "charge", 2.0)


def test_a_changed_parameter_changes_what_is_found() -> None:
    law = engine_law("basic:universal_gravity")
    law.gravitational_constant = 0.0
    assert found_of(law) == InverseSquare(0.0, "mass", 0.0)
    assert str(found_of(law).strength) == "0.0"
    law.gravitational_constant = 1.0
    assert found_of(law) == InverseSquare(1.0, "mass", 0.0)


def test_without_a_charge_the_strength_is_all() -> None:
    assert found_of(Alike()) == InverseSquare(3.0, "", 0.0)


class Cut(Pull):
    """Cut."""

    id = "test:cut"
    cutoff = xp.Param(2.5, unit="m", gt=0, doc="Beyond it nothing acts.")


class Lopsided(Pull):
    """Lopsided."""

    id = "test:lopsided"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * a.mass * d / d.norm() ** 3


class Guarded(Pull):
    """Guarded."""

    id = "test:guarded"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return xp.where(d.norm() > self.s, -self.g * a.mass * b.mass * d / d.norm() ** 3, 0.0)


class Stretched(Pull):
    """The distance is not that of space."""

    id = "test:stretched"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * d / np.sqrt(d.x**2 + 1.0000000001 * d.y**2 + d.z**2) ** 3


class Swapped(Pull):
    """Swapped."""

    id = "test:swapped"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * xp.vector(d.y, d.x, d.z) / d.norm() ** 3


class Mirrored(Pull):
    """Mirrored."""

    id = "test:mirrored"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * xp.vector(d.x, -d.y, d.z) / d.norm() ** 3


class Flat(Pull):
    """Flat."""

    id = "test:flat"

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * xp.vector(d.x, d.y, 0.0) / d.norm() ** 3


class WithMore(Pull):
    """Beside it something else."""

    id = "test:more"
    near = xp.Param(1.0, unit="m", gt=0, doc="How near that is.")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * d / d.norm() ** 3 * (1.0 + np.exp(-d.norm() / self.near))


class Offset(Pull):
    """Offset."""

    id = "test:offset"
    away = xp.Param((1.0, 0.0, 0.0), unit="m", doc="From where the bodies are.")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position + self.away
        return -self.g * a.mass * b.mass * d / d.norm() ** 3


class Wave(Pull):
    """Wave."""

    id = "test:wave"
    second = xp.Constant(1.0, unit="s")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * d / d.norm() ** 3 * np.cos(a.time / self.second)


class ByRootOfCharges(Pull):
    """The root of a product of charges, of which nobody says that they are positive."""

    id = "test:charges"
    columns: ClassVar = {"hue": xp.Column(1.0, unit="1", doc="Of either sign.")}

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.g * a.mass * b.mass * d / d.norm() ** 3 * np.sqrt(a.hue * a.hue)


NOT = [Cut, Lopsided, Guarded, Stretched, Swapped, Mirrored, Flat, WithMore, Offset, Wave, ByRootOfCharges]


@pytest.mark.parametrize("other", NOT)
def test_what_is_something_else_is_not_taken_for_it(other: type[Pull]) -> None:
    assert found_of(other()) is None


@pytest.mark.parametrize("exponent", [2.0, 2.999999999, 4.0])
def test_other_powers_are_not_taken_for_it(exponent: float) -> None:
    assert found_of(OfExponent(exponent=exponent)) is None


@pytest.mark.parametrize(
    "name", ["basic:spring", "basic:planet_gravity", "basic:linear_drag", "basic:black_hole_gravity"]
)
def test_laws_of_another_kind_are_not_taken_for_it(name: str) -> None:
    assert found_of(engine_law(name)) is None


class Sun(xp.FieldLaw):
    """The pull of a fixed centre."""

    id = "test:sun"
    mu = xp.Param(4.0, unit="m^3/s^2", doc="G M.")
    place = xp.Param((1.0, 2.0, 0.0), unit="m", doc="Of the centre.")

    def force(self, body: Any) -> Any:
        d = body.position - self.place
        return -self.mu * body.mass * d / d.norm() ** 3


class SunAtOrigin(Sun):
    """Sun at origin."""

    id = "test:sun_at_origin"

    def force(self, body: Any) -> Any:
        r = body.position.norm()
        return self.mu * body.mass / r**2 * (-body.position / r)


class TwoSuns(Sun):
    """Two suns."""

    id = "test:two_suns"

    def force(self, body: Any) -> Any:
        d, e = body.position - self.place, body.position + self.place
        return -self.mu * body.mass * (d / d.norm() ** 3 + e / e.norm() ** 3)


def test_a_fixed_centre_is_found_with_its_place() -> None:
    assert found_of(Sun(place=(1.0, -2.0, 0.0))) == Centre(4.0, "mass", 0.0, (1.0, -2.0, 0.0))
    assert found_of(SunAtOrigin()) == Centre(4.0, "mass", 0.0, (0.0, 0.0, 0.0))
    assert found_of(Sun(place=(0.0, 0.0, 0.0))) == Centre(4.0, "mass", 0.0, (0.0, 0.0, 0.0))
    assert found_of(TwoSuns()) is None


def test_a_pair_law_is_no_centre_and_a_field_law_no_pair() -> None:
    sun, pull = Sun(), Pull()
    of_sun, of_pull = trace_law(sun), trace_law(pull)
    assert of_sun is not None and of_pull is not None
    assert inverse_square(of_sun, sun) is None and centre(of_pull, pull) is None
