"""The same text gives the same kernel; its code comes from memory, from disk, or from the compiler, with the same bits."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from xpheve.compile import assemble, compiled, facts, interpreted, machine
from xpheve.errors import CompileError

BODY = """
def entry(f, n):
    x = f[0]
    for i in range(n[0][0]):
        x[i] = ieee__divide(ieee__exp(x[i]), ieee__sqrt(x[i])) + ieee__power(x[i], 0.7)
    return 4
"""
SCRIPT = f"""
import sys
import numpy as np
from xpheve.compile import assemble, compiled
x = np.random.default_rng(2).uniform(0.0, 30.0, 1000)
kernel = compiled(assemble({BODY!r}), "a test")
assert kernel([x], [np.array([1000])]) == 4
print(kernel.origin, x.tobytes().hex(), "numba" in sys.modules)
"""


def bits(kernel: object) -> str:
    x = np.random.default_rng(2).uniform(0.0, 30.0, 1000)
    assert kernel([x], [np.array([1000])]) == 4  # type: ignore[operator]
    return x.tobytes().hex()


def test_interpreted_compiled_kept_and_in_another_process_the_bits_are_the_same(
    forget: Callable[[], None], process: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    text = assemble(BODY)
    want = bits(interpreted(text))
    cold = compiled(text, "a test")
    assert cold.origin == "compiled" and bits(cold) == want
    forget()
    warm = compiled(text, "a test")
    assert (warm.origin, warm.key, warm.path) == ("cache", cold.key, cold.path) and bits(warm) == want
    origin, other, numba = process(SCRIPT).stdout.split()
    assert (origin, other, numba) == ("cache", want, "False")


def test_the_same_text_is_the_same_kernel() -> None:
    text = assemble(BODY)
    assert compiled(text, "one") is compiled(text, "other")
    assert interpreted(text) is interpreted(text)
    assert compiled(text) is not interpreted(text)


def test_what_was_made_is_told() -> None:
    text = assemble(BODY)
    slow, fast = interpreted(text, "a law"), compiled(text, "two laws")
    found = facts()
    assert [(fact["what"], fact["origin"]) for fact in found] == [("a law", "interpreted"), ("two laws", "compiled")]
    assert [fact["key"] for fact in found] == [slow.key, fast.key]
    assert found[1]["seconds"] == fast.seconds > 0.0
    assert found[1]["path"] == fast.path and Path(fast.path).is_file()


def test_text_that_is_no_python_or_has_no_entry_is_refused() -> None:
    with pytest.raises(CompileError, match="line 2 of the generated text"):
        interpreted("def entry(f, n):\n    return +\n")
    with pytest.raises(CompileError, match="defines no entry"):
        interpreted("def start(f, n):\n    return 1\n")
    with pytest.raises(CompileError, match="defines no entry"):
        compiled("def start(f, n):\n    return 1\n")
    with pytest.raises(CompileError, match="line 2 of the generated text"):
        compiled("def entry(f, n):\n    return +\n")


def test_code_that_needs_numbas_runtime_runs_where_it_was_made_and_is_not_kept(cache: Path) -> None:
    loop = "    for i in range(n[0][0]):\n        many.append(i * 1.0)\n"
    text = f"def entry(f, n):\n    many = [1.5, 2.5]\n{loop}    f[0][0] = sum(many)\n    return 5\n"
    kernel, x = compiled(text), np.zeros(1)
    assert kernel.origin == "memory" and kernel.path == ""
    assert kernel([x], [np.array([4])]) == 5 and x[0] == 10.0
    assert not list(cache.glob("*.kernel"))


def test_without_numba_the_error_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    machine._numba.cache_clear()
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(CompileError, match=r"numba cannot be imported .* install it, or run with compile='never'"):
        compiled(assemble(BODY), "a law")


def test_importing_xpheve_imports_no_compiler(process: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    said = process(
        "import sys, xpheve\nprint([n for n in ('xpheve.compile', 'numba', 'llvmlite') if n in sys.modules])"
    ).stdout
    assert said == "[]\n"
    said = process(
        "import sys\nfrom xpheve.compile import assemble, interpreted\n"
        f"interpreted(assemble({BODY!r}))\nprint([n for n in ('numba', 'llvmlite') if n in sys.modules])"
    ).stdout
    assert said == "[]\n"


KERNEL_FILE = """
import math
from xpheve.kernels.ieee import divide, exp

def half(x):
    return divide(x, 2.0)

A, B = math.sqrt(2.0), half(math.exp(1.0)) ** 2.5
TABLE = (half(1.0), B, exp(0.3))

def f(x):
    return (A * x + TABLE[1]) * exp(x) + half(TABLE[0] + TABLE[2])
"""


def test_constants_of_a_kernel_file_may_be_computed_with_its_functions(tmp_path: Path) -> None:
    path = tmp_path / "lift.py"
    path.write_text(KERNEL_FILE)
    body = "def entry(f, n):\n    x = f[0]\n    for i in range(n[0][0]):\n        x[i] = lift__f(x[i])\n    return 4\n"
    text = assemble(body, {"lift": str(path)})
    assert bits(compiled(text)) == bits(interpreted(text))


def test_a_constant_that_cannot_be_computed_is_named(tmp_path: Path) -> None:
    path = tmp_path / "lift.py"
    path.write_text("K = 1.0 / 0.0\n\ndef f(x):\n    return K * x\n")
    text = assemble("def entry(f, n):\n    return int(lift__f(1.0))\n", {"lift": str(path)})
    for make in (interpreted, compiled):
        with pytest.raises(CompileError, match=r"a lift: a constant of its kernel file .*ZeroDivisionError"):
            make(text, "a lift")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_fork_in_the_midst_of_a_compilation_does_not_hang_the_child() -> None:
    script = f"""
import os, signal, threading
from xpheve.compile import assemble, compiled, interpreted, on_compile
compiling, forked = threading.Event(), threading.Event()
def watch(what, seconds):
    compiling.set()
    forked.wait(60.0)
on_compile(watch)
thread = threading.Thread(target=compiled, args=(assemble({BODY!r}), "a test"))
thread.start()
compiling.wait(60.0)
child = os.fork()
if child == 0:
    signal.alarm(20)
    interpreted(assemble({BODY!r}))
    os._exit(0)
status = os.waitpid(child, 0)[1]
forked.set()
thread.join()
print(status)
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", script], capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == "0", done.stdout + done.stderr
