"""Impulses across the normals, once those along them are known: friction of contacts that are solved together.

One contact is answered by the law of Chatterjee and Ruina (J. Appl. Mech. 65, 1998, 939, "A new algebraic rigid-body collision
law based on impulse space considerations"). With the matrix K of the contact (u' = u + K P, u the relative velocity at the point) let

    x = the impulse along the normal that takes the normal speed away,    x + d = -K^-1 u, the one that takes all of u away;
    P = (1 + e) x + b d,    b = 1 + beta if that P lies in Coulomb's cone |P_t| <= mu P_n, else the b that puts it on the cone.

As n . K d = 0, the normal speed is reversed by e exactly, whatever the friction, and the kinetic energy changes by

    ((1 + e)^2 / 2 - (1 + e)) x . K x + (b^2 / 2 - b) d . K d  <=  0    for 0 <= e <= 1, -1 <= beta <= 1, as 0 <= b <= 1 + beta:

it never rises (Newton's hypothesis with slip that is integrated in impulse makes it rise: Kane's paradox). For spheres this is Coulomb's
law: the surfaces stick and the slip is reversed by beta, or the impulse across is mu times that along, against the slip.

Contacts that are solved together are the same problem in more dimensions. The impulses along the normals are made first, for all; those
across follow, with what they need along the normals so that no pushing contact's normal speed changes. The part w of the slips that no normal
impulse can change then moves alone, and its energy is q . w + q . K q / 2. Where all stick q = -(1 + beta) K^-1 w; else it is 1 + beta times
the q of least energy in all cones (Moreau 1988: the most dissipation). A convex function that is 0 at 0 is at most 0 there, and at any
multiple up to 2: energy does not rise either. Contacts that would have to pull are let go, but for those of infinite friction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xpheve.kernels.quaternion import rotate_inverse
from xpheve.kernels.vector import Vec, cross, dot, norm, scale
from xpheve_laws_collision.turning import ONE, Body, spun

Array = npt.NDArray[np.float64]

CONE = 1e-13  # of its radius: so far outside is on it
ENERGY = 1e-12  # of the work of friction: so much above none is rounding
STEPS = 400  # towards the q of least energy in given cones
ROUNDS = 40  # of cones that follow the impulses along the normals


class Rub(NamedTuple):
    """A contact that pushes: the two bodies, the unit normal from i to j, the arms [m] to it, and what is known of it.

    ``push`` [N s] is the impulse along the normal that it has got, ``slip`` [m/s] the velocity of j seen from i at the point since then,
    ``friction`` and ``tangential`` as in `xpheve.laws.Grip`.
    """

    i: int
    j: int
    normal: Vec
    arm_i: Vec
    arm_j: Vec
    push: float
    slip: Vec
    friction: float
    tangential: float


def rub(contacts: Sequence[Rub], bodies: Sequence[Body]) -> list[Vec]:
    """The impulses [N s], world frame, that friction adds, on body j of each of the connected ``contacts``."""
    if len(contacts) == 1:
        return [_alone(contacts[0], bodies)]
    held = list(range(len(contacts)))
    while True:
        problem = _Slips(contacts, bodies, held)
        q = problem.solve()
        pushes = problem.pushes(q)
        pulled = [k for k in held if pushes[k] < 0.0 and contacts[k].friction < math.inf]
        if not pulled:
            return problem.vectors(q)
        held = [k for k in held if k not in pulled]  # nothing holds those back that friction takes apart


def _alone(one: Rub, bodies: Sequence[Body]) -> Vec:
    """The impulse of one contact, in closed form: b d of the head of this file."""
    if not (one.friction > 0.0 and one.tangential > -1.0):
        return (0.0, 0.0, 0.0)
    n, slip = one.normal, one.slip
    s, t = _across(n)
    along, by_s, by_t = (_moved(one, bodies, direction) for direction in (n, s, t))
    stiff, sn, tn = dot(n, along), dot(s, along), dot(t, along)
    ss, tt = dot(s, by_s) - sn * sn / stiff, dot(t, by_t) - tn * tn / stiff
    st = dot(s, by_t) - sn * tn / stiff
    speed = dot(n, slip) / stiff
    w_s, w_t = dot(s, slip) - sn * speed, dot(t, slip) - tn * speed
    scale_by = (1.0 + one.tangential) / (ss * tt - st * st)
    p_s, p_t = (st * w_t - tt * w_s) * scale_by, (st * w_s - ss * w_t) * scale_by
    more = -(p_s * sn + p_t * tn) / stiff
    size = math.hypot(p_s, p_t)
    if one.friction < math.inf and size > one.friction * (one.push + more):
        part = one.friction * one.push / (size - one.friction * more)
        p_s, p_t, more = part * p_s, part * p_t, part * more
    return (
        more * n[0] + p_s * s[0] + p_t * t[0],
        more * n[1] + p_s * s[1] + p_t * t[1],
        more * n[2] + p_s * s[2] + p_t * t[2],
    )


def _moved(one: Rub, bodies: Sequence[Body], impulse: Vec) -> Vec:
    """How much faster [m/s] the bodies part at the contact by ``impulse`` [N s]: K times it."""
    x, y, z = 0.0, 0.0, 0.0
    for number, arm in ((one.i, one.arm_i), (one.j, one.arm_j)):
        body = bodies[number]
        if body.inverse_mass:
            turned = cross(spun(body, cross(arm, impulse)), arm)
            x += body.inverse_mass * impulse[0] + turned[0]
            y += body.inverse_mass * impulse[1] + turned[1]
            z += body.inverse_mass * impulse[2] + turned[2]
    return x, y, z


class _Slips:
    """The contacts as rows over the movable coordinates, scaled by the roots of 1/m and 1/I; those ``held`` keep their normal speeds."""

    def __init__(self, contacts: Sequence[Rub], bodies: Sequence[Body], held: Sequence[int]) -> None:
        self.contacts, self.bodies = contacts, bodies
        self.held = list(held)
        self.rubbing = [k for k, one in enumerate(contacts) if one.friction > 0.0 and one.tangential > -1.0]
        self.across = [_across(contacts[k].normal) for k in self.rubbing]
        normals = self._rows([(contacts[k], contacts[k].normal) for k in self.held])
        self.sizes = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
        self.normals = normals / self.sizes[:, None]
        self.inverse = np.linalg.pinv(self.normals, rcond=ONE)
        pairs = [(contacts[k], t) for k, two in zip(self.rubbing, self.across, strict=True) for t in two]
        self.rows = self._rows(pairs)
        through = self.rows @ self.inverse
        self.free = self.rows - through @ self.normals
        speeds = np.array([dot(contacts[k].normal, contacts[k].slip) for k in self.held])
        slips = np.array([dot(t, one.slip) for one, t in pairs])
        self.w: Array = slips - through @ (speeds / self.sizes)
        whole, left = np.linalg.norm(self.rows, axis=1), np.linalg.norm(self.free, axis=1)
        self.free[left <= ONE * whole] = 0.0  # other contacts hold them
        self.matrix: Array = self.free @ self.free.T
        self.more = np.array([1.0 + contacts[k].tangential for k in self.rubbing])

    def _rows(self, directions: Sequence[tuple[Rub, Vec]]) -> Array:
        found = np.zeros((len(directions), 6 * len(self.bodies)))
        for line, (one, along) in enumerate(directions):
            for number, arm, sign in ((one.i, one.arm_i, -1.0), (one.j, one.arm_j, 1.0)):
                body = self.bodies[number]
                turning = rotate_inverse(body.orientation, cross(arm, along)) if any(arm) else (0.0, 0.0, 0.0)
                weights = [body.inverse_mass] * 3 + list(body.inverse_inertia)
                entries = [sign * math.sqrt(w) * c for w, c in zip(weights, (*along, *turning), strict=True)]
                found[line, 6 * number : 6 * number + 6] += entries
        return found

    def pushes(self, q: Array) -> Array:
        """The impulses [N s] along all normals after those across, ``q``."""
        found = np.array([one.push for one in self.contacts])
        found[self.held] += self._along(q)
        return found

    def _along(self, q: Array) -> Array:
        """What holds the normal speeds, when impulses ``q`` act across."""
        added: Array = -(self.inverse.T @ (self.rows.T @ q)) / self.sizes
        return added

    def solve(self) -> Array:
        """The impulses [N s] across the normals, two for each contact that rubs."""
        if not self.rubbing or not self.w.any():
            return np.zeros(len(self.w))
        q = self._sticking()
        excess = self._scaled(q)
        if excess < 1.0:
            q = q * excess if len(self.rubbing) == 1 else self._sliding()
        work, stiffness = float(q @ self.w), float(q @ self.matrix @ q)
        if work + 0.5 * stiffness > ENERGY * abs(work):
            q = q * (max(0.0, -2.0 * work / stiffness) if stiffness > 0.0 else 0.0)
        return q

    def _sticking(self) -> Array:
        """-(1 + beta) K^+ w, the least of those that do it."""
        sizes = np.linalg.norm(self.free, axis=1)
        sizes[sizes == 0.0] = math.inf
        u, s, _ = np.linalg.svd(self.free / sizes[:, None], full_matrices=False)
        kept = s > ONE * s.max(initial=0.0)
        wanted = np.repeat(self.more, 2) * self.w / sizes
        found: Array = -((u[:, kept] / s[kept] ** 2) @ (u[:, kept].T @ wanted)) / sizes
        return found

    def _radii(self, q: Array) -> Array:
        """The radii [N s] of the cones where impulses ``q`` act."""
        pushes = self.pushes(q)
        return np.array([_radius(self.contacts[k].friction, float(pushes[k])) for k in self.rubbing])

    def _scaled(self, q: Array) -> float:
        """The greatest part of ``q``, up to 1, that lies in all cones: |b q| <= mu (p + b c)."""
        before, after = self.pushes(np.zeros(len(q))), self.pushes(q)
        part = 1.0
        for place, k in enumerate(self.rubbing):
            friction = self.contacts[k].friction
            size = math.hypot(*q[2 * place : 2 * place + 2])
            if friction == math.inf or size <= friction * after[k] * (1.0 + CONE):
                continue
            part = min(part, friction * before[k] / (size - friction * (after[k] - before[k])))
        return max(part, 0.0)

    def _sliding(self) -> Array:
        """The q of most dissipation, by accelerated projected gradients (Nesterov 1983), in cones that follow the normal impulses."""
        steepest = float(np.linalg.eigvalsh(self.matrix)[-1])
        q = np.zeros(len(self.w))
        for _ in range(ROUNDS):
            last, radii = q, self._radii(q) / self.more
            q = np.repeat(self.more, 2) * self._least(q / np.repeat(self.more, 2), radii, steepest)
            if np.max(np.abs(q - last)) <= CONE * np.max(np.abs(q)):
                break
        return q * self._scaled(q)

    def _least(self, q: Array, radii: Array, steepest: float) -> Array:
        y, momentum = q, 1.0
        for _ in range(STEPS):
            new = _projected(y - (self.w + self.matrix @ y) / steepest, radii)
            change = new - q
            if float((y - new) @ change) > 0.0:
                momentum = 1.0  # overshot: begin anew (O'Donoghue and Candes 2015)
            after = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * momentum * momentum))
            y, momentum = new + ((momentum - 1.0) / after) * change, after
            q = new
            if np.max(np.abs(change)) <= 0.1 * CONE * np.max(np.abs(q)):
                break
        return q

    def vectors(self, q: Array) -> list[Vec]:
        """The impulses [N s] of ``q``, and those along the normals that go with them, as vectors."""
        found: list[Vec] = [(0.0, 0.0, 0.0)] * len(self.contacts)
        if not q.any():
            return found
        for k, along in zip(self.held, self._along(q).tolist(), strict=True):
            found[k] = scale(self.contacts[k].normal, along)
        for place, (k, (s, t)) in enumerate(zip(self.rubbing, self.across, strict=True)):
            a, b = float(q[2 * place]), float(q[2 * place + 1])
            x, y, z = (along + a * p + b * r for along, p, r in zip(found[k], s, t, strict=True))
            found[k] = (x, y, z)
        return found


def _radius(friction: float, push: float) -> float:
    if friction == math.inf:
        return math.inf
    return friction * push if push > 0.0 else 0.0


def _projected(q: Array, radii: Array) -> Array:
    """Each pair of ``q`` drawn onto the disk of its radius."""
    pairs = q.reshape(-1, 2)
    sizes = np.hypot(pairs[:, 0], pairs[:, 1])
    outside = sizes > radii
    factors = np.where(outside, radii / np.where(outside, sizes, 1.0), 1.0)
    found: Array = (pairs * factors[:, None]).reshape(-1)
    return found


def _across(normal: Vec) -> tuple[Vec, Vec]:
    """Two unit vectors across ``normal`` and each other."""
    least = min(range(3), key=lambda k: abs(normal[k]))
    axis: Vec = (float(least == 0), float(least == 1), float(least == 2))
    first = cross(normal, axis)
    first = scale(first, 1.0 / norm(first))
    return first, cross(normal, first)


__all__ = ["Rub", "rub"]
