"""The page of laws says what the laws say."""

from __future__ import annotations

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_of_laws_is_fresh() -> None:
    spec = importlib.util.spec_from_file_location("make_laws_page", DOCS / "make_laws_page.py")
    assert spec is not None
    assert spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    written = (DOCS / "laws.md").read_text(encoding="utf-8")
    assert written == maker.page(), "run: python docs/make_laws_page.py"
