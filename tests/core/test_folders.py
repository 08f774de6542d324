"""One rule says where caches lie; a setting that makes no sense moves nothing into the working folder."""

from __future__ import annotations

import os
import sys

import pytest

from xpheve.folders import cache_folder


@pytest.fixture(autouse=True)
def _home(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XPHEVE_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    monkeypatch.setattr(os.path, "expanduser", lambda path: path.replace("~", "/home/newton"))
    monkeypatch.setattr(sys, "platform", "linux")


def test_xpheves_own_setting_wins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XPHEVE_CACHE_DIR", "/mine")
    assert cache_folder() == cache_folder(xdg=True) == os.path.abspath("/mine")
    monkeypatch.setenv("XPHEVE_CACHE_DIR", "mine")
    assert cache_folder() == os.path.join(os.getcwd(), "mine")


def test_the_setting_for_all_caches_counts_only_where_it_is_asked_for() -> None:
    assert cache_folder() == os.path.join("/home/newton", ".cache", "xpheve")
    assert cache_folder(xdg=True) == os.path.join("/somewhere", "xpheve")


@pytest.mark.parametrize("named", ["", "relative", "./here"])
def test_a_setting_that_is_no_absolute_path_is_none(monkeypatch: pytest.MonkeyPatch, named: str) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", named)
    assert cache_folder(xdg=True) == os.path.join("/home/newton", ".cache", "xpheve")


def test_every_system_has_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    assert cache_folder() == os.path.join("/home/newton", "Library", "Caches", "xpheve")
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", "/users/newton/local")
    assert cache_folder() == os.path.join("/users/newton/local", "xpheve")
    monkeypatch.setenv("LOCALAPPDATA", "")
    assert cache_folder() == os.path.join("/home/newton", "AppData", "Local", "xpheve")


def test_a_user_without_a_home_has_no_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    assert cache_folder() == ""
