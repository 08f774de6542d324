"""Drivers: steppers' inner loops, each a file of plain functions with ``entry(f, n)``, which call ``forces`` of the motion that they carry.

The text of a driver is its file without imports, docstrings and annotations. What it imports from `xpheve.kernels` keeps the name that kernel
files have in texts, ``ieee__sqrt`` for ``sqrt`` of ``ieee.py``; what it imports from `xpheve.loop.drivers.motion` is what the text of the motion
defines, see `xpheve.loop.motion`. Constants of a driver's file stay in it.
"""

from __future__ import annotations

import ast
import os
from functools import cache
from typing import Any

from xpheve.errors import CompileError

ROOM = os.path.dirname(os.path.abspath(__file__))
MOTION = "xpheve.loop.drivers.motion"


LINKED = """
def forces(f, n, x, v, a, w, now):
    d = n[2]
    p = f[1]
    d[2] = x
    d[3] = v
    d[4] = a
    d[5] = w
    p[0] = now
    return machine__linked(d[6], f, n)

def jacobians(f, n, x, v, jx, jv, now):
    d = n[2]
    p = f[1]
    d[2] = x
    d[3] = v
    d[4] = jx
    d[5] = jv
    p[0] = now
    return machine__linked(d[7], f, n)

"""
"""What a compiled driver calls: code of the motion's own, by its address (`xpheve.plan.motions`), so that a driver is compiled once and not
for each set of laws."""


@cache
def driver_text(name: str) -> str:
    """The text of driver ``name``; raises `CompileError` for one that is not there, or imports what it may not."""
    from xpheve.compile.parsing import parse

    path = os.path.join(ROOM, f"{name}.py")
    try:
        with open(path, encoding="utf-8") as file:
            tree = parse(file.read(), path)
    except OSError as error:
        raise CompileError(f"driver {name!r}: it cannot be read ({error}); a file of loop/drivers is needed") from None
    clean = _Clean(path)
    body = [clean.visit(one) for one in tree.body]
    return "\n".join(ast.unparse(ast.fix_missing_locations(one)) for one in body if one is not None) + "\n"


class _Clean(ast.NodeTransformer):
    """Takes imports, docstrings and annotations away, and gives what was imported the names that it has in texts."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.names: dict[str, str] = {}

    def visit_Import(self, node: ast.Import) -> None:
        if [one.name for one in node.names] != ["math"]:
            raise self._wrong(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        module = node.module or ""
        if module in ("__future__", MOTION):
            return
        if not module.startswith("xpheve.kernels."):
            raise self._wrong(node)
        for one in node.names:
            self.names[one.asname or one.name] = f"{module.rpartition('.')[2]}__{one.name}"

    def _wrong(self, node: ast.stmt) -> CompileError:
        return CompileError(f"driver {self.path}:{node.lineno}: it may import math, xpheve.kernels and {MOTION} only")

    def visit_Expr(self, node: ast.Expr) -> Any:
        return None if isinstance(node.value, ast.Constant) else self._whole(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> Any:
        node.returns = None
        for one in (*node.args.posonlyargs, *node.args.args):
            one.annotation = None
        return self._whole(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> Any:
        if node.value is None:
            return None
        return self._whole(ast.copy_location(ast.Assign([node.target], node.value), node))

    def visit_Name(self, node: ast.Name) -> ast.Name:
        return ast.copy_location(ast.Name(self.names.get(node.id, node.id), node.ctx), node)

    def _whole(self, node: Any) -> Any:
        self.generic_visit(node)
        return node
