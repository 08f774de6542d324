"""Checkpoints as bytes: a JSON header and arrays in a NumPy archive; nothing in it is executed."""

from __future__ import annotations

import io
import json
import os
import struct
import tempfile
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import RecordError

Portable = tuple[dict[str, Any], dict[str, NDArray[Any]]]


TORN = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    EOFError,
    ArithmeticError,
    RuntimeError,
    tokenize.TokenError,
    MemoryError,
)
"""What reading a damaged archive may raise."""


def pack(portable: Portable) -> bytes:
    """Header and arrays as bytes."""
    header, arrays = portable
    text = np.frombuffer(json.dumps(header, allow_nan=True).encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in [("header", text), *((f"array.{name}", array) for name, array in arrays.items())]:
            # A fixed date: the same state gives the same bytes.
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w") as file:
                np.lib.format.write_array(file, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getvalue()


def unpack(checkpoint: bytes | str | os.PathLike[str]) -> Portable:
    """Header and arrays of bytes or of a file.

    Raises
    ------
    RecordError
        If it cannot be read, is torn, or is something else.
    """
    where = "the checkpoint" if isinstance(checkpoint, bytes) else str(checkpoint)
    try:
        data = checkpoint if isinstance(checkpoint, bytes) else Path(checkpoint).read_bytes()
    except OSError as error:
        raise RecordError(f"{where}: {error.strerror or error}") from None
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            header = json.loads(archive["header"].tobytes().decode())
            arrays = {name.removeprefix("array."): archive[name] for name in archive.files if name != "header"}
    except (*TORN, zipfile.BadZipFile, zlib.error, struct.error) as error:
        raise RecordError(
            f"{where} is no whole checkpoint of xpheve ({error}); take one with engine.checkpoint(path)"
        ) from None
    if not isinstance(header, dict) or header.get("format") != "xpheve checkpoint":
        raise RecordError(f"{where} is no checkpoint of xpheve; take one with engine.checkpoint(path)")
    return header, arrays


def write(path: Path, data: bytes) -> None:
    """Write ``data`` aside, then rename, so that ``path`` is whole or as before."""
    try:
        handle, aside = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror or error}") from None
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException:
        Path(aside).unlink(missing_ok=True)
        raise
