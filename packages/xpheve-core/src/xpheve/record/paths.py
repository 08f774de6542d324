"""Where files may go, and how a whole file takes the place of another."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from xpheve.errors import RecordError


def writable(path: str | os.PathLike[str]) -> Path:
    """``path``, if a file may be written there; else `RecordError`."""
    target = Path(path)
    folder = target.parent
    if not folder.is_dir():
        raise RecordError(f"{target}: the folder {folder} does not exist; make it first")
    if target.exists() and not target.is_file():
        raise RecordError(f"{target}: is not a file, so no file can take its place; give another path")
    if not target.name:
        raise RecordError(f"{str(path)!r}: is no name of a file")
    return target


@contextmanager
def aside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a path beside ``path`` to write to; on success it takes the place of ``path``, on failure it goes."""
    target = writable(path)
    beside = target.with_name(f".{target.stem[:100]}.{os.getpid()}.new{target.suffix}")
    try:
        yield beside
        os.replace(beside, target)
    except OSError as error:
        raise RecordError(f"{target}: could not be written ({error.strerror or error})") from error
    finally:
        beside.unlink(missing_ok=True)
