"""Run the benchmarks of smooth motion: tables, files, plots, the page; 1 if a bar of error is missed."""

from __future__ import annotations

import statistics
import sys
from collections.abc import Sequence
from dataclasses import replace
from types import ModuleType
from typing import Any

from benchmarks import turns
from benchmarks.command import Command, Peers, told
from benchmarks.peers import SMOOTH
from benchmarks.smooth import ours
from benchmarks.smooth.problem import Problem
from benchmarks.smooth.report import SECTION

SCENES = (
    "thrown",
    "s04_free_spin",
    "kepler",
    "figure_eight",
    "pythagorean",
    "outer_solar_system",
    "stiff_spring",
    "stiff_chain",
    "van_der_pol",
    "robertson",
    "gyration",
    "magnetic_bottle",
    "heavy_top",
    "gravity_gradient",
)
SPECIALS = ("kepler_outputs", "energy_growth", "dust")


def rows(module: ModuleType, peers: Peers, samples: int, quick: bool) -> list[dict[str, Any]]:
    """What is told of the scenes of a module; one with ``VARIANTS`` is the same scene with several starts."""
    if hasattr(module, "VARIANTS"):
        return [many_starts(module.VARIANTS[: 3 if quick else None], peers, samples)]
    return [one_scene(problem, peers, samples) for problem in module.PROBLEMS]


def one_scene(problem: Problem, peers: Peers, samples: int) -> dict[str, Any]:
    """The rows of a scene, and what is needed to tell of them."""
    contenders = ours.contenders(problem)
    for peer in peers.values():
        contenders += peer.smooth(problem)
    return told(problem, turns.take_turns(problem, contenders, samples))


def many_starts(variants: Sequence[Problem], peers: Peers, samples: int) -> dict[str, Any]:
    """The same with several starts: each row is the median error, and the time of one run, over all."""
    each = [ours.contenders(problem) for problem in variants]
    for peer in peers.values():
        for problem, found in zip(variants, each, strict=True):
            found += peer.smooth(problem)
    together = [turns.together(column) for column in zip(*each, strict=True)]

    def error(ends: Any) -> float:
        return statistics.median(problem.error(end) for problem, end in zip(variants, ends, strict=True))

    def drift(ends: Any) -> float:
        return statistics.median(
            abs(problem.drift(end)) for problem, end in zip(variants, ends, strict=True) if problem.drift
        )

    return told(
        variants[0], turns.take_turns(replace(variants[0], error=error, drift=drift), together, min(samples, 5))
    )


COMMAND = Command(__doc__, "benchmarks.scenes", SCENES, SPECIALS, SMOOTH, SECTION, rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    return COMMAND.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
