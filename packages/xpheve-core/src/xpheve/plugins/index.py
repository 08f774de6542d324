"""The static index: which installed distributions offer packs, found without importing any of them.

The folders of ``sys.path`` are searched for ``*.dist-info`` and ``*.egg-info`` folders whose ``entry_points.txt`` has
the groups ``xpheve.packs`` or ``xpheve.manifest``. What was found is kept in the user's cache folder, a file for each
folder, keyed by path, time of change and size of the folder and of the files that were read. A cache that is torn,
foreign, stale or cannot be written is a slow path, never an error.
"""

from __future__ import annotations

import json
import os
import sys
import time
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from xpheve.folders import cache_folder as users_cache_folder

__all__ = ["Index", "Offer", "locate", "normalised", "read_index"]

PACKS, MANIFESTS = "xpheve.packs", "xpheve.manifest"
FORMAT = "xpheve-index 1"
LARGEST_FILE = 1 << 20  # bytes of an entry_points.txt or METADATA that are looked at; real ones have a few thousand
LARGEST_CACHE = 1 << 24
KEPT = 64  # files kept in the cache folder, one for each folder that holds distributions
MANY = 1000  # entries above which a folder without distributions is kept too; fewer are as quick to list
# A change within one tick of the file system's clock leaves the time of change as it was. What changed so shortly
# before it was read is therefore not trusted the next time: 0.1 s where times have fractions, 2.5 s elsewhere (FAT).
TICK, COARSE_TICK = 100_000_000, 2_500_000_000

Stamp = tuple[int, int]
"""Time of change [ns] and size [bytes]; (0, -1) for what is not there."""
GONE: Stamp = (0, -1)


@dataclass(frozen=True, slots=True)
class Offer:
    """One pack that a distribution offers, as its entry points say.

    ``module`` is what to import, ``manifest`` is ``"package:file"`` or empty; ``location`` is the folder of the
    distribution's metadata.
    """

    name: str
    module: str
    manifest: str
    distribution: str
    version: str
    location: str


@dataclass(frozen=True, slots=True)
class Index:
    """All offers on a search path, the files that could not be read, and how the index was come by."""

    offers: tuple[Offer, ...]
    problems: tuple[tuple[str, str], ...]
    warm: bool
    seconds: float


def normalised(distribution: str) -> str:
    """Return the name of a distribution as it is compared: lower case, one ``-`` for runs of ``-``, ``_`` and ``.``."""
    parts = distribution.lower().replace("_", "-").replace(".", "-").split("-")
    return "-".join(part for part in parts if part)


def cache_folder() -> str:
    """Return where the index is kept: ``XPHEVE_CACHE_DIR``, ``XDG_CACHE_HOME/xpheve`` or ``~/.cache/xpheve``."""
    return users_cache_folder(xdg=True)


def search_folders(path: Iterable[str]) -> list[str]:
    """Return the entries of ``path`` as absolute paths, each once."""
    folders: dict[str, None] = {}
    for entry in path:
        if isinstance(entry, str):
            try:
                folders[os.path.abspath(entry or os.curdir)] = None
            except (OSError, ValueError):  # the working folder is gone, or a null character
                continue
    return list(folders)


def read_index(path: Sequence[str] | None = None) -> Index:
    """Return the index of ``path``, or of ``sys.path``: from the cache where nothing has changed, else searched."""
    started = time.perf_counter()
    home = cache_folder()
    warm = True
    seen: set[str] = set()
    offers: list[Offer] = []
    problems: list[tuple[str, str]] = []
    for folder in search_folders(sys.path if path is None else path):
        cache = os.path.join(home, f"index-{zlib.crc32(folder.encode('utf-8', 'surrogateescape')):08x}")
        found = _from_cache(cache, folder)
        if found is None:
            found, size = _search(folder)
            warm = warm and not found.distributions
            if found.distributions or size > MANY:
                _to_cache(cache, found)
        for distribution in found.distributions:
            if distribution.called in seen:
                continue  # the same distribution farther down the path, which Python does not see either
            seen.add(distribution.called)
            offers += distribution.offers
            problems += distribution.problems
    offers.sort(key=lambda offer: (offer.name, normalised(offer.distribution)))
    return Index(tuple(offers), tuple(problems), warm, time.perf_counter() - started)


# The cache -----------------------------------------------------------------------------------------------------------


class _Distribution(NamedTuple):
    """What was read of one distribution; ``watched`` is the file or folder whose stamp says whether it is true."""

    called: str
    watched: str
    stamp: Stamp
    offers: list[Offer]
    problems: list[tuple[str, str]]


class _Folder(NamedTuple):
    """What was read of one folder of the search path, and when."""

    path: str
    stamp: Stamp
    read_at: int
    distributions: list[_Distribution]


def _stamp(path: str) -> Stamp:
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return GONE
    return found.st_mtime_ns, found.st_size


def _from_cache(cache: str, folder: str) -> _Folder | None:
    """Return what ``cache`` says of ``folder``; None unless it is whole, ours and still true."""
    try:
        with open(cache, "rb") as file:
            about = os.fstat(file.fileno())
            if about.st_size > LARGEST_CACHE or (hasattr(os, "getuid") and about.st_uid != os.getuid()):
                return None
            head, _, body = file.read(LARGEST_CACHE).partition(b"\n")
        if head != f"{FORMAT} {zlib.crc32(body):08x}".encode():
            return None
        path, stamp, read_at, rows = json.loads(body)
        if path != folder or not _still_true(folder, stamp, read_at):
            return None
        distributions = []
        for called, watched, its_stamp, offers, problems in rows:
            if not _still_true(watched, its_stamp, read_at):
                return None
            if offers or problems:
                offers, problems = [Offer(*offer) for offer in offers], [(info, text) for info, text in problems]
            distributions.append(_Distribution(called, watched, its_stamp, offers, problems))
        return _Folder(path, stamp, read_at, distributions)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def _still_true(path: str, stamp: Sequence[int], read_at: int) -> bool:
    """Return whether ``path`` has the same stamp, and had it long enough before it was read to rely on that."""
    changed, size = stamp
    try:
        now = os.stat(path)
    except (OSError, ValueError):
        return (changed, size) == GONE
    tick = TICK if changed % 1_000_000_000 else COARSE_TICK
    return now.st_mtime_ns == changed and now.st_size == size and changed < read_at - tick


def _to_cache(cache: str, found: _Folder) -> None:
    """Keep ``found``, written aside and put in place in one go; nothing happens where that cannot be."""
    aside = f"{cache}.{os.getpid()}.{time.monotonic_ns()}"
    try:
        rows = [
            (d.called, d.watched, d.stamp, [_row(offer) for offer in d.offers], d.problems) for d in found.distributions
        ]
        body = json.dumps((found.path, found.stamp, found.read_at, rows), separators=(",", ":")).encode()
        os.makedirs(os.path.dirname(cache), mode=0o700, exist_ok=True)
        with open(aside, "xb") as file:
            file.write(f"{FORMAT} {zlib.crc32(body):08x}\n".encode() + body)
        os.replace(aside, cache)
        _drop_oldest(os.path.dirname(cache))
    except (OSError, ValueError):
        try:
            os.unlink(aside)
        except (OSError, ValueError):
            pass


def _row(offer: Offer) -> tuple[str, ...]:
    return offer.name, offer.module, offer.manifest, offer.distribution, offer.version, offer.location


def _drop_oldest(folder: str) -> None:
    with os.scandir(folder) as entries:
        ours = [(entry.stat().st_mtime_ns, entry.path) for entry in entries if entry.name.startswith("index-")]
    for _, path in sorted(ours)[:-KEPT]:
        os.unlink(path)


# The search ----------------------------------------------------------------------------------------------------------


def _search(folder: str) -> tuple[_Folder, int]:
    """Return what is in ``folder``, and its number of entries; stamps are taken before what they vouch for is read."""
    read_at = time.time_ns()
    stamp = _stamp(folder)
    infos, size = _metadata_folders(folder)
    found: dict[str, _Distribution] = {}
    for info in infos:
        called = normalised(os.path.basename(info).rpartition(".")[0].partition("-")[0])
        if called not in found:  # the newest comes first where an update left another behind
            found[called] = _read_distribution(called, info)
    return _Folder(folder, stamp, read_at, list(found.values())), size


def _read_distribution(called: str, info: str) -> _Distribution:
    entry_points = os.path.join(info, "entry_points.txt")
    stamp = _stamp(entry_points)
    if stamp == GONE:
        return _Distribution(called, info, _stamp(info), [], [])  # its own stamp changes when the file appears
    try:
        groups = _entry_points(entry_points)
    except (OSError, ValueError) as wrong:
        return _Distribution(called, entry_points, stamp, [], [(info, f"{type(wrong).__name__}: {wrong}")])
    packs, manifests = groups.get(PACKS, {}), groups.get(MANIFESTS, {})
    if not packs and not manifests:
        return _Distribution(called, entry_points, stamp, [], [])
    name, version = _name_and_version(info)
    offers = [Offer(pack, module, manifests.get(pack, ""), name, version, info) for pack, module in packs.items()]
    problems = [(info, f"names a manifest for {pack!r}, but no such pack") for pack in manifests if pack not in packs]
    return _Distribution(called, entry_points, stamp, offers, problems)


def _metadata_folders(folder: str) -> tuple[list[str], int]:
    """Return the metadata folders in ``folder``, the newest first, and how many entries there are in all."""
    found: list[tuple[int, str]] = []
    size = 0
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                size += 1
                # pip renames what it is about to remove to ~...
                if entry.name.endswith((".dist-info", ".egg-info")) and entry.name[0] != "~" and entry.is_dir():
                    found.append((-entry.stat().st_mtime_ns, entry.path))
    except (OSError, ValueError):
        return [], size
    return [path for _, path in sorted(found)], size


def _read_text(path: str) -> str:
    with open(path, "rb") as file:
        data = file.read(LARGEST_FILE + 1)
    if len(data) > LARGEST_FILE:
        raise ValueError(f"{path} is larger than {LARGEST_FILE} bytes")
    return data.decode("utf-8")


def _entry_points(path: str) -> dict[str, dict[str, str]]:
    """Return the groups of an ``entry_points.txt``, of which only ours are looked at."""
    text = _read_text(path)
    if PACKS not in text and MANIFESTS not in text:
        return {}
    groups: dict[str, dict[str, str]] = {}
    group: dict[str, str] = {}
    for line in text.splitlines():
        line = line.strip()
        if not line or line[0] in "#;":
            continue
        if line[0] == "[" and line[-1] == "]":
            group = groups.setdefault(line[1:-1].strip(), {})
            continue
        name, equals, value = line.partition("=")
        if equals:
            group[name.strip()] = value.partition("[")[0].strip()
    return groups


def _name_and_version(info: str) -> tuple[str, str]:
    """Return what the metadata say, or how the folder is called where they cannot be read."""
    stem = os.path.basename(info).rpartition(".")[0]
    name, _, version = stem.partition("-")
    version = version.partition("-")[0]
    for file in ("METADATA", "PKG-INFO"):
        try:
            text = _read_text(os.path.join(info, file))
        except (OSError, ValueError):
            continue
        for line in text.splitlines():
            if not line.strip():
                break
            key, _, value = line.partition(":")
            if key == "Name" and value.strip():
                name = value.strip()
            elif key == "Version" and value.strip():
                version = value.strip()
        break
    return name, version


# Files of a package --------------------------------------------------------------------------------------------------


def locate(reference: str, path: Sequence[str] | None = None) -> str:
    """Return the file that ``reference`` (``"package.module:file"``) names, without importing the package.

    It is empty if it cannot be found that way; ValueError is raised if the reference is none.
    """
    module, _, file = reference.partition(":")
    parts = module.strip().split(".")
    inner = file.strip().replace("\\", "/").split("/")
    if not all(part.isidentifier() for part in parts) or not all(part not in ("", ".", "..") for part in inner):
        raise ValueError(f"{reference!r}: package:file is needed, such as xpheve_aero:xpheve.json")
    if ":" in file or "\0" in file:
        raise ValueError(f"{reference!r}: a file below the package is needed")
    for folder in search_folders(sys.path if path is None else path):
        package = os.path.join(folder, *parts)
        homes = [package] if os.path.isdir(package) else []
        if len(parts) > 1 or not homes:
            homes.append(os.path.join(folder, *parts[:-1]) if len(parts) > 1 else folder)
        top = os.path.join(folder, parts[0])
        if not os.path.isdir(top) and not os.path.isfile(top + ".py"):
            continue
        for home in homes:
            wanted = os.path.join(home, *inner)
            if os.path.isfile(wanted):
                return wanted
        if os.path.isfile(os.path.join(top, "__init__.py")) or os.path.isfile(top + ".py"):
            return ""  # this is the package that Python would import, and the file is not in it
    return _locate_by_finder(parts, inner)


def _locate_by_finder(parts: list[str], inner: list[str]) -> str:
    """Ask the import system's finders, for editable installs that are not on the path; imports nothing."""
    from importlib.util import find_spec

    try:
        spec = find_spec(parts[0])
    except Exception:  # a finder of somebody else's may raise anything
        return ""
    if spec is None:
        return ""
    homes = list(spec.submodule_search_locations or [])
    if not homes and spec.origin:
        homes = [os.path.dirname(spec.origin)]
    for home in homes:
        for folder in (os.path.join(home, *parts[1:]), os.path.join(home, *parts[1:-1])):
            wanted = os.path.join(folder, *inner)
            if os.path.isfile(wanted):
                return wanted
    return ""
