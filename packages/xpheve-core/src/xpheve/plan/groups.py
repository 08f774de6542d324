"""Groups, their signatures, and the stepper that wins each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from xpheve.errors import NoStepperError
from xpheve.kernels.flight import GENERAL, PRINCIPAL, way_of_turning
from xpheve.laws import ContinuousLaw, FlowLaw, PairLaw
from xpheve.plan.contacts_wanted import needs_parabolas
from xpheve.plan.driven import immovable
from xpheve.plan.forms import is_two_bodies
from xpheve.plan.hand_kernels import formula_of
from xpheve.plan.stiffness import is_stiff
from xpheve.steppers.contract import Array, Offer, Refusal, Signature, State, Stepper

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.evaluation import BatchSources
    from xpheve.plan.scouts import Scout
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
        self.scout: Scout | None = None
        """Finds its steps ahead, if it acts on others."""
        self.met: tuple[int, Any, bool] = (-1, None, False)
        """Whether contacts of its rows are looked for: of which structure, and of which rows, that was found."""
        self.lent: tuple[str, ...] = ()
        """Who acts on it through pair laws and shares no potential energy: "driven" objects, moving "sources" of one-sided laws."""

    @property
    def stepper(self) -> Stepper:
        return self.choice.stepper

    @property
    def working(self) -> Array | None:
        """Forces [N] of the laws without potential over the present flights, (3, rows); None if there are none.

        What pair laws with driven objects do is among them, and with moving sources of one-sided laws: neither shares a potential energy.
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
    """All objects that pair laws join with ``start``, itself included; fixed and driven ones are sources and join nothing.

    Nor do the sources of one-sided laws, unless they hang on one another in a ring: a ring is one group.
    """
    found = join(world, start)
    if acts_one_sided(world, found):
        ring = in_ring(world, start, found)
        if ring:
            found = world.in_rank_order({*found, *ring})
    return found


def join(world: World, start: PhysicalObject) -> list[PhysicalObject]:
    """All objects that two-sided laws join with ``start``, itself included, by rank."""
    found = {start: None}
    frontier = [start]
    spent: set[tuple[PairLaw, int]] = set()
    while frontier:
        obj = frontier.pop()
        for law in world.continuous_laws(obj):
            if not isinstance(law, PairLaw) or law.one_sided:
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
    side = law.side_of(obj)
    if side & 1:
        found.append((1, [other for other in those if other in mapped]))
    if side & 2:
        found.append((2, [other for other in these if other in mapped]))
    return found


# Sources and targets


def acts_one_sided(world: World, objects: Iterable[PhysicalObject]) -> bool:
    """Whether one of ``objects`` is a source of a one-sided law."""
    return any(
        isinstance(law, PairLaw) and law.one_sided and law.side_of(obj) == 1
        for obj in objects
        for law in world.mapping.laws(obj)
    )


def targets_of(world: World, obj: PhysicalObject, spent: set[PairLaw] | None = None) -> list[PhysicalObject]:
    """The objects that one-sided laws let ``obj`` act on, by rank, but for laws that are ``spent``; those that are asked become so."""
    found: dict[PhysicalObject, None] = {}
    for law in world.mapping.laws(obj):
        if not (isinstance(law, PairLaw) and law.one_sided and law.enabled and not law.containers):
            continue
        if law.side_of(obj) != 1 or (spent is not None and law in spent):
            continue
        for _, others in partners(world, law, obj):
            found.update((other, None) for other in others if not immovable(other))
        if spent is not None:
            spent.add(law)
    return world.in_rank_order(found) if found else []


def downstream(world: World, objects: Iterable[PhysicalObject]) -> list[PhysicalObject]:
    """All that hangs on ``objects`` by one-sided laws, those excluded, and the groups of that."""
    seen = dict.fromkeys(objects)
    found: dict[PhysicalObject, None] = {}
    frontier = list(seen)
    spent: set[PairLaw] = set()
    while frontier:
        for other in targets_of(world, frontier.pop(), spent):
            for member in [] if other in seen else world.group_of(other):
                if member not in seen:
                    seen[member] = found[member] = None
                    frontier.append(member)
    return list(found)


def sources_of(world: World, objects: Iterable[PhysicalObject]) -> dict[PhysicalObject, None]:
    """The moving objects that act on ``objects`` by one-sided laws."""
    laws = {law: None for obj in objects for law in world.continuous_laws(obj)}
    found: dict[PhysicalObject, None] = {}
    for law in laws:
        if isinstance(law, PairLaw) and law.one_sided and law.between is not None:
            mapped = world.mapping.objects(law)
            found.update((one, None) for one in law.between[0] if one in mapped and not immovable(one))
    return found


def upstream(world: World, group: Sequence[PhysicalObject]) -> dict[PhysicalObject, list[PhysicalObject]]:
    """All that ``group`` hangs on, each with what is joined with it; itself, if it hangs on itself."""
    found: dict[PhysicalObject, list[PhysicalObject]] = {}
    frontier = [group]
    while frontier:
        for obj in sources_of(world, frontier.pop()):
            if obj not in found:
                joined = join(world, obj)
                found.update((member, joined) for member in joined)
                frontier.append(joined)
    return found


def in_ring(world: World, start: PhysicalObject, group: Sequence[PhysicalObject]) -> set[PhysicalObject]:
    """The objects that hang on ``group``, and ``group`` on them; none if it is in no ring."""
    above = upstream(world, group)
    if start not in above:
        return set()
    return {obj for obj, joined in above.items() if start in upstream(world, joined)}


def level_of(world: World, group: Sequence[PhysicalObject], known: dict[PairLaw, int]) -> int:
    """How many groups stand before ``group`` in the order of dependence, at most; ``known`` keeps that of the sources of laws."""
    members = set(group)
    level = 0
    laws = {law: None for obj in group for law in world.continuous_laws(obj)}
    for law in laws:
        if not (isinstance(law, PairLaw) and law.one_sided and law.between is not None):
            continue
        if law in known and not any(law.side_of(obj) == 1 for obj in group):
            level = max(level, known[law])
            continue
        mapped = world.mapping.objects(law)
        sources = [one for one in law.between[0] if one in mapped and not immovable(one)]
        if not members.isdisjoint(sources):  # a ring
            others = [one for one in sources if one not in members]
            level = max([level, *(1 + level_of(world, find_group(world, one), known) for one in others)])
            continue
        known[law] = max((1 + level_of(world, find_group(world, one), known) for one in sources), default=0)
        level = max(level, known[law])
    return level


def signature_of(world: World, group: Sequence[PhysicalObject], known: dict[PairLaw, int] | None = None) -> Signature:
    """What the laws and torques of ``group`` ask of a stepper; ``known``: see `level_of`."""
    if group[0]._driven:
        return Signature((), "none", driven=True)
    laws = {law: None for obj in group for law in world.continuous_laws(obj)}
    labels = tuple(sorted({law.label() for law in laws}))
    kinds = {torque_of(world, obj) for obj in group}
    torque = "general" if "general" in kinds else "principal" if "principal" in kinds else "none"
    levels: dict[PairLaw, int] = {} if known is None else known
    level = level_of(world, group, levels)
    found = Signature(labels, torque, len(group) > 1, level=level)
    if not found.evaluated:
        return replace(found, impacts=True) if flies_to_impacts(world, group[0], found) else found
    ordered = [law for law in world.ordered_laws(laws) if isinstance(law, ContinuousLaw)]
    facts = facts_of(world, tuple(ordered))
    fixed = world.settings.dt is not None
    heard = needs_parabolas(world, group)
    ring = in_itself(group, laws)
    form = "general" if level or ring else form_of(world, group, laws, torque, heard)
    stiff = form == "general" and not fixed and not heard and facts.traced and bool(laws) and is_stiff(world, group)
    return Signature(
        labels,
        torque,
        len(group) > 1,
        form=form,
        reads=facts.reads,
        conservative=facts.conservative and level == 0,
        traced=facts.traced and not moved_by_hand(world, laws) and not ring and (level == 0 or followed(ordered)),
        near=facts.near,
        stiff=stiff,
        fixed_step=fixed,
        contacts=heard,
        wish=world.wish,
        flows=tuple(sorted({law.label() for law in laws if isinstance(law, FlowLaw)})),
        level=level,
    )


def flies_to_impacts(world: World, obj: PhysicalObject, signature: Signature) -> bool:
    """Whether ``obj``, a group of its own under stored forces alone, flies from impact to impact in a stepper of the contact server's pack."""
    return world.contacts is not None and signature.torque == "none" and world.contacts.flies(obj)


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


def in_itself(group: Sequence[PhysicalObject], laws: Iterable[ContinuousLaw]) -> bool:
    """Whether a one-sided law lets one of ``group`` act on another of it."""
    sided = [law for law in laws if isinstance(law, PairLaw) and law.one_sided]
    return any(law.side_of(obj) == 1 for law in sided for obj in group)


def followed(laws: Iterable[ContinuousLaw]) -> bool:
    """Whether one-sided laws read of their sources only what is followed along the way: places and velocities."""
    sided = [law for law in laws if isinstance(law, PairLaw) and law.one_sided]
    traces = [formula_of(law) for law in sided]
    return not any(trace is None or trace.reads & {"orientation", "angular_velocity"} for trace in traces)


def moved_by_hand(world: World, laws: Iterable[ContinuousLaw]) -> bool:
    """Whether driven objects act through one of ``laws`` between two objects."""
    bodies = world.bodies
    if not bodies.driven[: bodies.count].any():
        return False
    return any(obj._driven for law in laws if isinstance(law, PairLaw) for obj in world.mapping.objects(law))


def form_of(
    world: World, group: Sequence[PhysicalObject], laws: Iterable[ContinuousLaw], torque: str, heard: bool
) -> str:
    """What can be proved of the forces on ``group``: "two bodies", "linear" or "general"."""
    if torque == "general" or heard:
        return "general"
    if is_two_bodies(world, group):
        return "two bodies"
    from xpheve.plan.linear_form import is_linear

    if is_linear(world, group, laws):
        return "linear"
    return "general"
