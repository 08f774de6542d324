"""Flow laws at work: called over batches of objects, checked, and tried before they first act."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.errors import LawFailedError
from xpheve.kernels.clock import Instant
from xpheve.laws.flow import CHANGING, FlowLaw
from xpheve.plan.energy import spin_energy
from xpheve.plan.evaluation import Evaluator, Fetch, vectors
from xpheve.steppers.contract import Array, Rows

if TYPE_CHECKING:
    from xpheve.plan.world import World

TRIED = 64  # objects at which a flow is tried; they share its formula
TRIAL = 1e-3  # [s] a flow is tried for, where no host step says what is a short time
ALIKE = 1e-9  # of the velocities at hand; a method of some order misses by more at any step that means something


def flow_all(
    evaluator: Evaluator,
    flows: Sequence[tuple[FlowLaw, Array]],
    rows: Rows,
    t: Instant,
    state: dict[str, Array],
    span: float,
    under_torque: Array,
) -> tuple[set[str], Array]:
    """Let ``flows``, each with the rows of the engine that it acts on, change ``state`` of ``rows`` one after the other for ``span`` [s].

    Returns what may have changed, and the work [J] of those without potential on each row; of those ``under_torque`` energy of rotation is
    booked as a whole, elsewhere (`xpheve.plan.books`).
    """
    changed: set[str] = set()
    work = np.zeros(len(rows))
    for law, mask in flows:
        which = np.flatnonzero(mask[rows])
        if not len(which):
            continue
        own = rows[which]
        held = {name: array[:, which] for name, array in state.items()}
        found = flow_of(evaluator, law, own, t[0], held.__getitem__, span)
        law.evaluations += 1
        if not law.defines("potential"):
            bodies, apart = evaluator.bodies, under_torque[which]
            work[which] += kinetic(bodies, own, held | found, apart) - kinetic(bodies, own, held, apart)
        for name, values in found.items():
            state[name] = state[name].copy()
            state[name][:, which] = values
            changed.add(name)
    return changed, work


def kinetic(bodies: Any, rows: Rows, state: dict[str, Array], apart: Array) -> Array:
    """Kinetic energy [J] of each of ``rows`` in ``state``, without that of rotation of those ``apart``."""
    v, spin = state["velocity"], state["angular_velocity"]
    found: Array = 0.5 * bodies.arrays["mass"][0, rows] * (v * v).sum(axis=0)
    if spin.any():
        turning = spin_energy(state["orientation"], spin, bodies.arrays["inertia"][:, rows])
        found = found + np.where(apart, 0.0, turning)
    return found


def flow_of(evaluator: Evaluator, law: FlowLaw, rows: Rows, time: float, state: Fetch, span: float) -> dict[str, Array]:
    """What ``law`` makes of ``rows`` in ``span`` [s], by name, (3, rows) each; ``state(name)`` gives the flying columns now.

    Raises
    ------
    LawFailedError
        If it raises, returns no such thing, or numbers that are not finite.
    """
    reads: set[str] = set()
    view = evaluator.view(law, rows, time, state, reads)
    result = evaluator.call(law, "flow", (view, span), rows, time)
    if not isinstance(result, Mapping):
        raise LawFailedError(
            f"{law.label()}.flow returned {_short(result)}; what it changes is needed by name: "
            'return {"velocity": ...}',
            law,
        )
    found = {}
    for name, values in result.items():
        if name not in CHANGING:
            raise LawFailedError(f"{law.label()}.flow returned {name!r}, {_why_not(name)}", law)
        try:
            if np.iscomplexobj(values):
                raise TypeError("complex")
            full = np.broadcast_to(vectors(values, len(rows), (view,)), (len(rows), 3)).T
        except (ValueError, TypeError):
            raise LawFailedError(
                f"{law.label()}.flow returned {_short(values)} for {name}; real numbers of shape ({len(rows)}, 3) or (3,) are needed: "
                "one vector an object",
                law,
            ) from None
        found[name] = np.array(evaluator.finite(law, "flow", full, rows, time))
    evaluator.remember(law, reads)
    return found


def _why_not(name: Any) -> str:
    from xpheve.plugins.suggest import did_you_mean

    if name in ("position", "orientation"):
        return (
            "which a flow leaves alone: it follows from velocity and angular_velocity, and that is the engine's part. "
            "Return what becomes of these"
        )
    return f"which is none of {', '.join(CHANGING)}.{did_you_mean(str(name), list(CHANGING))}"


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    return " ".join(repr(value).split())[:80]


def prove_flow(world: World, law: FlowLaw) -> None:
    """Try ``law`` on its own objects as they are: flowing in two parts must be flowing at once, and for no time must change nothing.

    Raises
    ------
    LawFailedError
        If it is no exact solution, or fails.
    """
    objects = world.in_rank_order(world.mapping.objects(law))[:TRIED]
    rows = np.array([obj._row for obj in objects], dtype=np.int64)
    start = {name: world.read_rows(rows, name) for name in ("position", "velocity", "orientation", "angular_velocity")}
    time, span = world.time[0], world.settings.dt or TRIAL

    def flown(state: dict[str, Array], since: float, for_: float) -> dict[str, Array]:
        return state | flow_of(world.evaluator, law, rows, since, state.__getitem__, for_)

    parts = 0.375 * span, 0.625 * span
    halfway = flown(start, time, parts[0])
    for name in CHANGING:
        once, twice = flown(start, time, span)[name], flown(halfway, time + parts[0], parts[1])[name]
        still = flown(start, time, 0.0)[name]
        size = ALIKE * max(np.abs(once).max(), np.abs(start[name]).max())
        for other, target, what in (
            (
                twice,
                once,
                f"flowing for {parts[0]:g} s and then for {parts[1]:g} s gives {{}}, for {span:g} s at once {{}}",
            ),
            (still, start[name], "flowing for 0 s gives {} of {}"),
        ):
            bad = np.flatnonzero((np.abs(other - target) > size).any(axis=0))
            if len(bad):
                first, second = tuple(other[:, bad[0]].tolist()), tuple(target[:, bad[0]].tolist())
                raise LawFailedError(
                    f"{law.label()}.flow is no exact solution: of {name} of {objects[int(bad[0])]!r} {what.format(first, second)}. "
                    "Solve its equation for any dt, or write it as the force of a FieldLaw",
                    law,
                )
