"""A law switched off and on again and again: what each switch costs, and what the loop costs afterwards."""

from __future__ import annotations

from typing import Any

from benchmarks.tracing import air
from benchmarks.tracing.runner import clock_time, in_turns, ratio, steps_for

LOOP_BAR, RELINK_BAR = 1.25, 1.0
SWITCHES = 10


def measure(samples: int, n: int = 1000, steps: int | None = None) -> dict[str, Any]:
    """Two engines of the same scene, the wind of one switched ten times; one more that has no wind, beside which it should cost nothing when off."""
    dt = 2.0**-16
    begin = air.start(n)
    untouched, _ = air.in_engine(begin, dt)
    switched, laws = air.in_engine(begin, dt)
    without, others = air.in_engine(begin, dt)
    others[2].enabled = False
    for runner in (untouched, switched, without):
        runner.advance(1)
    one = min(clock_time(lambda: switched.advance(1)) for _ in range(samples))

    def switch() -> None:
        laws[2].enabled = not laws[2].enabled
        switched.advance(1)

    costs = [clock_time(switch) - one for _ in range(SWITCHES)]
    value = clock_time(lambda: (setattr(laws[1], "density", 1.2), switched.advance(1))) - one
    laws[1].density = air.DENSITY
    steps = steps or steps_for(untouched)
    assert laws[2].enabled
    on = in_turns({"switched": switched, "untouched": untouched}, steps, samples)
    laws[2].enabled = False
    switched.advance(1)
    off = in_turns({"switched": switched, "without": without, "untouched": untouched}, steps, samples)
    found = {
        "loop": ratio(on, "switched", "untouched"),
        "off": ratio(off, "switched", "untouched"),
        "off beside without": ratio(off, "switched", "without"),
        "first": costs[0],
        "switches": costs,
        "parameter": value,
    }
    return {"n": n, "steps": steps, **found, "verdicts": verdicts(found)}


def verdicts(found: dict[str, Any]) -> list[dict[str, Any]]:
    """What was asked for, with its bars."""
    each = ", ".join(f"{1e3 * cost:.2f}" for cost in found["switches"])
    return [
        {
            "what": "loop after ten switches, the law on / loop of a law never switched",
            "value": found["loop"],
            "unit": "times",
            "bar": LOOP_BAR,
            "met": found["loop"] <= LOOP_BAR,
            "note": "",
        },
        {
            "what": "the same, the law off",
            "value": found["off"],
            "unit": "times",
            "bar": LOOP_BAR,
            "met": found["off"] <= LOOP_BAR,
            "note": f"{found['off beside without']:.2f} times that of a law off from the start",
        },
        {
            "what": "the wait at the first switch",
            "value": found["first"],
            "unit": "s",
            "bar": RELINK_BAR,
            "met": found["first"] <= RELINK_BAR,
            "note": f"switches one to ten [ms]: {each}",
        },
        {
            "what": "the wait when a parameter is set",
            "value": found["parameter"],
            "unit": "s",
            "bar": None,
            "met": None,
            "note": "nothing is compiled",
        },
    ]
