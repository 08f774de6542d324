"""Conserved quantities of a scene at its present time; sums are rounded once (fsum), whatever the order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from xpheve.laws import ContinuousLaw, FieldLaw, FlowLaw, PairLaw
from xpheve.plan.driven import immovable
from xpheve.plan.groups import Batch
from xpheve.plan.pairs import PairSet
from xpheve.steppers.contract import Array, Rows

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.world import World

Vec = tuple[float, float, float]


def total_of(values: Iterable[float]) -> float:
    """The sum of ``values``, rounded once; infinite or NaN, where it leaves the range of floats. They may be many, and are never held together."""
    left = iter(values)
    plain = 0.0  # of what `math.fsum` has taken, for when it gives up

    def seen() -> Iterator[float]:
        nonlocal plain
        for one in left:
            plain += one
            yield one

    try:
        return math.fsum(seen())
    except (OverflowError, ValueError):
        return plain + sum(left)


class Energy(NamedTuple):
    """Kinetic and potential energy [J], and the work [J] done so far by what has no potential: drag, impacts, user forces."""

    kinetic: float
    potential: float
    work: float

    @property
    def total(self) -> float:
        """Kinetic plus potential energy [J]."""
        return self.kinetic + self.potential

    @property
    def balance(self) -> float:
        """Kinetic plus potential energy less work [J]: constant but for error."""
        return total_of((self.kinetic, self.potential, -self.work))


def spin_of(orientation: Array, omega: Array, inertia: Array) -> Array:
    """Angular momentum [kg m^2/s] about the centre, world frame, (3, n): R diag(I) R^T omega."""
    w, x, y, z = orientation
    r = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    found: Array = np.einsum("ijn,jn->in", r, inertia * np.einsum("jin,jn->in", r, omega))
    return found


def spin_energy(orientation: Array, omega: Array, inertia: Array) -> Array:
    """Kinetic energy [J] of rotation, (n,)."""
    spin = spin_of(orientation, omega, inertia)
    found: Array = 0.5 * (spin[0] * omega[0] + spin[1] * omega[1] + spin[2] * omega[2])
    return found


def twisted(world: World, batch: Batch) -> Any:
    """Which rows of ``batch`` are under a torque whose work is booked: all that changes their energy of rotation."""
    torque = batch.state.arrays.get("torque")
    if torque is None:
        return np.zeros(batch.state.count, dtype=bool)
    return torque.any(axis=0) & working(world, batch)


def working(world: World, batch: Batch) -> Any:
    """Which rows of ``batch`` are under a torque that no potential stands for: stored, or of a law; where laws are not known yet, all."""
    rows, sources = batch.state.rows, batch.sources
    if sources is None:
        return np.ones(len(rows), dtype=bool)
    return sources.working_twists[rows] | world.bodies.arrays["torque"][:, rows].any(axis=0)


def twist_label(batch: Batch) -> str:
    """Under what name the work of torques on ``batch`` is booked."""
    return " + ".join(law.label() for law in batch.laws if law.defines("torque")) or "forces"


def label_of(batch: Batch) -> str:
    """Under what name the work of forces along the way on ``batch`` is booked."""
    labels = [law.label() for law in batch.laws if not law.defines("potential")]
    return " + ".join([*labels, *batch.lent]) or "laws"


class Snapshot:
    """The state of all rows at the present time, read once."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.count = world.bodies.count
        self._held: dict[str, Array] = {}
        self.moving = ~(world.bodies.fixed | world.bodies.driven)[: self.count]

    def __getitem__(self, name: str) -> Array:
        if name not in self._held:
            self._held[name] = self.world.read_all(name, self.world.time)
        return self._held[name]

    def part(self, rows: Rows, name: str) -> Array:
        """Column ``name`` of ``rows``."""
        found: Array = self[name][:, rows]
        return found

    @property
    def mass(self) -> Array:
        found: Array = self.world.bodies.arrays["mass"][0, : self.count]
        return found

    def spin(self) -> Array:
        """Angular momentum [kg m^2/s] of each body about its centre, world frame, shape (3, n)."""
        inertia = self.world.bodies.arrays["inertia"][:, : self.count]
        return spin_of(self["orientation"], self["angular_velocity"], inertia)


def energy(world: World) -> Energy:
    """Energy of all moving objects, and of the laws that have a potential."""
    shot = Snapshot(world)
    v, m = shot["velocity"], shot.mass
    with np.errstate(over="ignore"):  # energy beyond the range of floats is infinite
        parts = [0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])]
    if shot["angular_velocity"].any():
        inertia = world.bodies.arrays["inertia"][:, : shot.count]
        parts.append(spin_energy(shot["orientation"], shot["angular_velocity"], inertia))
    kinetic = total_of(value for part in parts for value in part[shot.moving].tolist())
    return Energy(
        kinetic,
        _potential(world, shot),
        total_of([*world.work.values(), *(value for found in _running_work(world, shot).values() for value in found)]),
    )


def share(world: World, obj: PhysicalObject) -> float:
    """Energy [J] that is in the scene because ``obj`` moves freely in it: kinetic, and potential with what acts on it."""
    shot = Snapshot(world)
    row = np.array([obj._row], dtype=np.int64)
    v = shot.part(row, "velocity")
    kinetic = 0.5 * float(shot.mass[obj._row]) * total_of((v * v).ravel().tolist())
    omega = shot.part(row, "angular_velocity")
    if omega.any():
        inertia = world.bodies.arrays["inertia"][:, row]
        kinetic += float(spin_energy(shot.part(row, "orientation"), omega, inertia)[0])
    return kinetic + _potential(world, shot, obj)


def _potential(world: World, shot: Snapshot, only: PhysicalObject | None = None) -> float:
    """Of all, or of ``only`` with the others; driven objects are not part of it."""
    return total_of(value for part in _potentials(world, shot, only) for value in part.tolist())


def _potentials(world: World, shot: Snapshot, only: PhysicalObject | None) -> Iterator[Array]:
    """Potential energies [J] of objects and pairs, some at a time."""
    for law in world.laws:
        if not (isinstance(law, ContinuousLaw) and law.enabled and not law.containers and law.defines("potential")):
            continue
        members = world.in_rank_order(world.mapping.objects(law))
        if only is not None and only not in members:
            continue
        time = world.time[0]
        if isinstance(law, FieldLaw | FlowLaw):
            rows = np.array([obj._row for obj in members if not immovable(obj) and only in (None, obj)], dtype=np.int64)
            if len(rows):
                yield world.evaluator.potential(law, (rows,), time, shot.__getitem__)
        elif isinstance(law, PairLaw):
            for a, b in _pairs(law, members, only).chunks(shot["position"]):
                if len(a):
                    yield world.evaluator.potential(law, (a, b), time, shot.__getitem__)


def _pairs(law: PairLaw, members: list[PhysicalObject], only: PhysicalObject | None) -> PairSet:
    """The pairs that ``law`` acts on and that are no driven object's, nor a moving source's, or those of ``only``."""
    free = [obj for obj in members if not obj._driven]
    if law.one_sided:
        free = [obj for obj in free if obj._fixed or law.side_of(obj) == 2]
    if only is None:
        return PairSet(law, free, [obj._fixed for obj in free])
    if only._fixed:
        free = [obj for obj in free if obj is only or not obj._fixed]
    return PairSet(law, free, [obj is not only for obj in free])


def work_by(world: World) -> dict[str, float]:
    """The work of `energy` by who did it, sorted by label; what did none is left out."""
    found = {label: [joules] for label, joules in world.work.items()}
    for label, parts in _running_work(world, Snapshot(world)).items():
        found.setdefault(label, []).extend(parts)
    sums = {label: total_of(parts) for label, parts in sorted(found.items())}
    return {label: joules for label, joules in sums.items() if joules or label in world.work}


def _running_work(world: World, shot: Snapshot) -> dict[str, list[float]]:
    """Work over the flights that are under way, and what steppers keep of those before, by who does it."""
    work: dict[str, list[float]] = {}
    bodies = world.bodies
    for obj, stored in world.forces.of.items():
        row = obj._row
        if row >= 0 and not obj._driven and any(not one.accounted for one in stored):
            way = [
                x1 - x0 for x1, x0 in zip(shot["position"][:, row].tolist(), bodies.get("position", row), strict=True)
            ]
            for one in stored:
                if not one.accounted:
                    label = one.owner.label() if one.owner is not None else "forces"
                    work.setdefault(label, []).extend(f * d for f, d in zip(one.force.vector, way, strict=True))
    for batch in world.batches:
        if not batch.state.count:
            continue
        rows, found = batch.state.rows, work.setdefault(label_of(batch), [])
        if batch.stepper.books_work:
            found += [value for name in ("work", "work_rest") for value in batch.state.arrays[name][0].tolist()]
            found += batch.stepper.running_work(batch.state, bodies, world.time, slice(None)).tolist()
        if batch.working is not None:
            found += (batch.working * (shot["position"][:, rows] - bodies.arrays["position"][:, rows])).ravel().tolist()
        turned = rows[twisted(world, batch)]
        if len(turned):
            inertia = bodies.arrays["inertia"][:, turned]
            now = spin_energy(shot["orientation"][:, turned], shot["angular_velocity"][:, turned], inertia)
            before = spin_energy(
                bodies.arrays["orientation"][:, turned], bodies.arrays["angular_velocity"][:, turned], inertia
            )
            work.setdefault(twist_label(batch), []).extend([*now.tolist(), *(-before).tolist()])
    return work


def momentum(world: World) -> Vec:
    """Sum of m v [kg m/s] over all objects that move of themselves, world frame: fixed and driven ones are outside."""
    shot = Snapshot(world)
    return _vector(shot.mass * shot["velocity"], shot)


def angular_momentum(world: World) -> Vec:
    """Sum of m x cross v + I omega [kg m^2/s] over all moving objects, about the origin, world frame."""
    shot = Snapshot(world)
    x, v = shot["position"], shot["velocity"]
    orbital = shot.mass * np.array([x[1] * v[2] - x[2] * v[1], x[2] * v[0] - x[0] * v[2], x[0] * v[1] - x[1] * v[0]])
    both = np.concatenate([orbital[:, shot.moving], shot.spin()[:, shot.moving]], axis=1)
    return total_of(both[0].tolist()), total_of(both[1].tolist()), total_of(both[2].tolist())


def _vector(values: Array, shot: Snapshot) -> Vec:
    x, y, z = (total_of(component[shot.moving].tolist()) for component in values)
    return x, y, z
