"""Mesh files in: sound ones of every format, mended ones, and those that are refused."""

from __future__ import annotations

import base64
import json
import socket
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh

import xpheve as xp
from xpheve import meshes
from xpheve.errors import MeshError, MeshWarning

BOX = trimesh.creation.box((1.0, 2.0, 3.0))


def gltf_text(**changes: object) -> str:
    """The JSON of a triangle in a data: URI, with some of its tables replaced."""
    body = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], dtype="<f4").tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(body).decode()
    document: dict[str, object] = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0, "name": "one"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": uri}],
    }
    return json.dumps(document | changes)


def save(folder: Path, name: str, data: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


@pytest.mark.parametrize("name", ["box.glb", "box.obj", "box.stl", "box.ply"])
def test_a_box_of_every_format_is_a_box(tmp_path: Path, name: str) -> None:
    path = save(tmp_path, name, BOX.export(file_type=name[-3:]))
    shape = meshes.load(path)
    assert isinstance(shape, xp.Mesh) and len(shape.vertices) == 8 and len(shape.faces) == 12
    assert shape.volume == pytest.approx(6.0) and shape.inertia(6.0) == pytest.approx((6.5, 5.0, 2.5))
    assert meshes.load(path, scale=0.01).volume == pytest.approx(6e-6)


def test_text_forms_and_gltf_with_a_buffer_beside_it(tmp_path: Path) -> None:
    files = {
        "a.stl": trimesh.exchange.stl.export_stl_ascii(BOX).encode(),
        "a.ply": trimesh.exchange.ply.export_ply(BOX, encoding="ascii"),
        "quads.obj": b"".join(b"v %d %d %d\n" % (k & 1, k >> 1 & 1, k >> 2) for k in range(8))
        + b"f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf -6 -2 -1 -5\nf 1/1/1 5/5/5 7/7 3\nf 2//2 4 8 6\nusemtl none\n",
    }
    files |= {
        ("g.gltf" if k == "model.gltf" else k): v for k, v in trimesh.exchange.gltf.export_gltf(BOX.scene()).items()
    }
    for name, data in files.items():
        save(tmp_path, name, data)
    for name, volume in (("a.stl", 6), ("a.ply", 6), ("quads.obj", 1), ("g.gltf", 6)):
        assert meshes.load(tmp_path / name).volume == pytest.approx(volume), name


def test_nodes_keep_their_places_and_their_scale_goes_into_the_geometry(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(0.5, (1, 2, 0), (1, 0, 0))
    scene.add_geometry(BOX, node_name="upper", geom_name="box", transform=turn @ np.diag([2, 2, 2, 1.0]))
    scene.add_geometry(
        BOX,
        node_name="lower",
        geom_name="box",
        parent_node_name="upper",
        transform=np.diag([1, -1, 1, 1.0]) + np.eye(4, k=3) * 9,
    )
    path = save(tmp_path, "two.glb", scene.export(file_type="glb"))
    whole = meshes.load(path)
    assert isinstance(whole, xp.Compound) and whole.volume == pytest.approx(96.0)
    points = meshes.points_of(whole)
    for corner in scene.to_mesh().vertices:
        assert np.linalg.norm(points - corner, axis=1).min() < 1e-5
    (obj,) = meshes.load_objects(path, density=2.0)
    assert obj.name == "upper" and obj.mass == pytest.approx(192.0)
    assert np.allclose(obj.pose, turn, atol=1e-6)


def test_every_mending_is_said() -> None:
    v, f = np.array(BOX.vertices), np.array(BOX.faces)
    cases = {
        "1 triangle without area left out": (v, [*f, (0, 0, 1)]),
        "2 triangles without area": (np.concatenate([v, 2 * v[1:2] - v[:1]]), [*f, (0, 1, 8), (1, 1, 1)]),
        "1 triangle that came twice": (v, [*f, f[3]]),
        "1 triangle of vertices that do not exist": (v, [*f, (0, 1, 99)]),
        "wound inwards: all triangles turned": (v, f[:, ::-1]),
        "3 triangles turned to wind as the neighbours do": (v, [*(t[::-1] for t in f[:3]), *f[3:]]),
    }
    for said, (vertices, faces) in cases.items():
        found = meshes.repaired(vertices, faces)
        assert len(found.repairs) == 1 and said in found.repairs[0], found.repairs
        assert xp.Mesh(found.vertices, found.faces).volume == pytest.approx(6.0)
    soup = meshes.repaired(v[f].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert soup.repairs == () and soup.tidied == ("28 vertices joined with others at the same place",)
    assert meshes.repaired(v, f[1:]).repairs == () and not xp.Mesh(v, f[1:]).solid  # holes stay holes


def test_a_hollow_solid_keeps_its_hole() -> None:
    inner = trimesh.creation.box((0.5, 0.5, 0.5))
    v = np.concatenate([BOX.vertices, inner.vertices])
    f = np.concatenate([BOX.faces, inner.faces[:, ::-1] + 8])
    found = meshes.repaired(v, f)
    assert found.repairs == () and xp.Mesh(found.vertices, found.faces).volume == pytest.approx(6 - 0.125)


def test_a_mended_file_gives_a_warning_that_lists_what_was_done(tmp_path: Path) -> None:
    inverted = trimesh.Trimesh(BOX.vertices, BOX.faces[:, ::-1], process=False)
    path = save(tmp_path, "in.ply", inverted.export(file_type="ply"))
    with pytest.warns(MeshWarning, match=r"in.ply.*wound inwards") as told:
        assert meshes.load(path).volume == pytest.approx(6.0)
    assert told[0].message.repairs == ("wound inwards: all triangles turned round",)
    with pytest.warns(MeshWarning, match="7 bytes after the last triangle left out"):
        meshes.load(save(tmp_path, "tail.stl", BOX.export(file_type="stl") + b"garbage"))


def test_a_file_with_holes_is_scenery_or_takes_its_hull(tmp_path: Path) -> None:
    path = save(
        tmp_path, "open.obj", trimesh.Trimesh(BOX.vertices, BOX.faces[1:], process=False).export(file_type="obj")
    )
    assert not meshes.load(path).solid
    assert meshes.load(path, solid="hull").volume == pytest.approx(6.0)
    with pytest.raises(MeshError, match=r"node .*not closed.*solid='hull'"):
        meshes.load_objects(path)
    assert meshes.load_objects(path, fixed=True)[0].fixed


STL = struct.pack("<80xI", 0xFFFFFFFF) + bytes(50)
PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
PLY += "property list uchar int vertex_indices\nend_header\n"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
REFUSED: dict[str, tuple[str, bytes | str, str]] = {
    "empty": ("a.glb", b"", "is empty"),
    "wrong ending": ("a.fbx", b"x", "mesh files end in .glb"),
    "no ending": ("a", b"x", "in nothing"),
    "glb that is none": ("a.glb", b"PK" + bytes(100), "does not begin with 'glTF'"),
    "glb too short": ("a.glb", struct.pack("<4sII", b"glTF", 2, 4_000_000_000) + bytes(100), "claims 4000000000 bytes"),
    "glb of version 1": ("a.glb", struct.pack("<4sII", b"glTF", 1, 112) + bytes(100), "version 1"),
    "json too long": (
        "a.glb",
        struct.pack("<4sIII4s", b"glTF", 2, 120, 1 << 31, b"JSON") + bytes(100),
        "first part claims",
    ),
    "stl of 4e9 triangles": ("a.stl", STL, "claims 4294967295 triangles, 214748364834 bytes; the file has 134"),
    "stl of none": ("a.stl", bytes(84), "has no triangles"),
    "stl of a few bytes": ("a.stl", b"solid", "no STL file"),
    "stl text cut": ("a.stl", b"solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\n", "2 vertices make no triangles"),
    "stl NaN": (
        "a.stl",
        struct.pack("<80xI12f2x", 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, float("nan"), 0, 0),
        "finite coordinates",
    ),
    "ply of 1e12 vertices": ("a.ply", PLY.replace("vertex 3", "vertex 1000000000000"), "claims at least"),
    "ply without faces": ("a.ply", PLY.split("element face")[0] + "end_header\n0 0 0 0 0 0 0 0 0", "only points"),
    "ply without end": ("a.ply", PLY.replace("end_header", "comment"), "does not end"),
    "ply of odd words": ("a.ply", PLY.replace("property float x", "import os"), "no line of a PLY header"),
    "ply of odd numbers": ("a.ply", PLY.replace("float x", "quad x"), "none of PLY's"),
    "obj without triangles": ("a.obj", TRIANGLE, "has no triangles"),
    "obj of no vertex": ("a.obj", TRIANGLE + "f 1 2 4\n", ":4: 'f 1 2 4': vertex 4 does not exist"),
    "obj of no number": ("a.obj", "v 0 zero 0\n", ":1: 'v 0 zero 0'"),
    "obj of infinity": ("a.obj", TRIANGLE.replace("1 0 0", "inf 0 0") + "f 1 2 3\n", "finite coordinates"),
    "obj flat": ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no triangle is left; 1 triangle without area"),
    "gltf of no json": ("a.gltf", "[" * 100_000, "nested too deeply"),
    "gltf NaN": ("a.gltf", gltf_text().replace('"3"', "3").replace(": 3,", ": NaN,"), "NaN in its JSON"),
    "ring of nodes": ("a.gltf", gltf_text(nodes=[{"mesh": 0, "children": [1]}, {"children": [0]}]), "in a ring"),
    "two parents": (
        "a.gltf",
        gltf_text(nodes=[{"children": [2]}, {"children": [2]}, {"mesh": 0}]),
        "hangs on two nodes",
    ),
    "deep nodes": (
        "a.gltf",
        gltf_text(nodes=[*({"children": [k + 1]} for k in range(99)), {"mesh": 0}]),
        "more than 64 nodes deep",
    ),
    "remote": (
        "a.gltf",
        gltf_text(buffers=[{"byteLength": 36, "uri": "http://example.org/a.bin"}]),
        "nothing is fetched",
    ),
    "file uri": ("a.gltf", gltf_text(buffers=[{"byteLength": 36, "uri": "file:///etc/passwd"}]), "nothing is fetched"),
    "share": ("a.gltf", gltf_text(buffers=[{"byteLength": 36, "uri": "//host/a.bin"}]), "nothing is fetched"),
    "outside": ("a.gltf", gltf_text(buffers=[{"byteLength": 36, "uri": "../a.bin"}]), "by ..; put it beside"),
    "outside hidden": (
        "a.gltf",
        gltf_text(buffers=[{"byteLength": 36, "uri": "x/%2e%2e/%2e%2e/a.bin"}]),
        "by ..; put it beside",
    ),
    "absolute": ("a.gltf", gltf_text(buffers=[{"byteLength": 36, "uri": "/etc/passwd"}]), "leads out of the folder"),
    "missing buffer": ("a.gltf", gltf_text(buffers=[{"byteLength": 36, "uri": "b.bin"}]), "no such file"),
    "huge buffer": (
        "a.gltf",
        gltf_text(buffers=[{"byteLength": 1 << 39, "uri": "data:x;base64,AAAA"}]),
        "claims 549755813888",
    ),
    "huge accessor": (
        "a.gltf",
        gltf_text(accessors=[{"bufferView": 0, "componentType": 5126, "count": 1 << 30, "type": "VEC3"}]),
        "need 12884901888 bytes",
    ),
    "empty accessor": (
        "a.gltf",
        gltf_text(accessors=[{"componentType": 5126, "count": 1 << 39, "type": "VEC3"}]),
        "empty accessor",
    ),
    "negative offset": (
        "a.gltf",
        gltf_text(bufferViews=[{"buffer": 0, "byteOffset": -4, "byteLength": 36}]),
        "byteOffset = '-4'",
    ),
    "draco": ("a.gltf", gltf_text(extensionsRequired=["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
    "no mesh": ("a.gltf", gltf_text(nodes=[{}]), "no node shows any triangles"),
    "flattened": ("a.gltf", gltf_text(nodes=[{"mesh": 0, "scale": [0, 1, 1]}]), "flattens|no triangle|no area"),
}


@pytest.mark.parametrize(("name", "data", "said"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_read_is_refused_with_one_clear_error(
    tmp_path: Path, name: str, data: bytes | str, said: str
) -> None:
    path = save(tmp_path, name, data)
    with pytest.raises(MeshError, match=said) as told:
        meshes.load(path)
    assert name in str(told.value) or "geometry" in str(told.value)


def test_limits_are_parameters(tmp_path: Path) -> None:
    path = save(tmp_path, "box.stl", BOX.export(file_type="stl"))
    with pytest.raises(MeshError, match=r"larger than 100 bytes.*largest="):
        meshes.load(path, largest=100)
    with pytest.raises(MeshError, match=r"12 triangles.*11.*most_triangles="):
        meshes.load(path, most_triangles=11)
    with pytest.raises(MeshError, match="no such file"):
        meshes.load(tmp_path / "none.glb")
    (tmp_path / "folder.glb").mkdir()
    with pytest.raises(MeshError, match="no such file"):
        meshes.load(tmp_path / "folder.glb")


def test_one_buffer_shown_a_thousand_times_is_no_bomb(tmp_path: Path) -> None:
    primitives = [{"attributes": {"POSITION": 0}}] * 1000
    path = save(tmp_path, "a.gltf", gltf_text(meshes=[{"primitives": primitives}]))
    with pytest.raises(MeshError, match="1000 triangles"):
        meshes.load(path, most_triangles=999)


def test_nothing_is_opened_outside_and_nothing_fetched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*given: object, **named: object) -> None:
        raise AssertionError("a socket was opened")

    monkeypatch.setattr(socket, "socket", refuse)
    (tmp_path / "in").mkdir()
    save(tmp_path, "secret.bin", bytes(36))
    (tmp_path / "in" / "link.bin").symlink_to(tmp_path / "secret.bin")
    with pytest.raises(MeshError, match="symbolic link"):
        meshes.load(save(tmp_path / "in", "a.gltf", gltf_text(buffers=[{"byteLength": 36, "uri": "link.bin"}])))
    text = gltf_text(images=[{"uri": "http://example.org/x.png"}], materials=[{}], textures=[{"source": 0}])
    assert not meshes.load(save(tmp_path / "in", "b.gltf", text)).solid
    obj = TRIANGLE + "mtllib ../../secret.mtl\nusemtl http://example.org\nf 1 2 3\n"
    assert not meshes.load(save(tmp_path / "in", "c.obj", obj)).solid


def test_scene_files_name_mesh_files_below_their_folder(tmp_path: Path) -> None:
    save(tmp_path, "rock.ply", BOX.export(file_type="ply"))
    lines = ["xpheve = 1", "[[objects]]", 'name = "a"']
    (tmp_path / "s.toml").write_text(
        "\n".join([*lines, 'shape = { kind = "mesh", file = "rock.ply", scale = 2 }', "density = 2"])
    )
    from xpheve import scene

    engine = scene.load(tmp_path / "s.toml")
    assert engine.object("a").mass == pytest.approx(96.0)
    again = scene.loads(scene.dumps(engine))  # written out, so that the file is no longer needed
    assert again.object("a").shape == engine.object("a").shape
    (tmp_path / "h.toml").write_text("\n".join([*lines, 'shape = { kind = "hull", file = "rock.ply" }']))
    assert scene.load(tmp_path / "h.toml").object("a").shape.volume == pytest.approx(6.0)
    for shape, said in (
        ('{ kind = "mesh", file = "../rock.ply" }', "leads out of the folder"),
        ('{ kind = "mesh", file = "none.ply" }', "no such file"),
        ('{ kind = "mesh", file = "rock.ply", faces = [[0, 1, 2]] }', "give one or the other"),
        ('{ kind = "mesh" }', "key vertices is missing"),
        ('{ kind = "mesh", vertices = [[0, 0]], faces = [[0, 1, 2]] }', "row 1"),
    ):
        with pytest.raises(xp.errors.SceneError, match=said):
            scene.loads("\n".join([*lines, f"shape = {shape}"]), folder=tmp_path)


def test_importing_and_running_without_meshes_loads_neither_trimesh_nor_scipy() -> None:
    import subprocess
    import sys

    code = "import sys, xpheve as xp; xp.PhysicalObject(xp.Compound([xp.Sphere(1)])); xp.meshes; "
    code += "print([name for name in ('trimesh', 'scipy', 'networkx') if name in sys.modules])"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


def test_no_warning_of_trimesh_or_numpy_leaks(tmp_path: Path) -> None:
    path = save(tmp_path, "big.stl", struct.pack("<80xI12f2x", 1, 0, 0, 0, 0, 0, 0, 3e38, 0, 0, 0, 3e38, 0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(MeshError, match="finite coordinates"):
            meshes.load(path)
