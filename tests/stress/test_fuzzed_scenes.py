"""Scene files from strangers: 100,000 spoilt ones give an error or a finite answer, and never anything else.

Each file is one of two valid scenes, a plain one and one with nearly all that a file can say, spoilt by a seed: in its text, or in its
tables (wrong types, huge numbers, NaN, deep nesting, long names, unknown keys, paths that lead out, texts that look like code). What can
be read is carried one host step further.
"""

from __future__ import annotations

import ast
import copy
import importlib
import json
import pkgutil
import random
import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import xpheve as xp
import xpheve_laws_basic
import xpheve_laws_collision
from xpheve.errors import SceneError, XpheveError
from xpheve.plugins.suggest import closest
from xpheve.scene import dumps, loads

LONGEST = 20.0  # [s] one file may take on a busy machine; the mean is below a hundredth of it
CODE = (
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "os.spawn",
    "subprocess.Popen",
    "socket.connect",
    "exec",
    "compile",
    "pty.spawn",
    "open",
)

SCENE: dict[str, Any] = {
    "xpheve": 1,
    "up": "z",
    "seed": 3,
    "force_ids": 9,
    "run": {"until": 1.0, "every": 0.1, "record": "run.arrow"},
    "containers": [{"name": "clock", "condition": {"kind": "Elapsed", "seconds": 1.0, "every": True}}],
    "laws": [
        {"id": "basic:planet_gravity", "name": "gravity", "acceleration": 9.81},
        {"id": "basic:linear_drag", "name": "air", "coefficient": 0.1},
        {"id": "basic:spring", "between": [["ball"], ["hook"]], "stiffness": "3 N/m", "rest_length": 0.5},
        {"id": "collision:elastic", "name": "bounce", "restitution": 0.8},
        {"id": "basic:damper_to_point", "enabled": False, "damping": 1.0},
    ],
    "objects": [
        {
            "name": "ball",
            "shape": {"kind": "sphere", "radius": 0.1},
            "density": 100.0,
            "position": [0.0, -1.5, 3.0],
            "velocity": [0.1, 0.0, -2.0],
            "columns": {"restitution": 0.5},
            "laws": ["gravity", "bounce"],
            "forces": [{"vector": [1.0, 0.0, 0.0], "duration": 2.0, "id": "push"}, {"vector": [0.0, 1.0, 0.0], "id": 4}],
        },
        {"name": "floor", "fixed": True, "shape": {"kind": "plane", "offset": -1.0}, "laws": ["bounce"]},
        {"name": "hook", "mass": 2.0, "position": [0.0, 0.0, 5.0], "driven": True,
         "arrival": {"position": [1.0, 0.0, 5.0], "within": 2.0}},
        {"name": "brick", "shape": {"kind": "box", "size": [1, 2, 3]}, "mass": 2, "position": [9, 9, 9],
         "angular_velocity": [1, 2, 3], "orientation": [0.6, 0, 0.8, 0], "laws": ["air"]},
    ],
}  # fmt: skip

_ROOM = {"shape": "box", "size": [2.0, 2.0, 2.0], "position": [5.0, 0.0, 0.0], "orientation": [0.6, 0.0, 0.8, 0.0]}
_TIP = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
_FACES = [[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]]
RICH: dict[str, Any] = {
    "xpheve": 1,
    "up": "z",
    "seed": 3,
    "observers": [{"name": "eye", "position": [9.0, 0.0, 0.0], "radius": 1.0}],
    "probes": [{"name": "tip", "attached": "ball"}, {"name": "pin", "position": [4.5, 0.0, 0.0]}],
    "containers": [
        {"name": "cc", "condition": {"kind": "AnyOf", "of": [
            {"kind": "ProbeEnter", "region": _ROOM, "probe": "tip"},
            {"kind": "ObserverExit", "region": {"shape": "sphere", "radius": 9.0, "position": [1.0, 0.0, 0.0]}},
            {"kind": "AllOf", "of": [{"kind": "Posted", "id": "a"}, {"kind": "Elapsed", "seconds": 0.0004, "every": True}]},
            {"kind": "AllNow", "of": [
                {"kind": "Elapsed", "seconds": 0.0002},
                {"kind": "Not", "of": [{"kind": "RegionActive", "region": {"shape": "plane", "normal": [0, 0, 1], "position": [0, 0, 1]}}]},
            ]},
            {"kind": "ContactBegin", "a": "ball", "b": "house"}, {"kind": "Input", "input": "k", "match": {"a": 1}},
            {"kind": "Asleep", "obj": "ball"}, {"kind": "PoseChanged", "obj": "ball", "tol": 0.1}, {"kind": "Changed", "what": "mass"},
        ]}},
        {"name": "start", "condition": {"kind": "Started", "once": True}},
    ],
    "laws": [
        {"id": "basic:planet_gravity", "name": "gravity", "acceleration": 9.81},
        {"id": "basic:black_hole_gravity", "name": "hole", "mass": 1000.0, "position": [0.0, 0.0, -50.0]},
        {"id": "basic:buoyancy", "name": "sea", "density": 1000.0, "surface": 1.0},
        {"id": "basic:magnus", "name": "curl", "coefficient": 0.75},
        {"id": "basic:rotating_frame", "name": "ship", "angular_velocity": [0.0, 0.0, 1.0]},
        {"id": "basic:wind", "name": "wind", "velocity": [5.0, 0.0, 0.0], "container": "cc"},
        {"id": "basic:thrust", "name": "rocket", "thrust": [0.0, 0.0, 3.0], "container": "start"},
        {"id": "basic:electric_field", "name": "plates", "field": [0.0, 0.0, 5.0]},
        {"id": "basic:magnetic_field", "name": "coil", "field": [0.0, 1.0, 0.0]},
        {"id": "collision:elastic", "name": "bounce", "restitution": 0.8},
        {"id": "collision:elastic", "name": "skin", "restitution": 1.0},
        {"id": "collision:stop", "name": "stop", "container": "collision:picking"},
        {"id": "collision:reverse", "name": "reverse", "container": "collision:bounding_box"},
    ],
    "objects": [
        {"name": "ball", "shape": {"kind": "sphere", "radius": 0.1}, "mass": 1.0, "position": [0.0, 0.0, 3.0], "velocity": [0, 0, -1.0],
         "angular_velocity": [1.0, 2.0, 3.0], "columns": {"drag_area": 0.1, "charge": 1e-3},
         "laws": ["gravity", "curl", "wind", "bounce", "rocket", "plates", "coil"]},
        {"name": "marble", "shape": {"kind": "sphere", "radius": 0.1}, "density": 100.0, "position": [0.2, 0.1, 1.1005], "velocity": [0, 0, -1.0],
         "laws": ["skin"]},
        {"name": "hammer", "position": [3.0, 0.0, 3.0], "angular_velocity": [0.0, 1.0, 0.5],
         "shape": {"kind": "compound", "parts": [
             {"shape": {"kind": "capsule", "radius": 0.1, "length": 0.3}, "density": 100.0},
             {"shape": {"kind": "box", "size": [0.1, 0.2, 0.3]}, "position": [0.0, 0.0, 0.3], "orientation": [0.8, 0.6, 0, 0], "density": 200.0}]},
         "laws": ["gravity", "hole", "ship", "bounce"]},
        {"name": "dice", "shape": {"kind": "hull", "points": _TIP, "faces": _FACES}, "density": 10.0, "position": [0.0, 4.0, 6.0],
         "velocity": [0, 0, -400.0], "laws": ["gravity", "sea", "bounce"]},
        {"name": "stone", "shape": {"kind": "mesh", "vertices": _TIP, "faces": _FACES}, "density": 10.0, "position": [-6.0, 0.0, 3.0],
         "orientation": [0.8, 0.6, 0.0, 0.0], "angular_velocity": [0.0, 0.3, 0.0], "laws": ["gravity"]},
        {"name": "house", "shape": {"kind": "mesh", "file": "house.stl"}, "fixed": True, "position": [0.0, 0.0, 0.5], "laws": ["skin"]},
        {"name": "lift", "shape": {"kind": "box", "size": [1, 1, 1]}, "mass": 2.0, "position": [0.0, 4.0, 5.0], "driven": True,
         "velocity": [0.0, 0.0, 1.0], "angular_velocity": [0.0, 0.0, 1.0],
         "laws": ["bounce"]},
        {"name": "crate", "shape": {"kind": "box", "size": [1, 1, 1]}, "mass": 2.0, "position": [0.0, 8.0, 1.0], "velocity": [0, 0, -3.0],
         "laws": ["stop"]},
        {"name": "lid", "shape": {"kind": "box", "size": [1, 1, 1]}, "mass": 2.0, "position": [0.0, 8.0, 1.99], "laws": ["stop"]},
    ],
}  # fmt: skip

ODD: list[Any] = [
    None, True, False, 0, -1, 1, 7, 1 << 70, -(1 << 63), 0.0, -0.0, 5e-324, -5e-324, 1e308, -1e308, 1e-300, 0.1, float("nan"),
    float("inf"), float("-inf"), "", "ball", "#1", "#99", "gravity", "nan", "inf", "1e999", "9.81 m/s^2", "3 parsec", "\0", "\ud800",
    "\u202e\U0001f600", "x" * 300, "a" * 5000, "../../etc/passwd", "/etc/passwd", "C:\\x", "file:///etc/passwd", "http://example.org/x",
    "os:system", "__import__('os').system('true')", "{{7*7}}", "$(true)", "basic:planet_gravity", "collision:elastic", "Elapsed",
    [], {}, [[]], [{}], [1, 2], [1, 2, 3], [0, 0, 0], [1e308, 1e308, 1e308], ["1 N", 0, 0], [1, 2, 3, 4], [None] * 3, [["ball"], ["ball"]],
    {"kind": "sphere", "radius": 1e300}, {"kind": "sphere", "radius": 5e-324}, {"kind": "box", "size": [1e200, 1, 1]}, {"kind": "plane"},
    {"kind": "capsule", "radius": 1, "length": 1}, {"kind": "toy:ring"}, {"kind": "Elapsed", "seconds": 1e-3}, {"kind": "Posted"},
    {"kind": "hull", "points": _TIP}, {"kind": "mesh", "file": "house.stl"}, {"kind": "mesh", "file": "../house.stl"},
    {"shape": "sphere", "radius": 1.0}, {"shape": {"kind": {}}}, {"kind": "Not", "of": [{"kind": "Asleep", "obj": "ball"}]},
    {"kind": "compound", "parts": []}, "house.stl", "tip", "eye", "collision:picking",
]  # fmt: skip
KEYS = ["name", "id", "mass", "density", "inertia", "shape", "laws", "forces", "between", "container", "condition", "enabled", "driven",
        "arrival", "fixed", "columns", "position", "velocity", "orientation", "within", "duration", "vector", "torque", "kind", "radius",
        "size", "seconds", "every", "until",
        "of", "region", "points", "faces", "vertices", "file", "parts", "attached", "once", "obj", "a", "b",
        "record", "$schema", "__class__", "__init__", "__dict__", "self", "constructor", "import",
        "x" * 500, "", "a.b", "\n", "posision"]  # fmt: skip
PIECES = ["[", "]", "{", "}", '"', "'", '"""', "#", "=", ",", ".", "\n", "\\", "\0", "\ufeff", "-", "nan", "inf", "1e999", "1_000", "0x10",
          "true", "[[objects]]\n", "[[laws]]\n", "mass = -1\n", "1979-05-27T07:32:00Z", "#1", "\u202e", "[objects.shape]\n", "a.b.c = 1\n",
          "[" * 300, '{"a":' * 200]  # fmt: skip


def places(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every path to a value in ``tree``."""
    rows = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in rows:
        yield (*path, key)
        yield from places(value, (*path, key))


def spoilt_tables(chance: random.Random, base: dict[str, Any]) -> str:
    """The scene ``base`` as JSON with one to four of its values changed, taken out, doubled, moved or buried."""
    tree = copy.deepcopy(base)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 4))):
        path = chance.choice(list(places(tree)))
        holder = tree
        for key in path[:-1]:
            holder = holder[key]
        how, odd = chance.randrange(10), copy.deepcopy(chance.choice(ODD))
        if how < 4:
            holder[path[-1]] = odd
        elif how == 4:
            del holder[path[-1]]
        elif how == 5 and isinstance(holder, dict):
            holder[chance.choice(KEYS)] = odd
        elif how == 6 and isinstance(holder, dict):
            holder[chance.choice(KEYS)] = holder.pop(path[-1])
        elif how == 7 and isinstance(holder, list):
            holder.extend(copy.deepcopy(holder[: chance.randrange(1, 4)]))
        elif how == 8:
            for _ in range(chance.choice((1, 3, 40, 400))):
                odd = [odd] if chance.random() < 0.5 else {"kind": odd}
            holder[path[-1]] = odd
        elif isinstance(holder[path[-1]], float):
            holder[path[-1]] *= chance.choice((-1.0, 1e-200, 1e200, 1e30, 0.0))
        if not tree:
            break
    return json.dumps(tree)


def spoilt_text(chance: random.Random, text: str) -> str:
    """``text`` with slices taken out, doubled, put elsewhere or replaced."""
    for _ in range(chance.randrange(1, 4)):
        start, at = chance.randrange(len(text) + 1), chance.randrange(len(text) + 1)
        end = min(len(text), start + chance.randrange(60))
        piece = chance.choice(
            [chance.choice(PIECES), text[start:end], chr(chance.randrange(0xD000)), repr(chance.choice(ODD))]
        )
        text = chance.choice(
            [text[:start] + text[end:], text[:at] + piece + text[at:], text[:start] + piece + text[end:], text[:end]]
        )
    return text


class Heard:
    """Audit events that mean that code runs or a foreign file is opened; deaf outside `listening`. A hook cannot be taken out again."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.on = False
        self.found: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, args: tuple[Any, ...]) -> None:
        if not (self.on and event in CODE):
            return
        self.on = False  # the check parses, too
        try:
            if not (event == "open" and self._is_own(args[0])) and not _is_loop(event, args):
                self.found.append(f"{event} {str(args[:2])[:200]}")
        finally:
            self.on = True

    def _is_own(self, path: Any) -> bool:
        """Whether it is the mesh beside the scene."""
        return isinstance(path, (str, Path)) and Path(path).resolve().parent == self.folder

    @contextmanager
    def listening(self) -> Iterator[None]:
        self.on = True
        try:
            yield
        finally:
            self.on = False


KERNELS = Path(xp.__file__).resolve().parent / "kernels"
TEXTS = ("<traced law>", "<loop for arrays>", "<xpheve ")
"""What the engine calls the texts that it makes of laws."""
CALLED = {"range", "min", "max", "abs", "int", "float", "chunks", "all_pairs", "add_pairs", "left"}
"""What these texts may call besides their own functions, helpers of kernels (file__name), NumPy and math."""


def _is_loop(event: str, args: tuple[Any, ...]) -> bool:
    """Whether a loop that the engine made of laws is made ready: arithmetic on arrays, and nothing else."""
    if event == "exec":
        return str(getattr(args[0], "co_filename", "")).startswith(TEXTS)
    if event == "open":  # a kernel file, which such a text is made of
        return isinstance(args[0], (str, Path)) and Path(args[0]).resolve().parent == KERNELS
    if event != "compile":
        return False
    source, name = args[:2]
    text = source.decode() if isinstance(source, bytes) else str(source)
    if Path(str(name)).resolve().parent == KERNELS:
        return True
    return (name == "<text>" or str(name).startswith(TEXTS)) and _is_arithmetic(text)


def _is_arithmetic(text: str) -> bool:
    """Whether ``text`` imports nothing but math, and calls nothing but arithmetic."""
    tree = ast.parse(text)
    own = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    for node in ast.walk(tree):
        if isinstance(node, (ast.Import, ast.ImportFrom)) and [one.name for one in node.names] != ["math"]:
            return False
        if isinstance(node, ast.Attribute) and not (
            isinstance(node.value, ast.Name) and node.value.id in ("np", "math")
        ):
            return False
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            called = node.func.id
            if not (called in own or called in CALLED or "__" in called.strip("_")):
                return False
    return True


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory) -> Heard:
    """The ear, when all that a sound scene needs is imported."""
    folder = tmp_path_factory.mktemp("scenes").resolve()
    trimesh.creation.box((2.0, 2.0, 1.0)).export(folder / "house.stl")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for base in (SCENE, RICH):
            engine = loads(json.dumps(base), "json", folder=folder)
            engine.step(1e-3)
            engine.explain()
            loads(dumps(engine, "toml"), folder=folder)
    for package in (xp, xpheve_laws_basic, xpheve_laws_collision):  # what only spoilt scenes need
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    closest("a", ["ab"])
    return Heard(folder)


@contextmanager
def no_longer_than(seconds: float) -> Iterator[None]:
    """A file that hangs fails."""

    def late(number: int, frame: Any) -> None:
        raise TimeoutError(f"longer than {seconds} s")

    held = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, held)


def outcome(text: str, form: str, heard: Heard) -> str:
    """What reading and one step come to; anything but an error of xPheve or a finite state comes through."""
    try:
        with heard.listening():
            engine = loads(text, form, name="s", folder=heard.folder)
    except SceneError as wrong:
        assert len(str(wrong)) < 3000
        return "refused"
    assert_finite(engine)
    try:
        with heard.listening():
            engine.step(1e-3)
    except XpheveError:
        return "refused in the run"
    assert_finite(engine)
    return "ran"


def assert_finite(engine: xp.PhysicsEngine) -> None:
    for name in ("position", "velocity", "orientation", "angular_velocity", "mass", "inertia"):
        assert np.isfinite(getattr(engine.bodies, name)).all(), name


def spoilt_file(seed: int, base: dict[str, Any], toml: str) -> tuple[str, str]:
    """A file and its form."""
    chance, kind = random.Random(seed), seed % 4
    text = spoilt_text(chance, toml) if kind == 0 else spoilt_tables(chance, base)
    if kind == 1:
        text = spoilt_text(chance, text) if chance.random() < 0.3 else text
    return text, "toml" if kind == 0 else "json"


def fuzz(seeds: range, base: dict[str, Any], heard: Heard) -> Counter[str]:
    """The outcomes of the files made of ``base`` by ``seeds``."""
    found: Counter[str] = Counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        toml = dumps(loads(json.dumps(base), "json", folder=heard.folder), "toml")
        for seed in seeds:
            text, form = spoilt_file(seed, base, toml)
            try:
                with no_longer_than(LONGEST):
                    found[outcome(text, form, heard)] += 1
                assert not heard.found, f"code ran, or a foreign file was opened: {heard.found[:3]}"
            except BaseException as wrong:
                wrong.add_note(f"seed {seed} of the {'rich' if base is RICH else 'plain'} scene")
                raise
    return found


BASES = pytest.mark.parametrize("base", [SCENE, RICH], ids=["plain", "rich"])


@BASES
def test_six_hundred_spoilt_scenes_are_refused_or_give_a_finite_answer(base: dict[str, Any], heard: Heard) -> None:
    found = fuzz(range(600), base, heard)
    assert found["refused"] > 150 and found["ran"] > 60


@pytest.mark.stress
@BASES
def test_fifty_thousand_spoilt_scenes_are_refused_or_give_a_finite_answer(
    base: dict[str, Any], heard: Heard, capsys: pytest.CaptureFixture[str]
) -> None:
    begin = time.perf_counter()
    found = fuzz(range(1000, 51_000) if base is RICH else range(10_000, 60_000), base, heard)
    with capsys.disabled():
        print(f"\n{sum(found.values())} spoilt scenes in {time.perf_counter() - begin:.0f} s: {dict(found)}")
