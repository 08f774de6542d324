"""Inputs: what came into a running scene from outside, when, and with which arguments, as plain values."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from xpheve.errors import RecordError
from xpheve.kernels.clock import Instant

FORMAT, VERSION = "xpheve inputs", 1


def kinds_of(error: BaseException) -> list[str]:
    """Of which kinds an error and its cause are: what a replay compares, for texts may name addresses."""
    return [type(error).__name__, type(error.__cause__).__name__]


@dataclass(frozen=True, slots=True)
class Input:
    """One thing that came from outside.

    ``instant`` is the simulation time as (base, offset); ``group`` is the same for inputs between which no time passed, not
    even the rest of their instant; ``door`` is the method of the engine; ``arguments`` and ``options`` are JSON values, with objects
    and laws by serial number.
    """

    instant: Instant
    group: int
    door: str
    arguments: tuple[Any, ...] = ()
    options: tuple[tuple[str, Any], ...] = ()

    def plain(self) -> list[Any]:
        """As a JSON value."""
        return [list(self.instant), self.group, self.door, list(self.arguments), dict(self.options)]


@dataclass(frozen=True, slots=True)
class Inputs(Sequence[Input]):
    """The log since `PhysicsEngine.start`, for `PhysicsEngine.replay`.

    ``entries`` are the inputs in their order, ``begin`` and ``end`` the instants at which it begins and ends, ``settings`` the
    ``dt``, ``rtol`` and ``atol`` of the start; ``passed`` tells whether time passed after the last input, be it no longer than
    the rest of an instant.
    """

    entries: tuple[Input, ...]
    begin: Instant
    end: Instant
    settings: tuple[float | None, float, float] = (None, 1e-6, 1e-9)
    passed: bool = True

    def __len__(self) -> int:
        return len(self.entries)

    def __iter__(self) -> Iterator[Input]:
        return iter(self.entries)

    @overload
    def __getitem__(self, index: int) -> Input: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Input]: ...
    def __getitem__(self, index: int | slice) -> Input | Sequence[Input]:
        return self.entries[index]

    def to_json(self) -> str:
        """As JSON text; floats keep all their digits."""
        data = {
            "format": FORMAT,
            "version": VERSION,
            "begin": list(self.begin),
            "end": list(self.end),
            "settings": list(self.settings),
            "passed": self.passed,
            "inputs": [one.plain() for one in self.entries],
        }
        return json.dumps(data)

    @classmethod
    def from_json(cls, text: str) -> Inputs:
        """From what `to_json` gave. Raises `RecordError`."""
        try:
            data = json.loads(text)
            if data["format"] != FORMAT:
                raise ValueError(f"format {data['format']!r}")
            if data["version"] != VERSION:
                raise RecordError(f"inputs of version {data['version']!r}: this xpheve reads {VERSION}; upgrade xpheve")
            dt, rtol, atol = data["settings"]
            return cls(
                tuple(
                    Input(_instant(instant), int(group), str(door), tuple(arguments), tuple(options.items()))
                    for instant, group, door, arguments, options in data["inputs"]
                ),
                _instant(data["begin"]),
                _instant(data["end"]),
                (None if dt is None else float(dt), float(rtol), float(atol)),
                bool(data.get("passed", True)),
            )
        except RecordError:
            raise
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            raise RecordError(f"these are no inputs of xpheve ({error}); take them from engine.inputs") from None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `to_json` into a file, aside first, then renamed. Raises `RecordError`."""
        from xpheve.record.checkpoint import write

        write(Path(path), self.to_json().encode())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Inputs:
        """From a file that `save` wrote. Raises `RecordError`."""
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise RecordError(f"{path}: {error}") from None
        return cls.from_json(text)


def _instant(value: Any) -> Instant:
    base, offset = value
    return float(base), float(offset)


__all__ = ["Input", "Inputs"]
