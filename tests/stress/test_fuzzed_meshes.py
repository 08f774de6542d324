"""Mesh files from strangers: small sound files of every format, spoilt at random; an error or a finite shape, and no hang."""

from __future__ import annotations

import random
import struct
import warnings
from collections import Counter
from pathlib import Path
from time import process_time

import numpy as np
import pytest
import trimesh

from xpheve.errors import MeshError
from xpheve.meshes import load
from xpheve.shapes import Compound, Shape

SLOWEST = 10.0
"""[s] of one file of a few hundred bytes; the usual is milliseconds."""


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


def fuzz(folder: Path, count: int, seed: int) -> Counter[str]:
    """Read ``count`` spoilt files; how many were refused, mended, and read without a word."""
    whole = samples(folder)
    rng = random.Random(seed)
    told: Counter[str] = Counter()
    for k in range(count):
        ending, data = whole[k % len(whole)]
        bad = spoilt(data, rng)
        path = folder / f"fuzzed{ending}"
        path.write_bytes(bad)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            start = process_time()
            try:
                shape = load(path, largest=1 << 20, most_triangles=10_000)
            except MeshError as wrong:
                assert str(wrong).count("\n") == 0 and len(str(wrong)) < 1000, (k, wrong)
                told["refused"] += 1
                continue
            except BaseException:
                (folder / f"bad_{seed}_{k}{ending}").write_bytes(bad)
                raise
        assert process_time() - start < SLOWEST, k
        assert is_finite(shape), k
        told["mended" if said else "read"] += 1
    return told


def test_two_hundred_spoilt_files_are_refused_or_give_finite_shapes(tmp_path: Path) -> None:
    told = fuzz(tmp_path, 200, seed=0)
    assert min(told["refused"], told["read"] + told["mended"]) > 20, told


@pytest.mark.stress
def test_ten_thousand_spoilt_files_are_refused_or_give_finite_shapes(tmp_path: Path) -> None:
    told = fuzz(tmp_path, 10_000, seed=2)
    assert min(told["refused"], told["read"], told["mended"]) > 500, told
