"""What conditions name: objects, probes and laws."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from xpheve.errors import OwnershipError
from xpheve.laws import LawContainer, PhysicalLaw
from xpheve.laws.combinations import leaves
from xpheve.laws.conditions import Crosses
from xpheve.objects import PhysicalObject
from xpheve.observers import Probe


def check_references(engine: Any, container: LawContainer) -> None:
    """Raise `OwnershipError` if the condition of ``container`` names what is in another engine; what is in none may come later.

    Expressions are read, and raise `TraceError` if they are none.
    """
    for leaf in leaves(container.condition):
        for field in fields(leaf):
            value = getattr(leaf, field.name)
            home = value._engine if isinstance(value, PhysicalObject) else getattr(value, "engine", None)
            if isinstance(value, (PhysicalObject, Probe, PhysicalLaw)) and home not in (None, engine):
                raise OwnershipError(f"{container!r}: {field.name} names {value!r}, which is in another engine")
    if any(isinstance(leaf, Crosses) for leaf in leaves(container.condition)):
        from xpheve.plan.wakeups.expressions import read_expressions  # brings the tracer along: only who asks pays

        read_expressions(engine._world, container)
