"""Real time: a clock, frames on a thread of its own, snapshots for other threads, inputs that replay."""

from xpheve.realtime.clock import RealClock
from xpheve.realtime.inputs import Input, Inputs
from xpheve.realtime.snapshot import Snapshot

__all__ = ["Input", "Inputs", "RealClock", "Snapshot"]
