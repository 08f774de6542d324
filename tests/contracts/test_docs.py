"""Every page runs: the Python of each page of the docs, top to bottom, in an empty folder."""

from __future__ import annotations

import doctest
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^([ \t]*)```python[ \t]*\n(.*?)^\1```[ \t]*$", re.DOTALL | re.MULTILINE)


def blocks(text: str) -> Iterator[tuple[int, str]]:
    """Yield each block that is fenced as ``python``, with the number of lines above it."""
    for found in BLOCK.finditer(text):
        indent, code = found.groups()
        yield text.count("\n", 0, found.start(2)), re.sub(f"^{indent}", "", code, flags=re.MULTILINE)


@pytest.mark.parametrize("page", [pytest.param(page, id=str(page.relative_to(ROOT))) for page in PAGES])
def test_the_python_of_the_page_runs_as_written(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of one page share their names, as a reader who types them in would; ``>>>`` must print what it says."""
    monkeypatch.chdir(tmp_path)
    module = ModuleType(f"page_{page.stem}")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    for above, code in blocks(page.read_text(encoding="utf-8")):
        if code.lstrip().startswith(">>>"):
            example = doctest.DocTestParser().get_doctest(code, module.__dict__, page.name, str(page), above)
            report: list[str] = []
            doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example, out=report.append, clear_globs=False)
            assert not report, "".join(report)
            module.__dict__.update(example.globs)
        else:  # the empty lines put the right number on each line of a traceback
            exec(compile("\n" * above + code, page, "exec"), module.__dict__)
