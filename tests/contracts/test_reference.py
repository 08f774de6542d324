"""The reference: every public name says what it is, what it takes and what it raises; and the pages of it are made."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import pytest

import xpheve
from xpheve.plugins import Registry

ROOT = Path(__file__).parents[2]
MODULES = (
    "xpheve",
    "xpheve.when",
    "xpheve.errors",
    "xpheve.shapes",
    "xpheve.meshes",
    "xpheve.orientation",
    "xpheve.trace",
    "xpheve.compile",
    "xpheve.realtime",
    "xpheve.record",
    "xpheve_laws_basic",
    "xpheve_laws_collision",
)


def module(name: str) -> ModuleType:
    """Return a module by its public name."""
    found = {"xpheve.when": xpheve.when, "xpheve.errors": xpheve.errors}.get(name)
    return found or import_module(name)


def public() -> Iterator[tuple[str, Any]]:
    """Yield each public class and function once, by its full name."""
    seen = set()
    for name in MODULES:
        home = module(name)
        names = getattr(home, "__all__", None) or [
            key for key, value in vars(home).items() if getattr(value, "__module__", "") == home.__name__
        ]
        for key in names:
            value = getattr(home, key)
            if not key.startswith("_") and callable(value) and value not in seen:
                seen.add(value)
                yield f"{name}.{key}", value


PUBLIC = dict(public())
CLASSES = {name: value for name, value in PUBLIC.items() if inspect.isclass(value)}
each_class = pytest.mark.parametrize("name", sorted(CLASSES))


def members(kind: type) -> Iterator[tuple[str, Any]]:
    """Yield the public methods and properties that a class itself defines; the engine defines those of its rooms."""
    rooms = [part for part in kind.__mro__ if part is kind or part.__module__.startswith("xpheve.engine.")]
    for name, value in (one for part in rooms for one in vars(part).items()):
        inner = getattr(value, "__func__", value)
        if not name.startswith("_") and isinstance(inner, (FunctionType, property)):
            yield name, inner


def inherited(kind: type, name: str) -> str:
    """Return the docstring of a member, or that of the contract which it fills."""
    return next((doc for base in kind.__mro__ if (doc := inspect.getdoc(vars(base).get(name, None)) or "")), "")


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_a_public_name_says_what_it_is(name: str) -> None:
    own = vars(PUBLIC[name]).get("__doc__") if inspect.isclass(PUBLIC[name]) else inspect.getdoc(PUBLIC[name])
    first = inspect.cleandoc(own or "").partition("\n")[0]
    made_up = first.startswith(f"{name.rpartition('.')[2]}(")  # what a dataclass says of itself if nobody else does
    assert len(first.split()) > 1 and not made_up, f"{name}: {first!r}"


@each_class
def test_a_class_says_what_it_is_made_from(name: str) -> None:
    kind = CLASSES[name]
    made_by_us = issubclass(kind, BaseException) or "\nMade by " in (inspect.getdoc(kind) or "")
    if made_by_us or kind.__module__.startswith("xpheve_laws"):
        return  # parameters of laws say what they are themselves
    doc = "\n".join(inspect.getdoc(base) or "" for base in kind.__mro__ if base is not object)
    if is_dataclass(kind):
        given = [one.name for one in fields(kind) if one.init and one.name in vars(kind).get("__annotations__", {})]
    elif "__init__" in vars(kind):
        kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        given = [one.name for one in inspect.signature(kind).parameters.values() if one.kind in kinds]
    else:
        return
    if len(given) == 1:
        return  # what it says is about that one
    missing = [
        one for one in given if not re.search(rf"^{one}$|^[\w, ]*\b{one}\b[\w, ]*$|``{one}\b", doc, re.MULTILINE)
    ]
    assert not missing, (
        f"{name}: {', '.join(missing)}: put it into a section Parameters, or say ``{missing[0]}`` in the text"
    )


@each_class
def test_every_method_and_property_says_what_it_does(name: str) -> None:
    kind = CLASSES[name]
    silent = [member for member, _ in members(kind) if not inherited(kind, member)]
    assert not silent, f"{name}: {', '.join(silent)}"


@each_class
def test_a_method_that_raises_says_so(name: str) -> None:
    """What a method raises itself; what it calls may raise more."""
    kind = CLASSES[name]
    silent = []
    for member, value in members(kind):
        for one in (value.fget, value.fset) if isinstance(value, property) else (value,):
            if one is not None and refuses(one) and "rais" not in _all_docs(kind, member).lower():
                silent.append(member)
    assert not silent, f"{name}: {', '.join(silent)}: add a section Raises"


def refuses(function: Any) -> bool:
    """Whether a function raises in some case; one that does nothing else is a contract that waits to be filled."""
    body = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0].body  # type: ignore[attr-defined]
    raised = [node for part in body for node in ast.walk(part) if isinstance(node, ast.Raise) and node.exc is not None]
    return bool(raised) and body[-1] is not raised[0]


def _all_docs(kind: type, member: str) -> str:
    """Return what the member, and its class, say."""
    return (inspect.getdoc(kind) or "") + inherited(kind, member)


def test_every_condition_is_in_the_table_of_the_page() -> None:
    page = (ROOT / "docs" / "conditions.md").read_text(encoding="utf-8")
    kinds = [
        value
        for value in CLASSES.values()
        if value.__module__.startswith("xpheve.laws.conditions") and value is not xpheve.when.Condition
    ]
    assert len(kinds) >= 12
    assert [kind.__name__ for kind in kinds if not re.search(rf"\b{kind.__name__}\b", page)] == []


def test_the_pages_are_made(tmp_path: Path) -> None:
    pytest.importorskip("pdoc")
    command = [
        sys.executable,
        "-W",
        "error::UserWarning",
        str(ROOT / "docs" / "make_reference.py"),
        str(tmp_path / "out"),
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    made = {path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.html")}
    assert {"index.html", "xpheve.html", "xpheve_laws_basic.html", "xpheve_laws_collision.html"} <= made
    text = (tmp_path / "out" / "xpheve.html").read_text(encoding="utf-8")
    for name in xpheve.__all__:
        assert f'id="{name}"' in text or isinstance(getattr(xpheve, name), ModuleType), name
        if isinstance(getattr(xpheve, name), ModuleType):
            page = tmp_path / "out" / Path(*getattr(xpheve, name).__name__.split(".")).with_suffix(".html")
            assert page.is_file(), f"{name}: put the module into MODULES of docs/make_reference.py"
    for name in ("run", "add_law", "add_object", "checkpoint", "energy", "explain", "start", "suspend", "post"):
        assert f'id="PhysicsEngine.{name}"' in text, name
    basic = (tmp_path / "out" / "xpheve_laws_basic.html").read_text(encoding="utf-8")
    for info in Registry.default().laws():
        if info.pack == "basic":
            assert f'id="{Registry.default().law(info.id).__name__}"' in basic, info.id
    assert "http://" not in text.replace("http://www.w3.org", "")  # nothing is fetched when a page is read
