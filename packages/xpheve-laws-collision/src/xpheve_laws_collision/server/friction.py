"""Friction of what was pushed along the normals in one generation: found by `rubbing`, written and booked here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from xpheve.kernels.vector import Vec, add, cross, dot, norm, scale
from xpheve.objects import PhysicalObject
from xpheve_laws_collision import turning
from xpheve_laws_collision.mass import immovable
from xpheve_laws_collision.narrow_phase import Gap
from xpheve_laws_collision.rubbing import Rub, rub
from xpheve_laws_collision.server.pairs import Pair
from xpheve_laws_collision.simultaneous import components

if TYPE_CHECKING:
    from xpheve_laws_collision.server.generations import Generations


class Spot(NamedTuple):
    """A contact point that approaches, and what its law answered: a separation speed over the approach speed; of some laws more."""

    pair: Pair
    gap: Gap
    approach: float
    restitution: float
    friction: float = 0.0
    tangential: float = 0.0


Pushed = tuple[Spot, float]
"""A contact point and the impulse [N s] along its normal."""


def rub_all(state: Generations, pushed: Sequence[Pushed]) -> None:
    """Let friction act at all of ``pushed``, by connected groups."""
    if not any(spot.friction > 0.0 and spot.tangential > -1.0 for spot, _ in pushed):
        return
    objects = list({obj: None for spot, _ in pushed for obj in spot.pair})
    place = {obj: k for k, obj in enumerate(objects)}
    inverse = [0.0 if immovable(obj) else 1.0 for obj in objects]
    for members in components([(place[s.pair[0]], place[s.pair[1]]) for s, _ in pushed], inverse):
        _rub_together(state, [pushed[k] for k in members])


def _rub_together(state: Generations, pushed: Sequence[Pushed]) -> None:
    objects = list({obj: None for spot, _ in pushed for obj in spot.pair})
    place = {obj: k for k, obj in enumerate(objects)}
    contacts = []
    for spot, push in pushed:
        (a, b), gap = spot.pair, spot.gap
        arms = state.arm(spot.pair, a, gap), state.arm(spot.pair, b, gap)
        slip = state.slip(spot.pair, gap)
        contacts.append(Rub(place[a], place[b], gap.normal, *arms, push, slip, spot.friction, spot.tangential))
    vectors = rub(contacts, [state.body(obj) for obj in objects])
    for k, obj in enumerate(objects):
        if not immovable(obj):
            _push(state, obj, k, contacts, vectors)
    for (spot, push), one, vector in zip(pushed, contacts, vectors, strict=True):
        if any(vector):
            _book(state, spot, push, one.slip, vector)


def _push(
    state: Generations, obj: PhysicalObject, number: int, contacts: Sequence[Rub], vectors: Sequence[Vec]
) -> None:
    """Change velocity and spin of ``obj``, body ``number``, by impulses ``vectors`` [N s] at the contacts; sums are rounded once."""
    mine = [
        (scale(vector, sign), arm)
        for one, vector in zip(contacts, vectors, strict=True)
        for side, arm, sign in ((one.i, one.arm_i, -1.0), (one.j, one.arm_j, 1.0))
        if side == number and any(vector)
    ]
    if not mine:
        return
    body, u = state.body(obj), state.velocity_of(obj)
    state.velocity[obj] = add(u, scale(_total([vector for vector, _ in mine]), body.inverse_mass))
    twist = _total([cross(arm, vector) for vector, arm in mine])
    if any(twist):
        state.spin[obj] = turning.new_spin(state.spin[obj], turning.spun(body, twist))


def _total(vectors: Sequence[Vec]) -> Vec:
    return math.fsum(v[0] for v in vectors), math.fsum(v[1] for v in vectors), math.fsum(v[2] for v in vectors)


def _book(state: Generations, spot: Spot, push: float, slip: Vec, vector: Vec) -> None:
    """Account for the work of friction, and of the host on what it drives."""
    pair, gap = spot.pair, spot.gap
    after = state.slip(pair, gap)
    state.world.add_work(state.law(pair).label(), 0.5 * (dot(vector, slip) + dot(vector, after)))
    state.note(pair, norm(add(scale(gap.normal, push), vector)) - push, vector)
    state.book_host(pair, gap, vector)


__all__ = ["Spot", "rub_all"]
