"""The house is in order: what holds for every law of every pack here, and for what an import may cost."""

from __future__ import annotations

import inspect
import json
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from xpheve.laws import PhysicalLaw
from xpheve.plugins.manifest import check_manifest
from xpheve.plugins.pack import Pack, collect
from xpheve.plugins.spec import spec_of

ROOT = Path(__file__).parents[2]


def packs() -> Iterator[tuple[str, str]]:
    """Yield name and module of every pack in this repository."""
    for path in sorted((ROOT / "packages").glob("*/pyproject.toml")):
        project = tomllib.loads(path.read_text(encoding="utf-8"))["project"]
        yield from project.get("entry-points", {}).get("xpheve.packs", {}).items()


def laws() -> Iterator[type[PhysicalLaw]]:
    """Yield every law of every pack."""
    for name, module in packs():
        pack = Pack(name)
        collect(pack, import_module(module))
        for id in sorted(pack.offered["law"]):
            yield pack.resolve("law", id)


PACKS = list(packs())
LAWS = list(laws())
each_law = pytest.mark.parametrize("law", [pytest.param(law, id=law.id) for law in LAWS])
each_pack = pytest.mark.parametrize(("name", "module"), PACKS, ids=[name for name, _ in PACKS])


@each_law
def test_a_law_has_a_test_of_its_own(law: type[PhysicalLaw]) -> None:
    package, _, file = law.__module__.rpartition(".")
    folder = ROOT / "tests" / package.partition(".")[0].removeprefix("xpheve_")
    assert list(folder.rglob(f"test_{file}.py")), f"write {folder.relative_to(ROOT)}/test_{file}.py"


@each_law
def test_a_law_says_what_it_is_and_where_it_comes_from(law: type[PhysicalLaw]) -> None:
    spec = spec_of(law)
    assert spec.doc and len(spec.doc) <= 200, "the first paragraph is one line for listings"
    assert spec.cite, "the docstring has a line that begins with Source:"
    assert re.search(r"\b(holds?|valid)\b", inspect.getdoc(law) or "", re.IGNORECASE), "say where the law holds"
    assert all(param.doc for param in spec.params), "every parameter says what it is"
    assert all(column.doc for column in spec.columns), "every column says what it is"


def test_a_law_is_one_file() -> None:
    shared = [module for module, count in Counter(law.__module__ for law in LAWS).items() if count > 1]
    assert not shared, f"more than one law in {', '.join(shared)}"


@each_pack
def test_the_manifest_of_a_pack_is_fresh(name: str, module: str) -> None:
    assert check_manifest(import_module(module), name=name) == ""


def loaded_by(statement: str) -> set[str]:
    """Return the modules that a fresh Python has loaded after ``statement``."""
    code = f"{statement}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    return set(json.loads(done.stdout))


HEAVY = {
    "click", "importlib.metadata", "matplotlib", "PIL", "pluggy", "pyarrow", "pydantic", "rich", "scipy", "tomli_w",
}  # fmt: skip


def test_importing_xpheve_loads_little() -> None:
    before = loaded_by("import numpy")  # what the interpreter's own start brings along does not count
    heavy = HEAVY | {module for _, module in PACKS}
    assert not (loaded_by("import xpheve; xpheve.PhysicsEngine; xpheve.FieldLaw") - before) & heavy


@each_pack
def test_importing_a_pack_loads_little(name: str, module: str) -> None:
    assert not (loaded_by(f"import {module}") - loaded_by("import numpy")) & HEAVY
