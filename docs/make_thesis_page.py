"""Writes ``thesis.md``: what the thesis asks, and the tests that hold it; from ``tests/thesis/rows.toml`` and the marks of the tests.

Run ``python docs/make_thesis_page.py`` after a row or a mark has changed; a test says when that was forgotten.
"""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
PAGE = DOCS / "thesis.md"
DECISIONS = DOCS / "decisions"
TESTS = DOCS.parent / "tests" / "thesis"

HEAD = """\
# The thesis, row by row

xPheve began as the thesis of S. Nourian (2004). Each row says what the thesis asks for, in our words, and which tests hold it; all lie in
`tests/thesis`. This page is made by `docs/make_thesis_page.py` from `tests/thesis/rows.toml` and the marks of the tests.

| note | means |
|---|---|
| fix | the thesis has a slip or a flaw; we do the right thing, and a test tells the two apart |
| better | we do more, or otherwise, on purpose: [decision 23](decisions/0023-more-than-the-thesis.md) says why |
| decide | the thesis leaves it open: the decision says how it is here |
| later | not in this release |
"""


@dataclass(frozen=True)
class Row:
    """A row of ``rows.toml``."""

    id: str
    where: str
    holds: str
    note: tuple[str, ...]
    decision: tuple[str, ...] = ()
    claims: dict[str, str] = field(default_factory=dict)

    @property
    def later(self) -> bool:
        """Whether the row is not in this release."""
        return "later" in self.note

    def must_be_tested(self) -> list[str]:
        """Return what tests have to name: the row, and each of its claims."""
        return [] if self.later else [self.id, *(f"{self.id}/{claim}" for claim in self.claims)]


def rows() -> list[Row]:
    """Return all rows, in the order of the thesis."""
    with (TESTS / "rows.toml").open("rb") as file:
        table = tomllib.load(file)["row"]
    return [
        Row(**one | {"note": tuple(one["note"]), "decision": tuple(one.get("decision", ()))})  # type: ignore[arg-type]
        for one in table
    ]


def marks() -> dict[str, list[str]]:
    """Return, for each row or claim that a mark names, the tests that hold it, as ``file::test``; skipped tests hold nothing."""
    found: dict[str, list[str]] = {}
    for path in sorted(TESTS.rglob("test_*.py")):
        for test, names in _marked(ast.parse(path.read_text(encoding="utf-8"))):
            for name in names:
                here = found.setdefault(name, [])
                place = f"{path.relative_to(TESTS).as_posix()}::{test}"
                if place not in here:
                    here.append(place)
    return found


def _marked(tree: ast.Module) -> Iterator[tuple[str, list[str]]]:
    """Yield each test function with the names of its marks; a mark of a class counts for its tests."""
    todo: list[tuple[ast.AST, list[str], bool]] = [(node, [], False) for node in tree.body]
    while todo:
        node, above, skipped = todo.pop(0)
        if not isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            continue
        own = [name for decorator in node.decorator_list for name in _names(decorator)]
        skipped |= any(_skips(decorator) for decorator in node.decorator_list)
        if isinstance(node, ast.ClassDef):
            todo += [(inner, [*above, *own], skipped) for inner in node.body]
        elif node.name.startswith("test_") and not skipped:
            yield node.name, [*above, *own]


def _names(tree: ast.AST) -> Iterator[str]:
    """Yield what every ``pytest.mark.thesis(...)`` in ``tree`` names."""
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr == "thesis":
            for argument in call.args:
                if not (isinstance(argument, ast.Constant) and isinstance(argument.value, str)):
                    raise ValueError(
                        f"line {call.lineno}: a mark names rows by plain texts, not by {ast.unparse(argument)}"
                    )
                yield argument.value


def _skips(decorator: ast.AST) -> bool:
    return any(
        isinstance(one, ast.Attribute) and one.attr in ("skip", "skipif", "xfail") for one in ast.walk(decorator)
    )


def page() -> str:
    """Return the text of the page."""
    held = marks()
    parts = [HEAD, "| section, figure | what must hold | note | tests | decision |", "|---|---|---|---|---|"]
    for row in rows():
        tests = _cell_of_tests(row.id, held)
        parts.append(_line(row.where, row.holds, ", ".join(row.note), tests, _links(row.decision)))
        for claim, text in row.claims.items():
            parts.append(_line("", text, claim, _cell_of_tests(f"{row.id}/{claim}", held), ""))
    return parts[0] + "\n" + "\n".join(parts[1:]) + "\n"


def _line(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _cell_of_tests(name: str, held: dict[str, list[str]]) -> str:
    return "<br>".join(f"`{place.removesuffix('.py')}`" for place in held.get(name, [])) or "-"


def _links(numbers: tuple[str, ...]) -> str:
    return ", ".join(f"[{int(number)}](decisions/{path.name})" for number in numbers for path in decision(number))


def decision(number: str) -> list[Any]:
    """Return the pages of a decision: one, or none."""
    return sorted(DECISIONS.glob(f"{number}-*.md"))


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
    print(f"{PAGE}: written")
