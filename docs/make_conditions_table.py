"""Writes the table of ``conditions.md`` from the classes of `xpheve.when`: what each means, its Java3D original, what is other than there.

Run ``python docs/make_conditions_table.py`` after a condition has changed; a test says when that was forgotten.
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from xpheve.laws import conditions

PAGE = Path(__file__).parent / "conditions.md"
BEGIN, END = "<!-- table of conditions: made by make_conditions_table.py -->", "<!-- end of table -->"


def table() -> str:
    """Return the table, a row for each condition, in the order of the module."""
    kinds = [getattr(conditions, name) for name in conditions.__all__ if name != "Condition"]
    rows = ["| condition | fires when | found by | Java3D | other than there |", "|---|---|---|---|---|"]
    for kind in kinds:
        cells = (f"`{kind.__name__}{signature(kind)}`", meaning(kind), server(kind), kind.original, kind.difference)
        rows.append("| " + " | ".join(cell(text) for text in cells) + " |")
    return "\n".join(rows)


def signature(kind: type[Any]) -> str:
    """Return what the class takes, without ``once`` and annotations."""
    names = []
    for param in inspect.signature(kind).parameters.values():
        if param.kind is param.VAR_POSITIONAL:
            names.append("a, b, ..." if kind.__name__ != "Not" else "a")
        elif param.name != "once":
            names.append(param.name if param.default is param.empty else f"{param.name}={param.default!r}")
    return f"({', '.join(names)})"


def meaning(kind: type[Any]) -> str:
    """Return the first paragraph of the docstring, as one line."""
    return " ".join(inspect.cleandoc(kind.__doc__ or "").split("\n\n")[0].split())


def server(kind: type[Any]) -> str:
    """Return who finds its events."""
    return kind.served_by if isinstance(kind.served_by, str) else "members"


def cell(text: str) -> str:
    """Return text for a table, in which a bar would end the cell."""
    return text.replace("|", "\\|").replace("``", "`")


def page(old: str) -> str:
    """Return the page ``old`` with a fresh table."""
    head, rest = old.split(BEGIN)
    tail = rest.split(END)[1]
    return f"{head}{BEGIN}\n\n{table()}\n\n{END}{tail}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8", newline="\n")
    print(f"{PAGE}: written")
