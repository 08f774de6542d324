"""Every row of the thesis is held by a test that names it, without exception, and every mark names a row.

The rows stand in ``rows.toml``; a test names them by ``@pytest.mark.thesis("row", "row/claim")``. Marks are read from the
text of the tests, so that it does not matter which of them run.
"""

from __future__ import annotations

import importlib.util
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def load_maker() -> ModuleType:
    """Return the script that makes the page: it reads rows and marks."""
    spec = importlib.util.spec_from_file_location("make_thesis_page", DOCS / "make_thesis_page.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


maker = load_maker()
ROWS = maker.rows()
MARKS = maker.marks()
each_row = pytest.mark.parametrize("row", [pytest.param(row, id=row.id) for row in ROWS])


def test_rows_are_written_as_they_should_be() -> None:
    assert [id for id, count in Counter(row.id for row in ROWS).items() if count > 1] == []
    for row in ROWS:
        assert row.where and row.holds and set(row.note) <= {"fix", "better", "decide", "later"}, row.id
        assert {"fix", "decide"} & set(row.note) <= set(row.claims), f"{row.id}: say what is fixed or decided"


@each_row
def test_a_row_has_a_test_for_itself_and_for_each_claim(row: object) -> None:
    missing = [name for name in row.must_be_tested() if name not in MARKS]  # type: ignore[attr-defined]
    assert not missing, f"no test is marked @pytest.mark.thesis({', '.join(map(repr, missing))})"


@each_row
def test_a_row_that_was_open_names_its_decision(row: object) -> None:
    assert row.decision or "decide" not in row.note, "a row noted decide has a field decision"  # type: ignore[attr-defined]
    for number in row.decision:  # type: ignore[attr-defined]
        assert len(maker.decision(number)) == 1, f"docs/decisions/{number}-*.md"


@each_row
def test_a_row_that_is_better_is_in_the_page_of_what_is_better(row: object) -> None:
    if "better" in row.note:  # type: ignore[attr-defined]
        assert f"`{row.id}`" in maker.decision("0023")[0].read_text(encoding="utf-8")  # type: ignore[attr-defined]


def test_every_mark_names_a_row_or_a_claim() -> None:
    known = {name for row in ROWS for name in row.must_be_tested()}
    assert {name: places for name, places in MARKS.items() if name not in known} == {}


def test_the_page_of_the_thesis_is_fresh() -> None:
    assert maker.PAGE.read_text(encoding="utf-8") == maker.page(), "run: python docs/make_thesis_page.py"


def test_decisions_have_one_page_a_number_and_are_on_the_map() -> None:
    pages = sorted(path.name for path in maker.DECISIONS.glob("*.md"))
    assert [number for number, count in Counter(name[:4] for name in pages).items() if count > 1] == []
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    assert [name for name in pages if name not in index] == []
