"""Records as animated GLB: read again with trimesh, and channel by channel."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import xpheve as xp
from xpheve.cli.commands import commands
from xpheve.errors import RecordError
from xpheve.record import Record, Recorder
from xpheve.shapes import from_description

WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


def scene(up: str = "z") -> Record:
    engine = xp.PhysicsEngine(up=up)
    rock = xp.Hull(np.random.default_rng(0).normal(size=(20, 3)))
    car = xp.Compound(
        [(xp.Box((2, 1, 0.5)), (0, 0, 0.5)), (xp.Sphere(0.3), (1, 0, 0)), (xp.Capsule(0.2, 1), (-1, 0, 0))]
    )
    engine.add_object(xp.PhysicalObject(xp.Plane(), fixed=True, name="floor"))
    engine.add_object(xp.PhysicalObject(rock, name="rock", velocity=(1, 2, 3), angular_velocity=(4, 5, 6)))
    engine.add_object(xp.PhysicalObject(car, name="car", position=(0, 5, 0), angular_velocity=(0, 0, 20)))
    engine.add_object(xp.PhysicalObject(name="point", velocity=(0, 0, 1)))
    engine.add_object(xp.PhysicalObject(xp.Mesh(rock.vertices, rock.faces), name="rock'", position=(9, 0, 0)))
    return engine.run(until=1.0, every=1 / 20)


def read(path: Path) -> tuple[dict[str, Any], bytes]:
    data = path.read_bytes()
    magic, version, length, size, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON") and not size % 4
    body, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert kind == b"BIN\0" and not body % 4 and 28 + size + body == len(data)
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def values(document: dict[str, Any], body: bytes, number: int) -> np.ndarray:
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
    width = WIDTHS[accessor["type"]]
    assert view["byteOffset"] % 4 == 0 and view["byteLength"] == 4 * width * accessor["count"]
    assert view["byteOffset"] + view["byteLength"] <= document["buffers"][0]["byteLength"] <= len(body)
    found = np.frombuffer(body, kind, width * accessor["count"], view["byteOffset"]).reshape(-1, width)
    if "min" in accessor:
        assert accessor["min"] == found.min(axis=0).tolist() and accessor["max"] == found.max(axis=0).tolist()
    return found


@pytest.fixture(scope="module")
def record() -> Record:
    return scene()


def test_channels_hold_the_poses_of_the_record(record: Record, tmp_path: Path) -> None:
    document, body = read(record.export_glb(tmp_path / "a.glb"))
    (animation,) = document["animations"]
    met = set()
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        assert sampler["interpolation"] == "LINEAR"
        time, found = values(document, body, sampler["input"]), values(document, body, sampler["output"])
        assert "min" in document["accessors"][sampler["input"]] and (np.diff(time[:, 0]) > 0).all() and time[0, 0] == 0
        track = record[document["nodes"][channel["target"]["node"]]["name"]]
        assert np.array_equal(time[:, 0], track.time.astype(np.float32))
        if channel["target"]["path"] == "translation":
            assert np.array_equal(found, track.position.astype(np.float32))
        else:
            assert np.allclose(np.linalg.norm(found.astype(float), axis=1), 1, atol=1e-7)
            assert ((found[1:] * found[:-1]).sum(axis=1) >= 0).all(), "the short way"
            assert np.allclose(np.abs((np.roll(found, 1, axis=1) * track.orientation).sum(axis=1)), 1, atol=1e-6)
        met.add((track.name, channel["target"]["path"]))
    assert met == {("rock", "translation"), ("rock", "rotation"), ("car", "rotation"), ("point", "translation")}


def test_the_file_keeps_to_the_rules_of_gltf(record: Record, tmp_path: Path) -> None:
    document, body = read(record.export_glb(tmp_path / "a.glb"))
    assert document["asset"]["version"] == "2.0" and len(document["buffers"]) == 1
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            places = values(document, body, primitive["attributes"]["POSITION"])
            faces = values(document, body, primitive["indices"])
            assert {"min", "max"} <= document["accessors"][primitive["attributes"]["POSITION"]].keys()
            assert faces.max() < len(places) and len(faces) % 3 == 0 and np.isfinite(places).all()
            targets = [document["bufferViews"][document["accessors"][k]["bufferView"]]["target"] for k in (0, 1)]
            assert targets == [34962, 34963]
    names = [node["name"] for node in document["nodes"]]
    assert len(set(names)) == len(names)
    children = [child for node in document["nodes"] for child in node.get("children", [])]
    assert sorted(children) == list(range(1, len(names)))
    for node in document["nodes"]:
        if "rotation" in node:
            assert np.linalg.norm(node["rotation"]) == pytest.approx(1, abs=1e-6)
    targets = [(c["target"]["node"], c["target"]["path"]) for c in document["animations"][0]["channels"]]
    assert len(set(targets)) == len(targets) and all("matrix" not in node for node in document["nodes"])


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_trimesh_reads_nodes_and_geometry_with_y_up(up: str, tmp_path: Path) -> None:
    record = scene(up)
    found = trimesh.load_scene(record.export_glb(tmp_path / "a.glb"))
    frame = record.frame(0)
    axis = np.eye(3)["xyz".index(up)]
    turn = np.array(found.graph.get("scene")[0])[:3, :3]
    assert np.allclose(turn @ axis, (0, 1, 0), atol=1e-6) and np.linalg.det(turn) == pytest.approx(1)
    for row, place, q in zip(record.objects, frame.position, frame.orientation, strict=True):
        matrix = np.array(found.graph.get(row["name"])[0])
        assert np.allclose(matrix[:3, 3], turn @ place, atol=1e-6)
        assert np.allclose(matrix[:3, :3], turn @ xp.orientation.to_matrix(q), atol=1e-6)
    rock = next(row for row in record.objects if row["name"] == "rock")
    mesh = found.geometry[found.graph["rock"][1]]
    assert mesh.is_watertight and mesh.volume == pytest.approx(from_description(rock["shape"]).volume, rel=1e-5)


def test_objects_that_come_and_go_are_shrunk_while_they_are_not_there(tmp_path: Path) -> None:
    engine = xp.PhysicsEngine()
    gone = engine.add_object(xp.PhysicalObject(xp.Sphere(1), name="gone", velocity=(1, 0, 0)))
    engine.add_object(xp.PhysicalObject(xp.Sphere(1), name="stays"))
    recorder = Recorder(engine)
    for k in range(4):
        engine.run(until=0.5 * k)
        if k == 2:
            engine.remove_object(gone)
        recorder.sample()
    document, body = read(recorder.close().export_glb(tmp_path / "a.glb"))
    animation = document["animations"][0]
    scales = [c for c in animation["channels"] if c["target"]["path"] == "scale"]
    assert [document["nodes"][c["target"]["node"]]["name"] for c in scales] == ["gone"]
    sampler = animation["samplers"][scales[0]["sampler"]]
    assert sampler["interpolation"] == "STEP"
    assert values(document, body, sampler["input"])[:, 0].tolist() == [0, 0.5, 1, 1.5]
    assert values(document, body, sampler["output"])[:, 0] == pytest.approx([1, 1, 0, 0], abs=1e-8)


def test_a_record_in_a_file_gives_the_same_bytes_by_the_command(record: Record, tmp_path: Path) -> None:
    record.save(tmp_path / "r.arrow")
    record.export_glb(tmp_path / "a.glb")
    told = CliRunner().invoke(commands, ["export", str(tmp_path / "r.arrow"), str(tmp_path / "b.glb")])
    assert told.exit_code == 0, told.output
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


def test_other_endings_and_empty_records_are_refused(record: Record, tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"written as \.glb"):
        record.export_glb(tmp_path / "a.gltf")


def test_compounds_hulls_and_meshes_are_drawn(record: Record, tmp_path: Path) -> None:
    from PIL import Image

    path = record.animate(tmp_path / "a.gif", frames=2, size=(160, 120))
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    colourful = (pixels.max(axis=2) - pixels.min(axis=2)) > 60
    assert colourful.sum() > 200
    record.plot(tmp_path / "a.png")


def test_rays_meet_triangles_as_they_meet_the_true_shape() -> None:
    from xpheve.record.rays import box, surface
    from xpheve.shapes.triangles import triangles

    turn = xp.orientation.to_matrix(xp.orientation.from_euler((0.3, 0.5, 0.7)))
    grid = np.stack(np.meshgrid(np.linspace(-2, 2, 80), np.linspace(2, -2, 60)), axis=-1)
    start = (np.concatenate([grid, np.full((60, 80, 1), 5.0)], axis=2)) @ turn
    way = np.array([0, 0, -1.0]) @ turn
    one, there = box(np.array([1.0, 2.0, 3.0]))(start, way), surface(*triangles(xp.Box((1, 2, 3))))(start, way)
    seen = np.isfinite(one[0])
    assert (seen != np.isfinite(there[0])).sum() <= 4
    seen &= np.isfinite(there[0])
    assert seen.sum() > 500 and np.allclose(one[0][seen], there[0][seen], atol=1e-9)
    assert (np.abs(one[1][seen] - there[1][seen]).max(axis=1) > 1e-9).sum() < 10
