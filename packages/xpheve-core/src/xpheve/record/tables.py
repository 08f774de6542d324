"""Records as tables for other programs: one row per frame and object. Frames without objects have no row."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from xpheve.record import files
from xpheve.record.paths import aside
from xpheve.record.store import FrameIndex, Store


def write_csv(path: str | os.PathLike[str], store: Store) -> Path:
    """Shortest decimals that give the same float64 back; objects without a name have an empty cell."""
    return _write(path, store, files.csv_writer)


def write_parquet(path: str | os.PathLike[str], store: Store) -> Path:
    """With the metadata and the object table of the record in the metadata of the file."""
    return _write(path, store, files.parquet_writer)


def _write(path: str | os.PathLike[str], store: Store, writer_of: Callable[[Path, FrameIndex], Any]) -> Path:
    with aside(path) as beside, writer_of(beside, store.index) as writer:
        for batch in files.tables(store):
            writer.write_batch(batch)
    return Path(path)
