"""Folders laid out as site-packages are, with packs in them, and a fresh Python that sees them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

LAW = '''
"""A pack."""
from xpheve.laws import FieldLaw, Param

__all__ = ["Wind"]


class Wind(FieldLaw):
    """Wind that pushes evenly: F = c.

    Source: Beaufort (1805).
    """

    id = "{pack}:wind"
    role = "wind"
    c = Param(0.1, unit="N", ge=0, doc="Push.")

    def force(self, body):
        return (self.c, 0.0, 0.0)
'''


class Site:
    """A folder of installed packs, a cache folder beside it, and `run` to look at them from a fresh Python."""

    def __init__(self, root: Path) -> None:
        self.path = root / "site-packages"
        self.cache = root / "cache"
        self.path.mkdir(parents=True)

    def pack(
        self,
        name: str,
        source: str | None = None,
        *,
        distribution: str = "",
        version: str = "1.0",
        module: str = "",
        target: str | None = None,
        manifest: Any = None,
        home: Path | None = None,
    ) -> Path:
        """Install a pack of one module with ``source``; ``manifest`` is a table or the text of the file."""
        distribution = distribution or f"xpheve-{name}"
        module = module or distribution.replace("-", "_")
        package = (home or self.path) / module
        package.mkdir(parents=True, exist_ok=True)
        text = LAW.replace("{pack}", name) if source is None else textwrap.dedent(source)
        (package / "__init__.py").write_text(text, encoding="utf-8")
        entry = f"[xpheve.packs]\n{name} = {module if target is None else target}\n"
        if manifest is not None:
            text = manifest if isinstance(manifest, str) else json.dumps(manifest)
            (package / "xpheve.json").write_text(text, encoding="utf-8")
            entry += f"\n[xpheve.manifest]\n{name} = {module}:xpheve.json\n"
        info = self.path / f"{distribution.replace('-', '_')}-{version}.dist-info"
        info.mkdir(exist_ok=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n\nText.\n")
        (info / "entry_points.txt").write_text(entry)
        return info

    def settle(self) -> None:
        """Make everything look as if it was installed an hour ago, as on a machine that is used and not just set up."""
        for path in [self.path, *self.path.rglob("*")]:
            about = path.stat()
            os.utime(path, ns=(about.st_atime_ns - 3600 * 10**9, about.st_mtime_ns - 3600 * 10**9))

    def run(self, code: str, **environment: str) -> Any:
        """Run ``code``, which has ``registry`` and ends with ``out = ...``; returns ``out`` by way of JSON."""
        prelude = (
            "import json, sys\n"
            "from xpheve.plugins import Registry\n"
            f"SITE = {str(self.path)!r}\n"
            "registry = Registry(search_path=[SITE])\n"
            "def error_of(function, *arguments, **more):\n"
            "    try:\n"
            "        function(*arguments, **more)\n"
            "    except Exception as wrong:\n"
            "        return f'{type(wrong).__name__}: {wrong}'\n"
            "    return ''\n"
        )
        script = prelude + textwrap.dedent(code) + "\nprint('OUT' + json.dumps(out))\n"
        clean = {key: value for key, value in os.environ.items() if not key.startswith(("XPHEVE_", "PYTHON"))}
        clean |= {"PYTHONPATH": str(self.path), "XPHEVE_CACHE_DIR": str(self.cache), **environment}
        command = [sys.executable, "-W", "error", "-c", script]
        done = subprocess.run(command, capture_output=True, text=True, env=clean, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        self.stderr = done.stderr
        return json.loads(done.stdout.rpartition("OUT")[2])


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """Return an empty site."""
    return Site(tmp_path)


@pytest.fixture(scope="session")
def make_site(tmp_path_factory: pytest.TempPathFactory) -> Callable[[], Site]:
    """Return a maker of empty sites, for fixtures that serve several tests."""
    return lambda: Site(tmp_path_factory.mktemp("site"))
