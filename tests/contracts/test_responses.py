"""Every response law that ships is fused: Python, the interpreted text and the compiled one answer with the same bits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve_laws_collision as collision
from xpheve.compile import assemble, compiled, interpreted
from xpheve.kernels import response as layout
from xpheve.laws import ResponseLaw
from xpheve.loop.response_check import contacts, python_answer, same, scratch_of
from xpheve.loop.responses import Responses

CONTACTS = 150
COUNTS = (1, 3, 6, 0)
"""How many numbers each kind of answer has."""


def variants_of(kind: type[ResponseLaw]) -> Iterator[ResponseLaw]:
    """The law as it comes, and with each choice of each parameter that chooses a formula."""
    yield kind()
    for name, param in kind.params.items():
        if name != "resting":
            yield from (kind(**{name: choice}) for choice in param.choices or () if choice != param.default)


KINDS = [
    kind
    for kind in map(collision.__dict__.get, collision.__all__)
    if isinstance(kind, type) and issubclass(kind, ResponseLaw)
]
LAWS = [law for kind in KINDS for law in variants_of(kind)]
LONG = {"collision:rough", "collision:stick"}
"""What takes some seconds to compile, and has the arithmetic of another."""

ENTRY = "\n\ndef entry(f, n):\n    return respond(f, n)\n"


def disagreement(law: ResponseLaw, responses: Responses, run: Any, seed: int) -> list[Any]:
    """The contacts at which ``run`` answers otherwise than the law in Python, or asks it."""
    number = responses.laws.index(law)
    table, places = responses.parameters()
    ints = [np.array([number, *places[number]], dtype=np.int64)]
    wrong: list[Any] = []
    for contact in contacts(law, responses.columns, CONTACTS, seed=seed):
        expected = python_answer(law, contact)
        scratch = scratch_of(contact, responses.columns)
        kind = run([scratch, table], ints)
        found = kind, tuple(scratch[layout.VALUES : layout.VALUES + COUNTS[kind]].tolist())
        if expected[0] == layout.ASK or not same(expected, found):
            wrong.append((contact, expected, found))
    return wrong


def test_no_response_law_is_forgotten() -> None:
    assert {kind.id for kind in KINDS} >= {f"collision:{name}" for name in ("elastic", "point", "reverse", "stop")}
    assert len(LAWS) >= len(KINDS) + 4


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.id)
def test_a_response_that_ships_answers_in_a_text_as_in_python(law: ResponseLaw) -> None:
    responses = Responses([law])
    assert responses.why(law) == "" and responses.partly(law) == ""
    run = interpreted(assemble(responses.text + ENTRY, responses.files))
    assert disagreement(law, responses, run, seed=LAWS.index(law)) == []


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, id=kind.id, marks=[pytest.mark.stress] * (kind.id in LONG)) for kind in KINDS]
)
def test_a_response_that_ships_answers_compiled_as_in_python(
    kind: type[ResponseLaw], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(tmp_path))
    responses = Responses([kind()])
    run = compiled(assemble(responses.text + ENTRY, responses.files), f"the response {kind.id}")
    assert disagreement(responses.laws[0], responses, run, seed=3) == []
