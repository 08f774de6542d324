"""Wakeup conditions: *when* the laws of a container are enforced.

A condition is a frozen value and may be shared. It does nothing by itself: the plan gives each armed condition one
server (the event queue, the engine, or the scene's contact server); a condition nobody armed costs nothing.
All conditions stay armed after firing; ``once=True`` disarms them at their first event. ``a | b``, ``a & b``, ``~a`` and ``AllNow(a, b)`` make
one condition of several; see `xpheve.laws.combinations`.

A *level* condition holds for a while (an observer is near); it fires when it becomes true, and once when it is armed while true.
The others are events.

Source: the wakeup criteria of Java3D as used in Nourian (2004), 3.2.2.1, with simulation time for wall time.
"""

from xpheve.laws.combinations import AllNow, AllOf, AnyOf, Not
from xpheve.laws.conditions.base import Condition
from xpheve.laws.conditions.contacts import ContactBegin, ContactClear, ContactEnd, ContactStay, Impact
from xpheve.laws.conditions.crossings import Asleep, Awake, Crosses
from xpheve.laws.conditions.engine import (
    Changed,
    Input,
    ObjectAdded,
    ObjectRemoved,
    Paused,
    PoseChanged,
    Posted,
    Resumed,
    Started,
)
from xpheve.laws.conditions.space import (
    ObserverEnter,
    ObserverExit,
    ProbeEnter,
    ProbeExit,
    RegionActive,
    RegionInactive,
)
from xpheve.laws.conditions.time import Elapsed, ForceExpired, Steps

# In the order of listings: the table of the page, the schema of scene files and its errors.
__all__ = [  # noqa: RUF022
    "Condition",
    "Started",
    "ObjectAdded",
    "ObjectRemoved",
    "Changed",
    "PoseChanged",
    "Elapsed",
    "Steps",
    "Posted",
    "ForceExpired",
    "Impact",
    "ContactBegin",
    "ContactStay",
    "ContactEnd",
    "ContactClear",
    "RegionActive",
    "RegionInactive",
    "ObserverEnter",
    "ObserverExit",
    "ProbeEnter",
    "ProbeExit",
    "Input",
    "Paused",
    "Resumed",
    "Crosses",
    "Asleep",
    "Awake",
    "AllNow",
    "AllOf",
    "AnyOf",
    "Not",
]
