"""Whoever waits for a compiler is told so, once, on stderr; files and pipes stay clean."""

from __future__ import annotations

import io
import sys

import pytest

from xpheve.compile import compiled, on_compile
from xpheve.errors import CompileError

TEXT = "def entry(f, n):\n    return 11\n"


class Terminal(io.StringIO):
    """A stream somebody looks at."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_sees_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    compiled(TEXT, "gravity + drag")
    line = screen.getvalue()
    assert line.startswith("xpheve: compiling gravity + drag for the first time (kept for later runs) ... ")
    assert line.endswith(" s\n") and line.count("\n") == 1
    compiled(TEXT, "gravity + drag")
    assert screen.getvalue() == line


def test_a_file_sees_nothing_unless_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    compiled(TEXT, "gravity")
    assert capsys.readouterr().err == ""
    monkeypatch.setenv("XPHEVE_PROGRESS", "1")
    compiled(TEXT.replace("11", "12"), "wind")
    assert "compiling wind for the first time" in capsys.readouterr().err
    monkeypatch.setenv("XPHEVE_PROGRESS", "0")
    compiled(TEXT.replace("11", "13"), "wind")
    assert capsys.readouterr().err == ""


def test_a_process_without_stderr_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    assert compiled(TEXT)([], []) == 11
    monkeypatch.setenv("XPHEVE_PROGRESS", "1")
    assert compiled(TEXT.replace("11", "12"))([], []) == 12


def test_a_watcher_is_called_instead_at_the_beginning_and_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    seen: list[tuple[str, float | None]] = []
    remove = on_compile(lambda what, seconds: seen.append((what, seconds)))
    try:
        compiled(TEXT, "gravity")
        with pytest.raises(CompileError):
            compiled("def entry(f, n):\n    return 'word'\n", "nonsense")
    finally:
        remove()
        remove()
    assert [what for what, _ in seen] == ["gravity", "gravity", "nonsense", "nonsense"]
    assert [seconds is None for _, seconds in seen] == [True, False, True, False]
    assert screen.getvalue() == ""
    compiled(TEXT.replace("11", "12"), "drag")
    assert "compiling drag" in screen.getvalue() and len(seen) == 4
