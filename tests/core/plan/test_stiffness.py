"""What is called stiff: fast decay while the state hardly changes; not what swings, falls, or is being slowed down."""

from __future__ import annotations

from typing import Any

import pytest

import xpheve as xp
from xpheve.laws import FieldLaw, PairLaw, Param
from xpheve.plan.stiffness import LARGEST, is_stiff


class VanDerPol(FieldLaw):
    """Relaxation oscillator."""

    damping = Param(1e4, unit="kg/s")
    stiffness = Param(1.0, unit="N/m")
    length = Param(1.0, unit="m")

    def force(self, body: Any) -> Any:
        u = body.position / self.length
        return self.damping * (1.0 - u.dot(u)) * body.velocity - self.stiffness * body.position


class Robertson(FieldLaw):
    """The reaction, with velocities for concentrations."""

    slow = Param(0.04, unit="kg/s")
    fast = Param(3e7, unit="kg/m")
    back = Param(1e4, unit="kg/m")

    def force(self, body: Any) -> Any:
        v = body.velocity
        first = self.slow * v.x - self.back * v.y * v.z
        second = self.fast * v.y * v.y
        return xp.vector(-first, first - second, second)


class Cubic(FieldLaw):
    """A hard spring with drag."""

    stiffness = Param(1e8, unit="N/m^3")
    damping = Param(0.0, unit="kg/s")

    def force(self, body: Any) -> Any:
        return -self.stiffness * body.position.dot(body.position) * body.position - self.damping * body.velocity


class Drag(FieldLaw):
    """Quadratic drag."""

    coefficient = Param(0.1, unit="kg/m")

    def force(self, body: Any) -> Any:
        return -self.coefficient * body.velocity.norm() * body.velocity


class Strut(PairLaw):
    """A soft spring and a hard damper, stronger the nearer both are."""

    damping = Param(1e6, unit="kg m/s")
    stiffness = Param(1.0, unit="N/m")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -self.damping / d.norm() * (a.velocity - b.velocity) - self.stiffness * d


def stiff(laws: list[Any], *bodies: tuple[Any, Any]) -> bool:
    engine = xp.PhysicsEngine(up="z")
    known = [engine.add_law(law) for law in laws]
    objects = [
        engine.add_object(xp.PhysicalObject(position=position, velocity=velocity), laws=known)
        for position, velocity in bodies
    ]
    engine._world.plan()
    return is_stiff(engine._world, objects)


AT_REST = ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize(("damping", "expected"), [(1e4, True), (100.0, True), (1.0, False), (1e-3, False)])
def test_van_der_pols_oscillator_is_stiff_if_it_relaxes(damping: float, expected: bool) -> None:
    assert stiff([VanDerPol(damping=damping)], AT_REST) == expected


def test_robertsons_reaction_is_stiff_though_it_begins_slowly() -> None:
    assert stiff([Robertson()], ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))


@pytest.mark.parametrize("damping", [0.0, 1.0, 1e3])
def test_what_swings_fast_is_not_stiff(damping: float) -> None:
    assert not stiff([Cubic(damping=damping)], ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))


def test_what_creeps_is() -> None:
    assert stiff([Cubic(damping=1e9)], AT_REST)


def test_a_body_that_drag_slows_is_not() -> None:
    assert not stiff([Drag()], ((0.0, 0.0, 0.0), (100.0, 0.0, 0.0)))
    assert not stiff([Drag(coefficient=1e5)], ((0.0, 0.0, 0.0), (100.0, 0.0, 0.0)))
    assert not stiff([Drag()], ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


def test_two_that_a_damper_holds_together_are() -> None:
    assert stiff([Strut()], ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((1.0, 0.5, 0.0), (0.0, 0.0, 0.0)))


def test_forces_without_velocities_are_not_looked_at() -> None:
    assert not stiff(["basic:universal_gravity"], AT_REST, ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))


def test_large_groups_are_left_to_the_users_wish() -> None:
    bodies = [((float(k), 0.0, 0.0), (0.0, 0.0, 0.0)) for k in range(LARGEST + 1)]
    assert not stiff([Strut()], *bodies)
