"""Mesh files made to cost time or memory are refused before they do; exports beyond float32 too."""

from __future__ import annotations

import base64
import json
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import MeshError, RecordError
from xpheve.meshes import load
from xpheve.shapes import Compound

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4").tobytes()
FACES = np.array([0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2], "<u4").tobytes()


def document(**changed: Any) -> bytes:
    """A tetrahedron as glTF, with some of its tables exchanged."""
    body = base64.b64encode(CORNERS + FACES).decode()
    tables: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 96, "uri": f"data:application/octet-stream;base64,{body}"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    return json.dumps(tables | changed).encode()


PRIMITIVE = {"attributes": {"POSITION": 0}, "indices": 1}
BUFFER = json.loads(document())["buffers"][0]
PLY = b"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
FACE = b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"

HOSTILE = [
    (
        "a.gltf",
        document(nodes=[{"mesh": 0}] * 100_000, scenes=[{"nodes": list(range(100_000))}]),
        "10000 that are read",
    ),
    ("a.gltf", document(meshes=[{"primitives": [PRIMITIVE] * 20_000}]), "10000 that are read"),
    ("a.gltf", document(buffers=[BUFFER, *[{"byteLength": 0, "uri": "data:;base64,"}] * 20_000]), "20001 buffers"),
    ("a.gltf", document(buffers=[BUFFER, *[{"byteLength": 1, "uri": "side.bin"}] * 900]), "largest="),
    ("a.gltf", document(scenes=[{"nodes": [0.0]}]), "its scene"),
    ("a.gltf", document(scenes=[{"nodes": [[0]]}]), "its scene"),
    ("a.gltf", document(scenes=[{"nodes": [True]}]), "its scene"),
    ("a.gltf", b'{"asset": {"version": "2.0"}, "extras": [' + b"[]," * 9_000_000 + b"[]]}", "values"),
    ("a.obj", b"\n" * 2_000_000, "lines"),
    ("a.obj", b"v 0 0 0\n" * 400_000, "vertices"),
    ("a.stl", b"solid\nfacet\n" + b"VERTEX 0 0 0 " * 400_000, "vertices"),
    ("a.ply", PLY % 400_000 + FACE + b"0 0 0\n" * 400_000 + b"3 0 1 2\n", "vertices"),
    (
        "a.ply",
        PLY.replace(b"ascii", b"binary_little_endian") % 3
        + FACE.replace(b"uchar", b"int")
        + bytes(36)
        + struct.pack("<iiii", 10**9, 0, 1, 2),
        "PLY",
    ),
]


@pytest.mark.parametrize(("name", "data", "said"), HOSTILE, ids=[f"{k}-{one[0]}" for k, one in enumerate(HOSTILE)])
def test_files_made_to_cost_time_or_memory_are_refused_soon(tmp_path: Path, name: str, data: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(data)
    (tmp_path / "side.bin").write_bytes(bytes(1 << 20))
    began = time.process_time()
    with pytest.raises(MeshError, match=said):
        load(tmp_path / name, most_triangles=100_000)
    assert time.process_time() - began < 10.0


def test_what_is_within_the_limits_is_read_as_ever(tmp_path: Path) -> None:
    (tmp_path / "a.gltf").write_bytes(document(nodes=[{"mesh": 0}] * 50, scenes=[{"nodes": list(range(50))}]))
    shape = load(tmp_path / "a.gltf")
    assert isinstance(shape, Compound) and len(shape.parts) == 50
    (tmp_path / "a.obj").write_bytes(
        b"v 0 0 0\r\nv 1 0 0\nv 0 1 \\\n0\nv 0 0 1\nf -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -4 -1 -2\n"
    )
    assert load(tmp_path / "a.obj").volume == pytest.approx(1 / 6, rel=1e-15)


@pytest.mark.parametrize(("place", "radius"), [(1e39, 1.0), (-1e200, 1.0), (0.0, 1e39)])
def test_an_export_beyond_single_precision_is_refused(tmp_path: Path, place: float, radius: float) -> None:
    engine = xp.PhysicsEngine()
    ball = xp.PhysicalObject(xp.Sphere(radius), position=(place, 0, 0), mass=1.0, inertia=1.0, name="ball")
    engine.add_object(ball)
    record = engine.run(until=0.1, every=0.1)
    with pytest.raises(RecordError, match="beyond what a glTF file holds"):
        record.export_glb(tmp_path / "a.glb")
    assert not list(tmp_path.iterdir())


def test_names_that_no_text_file_can_hold_are_exported_as_question_marks(tmp_path: Path) -> None:
    engine = xp.PhysicsEngine()
    for name in ("\ud800", "?", "scene"):
        engine.add_object(xp.PhysicalObject(xp.Sphere(0.1), name=name))
    engine.run(until=0.1, every=0.1).export_glb(tmp_path / "a.glb")
    data = (tmp_path / "a.glb").read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    nodes = json.loads(data[20 : 20 + size].decode("utf-8"))["nodes"]
    assert [node["name"] for node in nodes] == ["scene", "?", "?'", "scene'"]
