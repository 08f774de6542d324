"""From a batch and its laws to the `forces` that drivers call, with the numbers of its rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from xpheve.errors import LawFailedError
from xpheve.kernels import tree
from xpheve.kernels.clock import Instant
from xpheve.loop.fields import PARAMETERS
from xpheve.loop.long_range import (
    TILES,
    TOLD,
    TREE,
    TREE_PARAMETERS,
    how_to_sum,
    scratch,
    told,
    tree_numbers,
    why_no_tree,
    work_of,
)
from xpheve.loop.motion import PLACES, STILL_LEFT, STILL_RIGHT, MotionText
from xpheve.loop.program import COMPILED, INTERPRETED, LISTED, Couples, values_of
from xpheve.loop.terms import slot_of
from xpheve.loop.text import PairKind
from xpheve.plan.programs import inverse_masses
from xpheve.steppers.contract import Array, Rows
from xpheve.trace.inverse_square import inverse_square

if TYPE_CHECKING:
    from xpheve.plan.evaluation import BatchSources
    from xpheve.trace.inverse_square import InverseSquare

COMPILE_AFTER = 50_000
"""Evaluations times rows and pairs that are interpreted before it pays to compile: a second or two. Both give the same bits."""
PAUSE = 5_000_000
"""Evaluations times rows and pairs of one compiled call: a tenth of a second, so that nobody waits long."""
BREATH = COMPILE_AFTER // 5
"""The same of an interpreted call; a part of `COMPILE_AFTER`, so that a call ends there."""
MOST_LOOPS = 64
"""Loops over pairs in one text up to which it is compiled unasked: each law without `between` has its own, and hundreds take minutes."""
EVALUATIONS, BUDGET = 0, 1
"""In a driver's own integers: evaluations of ``forces`` so far, and after how many to stop."""
PLACES_OF_CALL, FORCES, JACOBIANS = 2, 6, 7
"""Four integers with the places that a driver hands to compiled forces, and the addresses of compiled ``forces`` and ``jacobians``."""
FIRST_OWN = 8
"""The first of a driver's integers that is its own affair; those before it are for all drivers."""


LONG_RUN = 8
"""Pairs of one still row with rows side by side, from which on average it pays to go through these row by row."""
STEADY = "core:symplectic"
"""How the ids of steppers begin that bear a tree's error; where none was asked for, steps of a given length are such a one's, too."""


class Motion:
    """The second derivatives of the places of a batch's rows, for drivers (`xpheve.loop.drivers`).

    Attributes
    ----------
    rows, moving
        How many rows the text knows, N, of which the first ``moving`` are the batch's, in the order of the program.
    components
        Components of a place: 3, or 7 with the orientation as a quaternion.
    works
        Whether some force has no potential, so that ``forces`` writes the sum of those.
    reads_velocity, reads_time
        Whether accelerations depend on velocities, or on time.
    """

    def __init__(self, sources: BatchSources) -> None:
        self.sources = sources
        self.world = sources.world
        self.held = sources.held
        bodies, own = self.world.bodies, sources.rows
        self.segments, self.couples = self.held._parts
        turning = any(term.of_turning for term in self.held.terms.values()) or self._turns_already()
        turning = turning or bool(bodies.arrays["torque"][:, own].any())
        stored_work = bool(bodies.arrays["working"][:, own].any())
        kinds = list(dict.fromkeys(one.terms for one in self.segments))
        self.courses = sources.courses
        self._followed = -1
        self._given: list[dict[str, Any]] | None = None
        self._found: list[str] = []
        self.moving, self.rows = len(own), len(own) + len(self.held.sources)
        self._runs: dict[int, Runs | None] = {}
        self._hows = self._ways()
        pair_kinds = [
            PairKind(one.term, how, one.which is None) for one, how in zip(self.couples, self._hows, strict=True)
        ]
        proven = {number: self._proven(number) for number, how in enumerate(self._hows) if how == TREE}
        charges = {number: one.charge for number, one in proven.items() if one is not None}
        self.text = MotionText(kinds, pair_kinds, stored_work, turning, charges, self.courses is not None)
        self.components, self.works = self.text.components, self.text.works
        self.reads_velocity, self.reads_time = self.text.reads_velocity, self.text.reads_time
        self._kinds = [kinds.index(one.terms) for one in self.segments]
        self._kernels: dict[tuple[str, str], Callable[..., int]] = {}
        self._linked: list[Any] = []
        """Kernels that compiled drivers call; they must be kept."""
        self._addresses = np.zeros(2, dtype=np.int64)
        self.buffers: dict[str, Any] = {}
        """What steppers keep for their drivers, by driver: layouts, made again at any time."""
        self._lists = self._whole_numbers()
        self.forget()

    @property
    def turning(self) -> bool:
        """Whether rows turn, so that their orientations are carried, too."""
        return self.components != PLACES

    @property
    def load(self) -> int:
        """About how many operations on rows and pairs an evaluation has."""
        return self.moving + sum(work_of(how, len(one.left)) for one, how in zip(self.couples, self._hows, strict=True))

    def _turns_already(self) -> bool:
        """Whether the rotation of the batch was a part of its steps so far: then it stays one, though torques are over."""
        world, own = self.world, self.sources.rows
        number = int(world.bodies.batch[own[0]]) if len(own) else -1
        carried = number >= 0 and world.batches[number].state.numbers.get("turning") == 1.0
        return carried or self.sources.signature.torque != "none"

    def fits(self) -> bool:
        """Whether the stored forces, and torques, are still of the kind that the text was made for."""
        arrays, own = self.world.bodies.arrays, self.sources.rows
        torque = not self.turning and arrays["torque"][:, own].any()
        same = self._hows == self._ways()
        return same and not torque and (self.text.stored_work or not arrays["working"][:, own].any())

    # Sums over many bodies

    def _ways(self) -> list[str]:
        """How the pairs of each set are summed, by the laws' parameters as they are now."""
        given = [dict(one.laws[0].parameters) for one in self.couples]
        if given != self._given:
            self._given = given
            self._found = self._ways_of()
        return self._found

    def _ways_of(self) -> list[str]:
        found = [how_to_sum(one.how, len(one.left), one.term, one.laws[0], self._steady) for one in self.couples]
        for number, how in enumerate(found):
            if how == LISTED and number not in self._runs:
                self._runs[number] = runs_of(self.couples[number], self.moving)
            runs = self._runs.get(number)
            found[number] = how if runs is None else runs.how
        return found

    @property
    def _steady(self) -> bool:
        """Whether steps have a given length, and nothing is solved in them: `xpheve.loop.long_range.why_no_tree`."""
        signature = self.sources.signature
        return signature.wish.startswith(STEADY) or (signature.fixed_step and not signature.wish)

    def _proven(self, number: int) -> InverseSquare | None:
        one = self.couples[number]
        return inverse_square(one.term.trace, one.laws[0])

    def sums(self) -> dict[Any, str]:
        """How the forces of laws between all pairs of bodies are summed, in words, with the error that was measured."""
        words = {}
        for number, (one, how) in enumerate(zip(self.couples, self._hows, strict=True)):
            count = len(one.left)
            if how == TREE:
                error, walks = told(count, self._own[number])
                measured = (
                    f"at most {error:.2g} of a sample at the 99th percentile, in {walks} walks"
                    if walks
                    else "not run yet"
                )
                allowed = one.laws[0].allowed_error()
                words[one.laws[0]] = f"{count} bodies by a tree, error {allowed:g} allowed: {measured}"
            elif how == TILES:
                words[one.laws[0]] = f"all pairs of {count} bodies, by tiles"
                if one.laws[0].allowed_error() > 0.0:
                    words[one.laws[0]] += f": {why_no_tree(count, one.term, one.laws[0], self._steady)}"
        return words

    # Numbers

    def forget(self) -> None:
        """Parameters, masses or stored forces may be others."""
        self._floats: list[Array] | None = None
        self._followed = -1

    def _whole_numbers(self) -> list[Any]:
        """Counts, segments and lists of pairs; where the parameters of each instance lie."""
        at = PARAMETERS
        segments: list[int] = []
        for kind, one in zip(self._kinds, self.segments, strict=True):
            segments += [kind, one.first, one.last, at]
            at += sum(term.size for term in one.terms)
        suns = 0 if self.courses is None else len(self.courses.rows)
        counts = [len(self.segments), self.rows, self.moving, suns]
        lists = []
        self._own: list[Array] = []
        for number, (couples, how) in enumerate(zip(self.couples, self._hows, strict=True)):
            left, right, of = couples.left, couples.right, couples.which
            runs = self._runs.get(number)
            if runs is not None:
                left, right, of = runs.still, runs.rows, runs.which
            if how == TREE:
                right = np.zeros(tree.ints(len(couples.left)), dtype=np.int64)
            self._own.append(np.zeros(tree.floats(len(couples.left)) + TOLD if how == TREE else 1))
            places = at + couples.term.size * np.arange(len(couples.laws), dtype=np.int64)
            counts += [len(left), at]
            which = places if of is None else places[of]
            lists += [left, right if len(right) else _NOTHING, which]
            at += couples.term.size * len(couples.laws) + (TREE_PARAMETERS if how == TREE else 0)
        whole = [np.array(counts, dtype=np.int64), np.array(segments or [0], dtype=np.int64), _NOTHING]
        return [*whole, *(np.ascontiguousarray(one, dtype=np.int64) for one in lists)]

    def _parameters(self) -> Array:
        numbers = [0.0] * PARAMETERS
        numbers[3:6] = [float(one) for one in self.world.up_vector]
        for segment in self.segments:
            for law, term in zip(segment.laws, segment.terms, strict=True):
                numbers += values_of(law, term)
        for number, couples in enumerate(self.couples):
            for law in couples.laws:
                numbers += values_of(law, couples.term)
            if self._hows[number] == TREE:
                numbers += tree_numbers(self._proven(number), couples.laws[0])
        return np.array(numbers)

    def _constants(self) -> Array:
        """What rows have besides places and velocities, (slots, N)."""
        slots, bodies = self.text.slots, self.world.bodies
        everyone, moving = self.held._everyone, self.moving
        own = everyone[:moving]
        found = np.zeros((slots.width, self.rows))

        def put(name: str, values: Array) -> None:
            at = slots.first[name]
            found[at : at + len(values), : values.shape[1]] = values

        put("inverse_mass", inverse_masses(self.world, own))
        put("stored", bodies.arrays["force"][:, own] / bodies.arrays["mass"][:, own])
        if "stored_working" in slots.first:
            put("stored_working", bodies.arrays["working"][:, own])
        if self.turning:
            inertia = bodies.arrays["inertia"][:, own]
            put("stored_torque", bodies.arrays["torque"][:, own])
            put("inertia", inertia)
            with np.errstate(divide="ignore"):
                put("inverse_inertia", np.where(inertia > 0.0, 1.0 / inertia, 0.0))
        for name in slots.columns:
            put(slot_of(name), self.held.column(name, everyone, self.text.ages))
        return found.ravel()

    # Places

    def pack(self, found: dict[str, Array], t: Instant) -> tuple[Array, Array]:
        """Places and velocities (components, N) of ``found``, which has (width, rows) arrays of the batch's own rows; the rest at ``t``."""
        x, v = np.zeros((self.components, self.rows)), np.zeros((self.components, self.rows))
        order, moving, bodies = self.held.order, self.moving, self.world.bodies
        x[:3, :moving], v[:3, :moving] = found["position"][:, order], found["velocity"][:, order]
        rest = self.held.sources
        x[:3, moving:] = bodies.arrays["position"][:, rest]
        if self.turning:
            from xpheve.kernels.turning import rate_of

            q = np.concatenate([found["orientation"][:, order], bodies.arrays["orientation"][:, rest]], axis=1)
            spin = np.zeros((3, self.rows))
            spin[:, :moving] = found["angular_velocity"][:, order]
            x[3:] = q
            v[3:] = np.array(rate_of(tuple(q), tuple(spin)))  # type: ignore[arg-type]
        return x, v

    def unpack(self, values: Array) -> Array:
        """``values`` (width, N) of the program's rows as (width, rows) of the batch's, in their order."""
        found = np.empty((len(values), self.moving))
        found[:, self.held.order] = values[:, : self.moving]
        return found

    # Running

    def run(self, driver: str, s: Array, d: Array) -> int:
        """Let ``driver`` go on with its numbers ``s`` and ``d``; its answer. Evaluations are counted.

        ``d[0]``, the evaluations so far, decides whether it is interpreted or compiled, to the same bits; ``d[1]`` is set to the count after which
        the driver stops, so that it can be called again.
        """
        tier = self.tier(int(d[EVALUATIONS]))
        load = max(1, self.load)
        before = int(d[EVALUATIONS])
        most = PAUSE if tier == COMPILED else BREATH - (before * load) % BREATH
        d[BUDGET] = before + max(1, most // load)
        if self._floats is None:
            tables = self.text.tables if len(self.text.tables) else np.zeros(1)
            room = np.zeros(scratch(self.text.terms))
            self._floats = [self._parameters(), tables, self._constants(), np.zeros(1), room, *self._own]
        if self.courses is not None and self.courses.changes != self._followed:
            self._followed = self.courses.changes
            places = {int(row): self.moving + k for k, row in enumerate(self.held.sources.tolist())}
            self._floats[4 - 1] = self.courses.numbers(places)
        whole = [self._lists[0], self._lists[1], d, *self._lists[3:]]
        kernel = self._kernel(driver, tier)
        d[[FORCES, JACOBIANS]] = self._addresses
        try:
            found = kernel([s, *self._floats], whole)
        except (ArithmeticError, ValueError) as error:
            raise self.sources._kernel_failed(error) from error
        for law, term in self.held.terms.items():
            if law.enabled or term.switch:
                law.evaluations += int(d[EVALUATIONS]) - before
        self.world.tiers[self.sources.signature] = tier
        return found

    def made(self, driver: str, tier: str) -> Any:
        """The kernel of ``driver`` in ``tier`` if it was made already; None else."""
        return self._kernels.get((driver, tier))

    def compile(self, driver: str) -> list[Any]:
        """The compiled kernels of ``driver``, made now if they are not there yet: what it calls, and itself."""
        kernel = self._kernel(driver, COMPILED)
        return [*self._linked, kernel]

    def tier(self, evaluations: int) -> str:
        """How a driver runs that has called ``forces`` so often."""
        wish = self.world.compile
        enough = wish == "auto" and max(1, evaluations) * self.load >= COMPILE_AFTER
        enough = enough and len(self.couples) <= MOST_LOOPS
        return COMPILED if wish == "always" or enough else INTERPRETED

    def _kernel(self, driver: str, tier: str) -> Callable[..., int]:
        found = self._kernels.get((driver, tier))
        if found is None:
            found = self._kernels[driver, tier] = self._made(driver, tier)
        return found

    def _made(self, driver: str, tier: str) -> Callable[..., int]:
        """The kernel of ``driver``: with the forces in one text, or, compiled, calling those of the motion, so that it is compiled once for all."""
        from xpheve.compile import assemble, compiled, interpreted
        from xpheve.loop.drivers import LINKED, driver_text

        files = self.held.program.files
        forces, more = self.text.text(), self._more(driver)
        labels = " + ".join(dict.fromkeys(term.trace.label for term in self.text.terms))
        if tier == INTERPRETED:
            return interpreted(assemble(forces + more + driver_text(driver), files))
        if files:  # a kernel by hand may raise, which only its own text can tell
            return compiled(assemble(forces + more + driver_text(driver), files), what=f"{driver}: {labels}")
        linked = [compiled(assemble(forces + ENTRY.format("forces"), files), what=f"forces: {labels}")]
        if more:
            text = assemble(forces + more + ENTRY.format("jacobians"), files)
            linked.append(compiled(text, what=f"jacobians: {labels}"))
        for place, one in enumerate(linked):
            self._addresses[place] = one.address  # type: ignore[attr-defined]
        self._linked += linked
        return compiled(assemble(LINKED + driver_text(driver)), what=f"driver {driver}")

    def _more(self, driver: str) -> str:
        """Text that ``driver`` needs besides ``forces``."""
        if driver != "implicit":
            return ""
        from xpheve.loop.jacobian_text import jacobian_text

        return jacobian_text(self.text)

    def fail(self, t: Instant, found: dict[str, Array]) -> LawFailedError:
        """Why forces at ``t`` on the batch's rows in the state ``found`` are not finite: raises what a law says, else gives a general error."""
        self.sources.evaluate(self.sources.rows, t, found)
        return LawFailedError(
            f"motion leaves the range of floats after t = {t[0]} s; the engine stands just before. Look at the forces, or at the positions"
        )


class Runs(NamedTuple):
    """Pairs of rows that do not move with rows that do.

    Attributes
    ----------
    how
        `STILL_LEFT` or `STILL_RIGHT`: on which side the former are.
    still
        For each run the row that does not move, (runs,).
    rows
        The first of its partners, and the one after the last, (2 runs,).
    which
        The law whose pairs they are, (runs,); None if there is one.
    """

    how: str
    still: Rows
    rows: Rows
    which: Rows | None


def runs_of(couples: Couples, moving: int) -> Runs | None:
    """The listed pairs of ``couples`` as runs; None if both of a pair move, below ``moving``, or runs are short.

    The forces on a row are summed in the order of laws, then of rows that act, whichever other rows there are.
    """
    for how, still, felt in ((STILL_LEFT, couples.left, couples.right), (STILL_RIGHT, couples.right, couples.left)):
        if not len(still) or (still < moving).any() or (felt >= moving).any():
            continue
        law = np.zeros_like(still) if couples.which is None else couples.which
        order = np.lexsort((felt, still, law))
        still, felt, law = still[order], felt[order], law[order]
        new = (np.diff(still) != 0) | (np.diff(law) != 0) | (np.diff(felt) != 1)
        first = np.concatenate([[0], 1 + np.flatnonzero(new)])
        if LONG_RUN * len(first) > len(still):
            return None
        last = np.concatenate([first[1:], [len(still)]]) - 1
        rows = np.stack([felt[first], felt[last] + 1], axis=1).ravel()
        return Runs(how, still[first], rows, None if couples.which is None else law[first])
    return None


ENTRY = f"""
def entry(f, n):
    d = n[2]
    return {{}}(f, n, d[{PLACES_OF_CALL}], d[{PLACES_OF_CALL + 1}], d[{PLACES_OF_CALL + 2}], d[{PLACES_OF_CALL + 3}], f[1][0])
"""
"""The entry of forces, or jacobians, that compiled drivers call."""
_NOTHING = np.zeros(1, dtype=np.int64)
