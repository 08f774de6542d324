"""Answers with more digits than float64 has, each beside the script that made it: ``python -m benchmarks.references NAME``.

A file holds the float64 numbers of the start as hexadecimal (so that all begin with the same bits), the span, and the end in decimal digits.
"""

from __future__ import annotations

import json
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

FOLDER = Path(__file__).parent


class Reference(NamedTuple):
    """An end as a sum of two float64 arrays, ``high + low``, and the start it belongs to."""

    span: float
    start: Any
    high: Any
    low: Any


@cache
def load(name: str) -> list[Reference]:
    """The answers of ``name``: one for each start.

    Raises
    ------
    FileNotFoundError
        If it has not been made.
    """
    data = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    found = []
    for one in data["answers"]:
        high = np.array([float(text) for text in one["end"]])
        low = np.array([float(Decimal(text) - Decimal(float(text))) for text in one["end"]])
        start = np.array([float.fromhex(text) for text in one["start"]])
        found.append(Reference(float.fromhex(one["span"]), start, high, low))
    return found


def save(name: str, made: str, answers: list[tuple[float, Any, list[str]]]) -> Path:
    """Write (span, start, end in decimal digits) of each start; ``made`` says how."""
    path = FOLDER / f"{name}.json"
    data = {
        "made": made,
        "answers": [
            {"span": float(span).hex(), "start": [float(c).hex() for c in start], "end": list(end)}
            for span, start, end in answers
        ],
    }
    path.write_text(json.dumps(data, indent=0) + "\n", encoding="utf-8")
    return path


def exists(name: str) -> bool:
    """Whether the answers are there."""
    return (FOLDER / f"{name}.json").exists()
