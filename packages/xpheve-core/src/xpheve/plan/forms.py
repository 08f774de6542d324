"""What can be proved of the forces on a group, so that a closed form may serve it: two bodies under an inverse-square force."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from xpheve.kernels.elliptic import Pair, pair_add
from xpheve.kernels.kepler import inverse_square_rate as rate_of_numbers
from xpheve.laws import ContinuousLaw, FieldLaw, PairLaw
from xpheve.plan.hand_kernels import formula_of
from xpheve.steppers.contract import Attraction
from xpheve.trace.inverse_square import Centre, InverseSquare, centre, inverse_square

if TYPE_CHECKING:
    from xpheve.objects import PhysicalObject
    from xpheve.plan.evaluation import BatchSources
    from xpheve.plan.world import World

ALIKE = 4
"""Units of the last place by which the accelerations of two bodies by stored forces may differ: what m g / m leaves of g."""

inverse_square_rate = lru_cache(maxsize=4096)(rate_of_numbers)
"""Many bodies are alike."""

_PROOFS: WeakKeyDictionary[ContinuousLaw, tuple[Any, dict[str, Any], InverseSquare | Centre | None]] = (
    WeakKeyDictionary()
)
"""What was found of a law, with the trace and the parameters that it had."""


def is_two_bodies(world: World, group: Sequence[PhysicalObject]) -> bool:
    """Whether ``group`` is one body that moves about one fixed place, or two about one another, under inverse-square forces.

    A stored force may act beside, if it accelerates both alike.
    """
    return not why_not_two_bodies(world, group)


def why_not_two_bodies(world: World, group: Sequence[PhysicalObject]) -> str:
    """Why `is_two_bodies` does not hold, as the end of a sentence; empty if it does."""
    if len(group) > 2 or any(obj._driven for obj in group):
        return "more than two bodies move" if len(group) > 2 else "the host moves a body"
    laws = {law: None for obj in group for law in world.continuous_laws(obj)}
    places: set[Any] = set()
    for law in laws:
        if isinstance(law, PairLaw) and law.one_sided:
            targets = [obj for obj in group if law.side_of(obj) == 2]
            if not targets:
                continue
            if len(group) > 1:
                return f"{law.label()} acts on one of two that belong together"
        found = proof_of(law)
        if found is None:
            return f"{law.label()} is not proven to fall with the square of the distance"
        if found.softening != 0.0:
            return f"{law.label()} is softened"
        if not law.defines("potential"):
            return f"{law.label()} has no potential, so that its work must be booked along the way"
        places.update(_places(world, law, found, group))
    if len(places) != 1:
        return "nothing attracts" if not places else "more than one place attracts"
    (other,) = places
    if not isinstance(other, tuple) and other._driven:
        return "the host moves a body"
    if not isinstance(other, tuple) and len(group) == 1 and not other._fixed:
        return "what attracts moves, and feels nothing of it"
    return "" if _forced_alike(world, group) else "stored forces accelerate the bodies differently"


def proof_of(law: ContinuousLaw) -> InverseSquare | Centre | None:
    """What kind of inverse-square force ``law`` is with the parameters that it has; None if that is not proven."""
    trace = formula_of(law)
    if trace is None:
        return None
    known = _PROOFS.get(law)
    if known is None or known[0] is not trace or known[1] != law.parameters:
        prove = inverse_square if isinstance(law, PairLaw) else centre
        known = _PROOFS[law] = (trace, dict(law.parameters), prove(trace, law))
    return known[2]


def _places(
    world: World, law: ContinuousLaw, found: InverseSquare | Centre, group: Sequence[PhysicalObject]
) -> Iterable[Any]:
    """Where the force of ``law`` on ``group`` comes from: objects, or the place of a centre; of two that move, one of them for both."""
    from xpheve.plan.groups import partners

    if isinstance(found, Centre):
        return [found.place] if len(group) == 1 else [found.place, "and one another"]
    assert isinstance(law, PairLaw)
    others: set[PhysicalObject] = set()
    for obj in group:
        if obj not in world.mapping.objects(law):
            continue
        if law.one_sided:
            assert law.between is not None
            others.update(other for other in law.between[0] if other in world.mapping.objects(law))
            continue
        for _, joined in partners(world, law, obj):
            others.update(other for other in joined if other is not obj)
    return {group[1] if other is group[0] else other for other in others}


def _forced_alike(world: World, group: Sequence[PhysicalObject]) -> bool:
    """Whether stored forces do not change how the body, or one of the two, moves about the other."""
    bodies = world.bodies
    forces = [bodies.get("force", obj._row) for obj in group]
    if not any(any(force) for force in forces):
        return True
    if len(group) == 1:
        return False
    first, second = (
        tuple(one / bodies.get("mass", obj._row)[0] for one in force) for obj, force in zip(group, forces, strict=True)
    )
    room = ALIKE * math.ulp(max(map(abs, (*first, *second))))
    return all(abs(a - b) <= room for a, b in zip(first, second, strict=True))


def form_changed(world: World, obj: PhysicalObject) -> bool:
    """Whether the batch that serves ``obj`` was chosen for a form of forces that they have no more."""
    number = int(world.bodies.batch[obj._row])
    if number < 0 or world.batches[number].signature.form != "two bodies":
        return False
    return not is_two_bodies(world, world.group_of(obj))


def attractions(sources: BatchSources, rows: Iterable[int]) -> dict[int, Attraction]:
    """What attracts each of ``rows``; a row that nothing attracts, or more than one place, is left out."""
    wanted = np.array(sorted(rows), dtype=np.int64)
    found: dict[int, Attraction] = {}
    torn: set[int] = set()
    for law, pairs in sources.pairs:
        proof = proof_of(law)
        left, right = pairs.every()
        near = np.isin(left, wanted) | np.isin(right, wanted)
        for a, b in zip(left[near].tolist(), right[near].tolist(), strict=True):
            if not isinstance(proof, InverseSquare) or proof.softening != 0.0:
                torn.update((b,) if law.one_sided else (a, b))
                continue
            mu = _rate_of_pair(sources.world, law, proof, a, b)
            _note(found, torn, b, _attraction(sources.world, a, mu, law))
            if law.one_sided:
                torn.update([] if sources.world.bodies.objects[a]._fixed else [b])
            else:
                _note(found, torn, a, _attraction(sources.world, b, mu, law))
    for field, mask in sources.fields:
        proof = proof_of(field)
        for row in wanted[mask[wanted]].tolist():
            if not isinstance(proof, Centre) or proof.softening != 0.0:
                torn.add(row)
                continue
            mu = _rate_of_centre(sources.world, field, proof, row)
            _note(found, torn, row, Attraction(-1, proof.place, mu, field.label(), field))
    return {row: found[row] for row in wanted.tolist() if row in found and row not in torn}


def _note(found: dict[int, Attraction], torn: set[int], row: int, one: Attraction) -> None:
    """Add ``one`` to what attracts ``row``."""
    known = found.get(row)
    if known is None:
        found[row] = one
    elif known.row != one.row or known.place != one.place:
        torn.add(row)
    else:
        found[row] = known._replace(mu=pair_add(known.mu, one.mu), laws=f"{known.laws} + {one.laws}")


def _attraction(world: World, row: int, mu: Pair, law: PairLaw) -> Attraction:
    """That of the object in ``row``."""
    if not world.bodies.objects[row]._fixed:
        return Attraction(row, (0.0, 0.0, 0.0), mu, law.label(), law)
    return Attraction(-1, world.bodies.get("position", row), mu, law.label(), law)  # type: ignore[arg-type]


def _rate_of_pair(world: World, law: PairLaw, proof: InverseSquare, a: int, b: int) -> Pair:
    """Mu [m^3/s^2] of two objects: K q_a q_b (1 / m_a + 1 / m_b), without that of a fixed one."""
    if not law.enabled:
        return (0.0, 0.0)
    masses = [math.inf if world.bodies.objects[row]._fixed else _mass(world, row) for row in (a, b)]
    if proof.charge == "mass":  # K (m_a + m_b), or K m of the fixed one
        held = [_mass(world, row) for row, mass in zip((b, a), masses, strict=True) if mass != math.inf]
        rates = [inverse_square_rate(proof.strength, one, 1.0, 1.0, math.inf) for one in held]
        return rates[0] if len(rates) == 1 else pair_add(rates[0], rates[1])
    charges = [_charge(world, proof.charge, row) for row in (a, b)]
    return inverse_square_rate(proof.strength, charges[0], charges[1], masses[0], masses[1])


def _rate_of_centre(world: World, law: FieldLaw, proof: Centre, row: int) -> Pair:
    """Mu [m^3/s^2] of one object about a fixed centre: K q / m."""
    if not law.enabled:
        return (0.0, 0.0)
    if proof.charge == "mass":
        return (proof.strength, 0.0)
    return inverse_square_rate(proof.strength, _charge(world, proof.charge, row), 1.0, _mass(world, row), math.inf)


def _mass(world: World, row: int) -> float:
    return world.bodies.get("mass", row)[0]


def _charge(world: World, name: str, row: int) -> float:
    if not name:
        return 1.0
    return _mass(world, row) if name == "mass" else float(world.bodies.columns[name][row])
