"""Symplectic compositions of order 2, 4, 6 and 8, at host steps: conservative forces without drift of energy.

The steps are made by `xpheve.loop.drivers.composition`; here are the methods, what is kept between calls, and how rows are read between steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np

from xpheve.bodies import Bodies
from xpheve.errors import NoStepperError
from xpheve.kernels import spin
from xpheve.steppers.contract import (
    Array,
    Grid,
    Offer,
    Refusal,
    Settings,
    Signature,
    Sources,
    State,
    Stop,
)
from xpheve.steppers.flights import FlightState
from xpheve.steppers.nodes import Newton, Node, octic
from xpheve.steppers.stepped import PLACES, TURNS, Stepped

# Methods --------------------------------------------------------------------------------------------------------------


class Method(NamedTuple):
    """Weights of a step: ``kicks`` b_0 ... b_S, ``drifts`` a_0 ... a_(S-1), and ``turns``, of which a free turn of an uneven body is made.

    ``evaluations`` is how often a step asks for forces.
    """

    kicks: tuple[float, ...]
    drifts: tuple[float, ...]
    turns: tuple[float, ...]

    @property
    def evaluations(self) -> int:
        return sum(weight != 0.0 for weight in self.kicks[1:])


def mirrored(half: Sequence[float], total: float, middle: bool) -> tuple[float, ...]:
    """Weights that read the same from both ends and sum up to ``total``: ``half`` of them are given, the rest follows.

    With ``middle`` there is one in the middle, else two.
    """
    rest = total - 2.0 * math.fsum(half)
    inner = (rest,) if middle else (0.5 * rest, 0.5 * rest)
    return (*half, *inner, *reversed(half))


def drift_first(weights: Sequence[float]) -> Method:
    """The composition of steps drift-kick-drift of the lengths ``weights``, h = 1."""
    inner = [0.5 * (one + other) for one, other in pairwise(weights)]
    drifts = (0.5 * weights[0], *inner, 0.5 * weights[-1])
    return Method((0.0, *weights, 0.0), drifts, tuple(weights))


KAHAN_LI_6 = mirrored(
    (0.39216144400731413927925056, 0.33259913678935943859974864, -0.70624617255763935980996482, 0.08221359629355080023149045),
    1.0,
    True,
)  # fmt: skip
KAHAN_LI_8 = mirrored(
    (
        0.13020248308889008087881763, 0.56116298177510838456196441, -0.38947496264484728640807860, 0.15884190655515560089621075,
        -0.39590389413323757733623154, 0.18453964097831570709183254, 0.25837438768632204729397911, 0.29501172360931029887096624,
    ),
    1.0,
    True,
)  # fmt: skip
"""W. Kahan, R.-C. Li, Math. Comp. 66 (1997) 1089, s9odr6a and s17odr8a: nine steps of order 2 make one of order 6, seventeen one of order 8."""

LEAPFROG = Method((0.5, 0.5), (1.0,), (1.0,))
"""Kick-drift-kick (Stoermer, Verlet)."""

# For x'' = f(x) alone fewer conditions have to hold than for compositions, so that more weights are left to make errors small:
# S. Blanes, P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313, table 3, SRKN_6^b and SRKN_14^a, made exact to 25 digits by Newton's method.
# Error on the figure eight at equal evaluations, next to compositions of steps of order 2
# (Suzuki's fractal, Kahan and Li's s9odr6a): a 400th, and a 300th. Turns of uneven bodies are of a higher order than needed: they cost little.
NYSTROM_4 = Method(
    mirrored((0.08298440641740502058792996, 0.3963098014983680572607974, -0.03905630492234842501552195), 1.0, True),
    mirrored((0.245298957184271164039388, 0.6048726657110799774066924), 1.0, False),
    KAHAN_LI_6,
)
NYSTROM_6 = Method(
    (
        0.0,
        *mirrored(
            (
                0.0917191526244620131812477, 0.1839831700050048960170288, -0.05653436583288910273252011,
                0.004914688774711887286437297, 0.1437611271683616849788432, 0.3285676937468041413915653,
            ), 1.0, False,
        ),
        0.0,
    ),
    mirrored(
        (
            0.0378593198406109402370114, 0.1026356331024365465784443, -0.0258678882665583330073919, 0.3142414030714464264278324,
            -0.1301444595174151019248528, 0.1064177003695413689108342, -0.008794243128510205373536294,
        ), 1.0, True,
    ),
    KAHAN_LI_6,
)  # fmt: skip
COMPOSED_8 = drift_first(KAHAN_LI_8)


# The stepper ---------------------------------------------------------------------------------------------------------

SHORT = 0.25
"""Of a step: what an event left before it, if it is shorter, is no support for its polynomial, where rounding would grow by its inverse powers."""


class Symplectic(Stepped):
    """Drifts and kicks, composed to a high order: bounded errors of energy, and steps that can be taken back.

    For forces that derive from a potential of positions and orientations. A step is a host step, or what a jump or an event leaves of one. Bodies
    that turn drift in free rotation, so that angular momentum stays to rounding where nothing twists. Between two steps rows are read off the
    polynomial through position, velocity and acceleration at three instants, of degree 8; so is the orientation, which asks for turns of less
    than about a radian a step.
    """

    driver: ClassVar[str] = "composition"
    order: ClassVar[int]
    method: ClassVar[Method]

    def offer(self, signature: Signature) -> Offer | Refusal:
        reason = self.refusal(signature)
        if not reason and not signature.fixed_step:
            reason = "its steps are host steps: run(dt=...)"
        if not reason and not signature.conservative:
            reason = "a law has no potential, or reads velocity or time"
        if not reason and signature.wish != self.id:
            reason = f'only on request: PhysicsEngine(stepper="{self.id}")'
        if reason:
            return Refusal(reason)
        return Offer(float(self.order), 100.0 * self.method.evaluations, False)

    def stride(
        self, state: State, bodies: Bodies, grid: Grid, steps: int, settings: Settings, sources: Sources | None
    ) -> Stop:
        assert isinstance(state, FlightState) and sources is not None
        motion = sources.motion
        if motion is None or not np.isfinite(grid.dt):
            raise NoStepperError(f"{self.id} found no length for its step: give run(dt=...)")
        if motion.turning and state.numbers["turning"] == 0.0:
            self._take_up_rotation(state, bodies)
        run = _Run(self.method, state, bodies, motion)
        if not run.go(grid, steps):
            if steps > 1:  # one by one, so that what is good stays
                return super().stride(state, bodies, grid, steps, settings, sources)
            raise motion.fail(self.covered(state), self.held(state, bodies))
        found = run.found()
        if steps == 1 and (state.arrays["span"] < SHORT * grid.dt).any():
            run = _Run(self.method, state, bodies, motion)
            run.go(Grid(grid.point(0), 0.5 * grid.dt, 0), 1)
            middle = run.found()
            found |= {"earlier": middle["end"], "earlier_turn": middle["end_turn"]}
            found["ago"] = np.full((1, state.count), 0.5 * grid.dt)
        else:
            found["ago"] = np.where(steps > 1, -grid.dt, -state.arrays["span"])
        state.arrays |= found | {"span": np.full((1, state.count), grid.dt)}
        state.numbers["base"], state.numbers["offset"] = grid.point(steps)
        state.numbers["steps"] += float(steps)
        state.numbers["evaluations"] = float(run.evaluations)
        self._put_beginning(state, bodies, grid.point(steps - 1))
        return Stop(self.covered(state), state.rows)

    def path(self, begin: Node, end: Node, earlier: Node, span: Array, ago: Array) -> Newton:
        return octic(begin, end, earlier, span, ago)


class _Run:
    """The buffers of one run of the driver: a batch's rows in the order of its motion."""

    def __init__(self, method: Method, state: FlightState, bodies: Bodies, motion: Any) -> None:
        self.motion = motion
        self.turning = bool(motion.turning)
        self.width = 7 if self.turning else 3
        self.rows = motion.rows
        steps = [0.0] * (2 * len(method.kicks) - 1)
        steps[::2], steps[1::2] = method.kicks, method.drifts
        head = np.array([0.0, 0.0, 0.0, *steps, *method.turns])
        blocks = self._blocks(state, bodies)
        self.s = np.concatenate([head, *(block.ravel() for block in blocks)])
        places = len(head) + np.cumsum([0, *(block.size for block in blocks)])
        stages, turns = len(method.drifts), len(method.turns)
        fresh = int(not self.turning and bool((state.arrays["span"] != 0.0).all()))
        shared = [int(state.numbers["evaluations"]), 0, 0, 0, 0, 0, 0, 0]
        self.d = np.array([*shared, 0, fresh, stages, turns, self.width, *places[:-1]], dtype=np.int64)
        self.first_node = int(places[len(blocks) - 1])
        self.places = dict(
            zip(("place", "speed", "push", "working", "place_rest", "speed_rest"), places.tolist(), strict=False)
        )
        self.places |= {"momentum": int(places[6]), "momentum_rest": int(places[7])}

    @property
    def evaluations(self) -> int:
        return int(self.d[0])

    def _ordered(self, values: Array) -> Array:
        """``values`` (width, rows) of the batch's rows as (width, N) of the motion's; of rows that only act, 0."""
        found = np.zeros((len(values), self.rows))
        found[:, : self.motion.moving] = values[:, self.motion.held.order]
        return found

    def _blocks(self, state: FlightState, bodies: Bodies) -> list[Array]:
        """The driver's blocks, as it names them."""
        arrays = state.arrays
        end, turn = arrays["end"], arrays["end_turn"]
        found = {
            "position": end[:3],
            "velocity": end[3:6],
            "orientation": turn[:4],
            "angular_velocity": np.zeros((3, state.count)),
        }
        place, speed = self.motion.pack(found, (state.numbers["base"], state.numbers["offset"]))
        push = np.zeros_like(place)
        push[:3] = self._ordered(end[6:])
        rests, momentum = self._ordered(arrays["rests"]), self._ordered(arrays["momentum"])
        nodes = np.zeros((3, 3, self.width, self.rows))
        nodes[1] = self._node(arrays["begin"], arrays["begin_turn"])
        uneven = np.zeros((6, state.count))
        if self.turning:
            for k, row in enumerate(state.rows.tolist()):
                inertia: Any = bodies.get("inertia", row)
                uneven[:, k] = (*spin.excess_of(inertia), *spin.spread_of(inertia))
        return [
            place, speed, push, np.zeros((3, self.rows)), rests[:3], rests[3:], momentum[:3], momentum[3:], self._ordered(uneven), nodes,
        ]  # fmt: skip

    def _node(self, path: Array, turn: Array) -> Array:
        """A node (3, width, N) from how rows keep it."""
        parts = [self._ordered(path).reshape(3, 3, self.rows)]
        if self.turning:
            parts.append(self._ordered(turn).reshape(3, 4, self.rows))
        return np.concatenate(parts, axis=1)

    def go(self, grid: Grid, steps: int) -> bool:
        """Make ``steps`` steps of ``grid``; whether all is finite."""
        s, d = self.s, self.d
        (s[0], late), s[2] = grid.origin, grid.dt
        s[0] += late
        made = 0
        while made < steps:
            s[1], d[8] = float(grid.number + made), steps - made
            made += self.motion.run("composition", s, d)
        return bool(np.isfinite(s).all())

    def found(self) -> dict[str, Array]:
        """What rows keep, as the run has left it."""
        found = {}
        for k, (name, turn) in enumerate(zip(PLACES, TURNS, strict=True)):
            size = 3 * self.width * self.rows
            first = self.first_node + k * size
            node = self.s[first : first + size].reshape(3, self.width, self.rows)
            found[name] = self._own(node[:, :3])
            found[turn] = self._own(node[:, 3:]) if self.turning else np.zeros((12, self.motion.moving))
        found["rests"] = np.concatenate([self._part("place_rest"), self._part("speed_rest")])
        found["momentum"] = np.concatenate([self._part("momentum"), self._part("momentum_rest")])
        return found

    def _own(self, node: Array) -> Array:
        own: Array = self.motion.unpack(node.reshape(-1, self.rows))
        return own

    def _part(self, name: str) -> Array:
        first = self.places[name]
        own: Array = self.motion.unpack(self.s[first : first + 3 * self.rows].reshape(3, self.rows))
        return own


class Symplectic2(Symplectic):
    """Leapfrog: one evaluation a step."""

    id: ClassVar[str] = "core:symplectic2"
    promise: ClassVar[str] = "symplectic, second order in the step; energy does not drift"
    order: ClassVar[int] = 2
    method: ClassVar[Method] = LEAPFROG


class Symplectic4(Symplectic):
    """Six evaluations a step."""

    id: ClassVar[str] = "core:symplectic4"
    promise: ClassVar[str] = "symplectic, fourth order in the step; energy does not drift"
    order: ClassVar[int] = 4
    limit: ClassVar[float] = 3.16
    method: ClassVar[Method] = NYSTROM_4


class Symplectic6(Symplectic):
    """Fourteen evaluations a step."""

    id: ClassVar[str] = "core:symplectic6"
    promise: ClassVar[str] = "symplectic, sixth order in the step; energy does not drift"
    order: ClassVar[int] = 6
    limit: ClassVar[float] = 3.14
    method: ClassVar[Method] = NYSTROM_6


class Symplectic8(Symplectic):
    """Seventeen evaluations a step."""

    id: ClassVar[str] = "core:symplectic8"
    promise: ClassVar[str] = "symplectic, eighth order in the step; energy does not drift"
    order: ClassVar[int] = 8
    limit: ClassVar[float] = 3.09
    method: ClassVar[Method] = COMPOSED_8


SYMPLECTIC = (Symplectic2, Symplectic4, Symplectic6, Symplectic8)
