"""Kernel files into one text: only what is used, in an order that never changes, under names that cannot clash."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from xpheve.compile import assemble, interpreted
from xpheve.errors import CompileError
from xpheve.kernels import flight

BODY = """
def entry(f, n):
    a = f[0]
    q, w = flight__turn_split(
        (a[0], a[1], a[2], a[3]), (a[4], a[5], a[6]), (a[7], a[8], a[9]), (a[10], a[11], a[12]), a[13]
    )
    b = f[1]
    b[0] = q[0]
    b[1] = q[1]
    b[2] = q[2]
    b[3] = q[3]
    b[4] = w[0]
    b[5] = w[1]
    b[6] = w[2]
    return 0
"""


def pack_file(folder: Path, text: str, name: str = "lift.py") -> dict[str, str]:
    path = folder / name
    path.write_text(text)
    return {name.removesuffix(".py"): str(path)}


def run(body: str, files: dict[str, str], *numbers: float) -> float:
    """What ``entry`` puts into the first place of the last buffer."""
    out = np.zeros(1)
    interpreted(assemble(body, files))([np.array(numbers), out], [])
    return float(out[0])


def test_only_what_is_used_is_put_in() -> None:
    text = assemble("def entry(f, n):\n    f[0][0] = ieee__divide(f[0][1], 2.0)\n    return 0\n")
    assert "def ieee__divide(a, b):" in text
    assert "ieee__sqrt" not in text and "WHOLE" not in text


def test_annotations_and_docstrings_stay_behind() -> None:
    text = assemble("def entry(f, n):\n    return vector__add((1.0, 2.0, 3.0), (1.0, 2.0, 3.0))\n")
    assert "def vector__add(a, b):" in text
    assert "Vec" not in text and '"""' not in text


def test_functions_and_constants_of_other_files_come_along() -> None:
    text = assemble(BODY)
    for name in ("def flight__turn_split", "def quaternion__multiply", "def vector__cross", "elliptic__HALF_PI = "):
        assert text.count(name) == 1
    assert text.index("elliptic__HALF_PI = ") < text.index("free_rotation__FOUR_PI = ") < text.index("def entry")


def test_a_constant_of_several_names_is_put_in_once(tmp_path: Path) -> None:
    files = pack_file(
        tmp_path, "A, B = 2.0, 3.0\nC: float = A + B\n\ndef f(x: float) -> float:\n    return x * A * B * C\n"
    )
    text = assemble("def entry(f, n):\n    f[1][0] = lift__f(f[0][0])\n    return 0\n", files)
    assert text.count("lift__A") == 3
    assert run("def entry(f, n):\n    f[1][0] = lift__f(f[0][0])\n    return 0\n", files, 1.0) == 30.0


def test_turning_through_the_text_has_the_bits_of_the_kernel_file() -> None:
    rng = np.random.default_rng(4)
    kernel = interpreted(assemble(BODY))
    for _ in range(50):
        a, b = rng.uniform(0.3, 1.7, 14), np.zeros(7)
        kernel([a, b], [])
        x = a.tolist()
        q, w = flight.turn_split(
            (x[0], x[1], x[2], x[3]), (x[4], x[5], x[6]), (x[7], x[8], x[9]), (x[10], x[11], x[12]), x[13]
        )
        assert b.tolist() == [*q, *w]


def test_a_local_name_is_not_that_of_the_file(tmp_path: Path) -> None:
    files = pack_file(tmp_path, "k = 2.0\n\ndef g(x):\n    return x + k\n\ndef f(g):\n    k = 5.0\n    return g * k\n")
    assert run("def entry(f, n):\n    f[1][0] = lift__f(f[0][0])\n    return 0\n", files, 3.0) == 15.0
    assert "lift__g" not in assemble("def entry(f, n):\n    return lift__f(1.0)\n", files)


def test_functions_that_call_each_other(tmp_path: Path) -> None:
    files = pack_file(
        tmp_path,
        "def even(n):\n    return 1.0 if n == 0.0 else odd(n - 1.0)\n\ndef odd(n):\n    return 0.0 if n == 0.0 else even(n - 1.0)\n",
    )
    assert run("def entry(f, n):\n    f[1][0] = lift__even(f[0][0])\n    return 0\n", files, 4.0) == 1.0


def test_a_pack_may_import_math_and_kernels(tmp_path: Path) -> None:
    files = pack_file(
        tmp_path,
        '"""Lift."""\nfrom __future__ import annotations\nimport math\nfrom xpheve.kernels.vector import norm as size\n'
        "from xpheve.kernels.ieee import divide\n\ndef f(x):\n    return divide(size((x, 0.0, math.pi)), 0.0)\n",
    )
    assert run("def entry(f, n):\n    f[1][0] = lift__f(f[0][0])\n    return 0\n", files, 4.0) == math.inf


def test_kernel_files_of_a_pack_import_each_other_if_all_are_named(tmp_path: Path) -> None:
    files = pack_file(tmp_path, "TWO = 2.0\ndef twice(x):\n    return TWO * x\n", "basis.py")
    files |= pack_file(tmp_path, "from some_pack.shapes.basis import twice\ndef up(x):\n    return twice(x) + 1.0\n")
    body = "def entry(f, n):\n    f[0][0] = lift__up(f[0][0])\n    return 0\n"
    given = np.array([3.0])
    assert interpreted(assemble(body, files))([given], [np.zeros(1, dtype=np.int64)]) == 0 and given[0] == 7.0
    with pytest.raises(CompileError, match="named with it"):
        assemble(body, {"lift": files["lift"]})


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("import math\nimport numpy as np\n\ndef f(x):\n    return np.sin(x)\n", 2, "numpy"),
        ("import math as m\n\ndef f(x):\n    return x\n", 1, "math"),
        ("from . import other\n\ndef f(x):\n    return x\n", 1, "'.'"),
        ("from xpheve.kernels.nowhere import g\n\ndef f(x):\n    return g(x)\n", 4, "xpheve.kernels.nowhere"),
        ("def f(x):\n    return x * undefined\n", 2, "undefined"),
        ("@cache\ndef f(x):\n    return x\n", 2, "decorator"),
        ("def f(x):\n    return (lambda y: y)(x)\n", 2, "lambda"),
        ("def f(x):\n    global k\n    return x\n", 2, "global"),
        ("def f(*x):\n    return x\n", 1, "plain ones"),
        ("print('hello')\n\ndef f(x):\n    return x\n", 1, "move this statement"),
        ("def f(x:\n    return x\n", 1, "not Python"),
    ],
)
def test_what_a_kernel_file_may_not_do_is_named_with_its_line(tmp_path: Path, text: str, line: int, says: str) -> None:
    files = pack_file(tmp_path, text)
    with pytest.raises(CompileError) as caught:
        assemble("def entry(f, n):\n    return lift__f(1.0)\n", files)
    assert f"lift.py:{line}:" in str(caught.value)
    assert says in str(caught.value)


def test_a_function_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    files = pack_file(tmp_path, "def f(x):\n    return x\n")
    with pytest.raises(CompileError, match=r"lift__nosuch.*it has f$"):
        assemble("def entry(f, n):\n    return lift__nosuch(1.0)\n", files)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(CompileError, match=r"gone\.py: it cannot be read"):
        assemble("def entry(f, n):\n    return lift__f(1.0)\n", {"lift": str(tmp_path / "gone.py")})


@pytest.mark.parametrize("name", ["vector", "two words", "a__b"])
def test_a_name_that_is_taken_or_no_name_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(CompileError, match="name"):
        assemble("def entry(f, n):\n    return 0\n", {name: str(tmp_path / "x.py")})


def test_names_of_the_text_itself_are_left_alone() -> None:
    body = "def law__drag(x):\n    return x\n\ndef entry(f, n):\n    return law__drag(1)"
    assert assemble(body).endswith(body + "\n")


def test_every_process_makes_the_same_text(process: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    script = f"from xpheve.compile import assemble\nprint(assemble({BODY!r}), end='')"
    texts = {process(script, PYTHONHASHSEED=seed).stdout for seed in ("1", "2")}
    assert texts == {assemble(BODY)}


def test_kernel_files_of_a_pack_may_call_what_the_text_defines(tmp_path: Path) -> None:
    (tmp_path / "asker.py").write_text(
        "from __future__ import annotations\nfrom typing import Any\nfrom pack.declared import answer\n\n"
        "def ask(f: Any) -> float:\n    return 2.0 * answer(f)\n"
    )
    files = {"asker": str(tmp_path / "asker.py")}
    body = "def answer(f):\n    return f[0][0]\n\ndef entry(f, n):\n    f[0][1] = asker__ask(f)\n    return 0\n"
    numbers = np.array([3.0, 0.0])
    interpreted(assemble(body, files, declared=("answer",)))([numbers], [])
    assert numbers[1] == 6.0
    with pytest.raises(CompileError, match=r"pack\.declared"):
        assemble(body, files)


def test_what_typing_gives_is_for_annotations_only(tmp_path: Path) -> None:
    (tmp_path / "caster.py").write_text("from typing import cast\n\ndef f(x):\n    return cast(float, x)\n")
    with pytest.raises(CompileError, match="cast"):
        assemble("def entry(f, n):\n    return caster__f(1.0)\n", {"caster": str(tmp_path / "caster.py")})
