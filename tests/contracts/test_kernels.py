"""Every kernel file, and every law of the shipped packs, has the same bits interpreted and compiled, function by function."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xpheve as xp
import xpheve.kernels
import xpheve_laws_basic as basic
import xpheve_laws_collision as collision
from xpheve.compile import assemble, compiled, interpreted
from xpheve.trace.check import Functions, Trial
from xpheve.trace.emit import Writer
from xpheve.trace.graph import Node, walk
from xpheve.trace.law_trace import LawTrace
from xpheve.trace.recorder import trace_law
from xpheve.trace.samples import parameters_of

FOLDER = Path(xpheve.kernels.__file__).parent
NEVER_COMPILED = {"principal_axes", "sign_changes"}
"""For preparing scenes and for handlers: they return lists, or search among permutations."""
ELSEWHERE = {"neighbours", "dense", "tree", "course"}
"""They read or write buffers of their own: tests in `tests/core/kernels` compare them, and `tests/core/plan/test_courses.py`."""
ALONE = {"__init__", "response"}
"""No functions."""

NUMBER, WHOLE = "x", "i"
SHAPES: dict[str, str] = {
    "float": "x",
    "int": "i",
    "Vec": "(x, x, x)",
    "Quat": "(x, x, x, x)",
    "Pair": "(x, x)",
    "Instant": "(x, x)",
    "Pairs": "((x, x), (x, x), (x, x))",
    "Complex": "(x, x)",
    "Wide": "((x, x), (x, x))",
    "tuple[Wide, Wide, Wide, Wide, Wide, Wide]": "(" + ", ".join(["((x, x), (x, x))"] * 6) + ")",
    "Constants": "(" + ", ".join("x" * 35) + ")",
    "Orbit": "(" + ", ".join("x" * 35) + ")",
    "Eleven": "(" + ", ".join("x" * 11) + ")",
    "tuple[float, float, float, float, float]": "(x, x, x, x, x)",
    "Buffer": "f[1]",
}
"""How an argument is made of numbers ``x`` and whole numbers ``i``, by its annotation."""
RESULTS: dict[str, str] = {
    "bool": "b",
    "tuple[float, float]": "(x, x)",
    "tuple[float, float, float]": "(x, x, x)",
    "tuple[int, int, int]": "(x, x, x)",
    "tuple[float, float, float, float]": "(x, x, x, x)",
    "tuple[float, float, float, float, float, float, float]": "(x, x, x, x, x, x, x)",
    "tuple[Vec, Vec, Vec]": "((x, x, x), (x, x, x), (x, x, x))",
    "tuple[Pair, Pair, Pair, Pair]": "((x, x), (x, x), (x, x), (x, x))",
    "tuple[Complex, Complex, Complex]": "((x, x), (x, x), (x, x))",
    "tuple[Quat, Vec]": "((x, x, x, x), (x, x, x))",
    **SHAPES,
}


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache of compiled code that no other run has filled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XPHEVE_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


Draw = Callable[[np.random.Generator], float]


def usual(rng: np.random.Generator) -> float:
    """Numbers of all signs and of a few sizes, often equal to one another, often 0."""
    kind = rng.integers(6)
    if kind == 0:
        return float(rng.choice([0.0, 1.0, -1.0, 0.5, 2.0]))
    return float(rng.normal() * (10.0 ** rng.integers(-3, 4) if kind == 1 else 1.0))


def share(rng: np.random.Generator) -> float:
    """A number in [0, 1]."""
    return float(rng.choice([0.0, 1.0, 1e-12])) if rng.integers(8) == 0 else float(rng.uniform())


def above(rng: np.random.Generator) -> float:
    """A number above 0."""
    return float(rng.uniform(0.01, 3.0))


def third(rng: np.random.Generator) -> float:
    """A few moments, so that some are equal."""
    return float(rng.choice([1.0, 2.0, 2.5, rng.uniform(1.0, 3.0)]))


def axis(rng: np.random.Generator) -> float:
    """0, 1 or 2."""
    return float(rng.integers(3))


def own(rng: np.random.Generator) -> float:
    """An axis with its sign: +-1, +-2, +-3."""
    return float(rng.choice([-1.0, 1.0]) * rng.integers(1, 4))


DRAWS: dict[str, dict[str, Draw]] = {
    "elliptic": dict.fromkeys(["x", "y", "z", "p", "a", "g"], above)
    | dict.fromkeys(["m1", "s", "c", "d"], share)
    | {"n": axis, "u": lambda rng: float(rng.uniform(-1.5, 1.5)), "nu": above, "nu1": lambda rng: 1.0 + above(rng)},
    "free_rotation": {"inertia": third, "moments": third, "unit": above}
    | dict.fromkeys(["x", "y", "z"], share)
    | {
        "axis": axis,
        "place": own,
        "places": own,
        "low": lambda rng: 0.0,
        "middle": lambda rng: 1.0,
        "high": lambda rng: 2.0,
    },
    "flight": {"inertia": third},
    "spin": {"inertia": third},
    "kepler": dict.fromkeys(["x", "r", "mass", "one", "other", "a", "b", "zeta"], above)
    | {"k": lambda rng: float(rng.integers(-20, 20)), "z": share, "beta": lambda rng: float(rng.uniform(-2.0, 1.0))},
    "clock": {"k": lambda rng: float(rng.integers(0, 10**6))},
    "table": {"start": lambda rng: 0.0, "count": lambda rng: 4.0, "x": lambda rng: float(rng.uniform(-1.0, 5.0))},
}
"""What arguments are drawn from, by their names; what is not named is `usual`. Beyond these ranges some series would not end."""


class Function:
    """One function of a kernel file: how it is called with numbers of a row, and how many numbers it gives."""

    def __init__(self, file: str, node: ast.FunctionDef) -> None:
        self.name = f"{file}__{node.name}"
        given = DRAWS.get(file, {})
        self.names: list[str] = []
        self.draws: list[Draw] = []
        parts = []
        for argument in node.args.args:
            assert argument.annotation is not None
            text = ""
            for sign in SHAPES[ast.unparse(argument.annotation)]:
                if sign in "xi":
                    place = f"a[r + {len(self.draws)}]"
                    self.names.append(argument.arg)
                    self.draws.append(given.get(argument.arg, usual))
                    sign = place if sign == "x" else f"int({place})"
                text += sign
            parts.append(text)
        assert node.returns is not None
        self.result = RESULTS[ast.unparse(node.returns)]
        self.call = f"{self.name}({', '.join(parts)})"
        self.wide = sum(self.result.count(sign) for sign in "xib")

    def lines(self) -> list[str]:
        """The call, and each number of its result on its own place."""
        taken = iter(range(self.wide))
        found = [f"v = {self.call}"]

        def unpack(shape: ast.expr, value: str) -> None:
            if isinstance(shape, ast.Tuple):
                for k, part in enumerate(shape.elts):
                    unpack(part, f"{value}[{k}]")
            else:
                number = f"1.0 if {value} else 0.0" if self.result == "b" else f"float({value})"
                found.append(f"o[w + {next(taken)}] = {number}")

        unpack(ast.parse(self.result, mode="eval").body, "v")
        return found


def functions(file: str) -> list[Function]:
    """All functions of a kernel file."""
    tree = ast.parse((FOLDER / f"{file}.py").read_text(encoding="utf-8"))
    return [Function(file, node) for node in tree.body if isinstance(node, ast.FunctionDef)]


def text_of(every: list[Function]) -> str:
    """A text that calls function ``n[0][0]`` on rows ``n[0][1]`` to ``n[0][2]`` of arguments."""
    lines = ["def entry(f, n):", "    for row in range(n[0][1], n[0][2]):"]
    for k in range(len(every)):
        lines += [f"        if n[0][0] == {k}:", f"            call{k}(f, row * n[0][3], row * n[0][4])"]
    calls = []
    for k, one in enumerate(every):
        calls += [
            f"def call{k}(f, r, w):",
            "    a = f[0]",
            "    o = f[2]",
            *(f"    {line}" for line in one.lines()),
            "    return 0",
            "",
        ]
    return assemble("\n".join([*calls, *lines, "    return 1", ""]))


LONG = {"flight", "free_rotation", "kepler", "linear_mode"}
"""What takes some seconds to compile."""
FILES = sorted({path.stem for path in FOLDER.glob("*.py")} - ALONE - ELSEWHERE - NEVER_COMPILED)
ROWS = 200
TABLE = np.array([-9.0, 9.0, -0.5, 4.0, *(0.0, 0.0, 1.0, 2.5, 3.0), *np.random.default_rng(5).normal(size=20)])
"""A table of four points, held from -0.5 to 4."""


def arguments(file: str, every: list[Function], seed: int) -> np.ndarray:
    """Rows of arguments, for all functions of a file; the constants of a free rotation are those of one."""
    rng = np.random.default_rng(seed)
    found = np.zeros((len(every), ROWS, max(len(one.draws) for one in every)))
    for k, one in enumerate(every):
        found[k, :, : len(one.draws)] = [[draw(rng) for draw in one.draws] for _ in range(ROWS)]
        if {"low", "moments"} <= set(one.names):  # moments in rising order, no two of them equal
            found[k][:, [at for at, name in enumerate(one.names) if name == "moments"]] = np.sort(
                rng.uniform(1.0, 3.0, (ROWS, 3))
            )
        if file == "free_rotation" and len(one.draws) >= 35:
            from xpheve.kernels.free_rotation import prepare

            for row in found[k]:
                q, omega = rng.normal(size=4).tolist(), [usual(rng) for _ in range(3)]
                row[:35] = prepare(tuple(q), tuple(omega), tuple(third(rng) for _ in range(3)))  # type: ignore[arg-type]
        if file == "kepler" and one.names[:1] == ["orbit"]:
            from xpheve.kernels.kepler import prepare as through

            for row in found[k]:
                d, v = (tuple((usual(rng), 0.0) for _ in range(3)) for _ in range(2))
                row[:35] = through(d, v, (usual(rng), 0.0)) if any(one[0] for one in d) else row[:35]  # type: ignore[arg-type]
    return found


def same(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Where numbers are equal to the bit, signs of zero included; one NaN is as good as another."""
    return (a.view(np.int64) == b.view(np.int64)) | (np.isnan(a) & np.isnan(b))


@pytest.mark.parametrize("file", [pytest.param(one, marks=[pytest.mark.slow] * (one in LONG)) for one in FILES])
def test_every_function_of_a_kernel_file_has_the_same_bits_interpreted_and_compiled(file: str) -> None:
    every = functions(file)
    text = text_of(every)
    slow, fast = interpreted(text), compiled(text, f"the kernel file {file}")
    wide = max(one.wide for one in every)
    for k, (one, given) in enumerate(zip(every, arguments(file, every, 11), strict=True)):
        stride = given.shape[1]
        expected, found = np.full((ROWS, wide), np.nan), np.full((ROWS, wide), np.nan)
        floats = [given.ravel(), TABLE]
        answered = []
        for row in range(ROWS):
            try:
                slow([*floats, expected.ravel()], [np.array([k, row, row + 1, stride, wide])])
            except (ArithmeticError, ValueError):  # Python raises where the machine says infinite or no number
                continue
            answered.append(row)
        assert fast([*floats, found.ravel()], [np.array([k, 0, ROWS, stride, wide])]) == 1
        assert len(answered) > 0.25 * ROWS, one.name
        assert same(expected, found)[answered].all(), one.name
        assert not np.isnan(expected[answered, : one.wide]).all(), one.name


def test_no_kernel_file_is_forgotten() -> None:
    assert len(FILES) >= 10 and "free_rotation" in FILES
    assert all((FOLDER / f"{file}.py").is_file() for file in NEVER_COMPILED | ELSEWHERE)
    assert (Path(__file__).parents[1] / "core" / "kernels" / "test_neighbours.py").is_file()


# Laws


LAWS: list[Any] = [
    *(getattr(basic, name)() for name in basic.__all__),
    basic.Buoyancy(surface=1.0),
    basic.Thrust(thrust=(1.0, -2.0, 0.5), delay=1.0, duration=30.0),
    basic.RotatingFrame(angular_velocity=(0.1, 0.2, -0.3), point=(1.0, 2.0, 3.0)),
    basic.UniversalGravity(softening=0.5),
    basic.Spring(rest_length=0.4),
    basic.SpringToPoint(rest_length=0.4, anchor=(1.0, -2.0, 0.5)),
]
"""All laws that are evaluated along the way, and the other formulas of those that choose one by their parameters."""


@pytest.fixture(scope="module")
def traced() -> list[tuple[Any, list[Node], list[Node]]]:
    """Each law with the nodes of force, torque and potential, and with what they read."""
    found = []
    for law in LAWS:
        trace = trace_law(law)
        assert isinstance(trace, LawTrace)
        outputs = [*trace.motion, *([] if trace.potential is None else [trace.potential])]
        found.append((law, outputs, [node for node in walk(outputs) if node.op in ("input", "param")]))
    return found


def law_text(traced: list[tuple[Any, list[Node], list[Node]]]) -> str:
    """A text that computes law ``n[0][0]`` for rows ``n[0][1]`` to ``n[0][2]`` of numbers that it reads."""
    calls, chosen = [], ["def entry(f, n):", "    for row in range(n[0][1], n[0][2]):"]
    for k, (_, outputs, leaves) in enumerate(traced):
        place = {node.index: f"a[r + {at}]" for at, node in enumerate(leaves)}
        writer = Writer(lambda node, place=place: place[node.index])  # type: ignore[misc]
        names = writer.write(outputs)
        lines = [
            "a = f[0]",
            "o = f[1]",
            *writer.lines,
            *(f"o[w + {at}] = {name}" for at, name in enumerate(names)),
            "return 0",
        ]
        calls += [f"def law{k}(f, r, w):", *(f"    {line}" for line in lines), ""]
        chosen += [f"        if n[0][0] == {k}:", f"            law{k}(f, row * n[0][3], row * n[0][4])"]
    return assemble("\n".join([*calls, *chosen, "    return 1", ""]))


def test_every_law_of_the_packs_has_the_same_bits_interpreted_and_compiled(traced: Any) -> None:
    text = law_text(traced)
    slow, fast = interpreted(text), compiled(text, "all laws of the packs")
    wide = max(len(outputs) for _, outputs, _ in traced)
    for k, (law, outputs, leaves) in enumerate(traced):
        read = [node.value for node in leaves if node.op == "input"]
        states = Trial(law, Functions(trace_law(law)), ROWS, 17).states.inputs(read)  # type: ignore[arg-type]
        given = np.empty((ROWS, max(1, len(leaves))))
        values = parameters_of(law, [node.value for node in leaves if node.op == "param"])
        for at, node in enumerate(leaves):
            given[:, at] = states[node.value] if node.op == "input" else values[node.value]
        one, other = np.full((ROWS, wide), np.nan), np.full((ROWS, wide), np.nan)
        counts = [np.array([k, 0, ROWS, given.shape[1], wide])]
        assert slow([given.ravel(), one.ravel()], counts) == fast([given.ravel(), other.ravel()], counts) == 1
        assert same(one, other).all(), law.id
        assert np.isfinite(one[:, : len(outputs)]).mean() > 0.5, law.id


def test_no_law_of_the_packs_is_forgotten() -> None:
    packs = [basic, collision]
    along = {getattr(pack, name) for pack in packs for name in pack.__all__ if isinstance(getattr(pack, name), type)}
    assert {law for law in along if issubclass(law, xp.FieldLaw | xp.PairLaw)} == {type(law) for law in LAWS}
