"""Driven: objects that the host moves; uniform motion and rotation, whatever acts on them."""

from __future__ import annotations

from typing import Any, ClassVar

from xpheve.bodies import Bodies
from xpheve.kernels.flight import turn_uniformly
from xpheve.steppers.ballistic import Ballistic
from xpheve.steppers.contract import Offer, Refusal, Rows, Signature
from xpheve.steppers.flights import FlightState, Quat, Vec


class Driven(Ballistic):
    """Constant velocity and angular velocity in the world frame until the host says otherwise; forces wait."""

    id: ClassVar[str] = "core:driven"
    promise: ClassVar[str] = "prescribed by the host: uniform motion, exact to rounding"

    def offer(self, signature: Signature) -> Offer | Refusal:
        return Offer(float("inf"), 1.0, True) if signature.driven else Refusal("nobody drives it")

    def _take_forces(self, state: FlightState, bodies: Bodies, which: slice | Rows) -> None:
        """None acts."""
        state.arrays["acceleration"][:, which] = 0.0
        state.arrays["torque"][:, which] = 0.0
        state.facts = None

    def _turned(self, state: FlightState, bodies: Bodies, row: int, local: int, s: float) -> tuple[Quat, Vec]:
        q: Any = bodies.get("orientation", row)
        omega: Any = bodies.get("angular_velocity", row)
        return turn_uniformly(q, omega, s), omega
