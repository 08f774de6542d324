"""What every wakeup condition is."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

from xpheve.errors import InvalidValueError

if TYPE_CHECKING:
    from xpheve.laws.combinations import AllOf, AnyOf, Not


@dataclass(frozen=True)
class Condition:
    """What every wakeup condition is; with ``once`` it fires at its first event only, until a `reset`."""

    once: bool = field(default=False, kw_only=True)

    served_by: ClassVar[str] = "engine"
    """``"engine"``, ``"queue"``, ``"steps"``, ``"contacts"`` or ``"flights"``: who finds its events."""
    depth: ClassVar[int] = 0
    """How many combinations are in one another."""
    original: ClassVar[str] = "-"
    """The criterion of Java3D that it stands for."""
    difference: ClassVar[str] = ""
    """What is other than there."""

    @property
    def is_level(self) -> bool:
        """Whether it holds for a while, rather than at instants."""
        return False

    def __bool__(self) -> bool:
        """Refused: `and`, `or` and `not` would ask for it, and leave one of two conditions out without a word."""
        raise InvalidValueError(
            f"{self} is neither true nor false by itself: combine conditions with a & b, a | b, ~a (not and, or, not); "
            "whether there is one is asked with `is None`"
        )

    def __or__(self, other: Any) -> AnyOf:
        from xpheve.laws.combinations import AnyOf, joined

        return joined(AnyOf, self, other)  # type: ignore[no-any-return]

    def __and__(self, other: Any) -> AllOf:
        from xpheve.laws.combinations import AllOf, joined

        return joined(AllOf, self, other)  # type: ignore[no-any-return]

    def __invert__(self) -> Not:
        from xpheve.laws.combinations import Not

        return Not(self)

    def __str__(self) -> str:
        shown = [
            f"{f.name}={getattr(self, f.name)!r}"
            for f in fields(self)
            if getattr(self, f.name) not in (f.default, None)
        ]
        return f"{type(self).__name__}({', '.join(shown)})"


def check_object(condition: Condition, name: str) -> None:
    """Raise unless field ``name`` is None or an object."""
    from xpheve.objects import PhysicalObject

    value = getattr(condition, name)
    if value is not None and not isinstance(value, PhysicalObject):
        raise InvalidValueError(f"{type(condition).__name__}({name}={value!r}): a PhysicalObject, or None, is needed")


def check_law(condition: Any) -> None:
    """Raise unless ``law`` is None, a law, or a name."""
    from xpheve.laws.law import PhysicalLaw

    if condition.law is not None and not isinstance(condition.law, (PhysicalLaw, str)):
        raise InvalidValueError(
            f"{type(condition).__name__}(law={condition.law!r}): a law, its name, or None, is needed"
        )


__all__ = ["Condition", "check_law", "check_object"]
