"""The table of conditions says what the conditions say."""

from __future__ import annotations

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_table_of_conditions_is_fresh() -> None:
    spec = importlib.util.spec_from_file_location("make_conditions_table", DOCS / "make_conditions_table.py")
    assert spec is not None
    assert spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    written = (DOCS / "conditions.md").read_text(encoding="utf-8")
    assert written == maker.page(written), "run: python docs/make_conditions_table.py"
