"""Mesh files from strangers: small sound files of every format, spoilt at random; an error or a finite shape, and no hang.

What can be read goes into an engine, falling on a ball, for a step. No other file is opened and nothing is run.
"""

from __future__ import annotations

import os
import random
import signal
import struct
import sys
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
from xpheve.errors import MeshError, XpheveError
from xpheve.meshes import load
from xpheve.shapes import Compound, Shape

SLOWEST = 20.0
"""[s] of one file of a few hundred bytes, on a busy machine; the usual is milliseconds."""
RUNS = (
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "os.spawn",
    "subprocess.Popen",
    "socket.",
    "pty.spawn",
    "urllib.Request",
)
LIBRARIES = tuple({os.path.realpath(place) for place in (*sys.path, sys.prefix, sys.base_prefix) if place})
"""Where modules are imported from, when first needed."""


class Heard:
    """Audit events of commands, sockets and files outside ``folder``; deaf outside `listening`. A hook cannot be taken out again."""

    def __init__(self, folder: Path) -> None:
        self.folder = os.path.realpath(folder)
        self.on = False
        self.found: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, args: tuple[Any, ...]) -> None:
        if self.on and (event.startswith(RUNS) or (event == "open" and not self._is_fair(args[0]))):
            self.found.append(f"{event} {str(args[:2])[:200]}")

    def _is_fair(self, path: Any) -> bool:
        if not isinstance(path, (str, bytes, os.PathLike)):
            return False
        real = os.path.realpath(os.fsdecode(path))
        return real.startswith(self.folder + os.sep) or (real.startswith(LIBRARIES) and "test" not in real)

    @contextmanager
    def listening(self) -> Iterator[None]:
        self.on = True
        try:
            yield
        finally:
            self.on = False


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


def samples(folder: Path) -> list[tuple[str, bytes]]:
    """Ending and bytes of small files that can be read."""
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(0.5, (1, 1, 0))
    scene.add_geometry(box, node_name="one", geom_name="box", transform=turn)
    scene.add_geometry(box, node_name="two", geom_name="box", parent_node_name="one", transform=np.diag([2, 2, 2, 1.0]))
    tables = trimesh.exchange.gltf.export_gltf(scene, merge_buffers=True)
    folder.mkdir(exist_ok=True)
    for name, data in tables.items():
        (folder / name).write_bytes(data)
    return [
        (".glb", scene.export(file_type="glb")),
        (".gltf", tables["model.gltf"]),
        (".obj", box.export(file_type="obj").encode()),
        (".obj", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf -1 1 2\nusemtl ../x\nmtllib a.mtl\n"),
        (".stl", box.export(file_type="stl")),
        (".stl", trimesh.exchange.stl.export_stl_ascii(box).encode()),
        (".ply", box.export(file_type="ply")),
        (".ply", trimesh.exchange.ply.export_ply(box, encoding="ascii")),
    ]


NUMBERS = (
    b"nan",
    b"inf",
    b"-1",
    b"0",
    b"1e308",
    b"4294967295",
    b"99999999999999999999",
    b"1e-320",
    b"-7",
    b"{}",
    b"[]",
)


def spoilt(data: bytes, rng: random.Random) -> bytes:
    """``data`` with one to four faults."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        if not data:
            return data
        data = rng.choice((_bits, _bits, _cut, _doubled, _number, _number, _length, _tail, _token))(data, rng)
    return data


def _bits(data: bytes, rng: random.Random) -> bytes:
    found = bytearray(data)
    for _ in range(rng.choice((1, 1, 3, 20))):
        found[rng.randrange(len(found))] = rng.choice((0, 255, rng.randrange(256)))
    return bytes(found)


def _cut(data: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(data))
    return data[:start] if rng.random() < 0.5 else data[:start] + data[start + rng.randrange(1, 40) :]


def _doubled(data: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(data))
    piece = data[start : start + rng.randrange(1, 200)]
    return data[:start] + piece * rng.choice((2, 2, 50)) + data[start:]


def _number(data: bytes, rng: random.Random) -> bytes:
    """Another number in place of one in a text."""
    places = [k for k in range(1, len(data)) if data[k : k + 1].isdigit() and not data[k - 1 : k].isdigit()]
    if not places:
        return data
    start = end = rng.choice(places)
    while end < len(data) and data[end : end + 1] in b"0123456789.e-+":
        end += 1
    return data[:start] + rng.choice(NUMBERS) + data[end:]


def _length(data: bytes, rng: random.Random) -> bytes:
    """A huge or odd whole number of four bytes somewhere near the start."""
    at = rng.randrange(max(min(len(data) - 4, 120), 1))
    value = rng.choice((0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000, len(data)))
    return data[:at] + struct.pack("<I", value) + data[at + 4 :]


def _tail(data: bytes, rng: random.Random) -> bytes:
    return data + bytes(rng.randrange(256) for _ in range(rng.randrange(1, 100)))


def _token(data: bytes, rng: random.Random) -> bytes:
    pairs = (
        (b'"children"', b'"mesh"'),
        (b'"mesh"', b'"children"'),
        (b"[1]", b"[0]"),
        (b"gltf_buffer_0.bin", b"../../../etc/passwd"),
        (b"gltf_buffer_0.bin", b"http://127.0.0.1:9/x"),
        (b"gltf_buffer_0.bin", b"file:///etc/passwd"),
        (b"vertex", b"face"),
        (b"float", b"list uchar int"),
        (b"VEC3", b"MAT4"),
        (b"5126", b"5121"),
        (b"facet", b"vertex"),
        (b"f ", b"v "),
        (b"v ", b"f "),
        (b"matrix", b"rotation"),
    )
    old, new = rng.choice(pairs)
    return data.replace(old, new, rng.choice((1, -1)))


def is_finite(shape: Shape) -> bool:
    """Whether all that a shape says of itself is finite."""
    if isinstance(shape, Compound):
        places = all(np.isfinite([*part.position, *part.orientation]).all() for part in shape.parts)
        return places and np.isfinite(shape.reach) and all(is_finite(part.shape) for part in shape.parts)
    values = [shape.volume, shape.reach, *shape.frame[0], *shape.frame[1], *(shape.inertia(1.0) if shape.solid else ())]
    return bool(np.isfinite(values).all() and np.isfinite(shape.vertices).all())  # type: ignore[attr-defined]


def carried_a_step(shape: Shape) -> str:
    """What an engine makes of a body of ``shape`` that falls on a ball, if convex turning; a finite answer, or an error of xPheve."""
    engine = xp.PhysicsEngine()
    laws = [engine.add_law("basic:planet_gravity"), engine.add_law("collision:elastic")]
    try:
        given = {"density": 10.0} if shape.solid else {"mass": 1.0, "inertia": (1.0, 1.0, 1.0)}
        spin = (
            (0.0, 0.0, 0.0) if "Mesh(" in repr(shape) else (0.1, 0.2, 0.3)
        )  # contacts of meshes: where they do not turn
        body = xp.PhysicalObject(shape, velocity=(0, 0, -1), angular_velocity=spin, **given)
        engine.add_object(
            xp.PhysicalObject(xp.Sphere(0.5), fixed=True, position=(0, 0, -shape.reach - 0.501)), laws=laws
        )
        engine.add_object(body, laws=laws)
        engine.step(0.01)
    except XpheveError as wrong:
        assert len(str(wrong)) < 3000
        return "refused by the engine"
    values = [*body.position, *body.velocity, *body.orientation, *body.angular_velocity, body.mass]
    assert np.isfinite(values).all(), values
    return "moved"


def fuzz(folder: Path, count: int, seed: int) -> Counter[str]:
    """Read ``count`` spoilt files; how many were refused, mended, read without a word, and then moved."""
    whole = samples(folder)
    for ending, data in whole:  # imports all that sound files need
        (folder / f"sound{ending}").write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            carried_a_step(load(folder / f"sound{ending}"))
    heard = Heard(folder)
    rng = random.Random(seed)
    told: Counter[str] = Counter()
    for k in range(count):
        ending, data = whole[k % len(whole)]
        bad = spoilt(data, rng)
        path = folder / f"fuzzed{ending}"
        path.write_bytes(bad)
        try:
            with no_longer_than(SLOWEST), heard.listening():
                told.update(outcome(path))
            assert not heard.found, f"something was run, or a foreign file opened: {heard.found[:3]}"
        except BaseException as wrong:
            (folder / f"bad_{seed}_{k}{ending}").write_bytes(bad)
            wrong.add_note(f"file {k} of seed {seed}: {folder / f'bad_{seed}_{k}{ending}'}")
            raise
    return told


def outcome(path: Path) -> list[str]:
    """What reading and moving come to."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            shape = load(path, largest=1 << 20, most_triangles=10_000)
        except MeshError as wrong:
            assert str(wrong).count("\n") == 0 and len(str(wrong)) < 1000, wrong
            return ["refused"]
        assert is_finite(shape)
        return ["mended" if said else "read", carried_a_step(shape)]


def test_two_hundred_spoilt_files_are_refused_or_give_finite_shapes(tmp_path: Path) -> None:
    told = fuzz(tmp_path, 200, seed=0)
    assert min(told["refused"], told["read"] + told["mended"], told["moved"]) > 20, told


@pytest.mark.stress
def test_ten_thousand_spoilt_files_are_refused_or_give_finite_shapes(tmp_path: Path) -> None:
    told = fuzz(tmp_path, 10_000, seed=2)
    assert min(told["refused"], told["read"], told["mended"], told["moved"]) > 500, told
