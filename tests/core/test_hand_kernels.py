"""Kernels written by hand: part of the loop in all tiers, and errors that name what is wrong before anything moves."""

from __future__ import annotations

import math
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import CompileError, LawDefinitionError, LawFailedError

LIFT = """
    import math

    from xpheve.kernels.vector import cross, scale

    STALL = 2.0**2.0 - math.sqrt(1.0)


    def slope(v2):
        return 1.0 / (1.0 + math.sqrt(v2))


    def force(position, velocity, mass, drag_area, time, coefficient, wind):
        v2 = velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2]
        lift = scale(cross(velocity, wind), coefficient * slope(v2) * drag_area)
        if v2 > STALL * STALL:
            return (0.5 * lift[0], lift[1] * math.cos(time), lift[2] - mass)
        if position[2] < 0.0:
            return (0.0, 0.0, -mass * position[2])
        return lift
"""

PULL = """
    def force(position_a, position_b, mass_a, mass_b, velocity_b, stiffness):
        x = position_b[0] - position_a[0]
        y = position_b[1] - position_a[1]
        z = position_b[2] - position_a[2]
        if x * x + y * y + z * z > 4.0:
            return (0.0, 0.0, 0.0)
        k = stiffness * mass_a * mass_b / (mass_a + mass_b) + 0.01 * velocity_b[0] * 0.0
        return (k * x, k * y, k * z)
"""


class Lift(xp.FieldLaw):
    """A force by hand."""

    kernel = "hand_pack.lift"
    columns: ClassVar[dict[str, Any]] = {"drag_area": xp.Column(default=0.3, unit="m^2", doc="Area.")}
    coefficient = xp.Param(0.7, unit="1", doc="C.")
    wind = xp.Param((0.0, 1.0, 0.2), unit="m/s", doc="W.")


class Heavy(xp.FieldLaw):
    """Weight by hand, with a potential in Python."""

    kernel = "hand_pack.heavy"
    g = xp.Param(9.81, unit="m/s^2", doc="g.")

    def potential(self, body: Any) -> Any:
        """m g z [J]."""
        return body.mass * self.g * body.position.z


class Pull(xp.PairLaw):
    """A spring by hand."""

    kernel = "hand_pack.pull"
    stiffness = xp.Param(4.0, unit="1/s^2", doc="k by reduced mass.")


@pytest.fixture
def pack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], Path]]:
    """A package outside the repository; call it with a name and a text for each kernel file."""
    folder = tmp_path / "hand_pack"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [name for name in sys.modules if name.startswith("hand_pack")]:
        monkeypatch.delitem(sys.modules, name)

    def put(name: str, text: str) -> Path:
        path = folder / f"{name}.py"
        path.write_text(textwrap.dedent(text))
        return path

    yield put


def flying(law: type[Any], count: int, compile: str, until: float = 1.0, **options: Any) -> tuple[Any, set[str]]:
    """Places and velocities of ``count`` bodies under ``law`` at ``until``, and the tiers that ran."""
    engine = xp.PhysicsEngine(up="z")
    engine._world.compile = compile
    mapped = engine.add_law(law, **options)
    bodies = [
        engine.add_object(
            xp.PhysicalObject(
                mass=1.0 + 0.1 * k, position=(0.3 * k, 0.0, 0.5 - 0.1 * k), velocity=(4.0 - 0.3 * k, 1.0, 0.2)
            ),
            laws=[mapped],
        )
        for k in range(count)
    ]
    engine.run(until=until, dt=1 / 64)
    return np.array([[*b.position, *b.velocity] for b in bodies]), set(engine._world.tiers.values())


@pytest.mark.parametrize(("count", "tier"), [(3, "interpreted"), (30, "numpy")])
def test_a_kernel_with_branches_gives_the_same_bits_in_all_tiers(pack: Any, count: int, tier: str) -> None:
    pack("lift", LIFT)
    compiled, compiled_tier = flying(Lift, count, "always")
    other, other_tier = flying(Lift, count, "never")
    assert (compiled_tier, other_tier) == ({"compiled"}, {tier})
    assert (compiled == other).all()
    assert np.ptp(compiled[:, 5]) > 0.01


@pytest.mark.parametrize(("count", "tier"), [(4, "interpreted"), (12, "numpy")])
def test_a_kernel_for_pairs_gives_the_same_bits_in_all_tiers(pack: Any, count: int, tier: str) -> None:
    pack("pull", PULL)
    compiled, compiled_tier = flying(Pull, count, "always")
    other, other_tier = flying(Pull, count, "never")
    assert (compiled_tier, other_tier) == ({"compiled"}, {tier})
    assert (compiled == other).all()
    masses = 1.0 + 0.1 * np.arange(count)
    speeds = np.array([[4.0 - 0.3 * k, 1.0, 0.2] for k in range(count)])
    assert masses @ compiled[:, 3:] == pytest.approx(masses @ speeds, rel=1e-12)


def test_explain_names_the_kernel_and_what_it_reads(pack: Any) -> None:
    pack("lift", LIFT)
    engine = xp.PhysicsEngine(up="z", compile="never")
    engine.add_object(xp.PhysicalObject(mass=1.0, velocity=(4.0, 1.0, 0.0)), laws=[engine.add_law(Lift)])
    engine.run(until=0.25, dt=1 / 64)
    (told,) = engine.explain().data["laws"]
    assert told["tier"] == "interpreted"
    assert "kernel" in told["kind"] and "hand" in told["kind"]
    assert told["reads"] == ["drag_area", "mass", "position", "time", "velocity"]
    assert told["kind"] in str(engine.explain())


def test_a_potential_in_python_stands_for_the_work_of_a_kernel(pack: Any) -> None:
    pack("heavy", "def force(mass, g, time):\n    return (0.0, 0.0, -mass * g + 0.0 * time)\n")
    engine = xp.PhysicsEngine(up="z")
    body = engine.add_object(xp.PhysicalObject(mass=2.0, velocity=(1, 0, 5)), laws=[engine.add_law(Heavy)])
    before = engine.energy()
    engine.run(until=1.0, dt=0.01)
    assert body.velocity[2] == pytest.approx(5.0 - 9.81)
    assert engine.energy().work == 0.0
    assert engine.energy().total == pytest.approx(before.total, rel=1e-12)


def test_a_kernel_that_reads_no_state_is_stored_as_any_constant_force(pack: Any) -> None:
    pack("heavy", "def force(mass, g):\n    return (0.0, 0.0, -mass * g)\n")
    engine = xp.PhysicsEngine(up="z")
    body = engine.add_object(xp.PhysicalObject(mass=2.0, velocity=(1, 0, 5)), laws=[engine.add_law(Heavy)])
    engine.run(until=1.0)
    assert body.position[2] == pytest.approx(5.0 - 0.5 * 9.81, rel=1e-15)


def test_a_parameter_takes_effect(pack: Any) -> None:
    pack("lift", LIFT)
    assert (flying(Lift, 3, "never")[0] != flying(Lift, 3, "never", coefficient=0.9)[0]).any()


@pytest.mark.parametrize("compile", ["never", "always"])
@pytest.mark.parametrize("count", [3, 30])
def test_an_edited_kernel_runs_as_it_stands(pack: Any, compile: str, count: int) -> None:
    pack("lift", LIFT)
    before, _ = flying(Lift, count, compile)
    pack("lift", LIFT.replace("STALL = 2.0**2.0 - math.sqrt(1.0)", "STALL = 3.9"))
    after, _ = flying(Lift, count, compile)
    assert (before != after).any()
    pack("lift", LIFT)
    assert (flying(Lift, count, compile)[0] == before).all()


BAD = [
    (
        "def force(position, colour):\n    return position\n",
        LawDefinitionError,
        r"argument 'colour' .* at hand: position",
    ),
    ("def force(possition):\n    return possition\n", LawDefinitionError, 'Did you mean "position"'),
    ("def pull(position):\n    return position\n", LawDefinitionError, "has no function 'force'; it has pull"),
    ("def force(position:\n", LawDefinitionError, r"lift.py:1: it is not Python"),
    ("def force(mass, time):\n    return mass\n", LawFailedError, "returned 1.0; a tuple of three numbers"),
    ("def force(position):\n    return (1.0, 2.0)\n", LawFailedError, r"returned \(1.0, 2.0\); a tuple of three"),
    ("import os\ndef force(position):\n    return (os.sep, 0.0, 0.0)\n", CompileError, "imports 'os'"),
    ("def force(position):\n    return (0.0, 1.0 / position[0], 0.0)\n", LawFailedError, "ZeroDivisionError"),
]


@pytest.mark.parametrize(("text", "error", "match"), BAD)
def test_what_is_wrong_with_a_kernel_is_said_before_anything_moves(
    pack: Any, text: str, error: Any, match: str
) -> None:
    pack("lift", text)
    engine = xp.PhysicsEngine(up="z")
    with pytest.raises(error, match=match):
        engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[engine.add_law(Lift)])
        engine.run(until=1.0, dt=0.1)
    assert engine.time == 0.0
    assert [body.position for body in engine.objects] in ([], [(0.0, 0.0, 0.0)])


PAIRS = [
    ("def force(position):\n    return position\n", LawDefinitionError, "position_a, position_b"),
    ("def force(position_a, time_b):\n    return position_a\n", LawDefinitionError, "argument 'time_b'"),
    ("def force(position_a):\n    return 1.0\n", LawFailedError, "returned 1.0; a tuple of three"),
]


@pytest.mark.parametrize(("text", "error", "match"), PAIRS)
def test_what_is_wrong_with_a_kernel_for_pairs_is_said_before_anything_moves(
    pack: Any, text: str, error: Any, match: str
) -> None:
    pack("pull", text)
    engine = xp.PhysicsEngine(up="z")
    law = engine.add_law(Pull)
    with pytest.raises(error, match=match):
        for k in range(2):
            engine.add_object(xp.PhysicalObject(position=(k, 0, 0)), laws=[law])
        engine.run(until=1.0, dt=0.1)
    assert engine.time == 0.0
    assert [body.position[0] for body in engine.objects] == [0.0, 1.0]


def test_a_kernel_that_is_nowhere_is_an_error(pack: Any) -> None:
    class Lost(xp.FieldLaw):
        """A law without its file."""

        kernel = "hand_pack.nowhere"

    engine = xp.PhysicsEngine()
    with pytest.raises(LawDefinitionError, match=r"hand_pack.nowhere.*there is no such Python file"):
        engine.add_object(xp.PhysicalObject(), laws=[engine.add_law(Lost)])
        engine.run(until=1.0)


def test_a_kernel_that_fails_on_its_way_is_an_error_that_names_the_law(pack: Any) -> None:
    pack("lift", "import math\ndef force(position, time):\n    return (math.sqrt(0.55 - time), 0.0, 0.0)\n")
    engine = xp.PhysicsEngine(up="z")
    body = engine.add_object(xp.PhysicalObject(velocity=(1, 0, 0)), laws=[engine.add_law(Lift)])
    with pytest.raises(LawFailedError, match="Lift: force raised ValueError"):
        engine.run(until=1.0, dt=0.1)
    assert math.isfinite(body.position[0])
