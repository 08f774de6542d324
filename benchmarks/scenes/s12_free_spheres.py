"""S12: 10,000 spheres falling far apart for 1 s; positions and velocities are read once each 1/60 s. No contacts.

There is a peer that cannot be beaten: the closed form written by hand in NumPy, into arrays made beforehand. It is written twice: over
arrays with a row a sphere, as one would write it, and over arrays with a row a component, the fastest way we know.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

import mpmath
import numpy as np

from benchmarks.ball import DIGITS
from benchmarks.measure import Row, cpu_time, middle, ratio

ID, TITLE = "S12", "10,000 free spheres, one read of all a step"
GRAVITY, SPAN, STEP = 9.81, 1.0, 1.0 / 60.0
RATIO_BAR = 1.3
ERROR_BAR = 1e-12 * 1000.0  # of the largest coordinate [m]


def start(n: int) -> tuple[Any, Any]:
    """Positions [m] 10 m apart and velocities [m/s], shape (n, 3)."""
    k = np.arange(n)
    positions = np.column_stack([10.0 * (k % 100), 10.0 * (k // 100), np.full(n, 100.0)])
    return positions, np.random.default_rng(12).uniform(-1.0, 1.0, (n, 3))


def build(n: int) -> Any:
    """A planned xPheve engine."""
    import xpheve as xp

    engine = xp.PhysicsEngine(up="z")
    gravity = engine.add_law("basic:planet_gravity", acceleration=GRAVITY)
    positions, velocities = start(n)
    engine.add_objects(
        [
            xp.PhysicalObject(xp.Sphere(0.1), mass=1.0, position=place, velocity=velocity)
            for place, velocity in zip(positions.tolist(), velocities.tolist(), strict=True)
        ],
        laws=[gravity],
    )
    engine.run(until=0.0)
    return engine


def exact(place: Any, velocity: Any, t: float) -> list[Any]:
    """Position [m] of one sphere at ``t``, to `DIGITS` digits."""
    with mpmath.workdps(DIGITS):
        s = mpmath.mpf(t)
        drop = (mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(GRAVITY) * s * s / 2)
        return [
            mpmath.mpf(float(x)) + mpmath.mpf(float(v)) * s - d for x, v, d in zip(place, velocity, drop, strict=True)
        ]


def worst_error(positions: Any, n: int, t: float) -> float:
    """The largest distance [m] of 200 of the spheres from their exact places."""
    at, velocities = start(n)
    worst = 0.0
    for k in range(0, n, max(1, n // 200)):
        with mpmath.workdps(DIGITS):
            error = mpmath.sqrt(
                sum(
                    (mpmath.mpf(float(a)) - b) ** 2
                    for a, b in zip(positions[k], exact(at[k], velocities[k], t), strict=True)
                )
            )
        worst = max(worst, float(error))
    return worst


def by_hand(n: int, *, components_first: bool) -> Callable[[float], Any]:
    """The closed form over whole arrays, with outputs made beforehand."""
    place, velocity = start(n)
    g = np.array([0.0, 0.0, -GRAVITY])
    if components_first:
        place, velocity, g = place.T.copy(), velocity.T.copy(), g[:, None]
    x, v = np.empty_like(place), np.empty_like(place)

    def at(t: float) -> Any:
        np.add(velocity, t * g, out=v)
        np.add(velocity, (0.5 * t) * g, out=x)
        np.multiply(x, t, out=x)
        np.add(x, place, out=x)
        return x, v

    return at


def counters(engine: Any) -> dict[str, Any]:
    """What goes up when something is computed: events, evaluations of laws, steps."""
    data = engine.explain().data
    return {
        "events": data["events"]["handled"],
        "evaluations": [law["evaluations"] for law in data["laws"]],
        "steps": [group.get("steps", 0) for group in data["groups"]],
    }


def _ours(engine: Any, times: Iterator[float]) -> Callable[[], Any]:
    def step() -> Any:
        engine.run(until=next(times))
        bodies = engine.bodies
        return bodies.position, bodies.velocity

    return step


def measure(peers: dict[str, Any], samples: int, quick: bool) -> list[Row]:
    """Rows of this scene; the time is that of one step of 1/60 s with its read."""
    n = 1000 if quick else 10_000
    engine = build(n)
    before = counters(engine)
    rows = []
    for components_first, name in ((False, "a row a sphere"), (True, "a row a component")):
        times = (engine.time + STEP * k for k in count(1))
        hand, hand_times = by_hand(n, components_first=components_first), (STEP * k for k in count(1))
        found, ours, theirs = ratio(
            _ours(engine, times), lambda hand=hand, at=hand_times: hand(next(at)), samples, repeat=60
        )
        rows.append(Row(ID, "NumPy by hand", name, STEP, theirs, note=f"xPheve takes {found:.2f} times as long"))
        rows[-1].more = {"ratio": found, "bar": RATIO_BAR, "xpheve": ours}
    nothing_computed = counters(engine) == before
    first = build(n)
    for k in range(1, 61):
        first.run(until=STEP * k)
        positions = first.bodies.position
    note = (
        "nothing computed between reads: events and evaluations unchanged"
        if nothing_computed
        else "COMPUTED BETWEEN READS"
    )
    mine = Row(
        ID, "xPheve", "exact", None, rows[0].more["xpheve"], error=worst_error(positions, n, first.time), note=note
    )
    mine.more = {"objects": n, "nothing_computed": nothing_computed}
    return [mine, *rows, *(row for name, peer in peers.items() for row in _peer_rows(name, peer, n))]


def _peer_rows(name: str, peer: Any, n: int) -> list[Row]:
    if peer is None:
        return [Row(ID, name, "-", note="not installed")]
    fields: list[Any] = []
    try:
        built = cpu_time(lambda: fields.extend(peer.field(*start(n), STEP)))
    except Exception as error:  # a peer that fails is a row that says so
        return [Row(ID, peer.NAME, "-", STEP, note=f"could not be built: {error}")]
    rows = []
    for field in fields:
        field.start()
        row = Row(ID, peer.NAME, field.setting, STEP)
        row.seconds, row.spread = middle([cpu_time(field.step) for _ in range(round(SPAN / STEP))])
        row.error = worst_error(field.read()[0], n, SPAN)
        row.note = f"built in {built:.1f} s" + ("; reading comes on top" if peer.MODULE == "pybullet" else "")
        row.more = {"objects": n, "built": built}
        rows.append(row)
    return rows
