"""A scene of a bouncing ball, and how to call the command line in this process and in another."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

SCENE = """xpheve = 1
up = "z"

[run]
until = 1.0

[[laws]]
id = "basic:planet_gravity"
name = "gravity"

[[laws]]
id = "collision:elastic"
restitution = 0.8

[[objects]]
name = "floor"
shape = { kind = "plane" }
fixed = true
laws = ["collision:elastic"]

[[objects]]
name = "ball"
shape = { kind = "sphere", radius = 0.1 }
position = [0.0, 0.0, 1.1]
laws = ["gravity", "collision:elastic"]
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """The file of the scene."""
    path = tmp_path / "ball.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Call the command line in this process."""
    monkeypatch.delenv("XPHEVE_TRACEBACK", raising=False)

    def call(*arguments: Any) -> Result:
        from xpheve.cli.commands import commands

        return CliRunner().invoke(commands, [str(argument) for argument in arguments])

    return call


@pytest.fixture
def process(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Call the command line in a process of its own; ``site`` is a folder of packs in front of the installed ones."""

    def process(*arguments: Any, site: Path | None = None) -> subprocess.CompletedProcess[str]:
        environment = dict(os.environ, XPHEVE_CACHE_DIR=str(tmp_path / "cache"))
        environment.pop("XPHEVE_TRACEBACK", None)
        if site is not None:
            environment["PYTHONPATH"] = str(site)
        command = [sys.executable, "-m", "xpheve", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment, cwd=tmp_path)

    return process
