"""A command that measures scenes side by side with peers: tables, files, plots, the page; 1 if a bar is missed."""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks import pages
from benchmarks.calibrate import calibrate, machine
from benchmarks.measure import SAMPLES, Row
from benchmarks.peers import adapter, version
from benchmarks.problem import Scene

ROOT = Path(__file__).resolve().parents[1]
Peers = dict[str, ModuleType]


@dataclass(frozen=True)
class Command:
    """Which scenes there are, who the peers are, and how the rows of a scene are made.

    A module of ``scenes`` in ``package`` has ``PROBLEMS``; one of ``specials`` has ``measure(samples, quick, peers)``, which gives a table
    of its own. ``rows(module, peers, samples, quick)`` gives what is told of the scenes of a module.
    """

    about: str
    package: str
    scenes: Sequence[str]
    specials: Sequence[str]
    adapters: Mapping[str, str]
    section: pages.Section
    rows: Callable[[ModuleType, Peers, int, bool], list[dict[str, Any]]]

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Measure what was asked for, and write it."""
        parser = argparse.ArgumentParser(prog=f"benchmarks/{self.section.name}/run", description=self.about)
        parser.add_argument(
            "--scene", action="append", choices=[*self.scenes, *self.specials], help="only this one; may be given again"
        )
        parser.add_argument(
            "--peer", action="append", choices=[*self.adapters, "none"], help="only this one; 'none' for none"
        )
        parser.add_argument("--quick", action="store_true", help="one sample, little of all: to see that all works")
        parser.add_argument(
            "--out", type=Path, help="folder for the results (default: benchmarks/results; of a part, .benchmarks)"
        )
        parser.add_argument("--page", action="store_true", help="put the results into docs/benchmarks.md, too")
        chosen = parser.parse_args(arguments)

        names = [name for name in (chosen.peer or self.adapters) if name != "none"]
        whole = not chosen.quick and not chosen.scene and not chosen.peer
        out = chosen.out or ROOT / ("benchmarks/results" if whole else ".benchmarks")
        peers = {name: adapter(name, self.adapters) for name in names}
        wanted = chosen.scene or [*self.scenes, *self.specials]
        results = pages.rounded(self.collect(wanted, peers, quick=chosen.quick))
        self.section.write(results, out)
        text = pages.table(results)
        print(text)
        if chosen.page:
            self.section.put_into_page(text, ROOT / "docs" / "benchmarks.md")
        missed = [f"{scene}: {one.text}: {one.found}" for scene, one in pages.verdicts(results) if one.met is False]
        for line in missed:
            print(f"missed: {line}", file=sys.stderr)
        return 1 if missed else 0

    def collect(self, names: Sequence[str], peers: Mapping[str, ModuleType | None], *, quick: bool) -> dict[str, Any]:
        """Everything measured, as plain values."""
        samples = 1 if quick else SAMPLES
        results: dict[str, Any] = {
            "machine": machine(),
            "calibration": calibrate(3 if quick else samples),
            "samples": samples,
            "quick": quick,
            "peers": {name: None if peer is None else version(name) for name, peer in peers.items()},
            "scenes": [],
            "specials": [],
        }
        # What a row warned of at its first run stands in the row.
        warnings.simplefilter("ignore")
        installed = {name: peer for name, peer in peers.items() if peer is not None}
        for name in names:
            begin, spent = time.perf_counter(), time.process_time()
            module = import_module(f"{self.package}.{name}")
            if name in self.specials:
                results["specials"].append(_special(name, module, samples, quick, tuple(installed)))
            else:
                results["scenes"] += self.rows(module, installed, samples, quick)
            clock, cpu = time.perf_counter() - begin, time.process_time() - spent
            print(f"{name}: {clock:.1f} s, {cpu:.1f} s of CPU", file=sys.stderr, flush=True)
        return results


def _special(name: str, module: ModuleType, samples: int, quick: bool, peers: tuple[str, ...]) -> dict[str, Any]:
    """The table of a special; one that fails is a bar that is missed, and not the end of all."""
    try:
        return module.measure(samples, quick, peers)  # type: ignore[no-any-return]
    except Exception as wrong:
        said = f"{type(wrong).__name__}: {' '.join(str(wrong).split())[:300]}"
        bars = [{"text": "it runs", "found": said, "met": False}]
        title = (module.__doc__ or "").partition("\n")[0]
        return {"id": name, "title": title, "names": ("what",), "rows": [[said]], "text": "", "bars": bars}


def told(scene: Scene, rows: Sequence[Row]) -> dict[str, Any]:
    """The rows of a scene, and what is needed to tell of them, as plain values."""
    return {
        "id": scene.id,
        "title": scene.title,
        "metric": scene.metric,
        "file": scene.file,
        "notes": scene.notes,
        "bars": [asdict(bar) for bar in scene.bars],
        "rows": [row.plain() for row in rows],
    }
