"""A cache folder of its own for every test, and a process that has compiled nothing yet."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from xpheve.compile import store, tiers


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    home = tmp_path / "cache"
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(home))
    fresh(monkeypatch)
    return home / "kernels"


def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "_compiled", {})
    monkeypatch.setattr(tiers, "_interpreted", {})
    monkeypatch.setattr(store, "_warned", False)


@pytest.fixture
def forget(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """As if the process had just begun."""
    return lambda: fresh(monkeypatch)


@pytest.fixture
def process(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs Python text in another process."""

    def run(text: str, check: bool = True, **environment: str) -> subprocess.CompletedProcess[str]:
        script = tmp_path / f"script{len(list(tmp_path.iterdir()))}.py"
        script.write_text(text)
        here = {**os.environ, **environment}
        place = tmp_path / "here"
        place.mkdir(exist_ok=True)
        return subprocess.run(
            [sys.executable, "-W", "error", str(script)],
            env=here,
            cwd=place,
            capture_output=True,
            text=True,
            check=check,
            timeout=120,
        )

    return run
