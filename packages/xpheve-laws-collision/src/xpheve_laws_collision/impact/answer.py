"""What the text of the laws' answers defines, for the kernel files that call it; and the layout of a contact in ``f[0]``."""

from __future__ import annotations

from typing import Any

NORMAL, POINT, APPROACH, SEPARATION, WHEN = 0, 3, 6, 7, 8
BODY_A, BODY_B = 16, 64
BODY_X, BODY_V, BODY_SPIN, BODY_TURN, BODY_MASS, BODY_INVERSE, BODY_INERTIA, BODY_RADIUS, BODY_OWN = (
    0,
    3,
    6,
    9,
    13,
    14,
    15,
    18,
    24,
)
ANSWER, VALUES, UP = 112, 113, 120
CONTACTS = 128
SPEED, IMPULSE, VELOCITIES, REFUSED = 0, 1, 2, 3


def respond(f: Any, n: Any) -> int:
    """Read the contact in ``f[0]``, and write the answer of the law ``n[0]`` behind it."""
    raise NotImplementedError
