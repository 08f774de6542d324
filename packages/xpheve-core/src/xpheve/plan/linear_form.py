"""Groups whose forces are affine: F = K x + D v + c with constant matrices, proven from the traces with the numbers that their parameters have."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import ContinuousLaw, FieldLaw, PairLaw
from xpheve.plan.affine import AffineLaw, affine_law, evaluated
from xpheve.plan.driven import immovable
from xpheve.plan.hand_kernels import formula_of, is_by_hand
from xpheve.plan.pairs import PairSet
from xpheve.steppers.contract import Rows
from xpheve.steppers.linear_form import Couplings, LinearForm, turns
from xpheve.steppers.wide import Wide, wide
from xpheve.trace.graph import Input, walk

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.world import World

LARGEST = 150
"""Coordinates of a group that depend on one another, at most: finding its modes takes some tenths of a second, without modes some seconds."""


def linear_form(world: World, group: Sequence[PhysicalObject]) -> LinearForm | None:
    """What acts on ``group`` as matrices; None if its forces are not affine, or it is too large."""
    laws = _laws_of(world, group)
    if not is_linear(world, group, laws):
        return None
    return form_of_rows(world, laws, np.array([obj._row for obj in group], dtype=np.int64))


def is_linear(world: World, group: Sequence[PhysicalObject], laws: Iterable[ContinuousLaw]) -> bool:
    """Whether the forces of ``laws`` on ``group`` are affine in places and velocities, with numbers that stay."""
    points = not any(any(obj.inertia) for obj in group)
    crosses = pairs = False
    for law in laws:
        key = law, points
        if key not in world.affine:
            world.affine[key] = affine_of(world, law, points)
        found = world.affine[key]
        if found is None:
            return False
        crosses |= found.crosses
        pairs |= isinstance(law, PairLaw)
    if not pairs:
        return True
    # Without forces across, the three directions are apart.
    return (3 if crosses else 1) * len(group) <= LARGEST


def affine_of(world: World, law: ContinuousLaw, points: bool) -> AffineLaw | None:
    """``law`` as an affine one, if it is at all times; of objects that are ``points``, without inertia, or others."""
    trace = formula_of(law)
    if trace is None or is_by_hand(law) or law.defines("jumps"):
        return None
    if isinstance(law, PairLaw) and (math.isfinite(law.reach()) or _is_moved_by_others(world, law)):
        return None
    return affine_law(law, trace, points and law.defines("torque"))


def _is_moved_by_others(world: World, law: PairLaw) -> bool:
    """Whether what moves of itself, or by the host, acts through ``law`` on others that do not act on it."""
    for obj in world.mapping.objects(law):
        if obj._driven or (law.one_sided and not law.moves(obj) and not immovable(obj)):
            return True
    return False


def _laws_of(world: World, group: Iterable[PhysicalObject]) -> list[ContinuousLaw]:
    found = {law: None for obj in group for law in world.continuous_laws(obj)}
    return [law for law in world.ordered_laws(found) if isinstance(law, ContinuousLaw)]


def form_of_rows(
    world: World, laws: Sequence[ContinuousLaw], rows: Rows, sets: Mapping[PairLaw, PairSet] | None = None
) -> LinearForm:
    """The form of ``rows``, each with all others of its group; ``laws`` are affine, and those that are off do nothing.

    ``sets`` are the pairs of pair laws, where they are known.
    """
    maker = _Maker(world, rows)
    points = not world.bodies.arrays["inertia"][:, rows].any()
    for law in laws:
        if not law.enabled:
            continue
        affine = affine_of(world, law, points)
        assert affine is not None, f"{law.label()} is not affine"
        if isinstance(law, FieldLaw):
            maker.field(law, affine)
        elif isinstance(law, PairLaw):
            maker.pair(law, affine, (sets or {}).get(law))
    return maker.made()


class _Maker:
    """Sums what laws do to ``rows``."""

    def __init__(self, world: World, rows: Rows) -> None:
        self.world, self.rows = world, rows
        self.place = np.full(world.bodies.count, -1, dtype=np.int64)
        self.place[rows] = np.arange(len(rows))
        n = len(rows)
        self.stiffness, self.damping, self.held = (Wide(np.zeros((3, 3, n))) for _ in range(3))
        self.constant, self.kept = Wide(np.zeros((3, n))), Wide(np.zeros((3, n)))
        self.couplings: list[Couplings] = []
        self.works = False

    def made(self) -> LinearForm:
        mass = self.world.bodies.arrays["mass"][0, self.rows]
        return LinearForm(
            self.rows,
            mass,
            self.stiffness,
            self.damping,
            self.constant,
            self.held,
            self.kept,
            self.couplings,
            self.works,
        )

    def field(self, law: FieldLaw, affine: AffineLaw) -> None:
        """A law on single objects."""
        which = self._under(law)
        if len(which):
            slopes, force = self._numbers(law, affine, {"": self.rows[which]})
            self._add(law, which, slopes.get(("", "position")), slopes.get(("", "velocity")), force)
        self.works |= not law.defines("potential")

    def _under(self, law: FieldLaw) -> Rows:
        """Places of the rows that obey ``law``."""
        members = self.world.mapping.objects(law)
        if len(self.rows) < len(members):
            objects = self.world.bodies.objects
            mine = [k for k, row in enumerate(self.rows.tolist()) if objects[row] in members]
            return np.array(mine, dtype=np.int64)
        which = np.sort(self.place[np.array([obj._row for obj in members], dtype=np.int64)])
        return which[which >= 0]

    def pair(self, law: PairLaw, affine: AffineLaw, pairs: PairSet | None) -> None:
        """A law between two: on ``a`` as it is, on ``b`` its opposite; what does not move is a part of the constant."""
        world = self.world
        if pairs is None:
            members = world.in_rank_order(world.mapping.objects(law))
            pairs = PairSet(law, members, [immovable(obj) for obj in members])
        a, b = pairs.every()
        ours = (self.place[a] >= 0) | (self.place[b] >= 0)
        a, b = a[ours], b[ours]
        self.works |= not law.defines("potential")
        if not len(a):
            return
        slopes, force = self._numbers(law, affine, {"a": a, "b": b})
        for side, rows in (("a", a), ("b", b)):
            still = self.place[rows] < 0
            slope = slopes.get((side, "position"))
            if still.any() and slope is not None:
                x = self.world.bodies.arrays["position"][:, rows[still]]
                force[:, still] = force[:, still] + (slope[:, :, still] * Wide(x)[None]).sum(1)
        for side, rows, sign in (("a", a, 1.0), ("b", b, -1.0)):
            moves = self.place[rows] >= 0
            own = [slopes.get((side, name)) for name in ("position", "velocity")]
            parts = [None if one is None else one[:, :, moves].scaled(sign) for one in own]
            self._add(law, self.place[rows[moves]], parts[0], parts[1], force[:, moves].scaled(sign))
        both = (self.place[a] >= 0) & (self.place[b] >= 0)
        for one, other, side, sign in ((a, b, "b", 1.0), (b, a, "a", -1.0)):
            cross = [slopes.get((side, name)) for name in ("position", "velocity")]
            none = Wide(np.zeros((3, 3, int(both.sum()))))
            stiff, damp = (none if part is None else part[:, :, both].scaled(sign) for part in cross)
            places = self.place[one[both]], self.place[other[both]]
            self.couplings.append(Couplings(*places, stiff, damp, law.defines("potential")))

    def _numbers(
        self, law: ContinuousLaw, affine: AffineLaw, sides: dict[str, Rows]
    ) -> tuple[dict[tuple[str, str], Wide], Wide]:
        """Slopes (3, 3, n) by side and name, and the force (3, n) at rest at the origin."""
        n = len(next(iter(sides.values())))
        time = self.world.time[0]
        inputs: dict[Input, Any] = {}
        for node in walk(affine.outputs):
            if node.op != "input":
                continue
            one = node.value
            if one.name in ("position", "velocity"):
                inputs[one] = 0.0
                continue
            rows = sides.get(one.side, next(iter(sides.values())))
            inputs[one] = self.world.evaluator.read(law, one.name, rows, time, self._unread)[one.component]
        found = [_spread(one, n) for one in evaluated(affine.outputs, inputs)]
        slopes = {}
        for k, key in enumerate(affine.slopes):
            slopes[key] = _grouped([found[9 * k + 3 * i : 9 * k + 3 * i + 3] for i in range(3)])
        force = found[9 * len(affine.slopes) :]
        full = Wide(np.array([one.high for one in force]), np.array([one.low for one in force]))
        whole = full.high + sum(one.high.sum(axis=1) for one in slopes.values())
        self.world.evaluator.finite(law, "force", whole, next(iter(sides.values())), time)
        law.evaluations += 1
        return slopes, full

    @staticmethod
    def _unread(name: str) -> Any:
        raise AssertionError(f"an affine law reads {name}")

    def _add(self, law: ContinuousLaw, which: Rows, stiffness: Wide | None, damping: Wide | None, force: Wide) -> None:
        """Add slopes and forces on the rows at places ``which``, several times where a place is there several times."""
        conservative = law.defines("potential")
        for turn in turns(which):
            at = which[turn]
            every = slice(None) if len(at) == len(self.rows) else at
            if stiffness is not None:
                self.stiffness[:, :, every] = self.stiffness[:, :, every] + stiffness[:, :, turn]
                if conservative:
                    self.held[:, :, every] = self.held[:, :, every] + stiffness[:, :, turn]
            if damping is not None:
                self.damping[:, :, every] = self.damping[:, :, every] + damping[:, :, turn]
            self.constant[:, every] = self.constant[:, every] + force[:, turn]
            if conservative:
                self.kept[:, every] = self.kept[:, every] + force[:, turn]


def _spread(one: Any, n: int) -> Wide:
    """``one`` for each of n."""
    found = wide(one)
    return Wide(np.broadcast_to(found.high, (n,)), np.broadcast_to(found.low, (n,)))


def _grouped(rows: list[list[Wide]]) -> Wide:
    return Wide(
        np.array([[one.high for one in row] for row in rows]), np.array([[one.low for one in row] for row in rows])
    )
