"""S9: a bullet of radius 0.01 m flies at a wall 0.01 m thick, at 10 to 10,000 m/s: who stops it.

Ours besides: at restitution 0 the speed and the gap that are left, at restitution 1 the instant of the impact against fractions.
"""

from __future__ import annotations

from fractions import Fraction
from importlib import import_module
from typing import Any

from benchmarks.impacts import ours
from benchmarks.impacts.stage import Stage, Thing, step_of
from benchmarks.peers import IMPACTS

SPEEDS, RADIUS, THICK, SPAN, AWAY = (10.0, 100.0, 1_000.0, 10_000.0), 0.01, 0.01, 0.1, 0.5
STEPS = (1 / 60, 1 / 240, 1 / 1000)
NAMES = ("engine", "setting", *(f"{speed:,.0f} m/s" for speed in SPEEDS))


def stage(speed: float, restitution: float = 0.0) -> Stage:
    """The bullet at x = -0.5 m, and the wall about x = 0."""
    wall = Thing("box", (0.5 * THICK, 50.0, 50.0))
    bullet = Thing("sphere", (RADIUS,), (-AWAY, 0.0, 0.0), (speed, 0.0, 0.0), mass=0.01)
    return Stage([wall, bullet], restitution)


def ended(speed: float, restitution: float) -> tuple[float, float]:
    """Where the bullet of xPheve is in the end [m], and its speed [m/s]."""
    engine = ours.new_engine()
    (bullet,) = ours.fill(engine, stage(speed, restitution))
    engine.run(until=SPAN)
    return bullet.position[0], bullet.velocity[0]


def instant_error(speed: float) -> float:
    """At restitution 1: the instant of the impact [s], read from where the bullet is in the end, against that of the floats given."""
    x, v = ended(speed, 1.0)
    face = -Fraction(0.5 * THICK) - Fraction(RADIUS)
    exact = (face + Fraction(AWAY)) / Fraction(speed)
    if v != -speed:
        return float("inf")
    found = Fraction(SPAN) - (Fraction(x) - face) / Fraction(v)
    return abs(float(found - exact))


def measure(samples: int, quick: bool, peers: tuple[str, ...]) -> dict[str, Any]:
    """A row a setting: where the bullets are."""
    speeds = SPEEDS[:2] if quick else SPEEDS
    away = -RADIUS - 0.5 * THICK
    mine = [ended(speed, 0.0) for speed in speeds]
    rows = [["xPheve", "restitution 0", *(_told(x, v) for x, v in mine)]]
    late = [instant_error(speed) for speed in speeds]
    rows.append(["xPheve", "restitution 1: error of the instant", *(f"{one:.0e} s" for one in late)])
    for peer in peers:
        module = import_module(IMPACTS[peer])
        for setting in getattr(module, "BULLETS", ("default", "tuned")) if hasattr(module, "World") else ():
            for dt in STEPS[:1] if quick else STEPS:
                rows.append([f"{module.NAME} {setting}", step_of(dt), *(_peer(module, setting, dt, v) for v in speeds)])
    gap, speed = max(abs(x - away) for x, _ in mine), max(abs(v) for _, v in mine)
    return {
        "id": "S9",
        "title": "bullets at a wall of 1 cm",
        "names": NAMES[: 2 + len(speeds)],
        "rows": rows,
        "text": f"Stopped at the face the centre is at {away:g} m. The 1,000 random cases of spheres, rods and moving walls are tests.",
        "bars": [
            {
                "text": "none passes",
                "found": f"{sum(x > 0 for x, _ in mine)} of {len(mine)}",
                "met": all(x < 0 for x, _ in mine),
            },
            {"text": "restitution 0: speed left below 1e-9 m/s", "found": f"{speed:.1e}", "met": speed < 1e-9},
            {"text": "restitution 0: at the wall within 1e-9 m", "found": f"{gap:.1e}", "met": gap < 1e-9},
            {"text": "restitution 1: instant within 1e-12 s", "found": f"{max(late):.1e}", "met": max(late) <= 1e-12},
        ],
    }


def _peer(module: Any, setting: str, dt: float, speed: float) -> str:
    world = module.World(stage(speed), setting, dt)
    world.advance(round(SPAN / dt))
    end = world.read()
    return _told(float(end.position[0, 0]), float(end.velocity[0, 0]))


def _told(x: float, v: float) -> str:
    if x != x or abs(x) > 1e9:
        return "not finite"
    said = "**passes**" if x > 0.5 * THICK else "stopped" if abs(v) < 1e-2 else "thrown back" if v < 0 else "inside"
    return f"{said}, {x:.4g} m"
