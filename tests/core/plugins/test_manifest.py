"""The manifest: built from the module, read without it, and never stale unnoticed."""

from __future__ import annotations

import json
import types
from pathlib import Path
from typing import Any

import pytest

from xpheve.errors import PackError
from xpheve.laws import FieldLaw, LawContainer, Param
from xpheve.plugins.manifest import (
    api_allows,
    build_manifest,
    check_manifest,
    parse_manifest,
    read_manifest,
    write_manifest,
)


class Push(FieldLaw):
    """A push: F = c."""

    id = "toys:push"
    role = "push"
    c = Param((1.0, 0.0, 0.0), unit="N", doc="Push.")

    def force(self, body: Any) -> Any:
        return self.c


class Box(LawContainer):
    """Holds pushes."""

    id = "toys:box"
    accepts_role = "push"


class Torus:
    """A ring."""

    offers = "shape"
    kind = "torus"


@pytest.fixture
def pack(tmp_path: Path) -> Any:
    module: Any = types.ModuleType("toys")
    module.Push, module.Box, module.Torus = Push, Box, Torus
    module.__all__ = ["Push", "Box", "Torus"]
    module.__file__ = str(tmp_path / "__init__.py")
    return module


def test_a_manifest_lists_what_the_pack_offers(pack: Any) -> None:
    built = build_manifest(pack)
    assert built == {
        "schema": 1,
        "pack": "toys",
        "api": ">=1,<2",
        "laws": [
            {
                "id": "toys:push",
                "role": "push",
                "kind": "field",
                "params": [
                    {"name": "c", "kind": "vector", "unit": "N", "default": [1.0, 0.0, 0.0], "doc": "Push.", "size": 3}
                ],
                "doc": "A push: F = c.",
                "form": "formula",
                "class": f"{__name__}:Push",
                "nature": "constant; no potential: its work is reported; 0 operations",
            }
        ],
        "containers": [{"id": "toys:box", "class": f"{__name__}:Box", "doc": "Holds pushes."}],
        "shapes": [{"id": "toys:torus", "class": f"{__name__}:Torus", "doc": "A ring."}],
        "steppers": [],
        "contact_servers": [],
    }


def test_a_manifest_just_written_is_not_stale(pack: Any, tmp_path: Path) -> None:
    assert "there is no manifest" in check_manifest(pack)
    path = write_manifest(pack)
    assert path == tmp_path / "xpheve.json"
    assert check_manifest(pack) == ""
    first = path.read_bytes()
    write_manifest(pack)
    assert path.read_bytes() == first
    assert [entry.name for entry in tmp_path.iterdir()] == ["xpheve.json"]
    manifest = read_manifest(path, "toys")
    assert [law.id for law in manifest.laws] == ["toys:push"]
    assert manifest.classes["container"] == {"toys:box": f"{__name__}:Box"}


def test_a_stale_manifest_says_what_has_changed(pack: Any) -> None:
    path = write_manifest(pack)
    pack.__all__ = ["Box", "Torus", "Pull"]
    pack.Pull = type("Pull", (Push,), {"id": "toys:pull", "__doc__": "A pull.", "__module__": "toys"})
    said = check_manifest(pack)
    assert said == f"{path} is stale: toys:pull is missing; toys:push is no more. Run: xpheve manifest --write"
    pack.__all__ = ["Push", "Box", "Torus"]
    written = json.loads(path.read_text())
    written["laws"][0]["params"][0]["unit"] = "kN"
    path.write_text(json.dumps(written))
    assert "toys:push has another params" in check_manifest(pack)
    path.write_text(path.read_text()[:-20])
    assert "cannot be read" in check_manifest(pack)


def test_a_pack_may_say_which_law_api_it_is_for(pack: Any) -> None:
    pack.XPHEVE_API = ">=1,<4"
    assert build_manifest(pack)["api"] == ">=1,<4"


def test_an_unsound_pack_gets_no_manifest(pack: Any, tmp_path: Path) -> None:
    pack.__all__.append("Gone")
    with pytest.raises(PackError, match="names 'Gone', which is not there"):
        write_manifest(pack)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(PackError, match="say the name of the pack"):
        build_manifest(types.ModuleType("nothing"))


@pytest.mark.parametrize(
    ("needed", "version", "allowed"),
    [(">=1,<2", 1, True), (">=1,<2", 2, False), ("1", 1, True), ("1", 2, False), ("==2", 2, True), ("!=2", 2, False),
     (">1", 1, False), ("<=3, >=2", 3, True), (" >= 1 , < 3 ", 2, True)],
)  # fmt: skip
def test_ranges_of_the_law_api(needed: str, version: int, allowed: bool) -> None:
    assert api_allows(needed, version) is allowed


@pytest.mark.parametrize("needed", ["", "soon", ">=", "1.2", "~=1", ">=1,", "\u00b2", "9" * 5000])
def test_what_is_no_range_is_refused(needed: str) -> None:
    with pytest.raises(ValueError, match="is meant"):
        api_allows(needed)


def test_a_manifest_of_a_later_xpheve_with_more_fields_is_read(pack: Any) -> None:
    built = json.loads(json.dumps(build_manifest(pack)))
    built["more"] = 1
    built["laws"][0]["more"] = {"x": 1}
    built["laws"][0]["params"][0]["more"] = 1
    assert [law.id for law in parse_manifest(built, "toys").laws] == ["toys:push"]
