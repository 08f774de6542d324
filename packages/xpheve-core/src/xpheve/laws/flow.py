"""FlowLaw: what acts by an exact solution of its own, for splitting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.errors import LawDefinitionError
from xpheve.laws.event import Event
from xpheve.laws.law import ContinuousLaw, silent

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView

CHANGING = ("velocity", "angular_velocity")
"""What a flow may change: places and orientations follow from these, and that is the engine's part."""


class FlowLaw(ContinuousLaw):
    """What it does to velocities over any time, solved exactly: for what is too fast or too stiff for a force, but known in closed form.

    ``flow(self, body, dt)`` gets a batch as `FieldLaw.force` does, and returns what it changes of ``velocity`` and ``angular_velocity`` by name,
    as it is ``dt`` [s] later if nothing else acts and nothing moves. It is called in NumPy, half a step before the forces of the other laws
    and half a step after (`xpheve.steppers.splitting`). It depends on its arguments alone, and flowing for a while and then for another is
    flowing for both together: that is checked when the law first acts.
    """

    in_containers = False

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name in ("force", "torque", "apply"):
            if cls.defines(name):
                raise LawDefinitionError(
                    f"{cls.__name__} is a FlowLaw and has {name}, which would act twice: keep flow(self, body, dt) alone, or derive from FieldLaw"
                )
        if cls.kernel:
            raise LawDefinitionError(
                f"{cls.__name__}: kernel = {cls.kernel!r}: a FlowLaw has none; write flow(self, body, dt)"
            )

    @silent
    def flow(self, body: BodyView, dt: float) -> Any:
        """What becomes of each body of the batch in ``dt`` [s], by name: ``{"velocity": ...}``, shape (n, 3), world frame."""
        raise LawDefinitionError(f"{type(self).__name__}: write flow(self, body, dt)")

    @silent
    def potential(self, body: BodyView) -> Any:
        """Potential energy [J] of each body, shape (n, 1). Optional; without it what the flow adds to kinetic energy is reported as work."""
        raise LawDefinitionError(f"{type(self).__name__}: write potential(self, body)")

    def enforce_this_law(self, event: Event) -> None:
        """A flow takes time: it cannot happen at an event."""
        raise LawDefinitionError(f"{self.label()} is a flow: it acts all the time, in no container")

    @classmethod
    def is_concrete(cls) -> bool:
        return cls.defines("flow")
