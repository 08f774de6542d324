"""Groups, their signatures, and the stepper that wins each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from xpheve.errors import NoStepperError
from xpheve.kernels.flight import GENERAL, PRINCIPAL, way_of_turning
from xpheve.laws import ContinuousLaw, PairLaw
from xpheve.plan.driven import immovable
from xpheve.plan.hand_kernels import formula_of
from xpheve.steppers.contract import Array, Offer, Refusal, Signature, State, Stepper

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.evaluation import BatchSources
    from xpheve.plan.world import World


class Choice:
    """Who serves a signature, and what the others said."""

    def __init__(self, stepper: Stepper, offers: dict[str, Offer], refusals: dict[str, str]) -> None:
        self.stepper = stepper
        self.offers = offers
        self.refusals = refusals


class Batch:
    """The groups of one signature that one stepper serves, with one State."""

    def __init__(self, number: int, signature: Signature, choice: Choice, state: State) -> None:
        self.number = number
        self.signature = signature
        self.choice = choice
        self.state = state
        self.sources: BatchSources | None = None
        self.laws: list[ContinuousLaw] = []
        self.lent = False
        """Whether driven objects act on it through pair laws."""

    @property
    def stepper(self) -> Stepper:
        return self.choice.stepper

    @property
    def working(self) -> Array | None:
        """Forces [N] of the laws without potential over the present flights, (3, rows); None if there are none.

        What pair laws with driven objects do is among them: a driven object has no potential energy.
        """
        if not self.lent and all(law.defines("potential") for law in self.laws):
            return None
        return self.state.arrays.get("working")


def choose(signature: Signature, steppers: Iterable[Stepper]) -> Choice:
    """The stepper that was asked for, if it offers; else the cheapest exact offer, else the cheapest of the highest order.

    Raises
    ------
    NoStepperError
        If all refuse.
    """
    if signature.driven:
        from xpheve.steppers.driven import Driven

        steppers = [Driven()]
    offers: dict[str, Offer] = {}
    refusals: dict[str, str] = {}
    best: tuple[tuple[bool, bool, float, float, str], Stepper] | None = None
    for stepper in sorted(steppers, key=lambda one: one.id):
        answer = stepper.offer(signature)
        if isinstance(answer, Refusal):
            refusals[stepper.id] = answer.reason
            continue
        offers[stepper.id] = answer
        key = (
            stepper.id != signature.wish,
            not answer.exact,
            answer.cost if answer.exact else -answer.order,
            answer.cost,
            stepper.id,
        )
        if best is None or key < best[0]:
            best = (key, stepper)
    if best is None:
        said = "; ".join(f"{name}: {reason}" for name, reason in refusals.items())
        raise NoStepperError(f"no stepper can move objects under {', '.join(signature.laws) or 'no law'} ({said})")
    return Choice(best[1], offers, refusals)


def torque_of(world: World, obj: PhysicalObject) -> str:
    """How the stored torque of ``obj`` acts: see `Signature`."""
    bodies, row = world.bodies, obj._row
    if obj._driven:
        return "none"
    torque = bodies.get("torque", row)
    if torque == (0.0, 0.0, 0.0):
        return "none"
    q = world.read_row(row, "orientation")
    omega = world.read_row(row, "angular_velocity")
    inertia = bodies.get("inertia", row)
    how = way_of_turning(q, omega, inertia, torque)  # type: ignore[arg-type]
    return {PRINCIPAL: "principal", GENERAL: "general"}.get(how, "none")


def find_group(world: World, start: PhysicalObject) -> list[PhysicalObject]:
    """All objects that pair laws join with ``start``, itself included; fixed and driven ones are sources and join nothing."""
    found = {start: None}
    frontier = [start]
    spent: set[tuple[PairLaw, int]] = set()
    while frontier:
        obj = frontier.pop()
        for law in world.continuous_laws(obj):
            if not isinstance(law, PairLaw):
                continue
            for side, others in partners(world, law, obj):
                if (law, side) in spent:
                    continue
                spent.add((law, side))
                for other in others:
                    if other not in found and not immovable(other):
                        found[other] = None
                        frontier.append(other)
    return world.in_rank_order(found)


def partners(world: World, law: PairLaw, obj: PhysicalObject) -> list[tuple[int, Sequence[PhysicalObject]]]:
    """The objects that ``law`` pairs with ``obj``, by side."""
    mapped = world.mapping.objects(law)
    if law.pairs is not None:  # a side of its own for each object
        return [(3 + obj.serial, [other for other in law.joined(obj) if other in mapped])]
    if law.between is None:
        return [(0, list(mapped))]
    these, those = law.between
    found: list[tuple[int, Sequence[PhysicalObject]]] = []
    if obj in these:
        found.append((1, [other for other in those if other in mapped]))
    if obj in those:
        found.append((2, [other for other in these if other in mapped]))
    return found


def signature_of(world: World, group: Sequence[PhysicalObject]) -> Signature:
    """What the laws and torques of ``group`` ask of a stepper."""
    if group[0]._driven:
        return Signature((), "none", driven=True)
    laws = {law: None for obj in group for law in world.continuous_laws(obj)}
    labels = tuple(sorted({law.label() for law in laws}))
    kinds = {torque_of(world, obj) for obj in group}
    torque = "general" if "general" in kinds else "principal" if "principal" in kinds else "none"
    found = Signature(labels, torque, len(group) > 1)
    if not found.evaluated:
        return found
    ordered = [law for law in world.ordered_laws(laws) if isinstance(law, ContinuousLaw)]
    facts = facts_of(world, tuple(ordered))
    fixed = world.settings.dt is not None
    heard = contacts_concern(world, group)
    form = form_of(world, group, laws, torque, heard)
    stiff = form == "general" and not fixed and not heard and facts.traced and bool(laws) and is_stiff(world, group)
    return Signature(
        labels,
        torque,
        len(group) > 1,
        form=form,
        reads=facts.reads,
        conservative=facts.conservative,
        traced=facts.traced and not moved_by_hand(world, laws),
        near=facts.near,
        stiff=stiff,
        fixed_step=fixed,
        contacts=heard,
        wish=world.wish,
    )


class Facts(NamedTuple):
    """What a set of laws has in common; see `Signature`."""

    reads: tuple[str, ...]
    conservative: bool
    traced: bool
    near: bool


def facts_of(world: World, laws: tuple[ContinuousLaw, ...]) -> Facts:
    """What ``laws`` read and need, found once for each set of traces."""
    traces = tuple(formula_of(law) for law in laws)
    reaches = tuple(isinstance(law, PairLaw) and math.isfinite(law.reach()) for law in laws)
    potentials = tuple(law.defines("potential") for law in laws)
    key = (traces if None not in traces else laws, reaches, potentials)
    found = world.facts.get(key)
    if found is None:
        reads = frozenset[str]().union(*(trace.reads for trace in traces if trace is not None))
        traced = None not in traces and not any(
            isinstance(law, PairLaw) and "since" in trace.reads
            for law, trace in zip(laws, traces, strict=True)
            if trace is not None
        )
        still = traced and not reads & {"velocity", "angular_velocity", "time", "since"}
        found = world.facts[key] = Facts(tuple(sorted(reads)), still and all(potentials), traced, any(reaches))
    return found


def moved_by_hand(world: World, laws: Iterable[ContinuousLaw]) -> bool:
    """Whether driven objects act through one of ``laws`` between two objects."""
    return any(obj._driven for law in laws if isinstance(law, PairLaw) for obj in world.mapping.objects(law))


def contacts_concern(world: World, group: Sequence[PhysicalObject]) -> bool:
    """Whether contacts of some of ``group`` are looked for."""
    contacts = world.contacts
    return contacts is not None and any(contacts.concerns(obj) for obj in group)


def form_of(
    world: World, group: Sequence[PhysicalObject], laws: Iterable[ContinuousLaw], torque: str, heard: bool
) -> str:
    """What can be proved of the forces on ``group``: "two bodies", "linear" or "general"."""
    return "general"


def is_stiff(world: World, group: Sequence[PhysicalObject]) -> bool:
    """Whether forces on ``group`` decay far faster than its state changes."""
    return False
