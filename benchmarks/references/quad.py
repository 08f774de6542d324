"""Answers in quadruple precision (113 bits), by Taylor series of heyoka (real128).

All begin with the float64 numbers of the start.

heyoka is no part of xPheve: ``pip install heyoka`` to make an answer again. F. Biscani, D. Izzo, MNRAS 504, 2614
(2021).
"""

from __future__ import annotations

from typing import Any


def swarm(one: Any, span: float) -> list[str]:
    """Places and then velocities of all at ``span``, body after body, in decimal digits."""
    import heyoka as hy

    quad = hy.real128
    n = one.n
    masses = [hy.expression(quad(float(m))) for m in one.mass]
    system = hy.model.nbody(n, masses=masses, Gconst=hy.expression(quad(float(one.constant))))
    state = [quad(float(c)) for x, v in zip(one.position, one.velocity, strict=True) for c in (*x, *v)]
    end = _propagate(hy, system, state, span)
    places = [end[6 * i + c] for i in range(n) for c in range(3)]
    return places + [end[6 * i + 3 + c] for i in range(n) for c in range(3)]


def slope(one: Any, span: float, kind: str = "real128") -> list[str]:
    """The state of a `Slope` at ``span``; ``kind`` "longdouble" is quicker, with 64 bits."""
    import heyoka as hy
    import numpy as np

    number = hy.real128 if kind == "real128" else np.longdouble
    names = [f"y{k}" for k in range(len(one.start))]
    variables = hy.make_vars(*names)
    right = one.make(hy.sqrt)(hy.time, variables)
    system = [(y, hy.expression(number(0.0)) + f) for y, f in zip(variables, right, strict=True)]
    return _propagate(hy, system, [number(float(c)) for c in one.start], span, number)


def _propagate(hy: Any, system: Any, state: list[Any], span: float, number: Any = None) -> list[str]:
    import numpy as np

    number = number or hy.real128
    many = hy.taylor_adaptive(system, np.array(state, dtype=number), fp_type=number, compact_mode=len(state) > 20)
    outcome = many.propagate_until(number(float(span)))
    assert outcome[0] == hy.taylor_outcome.time_limit, outcome
    digits = 34 if number is hy.real128 else 20
    return [_text(c, digits) for c in many.state]


def _text(value: Any, digits: int) -> str:
    import numpy as np

    return (
        np.format_float_scientific(value, precision=digits, unique=False)
        if isinstance(value, np.longdouble)
        else str(value)
    )
