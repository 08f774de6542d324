"""Units: what a text says in SI, and what it says about texts that say nothing."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.errors import UnitError
from xpheve.laws import FieldLaw, Param
from xpheve.units import BASE, PLAIN, PREFIXED, check_unit, dimension, factor, name_of, parse_quantity, show

NEWTON = (1, 1, -2, 0, 0, 0, 0)


@pytest.mark.parametrize(
    "unit",
    ["N", "kg*m/s^2", "kg m s^-2", "kg*m/s**2", "kg·m/s²", "kg*m/(s*s)", "kg*m/s/s", "J/m", "Pa*m^2", "W*s/m", "(N)",
     " N ", "C*V/m", "T*A*m", "A*Wb/m", "N*rad", "N*1"],
)  # fmt: skip
def test_a_newton_may_be_written_in_many_ways(unit: str) -> None:
    assert dimension(unit) == NEWTON
    assert factor(unit) == 1.0


@pytest.mark.parametrize(
    ("unit", "si"),
    [("km", 1000.0), ("ms", 0.001), ("min", 60.0), ("h", 3600.0), ("g", 0.001), ("kg", 1.0), ("mg", 1e-6), ("t", 1e3),
     ("deg", math.pi / 180), ("rpm", math.pi / 30), ("km/h", 1 / 3.6), ("cm^3", 1e-6), ("mm^2", 1e-6), ("L", 1e-3),
     ("kWh", 3.6e6), ("bar", 1e5), ("hPa", 100.0), ("daN", 10.0), ("g0", 9.80665), ("in", 0.0254), ("mi", 1609.344),
     ("µs", 1e-6), ("GPa", 1e9), ("%", 0.01), ("1", 1.0), ("rad", 1.0), ("min^-1", 1 / 60), ("1/min", 1 / 60)],
)  # fmt: skip
def test_factors_to_si_are_exact_to_the_last_bit(unit: str, si: float) -> None:
    assert factor(unit) == si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("9.81 m/s^2", "m/s^2", 9.81), ("9.81", "m/s^2", 9.81), ("1 km", "m", 1000.0), ("5km", "m", 5000.0),
     ("-1e3 g", "kg", -1.0), (".5 m", "m", 0.5), ("5. m", "m", 5.0), ("+5 m", "m", 5.0), ("9 mm", "m", 0.009),
     ("36 km/h", "m/s", 10.0), ("180 deg", "rad", math.pi), ("90 deg", "1", math.pi / 2), ("5 1/s", "Hz", 5.0),
     ("1e3", "1", 1000.0), ("1e3m", "m", 1000.0), ("\u22125 m", "m", -5.0), ("50 %", "1", 0.5), (" 2  N ", "N", 2.0)],
)  # fmt: skip
def test_a_quantity_is_read_as_it_is_written(text: str, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == value


@pytest.mark.parametrize(
    "text",
    ["", " ", "m", "abc", "nan", "inf m", "5 10 m", "1/2 m", "3 + 2 m", "5 $", "5 m)", "5 (m", "5 m^", "5 m^99", "5 m/",
     "5 m^x", "5 m^nan", "5 m^(1/0)", "5 *m", "1e999 m", "1e300 Qm", "5 Qm^30", "5 m" + "*m" * 90, "5 " + "(" * 500,
     "0x10 m", "5 kg/m s", "5 N", "20 degC", "5 m m", "5 \0", "5 m;import os", "9" * 5000 + "x"],
)  # fmt: skip
def test_what_is_no_length_is_refused_with_the_text_and_the_place(text: str) -> None:
    with pytest.raises(UnitError, match=r"^toys:ball\.radius = "):
        parse_quantity(text, "m", "toys:ball.radius")


def test_a_wrong_unit_names_both_and_the_way_out() -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity("0.1 N", "kg/m", "aero:quadratic_drag.c")
    assert str(caught.value) == (
        'aero:quadratic_drag.c = "0.1 N": unit N is kg*m/s^2 (force), needs kg/m. Did you mean 0.1 kg/m?'
    )


@pytest.mark.parametrize(
    ("text", "hint"),
    [("9.81 m/sek^2", '"sek" is no unit. Did you mean "s"?'), ("50 kmh", 'Did you mean "km/h"?'),
     ("5 n", 'Did you mean "N"?'), ("5 Newton", 'Did you mean "N"?'), ("5 m", "needs a pure number. Did you mean 5?"),
     ("20 degC", "give kelvin (K)"), ("1 J/kg K", "can be read in two ways; write a/(b*c), or a/b*c")],
)  # fmt: skip
def test_a_slip_of_the_pen_gets_a_hint(text: str, hint: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity(text, "1")
    assert hint in str(caught.value)


def test_a_parameter_takes_text_with_a_unit_and_stays_si() -> None:
    class Fall(FieldLaw):
        g = Param(9.81, unit="m/s^2", gt=0)

    assert Fall(g="981 cm/s^2").g == 9.81
    with pytest.raises(UnitError, match=r"Fall\.g = .*kg\*m/s\^2 \(force\), needs m/s\^2"):
        Fall(g="9.81 N")


def test_units_of_declarations_are_si() -> None:
    for unit in ("1", "m", "rad", "kg/m^3", "N*s", "V/m"):
        check_unit(unit)
    with pytest.raises(UnitError, match=r'unit "km/h" is not SI: one is 0\.277778 m/s\. Declare m/s'):
        check_unit("km/h")


def test_no_name_stands_for_two_units() -> None:
    assert not set(PLAIN) & set(PREFIXED)
    assert all(len(dim) == len(BASE) for _, dim in (*PLAIN.values(), *PREFIXED.values()))


@given(st.tuples(*[st.integers(-5, 5) for _ in BASE]))
def test_what_is_shown_of_a_dimension_reads_back_as_it(dim: tuple[int, ...]) -> None:
    assert dimension(show(dim)) == dim
    assert factor(show(dim)) == 1.0


@given(st.text(max_size=30))
def test_any_text_is_a_unit_or_a_unit_error(text: str) -> None:
    try:
        assert 0 < factor(text) < math.inf
        assert isinstance(name_of(dimension(text)), str)
    except UnitError:
        pass


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_without_a_unit_is_taken_as_it_is(value: float) -> None:
    assert parse_quantity(repr(value), "m") == value
    assert parse_quantity(f"{value!r} m", "m") == value
