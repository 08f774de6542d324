"""Thesis 5.3: each law of the library says its complexity, and its benefits and drawbacks beside similar laws."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest

import xpheve_laws_basic as basic
from xpheve.units import check_unit

LAWS = [getattr(basic, name) for name in basic.__all__]
each_law = pytest.mark.parametrize("law", LAWS, ids=[law.id for law in LAWS])


@each_law
def test_5_3_a_law_says_range_units_complexity_benefits_and_drawbacks(law: Any) -> None:
    text = inspect.getdoc(law) or ""
    for part in ("Holds ", "Benefits and drawbacks:", "Units:", "Cost:", "O(n", "Accuracy:", "Source:"):
        assert part in text, f"{law.id}: say {part!r}"


@each_law
def test_5_3_a_law_is_compared_with_laws_that_exist(law: Any) -> None:
    known = {other.id for other in LAWS}
    named = set(re.findall(r"``(basic:\w+)``", inspect.getdoc(law) or ""))
    assert named <= known
    assert law.id in ("basic:thrust", "basic:rotating_frame") or named - {law.id}, "name a similar law"


@each_law
def test_units_are_si_and_a_text_with_a_unit_is_read(law: Any) -> None:
    made = law()
    for name, param in law.params.items():
        check_unit(param.unit)
        if param.unit == "1":
            continue
        text = f"2 {param.unit}"
        setattr(made, name, (text,) * param.size if param.size else text)
        assert getattr(made, name) == ((2.0,) * param.size if param.size else 2.0)
    for column in law.columns.values():
        check_unit(column.unit)
