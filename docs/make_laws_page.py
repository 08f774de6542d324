"""Writes ``laws.md`` from the interfaces and docstrings of the laws of the packs that come along.

Run ``python docs/make_laws_page.py`` after a law has changed; a test says when that was forgotten.
"""

from __future__ import annotations

import inspect
import math
from pathlib import Path
from typing import Any

from xpheve.laws import PhysicalLaw
from xpheve.plugins import Registry
from xpheve.plugins.spec import ParamSpec, spec_of

PACKS = ("basic", "collision")
PAGE = Path(__file__).parent / "laws.md"

HEAD = """\
# Laws

The laws of the packs that come along. This page is made from their docstrings by `docs/make_laws_page.py`; `xpheve show ID` prints
the same of any law that is installed.
"""

KINDS = {
    "field": "on each object by itself",
    "pair": "on pairs of objects",
    "response": "on objects that touch and approach",
    "free": "when its condition fires",
}


def page() -> str:
    """Return the text of the page."""
    registry = Registry(allow=PACKS)
    infos = sorted((info for info in registry.laws() if info.pack in PACKS), key=lambda info: info.id)
    parts = [HEAD, "| law | acts | in a line |\n|---|---|---|"]
    for info in infos:
        parts[-1] += f"\n| [`{info.id}`](#{anchor(info.id)}) | {KINDS[info.kind]} | {cell(info.doc)} |"
    parts += [card(registry.law(info.id)) for info in infos]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def card(law: type[PhysicalLaw]) -> str:
    """Return what there is to say of one law."""
    spec = spec_of(law)
    parts = [f"## {spec.id}", inspect.cleandoc(law.__doc__ or "").replace("``", "`")]
    if spec.params:
        rows = [
            f"| `{one.name}` | {value(one.default)} | {unit(one.unit)} | {bounds(one)} | {cell(one.doc)} |"
            for one in spec.params
        ]
        parts.append("\n".join(["| parameter | default | unit | bounds | |", "|---|---|---|---|---|", *rows]))
    if spec.columns:
        rows = [f"| `{one.name}` | {value(one.default)} | {unit(one.unit)} | {cell(one.doc)} |" for one in spec.columns]
        parts.append("\n".join(["| column of objects | default | unit | |", "|---|---|---|---|", *rows]))
    facts = [f"Role: {spec.role}.", f"Acts {KINDS[spec.kind]}."]
    if spec.kind in ("field", "pair"):
        facts.append("It has a potential." if spec.has_potential else "It has no potential; its work is reported.")
    if spec.condition:
        facts.append(f"Condition: `{spec.condition}`.")
    return "\n\n".join([*parts, " ".join(facts)])


def value(given: Any) -> str:
    """Return a default as a reader would write it."""
    if given is None:
        return "-"
    if isinstance(given, float) and math.isnan(given):
        return "not given"
    return f"`{given!r}`"


def unit(given: str) -> str:
    """Return a unit; pure numbers have none."""
    return "" if given == "1" else given


def bounds(param: ParamSpec) -> str:
    """Return what a parameter may be."""
    found = [
        f"{sign} {bound:g}"
        for sign, bound in ((">", param.gt), (">=", param.ge), ("<", param.lt), ("<=", param.le))
        if bound is not None
    ]
    return " and ".join(found) or ", ".join(f"`{choice}`" for choice in param.choices)


def cell(text: str) -> str:
    """Return text for a table, in which a bar would end the cell."""
    return text.replace("|", "\\|").replace("``", "`")


def anchor(id: str) -> str:
    """Return the anchor of a heading that is an id."""
    return id.replace(":", "")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
    print(f"{PAGE}: written")
