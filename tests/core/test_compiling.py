"""The user's choice of what is compiled: how it is given, kept, and told; it changes no bit of the motion."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import xpheve as xp
from xpheve.errors import InvalidValueError, RecordError, SceneError
from xpheve.plan.saved import VERSION
from xpheve.record.checkpoint import pack, unpack

DT = 0.01
CHOICES = ("auto", "always", "never")


def scene(compile: str = "auto", count: int = 5) -> xp.PhysicsEngine:
    """Gravity, drag and wind on objects that differ, springs between three of them, and a force that ends."""
    engine = xp.PhysicsEngine(up="z", compile=compile)
    gravity = engine.add_law("basic:planet_gravity")
    drag = engine.add_law("basic:quadratic_drag", name="drag")
    wind = engine.add_law("basic:wind", name="wind")
    spring = engine.add_law("basic:spring", name="spring")
    objects = [
        xp.PhysicalObject(
            name=f"o{k}",
            mass=1.0 + 0.1 * k,
            position=(k, 0.5 * k * k, 0),
            velocity=(1, -0.3 * k, 5),
            drag_area=0.1 + 0.01 * k,
        )
        for k in range(count)
    ]
    for k, obj in enumerate(objects):
        laws = [gravity, drag, *([wind] if k % 2 else []), *([spring] if k < 3 else [])]
        engine.add_object(obj, laws=laws)
    objects[-1].add_force((0.5, 0.0, 1.0), 0.777)
    return engine


def bits(engine: xp.PhysicsEngine) -> list[Any]:
    """All that moves, and the energies."""
    return [*((obj.position, obj.velocity) for obj in engine.objects), tuple(engine.energy())]


# The choice


def test_the_choice_is_read_and_set_and_wrong_ones_are_refused() -> None:
    assert xp.PhysicsEngine().compile == "auto"
    for choice in CHOICES:
        assert xp.PhysicsEngine(compile=choice).compile == choice
    for wrong in ("sometimes", "", None, True, 1, ["auto"]):
        with pytest.raises(InvalidValueError, match=r"compile = .*: choose 'auto', 'always' or 'never'"):
            xp.PhysicsEngine(compile=wrong)  # type: ignore[arg-type]
    engine = xp.PhysicsEngine(compile="never")
    with pytest.raises(InvalidValueError, match="choose 'auto'"):
        engine.compile = "yes"
    assert engine.compile == "never"
    engine.compile = "always"
    assert engine.compile == "always"


def tiers(engine: xp.PhysicsEngine) -> list[str]:
    return [group["tier"] for group in engine.explain().data["groups"] if group["tier"]]


@pytest.mark.parametrize(
    ("choice", "count", "tier"),
    [
        ("auto", 5, "interpreted"),
        ("auto", 100, "numpy"),
        ("auto", 300, "compiled"),
        ("always", 5, "compiled"),
        ("never", 5, "interpreted"),
        ("never", 300, "numpy"),
    ],
)
def test_how_a_loop_runs_follows_from_the_choice_and_the_size_of_the_scene(choice: str, count: int, tier: str) -> None:
    engine = xp.PhysicsEngine(compile=choice, stepper="core:midpoint")
    drag = engine.add_law("basic:linear_drag")
    engine.add_objects([xp.PhysicalObject(velocity=(1, k, 0)) for k in range(count)], laws=[drag])
    engine.run(0.05, dt=DT)
    assert tiers(engine) == [tier]


def test_a_choice_made_on_the_way_holds_from_the_next_step_on_and_changes_no_bit() -> None:
    engine, other = scene("never"), scene("never")
    for until, choice in ((0.305, "always"), (0.61, "auto"), (1.0, "never")):
        engine.run(until, dt=DT)
        other.run(until, dt=DT)
        engine.compile = choice
    engine.run(1.5, dt=DT)
    other.run(1.5, dt=DT)
    assert bits(engine) == bits(other)


# Same bits


@pytest.fixture(scope="module")
def whole() -> list[Any]:
    """A thousand steps in one go, by text that is interpreted."""
    engine = scene("never")
    engine.run(10.0, dt=DT)
    return bits(engine)


@pytest.mark.parametrize("choice", CHOICES)
def test_the_choice_changes_no_bit(choice: str, whole: list[Any]) -> None:
    engine = scene(choice)
    engine.run(10.0, dt=DT)
    assert bits(engine) == whole


@pytest.mark.parametrize("choice", ["always", "never"])
@pytest.mark.parametrize("every", [None, 0.013])
def test_a_run_saved_in_the_midst_of_a_step_goes_on_to_the_bit(
    choice: str, every: float | None, whole: list[Any]
) -> None:
    engine = scene(choice)
    engine.run(4.0051, dt=DT, every=every)
    data = engine.checkpoint()
    restored, twin = xp.PhysicsEngine.restore(data), engine.copy()
    for one in (restored, twin):
        assert one.compile == choice and one._world.tiers == engine._world.tiers != {}
        assert bits(one) == bits(engine)
        one.run(10.0, dt=DT, every=every)
        assert bits(one) == whole
    engine.run(10.0, dt=DT, every=every)
    assert bits(engine) == whole
    assert restored.checkpoint() == engine.checkpoint()


def test_a_checkpoint_goes_on_in_another_process(tmp_path: Path, whole: list[Any]) -> None:
    engine = scene("always")
    engine.run(2.0051, dt=DT)
    engine.checkpoint(tmp_path / "half.checkpoint")
    code = (
        "import sys, xpheve as xp\n"
        f"engine = xp.PhysicsEngine.restore({str(tmp_path / 'half.checkpoint')!r})\n"
        f"engine.run(10.0, dt={DT})\n"
        "print([*((obj.position, obj.velocity) for obj in engine.objects), tuple(engine.energy())])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == repr(whole)


def test_what_rounding_left_and_the_work_done_are_kept() -> None:
    engine = scene("never")
    engine.run(1.005, dt=DT)
    restored = xp.PhysicsEngine.restore(engine.checkpoint())
    for batch, other in zip(engine._world.batches, restored._world.batches, strict=True):
        assert batch.state.arrays.keys() == other.state.arrays.keys()
        for name, array in batch.state.arrays.items():
            assert array.tobytes() == other.state.arrays[name].tobytes(), name
    kept = [batch.state.arrays for batch in engine._world.batches if "position_rest" in batch.state.arrays]
    for name in ("position_rest", "velocity_rest", "work", "work_rest"):
        assert any(arrays[name].any() for arrays in kept), name


@pytest.mark.parametrize("choice", ["always", "never"])
def test_reset_comes_back_to_the_same_run_and_keeps_the_choice(choice: str) -> None:
    engine = scene("auto")
    engine.run(1.005, dt=DT)
    first = bits(engine)
    engine.compile = choice
    engine.reset()
    assert engine.compile == choice
    engine.run(1.005, dt=DT)
    assert bits(engine) == first


def test_switches_are_kept_so_that_a_restored_engine_links_the_same_loops() -> None:
    engine = scene("never")
    engine.run(0.3, dt=DT)
    drag = engine.law("drag")
    drag.enabled = False
    engine.run(0.6, dt=DT)
    drag.enabled = True
    engine.run(0.9, dt=DT)
    drag.enabled = False
    engine.run(1.2051, dt=DT)
    restored = xp.PhysicsEngine.restore(engine.checkpoint())
    assert restored._world.is_switched(restored.law("drag"))
    for one in (engine, restored):
        one.law("drag").enabled = True
        one.run(2.0, dt=DT)
    assert bits(restored) == bits(engine)
    assert restored.checkpoint() == engine.checkpoint()


# Where else it is kept


def test_checkpoints_of_other_versions_are_refused_by_name() -> None:
    header, arrays = unpack(scene().checkpoint())
    assert header["version"] == VERSION == 3
    for version, way in ((2, "older|wrote it"), (4, "upgrade xpheve"), ("x", "upgrade"), (None, "upgrade")):
        with pytest.raises(
            RecordError, match=rf"checkpoint version {version!r}: this xpheve reads version 3; .*({way})"
        ):
            xp.PhysicsEngine.restore(pack((header | {"version": version}, arrays)))


def test_records_say_what_was_wished_and_how_each_loop_ran() -> None:
    engine = scene("never")
    record = engine.run(0.1, dt=DT, every=0.05)
    assert record.metadata["compile"] == "never"
    assert set(record.metadata["tiers"].values()) == {"interpreted"}
    assert any("basic:spring" in laws for laws in record.metadata["tiers"])


def test_scene_files_say_it_where_it_is_not_the_usual_one(tmp_path: Path) -> None:
    for form in ("toml", "json"):
        for choice in CHOICES:
            path = tmp_path / f"{choice}.{form}"
            scene(choice).save_scene(path)
            assert ("compile" in path.read_text()) == (choice != "auto")
            assert xp.PhysicsEngine.load_scene(path).compile == choice
            assert xp.PhysicsEngine.load_scene(path, compile="never").compile == "never"
    wrong = tmp_path / "wrong.toml"
    wrong.write_text('xpheve = 1\ncompile = "sometimes"\n')
    with pytest.raises(SceneError, match=r"wrong.toml:2: compile = .*sometimes"):
        xp.PhysicsEngine.load_scene(wrong)
