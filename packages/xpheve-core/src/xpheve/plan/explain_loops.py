"""What `explain` says of loops: how each batch runs, why, what was compiled for it, and what each law costs in it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from xpheve.errors import XpheveError
from xpheve.laws import ContinuousLaw, FlowLaw
from xpheve.plan import contacts_wanted, loops
from xpheve.plan.hand_kernels import is_by_hand

if TYPE_CHECKING:
    from xpheve.plan.evaluation import BatchSources
    from xpheve.plan.groups import Batch
    from xpheve.plan.world import World

ALONE = "law by law"
ORIGINS = {
    "compiled": "compiled now, and kept for later runs",
    "memory": "compiled now, and not kept",
    "cache": "from the cache",
    "interpreted": "interpreted",
}


def loop_of(world: World, batch: Batch) -> dict[str, Any]:
    """How ``batch`` is run along the way, and why; empty texts where motion is in closed form."""
    sources = world.sources(batch)
    if sources is None or batch.choice.offers[batch.stepper.id].exact:
        return {"tier": "", "tier_because": "", "calls": "", "kernel": None}
    if batch.stepper.driver and sources.motion is not None:
        return _driven_by(world, batch, sources)
    tier, because = _tier(world, batch, sources)
    calls = "one step in a call, each law called by itself" if tier == ALONE else _calls(world, batch, sources)
    kernel = None if tier == ALONE or sources.program is None else sources.program.made(tier)
    told = (
        {name: getattr(kernel, name) for name in ("what", "origin", "seconds")} if hasattr(kernel, "origin") else None
    )
    return {"tier": tier, "tier_because": because, "calls": calls, "kernel": told}


def _driven_by(world: World, batch: Batch, sources: BatchSources) -> dict[str, Any]:
    """How the driver of ``batch`` runs."""
    from xpheve.plan.motions import COMPILE_AFTER

    motion, wish = sources.motion, world.compile
    tier = world.tiers.get(batch.signature)
    because = f'compile="{wish}"'
    if wish == "auto":
        after = "" if tier is not None else "; not run yet"
        because = f"from {COMPILE_AFTER} evaluations of rows and pairs on it pays to compile{after}"
    tier = tier or motion.tier(0)
    kernel = motion.made(batch.stepper.driver, tier)
    told = (
        {name: getattr(kernel, name) for name in ("what", "origin", "seconds")} if hasattr(kernel, "origin") else None
    )
    return {"tier": tier, "tier_because": because, "calls": _calls(world, batch, sources), "kernel": told}


def _tier(world: World, batch: Batch, sources: BatchSources) -> tuple[str, str]:
    from xpheve.plan.tiers import choose_tier, why_tier

    try:
        program = sources.program
    except XpheveError as error:
        return ALONE, str(error)
    if program is None and sources._motion is not None and batch.signature in world.tiers:
        return world.tiers[batch.signature], "what acts on it is followed as polynomials"
    if program is None:
        return ALONE, sources.why_alone or "objects that move act on it by one-sided laws"
    ran = batch.state.numbers.get("steps", 0) > 0
    if ran and world.settings.dt is None:
        return ALONE, "steps follow the tolerances; with dt they are made in a loop"
    tier = world.tiers.get(batch.signature)
    if tier is None and ran:
        return ALONE, f"{batch.stepper.id} asked for no loop, as when bodies turn"
    size = why_tier(world.compile, sources.load)
    return (tier, size) if tier is not None else (choose_tier(world.compile, sources.load), f"{size}; not run yet")


def _calls(world: World, batch: Batch, sources: BatchSources) -> str:
    """Whether many steps are made in one call, and if not, why not."""
    objects = [world.bodies.objects[row] for row in batch.state.rows.tolist()]
    if len(sources.hands):
        why = "objects that the host carries act on it"
    elif not loops.stands_still(world, batch):
        why = "what acts on it is known one step at a time"
    elif world.is_source(batch):
        why = "it acts on objects that move after it"
    elif world.wakeups.tracker.follows_any(objects):
        why = "a condition follows its motion"
    elif contacts_wanted.meets(world, batch):
        why = "contacts of its objects are looked for"
    elif world.host_step_listeners():
        why = "somebody is called at host steps"
    else:
        until = "many steps in one call, until somebody looks or something happens"
        return f"{until}, or a force jumps" if sources.jumps else until
    return f"one step in a call: {why}"


def costs(world: World) -> dict[ContinuousLaw, float]:
    """The share of each law in the operations of a step of all loops; laws that are not traced have none."""
    work: dict[ContinuousLaw, float] = {}
    for batch in world.batches:
        sources = world.sources(batch) if batch.state.count else None
        if sources is None:
            continue
        for law, count in sources.counts():
            work[law] = work.get(law, 0.0) + count * _operations(law)
    total = sum(work.values())
    return {law: one / total for law, one in work.items()} if total else {}


def _operations(law: ContinuousLaw) -> int:
    """Operations of a row or pair in a step: a force that depends on velocity is found twice."""
    from xpheve.trace.nature import operations

    trace = _trace_of(law)
    if trace is None:
        return 0
    return sum(operations(trace.motion)) * (2 if "velocity" in trace.reads else 1)


def _trace_of(law: ContinuousLaw) -> Any:
    from xpheve.trace.recorder import trace_law

    try:
        return trace_law(law)
    except XpheveError:
        return None


def told_of(
    world: World, law: ContinuousLaw, shares: dict[ContinuousLaw, float], tiers: dict[int, str]
) -> dict[str, Any]:
    """What is said of a law that is evaluated along the way; ``tiers`` are those of the batches, by number."""
    own = [tiers[batch.number] for batch in world.batches if law in batch.laws and batch.number in tiers]
    found = {
        "tier": ", ".join(filter(None, dict.fromkeys(own))),
        "switched": world.is_switched(law),
        "share": shares.get(law),
        "summed": summed(world, law),
    }
    trace = _trace_of(law)
    if trace is None:
        reads = sorted(world.evaluator.seen.get(law, ()))
        return found | {"reads": reads, "kind": _why_untraced(law), "operations": None}
    nature = _nature_of(law, trace)
    return found | {
        "reads": sorted(trace.reads),
        "kind": nature.words(),
        "operations": nature.operations._asdict(),
    }


def summed(world: World, law: ContinuousLaw) -> str:
    """How the forces of ``law`` between many bodies are summed, with the error that was measured; empty where pair after pair is."""
    found = []
    for batch in world.batches:
        sources = world.sources(batch) if batch.state.count and law in batch.laws else None
        motion = None if sources is None else sources.made_motion
        words = "" if motion is None else motion.sums().get(law, "")
        found += [words] if words else []
    return "; ".join(found)


def _nature_of(law: ContinuousLaw, trace: Any) -> Any:
    """What the expressions say, and what numbers say of energy where they can be tried."""
    from xpheve.trace.check import nature_of
    from xpheve.trace.nature import nature

    try:
        return nature_of(law, trace)
    except XpheveError:
        return nature(trace)


def _why_untraced(law: ContinuousLaw) -> str:
    from xpheve.trace.recorder import trace_law, why_untraced

    why = why_untraced(law)
    if isinstance(law, FlowLaw):
        return f"split off: {why}"
    if is_by_hand(law):
        return f"{why}; the NumPy tier calls it row by row in Python, which is slow"
    if not why:
        try:
            trace_law(law)
        except XpheveError as error:
            why = str(error)
    return f"not traced: {why}"


def kernels() -> list[dict[str, Any]]:
    """What this process compiled, or took from the cache; nothing is imported to say so."""
    module = sys.modules.get("xpheve.compile")
    facts = module.facts() if module is not None else []
    return [
        {name: one[name] for name in ("what", "origin", "seconds")} for one in facts if one["origin"] != "interpreted"
    ]


# Text


def loop_lines(group: dict[str, Any]) -> list[str]:
    """How the batch of ``group`` runs, as text."""
    if not group["tier"]:
        return []
    lines = [f"    loop: {group['tier']}: {group['tier_because']}"]
    if group["tier"] != ALONE:
        lines.append(f"    calls: {group['calls']}")
    if group["kernel"] is not None and group["kernel"]["origin"] != "interpreted":
        lines.append(f"    code: {kernel_line(group['kernel'])}")
    return lines


def kernel_line(kernel: dict[str, Any]) -> str:
    """Where compiled code came from, in what time."""
    return f"{kernel['what']}: {ORIGINS[kernel['origin']]}, {kernel['seconds']:.3g} s"


def law_lines(laws: list[dict[str, Any]]) -> list[str]:
    """What laws along the way are and cost, as text."""
    lines = []
    for law in laws:
        if not law["tier"]:
            continue
        share = "" if law["share"] is None else f"; {law['share']:.0%} of the operations of a step"
        switched = "; switched by a number" if law["switched"] else ""
        lines.append(f"  {law['name'] or law['id']} [{law['tier']}]: reads {', '.join(law['reads']) or 'nothing'}")
        lines.append(f"    {law['kind']}{share}{switched}")
        if law["summed"]:
            lines.append(f"    sum: {law['summed']}")
    return ["", "laws along the way", *lines] if lines else []
