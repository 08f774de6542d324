"""The text of a scene file: read within limits, parsed, and where in it things stand. Nothing in it is executed."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from xpheve.errors import SceneError
from xpheve.laws.combinations import DEEPEST as DEEPEST_CONDITION

LARGEST = 64 << 20  # [bytes]; 100,000 objects take about 25 MB, and TOML of this size is read for a minute
DEEPEST = 2 * DEEPEST_CONDITION + 8  # tables and lists in one another: a condition in a condition is a table in a list
LONGEST_SHOWN = 60  # characters of a value in an error

Path_ = tuple[str | int, ...]
"""Keys and places in lists that lead to a value, such as ``("objects", 2, "mass")``."""

# A key of more than DEEPEST parts; TOML's parser takes time with the square of their number.
_MANY_DOTS = re.compile(rf"""(?<![\w"'.-])(?:[\w"'-]+[ \t]*\.[ \t]*){{{DEEPEST}}}""")
_FORMS = {".toml": "toml", ".json": "json"}


def form_of(path: str | os.PathLike[str]) -> str:
    """``"toml"`` or ``"json"``, by the end of the name; raises `SceneError`."""
    suffix = Path(path).suffix.lower()
    if suffix not in _FORMS:
        raise SceneError(
            f"{os.fspath(path)}: scene files end in .toml or .json, not {repr(suffix) if suffix else 'in nothing'}"
        )
    return _FORMS[suffix]


def read_source(path: str | os.PathLike[str]) -> Source:
    """Return the parsed file ``path``; raises `SceneError`."""
    name = os.fspath(path)
    form = form_of(path)
    try:
        with open(path, "rb") as file:
            data = file.read(LARGEST + 1)
    except (OSError, ValueError) as wrong:
        reason = wrong.strerror if isinstance(wrong, OSError) and wrong.strerror else str(wrong)
        raise SceneError(f"{name}: cannot be read: {reason}") from None
    if len(data) > LARGEST:
        raise SceneError(
            f"{name}: is larger than {LARGEST >> 20} MiB, the most that is read; build a scene of this size in Python"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as wrong:
        line = data.count(b"\n", 0, wrong.start) + 1
        byte = f"byte 0x{data[wrong.start]:02x}"
        raise SceneError(f"{name}:{line}: {byte} is no UTF-8 text; scenes are TOML or JSON in UTF-8") from None
    return Source(text, name, form)


class Source:
    """A parsed text, and the lines on which its keys and values stand.

    Raises
    ------
    SceneError
        If the text is no TOML or JSON, too large, nested too deeply, or names a key twice.
    """

    def __init__(self, text: str, name: str, form: str) -> None:
        if len(text) > LARGEST:
            raise SceneError(f"{name}: has more than {LARGEST >> 20} million characters, the most that is read")
        self.text = text
        self.name = name
        self.form = form
        self._lines: Lines | None = None
        self.data: dict[str, Any] = self._parse_toml() if form == "toml" else self._parse_json()
        if _depth(self.data) > DEEPEST:
            raise self._too_deep()

    # Parsing

    def _parse_toml(self) -> dict[str, Any]:
        import tomllib

        if _MANY_DOTS.search(self.text):
            raise self._too_deep()
        try:
            return tomllib.loads(self.text)
        except RecursionError:
            raise self._too_deep() from None
        except ValueError as wrong:
            said = str(wrong)
            at = re.search(r" \(at line (\d+), column (\d+)\)$", said)
            if at:
                where, said = f"{self.name}:{at[1]}", f"{said[: at.start()]} (column {at[2]})"
            elif said.endswith(" (at end of document)"):
                where = f"{self.name}:{self.text.rstrip().count(chr(10)) + 1}"
                said = said.removesuffix(" (at end of document)")
            else:
                where = self.name
            raise SceneError(f"{where}: this is no TOML: {clip(said, 200)}") from None

    def _parse_json(self) -> dict[str, Any]:
        import json

        def table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
            found = dict(pairs)
            if len(found) < len(pairs):
                seen: set[str] = set()
                raise _TwiceError(next(key for key, _ in pairs if key in seen or seen.add(key)))  # type: ignore[func-returns-value]
            return found

        try:
            data = json.loads(self.text, object_pairs_hook=table, parse_constant=_refuse_constant)
        except RecursionError:
            raise self._too_deep() from None
        except _TwiceError as wrong:
            key = str(wrong)
            line = self.lines.second(key)
            where = f"{self.name}:{line}" if line else self.name
            raise SceneError(f"{where}: key {show(key)} stands twice in one table; leave one of them") from None
        except _NotFiniteError as wrong:
            line = next((k for k, text in enumerate(self.text.split("\n"), 1) if str(wrong) in text), 1)
            raise SceneError(f"{self.name}:{line}: {wrong}: finite numbers are needed") from None
        except json.JSONDecodeError as wrong:
            raise SceneError(
                f"{self.name}:{wrong.lineno}: this is no JSON: {wrong.msg} (column {wrong.colno})"
            ) from None
        except ValueError as wrong:
            raise SceneError(f"{self.name}: this is no JSON: {clip(str(wrong), 200)}") from None
        if not isinstance(data, dict):
            raise SceneError(f'{self.name}:1: a scene is a table, {{"xpheve": 1, ...}}, not {show(data)}')
        return data

    def _too_deep(self) -> SceneError:
        return SceneError(f"{self.name}: tables and lists are nested more than {DEEPEST} deep; no scene needs that")

    # Places

    @property
    def lines(self) -> Lines:
        """Where keys and values stand; found when first asked for."""
        if self._lines is None:
            self._lines = Lines(self.text, self.form)
        return self._lines

    def line(self, path: Path_) -> int:
        """Return the line of ``path``, or of the nearest table around it; 1 if nothing is known."""
        found = self.lines.found
        for length in range(len(path), 0, -1):
            if path[:length] in found:
                return found[path[:length]]
        return 1

    def at(self, path: Path_) -> str:
        """File and line, for the beginning of an error's text."""
        return f"{self.name}:{self.line(path)}"

    def value(self, path: Path_) -> Any:
        """Return what stands at ``path``; None if nothing does."""
        found: Any = self.data
        for step in path:
            try:
                found = found[step]
            except (LookupError, TypeError):
                return None
        return found

    def error(self, path: Path_, message: str) -> SceneError:
        """Return an error that says file, line, table and ``message``."""
        owner, rest = self.owner(path)
        parts = [self.at(path), owner, rest]
        return SceneError(": ".join(part for part in (*parts, message) if part))

    def wrong(self, path: Path_, message: str) -> SceneError:
        """Return an error that says file, line, table, key, value and ``message``."""
        value = self.value(path)
        owner, rest = self.owner(path)
        shown = show(value)
        if isinstance(value, str) and message.startswith(shown + ": "):
            message = message[len(shown) + 2 :]
        said = f"{rest} = {shown}" if rest else f"{owner} = {shown}"
        return SceneError(": ".join(part for part in (self.at(path), owner if rest else "", said, message) if part))

    def owner(self, path: Path_) -> tuple[str, str]:
        """Return the object, law or container that ``path`` leads into, as it is called; and the keys below it."""
        if len(path) < 2 or path[0] not in ("objects", "laws", "containers") or not isinstance(path[1], int):
            return "", dotted(path)
        kind = str(path[0])[:-1]
        table = self.value(path[:2])
        for key in ("name", "id"):
            called = table.get(key) if isinstance(table, dict) else None
            if isinstance(called, str) and called:
                return f"{kind} {show(called)}", dotted(path[2:])
        return f"{kind} {path[1] + 1}", dotted(path[2:])


class _TwiceError(Exception):
    """A key that stands twice."""


class _NotFiniteError(Exception):
    """NaN or infinity."""


def _refuse_constant(text: str) -> None:
    raise _NotFiniteError(text)


def dotted(path: Path_) -> str:
    """``path`` as text: ``forces[0].vector``."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text


def show(value: Any) -> str:
    """``value`` as a scene file would have it, cut if it is long."""
    if isinstance(value, str):
        import json

        return clip(json.dumps(value, ensure_ascii=not value.isprintable()))
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None:
        return "null"
    try:
        return clip(repr(value))
    except ValueError:  # a whole number of more digits than Python writes
        return "a number of thousands of digits"


def clip(text: str, length: int = LONGEST_SHOWN) -> str:
    """``text``, cut off where it is too long to be shown."""
    return text if len(text) <= length else text[: length - 3] + "..."


def _depth(data: Any) -> int:
    """How deep tables and lists are nested; counted level by level, so that depth costs no stack."""
    level, depth = [data], 0
    while level and depth <= DEEPEST:
        inner: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                inner += [one for one in value.values() if isinstance(one, (dict, list))]
            else:
                inner += [one for one in value if isinstance(one, (dict, list))]
        level, depth = inner, depth + 1
    return depth


class Lines:
    """A light scan of a text that parses: on which line each key and each member of a list begins.

    ``found`` maps paths to lines; it is not complete if the text does not parse.
    """

    def __init__(self, text: str, form: str) -> None:
        self.found: dict[Path_, int] = {}
        self._twice: list[tuple[Path_, int]] = []
        self._text = text
        self._at = 0
        self._line = 1
        self._counted = 0
        self._counts: dict[Path_, int] = {}
        self._between = "=" if form == "toml" else ":"
        try:
            if form == "toml":
                self._toml()
            else:
                self._value(())
        except (IndexError, RecursionError, ValueError):
            pass  # what was found until here is what is known

    def second(self, key: str) -> int:
        """Return the line on which ``key`` stands for the second time in one table; 0 if there is none."""
        return next((line for path, line in self._twice if path[-1] == key), 0)

    def _note(self, path: Path_) -> None:
        line = self._here()
        if path in self.found:
            self._twice.append((path, line))
        else:
            self.found[path] = line

    def _here(self) -> int:
        self._line += self._text.count("\n", self._counted, self._at)
        self._counted = self._at
        return self._line

    def _skip(self, stops: str = "") -> str:
        """Go past white space and comments; the character there, or ``""`` at the end."""
        text = self._text
        while self._at < len(text):
            char = text[self._at]
            if char == "#" and self._between == "=":
                end = text.find("\n", self._at)
                self._at = len(text) if end < 0 else end
            elif char in " \t\r\n" and char not in stops:
                self._at += 1
            else:
                return char
        return ""

    def _toml(self) -> None:
        table: Path_ = ()
        while char := self._skip():
            if char != "[":
                self._pair(table)
                continue
            is_list = self._text.startswith("[[", self._at)
            start = self._at
            self._at += 2 if is_list else 1
            keys = self._keys()
            self._skip()
            self._at += 2 if is_list else 1
            table = self._resolve(keys[:-1])
            table = (*table, keys[-1])
            if is_list:
                number = self._counts.get(table, 0)
                self._counts[table] = number + 1
                table = (*table, number)
            else:
                table = self._resolve(keys)
            end, self._at = self._at, start
            for length in range(1, len(table) + 1):
                self.found.setdefault(table[:length], self._here())
            self._at = end

    def _resolve(self, keys: list[str]) -> Path_:
        path: Path_ = ()
        for key in keys:
            path = (*path, key)
            if path in self._counts:
                path = (*path, self._counts[path] - 1)
        return path

    def _pair(self, table: Path_) -> None:
        self._skip()
        start = self._at
        keys = self._keys()
        end, self._at = self._at, start
        path = (*table, *keys)
        for length in range(len(table) + 1, len(path)):
            self.found.setdefault(path[:length], self._here())
        self._note(path)
        self._at = end
        self._skip()
        self._at += 1  # the sign between key and value
        self._value(path)

    def _keys(self) -> list[str]:
        keys = []
        while True:
            char = self._skip()
            if char in "\"'":
                keys.append(self._string())
            else:
                start = self._at
                while self._text[self._at] not in " \t=.]:\n":
                    self._at += 1
                if start == self._at:
                    raise ValueError("a key is needed")
                keys.append(self._text[start : self._at])
            if self._between == ":" or self._skip() != ".":
                return keys
            self._at += 1

    def _string(self) -> str:
        text, start = self._text, self._at
        quote = text[start]
        if self._between == "=" and text.startswith(quote * 3, start):
            at = start + 3
            while not text.startswith(quote * 3, at):
                at += 2 if quote == '"' and text[at] == "\\" else 1
            at += 3
            while at < len(text) and text[at] == quote:
                at += 1
            self._at = at
            return ""
        at = start + 1
        while text[at] != quote:
            at += 2 if quote == '"' and text[at] == "\\" else 1
        self._at = at + 1
        inner = text[start + 1 : at]
        if quote == '"' and "\\" in inner:
            import json

            try:
                inner = str(json.loads(f'"{inner}"'))
            except ValueError:
                pass
        return inner

    def _value(self, path: Path_) -> None:
        char = self._skip()
        text = self._text
        if char in ("[", "{"):
            self._at += 1
            close = "]" if char == "[" else "}"
            number = 0
            while self._skip() != close:
                if char == "{":
                    self._pair(path)
                else:
                    self._note((*path, number))
                    self._value((*path, number))
                    number += 1
                if self._skip() == ",":
                    self._at += 1
                elif text[self._at] != close:
                    raise ValueError("a comma is needed")
            self._at += 1
        elif char and char in "\"'":
            self._string()
        else:
            start = self._at
            while self._at < len(text) and text[self._at] not in ",]}\n#":
                self._at += 1
            if start == self._at:
                raise ValueError("a value is needed")
