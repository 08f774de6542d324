"""The manifest: what a pack offers, as a data file that is read without importing the pack.

``xpheve manifest --write`` writes it next to the pack's module; a test holds it against the module, so that it is never
stale. Reading it executes nothing, and a file larger than `LARGEST` is not read.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from xpheve.errors import PackError
from xpheve.laws import API_VERSION
from xpheve.plugins.pack import KINDS, Pack, collect, guess_name
from xpheve.plugins.spec import LawSpec, default_api, nature_words

__all__ = [
    "Manifest",
    "api_allows",
    "api_of",
    "build_manifest",
    "check_manifest",
    "parse_manifest",
    "read_manifest",
    "write_manifest",
]

SCHEMA = 1
FILE = "xpheve.json"
LARGEST = 1 << 22  # bytes; a pack of 100 laws has some 100 000


@dataclass(frozen=True, slots=True)
class Manifest:
    """A manifest as read: interfaces of laws, and for each kind the ids with what to import for them."""

    pack: str
    api: str
    laws: tuple[LawSpec, ...]
    classes: Mapping[str, Mapping[str, str]]


def build_manifest(source: Any, name: str = "") -> dict[str, Any]:
    """Return the manifest of a module or pack object, from what it offers.

    Parameters
    ----------
    source
        The imported module (or object) that the entry point names.
    name
        Of the pack; if not given, the prefix of the first id.

    Raises
    ------
    PackError
        If the pack is not sound: with `TraceError`, if a field or pair law says no formula.

    """
    pack = Pack(name or guess_name(source))
    collect(pack, source)
    laws = []
    for id in sorted(pack.offered["law"]):
        law = pack.resolve("law", id)
        laws.append({**pack.specs[id].to_dict(), "class": _reference(law)})
        if nature := nature_words(law):
            laws[-1]["nature"] = nature
        if laws[-1].get("api") == default_api():
            del laws[-1]["api"]
    built: dict[str, Any] = {"schema": SCHEMA, "pack": pack.name, "api": api_of(source), "laws": laws}
    for kind in KINDS[1:]:
        rows = []
        for id in sorted(pack.offered[kind]):
            thing = pack.resolve(kind, id)
            rows.append({"id": id, "class": _reference(thing), "doc": _first_line(thing)})
        built[kind + "s"] = rows
    return built


def api_of(source: Any) -> str:
    """Return the versions of the law contract that a pack says it is for (``XPHEVE_API``), else the present one."""
    said = getattr(source, "XPHEVE_API", "")
    return said if isinstance(said, str) and said else default_api()


def write_manifest(source: Any, path: str | os.PathLike[str] | None = None, *, name: str = "") -> Path:
    """Write the manifest of the module ``source`` next to it, or to ``path``; returns where it lies now."""
    if path is None:
        if not isinstance(source, ModuleType) or not source.__file__:
            raise PackError(f"{source!r} has no file: say where the manifest goes")
        path = Path(source.__file__).parent / FILE
    target = Path(path)
    text = json.dumps(build_manifest(source, name), indent=1, ensure_ascii=False) + "\n"
    aside = target.with_name(f"{target.name}.{os.getpid()}")
    try:
        aside.write_text(text, encoding="utf-8", newline="\n")
        os.replace(aside, target)
    finally:
        aside.unlink(missing_ok=True)
    return target


def check_manifest(source: Any, path: str | os.PathLike[str] | None = None, *, name: str = "") -> str:
    """Return what is stale in the manifest of the module ``source``, as one sentence; empty if nothing is."""
    target = Path(path) if path is not None else Path(source.__file__).parent / FILE
    way_out = "Run: xpheve manifest --write"
    try:
        written = _load(target)
        read = parse_manifest(written, name)
    except FileNotFoundError:
        return f"there is no manifest {target}. {way_out}"
    except (OSError, ValueError) as wrong:
        return f"{target} cannot be read: {wrong}. {way_out}"
    differences = differ(json.loads(json.dumps(build_manifest(source, name or read.pack))), written)
    return f"{target} is stale: {'; '.join(differences)}. {way_out}" if differences else ""


def differ(built: Mapping[str, Any], written: Mapping[str, Any]) -> list[str]:
    """Return where a manifest just built and a written one differ."""
    found: list[str] = []
    if built["pack"] != written["pack"]:
        found.append(f"pack is {written['pack']!r}, should be {built['pack']!r}")
    for group in (kind + "s" for kind in KINDS):
        ours = {row["id"]: row for row in built[group]}
        theirs = {row["id"]: row for row in written.get(group, [])}
        found += [f"{id} is missing" for id in ours if id not in theirs]
        found += [f"{id} is no more" for id in theirs if id not in ours]
        for id in ours.keys() & theirs.keys():
            fields = [
                field for field in sorted({*ours[id], *theirs[id]}) if ours[id].get(field) != theirs[id].get(field)
            ]
            if sys.flags.optimize >= 2:  # Python has thrown the docstrings away
                fields = [field for field in fields if field not in ("doc", "cite")]
            if fields:
                found.append(f"{id} has another {', '.join(fields)}")
    return sorted(found)


# Reading --------------------------------------------------------------------------------------------------------------


def read_manifest(path: str | os.PathLike[str], name: str = "") -> Manifest:
    """Return the manifest in the file ``path`` of the pack ``name``. Raises OSError or ValueError; executes nothing."""
    return parse_manifest(_load(path), name)


def _load(path: str | os.PathLike[str]) -> dict[str, Any]:
    with open(path, "rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise ValueError(f"larger than {LARGEST} bytes")
    try:
        written = json.loads(data)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(written, dict):
        raise ValueError(f"a {type(written).__name__}, not a table")
    return written


def parse_manifest(written: Mapping[str, Any], name: str = "") -> Manifest:
    """Return a manifest out of its JSON. Raises ValueError, saying what is wrong with it."""
    schema = written.get("schema")
    if not isinstance(schema, int) or isinstance(schema, bool):
        raise ValueError(f'"schema" is {schema!r}; {SCHEMA} is meant')
    if schema != SCHEMA:
        raise ValueError(f"its schema is {schema}; this xpheve reads {SCHEMA}: upgrade xpheve")
    pack, api = written.get("pack"), written.get("api")
    if not isinstance(pack, str) or (name and pack != name):
        raise ValueError(f'"pack" is {pack!r}{f", but the entry point says {name!r}" if name else ""}')
    if not isinstance(api, str):
        raise ValueError(f'"api" is {api!r}; a text such as "{default_api()}" is meant')
    api_allows(api)
    classes: dict[str, dict[str, str]] = {kind: {} for kind in KINDS}
    laws: list[LawSpec] = []
    for kind in KINDS:
        rows = written.get(kind + "s", [])
        if not isinstance(rows, list):
            raise ValueError(f'"{kind}s" is no list')
        for row in rows:
            id = row.get("id") if isinstance(row, dict) else None
            if not isinstance(id, str) or not id.startswith(pack + ":"):
                raise ValueError(f'an entry of "{kind}s" has the id {id!r}; {pack}:name is meant')
            if id in classes[kind]:
                raise ValueError(f'"{kind}s" has two entries of the id {id!r}')
            reference = row.get("class", "")
            if not isinstance(reference, str):
                raise ValueError(f'"class" of {id} is {reference!r}')
            classes[kind][id] = reference
            if kind == "law":
                laws.append(LawSpec.from_dict({"api": api, **row}))
    return Manifest(pack, api, tuple(laws), classes)


def api_allows(needed: str, version: int = API_VERSION) -> bool:
    """Return whether ``version`` lies within ``needed``, such as ``">=1,<2"`` or ``"1"``; ValueError for no range."""
    allowed = True
    for part in needed.split(","):
        part = part.strip()
        for sign in (">=", "<=", "==", "!=", ">", "<", ""):
            if part.startswith(sign):
                break
        number = part[len(sign) :].strip()
        if not number.isdecimal() or len(number) > 9:
            raise ValueError(f'"api" is {needed!r}; a range such as ">=1,<2" is meant')
        other = int(number)
        allowed = allowed and {
            ">=": version >= other,
            "<=": version <= other,
            "!=": version != other,
            ">": version > other,
            "<": version < other,
        }.get(sign, version == other)
    return allowed


def _reference(thing: type) -> str:
    return f"{thing.__module__}:{thing.__qualname__}"


def _first_line(thing: type) -> str:
    lines = (thing.__doc__ or "").strip().splitlines()
    return lines[0].strip() if lines else ""
