"""Thesis 1.4: laws that wake when needed, beside laws that run at each update: same motion, and how much less is asked."""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


def load(name: str) -> Any:
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    return importlib.import_module(name)


noope = load("benchmarks.noope")
N = 30
NEEDED, STORED, ARRAYS = noope.SETTINGS


def bounces(height: float) -> int:
    """How often what is let go at ``height`` [m] bounces until the end."""
    time, count = (2 * height / noope.GRAVITY) ** 0.5, 0
    flight = 2 * time
    while time <= noope.SPAN:
        count += 1
        flight *= noope.RESTITUTION
        time += flight
    return count


@pytest.mark.parametrize("quiet", [False, True])
def test_when_needed_is_exact_and_asks_for_what_happens_and_no_more(quiet: bool) -> None:
    run = noope.run_once(NEEDED, None, n=N, quiet=quiet)
    blown = N // 3
    happened = 0 if quiet else sum(bounces(h - noope.RADIUS) for h in noope.heights(N).tolist())
    expected = {
        "noope:bounce": happened,
        "noope:gravity": N + 2 * blown + 1,  # at the start, when the wind comes and goes, and for the mass that was set
        "noope:scale": 1,
        "noope:switch": 2,
        "noope:wind": blown,
    }
    assert run["by law"] == {law: count for law, count in expected.items() if count}
    assert run["error"] < 1e-12 and run["noted"] == 1


@pytest.mark.parametrize("quiet", [False, True])
@pytest.mark.parametrize("setting", [STORED, ARRAYS])
def test_at_each_update_everything_is_asked_and_the_motion_is_the_same_within_the_error_of_a_step(
    setting: str, quiet: bool
) -> None:
    steps = 4 * 60
    run = noope.run_once(setting, 1 / 60, n=N, quiet=quiet)
    everybody = {"noope:bounce": N, "noope:door": 1, "noope:gravity": N, "noope:scale": N, "noope:wind": N // 3}
    if setting == STORED:
        assert run["by law"] == {law: steps * count for law, count in everybody.items()}
        assert run["calls"] == steps * len(everybody)
    else:  # forces of what bounces are evaluated anew on the way, too
        assert all(run["by law"][law] >= steps * count for law, count in everybody.items())
    assert run["noted"] == 1
    # A push that ends up to a step late is carried on for the rest of the time; a bounce that comes late, too, and there are some.
    late = noope.PUSH * noope.SPAN / 60
    assert 1e-4 < run["error"] < (late if quiet else 1.0)


def test_a_shorter_step_asks_more_and_errs_less() -> None:
    coarse, fine = (noope.run_once(ARRAYS, dt, n=N) for dt in (1 / 60, 1 / 240))
    needed = noope.run_once(NEEDED, None, n=N)
    assert fine["asked"] > 3.5 * coarse["asked"] > 100 * needed["asked"]
    assert fine["error"] < 0.6 * coarse["error"]


def test_a_quick_run_writes_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert noope.main(["--quick", "--samples", "1", "--out", str(tmp_path)]) == 0
    assert "| busy | when needed | none |" in capsys.readouterr().out
    rows = json.loads((tmp_path / "noope.json").read_text())["rows"]
    assert len(rows) == 2 * len(noope.CONTENDERS)
    assert all(row["seconds"] > 0 and row["ratio"] > 0 for row in rows)


def test_the_page_and_the_table_are_made_from_the_results_in_the_repository() -> None:
    folder = ROOT / "benchmarks" / "results"
    text = (folder / "noope.md").read_text(encoding="utf-8")
    assert noope.table(json.loads((folder / "noope.json").read_text(encoding="utf-8"))) == text
    assert text.strip() in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
