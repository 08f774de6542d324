"""A response tried by numbers: what was read of it against what it does, on contacts of all kinds."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from xpheve.kernels import response as layout
from xpheve.kernels.vector import add, cross, dot, scale, sub
from xpheve.laws import Contact, Impulse, ResponseLaw, Velocities
from xpheve.objects import PhysicalObject
from xpheve.shapes import Sphere
from xpheve.trace.response import ResponseTrace
from xpheve.trace.samples import SEED, _within, variants

SAMPLES = 16
TRIALS = 2

_PROVEN: WeakKeyDictionary[type, set[str]] = WeakKeyDictionary()
"""Texts that stood, by the class of the law."""

Answer = tuple[int, tuple[float, ...]]


class SampleObject(PhysicalObject):
    """An object outside any engine whose columns have values, or the defaults of those who declare them."""

    values: Mapping[str, float]

    def __getitem__(self, name: str) -> float:
        return self.values.get(name, 0.5)  # what is read to no effect is in no row


def difference(law: ResponseLaw, trace: ResponseTrace) -> str:
    """Where what was read of ``law`` differs from what it answers, in words; empty if it does not on any of the samples."""
    from xpheve.compile import assemble, interpreted
    from xpheve.loop.responses import branch_text

    body = branch_text(trace, trace.columns)
    proven = _PROVEN.setdefault(type(law), set())
    if body in proven:
        return ""
    run = interpreted(assemble(f"def entry(f, n):\n{body}\n"))
    for number, one in enumerate(variants(law, TRIALS)):
        parameters = np.array([_parameter(one, part) for part in trace.parameters] or [0.0])
        for contact in contacts(one, trace.columns, SAMPLES, SEED + number):
            expected = python_answer(one, contact)
            scratch = scratch_of(contact, trace.columns)
            kind = run([scratch, parameters], [np.zeros(3, dtype=np.int64)])
            found = kind, tuple(scratch[layout.VALUES : layout.VALUES + (1, 3, 6, 0)[kind]].tolist())
            if kind != layout.ASK and not same(expected, found):
                said = f"answers {_said(expected)}" if expected[1] else _refusal(one, contact)
                return f"{law.label()}.respond, read as a formula, answers {_said(found)}, and in Python it {said}"
    proven.add(body)
    return ""


def python_answer(law: ResponseLaw, contact: Contact) -> Answer:
    """What ``law`` itself says, in the numbers of the scratch; what it refuses, or may not say, is to be asked."""
    try:
        answer: Any = law.respond(contact)
    except Exception:
        return layout.ASK, ()
    if isinstance(answer, Impulse):
        return layout.IMPULSE, answer.vector
    if isinstance(answer, Velocities):
        return layout.VELOCITIES, (*answer.a, *answer.b)
    if isinstance(answer, (int, float)) and 0.0 <= answer < math.inf:
        return layout.SPEED, (float(answer),)
    return layout.ASK, ()


def same(one: Answer, other: Answer) -> bool:
    """Whether two answers are equal to the bit."""
    return one[0] == other[0] and _bits(one[1]) == _bits(other[1])


def _bits(values: Sequence[float]) -> bytes:
    return struct.pack(f"{len(values)}d", *values)


def _said(answer: Answer) -> str:
    kind, values = answer
    name = {layout.SPEED: "m/s", layout.IMPULSE: "N s", layout.VELOCITIES: "m/s"}.get(kind)
    return f"{', '.join(map(repr, values))} {name}" if name else "nothing that can be done"


def _refusal(law: ResponseLaw, contact: Contact) -> str:
    """What ``law`` does in Python where it has no answer."""
    try:
        return f"gives {law.respond(contact)!r}"
    except Exception as error:
        return f"raises {type(error).__name__}: {error}"


def _parameter(law: ResponseLaw, one: Any) -> float:
    value = law.parameters[one.name]
    return float(value[one.component] if isinstance(value, tuple) else value)


def contacts(law: ResponseLaw, columns: Sequence[str], count: int, seed: int = SEED) -> Iterator[Contact]:
    """Contacts of spheres that approach, of all sizes and speeds; of every three one has a fixed body, by turns a and b."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        a, b = (_object(law, columns, rng, fixed=k % 6 == still) for still in (1, 4))
        direction = rng.normal(size=3)
        if k % 4 == 0:
            direction = np.eye(3)[k // 4 % 3]
        n = direction / np.sqrt((direction * direction).sum())
        closing = sum((q - p) * c for p, q, c in zip(a.velocity, b.velocity, n.tolist(), strict=True))
        n = n if closing < 0.0 else -n
        point = tuple(rng.normal(size=3).tolist())
        yield _contact(law, a, b, tuple(n.tolist()), point, float(rng.normal() * 1e-12), abs(closing) or 1.0, rng)


def _contact(
    law: ResponseLaw,
    a: Any,
    b: Any,
    normal: Any,
    point: Any,
    separation: float,
    closing: float,
    rng: np.random.Generator,
) -> Contact:
    more: dict[str, Any] = {
        "instant": (float(rng.uniform(0.0, 100.0)), float(rng.uniform(0.0, 1e-3))),
        "relative_velocity": sub(_speed(law, b, normal, point), _speed(law, a, normal, point)),
    }
    known = {name: value for name, value in more.items() if name in Contact.__dataclass_fields__}
    return Contact(a, b, normal, point, separation, closing, **known)


def _speed(law: ResponseLaw, ball: PhysicalObject, normal: Any, point: Any) -> Any:
    """Velocity [m/s] of a ball where it touches: its arm is along the normal."""
    if not law.lever_arms or not any(ball.angular_velocity):
        return ball.velocity
    arm = scale(normal, dot(normal, sub(point, ball.position)))
    return add(ball.velocity, cross(ball.angular_velocity, arm))


def _object(law: ResponseLaw, columns: Sequence[str], rng: np.random.Generator, fixed: bool) -> PhysicalObject:
    size = 10.0 ** rng.uniform(-3.0, 3.0)
    motion = (
        {}
        if fixed
        else {
            name: (rng.normal(size=3) * 10.0 ** rng.uniform(-3.0, 3.0)).tolist()
            for name in ("velocity", "angular_velocity")
        }
    )
    found = SampleObject(
        Sphere(float(size)),
        mass=float(10.0 ** rng.uniform(-3.0, 3.0)),
        position=(rng.normal(size=3) * size).tolist(),
        orientation=rng.normal(size=4).tolist(),
        fixed=fixed,
        **motion,
    )
    found.values = {name: _column(law, name, rng) for name in sorted({*columns, *law.columns})}
    return found


def _column(law: ResponseLaw, name: str, rng: np.random.Generator) -> float:
    """A column's default, every third time, or a number that it allows."""
    number = float(rng.normal() * 10.0 ** rng.uniform(-2.0, 2.0))
    if name not in law.columns:
        return number
    column = law.columns[name]
    return column.default if rng.integers(3) == 0 else _within(column.param, number, column.default)


def scratch_of(contact: Contact, columns: Sequence[str]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The contact scratch of `xpheve.kernels.response` for ``contact``."""
    found = np.zeros(layout.SCRATCH)
    found[layout.NORMAL : layout.NORMAL + 3] = contact.normal
    found[layout.POINT : layout.POINT + 3] = contact.point
    found[layout.APPROACH], found[layout.SEPARATION] = contact.approach_speed, contact.separation
    found[layout.TIME : layout.TIME + 2] = getattr(contact, "instant", (0.0, 0.0))
    for start, obj in ((layout.BODY_A, contact.body_a), (layout.BODY_B, contact.body_b)):
        row = [*obj.position, *obj.velocity, *obj.angular_velocity, *obj.orientation, obj.mass]
        row += [
            0.0 if obj.fixed or obj.driven else 1.0 / obj.mass,
            *obj.inertia,
            getattr(obj.shape, "radius", math.nan),
        ]
        found[start : start + len(row)] = row
        found[start + layout.COLUMNS : start + layout.COLUMNS + len(columns)] = [obj[name] for name in columns]
    return found
