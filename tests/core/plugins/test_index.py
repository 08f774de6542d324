"""The index: packs are found without importing them, quickly, and nothing about its cache can do harm."""

from __future__ import annotations

import os
import shutil
import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from xpheve.plugins.index import cache_folder, locate, read_index


@pytest.fixture(autouse=True)
def _own_cache(site: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(site.cache))


def names(site: Any) -> list[tuple[str, str]]:
    return sorted((offer.name, offer.version) for offer in read_index([str(site.path)]).offers)


def test_packs_are_found_by_their_entry_points(site: Any) -> None:
    site.pack("aero", version="1.2", manifest={})
    (site.path / "numpy-2.0.dist-info").mkdir()
    other = site.path / "other-1.0.dist-info"
    other.mkdir()
    (other / "entry_points.txt").write_text("[console_scripts]\nother = other:main\n")
    (offer,) = read_index([str(site.path)]).offers
    assert (offer.name, offer.module, offer.manifest) == ("aero", "xpheve_aero", "xpheve_aero:xpheve.json")
    assert (offer.distribution, offer.version) == ("xpheve-aero", "1.2")


def test_an_egg_info_counts_too(site: Any) -> None:
    info = site.pack("aero")
    info.rename(site.path / "xpheve_aero.egg-info")
    (site.path / "xpheve_aero.egg-info" / "METADATA").rename(site.path / "xpheve_aero.egg-info" / "PKG-INFO")
    assert names(site) == [("aero", "1.0")]


def test_the_second_reading_is_warm_and_the_same(site: Any) -> None:
    site.pack("aero")
    site.settle()
    cold, warm = read_index([str(site.path)]), read_index([str(site.path)])
    assert not cold.warm and warm.warm
    assert cold.offers == warm.offers


@pytest.mark.parametrize("settled", [True, False])
def test_what_is_installed_changed_or_removed_is_noticed(site: Any, settled: bool) -> None:
    first = site.pack("aero")
    if settled:
        site.settle()
    assert names(site) == names(site) == [("aero", "1.0")]
    second = site.pack("toys", version="0.3")
    assert names(site) == [("aero", "1.0"), ("toys", "0.3")]
    text = (second / "entry_points.txt").read_text()
    (second / "entry_points.txt").write_text(text.replace("toys =", "game ="))
    assert names(site) == [("aero", "1.0"), ("game", "0.3")]
    shutil.rmtree(first)
    assert names(site) == [("game", "0.3")]
    (second / "entry_points.txt").unlink()
    assert names(site) == []
    (second / "entry_points.txt").write_text(text)
    assert names(site) == [("toys", "0.3")]


def test_a_change_within_one_tick_of_the_clock_is_noticed(site: Any) -> None:
    info = site.pack("aero")
    assert names(site) == [("aero", "1.0")]
    entry = info / "entry_points.txt"
    before = entry.stat()
    entry.write_text(entry.read_text().replace("aero =", "oare ="))
    os.utime(entry, ns=(before.st_atime_ns, before.st_mtime_ns))  # same size, same time: only mistrust helps
    assert names(site) == [("oare", "1.0")]


@pytest.mark.parametrize(
    "harm",
    [
        lambda data: b"",
        lambda data: data[: len(data) // 2],
        lambda data: data[:-1],
        lambda data: data.replace(b"aero", b"evil"),
        lambda data: b"\xff\xfe" + os.urandom(200),
        lambda data: data.replace(b"xpheve-index 1", b"xpheve-index 2"),
        lambda data: b"[]",
        lambda data: b"[" * 100_000,
    ],
)
def test_a_cache_that_is_torn_or_foreign_is_searched_anew(site: Any, harm: Callable[[bytes], bytes]) -> None:
    site.pack("aero")
    site.settle()
    read_index([str(site.path)])
    (kept,) = site.cache.iterdir()
    kept.write_bytes(harm(kept.read_bytes()))
    again = read_index([str(site.path)])
    assert not again.warm
    assert [offer.module for offer in again.offers] == ["xpheve_aero"]
    assert read_index([str(site.path)]).warm


def test_a_cache_that_cannot_be_read_or_written_is_no_error(
    site: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site.pack("aero")
    site.settle()
    blocked = tmp_path / "file"
    blocked.write_text("a file where a folder should be")
    for folder in (str(blocked), str(blocked / "below"), "/proc/nowhere", "\0"):
        if "\0" not in folder:
            monkeypatch.setenv("XPHEVE_CACHE_DIR", folder)
        assert names(site) == [("aero", "1.0")]
    read_index([str(site.path)])
    monkeypatch.setenv("XPHEVE_CACHE_DIR", str(site.cache))
    read_index([str(site.path)])
    (kept,) = site.cache.iterdir()
    kept.unlink()
    kept.mkdir()
    assert names(site) == [("aero", "1.0")]
    assert [path.name for path in site.cache.iterdir()] == [kept.name]  # nothing is left lying about


def test_old_caches_do_not_pile_up(site: Any) -> None:
    site.cache.mkdir()
    for number in range(80):
        (site.cache / f"index-{number:08d}").write_text("old")
    site.pack("aero")
    read_index([str(site.path)])
    assert len(list(site.cache.iterdir())) == 64


def test_a_cache_that_belongs_to_somebody_else_is_not_trusted(site: Any) -> None:
    if not hasattr(os, "getuid") or os.getuid() != 0:
        pytest.skip("only root can give files away")
    site.pack("aero")
    site.settle()
    read_index([str(site.path)])
    (kept,) = site.cache.iterdir()
    os.chown(kept, 12345, -1)
    assert not read_index([str(site.path)]).warm


def test_a_folder_that_changes_all_the_time_does_not_make_the_others_slow(site: Any, tmp_path: Path) -> None:
    site.pack("aero")
    site.settle()
    work = tmp_path / "work"
    work.mkdir()
    read_index([str(work), str(site.path)])
    (work / "result.csv").write_text("new")
    index = read_index([str(work), str(site.path)])
    assert index.warm
    assert [offer.name for offer in index.offers] == ["aero"]


def test_the_cache_folder_is_the_users(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XPHEVE_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert cache_folder() == os.path.join("/somewhere", "xpheve")
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    assert cache_folder() == str(Path.home() / ".cache" / "xpheve")


def test_metadata_that_cannot_be_read_are_named_and_hinder_no_others(site: Any) -> None:
    site.pack("aero")
    bad = site.pack("toys")
    (bad / "entry_points.txt").write_bytes(b"[xpheve.packs]\n\xff\xff")
    huge = site.pack("huge")
    (huge / "entry_points.txt").write_bytes(b"#" * (2 << 20))
    index = read_index([str(site.path)])
    assert [offer.name for offer in index.offers] == ["aero"]
    assert sorted(Path(info).name for info, _ in index.problems) == [
        "xpheve_huge-1.0.dist-info",
        "xpheve_toys-1.0.dist-info",
    ]


def test_a_distribution_found_twice_counts_as_python_imports_it(site: Any, tmp_path: Path) -> None:
    site.pack("aero", version="1.0")
    later = tmp_path / "later"
    shutil.copytree(site.path, later)
    (later / "xpheve_aero-1.0.dist-info").rename(later / "xpheve_aero-2.0.dist-info")
    assert [offer.version for offer in read_index([str(site.path), str(later)]).offers] == ["1.0"]
    assert len(read_index(["", "/nowhere", str(site.path), str(site.path)]).offers) >= 1


def test_a_manifest_is_located_without_importing(site: Any, tmp_path: Path) -> None:
    site.pack("aero", "raise SystemExit", manifest={})
    source = tmp_path / "src"
    site.pack("far", "raise SystemExit", manifest={}, home=source)
    path = [str(site.path), str(source)]
    assert locate("xpheve_aero:xpheve.json", path) == str(site.path / "xpheve_aero" / "xpheve.json")
    assert locate("xpheve_aero.laws:xpheve.json", path) == str(site.path / "xpheve_aero" / "xpheve.json")
    assert locate("xpheve_far:xpheve.json", path) == str(source / "xpheve_far" / "xpheve.json")
    assert locate("xpheve_aero:other.json", path) == ""
    assert locate("no_such_package:xpheve.json", path) == ""
    for wrong in ("xpheve_aero:../secret", "xpheve_aero:/etc/passwd", "xpheve aero:x", ":x", "xpheve_aero:", "../a:b"):
        with pytest.raises(ValueError, match="is needed"):
            locate(wrong, path)
    assert not any(name.startswith("xpheve_aero") for name in sys.modules)


def test_an_editable_install_by_finder_is_located_without_importing(site: Any, tmp_path: Path) -> None:
    source = tmp_path / "elsewhere"
    site.pack("aero", "raise RuntimeError('imported')", manifest={}, home=source)
    out = site.run(
        f"""
        from importlib.machinery import PathFinder
        class Finder:
            @staticmethod
            def find_spec(name, path=None, target=None):
                return PathFinder.find_spec(name, [{str(source)!r}]) if name == "xpheve_aero" else None
        sys.meta_path.append(Finder)
        from xpheve.plugins.index import locate
        out = [locate("xpheve_aero:xpheve.json", [SITE]), "xpheve_aero" in sys.modules]
        """
    )
    assert out == [str(source / "xpheve_aero" / "xpheve.json"), False]


def test_a_hundred_unused_packs_cost_less_than_five_milliseconds_and_are_not_imported(site: Any) -> None:
    for number in range(100):
        site.pack(f"p{number}", "raise RuntimeError('imported')")
    site.pack("aero")
    site.settle()
    code = """
    import time
    from xpheve.plugins.index import read_index
    def once():
        started = time.perf_counter()
        index = read_index([SITE, *sys.path])
        return time.perf_counter() - started, index.warm, len(index.offers)
    runs = [once() for _ in range(12)]
    law = registry.law("aero:wind").__name__
    out = [[seconds for seconds, _, _ in runs], [warm for _, warm, _ in runs], runs[-1][2], law,
           sum(name.startswith("xpheve_p") for name in sys.modules)]
    """
    site.run(code)
    seconds, warm, count, law, imported = site.run(code)
    assert all(warm)
    assert count >= 101
    assert law == "Wind"
    assert imported == 0
    assert statistics.median(seconds) < 0.005
    assert seconds[0] < 0.02  # the very first, on a machine that does other things too


def test_the_door_imports_nothing_heavy(site: Any) -> None:
    out = site.run(
        """
        import xpheve.plugins, xpheve.units
        from xpheve.plugins import Registry
        registry.packs()
        heavy = ("pydantic", "pluggy", "importlib.metadata", "numpy", "numba", "xpheve_laws_basic")
        out = [name for name in heavy if name in sys.modules]
        """
    )
    assert out == []
