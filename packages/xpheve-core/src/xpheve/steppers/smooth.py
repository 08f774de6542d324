"""What steppers share whose rows move on curves of their own: reading them, and rows that an event wrote."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from xpheve.bodies import Bodies
from xpheve.kernels.clock import Instant
from xpheve.steppers.contract import STATE_NAMES, Array, Flight, Rows, Signature, Sources, State
from xpheve.steppers.flights import FlightState, FlightStepper

Turned = tuple[Array, Array]


class Smooth(FlightStepper):
    """Rows whose places are some function of time until further notice.

    A row's own numbers hold from the instant in ``state.arrays["since"]`` (2, rows) on, which is its clock, too, until an event writes the row:
    then it is what was written, until `changed`. Rotation is free and in closed form, unless ``state.numbers["turning"]`` is 1: then it is
    a part of the curve.
    """

    @abstractmethod
    def curve(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        """Positions and velocities at ``t`` of the rows at ``places``, (3, places) each; row by row to the same bits as all at once."""

    def turned(self, state: FlightState, bodies: Bodies, t: Instant, places: slice | Rows) -> tuple[Array, Array]:
        """Orientations (4, places) and angular velocities (3, places), where rotation is a part of the curve."""
        raise NotImplementedError(f"{self.id} carries no rotation")

    def refusal(self, signature: Signature) -> str:
        """Why no smooth stepper serves groups of ``signature``; empty if one may."""
        if not signature.evaluated:
            return "no law acts along the way: closed form"
        if signature.contacts:
            return "contacts are looked for that are known along parabolas only"
        if not signature.traced:
            return "a law cannot be traced"
        if signature.near:
            return "a law has a cutoff, where its force is not smooth"
        return ""

    def new_state(self, arrays: dict[str, int], numbers: dict[str, float]) -> FlightState:
        """An empty State with ``arrays``, by their widths, and ``numbers``, beside what every smooth stepper keeps."""
        state = FlightState(np.zeros(0, dtype=np.int64))
        state.arrays |= {name: np.zeros((width, 0)) for name, width in ({"since": 2} | arrays).items()}
        state.numbers = {"turning": 0.0} | numbers
        return state

    # Reading

    def _written(self, state: FlightState, bodies: Bodies, places: slice | Rows) -> Any:
        """Which of the rows at ``places`` an event wrote since their curve began."""
        rows = state.rows[places]
        since = state.arrays["since"][:, places]
        return (bodies.clock[0, rows] != since[0]) | (bodies.clock[1, rows] != since[1])

    def _read(self, state: FlightState, bodies: Bodies, t: Instant, name: str, places: slice | Rows) -> Array:
        pair = self.curve if name in ("position", "velocity") else self.turned
        found = pair(state, bodies, t, places)[0 if name in ("position", "orientation") else 1]
        written = self._written(state, bodies, places)
        if written.any():
            found = np.where(written, bodies.arrays[name][:, state.rows[places]], found)
        return found

    def _is_curved(self, state: State, name: str) -> bool:
        return name in ("position", "velocity") or state.numbers["turning"] == 1.0

    def read(self, state: State, bodies: Bodies, t: Instant, name: str, out: Array) -> None:
        assert isinstance(state, FlightState)
        if self._is_curved(state, name):
            out[...] = self._read(state, bodies, t, name, slice(None))
        else:
            super().read(state, bodies, t, name, out)

    def read_row(self, state: State, bodies: Bodies, t: Instant, name: str, local: int) -> tuple[float, ...]:
        assert isinstance(state, FlightState)
        if not self._is_curved(state, name):
            return super().read_row(state, bodies, t, name, local)
        found = self._read(state, bodies, t, name, np.array([local], dtype=np.int64))
        return tuple(found[:, 0].tolist())

    def flight(self, state: State, bodies: Bodies, local: int) -> Flight:
        return super().flight(state, bodies, local)._replace(curved=True)

    # Writing

    def rebase(self, state: FlightState, bodies: Bodies, places: slice | Rows, t: Instant) -> None:
        """Write the state at ``t`` of the rows at ``places`` into the bodies, but of rows that are there already."""
        rows = state.rows[places]
        behind = (bodies.clock[0, rows] != t[0]) | (bodies.clock[1, rows] != t[1])
        which = np.arange(state.count)[places][behind]
        if not len(which):
            return
        rows = state.rows[which]
        curved = [name for name in STATE_NAMES if self._is_curved(state, name)]
        found = {name: self._read(state, bodies, t, name, which) for name in curved}
        for name, values in found.items():
            bodies.arrays[name][:, rows] = values
        bodies.clock[0, rows], bodies.clock[1, rows] = t
        if state.numbers["turning"] == 1.0:
            bodies.turn_clock[:, rows] = bodies.clock[:, rows]
        state.facts = None
        bodies.change += 1

    def begin(self, state: FlightState, bodies: Bodies, places: slice | Rows) -> None:
        """From their clocks on the rows at ``places`` have new curves."""
        state.arrays["since"][:, places] = bodies.clock[:, state.rows[places]]
        state.facts = None

    def held(self, state: FlightState, bodies: Bodies, places: slice | Rows = slice(None)) -> dict[str, Array]:
        """The states of the rows at ``places`` as the bodies have them, by name."""
        return {name: bodies.arrays[name][:, state.rows[places]] for name in STATE_NAMES}

    def together(self, bodies: Bodies, rows: Sequence[int], sources: Sources | None) -> list[int]:
        """``rows`` and all that laws join with them."""
        return list(rows) if sources is None else sources.joined(rows)
