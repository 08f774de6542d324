"""Sums over many bodies beside REBOUND's: all find the same accelerations, results are told as found."""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


def load(name: str) -> Any:
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    return importlib.import_module(f"benchmarks.long_range.{name}")


contenders, main = load("contenders"), load("__main__")
X = contenders.plummer(300)
EVERY = np.arange(300)


def test_ours_find_what_long_double_finds() -> None:
    right = contenders.exact(X, EVERY)
    assert contenders.errors(contenders.OurDirect(X).read(), right)[1] < 1e-14
    tree = contenders.OurTree(X, 1e-3)
    assert contenders.errors(tree.read(), right)[1] < 2e-3 and tree.told <= 1e-3


@pytest.mark.parametrize("setting", [("basic", 0.0, 1e-14), ("tree", 0.3, 0.05)])
def test_rebound_finds_the_same(setting: tuple[str, float, float]) -> None:
    pytest.importorskip("rebound")
    gravity, angle, error = setting
    peer = contenders.Rebound(X, gravity, angle)
    peer.act()
    assert contenders.errors(peer.read(), contenders.exact(X, EVERY))[1] < error


def test_the_kept_results_are_told_as_they_are() -> None:
    results = json.loads((ROOT / "benchmarks" / "results" / "long_range.json").read_text(encoding="utf-8"))
    assert (ROOT / "benchmarks" / "results" / "long_range.md").read_text(encoding="utf-8") == main.tables(results)
    for one in results["tree"]:
        assert one["met"] == main.tree_met(one["n"], one["rows"], one["ratios"])


def test_a_bar_is_missed_by_time_or_by_error() -> None:
    rows = {"xpheve 0.001": {"p99": 9e-4}}
    good, slow, none = ({"peer": {"ratio": ratio}} for ratio in (0.4, 0.6, None))
    assert main.tree_met(100_000, rows, good) is True
    assert main.tree_met(100_000, rows, slow) is False and main.tree_met(100_000, rows, none) is False
    assert main.tree_met(100_000, {"xpheve 0.001": {"p99": 2e-3}}, good) is False
    assert main.tree_met(10_000, rows, slow) is None
