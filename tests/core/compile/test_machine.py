"""Compiled and interpreted text have the same bits, at any value; what cannot be sure of that is refused."""

from __future__ import annotations

import gc
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from xpheve.compile import assemble, compiled, interpreted, loader
from xpheve.compile.loader import LIBM, machine, missing_symbols
from xpheve.compile.machine import HELPERS, lowered, machine_code
from xpheve.errors import CompileError
from xpheve.trace.emit import SCALAR

Floats = NDArray[np.float64]
SPECIAL = [0.0, -0.0, math.inf, -math.inf, math.nan, 5e-324, -5e-324, 1e-310, 2.2e-308, 1.0, -1.0, 0.5, -0.5, 1.5, -1.5, 2.0, -2.0, 3.0, -3.0,
           1e15 + 0.5, 4503599627370497.0, -4503599627370495.5, 710.0, -746.0, 1e22, 1e308, -1e308]  # fmt: skip
PAIRS = {
    "ieee__divide",
    "ieee__power",
    "ieee__hypot",
    "ieee__minimum",
    "ieee__maximum",
    "math.atan2",
    "math.fmod",
    "math.pow",
}


def same(a: Floats, b: Floats) -> bool:
    """Equal to the bit, signs of zero included; one NaN is as good as another."""
    return bool(np.all((a.view(np.int64) == b.view(np.int64)) | (np.isnan(a) & np.isnan(b))))


def values(count: int) -> tuple[Floats, Floats]:
    """Pairs of all special values, and random ones of all sizes."""
    rng = np.random.default_rng(7)
    bits = rng.integers(-(2**63), 2**63 - 1, count).view(np.float64)
    near = rng.uniform(-3.0, 3.0, count)
    wide = rng.uniform(-1.0, 1.0, count) * 10.0 ** rng.uniform(-12, 12, count)
    powers = rng.integers(-20, 20, count).astype(float)
    a, b = np.meshgrid(SPECIAL, SPECIAL)
    x = np.concatenate([a.ravel(), bits, near, wide, np.abs(near), wide])
    y = np.concatenate([b.ravel(), np.roll(bits, 1), np.roll(near, 1), np.roll(wide, 1), wide, powers])
    return x, y


def both(text: str, floats: list[Floats], ints: list[NDArray[np.int64]]) -> tuple[list[Floats], list[Floats]]:
    """The buffers after the interpreted and after the compiled run."""
    slow, fast = [x.copy() for x in floats], [x.copy() for x in floats]
    assert interpreted(text)(slow, ints) == compiled(text)(fast, ints)
    return slow, fast


def test_every_function_of_the_scalar_text_has_the_same_bits_compiled() -> None:
    names = [name for name in SCALAR.values() if name != "abs"]
    calls = [f"{name}(x, y)" if name in PAIRS else f"{name}(x)" for name in names] + ["abs(x)", "-x"]
    lines = [f"        o{k} = f[{k + 2}]\n        o{k}[i] = {call}" for k, call in enumerate(calls)]
    body = "def entry(f, n):\n    a = f[0]\n    b = f[1]\n    m = n[0][0]\n    for i in range(m):\n        x = a[i]\n        y = b[i]\n"
    text = assemble(body + "\n".join(lines) + "\n    return m\n")
    x, y = values(4000)
    slow, fast = both(text, [x, y, *(np.zeros(len(x)) for _ in calls)], [np.array([len(x)])])
    for call, a, b in zip(calls, slow[2:], fast[2:], strict=True):
        assert same(a, b), call


def some_text(seed: int, lines: int = 60) -> str:
    """Straight-line text of operations drawn at random, each on results of earlier ones."""
    rng = np.random.default_rng(seed)
    names = ["x", "y", "0.5", "3.0", "(-1.0)"]
    body = []
    for k in range(lines):
        a, b, c = (names[int(i)] for i in rng.integers(0, len(names), 3))
        op = str(rng.choice(["+", "-", "*", "where", *SCALAR.values()]))
        if op in ("+", "-", "*"):
            text = f"{a} {op} {b}"
        elif op == "where":
            text = f"{a} if {b} < {c} else {c}"
        else:
            text = f"{op}({a}, {b})" if op in PAIRS else f"{op}({a})"
        body.append(f"        t{k} = {text}")
        names.append(f"t{k}")
        if rng.random() < 0.5:  # back to where numbers are of a size
            body[-1] += f"\n        t{k} = t{k} if abs(t{k}) < 100.0 else x"
    head = "def entry(f, n):\n    a = f[0]\n    b = f[1]\n    for i in range(n[0][0]):\n        x = a[i]\n        y = b[i]\n"
    tail = "".join(f"\n        o{k} = f[{k + 2}]\n        o{k}[i] = t{7 * k + 10}" for k in range(8))
    return assemble(head + "\n".join(body) + tail + "\n    return 0\n")


@pytest.mark.parametrize("seed", range(4))
def test_any_text_of_the_scalar_kind_has_the_same_bits_compiled(seed: int) -> None:
    x, y = values(300)
    slow, fast = both(some_text(seed), [x, y, *(np.zeros(len(x)) for _ in range(8))], [np.array([len(x)])])
    assert all(same(a, b) for a, b in zip(slow, fast, strict=True))
    assert sum(len(np.unique(out)) > 50 for out in slow[2:]) >= 2


def test_functions_of_math_have_the_same_bits_where_python_does_not_raise() -> None:
    x, y = values(2000)
    calls, buffers, keep = [], [], []
    for name in [*LIBM, "sqrt", "copysign", "fabs"]:
        pair = name in ("atan2", "fmod", "pow", "copysign")
        good = np.array([_answers(name, a, b, pair) for a, b in zip(x, y, strict=True)])
        keep.append(good)
        calls.append(f"math.{name}(x, y)" if pair else f"math.{name}(x)")
        buffers.append(good.astype(float))
    lines = [
        f"        o{k} = f[{k + 2}]\n        if o{k}[i] == 1.0:\n            o{k}[i] = {call}"
        for k, call in enumerate(calls)
    ]
    body = "def entry(f, n):\n    a = f[0]\n    b = f[1]\n    for i in range(n[0][0]):\n        x = a[i]\n        y = b[i]\n"
    slow, fast = both(assemble(body + "\n".join(lines) + "\n    return 0\n"), [x, y, *buffers], [np.array([len(x)])])
    for call, good, a, b in zip(calls, keep, slow[2:], fast[2:], strict=True):
        assert good.sum() > 500, call
        assert same(a, b), call


def _answers(name: str, a: float, b: float, pair: bool) -> bool:
    try:
        getattr(math, name)(*((float(a), float(b)) if pair else (float(a),)))
    except (ValueError, OverflowError):
        return False
    return True


def test_powers_lesser_and_greater_of_python_have_the_same_bits() -> None:
    calls = [
        "abs(x) ** 1.7",
        "x ** 2",
        "min(x, y)",
        "max(x, y)",
        "min(x, y, 0.0)",
        "max(-0.0, x, y, 1.0)",
        "2.0 ** min(max(y, -9.0), 9.0)",
    ]
    lines = [f"        o{k} = f[{k + 2}]\n        o{k}[i] = {call}" for k, call in enumerate(calls)]
    body = "def entry(f, n):\n    a = f[0]\n    b = f[1]\n    for i in range(n[0][0]):\n        x = a[i]\n        y = b[i]\n"
    x, y = values(2000)
    few = np.abs(np.nan_to_num(x, nan=math.nan)) < 1e150  # beyond, Python's ** raises
    x, y = np.where(few | np.isnan(x), x, 1.0), y
    slow, fast = both(
        assemble(body + "\n".join(lines) + "\n    return 0\n"),
        [x, y, *(np.zeros(len(x)) for _ in calls)],
        [np.array([len(x)])],
    )
    for call, a, b in zip(calls, slow[2:], fast[2:], strict=True):
        assert same(a, b), call


def test_halves_of_floats_have_the_same_bits() -> None:
    text = assemble(
        "def entry(f, n):\n    a = f[0]\n    for i in range(n[0][0]):\n        part, power = math.frexp(a[i])\n"
        "        f[1][i] = part\n        n[1][i] = power\n        f[2][i] = math.ldexp(part, max(-1100, min(1000, power - 60)))\n    return 0\n"
    )
    x = values(2000)[0]
    x = x[np.isfinite(x)]
    powers = [np.zeros(len(x), np.int64), np.zeros(len(x), np.int64)]
    results = []
    for kernel, power in zip((interpreted(text), compiled(text)), powers, strict=True):
        part, scaled = np.zeros(len(x)), np.zeros(len(x))
        kernel([x, part, scaled], [np.array([len(x)]), power])
        results.append((part, scaled))
    assert powers[0].tolist() == powers[1].tolist()
    assert all(same(a, b) for a, b in zip(*results, strict=True))


def test_turning_a_body_has_the_same_bits_compiled() -> None:
    text = assemble(
        "def entry(f, n):\n    a = f[0]\n    b = f[1]\n    for k in range(n[0][0]):\n        i = 14 * k\n"
        "        q, w = flight__turn_split((a[i], a[i + 1], a[i + 2], a[i + 3]), (a[i + 4], a[i + 5], a[i + 6]),\n"
        "            (a[i + 7], a[i + 8], a[i + 9]), (a[i + 10], a[i + 11], a[i + 12]), a[i + 13])\n"
        "        j = 7 * k\n        b[j] = q[0]\n        b[j + 1] = q[1]\n        b[j + 2] = q[2]\n        b[j + 3] = q[3]\n"
        "        b[j + 4] = w[0]\n        b[j + 5] = w[1]\n        b[j + 6] = w[2]\n    return 0\n"
    )
    rng = np.random.default_rng(5)
    a = rng.uniform(0.2, 1.8, (600, 14))
    a[::7, 7:10] = a[::7, 7:8]  # a sphere
    a[1::7, 8] = a[1::7, 7]  # symmetric
    a[2::7, 4:6] = 0.0
    a[3::7, 10:13] = 0.0
    slow, fast = both(text, [a.ravel(), np.zeros(600 * 7)], [np.array([600])])
    assert same(slow[1], fast[1]) and np.isfinite(fast[1]).all()


def test_division_by_zero_is_infinite_and_needs_nothing_of_python() -> None:
    text = assemble(
        "def entry(f, n):\n    a = f[0]\n    a[1] = ieee__divide(a[0], 0.0)\n    a[2] = ieee__divide(0.0, a[3])\n    return 0\n"
    )
    a = np.array([-2.0, 0.0, 0.0, 0.0])
    compiled(text)([a], [])
    assert a[1] == -math.inf and math.isnan(a[2])
    assert missing_symbols(machine_code(text, "x").code) == set()


def test_helpers_are_the_machines_operations() -> None:
    text = lowered(
        assemble("def entry(f, n):\n    x = f[0][0]\n    return ieee__divide(ieee__sqrt(x), ieee__minimum(x, 2.0))\n")
    )
    assert "machine__sqrt(x) / machine__minimum(x, 2.0)" in text
    assert "def ieee__divide" not in text and "def ieee__sqrt" not in text
    assert set(HELPERS) < set(SCALAR.values())


@pytest.mark.parametrize(
    "line", ["math.gamma(2.0)", "math.hypot(3.0, 4.0)", "math.fsum(f[0])", "math.log(2.0) + math.lgamma(1.0)"]
)
def test_what_would_round_otherwise_is_refused(line: str) -> None:
    with pytest.raises(CompileError, match=r"same bits.*xpheve\.kernels\.ieee"):
        compiled(f"import math\ndef entry(f, n):\n    f[0][0] = {line}\n    return 0\n")


def test_the_least_of_a_tuple_is_refused_with_the_way_out() -> None:
    with pytest.raises(CompileError, match=r"max\(v\).*write them out"):
        compiled("def entry(f, n):\n    v = (1.0, 2.0)\n    f[0][0] = max(v)\n    return 0\n")


def test_text_that_numba_cannot_type_is_an_error_that_names_it() -> None:
    with pytest.raises(CompileError, match=r"^gravity: the generated text cannot be compiled: "):
        compiled("def entry(f, n):\n    f[0][0] = 'word'\n    return 0\n", "gravity")


@pytest.mark.parametrize("make", [interpreted, compiled])
def test_an_error_in_the_text_reaches_the_caller(make: object) -> None:
    text = "def entry(f, n):\n    v = (1.0, 2.0, 3.0)\n    f[0][0] = v[n[0][0]]\n    return 0\n"
    kernel = make(text)  # type: ignore[operator]
    assert kernel([np.zeros(1)], [np.array([2])]) == 0
    with pytest.raises(IndexError):
        kernel([np.zeros(1)], [np.array([7])])
    assert kernel([np.zeros(1)], [np.array([0])]) == 0


def test_the_machine_is_named_by_what_compiled_code_depends_on() -> None:
    assert {"numba", "llvmlite", "platform", "processor", "features", "lowering"} <= machine().keys()


def test_code_that_another_lowering_made_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loader, "__file__", str(tmp_path / "loader.py"))
    source = tmp_path / "machine.py"
    found = [loader._lowering()]
    for text in ("one = 1\n", "one = 2\n"):
        source.write_text(text)
        found.append(loader._lowering())
    assert found[0] == "" and len(set(found)) == 3


def test_functions_that_many_call_are_linked_once_with_all_that_they_need() -> None:
    text = """
def whole(x):
    return int(x) + 1

def left(x):
    return whole(x) * 2.0

def right(x):
    return whole(x) + left(x)

def entry(f, n):
    f[0][0] = right(f[0][0]) + left(f[0][1]) + whole(f[0][2])
    return int(f[0][0])
"""
    assert missing_symbols(machine_code(text, "parts").code) == set()
    slow, fast = both(text, [np.array([2.5, 7.25, 1.0])], [])
    assert same(slow[0], fast[0])


def test_garbage_is_looked_for_again_after_compiling_even_what_cannot_be() -> None:
    machine_code("def entry(f, n):\n    return 5\n", "a number")
    assert gc.isenabled()
    with pytest.raises(CompileError):
        machine_code("def entry(f, n):\n    return f + n\n", "nonsense")
    assert gc.isenabled()
