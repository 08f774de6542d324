"""RealClock: t = speed * (t_system - t_start - t_paused) + origin."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.errors import InvalidValueError, StateError
from xpheve.realtime import RealClock


class System:
    """A time of the system that the test sets."""

    def __init__(self, now: float = 0.0) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now


def test_it_stands_at_its_origin_until_it_is_started() -> None:
    system = System(5.0)
    clock = RealClock(origin=2.0, source=system)
    system.now = 9.0
    assert clock.time == 2.0 and not clock.running
    clock.start()
    system.now = 10.5
    assert clock.time == 3.5 and clock.running
    with pytest.raises(StateError, match="started already"):
        clock.start()


def test_a_pause_that_still_runs_counts_and_several_add_up() -> None:
    system = System(10.0)
    clock = RealClock(source=system)
    clock.start()
    for begin, end in ((11.0, 12.0), (13.0, 15.0)):
        system.now = begin
        clock.pause()
        system.now = 0.5 * (begin + end)
        assert clock.time == begin - 10.0 - (begin == 13.0)
        system.now = end
        clock.resume()
    system.now = 17.0
    assert clock.paused == 3.0 and clock.time == 4.0
    clock.pause()
    system.now = 1e6
    assert clock.time == 4.0 and clock.paused == 3.0 + 1e6 - 17.0
    clock.pause()  # nothing more
    clock.resume()
    assert clock.time == 4.0


def test_speed_is_simulated_seconds_per_second() -> None:
    system = System()
    clock = RealClock(speed=0.25, origin=1.0, source=system)
    clock.start()
    system.now = 8.0
    assert clock.time == 3.0
    assert clock.system_at(4.0) == 12.0


def test_a_pause_may_have_begun_before_it_is_told() -> None:
    system = System()
    clock = RealClock(source=system)
    clock.start()
    system.now = 3.0
    clock.pause(at=clock.system_at(2.5))
    assert clock.time == 2.5
    clock.resume()
    system.now = 4.0
    assert clock.time == 3.5


@pytest.mark.parametrize(
    "given", [{"speed": 0}, {"speed": -1.0}, {"speed": math.inf}, {"speed": "1"}, {"origin": math.nan}, {"source": 3}]
)
def test_what_makes_no_sense_is_refused(given: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(given))):
        RealClock(**given)


@given(st.lists(st.tuples(st.sampled_from(["go", "pause", "resume"]), st.integers(0, 1000)), max_size=30))
def test_whatever_happens_it_counts_the_time_it_ran(steps: list[tuple[str, int]]) -> None:
    system = System(100.0)
    clock = RealClock(source=system)
    clock.start()
    ran, running = 0, True
    for what, span in steps:
        if what == "pause":
            clock.pause()
            running = False
        elif what == "resume":
            clock.resume()
            running = True
        system.now += span
        ran += span if running else 0
        assert clock.time == ran
