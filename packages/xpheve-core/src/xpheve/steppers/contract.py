"""The stepper contract: one way of passing time, chosen by the plan, found through the same door as laws.

A stepper serves *batches*: rows whose groups have the same signature. It has no state of its own: `State` holds named arrays, aligned
with ``state.rows``, which core saves, restores, grows and shrinks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from xpheve.bodies import Bodies
from xpheve.kernels.clock import NEVER, Instant, multiple

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Vec = tuple[float, float, float]
STATE_NAMES = ("position", "velocity", "orientation", "angular_velocity")


@dataclass(frozen=True)
class Signature:
    """What a stepper needs to know of a group to make an offer.

    Attributes
    ----------
    laws
        The ids of the laws evaluated along the way; stored forces are none of them.
    torque
        How the stored torques act: ``"none"``, ``"principal"`` (about a principal axis about which the body spins) or ``"general"``.
    coupled
        Whether the group joins more than one object.
    driven
        Objects that move as the host says; core serves them itself.
    form
        What the plan proved of the group: ``"two bodies"`` under an inverse-square force, ``"linear"``, or ``"general"``.
    reads
        What the laws read of objects and scene, as far as they are traced.
    conservative
        Whether each law has a potential, and reads neither velocity nor time.
    traced
        Whether all laws can be parts of a generated text.
    near
        Whether a law has a cutoff.
    stiff
        Whether forces decay far faster than the state changes, so that explicit steps would be far too short.
    fixed_step
        Whether host steps were asked for, by ``dt``, or tolerances.
    contacts
        Whether contacts are looked for that the contact server finds along parabolas only: what moves on other curves cannot serve then.
    flows
        The ids of those laws that are exact flows of their own.
    wish
        The id of the stepper that the user asked for; empty for none.
    impacts
        Whether the contact server would have the group fly from impact to impact in a stepper of its own (`Stepper.impacts`).
    level
        How many groups stand before the group in the order of dependence, at most: sources of one-sided laws are moved on before what they
        act on. 0 if nothing that moves acts on it so.
    """

    laws: tuple[str, ...]
    torque: str
    coupled: bool = False
    driven: bool = False
    form: str = "general"
    reads: tuple[str, ...] = ()
    conservative: bool = False
    traced: bool = True
    near: bool = False
    stiff: bool = False
    fixed_step: bool = True
    contacts: bool = False
    wish: str = ""
    flows: tuple[str, ...] = ()
    level: int = 0
    impacts: bool = False

    @property
    def evaluated(self) -> bool:
        """Whether something must be evaluated along the way: laws, or torques that turn with the body."""
        return bool(self.laws) or self.torque == "general"


class Offer(NamedTuple):
    """A stepper's bid: order of its error in the step, relative cost of a unit of time, whether it is exact."""

    order: float
    cost: float
    exact: bool


class Refusal(NamedTuple):
    """Why a stepper cannot serve a group."""

    reason: str


class Flight(NamedTuple):
    """How one object's centre moves from ``t0`` to ``t1``: ``position + s (velocity + s acceleration / 2)``, s since ``t0``.

    ``curved`` says that it is so at ``t0`` only: who follows the flight reads it from its stepper, at any time from ``t0`` to ``t1``. One
    without end is one smooth formula.
    """

    t0: Instant
    t1: Instant
    position: Vec
    velocity: Vec
    acceleration: Vec
    error: float
    curved: bool = False


class Stop(NamedTuple):
    """Until when a batch is known now, and the rows whose flight is new."""

    covered: Instant
    rows: Sequence[int] | Rows


class Attraction(NamedTuple):
    """What attracts a body by an inverse-square force: d'' = -mu d / |d|^3, where d leads from there to the body.

    Attributes
    ----------
    row
        Of the other body, if that moves, too; else -1.
    place
        Where the centre is [m], if it does not move.
    mu
        [m^3/s^2], as a pair of floats; below 0 if it repels.
    laws
        Labels of the laws.
    law
        The first of them, to be named where it fails.
    """

    row: int
    place: Vec
    mu: tuple[float, float]
    laws: str
    law: Any


class Grid(NamedTuple):
    """Host steps: step ``number`` goes from ``origin + number * dt`` to the next point."""

    origin: Instant
    dt: float
    number: int

    def point(self, steps: int) -> Instant:
        """Where the step ``steps`` after this one begins."""
        return multiple(self.origin, self.number + steps, self.dt)


class Sources(Protocol):
    """What acts on a batch along the way: laws evaluated by the plan."""

    working: Array
    """Forces [N] of the last evaluation that no potential stands for, (3, rows); a stepper keeps them in
    ``state.arrays["working"]`` beside the flights they act over, so that their work is booked."""

    twists: NDArray[np.bool_]
    """Which rows of the engine a law turns that has a torque."""

    @property
    def reads_turning(self) -> bool:
        """Whether a law reads orientation or angular velocity, for all that is known."""
        ...

    @property
    def turning_pairs(self) -> bool:
        """Whether a law between two objects does."""
        ...

    def stepped(self, rows: Rows) -> Array:
        """How ``rows`` turn, (1, rows).

        2 if a torque may act; 1 if none does, but a law needs the rotation in every step; 0 if it is free, and stays in closed form.
        """
        ...

    def evaluate(
        self, rows: Rows, t: Instant, state: dict[str, Array], again: bool = False
    ) -> tuple[Array, Array, bool]:
        """Forces [N] and torques [N m], shape (3, rows), of the laws on ``rows`` in ``state``; and whether a velocity was read.

        ``again``: as in the call before, but for velocities and orientations; what reads none of them is not evaluated.
        """
        ...

    def flow(
        self, rows: Rows, t: Instant, state: dict[str, Array], span: float, backwards: bool = False
    ) -> tuple[set[str], Array]:
        """Let the exact flows change ``state`` of ``rows`` for ``span`` [s] from ``t`` on, in the order of their ranks or in the opposite one.

        Returns the names of what may have changed, and the work [J] that those without potential did on each row.
        """
        ...

    def joined(self, rows: Sequence[int]) -> list[int]:
        """``rows`` and all rows that pair laws join with them, ascending."""
        ...

    def attractions(self, rows: Sequence[int]) -> dict[int, Attraction]:
        """What attracts each of ``rows`` of a group of the form "two bodies"; what is of another form now is left out."""
        ...

    def linear(self, rows: Rows) -> Any:
        """The `xpheve.steppers.linear_form.LinearForm` of ``rows``, complete groups of a batch whose signature says linear."""
        ...

    def follow(self, begin: Instant, end: Instant, least: Instant) -> Instant:
        """Follow what acts by one-sided laws from ``begin`` on, to ``least`` at least and rather to ``end``; until when that could be done."""
        ...

    @property
    def motion(self) -> Any:
        """The `xpheve.plan.motions.Motion` of the batch, for drivers; or None if its laws must be evaluated one by one."""
        ...

    @property
    def program(self) -> Any:
        """The `xpheve.loop.program.Program` of the batch, or None if its laws must be evaluated one by one."""
        ...

    def pack(self, state: State, found: dict[str, Array]) -> Array:
        """The numbers of the program's rows, (slots, rows): ``found`` of the batch's, and what the program reads besides."""
        ...

    def run(self, numbers: Array, grid: Grid, steps: int) -> None:
        """Run the program over ``numbers``, in place."""
        ...

    def label(self, place: int) -> str:
        """The object at ``place`` of the program."""
        ...

    def unpack(self, numbers: Array) -> dict[str, Array]:
        """What a run changes, in the order of the batch's rows."""
        ...


@dataclass
class Settings:
    """How accurate: host steps on a grid, or tolerances in SciPy's meaning (relative, absolute)."""

    dt: float | None = None
    rtol: float = 1e-6
    atol: float = 1e-9


@dataclass
class State:
    """What a batch keeps between calls: rows, named arrays (width, rows), and named numbers."""

    rows: Rows
    arrays: dict[str, Array] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)
    where: slice | Rows = field(default_factory=lambda: slice(0, 0))
    """The rows as a slice if they lie side by side, else as they are; kept by `locate`."""

    @property
    def count(self) -> int:
        return len(self.rows)

    def locate(self) -> None:
        """To be called when ``rows`` changed."""
        rows, n = self.rows, len(self.rows)
        if n and rows[n - 1] - rows[0] == n - 1 and bool((np.diff(rows) == 1).all()):
            self.where = slice(int(rows[0]), int(rows[0]) + n)
        else:
            self.where = rows


class Stepper(ABC):
    """One way of passing time."""

    offers: ClassVar[str] = "stepper"
    id: ClassVar[str] = ""
    promise: ClassVar[str] = ""
    """One line for `explain`."""
    books_work: ClassVar[bool] = False
    """Whether the stepper itself keeps, in ``state.arrays["work"]`` and ``["work_rest"]``, the work [J] that forces without potential did
    on each row over the flights that are over."""
    driver: ClassVar[str] = ""
    """The driver (`xpheve.loop.drivers`) that makes its steps; empty if it has none."""
    limit: ClassVar[float] = 2.0
    """How large the step times the fastest rate may be in fixed steps before they are unstable; infinite for steps that always are stable."""
    loops: ClassVar[bool] = True
    """Whether it runs the forces of `Sources.motion` along the way, so that moving sources are followed for it as polynomials."""
    asks: ClassVar[bool] = False
    """Whether, with tolerances, it asks `Sources.follow` for the ways of moving sources as far as its steps reach; else these cut them."""
    impacts: ClassVar[bool] = False
    """Whether it goes from impact to impact: it is given the contact server as its sources, and as `need` and `wall` the instant before which all
    events of its own are to happen; it may stop there, or where the server must act. `covered` is then when its next event is due."""
    parts: ClassVar[bool] = False
    """Whether rows that an event changes in the midst of a step leave their batch for one of their own, so that nobody else's step is cut."""

    @abstractmethod
    def offer(self, signature: Signature) -> Offer | Refusal:
        """A bid for groups of ``signature``, or why not."""

    @abstractmethod
    def start(self, rows: Rows, bodies: Bodies, t: Instant, sources: Sources | None) -> State:
        """A State for ``rows``."""

    @abstractmethod
    def join(self, state: State, rows: Rows, bodies: Bodies, t: Instant) -> None:
        """Take ``rows`` in, re-basing nobody else."""

    def merge(self, state: State, other: State, bodies: Bodies, settings: Settings) -> bool:
        """Take all rows of ``other``, known until the same instant, into ``state`` with the flights they have; whether that was done.

        Only what then moves to the same bits as in two batches may be merged. By default nothing is.
        """
        return False

    @abstractmethod
    def leave(self, state: State, local: int) -> None:
        """Let go of the row at place ``local`` by moving the last into its place."""

    @abstractmethod
    def advance(
        self,
        state: State,
        bodies: Bodies,
        need: Instant,
        wall: Instant,
        settings: Settings,
        sources: Sources | None,
    ) -> Stop:
        """Make one more step of the stepper's own if the batch is not known until ``need``.

        ``need`` must not change the sequence of steps by a bit; ``wall``, the next host step or jump of a force, is never passed.
        """

    def leap(
        self,
        state: State,
        bodies: Bodies,
        need: Instant,
        wall: Instant,
        settings: Settings,
        sources: Sources | None,
    ) -> Stop:
        """As `advance`, with nobody listening to the steps up to ``need``, so that many may be made in one call.

        To the same bits as one after the other; it may stop short of ``need`` and be called again. By default it makes one.
        """
        return self.advance(state, bodies, need, wall, settings, sources)

    def stride(
        self, state: State, bodies: Bodies, grid: Grid, steps: int, settings: Settings, sources: Sources | None
    ) -> Stop:
        """Make ``steps`` host steps, the first from where the batch is covered, with nobody listening in between.

        To the same bits as one after the other, which is what it does by default.
        """
        rows: Sequence[int] | Rows = ()
        for k in range(steps):
            end = grid.point(k + 1)
            while self.covered(state) < end:  # steps may be shorter than host steps
                rows = self.leap(state, bodies, end, end, settings, sources).rows
        return Stop(self.covered(state), rows)

    @abstractmethod
    def read(self, state: State, bodies: Bodies, t: Instant, name: str, out: Array) -> None:
        """Write column ``name`` of all rows at ``t`` into ``out`` (width, rows of the state). Changes nothing."""

    @abstractmethod
    def read_row(self, state: State, bodies: Bodies, t: Instant, name: str, local: int) -> tuple[float, ...]:
        """Column ``name`` of one row at ``t``, to the same bits as `read`."""

    def read_times(self, state: State, bodies: Bodies, times: Sequence[Instant], name: str, local: int) -> Array:
        """Column ``name`` of one row at many ``times``, shape (width, times), to the same bits as `read_row`."""
        return np.array([self.read_row(state, bodies, t, name, local) for t in times]).T

    @abstractmethod
    def flight(self, state: State, bodies: Bodies, local: int) -> Flight:
        """How the row at place ``local`` moves until further notice."""

    @abstractmethod
    def changed(
        self, state: State, bodies: Bodies, rows: Sequence[int], t: Instant, sources: Sources | None
    ) -> Sequence[int]:
        """The state, forces or laws of ``rows`` were written at ``t``: returns every row whose flight is new now."""

    def restart(self, state: State, bodies: Bodies, t: Instant, sources: Sources | None) -> Sequence[int]:
        """The forces on all rows are others from ``t`` on: returns the rows, whose flights are new."""
        return self.changed(state, bodies, state.rows.tolist(), t, sources)

    def running_work(self, state: State, bodies: Bodies, t: Instant, places: slice | Rows) -> Array:
        """Work [J] of forces without potential on the rows at ``places``, from the start of their flights to ``t``, (places,).

        Of steppers that keep it as ``books_work`` says; what stands in ``state.arrays["work"]`` is not in it. 0 by default.
        """
        return np.zeros(len(state.rows[places]))

    def resume(self, state: State, bodies: Bodies, t: Instant, sources: Sources | None) -> None:  # noqa: B027
        """Make again what is not in the arrays and numbers of ``state``, which were restored from a checkpoint."""

    def covered(self, state: State) -> Instant:
        """Until when the batch is known without another step."""
        return NEVER


class ContactServer(ABC):
    """Finds touching pairs and answers them: one for a scene, offered by a pack. See `xpheve.plan.world.World` for what it may ask."""

    offers: ClassVar[str] = "contact_server"
    id: ClassVar[str] = ""

    @abstractmethod
    def attach(self, world: Any) -> None:
        """Serve ``world`` from now on."""

    @abstractmethod
    def check(self, obj: Any, laws: Sequence[Any]) -> None:
        """Raise `ContactError` if contacts of ``obj`` with others under ``laws`` could not be found."""

    @classmethod
    def queries(cls, engine: Any) -> Any:
        """What answers `xpheve.queries.Queries` of ``engine``; None if this server's pack does not."""
        return None

    def check_turning(self, obj: Any, spin: Any) -> None:  # noqa: B027 (most servers know contacts of what turns)
        """Raise `ContactError` if contacts of ``obj`` could not be found at the angular velocity ``spin`` [rad/s]."""

    def concerns(self, obj: Any) -> bool:
        """Whether contacts of ``obj`` are looked for, so that every new flight of it matters."""
        return True

    def parabolas(self, obj: Any) -> str:
        """Why contacts of ``obj`` are found only where it flies along parabolas; empty if they are found along any flight."""
        return "its contacts are found along parabolas"

    def flies(self, obj: Any) -> bool:
        """Whether ``obj`` is to fly from impact to impact in a stepper of the server's own pack; see `Stepper.impacts`."""
        return False

    def plan(self) -> None:  # noqa: B027 (servers without a stepper of their own have nothing to plan)
        """Before the scene is planned: have those planned anew (`World.mark`) of whom `flies` says otherwise now."""

    def flown(self, rows: Sequence[int] | Rows) -> None:  # noqa: B027
        """The flights of ``rows`` are new by events of the pack's own stepper."""

    @abstractmethod
    def refresh(self, rows: Sequence[int]) -> None:
        """The flights, shapes or mapping of ``rows`` are new: predict their contacts again."""

    @abstractmethod
    def removed(self, obj: Any, row: int, moved: int) -> None:
        """``obj`` was taken out of ``row``, and what was row ``moved`` has its place now."""

    @abstractmethod
    def answer(self, law: Any, contacts: Sequence[Any]) -> None:
        """Let ``law``, a `ResponseLaw`, answer ``contacts`` that somebody else found; what it does is written at this instant."""

    @abstractmethod
    def host_step(self) -> None:
        """A host step begins: tell the listeners of `ContactStay`."""

    @abstractmethod
    def save(self) -> dict[str, Any]:
        """What it keeps between instants, as plain values; rows as serials."""

    @abstractmethod
    def restore(self, saved: dict[str, Any]) -> None:
        """Take up what `save` gave."""

    @abstractmethod
    def report(self) -> dict[str, Any]:
        """Counts and standing contacts, for `explain`."""
