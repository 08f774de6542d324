"""`xpheve.kernels.spin` for arrays: the same functions, with the same bits, on tuples of arrays, one number a row."""

from __future__ import annotations

from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.kernels import ieee, spin

Array = NDArray[np.float64]


def _uneven(by: Any) -> bool:
    return any(np.any(one) for one in by)


def _one_by_one(function: Any) -> Any:
    """``function`` of each number: NumPy's own sines may differ from the C library's in the last bit, and from machine to machine."""

    def mapped(x: Any) -> Any:
        return np.array([function(one) for one in x.tolist()]) if isinstance(x, np.ndarray) else function(x)

    return mapped


def _for_arrays() -> dict[str, Any]:
    names = dict(vars(spin)) | {
        "sin": _one_by_one(ieee.sin),
        "cos": _one_by_one(ieee.cos),
        "sqrt": np.sqrt,
        "uneven": _uneven,
    }
    for name, value in vars(spin).items():
        if isinstance(value, FunctionType) and value.__module__ == spin.__name__ and name != "uneven":
            names[name] = FunctionType(value.__code__, names, name, value.__defaults__)
    return {name: value for name, value in names.items() if callable(value) and not name.startswith("_")}


FUNCTIONS = _for_arrays()
"""By name; in the text of loops ``spin__turned`` and so on."""


def moments(inertia: Array) -> tuple[Array, Array, Array]:
    """Excess and spread (3, n), and one over the middle moment (n,), 0 for points, of ``inertia`` (3, n); see `xpheve.kernels.spin`."""
    point = inertia[0] == 0.0
    middle = np.where(point, 1.0, np.sort(inertia, axis=0)[1])
    whole = np.where(point, 1.0, inertia)
    return whole / middle - 1.0, middle / whole - 1.0, np.where(point, 0.0, 1.0 / middle)


def flown(q: Array, omega: Array, inertia: Array, torque: Array, s: Any) -> tuple[Array, Array]:
    """Orientations (4, n) and angular velocities (3, n) after ``s`` [s] under constant torques [N m]; at s = 0 those given."""
    excess, spread, inverse = moments(inertia)
    with np.errstate(all="ignore"):
        new_q, new_omega = FUNCTIONS["flown"](
            tuple(q), tuple(omega), tuple(excess), tuple(spread), tuple(torque * inverse), s
        )
    still = np.asarray(s) == 0.0
    return np.where(still, q, np.array(new_q)), np.where(still, omega, np.array(new_omega))


def half_way(q: Array, omega: Array, inertia: Array, torque: Array, half: float) -> tuple[Array, Array]:
    """Orientations and angular velocities in the middle of a step of length 2 ``half``, with half the kick."""
    excess, spread, inverse = moments(inertia)
    call = FUNCTIONS
    with np.errstate(all="ignore"):
        m = call["stretched"](tuple(q), tuple(omega), tuple(excess))
        middle = call["turned"](tuple(q), m, tuple(spread), half)
        m = call["kicked"](m, tuple(torque * inverse), half)
        return np.array(middle), np.array(call["stretched"](middle, m, tuple(spread)))


__all__ = ["FUNCTIONS", "flown", "half_way", "moments"]
