"""Impulses at contact points of bodies that turn, solved together.

The same problem as in `simultaneous`, with lever arms: a push p along the unit normal n at a point r from the centre changes
the velocity by p n / m and the angular velocity, along the principal axes, by p c / I with c = r x n in the body's frame. So a
contact is a row (-n, -c_i, n, c_j) over its two bodies, the matrix of the contacts is A = J M^-1 J^T with M = (m, m, m, I_1, I_2,
I_3), and impulses p >= 0 are wanted such that each contact leaves with at least its wanted speed, and with exactly that where
one acts (Moreau 1988; Baraff, SIGGRAPH 1989). Where several sets of impulses do the same it is the one of least norm: four equal
ones under a box that falls flat.

Which contacts push is found in floats, by singular values, in which contacts that differ by rounding only are one. Their
impulses are then refined with residuals free of error, and each component of a velocity is rounded once.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xpheve.kernels.quaternion import Quat, rotate, rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, sub
from xpheve_laws_collision.simultaneous import pushed

Array = npt.NDArray[np.float64]

ONE = 1e-9  # of the largest: directions of motion that contacts tell apart by less are one
REFINEMENTS = 4
NONE = Fraction(1, 2**70)  # of the pushes that turn a body: what is left of them when they cancel
SLOW = 1e-12  # of the speeds at hand: missing less than this is missing nothing, when the pushing contacts are sought


class Body(NamedTuple):
    """One body: 1/m [1/kg], 1/I [1/(kg m^2)] along its principal axes (0 where immovable), velocities, orientation, centre [m].

    ``spin`` [rad/s] is the angular velocity in the frame of the principal axes.
    """

    inverse_mass: float
    inverse_inertia: Vec
    velocity: Vec
    spin: Vec
    orientation: Quat
    position: Vec


class Push(NamedTuple):
    """A contact point: the two bodies, the unit normal from i to j, and the levers r x n in the frames of both."""

    i: int
    j: int
    normal: Vec
    lever_i: Vec
    lever_j: Vec


def push_at(i: int, j: int, bodies: Sequence[Body], normal: Vec, point: Vec) -> Push:
    """The contact of bodies ``i`` and ``j`` at ``point`` [m] along ``normal``."""
    return Push(i, j, normal, _lever(bodies[i], normal, point), _lever(bodies[j], normal, point))


def _lever(body: Body, normal: Vec, point: Vec) -> Vec:
    if not any(body.inverse_inertia) and not any(body.spin):
        return (0.0, 0.0, 0.0)
    return rotate_inverse(body.orientation, cross(sub(point, body.position), normal))


def separation_speed(push: Push, bodies: Sequence[Body]) -> Fraction:
    """How fast [m/s] the contact opens, without error: n . (v_j - v_i) + c_j . w_j - c_i . w_i."""
    total = Fraction(0)
    for number, lever, sign in ((push.i, push.lever_i, -1), (push.j, push.lever_j, 1)):
        body = bodies[number]
        for rates, along in ((body.velocity, push.normal), (body.spin, lever)):
            for rate, part in zip(rates, along, strict=True):
                if rate != 0.0 and part != 0.0:
                    total += sign * Fraction(rate) * Fraction(part)
    return total


def solve(pushes: Sequence[Push], bodies: Sequence[Body], missing: Sequence[Fraction]) -> list[Fraction]:
    """The impulses [N s] of contacts that lack ``missing`` [m/s] of the speed they should leave with, one for each."""
    rows = _Rows(pushes, bodies)
    if len(pushes) == 1:
        return [max(Fraction(0), missing[0]) / rows.own(0)] if rows.own(0) else [Fraction(0)]
    free = [k for k in range(len(pushes)) if rows.own(k)]
    matrix = rows.scaled(free)
    sizes = np.array([rows.size[k] for k in free])
    largest = max((abs(missing[k]) for k in free), default=Fraction(0))
    impulses = [Fraction(0)] * len(pushes)
    if largest == 0:
        return impulses
    wanted = np.array([float(missing[k] / largest) for k in free]) / sizes
    chosen = pushing(matrix, wanted)
    inverse = _inverse(matrix[chosen])
    for _ in range(REFINEMENTS):
        moved = rows.moved(impulses)
        lack = [missing[free[k]] - rows.speed(free[k], moved) for k in chosen]
        worst = max((abs(x) for x in lack), default=Fraction(0))
        if worst == 0:
            break
        step = inverse @ (np.array([float(x / worst) for x in lack]) / sizes[chosen])
        for k, x in zip(chosen, step / sizes[chosen], strict=True):
            impulses[free[k]] += Fraction(float(x) * float(worst))
    return [max(p, Fraction(0)) for p in impulses]


def after(pushes: Sequence[Push], bodies: Sequence[Body], impulses: Sequence[Fraction]) -> list[tuple[Vec, Vec]]:
    """Velocity [m/s] and change of angular velocity [rad/s], both in the world frame, of each body after the impulses."""
    parts: dict[int, list[tuple[int, Fraction, Vec, Vec]]] = {}
    for push, impulse in zip(pushes, impulses, strict=True):
        if impulse:
            parts.setdefault(push.i, []).append((-1, impulse, push.normal, push.lever_i))
            parts.setdefault(push.j, []).append((1, impulse, push.normal, push.lever_j))
    found = []
    for number, body in enumerate(bodies):
        mine = parts.get(number, [])
        v, turned = list(body.velocity), [0.0, 0.0, 0.0]
        if body.inverse_mass:
            for axis in range(3):
                speed = pushed(v[axis], body.inverse_mass, [(sign, p, n[axis]) for sign, p, n, _ in mine])
                v[axis] = speed if speed == v[axis] or abs(speed) > NONE * abs(v[axis]) else 0.0
                if body.inverse_inertia[axis]:
                    twists = [sign * p * Fraction(c[axis]) for sign, p, _, c in mine]
                    total = sum(twists, Fraction(0))
                    if abs(total) > NONE * sum(map(abs, twists)):
                        turned[axis] = float(total * Fraction(body.inverse_inertia[axis]))
        change = rotate(body.orientation, (turned[0], turned[1], turned[2])) if any(turned) else (0.0, 0.0, 0.0)
        found.append(((v[0], v[1], v[2]), change))
    return found


def turned_by(body: Body, impulse: Vec, point: Vec) -> Vec:
    """Change of angular velocity [rad/s], world frame, by ``impulse`` [N s] on ``body`` at ``point`` [m]."""
    return spun(body, cross(sub(point, body.position), impulse))


def spun(body: Body, twist: Vec) -> Vec:
    """Change of angular velocity [rad/s], world frame, by an angular impulse ``twist`` [N m s], world frame."""
    if not any(body.inverse_inertia):
        return (0.0, 0.0, 0.0)
    own = rotate_inverse(body.orientation, twist)
    w = body.inverse_inertia
    return rotate(body.orientation, (w[0] * own[0], w[1] * own[1], w[2] * own[2]))


def pushing(matrix: Array, wanted: Array) -> list[int]:
    """Which rows push: p >= 0 with S S^T p >= b, complementary, of a matrix S of rows of length 1.

    By active sets, starting with all that want to (Lawson and Hanson 1974, chapter 23), with pseudo-inverses, so that redundant
    contacts share.
    """
    size = len(wanted)
    p = np.zeros(size)
    active = wanted > 0.0
    tolerance = SLOW * float(np.max(np.abs(wanted)))
    for _ in range(3 * size + 3):
        while active.any():
            places = np.flatnonzero(active)
            full = np.zeros(size)
            full[places] = _inverse(matrix[places]) @ wanted[places]
            pulling = active & (full <= 0.0)
            if not pulling.any():
                p = full
                break
            fractions = p[pulling] / np.maximum(p[pulling] - full[pulling], 1e-300)
            p = np.where(active, p + float(np.min(fractions, initial=1.0)) * (full - p), 0.0)
            active &= ~(pulling & (p <= 1e-14 * np.max(p, initial=0.0)))
        slow = np.where(active, 0.0, wanted - matrix @ (matrix.T @ p))
        worst = int(np.argmax(slow))
        if slow[worst] <= tolerance:
            break
        active[worst] = True
    return np.flatnonzero(active).tolist()


def _inverse(rows: Array) -> Array:
    """The pseudo-inverse of S S^T, by the singular values of S."""
    u, s, _ = np.linalg.svd(rows, full_matrices=False)
    kept = s > ONE * s.max(initial=0.0)
    inverse: Array = (u[:, kept] / s[kept] ** 2) @ u[:, kept].T
    return inverse


class _Rows:
    """The contacts as rows over all movable coordinates: without error, and scaled to length 1 as floats."""

    def __init__(self, pushes: Sequence[Push], bodies: Sequence[Body]) -> None:
        self.parts: list[list[tuple[tuple[int, int], Fraction, Fraction]]] = []
        """Of each contact: (body, coordinate), entry of its row, 1/m or 1/I."""
        for push in pushes:
            row = []
            for number, lever, sign in ((push.i, push.lever_i, -1), (push.j, push.lever_j, 1)):
                body = bodies[number]
                entries = (*push.normal, *lever)
                weights = (*(body.inverse_mass,) * 3, *body.inverse_inertia)
                for k, (entry, weight) in enumerate(zip(entries, weights, strict=True)):
                    if entry != 0.0 and weight != 0.0:
                        row.append(((number, k), sign * Fraction(entry), Fraction(weight)))
            self.parts.append(row)
        self.size = [float(self.own(k)) ** 0.5 for k in range(len(pushes))]

    def own(self, k: int) -> Fraction:
        """1 / effective mass [1/kg] of contact ``k``."""
        return sum((entry * entry * weight for _, entry, weight in self.parts[k]), Fraction(0))

    def scaled(self, places: Sequence[int]) -> Array:
        """Rows J M^-1/2 of length 1."""
        columns: dict[tuple[int, int], int] = {}
        for k in places:
            for where, _, _ in self.parts[k]:
                columns.setdefault(where, len(columns))
        found = np.zeros((len(places), len(columns)))
        for line, k in enumerate(places):
            for where, entry, weight in self.parts[k]:
                found[line, columns[where]] = float(entry) * float(weight) ** 0.5 / self.size[k]
        return found

    def moved(self, impulses: Sequence[Fraction]) -> dict[tuple[int, int], Fraction]:
        """Changes of velocity M^-1 J^T p."""
        found: dict[tuple[int, int], Fraction] = {}
        for row, impulse in zip(self.parts, impulses, strict=True):
            if impulse:
                for where, entry, weight in row:
                    found[where] = found.get(where, Fraction(0)) + entry * weight * impulse
        return found

    def speed(self, k: int, moved: dict[tuple[int, int], Fraction]) -> Fraction:
        """By how much contact ``k`` opens faster after them."""
        return sum((entry * moved[where] for where, entry, _ in self.parts[k] if where in moved), Fraction(0))


def new_spin(spin: Vec, change: Vec) -> Vec:
    """``spin`` + ``change``; its own bits where nothing changes."""
    return add(spin, change) if any(change) else spin
