"""Records as animated glTF 2.0 in one GLB file, which standard viewers open.

A root node turns the scene's up to glTF's y; below it is a node for each object, with the triangles of its shape and channels of
translation and rotation, linear in between. glTF holds float32.
"""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from xpheve.errors import InvalidValueError, RecordError
from xpheve.meshes.gltf import pack_glb
from xpheve.record.frame import FloatArray
from xpheve.record.paths import aside, writable
from xpheve.record.picture import COLOURS, FIXED, is_plane, up_of
from xpheve.record.record import Record
from xpheve.shapes import from_description
from xpheve.shapes.triangles import triangles

_FLOAT, _UINT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_GONE = 1e-9  # scale of an object in frames without it; 0 would have no inverse

LARGEST = float(np.finfo(np.float32).max)

Table = dict[str, Any]


def export_glb(record: Record, path: str | os.PathLike[str]) -> Path:
    """Write ``record`` as an animated GLB file; see ``Record.export_glb``."""
    target = writable(path)
    if target.suffix.lower() != ".glb":
        raise RecordError(f"{target}: an animated glTF file is written as .glb")
    if not len(record):
        raise RecordError(f"{target}: the record has no frames to show")
    data = _Document(record).packed()
    with aside(target) as beside:
        beside.write_bytes(data)
    return target


class _Document:
    """A glTF document in the making, and its one buffer."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.body = bytearray()
        self.views: list[Table] = []
        self.accessors: list[Table] = []
        self.meshes: list[Table] = []
        self.materials: list[Table] = []
        self.samplers: list[Table] = []
        self.channels: list[Table] = []
        self.shapes: dict[str, tuple[int, int]] = {}
        self.known: dict[tuple[str, str], int] = {}
        self.times: dict[bytes, int] = {}
        self.up = up_of(record)
        self.extent = self._extent()
        root: Table = {"name": "scene", "children": []}
        turn = _to_y(self.up)
        if turn != [0.0, 0.0, 0.0, 1.0]:
            root["rotation"] = turn
        self.nodes: list[Table] = [root]
        names: set[str] = {"scene"}
        moving = 0
        for row in record.objects:
            self._object(row, FIXED if row["fixed"] else COLOURS[moving % len(COLOURS)], names)
            moving += not row["fixed"]
        if not root["children"]:
            del root["children"]

    def _extent(self) -> float:
        """Size [m] of the ground that is drawn for planes: all places, and a third more."""
        places = self.record._flat("position")
        places = places[np.isfinite(places).all(axis=1)]
        return 1.5 * max(float(np.ptp(places, axis=0).max()) if len(places) else 0.0, 1.0)

    def _object(self, row: Table, colour: str, names: set[str]) -> None:
        track = self.record[int(row["serial"])]
        whole = np.isfinite(track.position).all(axis=1) & np.isfinite(track.orientation).all(axis=1)
        if not whole.any():
            return
        time, places, turns = track.time[whole], track.position[whole], _continuous(track.orientation[whole])
        name = (row["name"] or f"#{row['serial']}").encode("utf-8", "replace").decode()
        while name in names:
            name += "'"
        names.add(name)
        _single(places, f"object {name!r}")
        node: Table = {"name": name, "translation": _numbers(places[0]), "rotation": _numbers(_xyzw(turns[:1])[0])}
        mesh = self._mesh(row, colour)
        if mesh is not None:
            node["mesh"] = mesh
        self.nodes[0]["children"].append(len(self.nodes))
        self.nodes.append(node)
        here = len(self.nodes) - 1
        if len(time) > 1 and (places != places[0]).any():
            self._channel(here, "translation", time, _single(places, f"object {name!r}"))
        if len(time) > 1 and (turns != turns[0]).any():
            self._channel(here, "rotation", time, _unit32(_xyzw(turns)))
        self._presence(here, node, track)

    def _presence(self, node: int, table: Table, track: Any) -> None:
        """Shrink an object to nothing while it is not in the scene."""
        there = np.zeros(len(self.record), dtype=bool)
        there[track.frame_numbers] = True
        if there.all():
            return
        size = np.where(there, 1.0, _GONE).astype(np.float32)
        table["scale"] = [float(size[0])] * 3
        self._channel(node, "scale", self.record.time, np.repeat(size[:, None], 3, axis=1), "STEP")

    def _channel(self, node: int, path: str, time: FloatArray, values: Any, how: str = "LINEAR") -> None:
        seconds = _single(time - self.record.time[0], "the times")
        keep = np.concatenate([[True], np.diff(seconds) > 0.0])  # several frames of one time: glTF has one
        seconds, values = seconds[keep], values[keep]
        key = seconds.tobytes()
        if key not in self.times:
            self.times[key] = self._accessor(seconds, "SCALAR", _FLOAT, bounds=True)
        output = self._accessor(values, f"VEC{values.shape[1]}", _FLOAT)
        self.samplers.append({"input": self.times[key], "output": output, "interpolation": how})
        self.channels.append({"sampler": len(self.samplers) - 1, "target": {"node": node, "path": path}})

    def _mesh(self, row: Table, colour: str) -> int | None:
        described = row["shape"]
        if not described:
            return None
        key = json.dumps(described, sort_keys=True)
        if key not in self.shapes:
            made = self._triangles(row)
            if made is None:
                return None
            vertices, faces = made
            corners = self._accessor(
                _single(vertices, f"shape {described.get('kind')!r}"), "VEC3", _FLOAT, _VERTICES, bounds=True
            )
            self.shapes[key] = corners, self._accessor(faces.astype(np.uint32).reshape(-1), "SCALAR", _UINT, _INDICES)
        corners, indices = self.shapes[key]
        primitive = {
            "attributes": {"POSITION": corners},
            "indices": indices,
            "material": self._material(colour),
            "mode": 4,
        }
        table = {"name": described.get("kind", "shape"), "primitives": [primitive]}
        found = self.known.setdefault((key, colour), len(self.meshes))
        if found == len(self.meshes):
            self.meshes.append(table)
        return found

    def _triangles(self, row: Table) -> tuple[FloatArray, Any] | None:
        if is_plane(row):
            return self._ground(row["shape"])
        try:
            return triangles(from_description(row["shape"]))
        except InvalidValueError:
            return None  # a pack's shape, of which a record knows parameters only

    def _ground(self, shape: Table) -> tuple[FloatArray, Any]:
        """A square of the plane, in the plane's own frame."""
        normal = np.asarray(self.up if shape.get("normal") is None else shape["normal"], dtype=np.float64)
        first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        first /= np.linalg.norm(first)
        second = np.cross(normal, first)
        middle = normal * float(shape.get("offset", 0.0))
        corners = [middle + self.extent * (i * first + j * second) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        return np.array(corners), np.array([(0, 1, 2), (0, 2, 3)])

    def _material(self, colour: str) -> int:
        rgb = [(int(colour[k : k + 2], 16) / 255.0) ** 2.2 for k in (1, 3, 5)]  # linear light
        table = {
            "name": colour,
            "pbrMetallicRoughness": {"baseColorFactor": [*rgb, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7},
            "doubleSided": True,
        }
        if table not in self.materials:
            self.materials.append(table)
        return self.materials.index(table)

    def _accessor(self, values: Any, kind: str, component: int, target: int = 0, bounds: bool = False) -> int:
        data = np.ascontiguousarray(values, dtype="<f4" if component == _FLOAT else "<u4")
        view: Table = {"buffer": 0, "byteOffset": len(self.body), "byteLength": data.nbytes}
        self.views.append(view | {"target": target} if target else view)
        self.body += data.tobytes()  # all components have four bytes, so that every view is aligned
        table: Table = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(data), "type": kind}
        if bounds:
            table["min"] = np.atleast_1d(data.min(axis=0)).astype(float).tolist()
            table["max"] = np.atleast_1d(data.max(axis=0)).astype(float).tolist()
        self.accessors.append(table)
        return len(self.accessors) - 1

    def packed(self) -> bytes:
        """The whole file."""
        from xpheve import __version__

        document: Table = {
            "asset": {"version": "2.0", "generator": f"xPheve {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.body)}] if self.body else [],
        }
        if self.channels:
            document["animations"] = [{"name": "motion", "channels": self.channels, "samplers": self.samplers}]
        return pack_glb({key: value for key, value in document.items() if value != []}, bytes(self.body))


def _continuous(turns: FloatArray) -> FloatArray:
    """The same orientations, each in the half of the sphere of the one before, so that viewers take the short way."""
    dots = (turns[1:] * turns[:-1]).sum(axis=1)
    signs = np.cumprod(np.concatenate([[1.0], np.where(dots < 0.0, -1.0, 1.0)]))
    return np.asarray(turns * signs[:, None])


def _xyzw(turns: FloatArray) -> FloatArray:
    return np.roll(turns, -1, axis=1)


def _unit32(turns: FloatArray) -> Any:
    single = turns.astype(np.float32)
    return (single / np.linalg.norm(single.astype(np.float64), axis=1)[:, None]).astype(np.float32)


def _single(values: FloatArray, what: str) -> Any:
    """``values`` in the precision of the file. Raises `RecordError`."""
    if values.size and not float(np.abs(values).max()) < LARGEST:
        raise RecordError(f"{what}: {float(np.abs(values).max()):g} is beyond what a glTF file holds, {LARGEST:.3g}")
    return values.astype(np.float32)


def _numbers(values: FloatArray) -> list[float]:
    return [float(np.float32(value)) for value in values]


def _to_y(up: FloatArray) -> list[float]:
    """Rotation (x, y, z, w) that takes ``up`` to y by the shortest way."""
    if up[1] < -1.0 + 1e-12:
        return [1.0, 0.0, 0.0, 0.0]
    x, y, z, w = float(-up[2]), 0.0, float(up[0]), 1.0 + float(up[1])
    length = math.hypot(x, y, z, w)
    return [x / length + 0.0, y, z / length + 0.0, w / length]
