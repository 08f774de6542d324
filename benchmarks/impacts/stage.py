"""Bodies that meet: one description that all engines build, and contenders made of it.

Sizes: the radius of a sphere; half edges of a box; radius and length (between the centres of its ends, along z) of a capsule; the normal of
a plane, which goes through ``position``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from benchmarks.measure import Row
from benchmarks.problem import Array, End, Scene
from benchmarks.turns import Contender

Vec = tuple[float, ...]
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
STILL = (0.0, 0.0, 0.0)
LOOKS = 60  # how often a run is looked at for what counts along the way


@dataclass(frozen=True)
class Thing:
    """A body; without ``mass`` it is fixed. Orientations are quaternions (w, x, y, z)."""

    shape: str
    size: Vec
    position: Vec = STILL
    velocity: Vec = STILL
    orientation: Vec = UPRIGHT
    turning: Vec = STILL
    mass: float = 0.0

    @property
    def inertia(self) -> Vec:
        """Principal moments [kg m^2] of a solid body of even density."""
        if self.shape == "sphere":
            return (0.4 * self.mass * self.size[0] ** 2,) * 3
        if self.shape == "box":
            x, y, z = (edge * edge for edge in self.size)
            return tuple(self.mass / 3.0 * both for both in (y + z, x + z, x + y))
        r, h = self.size
        cylinder = self.mass * h / (h + 4.0 / 3.0 * r)
        ends = self.mass - cylinder
        along = (0.5 * cylinder + 0.4 * ends) * r * r
        across = cylinder * (r * r / 4 + h * h / 12) + ends * (0.4 * r * r + h * h / 4 + 3.0 / 8.0 * h * r)
        return across, across, along


@dataclass(frozen=True)
class Stage:
    """Things under ``gravity`` [m/s^2] along -z, all with one ``restitution`` and no friction."""

    things: Sequence[Thing]
    restitution: float = 1.0
    gravity: float = 0.0

    @cached_property
    def movers(self) -> list[Thing]:
        """Those that are not fixed, in their order: an `End` holds these."""
        return [one for one in self.things if one.mass > 0]

    @cached_property
    def scenery(self) -> list[Thing]:
        """Those that are fixed."""
        return [one for one in self.things if one.mass == 0]

    @cached_property
    def start(self) -> End:
        """Where all movers are at first."""
        columns = ("position", "velocity", "orientation", "turning")
        return End(*(np.array([getattr(one, name) for one in self.movers]) for name in columns))

    @cached_property
    def _masses(self) -> tuple[Array, Array]:
        return np.array([one.mass for one in self.movers]), np.array([one.inertia for one in self.movers])

    def energy(self, end: End) -> float:
        """Kinetic energy, of turning too, and potential energy [J], in long double."""
        long = np.longdouble
        mass, inertia = (one.astype(long) for one in self._masses)
        v, x = np.asarray(end.velocity, long), np.asarray(end.position, long)
        total = (0.5 * mass * (v * v).sum(axis=1)).sum() + long(self.gravity) * (mass * x[:, 2]).sum()
        if end.turning is not None and np.any(end.turning):
            w = to_body(np.asarray(end.orientation, long), np.asarray(end.turning, long))
            total += (0.5 * inertia * w * w).sum()
        return total  # type: ignore[no-any-return]

    def drift(self, end: End) -> float:
        """Change of the energy over the energy at the start."""
        begin = self.energy(self.start)
        return float((self.energy(end) - begin) / begin)

    @cached_property
    def _radii(self) -> Array:
        return np.array([one.size[0] for one in self.movers])

    def overlap(self, end: End) -> float:
        """Deepest overlap [m] of spheres with one another and with fixed planes, boxes and spheres; 0 if there is none."""
        x, r = np.asarray(end.position), self._radii
        if not np.isfinite(x).all():
            return math.inf
        deepest = _among(x, r)
        normals = np.array([one.size for one in self.scenery if one.shape == "plane"]).reshape(-1, 3)
        if len(normals):
            through = np.array([one.position for one in self.scenery if one.shape == "plane"])
            heights = x @ normals.T - (normals * through).sum(axis=1)
            deepest = max(deepest, float((r[:, None] - heights).max()))
        return max(0.0, deepest, self._in_boxes(x))

    @cached_property
    def _boxes(self) -> tuple[Array, Array, Array]:
        boxes = [one for one in self.scenery if one.shape == "box"]
        columns = ("position", "orientation", "size")
        places, turned, halves = (np.array([getattr(one, name) for one in boxes], float) for name in columns)
        return places.reshape(-1, 3), turned.reshape(-1, 4), halves.reshape(-1, 3)

    def _in_boxes(self, x: Array) -> float:
        """Deepest overlap of spheres at ``x`` with fixed boxes: of those alone whose surrounding spheres overlap."""
        places, turned, halves = self._boxes
        if not len(places):
            return 0.0
        square = (x * x).sum(axis=1)[:, None] + (places * places).sum(axis=1) - 2.0 * x @ places.T
        i, k = np.nonzero(square < (self._radii[:, None] + np.linalg.norm(halves, axis=1)) ** 2 * 1.001)
        if not len(i):
            return 0.0
        out = np.abs(to_body(turned[k], x[i] - places[k])) - halves[k]
        far = np.sqrt((np.maximum(out, 0.0) ** 2).sum(axis=1))
        return float((self._radii[i] - np.where(far > 0, far, out.max(axis=1))).max())


def to_body(q: Array, v: Array) -> Array:
    """Vectors (n, 3) of the world frame in those of the bodies of orientations (n, 4)."""
    w, u = q[:, :1], -q[:, 1:]
    t = 2.0 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


def _among(x: Array, r: Array) -> float:
    deepest, block = -math.inf, 256
    for k in range(0, len(x), block):
        d = np.sqrt(((x[k : k + block, None] - x) ** 2).sum(axis=-1))
        d[np.arange(len(d)), np.arange(k, k + len(d))] = np.inf
        deepest = max(deepest, float((r[k : k + block, None] + r - d).max())) if len(x) > 1 else deepest
    return deepest


class World(Protocol):
    """A stage built in a peer's engine."""

    def advance(self, steps: int) -> None:
        """Make so many steps."""

    def read(self) -> End:
        """Where all movers are."""


@dataclass(frozen=True)
class Staged(Scene):
    """A scene that is told by a `Stage`; ``peers`` gives (setting, dt) for each peer."""

    stage: Stage = field(default_factory=lambda: Stage(()))


def contenders(
    scene: Staged, name: str, module: str, world: Callable[[Stage, str, float], World], notes: dict[str, str]
) -> list[Contender]:
    """A contender of a peer for each setting that the scene names. ``world(stage, setting, dt)`` builds."""
    return [_contender(scene, name, world, setting, dt, notes) for setting, dt in scene.peers.get(module, ())]


def _contender(
    scene: Staged,
    name: str,
    world: Callable[[Stage, str, float], World],
    setting: str,
    dt: float,
    notes: dict[str, str],
) -> Contender:
    steps = round(scene.span / dt)
    row = Row(scene.id, f"{name} {setting}", step_of(dt), dt, note=notes.get(setting, ""))

    def make() -> tuple[Callable[[], Any], Callable[[], End]]:
        made = world(scene.stage, setting, dt)
        return (lambda: made.advance(steps)), made.read

    def watch() -> list[End]:
        made, done, seen = world(scene.stage, setting, dt), 0, []
        for k in range(1, LOOKS + 1):
            to = round(k * steps / LOOKS)
            made.advance(to - done)
            done = to
            seen.append(made.read())
        return seen

    return Contender(row, make, watch=watch)


def step_of(dt: float) -> str:
    """A step as its setting says it."""
    return f"dt 1/{round(1 / dt)}"


def room(low: Vec, high: Vec) -> list[Thing]:
    """Six planes that look inwards."""
    return [
        Thing(
            "plane",
            tuple(sign * float(k == axis) for k in range(3)),
            tuple(c * float(k == axis) for k, c in enumerate(corner)),
        )
        for corner, sign in ((low, 1.0), (high, -1.0))
        for axis in range(3)
    ]
