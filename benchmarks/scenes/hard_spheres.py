"""Elastic hard spheres in a periodic cube: 1,000, 10,000, 100,000 of them at packing 0.1, 0.3, 0.45, over 1,000,000 impacts.

All begin from the same bits: a fluid in equilibrium, made by the loop by hand. Impacts a second are told beside those of that loop, in turns,
and in units of the fixed compiled loop; the rate of impacts beside Enskog's, with the contact value of Carnahan and Starling (which itself is
some 0.3 % low at 0.3: the virial series to the tenth coefficient says so). At packing 0.3 the full lattice of 10,976 stands for the
prototype of which 339,000 impacts a second were told, on its machine.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from benchmarks.calibrate import compiled
from benchmarks.impacts.ours import listen, new_engine
from benchmarks.measure import cpu_time

SIZES, PACKINGS = (1_000, 10_000, 100_000), (0.1, 0.3, 0.45)
IMPACTS, TURNS = 1_000_000, 5
PROTOTYPE, PROTOTYPE_N = 339_000.0, 10_976
NAMES = (
    "spheres",
    "packing",
    "impacts",
    "thousand impacts a second",
    "plain loop",
    "ours over it",
    "a fixed loop",
    "rate over Enskog's, -1",
    "the same, plain loop",
    "deepest overlap / diameter",
    "energy error",
    "built",
)


def build(spheres: Any, told: Callable[[Any], None] | None = None) -> tuple[Any, Any, list[Any]]:
    """An engine with the spheres of a `benchmarks.impacts.plain_loop.Spheres`, its law, and the objects; ``told`` hears of each impact."""
    import xpheve as xp

    engine = new_engine(periodic=(spheres.edge,) * 3)
    bounce = engine.add_law("collision:elastic", restitution=1.0)
    ball = xp.Sphere(0.5 * spheres.diameter)
    objects = [
        xp.PhysicalObject(ball, mass=1.0, position=x, velocity=v)
        for x, v in zip(spheres.position.tolist(), spheres.velocity.tolist(), strict=True)
    ]
    engine.add_objects(objects, laws=[bounce])
    if told is not None:
        listen(engine, objects, told)
    engine.run(until=0.0)
    return engine, bounce, objects


def contact_distance(spheres: Any, impacts: int) -> float:
    """The largest error of the distance of two spheres when they meet, over the diameter, over some ``impacts``: each is listened to."""
    from benchmarks.impacts.plain_loop import enskog_rate

    seen: list[float] = []
    engine, _, objects = build(
        spheres, lambda event: seen.extend(abs(contact.separation) for contact in event.contacts)
    )
    n = len(objects)
    packing = n * math.pi / 6.0 * (spheres.diameter / spheres.edge) ** 3
    engine.run(until=impacts / enskog_rate(n, packing, spheres.diameter))
    return max(seen) / spheres.diameter


def measure(samples: int, quick: bool, peers: tuple[str, ...]) -> dict[str, Any]:
    """A row for each number of spheres and packing."""
    try:
        from benchmarks.impacts import plain_loop
    except ImportError as missing:
        return _told([], [], f"Left out: {missing}.")
    fixed = compiled()
    loop = statistics.median(cpu_time(fixed) for _ in range(5)) if fixed is not None else math.nan
    sizes, packings = ((500,), (0.3,)) if quick else (SIZES, PACKINGS)
    impacts = 3_000 if quick else IMPACTS
    rows: list[dict[str, Any]] = []
    for n in sizes:
        for packing in packings:
            rows.append(one(plain_loop.fluid(n, packing), packing, impacts, loop, plain_loop))
    start = plain_loop.lattice(500 if quick else PROTOTYPE_N, 0.3)
    plain_loop.run(start, impacts=(1 if quick else 5) * start.n)
    prototype = one(plain_loop._at_zero(start), 0.3, impacts, loop, plain_loop)
    rows.append(prototype)
    if any("wrong" in row for row in rows):
        return _told(rows, _bars(rows, prototype, math.nan), "")
    try:
        worst: float | str = contact_distance(plain_loop.fluid(500, 0.3), 300 if quick else 3_000)
    except Exception as wrong:  # what is not there is said
        worst = f"{type(wrong).__name__}: {wrong}"
    return _told(rows, _bars(rows, prototype, worst), "")


def one(start: Any, packing: float, impacts: int, loop: float, plain_loop: Any) -> dict[str, Any]:
    """Both go on to the same times, in turns."""
    n, rate = start.n, plain_loop.enskog_rate(start.n, packing)
    found: list[Any] = []
    try:
        built = cpu_time(lambda: found.extend(build(start)))
    except Exception as wrong:  # what is not there is said
        return {"n": n, "packing": packing, "wrong": f"{type(wrong).__name__}: {wrong}"}
    engine, law, _ = found
    plain = plain_loop._at_zero(start)
    plain_loop.run(plain, until=1e-9)
    before, begun = law.evaluations, plain.impacts
    times: list[tuple[float, float]] = []
    end = impacts / rate
    engine.run(until=1e-9 * end)  # compiled by now
    for k in range(1, TURNS + 1):
        at = k / TURNS * end
        times.append((cpu_time(partial(engine.run, until=at)), cpu_time(partial(plain_loop.run, plain, until=at))))
    done, theirs = law.evaluations - before, plain.impacts - begun
    place, velocity = engine.bodies.position, np.asarray(engine.bodies.velocity, np.longdouble)
    least = plain_loop.closest(np.asarray(place), start.diameter, start.edge, True)
    kinetic = (np.asarray(start.velocity, np.longdouble) ** 2).sum()
    return {
        "n": n,
        "packing": packing,
        "impacts": done,
        "seconds": sum(a for a, _ in times),
        "a second": done / sum(a for a, _ in times),
        "plain": theirs / sum(b for _, b in times),
        "ratio": statistics.median(a / b for a, b in times),
        "a loop": done / sum(a for a, _ in times) * loop,
        "rate": done / end / rate - 1.0,
        "plain rate": theirs / end / rate - 1.0,
        "overlap": max(0.0, 1.0 - least / start.diameter),
        "energy": float(((velocity**2).sum() - kinetic) / kinetic),
        "built": built,
    }


def _bars(rows: list[dict[str, Any]], prototype: dict[str, Any], worst: float | str) -> list[dict[str, Any]]:
    good = [row for row in rows if "wrong" not in row]
    if len(good) < len(rows):
        first = next(row["wrong"] for row in rows if "wrong" in row)
        return [{"text": "hard spheres in a periodic cube", "found": first, "met": False}]
    overlap, rate = max(row["overlap"] for row in good), max((row["rate"] for row in good[:-1]), key=abs)
    return [
        {
            "text": "contact distance at impact within 1e-13 of the diameter",
            "found": worst if isinstance(worst, str) else f"{worst:.1e}",
            "met": not isinstance(worst, str) and worst <= 1e-13,
        },
        {"text": "no overlap (1e-13 of the diameter)", "found": f"at most {overlap:.1e}", "met": overlap <= 1e-13},
        {
            "text": "rate of impacts within 0.5 % of Enskog with Carnahan-Starling",
            "found": f"at most {100 * rate:+.2f} %",
            "met": abs(rate) <= 0.005,
        },
        {
            "text": f"at packing 0.3, {PROTOTYPE_N:,} spheres: impacts a calibrated second no lower than the prototype's",
            "found": f"{prototype['a second']:,.0f} a second here; {PROTOTYPE:,.0f} told of its machine; "
            f"{1 / prototype['ratio']:.2f} times the loop by hand, {prototype['plain']:,.0f}, that stands for it here",
            "met": prototype["a second"] >= PROTOTYPE,
        },
    ]


def _told(rows: list[dict[str, Any]], bars: list[dict[str, Any]], text: str) -> dict[str, Any]:
    return {
        "id": "hard spheres",
        "title": "hard spheres in a periodic cube",
        "names": NAMES,
        "rows": [_cells(row) for row in rows],
        "text": text
        or 'The last row is the start of the prototype. "A fixed loop": impacts in the time of `benchmarks/calibrate`\'s compiled loop. '
        "The plain loop has no engine around it, and knows elastic spheres of one size only.",
        "bars": bars,
        "data": rows,
    }


def _cells(row: dict[str, Any]) -> list[str]:
    if "wrong" in row:
        return [f"{row['n']:,}", f"{row['packing']}", row["wrong"], *["-"] * 9]
    return [
        f"{row['n']:,}",
        f"{row['packing']}",
        f"{row['impacts']:,}",
        f"{row['a second'] / 1e3:.0f}",
        f"{row['plain'] / 1e3:.0f}",
        f"{row['ratio']:.2f}",
        f"{row['a loop']:,.0f}",
        f"{100 * row['rate']:+.2f} %",
        f"{100 * row['plain rate']:+.2f} %",
        f"{row['overlap']:.1e}",
        f"{row['energy']:.1e}",
        f"{row['built']:.1f} s",
    ]
