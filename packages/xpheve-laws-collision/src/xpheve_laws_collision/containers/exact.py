"""The exact contact container: laws of touching bodies, called at the instant of impact."""

from __future__ import annotations

from typing import ClassVar

from xpheve.laws import LawContainer
from xpheve.laws.conditions import Impact


class ExactContacts(LawContainer):
    """Detects touching and approaching pairs by their exact shapes, at the exact instant, and hands them to its collision laws."""

    id: ClassVar[str] = "collision:exact"
    condition = Impact()
    accepts_role: ClassVar[str] = "collision"
