"""What acts on rows whose forces are affine, as matrices: M x'' = K x + D x' + c."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from xpheve.steppers.contract import Array, Rows
from xpheve.steppers.wide import Wide


class Couplings(NamedTuple):
    """Forces on rows in proportion to places and velocities of others."""

    rows: Rows
    """Places of those acted upon, (n,)."""
    others: Rows
    """Places of those whose motion acts, (n,)."""
    stiffness: Wide
    """[N/m], shape (3, 3, n)."""
    damping: Wide
    """[kg/s], shape (3, 3, n)."""
    conservative: bool
    """Whether a potential stands for their work."""


@dataclass
class LinearForm:
    """Affine forces on n rows, in ~32 digits.

    Attributes
    ----------
    rows
        Rows of the engine, (n,).
    mass
        Masses [kg], (n,).
    stiffness, damping
        Of each row's force in its own place [N/m] and velocity [kg/s], (3, 3, n).
    constant
        Force [N] where all places and velocities are 0, (3, n).
    held, kept
        The parts of ``stiffness`` and ``constant`` that have a potential.
    couplings
        Of each row's force in places and velocities of others.
    works
        Whether a force has no potential.
    """

    rows: Rows
    mass: Array
    stiffness: Wide
    damping: Wide
    constant: Wide
    held: Wide
    kept: Wide
    couplings: list[Couplings] = field(default_factory=list)
    works: bool = False

    def force(self, position: Array) -> Wide:
        """Forces [N] on the rows at rest at ``position`` [m], (3, n)."""
        return self._at(position, self.constant, self.stiffness, self.couplings)

    def kept_force(self, position: Array) -> Wide:
        """The part of `force` that has a potential."""
        return self._at(position, self.kept, self.held, [one for one in self.couplings if one.conservative])

    @staticmethod
    def _at(position: Array, constant: Wide, stiffness: Wide, couplings: list[Couplings]) -> Wide:
        x = Wide(position)
        total = constant + (stiffness * x[None]).sum(1)
        for one in couplings:
            found = (one.stiffness * x[None, :, one.others]).sum(1)
            for turn in turns(one.rows):
                at = one.rows[turn]
                total[:, at] = total[:, at] + found[:, turn]
        return total

    def groups(self) -> list[Rows]:
        """Places of rows that act on one another, of two or more; ascending, by the first."""
        parent = np.arange(len(self.rows))

        def root(k: int) -> int:
            while parent[k] != k:
                parent[k] = parent[parent[k]]
                k = int(parent[k])
            return k

        joined: set[int] = set()
        for one in self.couplings:
            for a, b in zip(one.rows.tolist(), one.others.tolist(), strict=True):
                joined |= {a, b}
                p, q = root(a), root(b)
                if p != q:
                    parent[max(p, q)] = min(p, q)
        found: dict[int, list[int]] = {}
        for k in sorted(joined):
            found.setdefault(root(k), []).append(k)
        return [np.array(one, dtype=np.int64) for one in found.values()]

    def matrices(self, group: Rows) -> tuple[Wide, Wide]:
        """K and D of the rows at the places ``group``, (3 g, 3 g): x, y, z of the first, then of the next."""
        stiffness = [one.stiffness for one in self.couplings]
        damping = [one.damping for one in self.couplings]
        return self._matrix(group, self.stiffness, stiffness), self._matrix(group, self.damping, damping)

    def held_matrix(self, group: Rows) -> Wide:
        """The part of K that has a potential."""
        none = [Wide(np.zeros_like(one.stiffness.high)) for one in self.couplings]
        parts = [one.stiffness if one.conservative else nil for one, nil in zip(self.couplings, none, strict=True)]
        return self._matrix(group, self.held, parts)

    def _matrix(self, group: Rows, own: Wide, parts: list[Wide]) -> Wide:
        g = len(group)
        local = np.full(len(self.rows), -1, dtype=np.int64)
        local[group] = np.arange(g)
        full = Wide(np.zeros((3, 3, g * g)))
        places = np.arange(g)
        full[:, :, places * g + places] = own[:, :, group]
        for one, part in zip(self.couplings, parts, strict=True):
            inside = np.flatnonzero(local[one.rows] >= 0)
            at = local[one.rows[inside]] * g + local[one.others[inside]]
            for turn in turns(at):
                full[:, :, at[turn]] = full[:, :, at[turn]] + part[:, :, inside[turn]]
        halves = [
            half.reshape(3, 3, g, g).transpose(2, 0, 3, 1).reshape(3 * g, 3 * g) for half in (full.high, full.low)
        ]
        return Wide(halves[0], halves[1])


def turns(places: Rows) -> list[Rows]:
    """Indices of ``places`` in turns, in each of which no place comes twice."""
    order = np.argsort(places, kind="stable")
    ordered = places[order]
    first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(places)])
    counts = np.diff(np.append(first, len(places)))
    rank = np.arange(len(places)) - np.repeat(first, counts)
    return [order[rank == k] for k in range(int(counts.max(initial=0)))]
