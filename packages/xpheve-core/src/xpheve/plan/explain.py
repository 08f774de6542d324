"""Explain: who serves what and why, what was evaluated and what was skipped, what the error is. Looking changes nothing."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from xpheve.errors import XpheveError
from xpheve.laws import ContinuousLaw, PairLaw, PhysicalLaw, ResponseLaw
from xpheve.plan.energy import work_by
from xpheve.plan.explain_loops import costs, kernel_line, kernels, law_lines, loop_lines, loop_of, told_of
from xpheve.plan.order import order_report
from xpheve.plan.wakeups.wakeups import SERVERS

if TYPE_CHECKING:
    from xpheve.engine import PhysicsEngine
    from xpheve.plan.world import World


class Explanation:
    """What `PhysicsEngine.explain` found: ``data`` as plain values, `to_json`, and text for people by ``str()``."""

    def __init__(self, data: dict[str, Any]) -> None:
        self.data = data

    def to_json(self) -> str:
        """``data`` as JSON text."""
        return json.dumps(self.data, indent=2, sort_keys=True)

    def __str__(self) -> str:
        return "\n".join(_lines(self.data))

    def __repr__(self) -> str:
        return str(self)


def explain(engine: PhysicsEngine) -> Explanation:
    """Explain the scene of ``engine`` as it stands; one that is not planned yet is planned in a copy."""
    seen = engine
    remarks: list[str] = []
    if engine._world.dirty:
        try:
            seen = engine.copy()
            seen._world.plan()
        except (XpheveError, TypeError) as error:
            seen = engine
            remarks.append(f"not planned yet, and it could not be planned in a copy: {error}")
    world = seen._world
    energy = seen.energy()
    loops = {batch.number: loop_of(world, batch) for batch in world.batches if batch.state.count}
    shares = costs(world)
    tiers = {number: loop["tier"] for number, loop in loops.items()}
    data: dict[str, Any] = {
        "time": engine.time,
        "state": engine.state,
        "objects": world.bodies.count,
        "compile": world.compile,
        "periodic": None if world.periodic is None else [_finite(edge) for edge in world.periodic],
        "groups": _groups(world, loops),
        "laws": [_law(world, law, own, shares, tiers) for law, own in zip(world.laws, engine._world.laws, strict=True)],
        "conditions": [_container(world, container) for container in world.containers],
        "order": order_report(world),
        "conflicts": list(engine._world.clashes.values()),
        "servers": world.wakeups.report(),
        "contacts": None if world.contacts is None else world.contacts.report(),
        "events": {"handled": world.events, "waiting": len(world.queue), "void": world.queue.voided},
        "energy": {
            "kinetic": energy.kinetic,
            "potential": energy.potential,
            "work": energy.work,
            "drift": drift(engine),
            "work_by": work_by(world),
        },
        "real_time": engine.real_time_report(),
        "skipped": _skipped(world),
        "unread_columns": _unread(world),
        "compiled": kernels(),
        "remarks": remarks,
    }
    engine.registry.call("xpheve_report", engine=engine, report=data)
    return Explanation(data)


def _groups(world: World, loops: dict[int, dict[str, Any]]) -> list[dict[str, Any]]:
    found = []
    for batch in world.batches:
        if not batch.state.count:
            continue
        rows = batch.state.rows.tolist()
        groups = {id(world.group_of(world.bodies.objects[row])) for row in rows} if batch.signature.coupled else rows
        found.append(
            {
                "stepper": batch.stepper.id,
                "promise": batch.stepper.promise,
                "objects": len(rows),
                "groups": len(groups),
                "because": _because(batch.signature),
                "refused": dict(batch.choice.refusals),
                "offers": {
                    name: {
                        "order": None if math.isinf(offer.order) else offer.order,
                        "exact": offer.exact,
                        "cost": offer.cost,
                    }
                    for name, offer in batch.choice.offers.items()
                },
                "steps": int(batch.state.numbers.get("steps", 0)),
                "rejected": int(batch.state.numbers.get("rejected", 0)),
                "covered_until": _finite(batch.stepper.covered(batch.state)[0]),
                **loops[batch.number],
            }
        )
    fixed = sum(obj.fixed for obj in world.bodies.objects)
    if fixed:
        found.append({"stepper": "none", "promise": "fixed: nothing is computed", "objects": fixed, "groups": fixed,
                      "because": "fixed=True", "refused": {}, "offers": {}, "steps": 0, "rejected": 0, "covered_until": None,
                      "tier": "", "tier_because": "", "calls": "", "kernel": None})  # fmt: skip
    return found


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _after(signature: Any) -> str:
    return f"; moved on after what acts on it, in place {signature.level + 1}" if signature.level else ""


def _because(signature: Any) -> str:
    if signature.driven:
        return "held or carried by the host; forces and laws wait"
    torque = {
        "none": "no torque",
        "principal": "torque about a principal axis",
        "general": "a torque in general direction",
    }
    if signature.laws:
        torque["none"] = "no stored torque"
    laws = f"laws along the way: {', '.join(signature.laws)}" if signature.laws else "stored forces only"
    return (
        f"{laws}; {torque[signature.torque]}{'; joined by pair laws' if signature.coupled else ''}{_after(signature)}"
    )


def _law(
    world: World, law: PhysicalLaw, own: PhysicalLaw, shares: dict[ContinuousLaw, float], tiers: dict[int, str]
) -> dict[str, Any]:
    objects = len(world.mapping.objects(law))
    how, why = _how(world, law, objects)
    found = {
        "id": law.label(),
        "name": law.name,
        "how": how,
        "objects": objects,
        "evaluations": own.evaluations,
        "skipped_because": why if own.evaluations == 0 or how == "stored" else "",
        "reads": sorted(world.constant.get(law, ())) if isinstance(law, ContinuousLaw) else [],
        "potential": isinstance(law, ContinuousLaw) and law.defines("potential"),
        "pairs": _pairs(law, objects) if isinstance(law, PairLaw) else "",
        "cutoff": _finite(law.reach()) if isinstance(law, PairLaw) else None,
        "parameters": {k: list(v) if isinstance(v, tuple) else v for k, v in law.parameters.items()},
        "kind": "constant" if how == "stored" else "",
        "operations": None,
        "share": None,
        "tier": "",
        "switched": False,
    }
    if isinstance(law, ContinuousLaw) and any(law in batch.laws for batch in world.batches):
        found |= told_of(world, law, shares, tiers)
    return found


def _pairs(law: PairLaw, objects: int) -> str:
    """Which pairs ``law`` acts on."""
    if law.pairs is not None:
        return f"{len(law.pairs)} given"
    if law.between is not None and law.one_sided:
        return f"{len(law.between[0])} sources act on {len(law.between[1])} objects"
    if law.between is not None:
        return f"between {len(law.between[0])} and {len(law.between[1])} objects"
    return f"all of {objects} objects"


def _how(world: World, law: PhysicalLaw, objects: int) -> tuple[str, str]:
    if not law.enabled:
        inside = isinstance(law, ContinuousLaw) and world.is_switched(law)
        return "disabled", "disabled: put out by a number in its loop" if inside else "disabled"
    if not objects and (isinstance(law, (ContinuousLaw, ResponseLaw)) or not law.containers):
        return "unmapped", "no object is mapped to it"
    if isinstance(law, ContinuousLaw) and law in world.constant:
        return "stored", "constant: its force is stored, and evaluated again only when what it reads is set"
    if isinstance(law, ResponseLaw) and all(container.is_polled for container in law.containers):
        return "event", "its container has found no contact"
    if isinstance(law, ResponseLaw):
        return "contacts", "no two of its objects have met"
    if law.containers:
        conditions = ", ".join(str(container.condition) for container in law.containers)
        return "event", f"its condition has not fired: {conditions}"
    batches = [batch for batch in world.batches if law in batch.laws and batch.state.count]
    if batches and all(batch.choice.offers[batch.stepper.id].exact for batch in batches):
        return "along the way", f"in closed form: {', '.join(dict.fromkeys(batch.stepper.id for batch in batches))}"
    return "along the way", "no time has passed"


def _container(world: World, container: Any) -> dict[str, Any]:
    condition = container.condition
    server = "polled: it detects for itself" if container.is_polled else SERVERS[condition.served_by]
    return {
        "id": container.label(),
        "name": container.name,
        "condition": str(condition) if condition is not None else "",
        "server": server,
        "laws": [law.label() for law in container.laws],
        "firings": container.firings,
        "detections": container.detections,
        "spent": container in world.spent,
    }


def _skipped(world: World) -> list[str]:
    found = []
    if not any(batch.signature.laws and batch.state.count for batch in world.batches):
        found.append("stepping: all motion is in closed form, nothing is computed between events")
    if world.contacts is None:
        found.append("contacts: no law or container asks for them")
    if not world.host_step_listeners():
        found.append("host steps: nobody listens to them")
    return found


def _unread(world: World) -> list[str]:
    declared = {name for law in world.laws for name in law.columns}
    found = {name for obj in world.bodies.objects for name in obj._columns} - declared
    return sorted(found)


MOST_PAIRS = 2_000_000
"""Rows and pairs up to which `explain` looks at the energy; it takes some microseconds a pair."""


def drift(engine: PhysicsEngine) -> float | None:
    """Change of (kinetic + potential - work) since the start, over the largest of these energies and of the works done.

    None of scenes with more than `MOST_PAIRS`: nobody waits for that.
    """
    if engine._authored is None:
        return None
    acting = [engine._world.sources(batch) for batch in engine._world.batches if batch.state.count]
    if sum(sources.load for sources in acting if sources is not None) > MOST_PAIRS:
        return None
    try:
        from xpheve.plan.saved import revive

        laws = [type(law) for law in engine._authored.laws]
        containers = [type(container) for container in engine._authored.containers]
        saved = engine._authored
        first = revive(
            type(engine),
            saved.portable(),
            laws,
            containers,
            engine._registry,
            functions=saved.functions,
            by_place=True,
        ).energy()
    except (XpheveError, TypeError):
        return None
    energy = engine.energy()
    scale = max(abs(value) for value in (*first, *energy, *engine._world.work.values()))
    return (energy.balance - first.balance) / scale if scale else 0.0


def _lines(data: dict[str, Any]) -> list[str]:
    """The explanation as text."""
    lines = [f"t = {data['time']} s, {data['state']}, {data['objects']} objects, {len(data['laws'])} laws", ""]
    if data["periodic"]:
        edges = ", ".join("none" if edge is None else f"{edge:.9g} m" for edge in data["periodic"])
        lines += [f"periodic: {edges} along x, y, z; places are in [0, L)", ""]
    lines.append("who moves whom")
    for group in data["groups"]:
        lines.append(
            f"  {group['stepper']}: {group['objects']} objects in {group['groups']} groups: {group['promise']}"
        )
        lines.append(f"    because: {group['because']}")
        if group["steps"]:
            lines.append(f"    steps: {group['steps']}, rejected {group['rejected']}")
        lines += loop_lines(group)
        lines += [f"    refused: {name}: {reason}" for name, reason in group["refused"].items()]
    lines += ["", f"{'law':<34}{'how':<16}{'objects':>8}{'evaluations':>13}  skipped because"]
    for law in data["laws"]:
        name = f"{law['id']}{' ' + repr(law['name']) if law['name'] else ''}"
        lines.append(
            f"{name:<34}{law['how']:<16}{law['objects']:>8}{law['evaluations']:>13}  {law['skipped_because'] or '-'}"
        )
        if law["pairs"]:
            cutoff = "" if law["cutoff"] is None else f", cutoff {law['cutoff']:.9g} m"
            lines.append(f"  pairs: {law['pairs']}{cutoff}")
    lines += law_lines(data["laws"])
    if data["conditions"]:
        lines += ["", "conditions"]
        for c in data["conditions"]:
            lines.append(
                f"  {c['condition']} [{c['server']}]: fired {c['firings']} times, for {', '.join(c['laws']) or 'no law'}"
            )
    if data["order"]:
        lines += ["", "order of laws inside one event (forces along the way are summed: their order does not matter)"]
    for one in data["order"]:
        lines.append(f"  {one['condition']} in {one['container']}: {one['laws'][0]}")
        lines += [f"    then {law} ({why})" for law, why in zip(one["laws"][1:], one["because"], strict=True)]
    lines += [f"conflict: {text}" for text in data["conflicts"]]
    if data["servers"]:
        lines += ["", "who finds the events"]
        for one in data["servers"]:
            lines.append(
                f"  {one['server']}: {one['condition']}: {one['detections']} events, found once for {one['containers']} containers"
            )
    if data["contacts"]:
        c = data["contacts"]
        lines += [
            "",
            f"contacts: {c['impacts']} impacts in {c['generations']} generations, {c['predictions']} predictions",
        ]
        lines += [f"  {text}" for text in c.get("told", ())]
        lines += [f"  rests: {text}" for text in c["supports"]] + [f"  held: {text}" for text in c["held"]]
    if data["real_time"]:
        r = data["real_time"]
        factor = "not known yet" if r["real_time_factor"] is None else f"{r['real_time_factor']:.3g}"
        lines += ["", f"real time: {r['frames']} frames, real-time factor {factor}, {r['lag']:.3g} s behind the clock"]
        lines += [f"  failed: {r['failed']}"] * bool(r["failed"])
    energy = data["energy"]
    drift = (
        "not started, or too many pairs to look"
        if energy["drift"] is None
        else f"{energy['drift']:.2g} of the largest energy"
    )
    lines += [
        "",
        f"energy: kinetic {energy['kinetic']:.9g} J, potential {energy['potential']:.9g} J, work {energy['work']:.9g} J",
    ]
    lines.append(f"  drift of kinetic + potential - work since the start: {drift}")
    lines += [f"  work by {name}: {joules:.9g} J" for name, joules in energy["work_by"].items()]
    lines += ["", *(f"skipped: {text}" for text in data["skipped"])]
    lines += [f"compiled in this process: {kernel_line(one)}" for one in data["compiled"]] or [
        "compiled in this process: nothing"
    ]
    lines += [f"column {name!r} was given to objects, but no law here reads it" for name in data["unread_columns"]]
    lines += [str(remark) for remark in data["remarks"]]
    return lines
