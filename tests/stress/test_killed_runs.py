"""kill -9 in the middle of a recorded run: the record opens, and holds a prefix of the undisturbed one, to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest


def test_a_killed_run_leaves_a_prefix_of_its_record(kill_runs: Any, tmp_path: Path) -> None:
    lengths = kill_runs(10, tmp_path)
    assert max(lengths) > 0 and len(set(lengths)) > 2  # killed at several stages


@pytest.mark.stress
def test_fifty_killed_runs_leave_prefixes_of_their_records(kill_runs: Any, tmp_path: Path) -> None:
    lengths = kill_runs(50, tmp_path)
    assert len(set(lengths)) > 5
