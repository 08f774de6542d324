"""A pack outside the repository: installed by pip into a folder of its own, and what an author had to write."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

PACK = Path(__file__).with_name("pack")
MODULE = "xpheve_laws_outside"


def wheel(folder: Path) -> Path:
    """The pack as a wheel, made as a build backend would, without one: so that nothing has to be fetched."""
    project = tomllib.loads((PACK / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    stem = f"{project['name'].replace('-', '_')}-{project['version']}"
    info = f"{stem}.dist-info"
    entries = "".join(
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in points.items())
        for group, points in project["entry-points"].items()
    )
    files = {
        f"{MODULE}.py": (PACK / f"{MODULE}.py").read_text(encoding="utf-8"),
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: benchmarks\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": entries,
    }
    files[f"{info}/RECORD"] = "".join(f"{name},,\n" for name in [*files, f"{info}/RECORD"])
    path = folder / f"{stem}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


def install(folder: Path) -> Path:
    """Install the pack by pip below ``folder``; the result is to be put on `sys.path`. Raises `RuntimeError` if pip fails."""
    target = folder / "site-packages"
    command = [
        sys.executable,
        "-m",
        "pip",
        "--isolated",
        "--disable-pip-version-check",
        "install",
        "--no-index",
        "--no-deps",
    ]
    done = subprocess.run(
        [*command, "--target", str(target), str(wheel(folder))], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"pip could not install the pack: {done.stdout}{done.stderr}")
    return target


def lines(path: Path = PACK / f"{MODULE}.py") -> int:
    """Non-blank lines of a module, docstrings and comments apart."""
    text = path.read_text(encoding="utf-8")
    apart: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        if (
            isinstance(body, list)
            and body
            and isinstance(body[0], ast.Expr)
            and isinstance(body[0].value, ast.Constant)
        ):
            if isinstance(body[0].value.value, str):
                apart |= set(range(body[0].lineno, (body[0].end_lineno or 0) + 1))
    kept = (line.strip() for number, line in enumerate(text.splitlines(), 1) if number not in apart)
    return sum(bool(line) and not line.startswith("#") for line in kept)
