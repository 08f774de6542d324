"""Columns that several laws of this pack share, so that they say the same of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from xpheve.laws import Column

if TYPE_CHECKING:
    from xpheve.laws.view import BodyView

CHARGE = Column(math.nan, unit="C", doc="q, electric charge; must be given, 0 for a neutral object.")
DRAG_AREA = Column(math.nan, unit="m^2", ge=0, doc="A, the area seen along the way; must be given.")
DISPLACED_VOLUME = Column(
    math.nan, unit="m^3", ge=0, doc="V, displaced when wholly immersed; by default the volume of the object's shape."
)


def volume_of(body: BodyView) -> Any:
    """Volume [m^3] that each body displaces, shape (n, 1): its own column, else that of its shape, else NaN."""
    own = body.displaced_volume
    return np.where(np.isnan(own), body.volume, own)
