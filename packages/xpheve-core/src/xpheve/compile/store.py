"""Compiled code on disk. An entry says of itself whether it is whole; whoever cannot read it makes it again.

An entry is the line `MAGIC`, the sha256 of all that follows, the length of the header, the header (JSON), the object code. It is named by
its key: the hash of the text, of the machine (processor, platform, numba, llvmlite, our own lowering) and of the form of entries. The
folder, and the file, must be the user's own and writable by nobody else, since what is in them is run: otherwise it is neither read nor
written.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import stat
import time
import warnings
from typing import NamedTuple

from xpheve.errors import CompileWarning
from xpheve.folders import cache_folder

MAGIC = b"xpheve kernel 1\n"
SUFFIX = ".kernel"
LARGEST_ENTRY = 1 << 26
KEPT_BYTES = 1 << 28
"""Bytes kept in the folder; beyond, entries that were not used for longest go."""
ABANDONED = 3600.0
"""Age [s] of a file written aside at which whoever wrote it is taken for dead."""
DAY = 86400.0

_warned = False


class Entry(NamedTuple):
    """What is kept of one kernel."""

    symbol: str
    what: str
    code: bytes


def folder() -> str:
    """Return where compiled code is kept; empty where the user has no home."""
    home = cache_folder()
    return os.path.join(home, "kernels") if home else ""


def key_of(text: str, machine: dict[str, str]) -> str:
    """Return the name under which the code of ``text`` for ``machine`` is kept."""
    whole = json.dumps([MAGIC.decode(), machine, text], sort_keys=True)
    return hashlib.sha256(whole.encode("utf-8", "surrogatepass")).hexdigest()


def path_of(key: str) -> str:
    """Return the file of ``key``."""
    return os.path.join(folder(), key + SUFFIX)


# Reading -------------------------------------------------------------------------------------------------------------


def read(key: str) -> Entry | None:
    """Return the entry of ``key``; None if there is none, or none that can be trusted to be whole and ours."""
    if distrust() is not None:
        return None
    try:
        data = _bytes_of(path_of(key))
        return None if data is None else _entry(key, data)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def distrust() -> str | None:
    """Return why the folder is neither read nor written; None if it is the user's own, or not there yet."""
    place = folder()
    if not place:
        return "the user has no home folder"
    try:
        own, shown = os.stat(place), os.lstat(place)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as wrong:
        return f"{place} cannot be looked at ({wrong})"
    if not stat.S_ISDIR(own.st_mode):
        return f"{place} is not a folder"
    if not _users_own(own) or not _of_user(shown):
        return (
            f"{place} is not the user's own, or others may write to it; remove it, or name another by XPHEVE_CACHE_DIR"
        )
    return None


def _of_user(about: os.stat_result) -> bool:
    return not hasattr(os, "geteuid") or about.st_uid == os.geteuid()


def _users_own(about: os.stat_result) -> bool:
    """Whether it belongs to the user and nobody else may write; Windows guards the user's profile itself."""
    return not hasattr(os, "geteuid") or (_of_user(about) and not about.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _bytes_of(path: str) -> bytes | None:
    """Return what is in a plain file of the user's; a link is not followed, a pipe not waited for."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    handle = os.open(path, flags | getattr(os, "O_CLOEXEC", 0))
    with open(handle, "rb") as file:
        about = os.fstat(handle)
        if not stat.S_ISREG(about.st_mode) or not _users_own(about) or about.st_size > LARGEST_ENTRY:
            return None
        data = file.read(LARGEST_ENTRY + 1)
    if time.time() - about.st_mtime > DAY:
        try:
            os.utime(path)  # used lately
        except OSError:
            pass
    return data


def _entry(key: str, data: bytes) -> Entry | None:
    start = len(MAGIC)
    rest = data[start + 32 :]
    if data[:start] != MAGIC or hashlib.sha256(rest).digest() != data[start : start + 32]:
        return None
    size = int.from_bytes(rest[:4], "little")
    header = json.loads(rest[4 : 4 + size])
    if header["key"] != key:
        return None
    symbol, what = header["symbol"], header["what"]
    if not isinstance(symbol, str) or not isinstance(what, str):
        return None
    return Entry(symbol, what, rest[4 + size :])


# Writing -------------------------------------------------------------------------------------------------------------


def write(key: str, entry: Entry) -> bool:
    """Keep ``entry``, written aside and put in place in one go; return whether it is kept, and warn once where it cannot be."""
    wrong = distrust() or _written(key, entry)
    if wrong:
        warn_once(f"compiled code cannot be kept: {wrong}; it is compiled anew in every process")
    return not wrong


def _written(key: str, entry: Entry) -> str:
    """Write ``entry``; return what went wrong."""
    place, path = folder(), path_of(key)
    aside = os.path.join(place, f".{key[:16]}.{os.getpid()}.{secrets.token_hex(4)}")
    header = json.dumps({"key": key, "symbol": entry.symbol, "what": entry.what}).encode()
    rest = len(header).to_bytes(4, "little") + header + entry.code
    try:
        os.makedirs(os.path.dirname(place), mode=0o700, exist_ok=True)
        if not os.path.isdir(place):
            _make_folder(place)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0)
        with open(os.open(aside, flags, 0o600), "wb") as file:
            file.write(MAGIC + hashlib.sha256(rest).digest() + rest)
        os.replace(aside, path)
    except (OSError, ValueError) as wrong:
        _remove(aside)
        return str(wrong)
    _clean_up(place)
    return ""


def _make_folder(place: str) -> None:
    try:
        os.mkdir(place, 0o700)
    except FileExistsError:  # another process was as quick
        pass


def _remove(path: str) -> None:
    try:
        os.unlink(path)
    except (OSError, ValueError):
        pass


def _clean_up(place: str) -> None:
    """Remove what was abandoned, and the entries unused for longest. A reader has its file open, or misses and makes it again."""
    now, total = time.time(), 0
    found: list[tuple[float, int, str]] = []
    try:
        with os.scandir(place) as entries:
            for entry in entries:
                about = entry.stat(follow_symlinks=False)
                if entry.name.endswith(SUFFIX):
                    found.append((about.st_mtime, about.st_size, entry.path))
                elif entry.name.startswith(".") and now - about.st_mtime > ABANDONED:
                    _remove(entry.path)
    except OSError:
        return
    for _, size, path in sorted(found, reverse=True):
        total += size
        if total > KEPT_BYTES:
            _remove(path)


def warn_once(message: str) -> None:
    """Warn, the first time in a process."""
    global _warned
    if not _warned:
        _warned = True
        warnings.warn(message, CompileWarning, stacklevel=5)
