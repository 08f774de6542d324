"""glTF 2.0 from anyone: every length and index is checked, and all but nodes and triangles left out, before trimesh reads it."""

from __future__ import annotations

import base64
import json
import math
import re
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from xpheve.errors import MeshError, SceneError

DEEPEST = 64
"""Nodes below one another."""
MOST_NODES = 100_000
MOST_BUFFERS = 1000
MOST_VALUES = 8_000_000
"""In the JSON part."""
MOST_PIECES = 10_000
"""Primitives that the file holds, and that its nodes show: each becomes a part of its own."""
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_HARMLESS = re.compile(r"KHR_(materials_\w+|texture_transform|lights_punctual|xmp_json_ld)")

Table = dict[str, Any]


def cleaned(data: bytes, suffix: str, path: Path, name: str, largest: int, most: int, said: list[str]) -> bytes:
    """Return a GLB file of the nodes and triangles in ``data``; raises `MeshError`."""
    text, binary = _chunks(data, name) if suffix == ".glb" else (data, b"")
    document = _document(text, name)
    _check_version(document, name)
    buffers = _buffers(document, binary, path, name, largest)
    views = _views(document, buffers, name)
    accessors = [_accessor(one, k, views, name) for k, one in enumerate(_list(document, "accessors", name))]
    meshes = [_mesh(one, k, accessors, name, said) for k, one in enumerate(_list(document, "meshes", name))]
    nodes = [_node(one, k, len(meshes), name, said) for k, one in enumerate(_list(document, "nodes", name))]
    roots = _roots(document, nodes, name)
    for node in nodes:
        if "mesh" in node and not meshes[node["mesh"]]["primitives"]:
            del node["mesh"]
    if not any("mesh" in node for node in nodes):
        raise MeshError(f"{name}: no node shows any triangles")
    _check_triangles(meshes, nodes, accessors, most, name)
    return _packed(_only_used(accessors, meshes), views, buffers, meshes, nodes, roots)


def _check_triangles(meshes: list[Table], nodes: list[Table], accessors: list[Table], most: int, name: str) -> None:
    primitives = [primitive for mesh in meshes for primitive in mesh["primitives"]]
    shown = sum(len(meshes[node["mesh"]]["primitives"]) for node in nodes if "mesh" in node)
    if max(len(primitives), shown) > MOST_PIECES:
        raise MeshError(
            f"{name}: {len(primitives)} pieces of geometry, shown {shown} times, are more than the {MOST_PIECES} that are read; "
            "join them"
        )
    count = sum(accessors[one.get("indices", one["attributes"]["POSITION"])]["count"] // 3 for one in primitives)
    places = sum(accessors[one["attributes"]["POSITION"]]["count"] for one in primitives)
    if max(count, places // 3) > most:
        raise MeshError(f"{name}: {count} triangles of {places} vertices; up to {most} are read: give most_triangles=")


def _only_used(accessors: list[Table], meshes: list[Table]) -> list[Table]:
    """The accessors that primitives use, numbered anew there."""
    place: dict[int, int] = {}
    for primitive in (primitive for mesh in meshes for primitive in mesh["primitives"]):
        attributes = primitive["attributes"]
        attributes["POSITION"] = place.setdefault(attributes["POSITION"], len(place))
        if "indices" in primitive:
            primitive["indices"] = place.setdefault(primitive["indices"], len(place))
    return [accessors[k] for k in place]


def _chunks(data: bytes, name: str) -> tuple[bytes, bytes]:
    if len(data) < 20 or data[:4] != b"glTF":
        raise MeshError(f"{name}: does not begin with 'glTF', so it is no GLB file")
    version, length, size, kind = struct.unpack_from("<II I4s", data, 4)
    if version != 2:
        raise MeshError(f"{name}: version {version} of glTF; 2 is read")
    if length != len(data):
        raise MeshError(f"{name}: the header claims {length} bytes, the file has {len(data)}: cut short, or no GLB")
    if kind != b"JSON" or 20 + size > len(data):
        raise MeshError(f"{name}: its first part claims {size} bytes of kind {kind!r}; JSON within the file is needed")
    text, rest = data[20 : 20 + size], data[20 + size :]
    if len(rest) < 8:
        return text, b""
    size, kind = struct.unpack_from("<I4s", rest)
    if size > len(rest) - 8:
        raise MeshError(f"{name}: its second part claims {size} bytes, {len(rest) - 8} follow")
    return text, rest[8 : 8 + size] if kind == b"BIN\0" else b""


def _document(text: bytes, name: str) -> Table:
    def refuse(word: str) -> Any:
        raise MeshError(f"{name}: {word} in its JSON: finite numbers are needed")

    values = text.count(b",")
    if values > MOST_VALUES:
        raise MeshError(f"{name}: its JSON has {values} values, more than the {MOST_VALUES} that are read")
    try:
        found = json.loads(text.decode("utf-8-sig"), parse_constant=refuse)
    except RecursionError:
        raise MeshError(f"{name}: its JSON is nested too deeply") from None
    except MeshError:
        raise
    except ValueError as wrong:
        raise MeshError(f"{name}: its JSON cannot be read: {str(wrong)[:120]}") from None
    if not isinstance(found, dict):
        raise MeshError(f"{name}: its JSON is no table")
    return found


def _check_version(document: Table, name: str) -> None:
    asset = document.get("asset")
    version = asset.get("version") if isinstance(asset, dict) else None
    if not isinstance(version, str) or not version.startswith("2."):
        raise MeshError(f"{name}: asset.version is {version!r}: 2.0 is read")
    required = document.get("extensionsRequired", [])
    for one in required if isinstance(required, list) else [required]:
        if not (isinstance(one, str) and _HARMLESS.fullmatch(one)):
            raise MeshError(f"{name}: needs the extension {str(one)[:60]!r}, which is not read; export it without")


def _buffers(document: Table, binary: bytes, path: Path, name: str, largest: int) -> list[bytes]:
    found: list[bytes] = []
    read = 0
    tables = _list(document, "buffers", name)
    if len(tables) > MOST_BUFFERS:
        raise MeshError(f"{name}: {len(tables)} buffers are more than the {MOST_BUFFERS} that are read; join them")
    for k, one in enumerate(tables):
        length = _count(one, "byteLength", f"{name}: buffers[{k}]")
        uri = one.get("uri")
        if uri is None:
            data = binary if k == 0 else b""
        else:
            data = _referred(uri, path, f"{name}: buffers[{k}]", largest)
        if length > len(data):
            raise MeshError(f"{name}: buffers[{k}] claims {length} bytes, there are {len(data)}")
        found.append(data[:length])
        read += len(data)  # all that was looked at, be it used or not
        if read > largest:
            raise MeshError(
                f"{name}: its buffers are larger than {largest} bytes, the most that is read; give largest="
            )
    return found


def _referred(uri: Any, path: Path, what: str, largest: int) -> bytes:
    """Bytes that a URI holds, or those of a file in the folder; nothing else is opened."""
    if not isinstance(uri, str):
        raise MeshError(f"{what}: uri = {str(uri)[:60]!r}: a text is needed")
    if uri.startswith("data:"):
        head, comma, body = uri.partition(",")
        if not comma or not head.endswith(";base64"):
            raise MeshError(f"{what}: its data: URI is not in base64")
        try:
            return base64.b64decode(body, validate=True)
        except ValueError:
            raise MeshError(f"{what}: its data: URI is no base64") from None
    from xpheve.meshes.files import read_within

    shown = uri[:80]
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", uri) or uri.startswith("//"):
        raise MeshError(
            f"{what}: uri {shown!r} leads out of the file's folder; nothing is fetched: put it beside the file"
        )
    from xpheve.scene.paths import inside

    try:
        target = inside(path.parent, unquote(uri))
    except SceneError as wrong:
        raise MeshError(f"{what}: uri {shown!r}: {str(wrong).split(';')[0]}; put it beside the file") from None
    return read_within(target, f"{what}: uri {shown!r}", largest)


def _views(document: Table, buffers: list[bytes], name: str) -> list[tuple[int, int, int, int]]:
    """Buffer, offset, length and stride (0 for none) of each buffer view."""
    found = []
    for k, one in enumerate(_list(document, "bufferViews", name)):
        what = f"{name}: bufferViews[{k}]"
        buffer = _index(one, "buffer", len(buffers), what)
        offset, length = _count(one, "byteOffset", what, 0), _count(one, "byteLength", what)
        stride = _count(one, "byteStride", what, 0)
        if offset + length > len(buffers[buffer]) or stride > 252:
            raise MeshError(f"{what}: bytes {offset} to {offset + length} of a buffer of {len(buffers[buffer])}")
        found.append((buffer, offset, length, stride))
    return found


def _accessor(one: Table, k: int, views: list[tuple[int, int, int, int]], name: str) -> Table:
    what = f"{name}: accessors[{k}]"
    kind, component = one.get("type"), one.get("componentType")
    if not isinstance(kind, str) or kind not in _WIDTHS or not isinstance(component, int) or component not in _SIZES:
        raise MeshError(f"{what}: type {str(kind)[:20]!r} of component {str(component)[:20]!r} is none of glTF's")
    clean: Table = {"type": kind, "componentType": component, "count": _count(one, "count", what)}
    if "sparse" in one or "bufferView" not in one:
        clean["unread"] = "sparse" if "sparse" in one else "empty"
        return clean
    view = _index(one, "bufferView", len(views), what)
    offset = _count(one, "byteOffset", what, 0)
    _, start, length, stride = views[view]
    size = _SIZES[component] * _WIDTHS[kind]
    if stride and stride < size:
        raise MeshError(f"{what}: a stride of {stride} bytes for elements of {size}")
    needed = offset + (stride or size) * (clean["count"] - 1) + size if clean["count"] else offset
    if needed > length or (start + offset) % _SIZES[component]:
        raise MeshError(f"{what}: {clean['count']} elements need {needed} bytes, aligned; its view has {length}")
    return clean | {"bufferView": view, "byteOffset": offset, "normalized": one.get("normalized") is True}


def _mesh(one: Table, k: int, accessors: list[Table], name: str, said: list[str]) -> Table:
    clean: list[Table] = []
    for j, primitive in enumerate(_list(one, "primitives", f"{name}: meshes[{k}]")):
        what = f"{name}: meshes[{k}].primitives[{j}]"
        mode = primitive.get("mode", 4)
        if mode not in (4, 5, 6):
            said.append(f"meshes[{k}]: points and lines left out") if mode in (0, 1, 2, 3) else _refuse(
                what, "mode", mode
            )
            continue
        if mode != 4:
            raise MeshError(f"{what}: strips and fans of triangles are not read; export it with plain triangles")
        if primitive.get("extensions"):
            raise MeshError(f"{what}: compressed geometry is not read; export it without")
        attributes = primitive.get("attributes")
        place = _index(attributes if isinstance(attributes, dict) else {}, "POSITION", len(accessors), what)
        _check_read(accessors[place], ("VEC3",), (5126,), f"{what}: POSITION")
        made: Table = {"mode": 4, "attributes": {"POSITION": place}}
        count = accessors[place]["count"]
        if "indices" in primitive:
            made["indices"] = _index(primitive, "indices", len(accessors), what)
            _check_read(accessors[made["indices"]], ("SCALAR",), (5121, 5123, 5125), f"{what}: indices")
            count = accessors[made["indices"]]["count"]
        if count % 3 or not count:
            raise MeshError(f"{what}: {count} corners are no triangles")
        clean.append(made)
        if primitive.get("targets"):
            said.append(f"meshes[{k}]: morph targets left out")
    return {"name": _name(one, f"mesh{k}"), "primitives": clean}


def _check_read(accessor: Table, kinds: tuple[str, ...], components: tuple[int, ...], what: str) -> None:
    if "unread" in accessor:
        raise MeshError(f"{what}: a {accessor['unread']} accessor is not read; export it with plain ones")
    if accessor["type"] not in kinds or accessor["componentType"] not in components:
        raise MeshError(
            f"{what}: {accessor['type']} of component {accessor['componentType']} is not what glTF wants there"
        )


def _node(one: Table, k: int, meshes: int, name: str, said: list[str]) -> Table:
    what = f"{name}: nodes[{k}]"
    clean: Table = {"name": _name(one, f"node{k}"), "children": one.get("children", [])}
    if "mesh" in one:
        clean["mesh"] = _index(one, "mesh", meshes, what)
    if "skin" in one:
        said.append(f"nodes[{k}]: skin left out, shown at rest")
    if "matrix" in one:
        clean["matrix"] = _numbers(one, "matrix", 16, what)
    else:
        for key, width in (("translation", 3), ("rotation", 4), ("scale", 3)):
            if key in one:
                clean[key] = _numbers(one, key, width, what)
        if not any(clean.get("rotation", [1.0])):
            raise MeshError(f"{what}: rotation is 0: a unit quaternion is needed")
        if "rotation" in clean:
            length = math.hypot(*clean["rotation"])
            clean["rotation"] = [component / length for component in clean["rotation"]]
    return clean


def _roots(document: Table, nodes: list[Table], name: str) -> list[int]:
    """Nodes that hang on none; each other hangs on one, and none on itself."""
    if len(nodes) > MOST_NODES:
        raise MeshError(f"{name}: {len(nodes)} nodes are more than the {MOST_NODES} that are read")
    parent = [-1] * len(nodes)
    for k, node in enumerate(nodes):
        children = node["children"]
        if not isinstance(children, list):
            raise MeshError(f"{name}: nodes[{k}].children: a list is needed")
        for child in children:
            if isinstance(child, bool) or not isinstance(child, int) or not 0 <= child < len(nodes):
                raise MeshError(f"{name}: nodes[{k}]: child {str(child)[:20]!r} does not exist")
            if parent[child] >= 0:
                raise MeshError(f"{name}: nodes[{child}] hangs on two nodes, {parent[child]} and {k}")
            parent[child] = k
        if not children:
            del node["children"]
    reached, waiting = 0, [(k, 1) for k in range(len(nodes)) if parent[k] < 0]
    roots = [k for k, _ in waiting]
    while waiting:
        k, depth = waiting.pop()
        reached += 1
        if depth > DEEPEST:
            raise MeshError(f"{name}: nodes[{k}] lies more than {DEEPEST} nodes deep")
        waiting.extend((child, depth + 1) for child in nodes[k].get("children", ()))
    if reached < len(nodes):
        raise MeshError(f"{name}: {len(nodes) - reached} of its nodes hang on one another in a ring")
    scenes = _list(document, "scenes", name)
    if not scenes:
        return roots
    chosen = scenes[_index(document, "scene", len(scenes), name) if "scene" in document else 0].get("nodes", [])
    known = set(roots)
    if not isinstance(chosen, list) or any(type(k) is not int or k not in known for k in chosen):
        raise MeshError(f"{name}: its scene shows nodes that do not exist, or hang on others")
    return list(dict.fromkeys(chosen))


def _packed(
    accessors: list[Table],
    views: list[tuple[int, int, int, int]],
    buffers: list[bytes],
    meshes: list[Table],
    nodes: list[Table],
    roots: list[int],
) -> bytes:
    """A GLB file of one buffer."""
    starts, joined = [], bytearray()
    for data in buffers:
        starts.append(len(joined))
        joined += data + bytes(-len(data) % 4)
    body = bytes(joined)
    view_tables = []
    for buffer, offset, length, stride in views:
        table: Table = {"buffer": 0, "byteOffset": starts[buffer] + offset, "byteLength": length}
        view_tables.append(table | {"byteStride": stride} if stride else table)
    names: set[str] = set()
    for k, node in enumerate(nodes):
        while node["name"] in names or node["name"] == "world":
            node["name"] = f"{node['name']}_{k}"
        names.add(node["name"])
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": view_tables,
        "buffers": [{"byteLength": len(body)}],
    }
    return pack_glb(document, body)


def pack_glb(document: Table, body: bytes) -> bytes:
    """A GLB file of a document and its one buffer, parts padded to four bytes."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    body += bytes(-len(body) % 4)
    length = 12 + 8 + len(text) + 8 + len(body)
    head = struct.pack("<4sII", b"glTF", 2, length)
    return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body


# Values


def _list(table: Table, key: str, what: str) -> list[Table]:
    found = table.get(key, [])
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        raise MeshError(f"{what}: {key}: a list of tables is needed")
    return found


def _count(table: Table, key: str, what: str, usual: int | None = None) -> int:
    found = table.get(key, usual)
    if isinstance(found, bool) or not isinstance(found, int) or not 0 <= found < 1 << 40:
        raise MeshError(f"{what}: {key} = {str(found)[:40]!r}: a whole number from 0 up is needed")
    return found


def _index(table: Table, key: str, count: int, what: str) -> int:
    found = table.get(key)
    if isinstance(found, bool) or not isinstance(found, int) or not 0 <= found < count:
        raise MeshError(f"{what}: {key} = {str(found)[:40]!r}: there are {count}, counted from 0")
    return found


def _numbers(table: Table, key: str, width: int, what: str) -> list[float]:
    found = table.get(key)
    if (
        not isinstance(found, list)
        or len(found) != width
        or any(isinstance(one, bool) or not isinstance(one, (int, float)) or not abs(one) < 1e30 for one in found)
    ):
        raise MeshError(f"{what}: {key}: {width} finite numbers are needed")
    return [float(one) for one in found]


def _name(table: Table, usual: str) -> str:
    found = table.get("name")
    return found[:200] if isinstance(found, str) and found else usual


def _refuse(what: str, key: str, value: Any) -> None:
    raise MeshError(f"{what}: {key} = {str(value)[:40]!r} is none of glTF's")
