"""Mesh files from anyone: read whole within limits, checked, and only then given to trimesh. Nothing is fetched or executed."""

from __future__ import annotations

import io
import os
import re
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from xpheve.errors import MeshError, MeshWarning
from xpheve.meshes import gltf
from xpheve.meshes.nodes import below, scene_objects, shape_of
from xpheve.objects import PhysicalObject
from xpheve.shapes import Shape
from xpheve.shapes.base import positive

LARGEST = 256 << 20
"""[bytes] of a file and of all that it refers to."""
MOST_TRIANGLES = 2_000_000
LONGEST_HEADER = 1 << 16  # [bytes] of a PLY file

FORMATS = (".glb", ".gltf", ".obj", ".stl", ".ply")
_PLY_SIZES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "float", "int32", "uint32", "float32"), 4),
    **dict.fromkeys(("double", "float64", "int64", "uint64"), 8),
}


def load(
    path: str | os.PathLike[str],
    *,
    solid: str = "",
    scale: float = 1.0,
    largest: int = LARGEST,
    most_triangles: int = MOST_TRIANGLES,
) -> Shape:
    """All triangles of a mesh file as one shape, in the file's frame: a mesh, or a compound of one for each node.

    Parameters
    ----------
    path
        GLB, glTF, OBJ, STL or PLY, by its ending. Materials, textures, skins and animations are left out.
    solid
        As of `xpheve.Mesh`: ``"hull"`` takes mass properties of meshes with holes from their convex hulls.
    scale
        Metres for a unit of the file; glTF is in metres, others as their authors liked.
    largest, most_triangles
        What is refused: bytes of the file with its buffers, triangles.

    Raises
    ------
    MeshError
        If the file cannot be read, lies about itself, refers to anything outside its folder, or has no sound triangles.

    Warns
    -----
    MeshWarning
        If something was mended, and what; see `xpheve.meshes.repaired`.
    """
    scene = load_scene(path, largest=largest, most_triangles=most_triangles)
    pieces = list(below(scene, scene.graph.base_frame, set()))
    if not pieces:
        raise MeshError(f"{os.fspath(path)}: no node shows any triangles")
    shape = shape_of(scene, pieces, solid, os.fspath(path))
    return shape if scale == 1.0 else shape.scaled(positive(scale, "scale", "factor", "1"))


def load_objects(
    path: str | os.PathLike[str],
    *,
    density: float | None = None,
    fixed: bool = False,
    solid: str = "",
    largest: int = LARGEST,
    most_triangles: int = MOST_TRIANGLES,
) -> list[PhysicalObject]:
    """An object for each node right under the root of a mesh file, in its place; see `load` and `scene_objects`."""
    scene = load_scene(path, largest=largest, most_triangles=most_triangles)
    return scene_objects(scene, density=density, fixed=fixed, solid=solid)


def load_scene(path: str | os.PathLike[str], *, largest: int = LARGEST, most_triangles: int = MOST_TRIANGLES) -> Any:
    """The nodes and triangles of a mesh file as a `trimesh.Scene`, unmended; refuses what `load` does."""
    target = Path(path)
    name, suffix = os.fspath(path), target.suffix.lower()
    if suffix not in FORMATS:
        raise MeshError(
            f"{name}: mesh files end in {', '.join(FORMATS)}, not {repr(suffix) if suffix else 'in nothing'}; "
            "convert it, or build a xpheve.Mesh of its vertices and faces"
        )
    data = read_within(target, name, largest)
    if not data:
        raise MeshError(f"{name}: is empty")
    said: list[str] = []
    try:
        if suffix in (".glb", ".gltf"):
            data = gltf.cleaned(data, suffix, target, name, largest, most_triangles, said)
        elif suffix == ".obj":
            data = _clean_obj(data, name, most_triangles)
        elif suffix == ".stl":
            data = _clean_stl(data, name, most_triangles, said)
        else:
            data = _clean_ply(data, name, most_triangles)
        scene = _parsed(data, suffix)
    except MeshError:
        raise
    except MemoryError:
        raise MeshError(f"{name}: does not fit into memory") from None
    except Exception as wrong:
        raise MeshError(
            f"{name}: cannot be read as {suffix[1:].upper()}: {type(wrong).__name__}: {_clip(wrong)}"
        ) from None
    count = sum(len(mesh.faces) for mesh in scene.geometry.values() if hasattr(mesh, "faces"))
    if count > most_triangles:
        raise MeshError(
            f"{name}: {count} triangles are more than the {most_triangles} that are read; give most_triangles="
        )
    if said:
        warnings.warn(MeshWarning(name, tuple(said)), stacklevel=2)
    return scene


def _parsed(data: bytes, suffix: str) -> Any:
    import logging

    import trimesh

    log = logging.getLogger("trimesh")
    level, log.disabled = log.disabled, True
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            kind = "glb" if suffix == ".gltf" else suffix[1:]
            given: dict[str, Any] = {} if kind == "stl" else {"skip_materials": True}
            return trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **given)
    finally:
        log.disabled = level


def read_within(path: Path, name: str, largest: int) -> bytes:
    """All bytes of a plain file of at most ``largest``; raises `MeshError`."""
    try:
        if not path.is_file():
            raise MeshError(f"{name}: there is no such file")
        with open(path, "rb") as file:
            data = file.read(largest + 1)
    except (OSError, ValueError) as wrong:
        reason = wrong.strerror if isinstance(wrong, OSError) and wrong.strerror else str(wrong)
        raise MeshError(f"{name}: cannot be read: {reason}") from None
    if len(data) > largest:
        raise MeshError(f"{name}: is larger than {largest} bytes, the most that is read; give largest=")
    return data


def _clip(wrong: Exception) -> str:
    return (str(wrong).splitlines() or [""])[0][:160]


# STL: 80 bytes, a count, and 50 bytes a triangle; or words


def _clean_stl(data: bytes, name: str, most: int, said: list[str]) -> bytes:
    if data[:5].lower() == b"solid" and b"facet" in data[:4096].lower() and not _is_binary_stl(data):
        _check_places(data.lower().count(b"vertex"), most, name)
        corners = re.findall(rb"vertex\s+(\S{1,40})\s+(\S{1,40})\s+(\S{1,40})", data, re.IGNORECASE)
        if len(corners) % 3 or not corners:
            raise MeshError(f"{name}: {len(corners)} vertices make no triangles; the file is cut short or no STL")
        numbers = _floats([one for corner in corners for one in corner], name).reshape(-1, 3, 3)
    else:
        if len(data) < 84:
            raise MeshError(f"{name}: {len(data)} bytes are no STL file; the header alone has 84")
        (count,) = struct.unpack_from("<I", data, 80)
        room = (len(data) - 84) // 50
        if count > room:
            raise MeshError(
                f"{name}: the header claims {count} triangles, {84 + 50 * count} bytes; the file has {len(data)}: cut short, or no STL"
            )
        if 84 + 50 * count < len(data):
            said.append(f"{len(data) - 84 - 50 * count} bytes after the last triangle left out")
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        numbers = np.frombuffer(data, dtype=kind, count=count, offset=84)["corners"].astype(np.float64)
    _check_count(len(numbers), most, name)
    # Handed on in one form, with normals that nobody reads left at zero.
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    clean = np.zeros(len(numbers), dtype=kind)
    with np.errstate(over="ignore"):
        clean["corners"] = numbers
    return bytes(80) + struct.pack("<I", len(clean)) + clean.tobytes()


def _is_binary_stl(data: bytes) -> bool:
    return len(data) >= 84 and 84 + 50 * int(struct.unpack_from("<I", data, 80)[0]) == len(data)


def _check_count(count: int, most: int, name: str) -> None:
    if not count:
        raise MeshError(f"{name}: has no triangles")
    if count > most:
        raise MeshError(f"{name}: {count} triangles are more than the {most} that are read; give most_triangles=")


def _check_places(count: int, most: int, name: str) -> None:
    if count > 3 * most:
        raise MeshError(f"{name}: {count} vertices are more than {most} triangles have; give most_triangles=")


def _floats(words: list[bytes], name: str) -> Any:
    try:
        return np.array([float(word) for word in words])
    except ValueError as wrong:
        raise MeshError(f"{name}: {_clip(wrong)}") from None


# OBJ: lines of v and f; all others, such as materials, are left out


def _clean_obj(data: bytes, name: str, most: int) -> bytes:
    lines: list[str] = []
    vertices = triangles = 0
    if (count := data.count(b"\n")) > 100_000 + 12 * most:
        raise MeshError(f"{name}: {count} lines are more than {most} triangles need; give most_triangles=")
    text = data.decode("utf-8", errors="replace").replace("\\\r\n", " ").replace("\\\n", " ")
    for k, line in enumerate(io.StringIO(text, newline="\n"), 1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0] == "v":
                lines.append("v " + " ".join(repr(float(word)) for word in words[1:4]))
                if len(words) < 4:
                    raise ValueError("three coordinates are needed")
                vertices += 1
                if vertices > 3 * most:
                    _check_places(vertices, most, name)
            elif words[0] == "f":
                corners = [_corner(word, vertices) for word in words[1:]]
                if len(corners) < 3:
                    raise ValueError("three corners are needed")
                triangles += len(corners) - 2
                if triangles > most:
                    _check_count(triangles, most, name)
                lines.extend(f"f {corners[0]} {corners[i]} {corners[i + 1]}" for i in range(1, len(corners) - 1))
        except ValueError as wrong:
            if isinstance(wrong, MeshError):
                raise
            raise MeshError(f"{name}:{k}: {line.strip()[:60]!r}: {_clip(wrong)}") from None
    _check_count(triangles, most, name)
    return ("\n".join(lines) + "\n").encode()


def _corner(word: str, vertices: int) -> int:
    """The vertex, counted from 1, that ``word`` such as ``3/1/2`` or ``-1`` means."""
    index = int(word.split("/", 1)[0])
    index = vertices + 1 + index if index < 0 else index
    if not 1 <= index <= vertices:
        raise ValueError(f"vertex {word[:20]} does not exist; there are {vertices} above")
    return index


# PLY: a header of words that claims what follows


def _clean_ply(data: bytes, name: str, most: int) -> bytes:
    if not re.match(rb"ply\r?\n", data):
        raise MeshError(f"{name}: does not begin with 'ply', so it is no PLY file")
    end = re.search(rb"\nend_header[ \t]*\r?\n", data[:LONGEST_HEADER])
    if end is None:
        raise MeshError(f"{name}: its header does not end within {LONGEST_HEADER} bytes")
    head, body = data[: end.start()].decode("ascii", errors="replace"), data[end.end() :]
    lines = [line.split() for line in head.split("\n")[1:]]
    lines = [words for words in lines if words and words[0] not in ("comment", "obj_info")]
    if not lines or lines[0][0] != "format" or len(lines[0]) < 2:
        raise MeshError(f"{name}: its header does not say the format")
    form = lines[0][1]
    if form not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise MeshError(f"{name}: format {form[:40]!r}: ascii, binary_little_endian or binary_big_endian is needed")
    elements = _ply_elements(lines[1:], name)
    needed = 0
    for element, count, size, properties in elements:
        needed += count * (max(len(properties), 1) * 2 if form == "ascii" else size)
        if element == "face":
            _check_count(count, most, name)
    if needed > len(body) + 1:
        raise MeshError(f"{name}: the header claims at least {needed} bytes, {len(body)} follow: cut short, or no PLY")
    for _, count, _, _ in elements:
        _check_places(count, most, name)
    known = {element: properties for element, _, _, properties in elements}
    if not {"x", "y", "z"} <= set(known.get("vertex", ())):
        raise MeshError(f"{name}: its vertices have no x, y and z")
    if not {"vertex_indices", "vertex_index"} & set(known.get("face", ())):
        raise MeshError(f"{name}: it has no faces with vertex_indices, only points")
    clean = "\n".join(["ply", *(" ".join(words) for words in lines), "end_header"]) + "\n"
    return clean.encode("ascii", errors="replace") + body


def _ply_elements(lines: list[list[str]], name: str) -> list[tuple[str, int, int, list[str]]]:
    """Name, count, least bytes each and properties of the elements that a header claims."""
    found: list[tuple[str, int, int, list[str]]] = []
    for words in lines:
        if words[0] == "element" and len(words) == 3 and words[2].isdigit() and len(words[2]) < 19:
            if any(words[1] == one[0] for one in found) or len(found) >= 16:
                raise MeshError(f"{name}: element {words[1][:40]!r} comes twice, or there are more than 16")
            found.append((words[1], int(words[2]), 0, []))
        elif words[0] == "property" and found and words[-1] not in found[-1][3] and len(found[-1][3]) < 64:
            element, count, size, properties = found[-1]
            kinds = words[2:-1] if words[1] == "list" else words[1:-1]
            if len(kinds) != (2 if words[1] == "list" else 1) or any(kind not in _PLY_SIZES for kind in kinds):
                raise MeshError(f"{name}: property {' '.join(words)[:60]!r} is none of PLY's")
            found[-1] = element, count, size + _PLY_SIZES[kinds[0]], [*properties, words[-1]]
        else:
            raise MeshError(f"{name}: {' '.join(words)[:60]!r} is no line of a PLY header")
    if any(not properties for _, _, _, properties in found):
        raise MeshError(f"{name}: an element of its header has no properties")
    return found
