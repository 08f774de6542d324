"""The electric force between charges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import PairLaw, Param
from xpheve_laws_basic.columns import CHARGE

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView


class Coulomb(PairLaw):
    """Coulomb's law: F on a = k q_a q_b d / (eps_r (|d|^2 + s^2)^(3/2)), where d leads from b to a.

    Holds for points and for spheres outside one another whose charge is spread in spherical shells, at rest or at speeds far below
    that of light: magnetic forces between moving charges, delay and radiation are left out, and so are charges that shift on
    a conductor. Without softening (s = 0) it is singular at d = 0, and two charges in one place are an error. With softening each charge
    is smeared as in a Plummer sphere of radius s. Every object needs ``charge``; 0 is a neutral one.

    Benefits and drawbacks: beside ``basic:electric_field`` it knows where the sources are, and costs an evaluation of each pair at
    each step instead of none. Close encounters of opposite charges ask for small steps, or for softening, which is wrong within s.

    Units: k [N m^2/C^2], charges [C], lengths [m], force [N]; the potential of a pair is k q_a q_b / (eps_r sqrt(|d|^2 + s^2)) [J].

    Cost: one evaluation a step; n (n - 1)/2 pairs of n bodies, or sources times targets with ``between``: O(n^2); by a tree
    about O(n log n).
    Accuracy: the force is exact to rounding, or of 99% of the bodies within ``error``; trajectories are as exact as the stepper,
    order 2 in dt with the midpoint.

    Source: C. A. Coulomb, Histoire de l'Academie royale des sciences (1785), 569; k = 1/(4 pi eps_0) of CODATA 2018: E. Tiesinga et
    al., Rev. Mod. Phys. 93, 025010 (2021); softening: H. C. Plummer, MNRAS 71, 460 (1911).
    """

    id = "basic:coulomb"
    role = "electromagnetic"
    columns = {"charge": CHARGE}
    singular = "Two charges in one place repel without bound: move them apart, or give the law a softening"

    coulomb_constant = Param(8.9875517923e9, unit="N*m^2/C^2", ge=0, doc="k in vacuum; relative uncertainty 1.5e-10.")
    relative_permittivity = Param(1.0, unit="1", gt=0, doc="eps_r of the medium; 1 in vacuum, about 80 in water.")
    softening = Param(0.0, unit="m", ge=0, doc="s, the Plummer radius; 0 for Coulomb's law itself.")
    error = Param(
        0.0, unit="1", ge=0, le=0.1, doc="Relative error that sums over many bodies may have; 0 for exact ones."
    )

    def force(self, a: BodyView, b: BodyView) -> Any:
        """Force [N] on ``a`` of each pair."""
        d = a.position - b.position
        square = d.dot(d) + self.softening**2
        return self._strength(a, b) / (square * np.sqrt(square)) * d

    def potential(self, a: BodyView, b: BodyView) -> Any:
        """Potential energy [J] of each pair, 0 far apart."""
        d = a.position - b.position
        return self._strength(a, b) / np.sqrt(d.dot(d) + self.softening**2)

    def _strength(self, a: BodyView, b: BodyView) -> Any:
        return self.coulomb_constant / self.relative_permittivity * a.charge * b.charge
