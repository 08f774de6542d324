"""Parameters of laws: declared with default, unit, bounds and doc; checked whenever they are set."""

from __future__ import annotations

import math
from typing import Any

from xpheve.errors import LawDefinitionError, ParameterError


class Param:
    """A parameter of a law, declared in the class body.

    Parameters
    ----------
    default
        A float, an int, a bool, a string (with ``choices``), a tuple of floats (a vector), or None
        for "not given", which an ``optional`` parameter may be.
    unit
        Of the SI value, such as ``"m/s^2"``; ``"1"`` for pure numbers.
    gt, ge, lt, le
        Bounds, in the SI unit, for each component.
    choices
        The strings that are allowed.
    size
        Components of a vector whose default is None.
    doc
        One sentence for people.

    Raises
    ------
    LawDefinitionError
        If the declaration contradicts itself.
    """

    def __init__(
        self,
        default: Any,
        *,
        unit: str = "1",
        gt: float | None = None,
        ge: float | None = None,
        lt: float | None = None,
        le: float | None = None,
        choices: tuple[str, ...] = (),
        optional: bool = False,
        size: int = 0,
        doc: str = "",
    ) -> None:
        self.name = ""
        self.owner = ""
        self.unit = unit
        self.gt, self.ge, self.lt, self.le = gt, ge, lt, le
        self.choices = choices
        self.optional = optional or default is None
        self.size = len(default) if isinstance(default, (tuple, list)) else size
        self.doc = doc
        self.default = tuple(map(float, default)) if isinstance(default, (tuple, list)) else default
        if isinstance(default, str) and not choices and unit != "1":
            raise LawDefinitionError(
                f"default {default!r} is text: give the number in {unit}, as in Param(1.0, unit={unit!r})"
            )
        if choices and default not in choices and default is not None:
            raise LawDefinitionError(f"default {default!r} is none of the choices {choices}")

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        self.owner = getattr(owner, "id", "") or owner.__name__

    def __get__(self, law: Any, owner: type | None = None) -> Any:
        if law is None:
            return self
        return law.parameters[self.name]

    def __set__(self, law: Any, value: Any) -> None:
        law.set_parameter(self.name, value)

    @property
    def kind(self) -> str:
        """``"vector"``, ``"text"``, ``"switch"``, ``"integer"`` or ``"number"``."""
        if self.size:
            return "vector"
        if self.choices or isinstance(self.default, str):
            return "text"
        if isinstance(self.default, bool):
            return "switch"
        return "number"

    def check(self, value: Any, owner: str = "") -> Any:
        """``value`` as the parameter keeps it: SI floats, tuples, text.

        Raises
        ------
        ParameterError
            If the value is of the wrong kind, unit, shape, not finite or out of bounds.
        """
        where = f"{owner or self.owner}.{self.name}"
        if value is None:
            if self.optional:
                return None
            raise ParameterError(f"{where}: a value is needed; leave it out to get {self.default!r}")
        if self.kind == "text":
            return self._check_text(value, where)
        if self.kind == "switch":
            if isinstance(value, bool):
                return value
            raise ParameterError(f"{where} = {value!r}: give True or False")
        if self.kind == "vector":
            return self._check_vector(value, where)
        return self._check_number(value, where)

    def _check_text(self, value: Any, where: str) -> str:
        if not isinstance(value, str):
            raise ParameterError(f"{where} = {value!r}: a text is needed")
        if self.choices and value not in self.choices:
            from xpheve.plugins.suggest import did_you_mean

            hint = did_you_mean(value, self.choices)
            raise ParameterError(f"{where} = {value!r}: choose one of {', '.join(self.choices)}.{hint}")
        return value

    def _check_vector(self, value: Any, where: str) -> tuple[float, ...]:
        if isinstance(value, str) or not hasattr(value, "__len__") or len(value) != self.size:
            raise ParameterError(f"{where} = {value!r}: {self.size} numbers are needed")
        return tuple(self._check_number(component, where) for component in value)

    def _check_number(self, value: Any, where: str) -> float:
        if isinstance(value, str):
            from xpheve.units import parse_quantity

            value = parse_quantity(value, self.unit, where)
        if isinstance(value, bool):
            raise ParameterError(f"{where} = {value!r}: a number is needed")
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise ParameterError(f"{where} = {value!r}: a number in {self.unit} is needed") from None
        if not math.isfinite(number):
            raise ParameterError(f"{where} = {number}: a finite number in {self.unit} is needed")
        for bound, holds, sign in (
            (self.gt, self.gt is None or number > self.gt, ">"),
            (self.ge, self.ge is None or number >= self.ge, ">="),
            (self.lt, self.lt is None or number < self.lt, "<"),
            (self.le, self.le is None or number <= self.le, "<="),
        ):
            if not holds:
                unit = "" if self.unit == "1" else f" {self.unit}"
                raise ParameterError(f"{where} = {number!r}{unit}: must be {sign} {bound}")
        return number


class Column:
    """A column that a law adds to objects, such as ``charge``.

    Parameters
    ----------
    default
        Value [unit] of objects that are not given one; ``math.nan`` marks "not given".
    unit, gt, ge, lt, le, doc
        As in `Param`.
    whole
        Whether it takes whole numbers only, such as bits.
    """

    def __init__(
        self, default: float = 0.0, *, unit: str = "1", doc: str = "", whole: bool = False, **bounds: float | None
    ) -> None:
        self.default = float(default)
        self.unit = unit
        self.doc = doc
        self.whole = whole
        self.param = Param(0.0, unit=unit, doc=doc, **bounds)  # type: ignore[arg-type]

    def check(self, value: Any, owner: str, name: str) -> float:
        """``value`` as a float in SI; raises `ParameterError` as `Param.check` does."""
        self.param.name = name
        checked = float(self.param.check(value, owner))
        if self.whole and not checked.is_integer():
            raise ParameterError(f"{owner}.{name} = {checked!r}: a whole number is needed")
        return checked


class Constant:
    """A number, or a vector, of a law's class that never changes: a constant of nature, or of the method.

    It stands in the compiled text of the law as it is; what users may set is a `Param`.

    Parameters
    ----------
    value
        A number, text with a unit such as ``"1 mm"``, or a tuple of them (a vector).
    unit
        Of the SI value, such as ``"m"``; ``"1"`` for pure numbers.
    doc
        One sentence for people.

    Raises
    ------
    LawDefinitionError
        If the value is none.
    """

    def __init__(self, value: Any, unit: str = "1", doc: str = "") -> None:
        vector = isinstance(value, (tuple, list))
        checker = Param(tuple(0.0 for _ in value) if vector else 0.0, unit=unit)
        checker.name, checker.owner = repr(value), "Constant"
        try:
            self.value: float | tuple[float, ...] = checker.check(tuple(value) if vector else value)
        except ParameterError as wrong:
            raise LawDefinitionError(str(wrong)) from None
        self.name = ""
        self.unit = unit
        self.doc = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, law: Any, owner: type | None = None) -> Any:
        if law is None or not isinstance(self.value, tuple):
            return self if law is None else self.value
        import numpy as np

        from xpheve.laws.view import Batch

        array = np.array(self.value).view(Batch)
        array.flags.writeable = False
        return array

    def __set__(self, law: Any, value: Any) -> None:
        raise ParameterError(
            f"{law.label()}.{self.name} = {value!r}: it is a constant of the class; a Param can be set"
        )
