"""Forces that fall with the square of the distance, proven from a law's formula: Newton's gravity and Coulomb's law, however they are written.

Each node of the graph becomes a number times powers of *atoms*: what is read of an object, or a sum of such terms. Sums are kept once, by
their terms, so that ``d / d.norm() ** 3`` and ``d / (d.dot(d) * np.sqrt(d.dot(d)))`` become the same. What is no such product ends the proof,
and the law is taken for none.

Source: canonical forms of expressions, as in J. Moses, Commun. ACM 14 (1971) 527.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from xpheve.laws import ContinuousLaw
from xpheve.laws.view import STATE
from xpheve.trace.derivative import COMPONENTS, SCENE, is_zero
from xpheve.trace.graph import Input, Node, walk
from xpheve.trace.law_trace import LawTrace
from xpheve.trace.numpy_text import scalar_function
from xpheve.trace.samples import parameters_of

Vec = tuple[float, float, float]
Powers = tuple[tuple[int, float], ...]
"""Atoms by number, ascending, and their exponents, none of them 0."""

NO_CHARGE = STATE | frozenset({*COMPONENTS, *SCENE, "since", "volume"})
"""What an object has that is no charge."""


class InverseSquare(NamedTuple):
    """F on a = -c d / (|d|^2 + s^2)^(3/2), where d leads from b to a and c = ``strength`` q_a q_b.

    Attributes
    ----------
    strength
        K, in units of c over those of q squared; positive where equal charges attract: G of gravity, -k of Coulomb's law.
    charge
        q: "mass" or the name of a column; empty if c = K for all pairs.
    softening
        s [m].
    """

    strength: float
    charge: str
    softening: float


class Centre(NamedTuple):
    """F = -c d / (|d|^2 + s^2)^(3/2), where d leads from ``place`` [m] to the body and c = ``strength`` q; the rest as in `InverseSquare`."""

    strength: float
    charge: str
    softening: float
    place: Vec


def inverse_square(trace: LawTrace, law: ContinuousLaw) -> InverseSquare | None:
    """The force of a pair law as `InverseSquare`, with the numbers that the parameters of ``law`` have now; None if that cannot be proven.

    Parameters
    ----------
    trace
        Of ``law``.
    law
        Its parameters may change later: ask again then.
    """
    if not trace.pair or math.isfinite(law.reach()):  # type: ignore[attr-defined]
        return None
    found = _proven(trace, law)
    if found is None:
        return None
    strength, charges, softening, apart = found
    if any(one.keys() != {("a", k), ("b", k)} for k, one in enumerate(apart)):
        return None
    names = {name for _, name in charges}
    if any((one["a", k], one["b", k]) != (-1.0, 1.0) for k, one in enumerate(apart)) or len(names) > 1:
        return None
    if names and sorted(side for side, _ in charges) != ["a", "b"]:
        return None
    return InverseSquare(strength + 0.0, "".join(names), softening)


def centre(trace: LawTrace, law: ContinuousLaw) -> Centre | None:
    """The force of a field law as that of a fixed `Centre`, by the parameters of ``law`` as they are now; None if that cannot be proven."""
    if trace.pair:
        return None
    found = _proven(trace, law)
    if found is None:
        return None
    strength, charges, softening, apart = found
    if any(one.get(("", k)) != 1.0 for k, one in enumerate(apart)) or len(charges) > 1:
        return None
    x, y, z = (0.0 - one.get(NUMBER, 0.0) for one in apart)
    return Centre(0.0 - strength, "".join(name for _, name in charges), softening, (x, y, z))


NUMBER = ("", -1)
"""The key of the part of a difference that no object has."""

Apart = dict[tuple[str, int], float]
"""A component of d as a sum: by side and component of position, and `NUMBER`, the factors."""


def _proven(trace: LawTrace, law: ContinuousLaw) -> tuple[float, list[tuple[str, str]], float, list[Apart]] | None:
    """F = K q ... d / (|d|^2 + s^2)^(3/2): K, what is multiplied as (side, name), s, and the components of d."""
    if trace.force is None or not all(map(is_zero, trace.torque or ())):
        return None
    algebra = _Algebra(trace, law)
    components = [algebra.terms.get(node.index) for node in trace.force]
    found = [algebra.component(one, k) for k, one in enumerate(components) if one is not None]
    whole = [one for one in found if one is not None]
    if len(whole) < 3 or any(one[:3] != whole[0][:3] for one in whole):
        return None
    strength, charges, square, _ = whole[0]
    softening = algebra.softening(square, [one[3] for one in whole])
    if softening is None:
        return None
    return strength, charges, softening, [algebra.apart(one[3]) for one in whole]


class _Term(NamedTuple):
    """``factor`` times the powers of atoms."""

    factor: float
    powers: Powers


class _Algebra:
    """The nodes of a law's force as terms; what has none is not in ``terms``."""

    def __init__(self, trace: LawTrace, law: ContinuousLaw) -> None:
        self.inputs: dict[int, Input] = {}
        self.sums: dict[int, dict[Powers, float]] = {}
        self._numbers: dict[object, int] = {}
        self.terms: dict[int, _Term] = {}
        nodes = list(walk(trace.force or ()))
        for read in sorted(node.value for node in nodes if node.op == "input"):  # so that differences have one sign
            self.inputs[self._atom(read)] = read
        numbers = _numbers(nodes, law)
        for node in nodes:
            if node.index in numbers:
                term: _Term | None = _finite(numbers[node.index], ())
            elif node.op == "where" and node.args[0].index in numbers:
                term = self.terms.get(node.args[1 if numbers[node.args[0].index] else 2].index)
            else:
                args = [self.terms.get(arg.index) for arg in node.args]
                given = [arg for arg in args if arg is not None]
                term = self._term(node, given) if len(given) == len(args) else None
            if term is not None:
                self.terms[node.index] = term

    def _atom(self, key: object) -> int:
        return self._numbers.setdefault(key, len(self._numbers))

    def _term(self, node: Node, args: Sequence[_Term]) -> _Term | None:
        op = node.op
        if op == "input":
            return _Term(1.0, ((self._atom(node.value), 1.0),))
        if op == "neg":
            return _Term(-args[0].factor, args[0].powers)
        if op == "+":
            return self._sum(args)
        if op == "-":
            return self._sum([args[0], _Term(-args[1].factor, args[1].powers)])
        if op == "*":
            return _product(args)
        if op == "/":
            return self._quotient(*args)
        if op == "sqrt":
            return self._power(args[0], 0.5)
        if op == "hypot":
            squares = [_product([one, one]) for one in args]
            total = self._sum([one for one in squares if one is not None]) if None not in squares else None
            return None if total is None else self._power(total, 0.5)
        if op == "pow":
            return self._power(args[0], args[1].factor) if not args[1].powers else None
        if op == "abs":
            return self._size(args[0])
        return None

    def _quotient(self, above: _Term, below: _Term) -> _Term | None:
        inverse = self._power(below, -1.0)
        if inverse is None:
            return None
        product = _product([above, inverse])
        return None if product is None else _finite(above.factor / below.factor, product.powers)  # rounded once

    def _power(self, term: _Term, exponent: float) -> _Term | None:
        whole = exponent == math.floor(exponent)
        if not whole and not (term.factor >= 0.0 and all(self._is_positive(atom) for atom, _ in term.powers)):
            return None
        if term.factor == 0.0 and exponent <= 0.0:
            return None
        try:
            factor = math.sqrt(term.factor) if exponent == 0.5 else math.pow(term.factor, exponent)
        except (OverflowError, ValueError):
            return None
        return _finite(factor, tuple((atom, one * exponent) for atom, one in term.powers if exponent))

    def _size(self, term: _Term) -> _Term | None:
        if all(self._is_positive(atom) for atom, _ in term.powers):
            return _Term(abs(term.factor), term.powers)
        return None

    def _is_positive(self, atom: int) -> bool:
        """Whether an atom is nowhere negative."""
        if atom in self.inputs:
            return self.inputs[atom].name == "mass"
        return all(
            factor > 0.0 and all(one % 2.0 == 0.0 or self._is_positive(part) for part, one in powers)
            for powers, factor in self.sums[atom].items()
        )

    def _sum(self, terms: Iterable[_Term]) -> _Term | None:
        """The sum as one term: a new atom, without what all its terms have in common, where more than one is left."""
        parts: dict[Powers, float] = {}
        for one in terms:
            inside = self.sums.get(one.powers[0][0]) if len(one.powers) == 1 and one.powers[0][1] == 1.0 else None
            for powers, factor in (inside or {one.powers: 1.0}).items():
                parts[powers] = parts.get(powers, 0.0) + one.factor * factor
        parts = {powers: factor for powers, factor in parts.items() if factor != 0.0}
        if not all(math.isfinite(factor) for factor in parts.values()):
            return None
        if not parts:
            return _Term(0.0, ())
        shared = _shared(list(parts))
        without = {_powers_of([*powers, *((atom, -one) for atom, one in shared)]): f for powers, f in parts.items()}
        if len(without) == 1:
            ((powers, factor),) = parts.items()
            return _Term(factor, powers)
        lead = max(without)
        scale = without[lead]
        scaled = {powers: without[powers] / scale for powers in sorted(without)}
        atom = self._atom(tuple(scaled.items()))
        self.sums[atom] = scaled
        return _product([_Term(scale, shared), _Term(1.0, ((atom, 1.0),))])

    # What a force is made of

    def component(self, term: _Term, component: int) -> tuple[float, list[tuple[str, str]], int, int] | None:
        """Component of a force as K, charges, the atom |d|^2 + s^2 and the atom d; None if it is something else."""
        charges: list[tuple[str, str]] = []
        squares: list[int] = []
        places: list[int] = []
        for atom, exponent in term.powers:
            read = self.inputs.get(atom)
            if exponent == -1.5 and read is None:
                squares.append(atom)
            elif exponent == 1.0 and (read is None or (read.name == "position" and read.component == component)):
                places.append(atom)
            elif exponent == 1.0 and read is not None and read.name not in NO_CHARGE:
                charges.append((read.side, read.name))
            else:
                return None
        if len(squares) != 1 or len(places) != 1:
            return None
        return term.factor, sorted(charges), squares[0], places[0]

    def softening(self, square: int, places: Sequence[int]) -> float | None:
        """s, if the atom ``square`` is the sum of the squares of ``places``, and s^2."""
        parts = dict(self.sums[square])
        softening = math.sqrt(max(0.0, parts.pop((), 0.0))) if parts.get((), 0.0) >= 0.0 else None
        return softening if parts == {((atom, 2.0),): 1.0 for atom in places} and len(set(places)) == 3 else None

    def apart(self, place: int) -> Apart:
        """The atom ``place`` by what it is the sum of; empty if that is more than positions and a number."""
        if place in self.inputs:
            return {(self.inputs[place].side, self.inputs[place].component): 1.0}
        found: Apart = {}
        for powers, factor in self.sums[place].items():
            if not powers:
                found[NUMBER] = factor
                continue
            read = self.inputs.get(powers[0][0])
            if len(powers) > 1 or powers[0][1] != 1.0 or read is None or read.name != "position":
                return {}
            found[read.side, read.component] = factor
        return found


def _numbers(nodes: Sequence[Node], law: ContinuousLaw) -> dict[int, float]:
    """The values of all nodes that read nothing of objects, nor the time."""
    free: dict[int, Node] = {}
    for node in nodes:
        if node.op in ("const", "param") or (node.args and all(arg.index in free for arg in node.args)):
            free[node.index] = node
    run = scalar_function(list(free.values()))
    return dict(zip(free, run({}, parameters_of(law, run.parameters)), strict=True))


def _finite(factor: float, powers: Powers) -> _Term | None:
    return _Term(float(factor), powers) if math.isfinite(factor) else None


def _product(terms: Sequence[_Term]) -> _Term | None:
    factor = math.prod(one.factor for one in terms)
    return _finite(factor, _powers_of(power for one in terms for power in one.powers))


def _powers_of(given: Iterable[tuple[int, float]]) -> Powers:
    """Powers of atoms, those of one atom added, ascending."""
    found: dict[int, float] = {}
    for atom, exponent in given:
        found[atom] = found.get(atom, 0.0) + exponent
    return tuple(sorted((atom, exponent) for atom, exponent in found.items() if exponent != 0.0))


def _shared(terms: Sequence[Powers]) -> Powers:
    """What all of ``terms`` have in common."""
    first, others = dict(terms[0]), [dict(one) for one in terms[1:]]
    common = [atom for atom in first if all(atom in one for one in others)]
    return tuple(sorted((atom, min(first[atom], *(one[atom] for one in others))) for atom in common if others))
