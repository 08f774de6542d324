"""Parsing while other threads parse."""

from __future__ import annotations

import ast
import threading

import pytest

from xpheve.compile import parsing


def test_many_threads_parse_at_once() -> None:
    text = "\n".join(f"x{k} = ((({k} + 1) * 2) ** 3, [a for a in (b, c)])" for k in range(300))
    wrong: list[BaseException] = []

    def work() -> None:
        try:
            for _ in range(10):
                assert len(parsing.parse(text).body) == 300
        except BaseException as error:
            wrong.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_a_parse_that_another_thread_spoilt_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    real, calls = ast.parse, []

    def spoilt(text: str, name: str) -> ast.Module:
        calls.append(text)
        if len(calls) < 3:
            raise SystemError("AST constructor recursion depth mismatch (before=60, after=63)")
        return real(text, name)

    monkeypatch.setattr(parsing.ast, "parse", spoilt)
    assert len(parsing.parse("x = 1").body) == 1 and len(calls) == 3


def test_what_is_no_python_is_told_as_ever() -> None:
    with pytest.raises(SyntaxError):
        parsing.parse("x = = 1")
