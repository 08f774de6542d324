"""Thesis 1.4 to 1.6, 3.2.1, 5.2, 5.3 and 6: packages of laws, precision, integration, order, measurements, formats, platforms."""

from __future__ import annotations

import ast
import inspect
import json
import random
import re
from pathlib import Path
from typing import Any, ClassVar

import pytest
import trimesh

import xpheve as xp
from xpheve.errors import MeshError
from xpheve.meshes import load_objects
from xpheve.plugins import Registry

ROOT = Path(__file__).parents[2]


@pytest.mark.thesis("plug-in")
def test_fig_3_10_a_law_and_a_container_plug_in_with_no_change_elsewhere(tmp_path: Path) -> None:
    """They are classes of this file; saved, restored and explained like all others."""

    class Above(xp.LawContainer):
        """Fires when an object of its laws is above 1 m."""

        id = "here:above"
        period = 0.125

        def detect(self) -> Any:
            """Look."""
            high = tuple(obj for law in self.laws for obj in law.objects if obj.position[1] > 1.0)
            return xp.Event(self.engine.time, objects=high) if high else None

    class Stop(xp.PhysicalLaw):
        """Stops what is too high."""

        id = "here:stop"
        initial_state: ClassVar[dict[str, Any]] = {"stopped": 0}

        def enforce_this_law(self, event: Any) -> None:
            """Stop."""
            for obj in event.objects:
                obj.velocity = (0, 0, 0)
                self.state["stopped"] += 1

    def scene() -> tuple[xp.PhysicsEngine, Any]:
        engine = xp.PhysicsEngine()
        law = engine.add_law(Stop, container=Above())
        return engine, engine.add_object(xp.PhysicalObject(velocity=(0, 1, 0), name="balloon"), laws=[law])

    engine, balloon = scene()
    engine.run(until=0.75)
    other = xp.PhysicsEngine.restore(engine.checkpoint(), laws=[Stop], containers=[Above])
    for one in (engine, other):
        one.run(until=3.0)
    assert balloon.position == (0, 1.125, 0) == other.object("balloon").position
    assert engine.laws[0].state["stopped"] == other.laws[0].state["stopped"] > 0
    assert "here:stop" in str(engine.explain())


class Bounds(xp.LawContainer):
    """Looks each 10 ms whether the boxes around two spheres meet."""

    period = 0.01

    def detect(self) -> Any:
        """Look."""
        a, b = self.laws[0].objects
        reach = a.shape.radius + b.shape.radius
        near = all(abs(p - q) <= reach for p, q in zip(a.position, b.position, strict=True))
        return xp.Event(self.engine.time, objects=(a, b)) if near else None


class Stand(xp.PhysicalLaw):
    """Stops both: the cheapest response of all."""

    def enforce_this_law(self, event: Any) -> None:
        """Stop."""
        for obj in event.objects:
            obj.velocity = (0, 0, 0)


@pytest.mark.thesis("precision-by-choice")
def test_5_2_precision_is_chosen_by_container_and_law() -> None:
    """Head-on at 1 m/s each, a gap of 1.005 m: a look each 10 ms is late by up to 2 cm, the exact container by nothing."""

    def places(cheap: bool) -> tuple[float, float]:
        engine = xp.PhysicsEngine()
        law = (
            engine.add_law(Stand(), container=Bounds())
            if cheap
            else engine.add_law("collision:elastic", restitution=0.0)
        )
        pair = [
            engine.add_object(xp.PhysicalObject(xp.Sphere(0.5), position=(x, 0, 0), velocity=(v, 0, 0)), laws=[law])
            for x, v in ((0.0, 1.0), (2.005, -1.0))
        ]
        engine.run(until=2.0)
        return pair[0].position[0], pair[1].position[0]

    left, right = places(cheap=True)
    assert 0.98 < right - left < 1.0
    left, right = places(cheap=False)
    assert right - left == pytest.approx(1.0, abs=1e-12)


@pytest.mark.thesis("packages-of-laws")
def test_5_3_every_law_comes_with_interface_cost_and_where_it_holds_beside_similar_ones() -> None:
    registry = Registry.default()
    infos = [info for info in registry.laws() if info.pack in ("basic", "collision")]
    assert len(infos) >= 21
    page = (ROOT / "docs" / "laws.md").read_text(encoding="utf-8")
    for info in infos:
        doc = inspect.getdoc(registry.law(info.id)) or ""
        assert re.search(r"\bholds?\b|\bvalid\b", doc, re.IGNORECASE), info.id
        assert re.search(r"\bcosts?\b", doc, re.IGNORECASE), f"{info.id}: say what it costs"
        assert "Benefits and drawbacks:" in doc, f"{info.id}: compare it with similar laws"
        assert "Source:" in doc, info.id
        assert f"## {info.id}" in page, info.id


@pytest.mark.thesis("packages-of-laws")
def test_5_3_packs_are_written_without_the_engines_source() -> None:
    """They import contracts only: laws, shapes, errors and the like, never what plans or runs."""
    inner = ("xpheve.plan", "xpheve.engine", "xpheve.scene", "xpheve.cli")
    for path in sorted((ROOT / "packages").glob("xpheve-laws-*/src/**/*.py")):
        for module in imported(path):
            assert not module.startswith(inner), f"{path.name} imports {module}"


def imported(path: Path) -> list[str]:
    """Return the modules that a file imports."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.append(node.module)
    return found


BOUND = {
    "_winapi", "crypt", "curses", "fcntl", "grp", "msvcrt", "nt", "ossaudiodev", "posix", "pty", "pwd", "resource", "spwd",
    "syslog", "termios", "tty", "winreg", "winsound",
}  # fmt: skip


@pytest.mark.thesis("platforms")
def test_1_5_nothing_is_bound_to_one_operating_system() -> None:
    for path in sorted((ROOT / "packages").glob("*/src/**/*.py")):
        assert not BOUND & {name.partition(".")[0] for name in imported(path)}, path
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"os\.(fork|mkfifo)\b|[\"']/(tmp|usr|etc|dev)/", text), path
        assert "os.getuid" not in text or 'hasattr(os, "getuid")' in text, path
    for path in sorted((ROOT / "packages").glob("*/pyproject.toml")):
        assert "flit_core.buildapi" in path.read_text(encoding="utf-8")  # pure Python: one wheel for all


@pytest.mark.thesis("integration")
def test_5_2_the_page_of_integration_has_the_four_decisions_and_the_seven_steps() -> None:
    """That its program runs is held by the test of the pages."""
    text = (ROOT / "docs" / "integration.md").read_text(encoding="utf-8")
    for word in ("first", "second", "third", "fourth"):
        assert re.search(rf"\b{word}\b", text, re.IGNORECASE)
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    steps = [int(number) for number in re.findall(r"# (\d)[.:]", code)]
    assert steps[:7] == [1, 2, 3, 4, 5, 6, 7]
    assert "assert" in code and "step(" in code


@pytest.mark.thesis("order-of-laws")
def test_6_laws_are_enforced_in_the_order_that_they_ask_for() -> None:
    def called(**asked: dict[str, Any]) -> list[str]:
        calls: list[str] = []
        kinds = [
            type(
                name,
                (xp.PhysicalLaw,),
                {
                    "id": f"order:{name}",
                    "enforce_this_law": lambda self, e: calls.append(self.id[6:]),
                    **asked.get(name, {}),
                },
            )
            for name in "abc"
        ]
        random.Random(3).shuffle(kinds)
        engine = xp.PhysicsEngine()
        holder = xp.LawContainer(xp.when.Started())
        for kind in kinds:
            engine.add_law(kind(), container=holder)
        engine.run(until=0.0)
        return calls

    assert called() == ["a", "b", "c"]  # by id, not as added
    assert called(c={"before": ("order:a",)}) == ["b", "c", "a"]
    assert called(a={"after": ("order:c",)}) == ["b", "c", "a"]
    assert called(b={"priority": 1}) == ["b", "a", "c"]
    assert called(b={"priority": -1}) == ["a", "c", "b"]


@pytest.mark.thesis("order-of-laws", "order-of-laws/measurements")
def test_6_the_measurements_say_time_beside_error() -> None:
    results = json.loads((ROOT / "benchmarks" / "results" / "results.json").read_text(encoding="utf-8"))
    ours = [row for row in results["rows"] if row["engine"] == "xPheve"]
    assert {row["scene"] for row in ours} >= {"S1", "S2", "S2b", "S12"}
    assert all(row["seconds"] > 0 and row["error"] is not None for row in ours)


@pytest.mark.thesis("only-when-needed")
def test_1_4_the_saving_is_a_number_beside_a_run_where_every_law_runs_at_each_update() -> None:
    """How the numbers are found is held by tests/benchmarks/test_noope.py."""
    rows = json.loads((ROOT / "benchmarks" / "results" / "noope.json").read_text(encoding="utf-8"))["rows"]
    for scene in ("busy", "quiet"):
        needed, *others = (row for row in rows if row["scene"] == scene)
        assert needed["setting"] == "when needed" and needed["error"] < 1e-12
        assert len(others) >= 2
        assert all(row["asked"] > 100 * needed["asked"] and row["error"] > 1e-4 for row in others)


@pytest.mark.thesis("formats")
@pytest.mark.parametrize("format", ["glb", "gltf", "obj", "stl", "ply"])
def test_1_6_geometry_is_read_from_files_of_these_formats(format: str, tmp_path: Path) -> None:
    brick = trimesh.creation.box((1.0, 2.0, 3.0))
    if format == "gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(brick.scene()).items():
            (tmp_path / name.replace("model", "brick")).write_bytes(data)
    else:
        brick.export(tmp_path / f"brick.{format}")
    (obj,) = load_objects(tmp_path / f"brick.{format}", density=2.0)
    assert obj.mass == pytest.approx(12.0, rel=1e-6) and obj.shape.volume == pytest.approx(6.0, rel=1e-6)


@pytest.mark.thesis("formats")
@pytest.mark.parametrize("format", ["wrl", "dxf", "step"])
def test_1_6_vrml_and_cad_formats_are_left_out_and_refused_with_the_way_out(format: str, tmp_path: Path) -> None:
    path = tmp_path / f"room.{format}"
    path.write_text("#VRML V2.0 utf8\n")
    with pytest.raises(MeshError, match=rf"\.glb, \.gltf, \.obj, \.stl, \.ply, not '\.{format}'; convert it"):
        load_objects(path)
