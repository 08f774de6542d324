"""What a pack implements: laws, containers, conditions, parameters."""

from xpheve.laws.conditions import Condition
from xpheve.laws.container import LawContainer
from xpheve.laws.event import Contact, Event
from xpheve.laws.flow import FlowLaw
from xpheve.laws.law import (
    API_VERSION,
    ContinuousLaw,
    FieldLaw,
    PairLaw,
    PhysicalLaw,
)
from xpheve.laws.param import Column, Constant, Param
from xpheve.laws.response import Grip, Impulse, ResponseLaw, Velocities

__all__ = [
    "API_VERSION",
    "Column",
    "Condition",
    "Constant",
    "Contact",
    "ContinuousLaw",
    "Event",
    "FieldLaw",
    "FlowLaw",
    "Grip",
    "Impulse",
    "LawContainer",
    "PairLaw",
    "Param",
    "PhysicalLaw",
    "ResponseLaw",
    "Velocities",
]
