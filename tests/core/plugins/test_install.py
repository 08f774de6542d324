"""A pack installed by pip is there; uninstalled it is gone; nothing but installing is needed."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path
from typing import Any

import pytest

WIND = '''"""Wind."""
from xpheve.laws import FieldLaw, Param

__all__ = ["Wind"]


class Wind(FieldLaw):
    """Wind that pushes evenly: F = c."""

    id = "aero:wind"
    c = Param(1.0, unit="N")

    def force(self, body):
        return (self.c, 0.0, 0.0)
'''


def wheel(folder: Path, version: str) -> Path:
    """Build a wheel as a build backend would, without one: it is a zip file with four text files."""
    path = folder / f"xpheve_aero-{version}-py3-none-any.whl"
    info = f"xpheve_aero-{version}.dist-info"
    files = {
        "xpheve_aero/__init__.py": WIND,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: xpheve-aero\nVersion: {version}\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: hand\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": "[xpheve.packs]\naero = xpheve_aero\n",
    }
    files[f"{info}/RECORD"] = "".join(f"{name},,\n" for name in [*files, f"{info}/RECORD"])
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


def test_a_pack_is_there_when_installed_and_gone_when_uninstalled(site: Any, tmp_path: Path) -> None:
    pytest.importorskip("pip")
    home = tmp_path / "venv"
    venv.create(home, with_pip=False)
    python = str(next(path for path in home.rglob("python*") if path.stem == "python"))
    site.path = Path(sysconfig.get_path("purelib", "venv", vars={"base": str(home), "platbase": str(home)}))

    def pip(*arguments: str) -> None:
        command = [sys.executable, "-m", "pip", "--isolated", "--disable-pip-version-check", "--python", python]
        done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr

    look = "out = [[(i.name, i.version, i.status) for i in registry.packs()], error_of(registry.law, 'aero:wind')]"
    assert site.run(look)[0] == []
    pip("install", "--no-index", "--no-deps", str(wheel(tmp_path, "1.0")))
    assert site.run(look) == [[["aero", "1.0", "available"]], ""]
    assert site.run(look) == [[["aero", "1.0", "available"]], ""]
    pip("install", "--no-index", "--no-deps", str(wheel(tmp_path, "1.1")))
    assert site.run(look) == [[["aero", "1.1", "available"]], ""]
    pip("uninstall", "--yes", "xpheve-aero")
    said = site.run(look)
    assert said[0] == []
    assert said[1].startswith('UnknownLawError: law "aero:wind" comes from pack "aero", which is not installed')


def test_an_editable_install_by_path_file_is_there(site: Any, tmp_path: Path) -> None:
    source = tmp_path / "checkout" / "src"
    site.pack("aero", manifest={"schema": 1, "pack": "aero", "api": "1", "laws": []}, home=source)
    (site.path / "xpheve_aero.pth").write_text(f"{source}\n")
    out = site.run(
        """
        import site
        site.addsitedir(SITE)
        registry = Registry()
        info = next(i for i in registry.packs() if i.name == "aero")
        untouched = "xpheve_aero" in sys.modules
        listed = [i.id for i in registry.laws() if i.pack == "aero"]
        out = [info.status, untouched, listed, registry.law("aero:wind").__name__]
        """
    )
    assert out == ["available", False, [], "Wind"]
