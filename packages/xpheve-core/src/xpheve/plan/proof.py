"""What is asked of a law before it may act: a formula when it is added, and numbers that fit when it first acts, once a formula and process."""

from __future__ import annotations

from weakref import WeakValueDictionary

from xpheve.laws import ContinuousLaw, PhysicalLaw
from xpheve.plan.hand_kernels import is_by_hand
from xpheve.trace.law_trace import LawTrace

_PROVEN: WeakValueDictionary[int, LawTrace] = WeakValueDictionary()
"""The traces that stood, by their identity."""


def require_formula(law: PhysicalLaw) -> None:
    """Raise `TraceError` if ``law`` is a field or pair law that says no formula, and has neither `apply` nor a kernel."""
    if isinstance(law, ContinuousLaw):
        from xpheve.trace.recorder import forget_if_edited, trace_law

        forget_if_edited(type(law))
        trace_law(law)


def prove(law: ContinuousLaw, trace: LawTrace) -> None:
    """Try ``law``, which has ``trace``, at a handful of states, unless a law of the same formula was tried before; kernels are not tried.

    Raises
    ------
    PotentialError
        If its potential does not match its force.
    TraceError
        If what was traced is not what its methods do.
    """
    if _PROVEN.get(id(trace)) is trace or is_by_hand(law):
        return
    from xpheve.trace.check import quick_check

    quick_check(law, trace)
    _PROVEN[id(trace)] = trace
