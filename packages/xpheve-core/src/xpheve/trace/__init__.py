"""Laws read once: what a law's expression computes, as a graph of scalar operations; what it reads; its derivatives and its text.

What authors of laws and of steppers use is here: `trace_law` reads a law, `nature_of` says what kind it is, `jacobian` derives it, `check_law`
and `require_law` try it by numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xpheve.trace.check import Finding, check_law, nature_of, require_law
    from xpheve.trace.derivative import jacobian
    from xpheve.trace.law_trace import LawTrace
    from xpheve.trace.nature import Nature
    from xpheve.trace.numpy_text import array_function, scalar_function
    from xpheve.trace.recorder import trace_law, why_untraced

_HOMES = {
    "Finding": "check",
    "LawTrace": "law_trace",
    "Nature": "nature",
    "array_function": "numpy_text",
    "check_law": "check",
    "jacobian": "derivative",
    "nature_of": "check",
    "require_law": "check",
    "scalar_function": "numpy_text",
    "trace_law": "recorder",
    "why_untraced": "recorder",
}

__all__ = [
    "Finding",
    "LawTrace",
    "Nature",
    "array_function",
    "check_law",
    "jacobian",
    "nature_of",
    "require_law",
    "scalar_function",
    "trace_law",
    "why_untraced",
]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module 'xpheve.trace' has no attribute {name!r}")
    found = getattr(import_module(f"xpheve.trace.{_HOMES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
