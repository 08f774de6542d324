"""What a pack implements: laws, containers, conditions, parameters."""

from xpheve.laws.conditions import Condition
from xpheve.laws.container import LawContainer
from xpheve.laws.event import Contact, Event
from xpheve.laws.flow import FlowLaw
from xpheve.laws.law import (
    API_VERSION,
    ContinuousLaw,
    FieldLaw,
    Impulse,
    PairLaw,
    PhysicalLaw,
    ResponseLaw,
    Velocities,
)
from xpheve.laws.param import Column, Constant, Param

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
    "Impulse",
    "LawContainer",
    "PairLaw",
    "Param",
    "PhysicalLaw",
    "ResponseLaw",
    "Velocities",
]
