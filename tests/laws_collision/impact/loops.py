"""Event loops for tests: gases in rooms and in periodic boxes, with a law of restitution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from xpheve_laws_collision.impact import rows
from xpheve_laws_collision.impact.impact_loop import ImpactLoop


class Restitution:
    """Newton's law, one number a law; a restitution of None can only be asked in Python."""

    text = """
def respond(f, n):
    c = f[0]
    c[112] = 0.0
    c[113] = f[1][n[0][2]] * c[6]
    return 0
"""
    columns: tuple[str, ...] = ()
    files: dict[str, str] = {}  # noqa: RUF012

    def __init__(self, *each: float | None) -> None:
        self.each = each or (1.0,)

    def parameters(self) -> tuple[list[float], list[tuple[int, int]]]:
        numbers = [0.0 if one is None else one for one in self.each]
        return numbers, [(-1 if one is None else 0, k) for k, one in enumerate(self.each)]


def plane(normal: Sequence[float], level: float) -> list[float]:
    """A fixed plane: a row of the scenery."""
    row = [0.0] * rows.SCENERIES
    row[rows.KIND] = rows.PLANE
    row[rows.CENTRE : rows.CENTRE + 3] = normal
    row[rows.SIZE] = level
    return row


def solid(kind: int, centre: Sequence[float], sizes: Sequence[float], turn: Any = None) -> list[float]:
    """A fixed sphere, box or capsule."""
    row = [0.0] * rows.SCENERIES
    row[rows.KIND] = kind
    row[rows.CENTRE : rows.CENTRE + 3] = centre
    row[rows.TURN : rows.TURN + 9] = np.eye(3).ravel() if turn is None else np.asarray(turn).ravel()
    row[rows.SIZE : rows.SIZE + len(sizes)] = sizes
    row[rows.SIZE + 3] = math.hypot(*sizes)
    return row


def room(size: float) -> list[list[float]]:
    """Six planes about the cube from 0 to ``size`` [m]."""
    return [
        plane([sign if axis == k else 0.0 for k in range(3)], 0.0 if sign > 0.0 else -size)
        for axis in range(3)
        for sign in (1.0, -1.0)
    ]


def loop_of(count: int, scenery: Any = (), law: Any = None, compiled: bool = False, **more: Any) -> ImpactLoop:
    """An empty loop with one law."""
    laws = list(range(len((law or Restitution()).each))) if isinstance(law or Restitution(), Restitution) else [0]
    shapes = np.array(scenery, dtype=float).reshape(-1, rows.SCENERIES)
    masks = more.pop("masks", np.ones(len(shapes), dtype=np.int64))
    return ImpactLoop(count, shapes, masks, law or Restitution(), laws, compiled=compiled, **more)


def put(loop: ImpactLoop, position: Any, velocity: Any, places: Any = None, **more: Any) -> None:
    """Load flights; what is not given is that of a ball of 1 kg and radius 0.05 m."""
    x = np.array(position, dtype=float).reshape(3, -1)
    k = x.shape[1]
    given: dict[str, Any] = {
        "acceleration": (0.0, 0.0, 0.0), "clock": (0.0, 0.0), "spin": (0.0, 0.0, 0.0), "radius": 0.05, "mass": 1.0, "mask": 1, "heard": 0,
    }  # fmt: skip
    given |= more
    at = np.arange(k) if places is None else np.asarray(places)
    for name in ("acceleration", "clock", "spin"):
        one = np.array(given[name], dtype=float)
        given[name] = np.broadcast_to(one.reshape(len(one), -1), (len(one), k))
    for name in ("radius", "mass", "mask", "heard"):
        given[name] = np.broadcast_to(given[name], (k,))
    given.setdefault("inertia", 0.4 * given["mass"] * given["radius"] ** 2)
    given.setdefault("rank", at)
    given.setdefault("columns", np.zeros((len(loop.columns), k)))
    loop.load(at, position=x, velocity=np.array(velocity, dtype=float).reshape(3, -1), **given)


def lattice(count: int, size: float, seed: int = 0) -> tuple[Any, Any]:
    """Positions on a cubic lattice and velocities of mean square 1, their sum 0."""
    rng = np.random.default_rng(seed)
    side = math.ceil(count ** (1.0 / 3.0) - 1e-9)
    grid = np.array(np.meshgrid(*[np.arange(side)] * 3, indexing="ij")).reshape(3, -1)[:, :count]
    v = rng.normal(size=(3, count))
    v -= v.mean(axis=1)[:, np.newaxis]
    return (grid + 0.5) * size / side, v / math.sqrt((v**2).sum() / count)


def crystal(packing: float, cells: int, seed: int = 0) -> tuple[Any, Any, float]:
    """4 cells^3 spheres of diameter 1 m on a face-centred lattice at a packing fraction, with thermal velocities; and the box's length [m]."""
    count = 4 * cells**3
    length = (count * math.pi / 6.0 / packing) ** (1.0 / 3.0)
    grid = np.array(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij")).reshape(3, -1)
    corners = ((0.25, 0.25, 0.25), (0.75, 0.75, 0.25), (0.75, 0.25, 0.75), (0.25, 0.75, 0.75))
    x = np.concatenate([grid + np.array(one)[:, np.newaxis] for one in corners], axis=1) * length / cells
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(3, count))
    v -= v.mean(axis=1)[:, np.newaxis]
    return x, v * math.sqrt(3.0 * count / (v**2).sum()), length


def flights(loop: ImpactLoop) -> Any:
    """Positions, velocities and clocks of all places, (8, k): a copy."""
    return loop._state[:, : rows.PULL].T.copy()


def at_time(loop: ImpactLoop, time: float) -> tuple[Any, Any]:
    """Positions and velocities at ``time`` [s]."""
    state = loop._state
    s = ((time - state[:, rows.TIME]) - state[:, rows.TIME + 1])[:, np.newaxis]
    pull, v = state[:, rows.PULL : rows.PULL + 3], state[:, rows.V : rows.V + 3]
    return (state[:, rows.X : rows.X + 3] + s * (v + 0.5 * s * pull)).T, (v + s * pull).T
