"""The text as numba gets it, and the object code that numba gives back. numba is imported here and nowhere else.

Before it is compiled the text is lowered: helpers of `xpheve.kernels.ieee` become the machine's own operation where that has the same
result (division, square root, floor), and functions of ``math`` become calls of the same function of the C library that ``math`` itself
calls, under a name of our own (``xpheve_exp``). The compiler knows nothing of that name, so it can neither fold it, nor turn a power into
products, nor put a vector library in its place: the bits are those of the interpreted text. All other functions are compiled once each and
called, which LLVM turns into no call at all; writing their text out where they are called compiles no faster, and slower where they branch.

Compiled functions return a status and write their result through a pointer, numba's own convention inside; no wrapper is built, so that the
code needs nothing of Python.
"""

from __future__ import annotations

import ast
import gc
import hashlib
import linecache
import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

from xpheve.compile.loader import LIBM, PREFIX, provide_symbols
from xpheve.compile.parsing import parse
from xpheve.errors import CompileError

INTRINSICS = {"sqrt": "llvm.sqrt.f64", "floor": "llvm.floor.f64", "copysign": "llvm.copysign.f64"}
"""Operations of the processor, exact or rounded once, for any value; how many arguments they take is in `ARGUMENTS`."""
ARGUMENTS = {"copysign": 2, "atan2": 2, "pow": 2, "fmod": 2}
SPECIAL = {"frexp", "ldexp"}
LOWERED = "machine__"

HELPERS = {
    "ieee__sqrt": "sqrt", "ieee__floor": "floor", "ieee__cbrt": "cbrt", "ieee__power": "pow", "ieee__exp": "exp", "ieee__expm1": "expm1",
    "ieee__log": "log", "ieee__log1p": "log1p", "ieee__sin": "sin", "ieee__cos": "cos", "ieee__tan": "tan", "ieee__asin": "asin",
    "ieee__acos": "acos", "ieee__sinh": "sinh", "ieee__cosh": "cosh",
    "ieee__minimum": "minimum", "ieee__maximum": "maximum",
}  # fmt: skip
"""Helpers whose result the C library, or the processor, gives for every value; `ieee__divide` is a plain division."""

MATH = {*LIBM, "sqrt", "copysign", *SPECIAL}
PLAIN_MATH = {"isnan", "isinf", "isfinite", "fabs", "floor", "ceil", "trunc", "pi", "e", "tau", "inf", "nan"}
"""What numba does as Python does; nothing else of ``math`` is sure to round alike."""


# Lowering ------------------------------------------------------------------------------------------------------------


def lowered(text: str) -> str:
    """Return the functions of ``text`` with the machine's operations in place of helpers and of ``math``; constants are left out."""
    replaced = {*HELPERS, "ieee__divide"}
    functions = [node for node in parse(text).body if isinstance(node, ast.FunctionDef) and node.name not in replaced]
    tree = ast.Module([_Lower().visit(node) for node in functions], [])
    return ast.unparse(ast.fix_missing_locations(tree))


def _constants(text: str) -> dict[str, Any]:
    """Return the constants of ``text`` as Python computes them, whatever functions of the text they are made with."""
    space: dict[str, Any] = {"math": math, "__name__": "xpheve_kernel"}
    exec(compile(text, "<xpheve constants>", "exec"), space)
    targets = [target for node in parse(text).body if isinstance(node, ast.Assign) for target in node.targets]
    names = [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
    return {name: space[name] for name in names}


class _Lower(ast.NodeTransformer):
    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        function = node.func
        if isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name) and function.value.id == "math":
            if function.attr in MATH:
                node.func = ast.Name(LOWERED + function.attr, ast.Load())
            elif function.attr not in PLAIN_MATH:
                raise CompileError(
                    f"math.{function.attr} is not sure to give the same bits compiled and interpreted; "
                    f"use one of {', '.join(sorted(MATH | PLAIN_MATH))}, or a function of xpheve.kernels.ieee"
                )
            return node
        if not isinstance(function, ast.Name) or node.keywords:
            return node
        if function.id == "ieee__divide" and len(node.args) == 2:
            return ast.BinOp(node.args[0], ast.Div(), node.args[1])
        if function.id in HELPERS:
            function.id = LOWERED + HELPERS[function.id]
        elif function.id in ("min", "max"):
            return self._of_pairs(function.id, node.args)
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow) or (_whole(node.left) and _whole(node.right)):
            return node
        return ast.Call(ast.Name(LOWERED + "pow", ast.Load()), [node.left, node.right], [])

    def _of_pairs(self, name: str, arguments: list[ast.expr]) -> ast.expr:
        """``min`` or ``max`` of many as that of two, the first first."""
        best, *others = arguments
        if not others or any(isinstance(argument, ast.Starred) for argument in arguments):
            raise CompileError(
                f"{name}({ast.unparse(best)}): compiled, it takes numbers only; write them out: {name}(a[0], a[1], a[2])"
            )
        for other in others:
            best = ast.Call(ast.Name(LOWERED + name, ast.Load()), [best, other], [])
        return best


def _whole(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) is int


# Compiling -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Machine:
    """Object code, the name of the entry in it, and where numba itself puts the entry, as long as this is kept."""

    code: bytes
    symbol: str
    address: Callable[[], int]


@cache
def _numba() -> Any:
    """Import numba, and return the parts of it that are used here; its warnings of settings are nobody's business."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import numba  # noqa: F401  (sets up its targets)
        from llvmlite import ir
        from numba._dynfunc import make_function
        from numba.core import cgutils, types
        from numba.core.compiler import Compiler
        from numba.core.registry import CPUDispatcher
        from numba.extending import intrinsic

    class Dispatcher(CPUDispatcher):
        """numba's own, but compiled once for all numbers of a type, and not again for each constant that it is called with."""

        def get_call_template(self, args: Any, kws: Any) -> Any:
            plain: Any = types.unliteral
            return super().get_call_template(tuple(map(plain, args)), {name: plain(one) for name, one in kws.items()})

    return SimpleNamespace(
        ir=ir,
        cgutils=cgutils,
        types=types,
        CPUDispatcher=Dispatcher,
        intrinsic=intrinsic,
        Compiler=Compiler,
        make_function=make_function,
    )


def _pipelines() -> tuple[Any, Any]:
    """numba's compiler, for the functions of a text, and for its entry.

    A function that only others call is never loaded by itself: its code is left as it is, and is optimised and turned into the machine's
    once, as part of the entry. numba by itself does so anew for each function with all that it calls.
    """
    parts: list[Any] = []

    def keep(library: Any, description: Any, environment: Any) -> Any:
        library._finalized = True  # nothing is linked to it
        parts.append(library)
        name: str = description.qualname
        # What numba knows the function by; nobody calls it.
        return _numba().make_function(
            description.lookup_module(), name.rsplit(".", 1)[-1], "", 0, environment, (library,)
        )

    class Part(_numba().Compiler):  # type: ignore[misc]
        def __init__(self, typing: Any, target: Any, *others: Any) -> None:
            super().__init__(typing, target, *others)
            self.state.targetctx.get_executable = keep  # numba makes a context for each function

    class Whole(_numba().Compiler):  # type: ignore[misc]
        def __init__(self, typing: Any, target: Any, *others: Any) -> None:
            super().__init__(typing, target, *others)
            context = self.state.targetctx
            load = context.get_executable

            def linked(library: Any, description: Any, environment: Any) -> Any:
                for one in reversed(parts):  # callers first: what nobody calls so far would be left out
                    library._linking_libraries.extend([one, *one._linking_libraries])
                return load(library, description, environment)

            context.get_executable = linked

    return Part, Whole


def machine_code(text: str, what: str) -> Machine:
    """Compile ``text``, which defines ``entry``; CompileError names the line that numba cannot type."""
    source = lowered(text)
    try:
        numba = _numba()
    except ImportError as wrong:
        raise CompileError(
            f"{what}: numba cannot be imported ({wrong}); install it, or run with compile='never'"
        ) from wrong
    provide_symbols()
    options = {
        "nopython": True, "error_model": "numpy", "boundscheck": False, "fastmath": False, "nogil": True,
        "no_cpython_wrapper": True, "no_cfunc_wrapper": True,
    }  # fmt: skip
    name = f"<xpheve {hashlib.sha256(source.encode()).hexdigest()[:16]}>"
    with _lines(name, source):
        space: dict[str, Any] = {
            "math": math,
            "__name__": "xpheve_kernel",
            **_machine_functions(source),
            **_constants(text),
        }
        exec(compile(source, name, "exec"), space)
        part, whole = _pipelines()
        for key, value in list(space.items()):
            if callable(value) and getattr(value, "__module__", None) == "xpheve_kernel" and key != "entry":
                space[key] = numba.CPUDispatcher(py_func=value, targetoptions=dict(options), pipeline_class=part)
        types = numba.types
        pointers = types.CPointer(types.CPointer(types.float64)), types.CPointer(types.CPointer(types.int64))
        entry = numba.CPUDispatcher(py_func=space["entry"], targetoptions=dict(options), pipeline_class=whole)
        try:
            with warnings.catch_warnings(), _no_collection():
                warnings.simplefilter("ignore")
                entry.compile(types.int64(*pointers))
        except Exception as wrong:  # numba's errors have no useful common class across versions
            raise CompileError(f"{what}: the generated text cannot be compiled: {_first_lines(wrong)}") from wrong
    result = entry.overloads[pointers]
    library, symbol = result.library, result.fndesc.llvm_func_name

    def address() -> int:  # numba frees the code with its library, which this function holds
        return int(library.codegen._engine._ee.get_function_address(symbol))

    return Machine(bytes(library._get_compiled_object()), symbol, address)


def _first_lines(wrong: Exception) -> str:
    """The gist of one of numba's errors, which run to pages."""
    lines = [line.strip() for line in str(wrong).splitlines() if line.strip()]
    return f"{type(wrong).__name__}: {' '.join(lines[:6])}"[:600]


@contextmanager
def _no_collection() -> Iterator[None]:
    """Look for no garbage meanwhile: numba makes millions of objects that all stay, and an eighth of its time goes into looking."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


@contextmanager
def _lines(name: str, source: str) -> Iterator[None]:
    """Let errors show lines of ``source``."""
    linecache.cache[name] = (len(source), None, source.splitlines(True), name)
    try:
        yield
    finally:
        linecache.cache.pop(name, None)


def _machine_functions(source: str) -> dict[str, Any]:
    """Return what the lowered names in ``source`` mean to numba."""
    names = {
        node.id[len(LOWERED) :]
        for node in ast.walk(parse(source))
        if isinstance(node, ast.Name) and node.id.startswith(LOWERED)
    }
    return {LOWERED + name: _machine_function(name) for name in sorted(names)}


_made: dict[str, Any] = {}


def _machine_function(name: str) -> Any:
    if name not in _made:
        if name in ("min", "max", "minimum", "maximum"):
            _made[name] = _choice(name)
        elif name in SPECIAL:
            _made[name] = _halves(name)
        elif name == "linked":
            _made[name] = _linked()
        else:
            _made[name] = _real_function(INTRINSICS.get(name, PREFIX + name), ARGUMENTS.get(name, 1))
    return _made[name]


def _real_function(symbol: str, count: int) -> Any:
    """A function of ``count`` floats without side effects, by its symbol."""
    ir, types, intrinsic = _numba().ir, _numba().types, _numba().intrinsic
    real = ir.DoubleType()

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        function = _declared(builder.module, symbol, ir.FunctionType(real, [real] * count))
        for attribute in () if symbol.startswith("llvm.") else ("readnone", "nounwind"):
            function.attributes.add(attribute)
        return builder.call(function, arguments)

    if count == 1:

        def one(typing: Any, x: Any) -> Any:
            return types.float64(types.float64), code

        return intrinsic(one)

    def two(typing: Any, x: Any, y: Any) -> Any:
        return types.float64(types.float64, types.float64), code

    return intrinsic(two)


def _halves(name: str) -> Any:
    """``math.frexp``, or ``math.ldexp``, whose C forms have an int in them."""
    ir, types, cgutils, intrinsic = _numba().ir, _numba().types, _numba().cgutils, _numba().intrinsic
    real, small = ir.DoubleType(), ir.IntType(32)

    def frexp_code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        function = _declared(builder.module, PREFIX + "frexp", ir.FunctionType(real, [real, small.as_pointer()]))
        place = cgutils.alloca_once(builder, small)
        builder.store(ir.Constant(small, 0), place)
        fraction = builder.call(function, [arguments[0], place])
        return context.make_tuple(
            builder, signature.return_type, [fraction, builder.sext(builder.load(place), ir.IntType(64))]
        )

    def ldexp_code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        function = _declared(builder.module, PREFIX + "ldexp", ir.FunctionType(real, [real, small]))
        limit = ir.Constant(ir.IntType(64), 1 << 20)
        power = arguments[1]
        power = builder.select(builder.icmp_signed("<", power, limit), power, limit)
        power = builder.select(builder.icmp_signed(">", power, limit.neg()), power, limit.neg())
        return builder.call(function, [arguments[0], builder.trunc(power, small)])

    def frexp(typing: Any, x: Any) -> Any:
        return types.Tuple((types.float64, types.int64))(types.float64), frexp_code

    def ldexp(typing: Any, x: Any, power: Any) -> Any:
        return types.float64(types.float64, types.int64), ldexp_code

    return intrinsic(frexp if name == "frexp" else ldexp)


def _linked() -> Any:
    """``linked(address, f, n)``: the entry of another kernel, by the address of its code; 0 if that stopped."""
    ir, types, cgutils, intrinsic = _numba().ir, _numba().types, _numba().cgutils, _numba().intrinsic
    whole, place = ir.IntType(64), ir.IntType(8).as_pointer()

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address, f, n = arguments
        result, failure = cgutils.alloca_once(builder, whole), cgutils.alloca_once(builder, place)
        kind = ir.FunctionType(ir.IntType(32), [whole.as_pointer(), place.as_pointer(), f.type, n.type])
        builder.store(ir.Constant(whole, 0), result)
        builder.call(builder.inttoptr(address, kind.as_pointer()), [result, failure, f, n])
        return builder.load(result)

    def linked(typing: Any, address: Any, f: Any, n: Any) -> Any:
        return types.int64(types.int64, f, n), code

    return intrinsic(linked)


def _declared(module: Any, symbol: str, kind: Any) -> Any:
    return module.globals[symbol] if symbol in module.globals else _numba().ir.Function(module, kind, symbol)


def _choice(name: str) -> Any:
    """The lesser or greater of two, without a branch; which one settles NaN and signs of zero.

    Python's ``min`` and ``max`` take the second only if it is less, or greater; IEEE's ``minimum`` and ``maximum`` take the first if it is
    no greater, or no less, or no number.
    """
    types, intrinsic = _numba().types, _numba().intrinsic
    sign = "<" if name.startswith("min") else ">"

    def pythons(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first, second = arguments
        compare = builder.icmp_signed if isinstance(signature.return_type, types.Integer) else builder.fcmp_ordered
        return builder.select(compare(sign, second, first), second, first)

    def ieee(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first, second = arguments
        takes_first = builder.or_(
            builder.fcmp_ordered(sign + "=", first, second), builder.fcmp_unordered("uno", first, first)
        )
        return builder.select(takes_first, first, second)

    def choose(typing: Any, x: Any, y: Any) -> Any:
        whole = name in ("min", "max") and all(isinstance(number, types.Integer | types.Boolean) for number in (x, y))
        kind = types.int64 if whole else types.float64
        return kind(kind, kind), pythons if name in ("min", "max") else ieee

    return intrinsic(choose)
