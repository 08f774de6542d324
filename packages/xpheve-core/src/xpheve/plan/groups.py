"""Groups, their signatures, and the stepper that wins each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from xpheve.errors import NoStepperError
from xpheve.kernels.flight import GENERAL, PRINCIPAL, way_of_turning
from xpheve.laws import ContinuousLaw, PairLaw
from xpheve.plan.contacts_wanted import wants_parabolas
from xpheve.plan.driven import immovable
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
    """The cheapest exact offer, else the cheapest of the highest order.

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
    best: tuple[tuple[bool, float, float, str], Stepper] | None = None
    for stepper in sorted(steppers, key=lambda one: one.id):
        answer = stepper.offer(signature)
        if isinstance(answer, Refusal):
            refusals[stepper.id] = answer.reason
            continue
        offers[stepper.id] = answer
        key = (not answer.exact, answer.cost if answer.exact else -answer.order, answer.cost, stepper.id)
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
    laws = {law.label() for obj in group for law in world.continuous_laws(obj)}
    kinds = {torque_of(world, obj) for obj in group}
    torque = "general" if "general" in kinds else "principal" if "principal" in kinds else "none"
    return Signature(tuple(sorted(laws)), torque, len(group) > 1, contacts=wants_parabolas(world, group))
