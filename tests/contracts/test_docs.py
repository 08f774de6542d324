"""Every page runs: the Python of each page of the docs, top to bottom, in an empty folder; and it prints what the page says."""

from __future__ import annotations

import ast
import contextlib
import doctest
import io
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(
    r"^([ \t]*)```python[ \t]*\n(.*?)^\1```[ \t]*\n(?:[ \t]*\n^\1```text[ \t]*\n(.*?)^\1```[ \t]*$)?",
    re.DOTALL | re.MULTILINE,
)
"""A block of Python, and the block of text right under it: what it prints."""


def blocks(text: str) -> Iterator[tuple[int, str, str | None]]:
    """Yield each block that is fenced as ``python``, with the number of lines above it, and what it says it prints."""
    for found in BLOCK.finditer(f"{text}\n"):
        indent, code, output = found.groups()
        yield text.count("\n", 0, found.start(2)), re.sub(f"^{indent}", "", code, flags=re.MULTILINE), output


def is_said(printed: str, output: str) -> bool:
    """Whether ``printed`` is ``output``, in which ``...`` stands for anything, and lines may be broken anywhere."""
    words = " ".join(output.split())
    return (
        re.fullmatch(".*".join(re.escape(part) for part in words.split("...")), " ".join(printed.split())) is not None
    )


@pytest.mark.parametrize("page", [pytest.param(page, id=str(page.relative_to(ROOT))) for page in PAGES])
def test_the_python_of_the_page_runs_as_written(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of one page share their names, as a reader who types them in would; ``>>>`` must print what it says."""
    monkeypatch.chdir(tmp_path)
    module = ModuleType(f"page_{page.stem}")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    for above, code, output in blocks(page.read_text(encoding="utf-8")):
        if code.lstrip().startswith(">>>"):
            example = doctest.DocTestParser().get_doctest(code, module.__dict__, page.name, str(page), above)
            report: list[str] = []
            doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example, out=report.append, clear_globs=False)
            assert not report, "".join(report)
            module.__dict__.update(example.globs)
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):  # the empty lines put the right number on each line of a traceback
            exec(compile("\n" * above + code, page, "exec"), module.__dict__)
        if output is not None:
            assert is_said(printed.getvalue(), output), f"{page.name}, line {above}: printed\n{printed.getvalue()}"


def test_what_a_page_says_is_printed_is_compared() -> None:
    page = '```python\nprint("a", 1.5)\n```\n\n```text\na\n1...\n```\n\n```python\nb\n```\n\nText.\n\n```text\nc\n```\n'
    assert [(above, output) for above, _, output in blocks(page)] == [(1, "a\n1...\n"), (10, None)]
    assert is_said("a 1.5\n", "a\n1...\n") and not is_said("a 2.5\n", "a\n1...\n") and not is_said("", "a")


def test_a_law_that_runs_compiled_takes_seven_lines() -> None:
    """Non-blank lines of the file at the top of the page on fast laws, docstrings and comments apart."""
    page = (ROOT / "docs" / "fast_laws.md").read_text(encoding="utf-8")
    _, code, _ = next(blocks(page))
    tree = ast.parse(code)
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            del node.body[0]
    lines = {
        line for node in ast.walk(tree) if isinstance(node, ast.stmt) for line in (node.lineno, node.end_lineno or 0)
    }
    written = [line for number, line in enumerate(code.splitlines(), 1) if number in lines]
    assert "class Drag" in "\n".join(written) and len(written) <= 7, written
