"""The engine, in rooms of one idea each: `PhysicsEngine` is made of them, as it is of `xpheve.realtime.control`."""

from xpheve.engine.engine import PhysicsEngine
from xpheve.plan.energy import Energy

__all__ = ["Energy", "PhysicsEngine"]
