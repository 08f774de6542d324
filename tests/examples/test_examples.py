"""Each example runs as a reader would run it, and the errors it prints of itself are below their bars."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"

# What an example prints before each error, and how large that may be at most.
BARS = {
    "front_door": {
        "error of the ball's height": 1e-15,  # m; twice the rounding of heights up to 1 m at most, after three bounces
        "error of the top's angular momentum": 1e-14,  # of 4 kg m^2/s: some roundings of it
    },
    "bouncing_room": {
        "error of the energy balance": 1e-13,
        "farthest into a wall": 1e-12,  # m; the gap at which two bodies count as touching, here of sizes near 1 m
    },
    "solar_system": {
        "dt = 0.25 d: energy drift": 1e-6,  # of order dt^2: 7.5e-7 was seen
        "largest error at dt = 0.25 d": 3e-3,  # Mercury's, after two of its years: 1.5e-3 was seen
        "error of the angular momentum": 1e-14,
    },
    "ten_thousand_years": {
        "largest error, there and back": 1e-11,  # au, after 40 years; rounding: 3e-13 was seen
        "largest distance from core:symplectic8": 1e-11,  # au: 3e-13 was seen
        "drift of the energy": 1e-14,
        "error of the angular momentum": 1e-15,
    },
    "driven_car": {"error of the way and the speed": 1e-14},
    "smoke_and_balls": {
        "puffs; largest distance of one from the closed form": 3e-2,  # m of 15, order 2; near the chimney drag is strong
        "balls; largest distance of one from its way without wind": 1e-13,  # m; other instants at which flights begin anew
    },
    "charged_particles": {
        "largest error of a radius": 1e-4,  # order 2: 5e-5 was seen
        "largest error": 1e-4,
    },
    "pushed_car": {
        "error of the energy balance": 1e-14,
        "error of the way against the closed form": 1e-12,  # m of 3; 37 impacts
        "deepest in the wall": 1e-12,
        "turned by the wall": 1e-12,  # rad/s: it is met by the whole front
    },
    "fireworks": {
        "error of the energy balance": 1e-13,
        "largest error of a place": 1e-2,  # m of 130, order 2 at 1/128 s: 6.8e-3 was seen
    },
    "glb_room": {
        "error of the energy balance": 1e-13,
        "deepest penetration in any frame": 1e-11,  # m; the gap at which bodies count as touching is 1e-12 of their sizes, here 7 m
        "largest error of a last place": 1e-6,  # m; glTF has 32-bit floats
    },
    "six_hundred_balls": {
        "deepest place of a ball in anything": 1e-12,  # m of 9; 1.4e-17 was seen
        "error of the energy balance": 1e-14,
    },
    "balloon_and_car": {
        "largest error against the closed form": 1e-14,
        "error of the energy balance": 1e-14,
    },
}


def test_every_example_has_its_bars() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(BARS)


@pytest.mark.parametrize("name", sorted(BARS))
def test_an_example_runs_and_its_error_is_below_its_bar(name: str, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    command = [sys.executable, "-W", "error", str(EXAMPLES / f"{name}.py"), "--quick", "--out", str(tmp_path / "out")]
    environment = {**os.environ, "MPLCONFIGDIR": str(tmp_path / "matplotlib")}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    for words, bar in BARS[name].items():
        found = re.search(rf"{re.escape(words)}[^\n]*?(\d\.\d+e[+-]\d+)", done.stdout)
        assert found is not None, f"{words!r} was not printed:\n{done.stdout}"
        assert float(found.group(1)) <= bar
    pictures = list((tmp_path / "out").glob("*.png"))
    assert pictures
    assert all(picture.stat().st_size > 10_000 for picture in pictures)


def test_the_planets_errors_fall_with_the_square_of_the_step(tmp_path: Path) -> None:
    """The order that the example measures for each planet is that of core:midpoint."""
    command = [sys.executable, str(EXAMPLES / "solar_system.py"), "--quick"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True)
    orders = [float(line.split()[5]) for line in done.stdout.splitlines() if line.count(" km") == 3]
    assert len(orders) == 8
    assert orders == pytest.approx([2.0] * 8, abs=0.05)
