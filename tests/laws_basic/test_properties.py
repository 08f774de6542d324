"""What every law of the library keeps: units, momentum, Galileo's principle, work and energy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
import xpheve_laws_basic as basic
from xpheve.laws import PairLaw
from xpheve.laws.view import BodyView
from xpheve.units import dimension

LAWS = {law.id: law for law in (getattr(basic, name) for name in basic.__all__)}
PAIRS = sorted(id for id, law in LAWS.items() if issubclass(law, PairLaw))
number = st.floats(-3, 3)
vector = st.tuples(number, number, number)
UNITS = {
    "position": "m", "velocity": "m/s", "angular_velocity": "1/s", "orientation": "1", "mass": "kg", "inertia": "kg m^2",
    "volume": "m^3", "time": "s", "since": "s", "up": "1",
}  # fmt: skip

# Values with which each law acts on what is below; all others keep their defaults.
GIVEN: dict[str, dict[str, Any]] = {
    "basic:black_hole_gravity": {"gravitational_constant": 1.0, "mass": 2.0, "speed_of_light": 30.0},
    "basic:buoyancy": {"surface": 0.1, "density": 2.0},
    "basic:coulomb": {"coulomb_constant": 1.0, "softening": 0.5, "relative_permittivity": 2.0},
    "basic:electric_field": {"field": (1.0, -2.0, 0.5)},
    "basic:magnetic_field": {"field": (0.5, 1.0, -0.3)},
    "basic:magnus": {"density": 1.0},
    "basic:rotating_frame": {"angular_velocity": (0.1, -0.2, 0.3), "point": (1.0, 0.0, 0.0)},
    "basic:spring": {"stiffness": 2.0, "rest_length": 1.0},
    "basic:spring_to_point": {"stiffness": 2.0, "rest_length": 1.0, "anchor": (5.0, 0.0, 0.0)},
    "basic:damper_to_point": {"anchor": (5.0, 0.0, 0.0)},
    "basic:thrust": {"thrust": (1.0, 2.0, 3.0), "duration": 0.33, "delay": 0.1},
    "basic:universal_gravity": {"gravitational_constant": 1.0, "softening": 0.5},
}
COLUMNS = {"charge": 0.7, "drag_area": 0.3, "displaced_volume": 0.2}


def values(seed: int, n: int = 3) -> dict[str, Any]:
    """Return the state of some bodies."""
    chance = np.random.default_rng(seed)
    q = chance.normal(size=(n, 4))
    found = {name: chance.normal(size=(n, 3)) + 1.0 for name in ("position", "velocity", "angular_velocity")}
    found |= {name: chance.uniform(0.5, 2.0, n) for name in ("mass", "volume", *COLUMNS)}
    found["inertia"] = chance.uniform(1.0, 1.5, (n, 3))
    return found | {
        "orientation": q / np.linalg.norm(q, axis=1)[:, None],
        "time": 0.25,
        "since": np.zeros(n),
        "up": np.array((0.0, 0.0, 1.0)),
    }


def scaled(value: Any, unit: str, sizes: tuple[float, ...]) -> Any:
    """Return ``value`` in a system of units whose kilogram, metre, second, ampere, ... are of other sizes."""
    factor = math.prod(size**power for size, power in zip(sizes, dimension(unit), strict=True))
    if value is None:
        return None
    return tuple(factor * one for one in value) if isinstance(value, tuple) else factor * value


@pytest.mark.parametrize("id", sorted(LAWS))
@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 10**6), m=st.floats(0.1, 10), x=st.floats(0.1, 10), t=st.floats(0.1, 10), a=st.floats(0.1, 10)
)
def test_a_law_says_the_same_in_any_system_of_units(id: str, seed: int, m: float, x: float, t: float, a: float) -> None:
    sizes = (m, x, t, a, 1.0, 1.0, 1.0)
    kind = LAWS[id]
    here = kind(**GIVEN.get(id, {}))
    there = kind(
        **{
            name: scaled(value, kind.params[name].unit, sizes)
            for name, value in here.parameters.items()
            if kind.params[name].kind != "text"
        }
    )
    units = UNITS | {name: column.unit for name, column in kind.columns.items()}
    state = {name: value for name, value in values(seed).items() if name in units}

    def answers(law: Any, *, other: bool) -> dict[str, Any]:
        def view(rows: slice) -> BodyView:
            def fetch(name: str) -> Any:
                value = state[name] if np.ndim(state[name]) == 0 or name == "up" else state[name][rows]
                return scaled(value, units[name], sizes) if other else value

            return BodyView(fetch, set(), 2)

        views = (view(slice(0, 2)), view(slice(1, 3))) if issubclass(kind, PairLaw) else (view(slice(0, 2)),)
        asked = {"force": "N", "torque": "N m", "potential": "J"}
        return {name: (getattr(law, name)(*views), unit) for name, unit in asked.items() if kind.defines(name)}

    found = answers(there, other=True)
    for name, (value, unit) in answers(here, other=False).items():
        expected = np.asarray(value) * scaled(1.0, unit, sizes)
        assert np.isfinite(expected).all()
        np.testing.assert_allclose(found[name][0], expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max(initial=0.0))


def cloud(id: str, seed: int, *, boost: Any = (0, 0, 0), shift: Any = (0, 0, 0), **given: Any) -> xp.PhysicsEngine:
    """Return some bodies under a law, perhaps seen by somebody who moves past."""
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law(id, **(GIVEN.get(id, {}) | given))
    state = values(seed, 4)
    for k in range(4):
        body = xp.PhysicalObject(
            xp.Sphere(0.3),
            mass=state["mass"][k],
            position=3 * state["position"][k] + shift,
            velocity=state["velocity"][k] + boost,
            angular_velocity=state["angular_velocity"][k],
            name=str(k),
            **{name: COLUMNS[name] * (k - 1.5) if name == "charge" else COLUMNS[name] for name in law.columns},
        )
        engine.add_object(body, laws=[law])
    return engine


@pytest.mark.parametrize("id", PAIRS)
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 10**6), dt=st.floats(0.01, 0.2))
def test_pair_laws_keep_momentum_and_angular_momentum_to_rounding(id: str, seed: int, dt: float) -> None:
    engine = cloud(id, seed)
    before = engine.momentum(), engine.angular_momentum()
    engine.run(until=5 * dt, dt=dt)  # between steps only momentum is
    np.testing.assert_allclose(engine.momentum(), before[0], atol=1e-12)
    np.testing.assert_allclose(engine.angular_momentum(), before[1], atol=1e-11)


@pytest.mark.parametrize("id", [*PAIRS, "basic:planet_gravity", "basic:electric_field", "basic:thrust", "basic:wind"])
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 10**6), boost=vector, shift=vector)
def test_somebody_who_moves_past_sees_the_same(id: str, seed: int, boost: Any, shift: Any) -> None:
    here = cloud(id, seed)
    carried = {"velocity": np.add((5.0, 0.0, 0.0), boost).tolist()} if id == "basic:wind" else {}
    there = cloud(id, seed, boost=boost, shift=shift, **carried)
    for engine in (here, there):
        engine.run(until=0.5, dt=0.1)
    moved = here.bodies.position + 0.5 * np.array(boost) + shift
    np.testing.assert_allclose(there.bodies.position, moved, atol=1e-11)
    np.testing.assert_allclose(there.bodies.velocity, here.bodies.velocity + boost, atol=1e-11)


WORKING = sorted(id for id, law in LAWS.items() if not law.defines("potential"))


@pytest.mark.parametrize("id", WORKING)
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 10**6), dt=st.floats(0.01, 0.3))
def test_what_has_no_potential_reports_its_work_to_rounding_at_any_step(id: str, seed: int, dt: float) -> None:
    engine = cloud(id, seed)
    before = engine.energy()
    engine.run(until=0.6, dt=dt)
    after = engine.energy()
    assert after.balance == pytest.approx(before.balance, rel=1e-12)
    assert after.work != 0.0


@pytest.mark.parametrize("id", sorted(LAWS.keys() - set(WORKING)))
def test_what_has_a_potential_keeps_the_energy_the_better_the_smaller_the_step(id: str) -> None:
    errors = []
    for n in (8, 32):
        engine = cloud(id, 2004)
        before = engine.energy()
        engine.run(until=0.25, dt=0.25 / n)
        errors.append(abs(engine.energy().balance - before.balance) / before.kinetic)
    assert errors[1] < 2e-3
    assert errors[1] < max(1e-13, errors[0] / 8), "of order two, or exact"
