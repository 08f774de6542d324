"""One text out of many kernel files: what a generated body calls, and all that those functions use, put before it.

A function ``f`` of the kernel file ``file.py`` is called ``file__f`` in the text, a constant alike. Annotations and docstrings are left
behind. What is used comes before what uses it, in the order of first use, so that the same body gives the same text in every process.
"""

from __future__ import annotations

import ast
import builtins
import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from xpheve.compile.parsing import parse
from xpheve.errors import CompileError

CORE = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "kernels")
PACKAGE = "xpheve.kernels"
MARK = "__"


def assemble(body: str, files: Mapping[str, str] | None = None, declared: Collection[str] = ()) -> str:
    """Return the text that defines ``entry``: what the names ``file__function`` in ``body`` mean, then ``body`` as it is.

    Parameters
    ----------
    body
        Generated text that defines ``def entry(f, n): ...``.
    files
        Kernel files of packs: name to path. Names of xPheve's own kernel files are taken. They may import from each other, by the
        names of their modules.
    declared
        Functions that ``body`` defines and kernel files of packs may call: they import them from a module that only declares them.

    Raises
    ------
    CompileError
        A file that cannot be read, imports what a kernel file may not, or lacks a name that is used.
    """
    if not files:  # xPheve's own do not change while it runs
        return _assembled(body)
    return _assemble(body, files, declared)


@lru_cache(maxsize=64)
def _assembled(body: str) -> str:
    return _assemble(body, {}, ())


def _assemble(body: str, files: Mapping[str, str], declared: Collection[str]) -> str:
    writer = _Writer(_Library(files, declared))
    for node in _in_order(parse(body)):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            file, mark, name = node.id.partition(MARK)
            if mark and file and name and writer.library.has(file):
                writer.put(file, name, f"the text calls {node.id}")
    return "\n".join(["import math", "", *writer.statements, body.strip("\n"), ""])


# Kernel files --------------------------------------------------------------------------------------------------------


@dataclass
class _File:
    """One kernel file: its top-level statements by the names they define, and the names it imports."""

    name: str
    path: str
    defines: dict[str, ast.stmt] = field(default_factory=dict)
    imports: dict[str, tuple[str, str]] = field(default_factory=dict)
    strangers: dict[str, str] = field(default_factory=dict)
    """Names imported from elsewhere, which only annotations may use in xPheve's own files."""
    declared: set[str] = field(default_factory=set)
    """Imported names that the text itself defines."""

    def wrong(self, node: ast.AST | None, what: str) -> CompileError:
        line = f":{getattr(node, 'lineno', 1)}" if node is not None else ""
        return CompileError(f"kernel file {self.path}{line}: {what}")


class _Library:
    """The kernel files at hand, each read when it is first asked for."""

    def __init__(self, files: Mapping[str, str], declared: Collection[str] = ()) -> None:
        self.files = dict(files)
        self.declared = declared
        self.read: dict[str, _File] = {}
        for name, path in self.files.items():
            if not name.isidentifier() or MARK in name or name.startswith("_"):
                raise CompileError(
                    f"kernel file {path}: {name!r} cannot be its name; a plain word is needed, such as 'lift'"
                )
            if os.path.isfile(os.path.join(CORE, f"{name}.py")):
                raise CompileError(
                    f"kernel file {path}: the name {name!r} is that of xpheve.kernels.{name}; rename the file"
                )

    def has(self, name: str) -> bool:
        return name in self.files or os.path.isfile(os.path.join(CORE, f"{name}.py"))

    def get(self, name: str) -> _File:
        if name not in self.read:
            own = name not in self.files
            path = os.path.join(CORE, f"{name}.py") if own else self.files[name]
            self.read[name] = _parsed(name, path, own, self)
        return self.read[name]

    def given(self, module: str) -> str:
        """The name of the pack's kernel file that ``module`` is; empty if none given is."""
        name = module.rpartition(".")[2]
        return name if name in self.files else ""


def _parsed(name: str, path: str, own: bool, library: _Library) -> _File:
    """Read one kernel file; a pack's may import ``math``, xPheve's kernels and the pack's own, and nothing else."""
    file = _File(name, path)
    try:
        with open(path, encoding="utf-8") as source:
            tree = parse(source.read(), path)
    except (OSError, ValueError) as wrong:
        raise CompileError(
            f"kernel file {path}: it cannot be read ({wrong}); name a Python file of plain functions"
        ) from wrong
    except SyntaxError as wrong:
        raise CompileError(
            f"kernel file {path}:{wrong.lineno}: it is not Python ({wrong.msg}); mend that line"
        ) from wrong
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef):
            file.defines[statement.name] = statement
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            for target in statement.targets if isinstance(statement, ast.Assign) else [statement.target]:
                for part in ast.walk(target):
                    if isinstance(part, ast.Name):
                        file.defines[part.id] = statement
        elif isinstance(statement, ast.Import | ast.ImportFrom):
            _take_import(file, statement, own, library)
        elif not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
            raise file.wrong(
                statement, "only imports, constants and functions belong here; move this statement into a function"
            )
    return file


def _take_import(file: _File, statement: ast.Import | ast.ImportFrom, own: bool, library: _Library) -> None:
    if isinstance(statement, ast.Import):
        strangers = [alias for alias in statement.names if alias.name != "math" or alias.asname]
    elif statement.module == "__future__":
        return
    elif statement.module is not None and statement.level == 0 and statement.module.startswith(f"{PACKAGE}."):
        other = statement.module[len(PACKAGE) + 1 :]
        for alias in statement.names:
            file.imports[alias.asname or alias.name] = (other, alias.name)
        return
    elif not own and statement.level == 0 and (other := library.given(statement.module or "")):
        for alias in statement.names:
            if not alias.asname and alias.name in library.declared:
                file.declared.add(alias.name)
            else:
                file.imports[alias.asname or alias.name] = (other, alias.name)
        return
    else:
        strangers = [alias for alias in statement.names if alias.asname or alias.name not in library.declared]
        file.declared.update(alias.name for alias in statement.names if alias not in strangers)
        own = own or (statement.module == "typing" and statement.level == 0)  # of use to annotations only
    for alias in strangers:
        if not own:
            module = (
                alias.name if isinstance(statement, ast.Import) else "." * statement.level + (statement.module or "")
            )
            raise file.wrong(
                statement,
                f"it imports {module!r}; a kernel file may `import math` and import from xpheve.kernels, or from kernel files "
                "that are named with it: write the function here, or make it an argument",
            )
        file.strangers[alias.asname or alias.name] = alias.name


# What is used --------------------------------------------------------------------------------------------------------


def _in_order(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes, as they stand in the text."""
    yield tree
    for child in ast.iter_child_nodes(tree):
        yield from _in_order(child)


class _Writer:
    """Writes down what is used, each statement once and after all that it uses."""

    def __init__(self, library: _Library) -> None:
        self.library = library
        self.statements: list[str] = []
        self.seen: set[tuple[str, int]] = set()

    def put(self, name: str, wanted: str, why: str) -> None:
        """Add the statement that defines ``wanted`` of file ``name``."""
        file = self.library.get(name)
        if wanted not in file.defines:
            if wanted in file.imports:
                return self._put_imported(file, wanted, None)
            known = ", ".join(key for key, value in file.defines.items() if isinstance(value, ast.FunctionDef))
            raise file.wrong(None, f"{why}, but there is no {wanted!r} in it; it has {known or 'no functions'}")
        statement = file.defines[wanted]
        if (name, statement.lineno) in self.seen:  # written, or being written: it calls itself
            return None
        self.seen.add((name, statement.lineno))
        clean = _Clean(file)
        text = ast.unparse(ast.fix_missing_locations(clean.visit(statement)))
        for node, used in clean.used:
            if used in file.imports:
                self._put_imported(file, used, node)
            else:
                self.put(name, used, f"line {getattr(node, 'lineno', 0)} uses {used!r}")
        self.statements.append(text)
        return None

    def _put_imported(self, file: _File, used: str, node: ast.AST | None) -> None:
        other, original = file.imports[used]
        if not self.library.has(other):
            raise file.wrong(node, f"there is no xpheve.kernels.{other}; import from a kernel file that exists")
        self.put(other, original, f"{file.path} imports {original!r}")


class _Clean(ast.NodeTransformer):
    """Takes annotations and docstrings away, and gives names of the file the names they have in the text."""

    def __init__(self, file: _File) -> None:
        self.file = file
        self.used: list[tuple[ast.AST, str]] = []
        self.local: set[str] = set()
        self.depth = 0

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        self._no_inner(node)
        if node.decorator_list:
            raise self.wrong(node, f"{node.name!r} has a decorator; leave it to xPheve how the function is compiled")
        arguments = node.args
        if arguments.vararg or arguments.kwarg or arguments.kwonlyargs:
            raise self.wrong(node, f"{node.name!r} takes *, ** or keyword-only arguments; give it plain ones")
        self.local = {
            part.id for part in ast.walk(node) if isinstance(part, ast.Name) and not isinstance(part.ctx, ast.Load)
        }
        for argument in [*arguments.posonlyargs, *arguments.args]:
            self.local.add(argument.arg)
            argument.annotation = None
        node.returns = None
        first = node.body[0]
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str):
            node.body = node.body[1:] or [ast.Pass()]
        arguments.defaults = [self.visit(default) for default in arguments.defaults]
        self.depth = 1
        node.body = [self.visit(statement) for statement in node.body]
        self.depth = 0
        node.name = f"{self.file.name}{MARK}{node.name}"
        return node

    def _no_inner(self, function: ast.FunctionDef) -> None:
        for part in ast.walk(function):
            inner = isinstance(part, ast.FunctionDef) and part is not function
            if inner or isinstance(part, ast.AsyncFunctionDef | ast.ClassDef | ast.Lambda | ast.Global | ast.Nonlocal):
                raise self.wrong(
                    part,
                    "a kernel function holds no function, class, lambda or global; write it at the top of the file",
                )
            if isinstance(part, ast.Import | ast.ImportFrom | ast.Yield | ast.YieldFrom | ast.Await | ast.With):
                raise self.wrong(part, "a kernel function only calculates; no import, yield or with")

    def wrong(self, node: ast.AST, what: str) -> CompileError:
        return self.file.wrong(node, what)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        if node.value is None:
            return ast.Pass()
        plain: ast.AST = self.visit(ast.Assign([node.target], node.value, lineno=node.lineno))
        return plain

    def visit_Name(self, node: ast.Name) -> ast.AST:
        name = node.id
        if self.depth and name in self.local:
            return node
        if isinstance(node.ctx, ast.Store):  # a constant of the file
            node.id = f"{self.file.name}{MARK}{name}"
        elif name in self.file.defines:
            self.used.append((node, name))
            node.id = f"{self.file.name}{MARK}{name}"
        elif name in self.file.imports:
            self.used.append((node, name))
            node.id = MARK.join(self.file.imports[name])
        elif name in self.file.declared:
            pass
        elif name in self.file.strangers or not (name == "math" or hasattr(builtins, name)):
            raise self.wrong(
                node,
                f"the name {name!r} means nothing in a kernel; define it in this file or import it from xpheve.kernels",
            )
        return node
