"""Every response law that ships is fused: Python, the interpreted text and the compiled one answer with the same bits."""

from __future__ import annotations

from collections.abc import Iterator
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


@pytest.fixture(scope="module")
def fused(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Responses, Any, Any]]:
    """All laws in one text, interpreted and compiled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        responses = Responses(LAWS)
        text = assemble(responses.text + "\n\ndef entry(f, n):\n    return respond(f, n)\n", responses.files)
        yield responses, interpreted(text), compiled(text, "all responses of the packs")


def test_no_response_law_is_forgotten() -> None:
    assert {kind.id for kind in KINDS} >= {f"collision:{name}" for name in ("elastic", "point", "reverse", "stop")}
    assert len(LAWS) >= len(KINDS) + 4


@pytest.mark.parametrize("number", range(len(LAWS)), ids=lambda k: f"{LAWS[k].id}-{k}")
def test_a_response_that_ships_has_the_same_bits_in_python_and_in_both_texts(number: int, fused: Any) -> None:
    responses, slow, fast = fused
    law = LAWS[number]
    assert responses.why(law) == "" and responses.partly(law) == ""
    table, places = responses.parameters()
    ints = [np.array([number, *places[number]], dtype=np.int64)]
    for contact in contacts(law, responses.columns, CONTACTS, seed=number):
        expected = python_answer(law, contact)
        for run in (slow, fast):
            scratch = scratch_of(contact, responses.columns)
            kind = run([scratch, table], ints)
            found = kind, tuple(scratch[layout.VALUES : layout.VALUES + COUNTS[kind]].tolist())
            assert expected[0] != layout.ASK and same(expected, found), (law, expected, found)
