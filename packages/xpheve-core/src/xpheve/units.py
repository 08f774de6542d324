"""Units: what a text such as ``"9.81 m/s^2"`` says in SI. Parsed at the edge only; inside, all numbers are SI floats.

An expression is made of unit names, ``1``, ``*``, ``/``, ``^`` or ``**``, parentheses, and spaces for products::

    m/s^2    kg*m/s^2    N m    1/s    kg/(m*s)    km/h    deg    1

``*`` and ``/`` are taken from left to right. A space after a ``/`` (``J/kg K``) can be read in two ways and is refused.

Source: BIPM, The International System of Units, 9th edition (2019): base units, derived units, prefixes and the exact
values of section 2; NIST SP 811 (2008), appendix B, for the foot, the pound and others.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache

from xpheve.errors import UnitError

__all__ = ["Dimension", "check_unit", "dimension", "factor", "name_of", "parse_quantity", "show"]

Dimension = tuple[float, ...]
"""Seven exponents: of kg, m, s, A, K, mol and cd."""

BASE = ("kg", "m", "s", "A", "K", "mol", "cd")
NONE: Dimension = (0, 0, 0, 0, 0, 0, 0)
LONGEST = 100  # characters of an expression; keeps the recursion shallow, and nobody needs more
HIGHEST = 30  # exponent; prefixes reach 1e30, so that no factor leaves the range of a float too soon

PREFIXES = {
    "Q": 30, "R": 27, "Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "da": 1, "d": -1,
    "c": -2, "m": -3, "u": -6, "n": -9, "p": -12, "f": -15, "a": -18, "z": -21, "y": -24, "r": -27, "q": -30,
}  # fmt: skip

# A factor is kept as numerator and denominator, whole numbers where it can be, so that "9 mm" is 0.009 and "36 km/h" is
# 10.0 to the last bit, which 9 * 0.001 is not.
Ratio = tuple[float, float]

# Units that take prefixes: factor to SI, and exponents of kg, m, s, A, K, mol, cd.
PREFIXED: dict[str, tuple[Ratio, Dimension]] = {
    "g": ((1, 1000), (1, 0, 0, 0, 0, 0, 0)),
    "m": ((1, 1), (0, 1, 0, 0, 0, 0, 0)),
    "s": ((1, 1), (0, 0, 1, 0, 0, 0, 0)),
    "A": ((1, 1), (0, 0, 0, 1, 0, 0, 0)),
    "K": ((1, 1), (0, 0, 0, 0, 1, 0, 0)),
    "mol": ((1, 1), (0, 0, 0, 0, 0, 1, 0)),
    "cd": ((1, 1), (0, 0, 0, 0, 0, 0, 1)),
    "rad": ((1, 1), NONE),
    "sr": ((1, 1), NONE),
    "Hz": ((1, 1), (0, 0, -1, 0, 0, 0, 0)),
    "Bq": ((1, 1), (0, 0, -1, 0, 0, 0, 0)),
    "N": ((1, 1), (1, 1, -2, 0, 0, 0, 0)),
    "Pa": ((1, 1), (1, -1, -2, 0, 0, 0, 0)),
    "bar": ((100000, 1), (1, -1, -2, 0, 0, 0, 0)),
    "J": ((1, 1), (1, 2, -2, 0, 0, 0, 0)),
    "eV": ((1.602176634e-19, 1), (1, 2, -2, 0, 0, 0, 0)),
    "cal": ((4184, 1000), (1, 2, -2, 0, 0, 0, 0)),
    "Wh": ((3600, 1), (1, 2, -2, 0, 0, 0, 0)),
    "W": ((1, 1), (1, 2, -3, 0, 0, 0, 0)),
    "C": ((1, 1), (0, 0, 1, 1, 0, 0, 0)),
    "V": ((1, 1), (1, 2, -3, -1, 0, 0, 0)),
    "F": ((1, 1), (-1, -2, 4, 2, 0, 0, 0)),
    "ohm": ((1, 1), (1, 2, -3, -2, 0, 0, 0)),
    "S": ((1, 1), (-1, -2, 3, 2, 0, 0, 0)),
    "Wb": ((1, 1), (1, 2, -2, -1, 0, 0, 0)),
    "T": ((1, 1), (1, 0, -2, -1, 0, 0, 0)),
    "H": ((1, 1), (1, 2, -2, -2, 0, 0, 0)),
    "lm": ((1, 1), (0, 0, 0, 0, 0, 0, 1)),
    "lx": ((1, 1), (0, -2, 0, 0, 0, 0, 1)),
    "L": ((1, 1000), (0, 3, 0, 0, 0, 0, 0)),
    "l": ((1, 1000), (0, 3, 0, 0, 0, 0, 0)),
    "P": ((1, 10), (1, -1, -1, 0, 0, 0, 0)),
}  # fmt: skip

LENGTH, MASS, TIME = PREFIXED["m"][1], PREFIXED["g"][1], PREFIXED["s"][1]

# Units that take no prefix.
PLAIN: dict[str, tuple[Ratio, Dimension]] = {
    "1": ((1, 1), NONE),
    "%": ((1, 100), NONE),
    "deg": ((math.pi, 180), NONE),
    "arcmin": ((math.pi, 10800), NONE),
    "arcsec": ((math.pi, 648000), NONE),
    "rev": ((2 * math.pi, 1), NONE),
    "turn": ((2 * math.pi, 1), NONE),
    "rpm": ((math.pi, 30), PREFIXED["Hz"][1]),
    "min": ((60, 1), TIME),
    "h": ((3600, 1), TIME),
    "d": ((86400, 1), TIME),
    "day": ((86400, 1), TIME),
    "yr": ((31557600, 1), TIME),
    "t": ((1000, 1), MASS),
    "u": ((1.66053906892e-27, 1), MASS),
    "lb": ((45359237, 10**8), MASS),
    "oz": ((28349523125, 10**12), MASS),
    "slug": ((14.593902937206364, 1), MASS),
    "in": ((254, 10**4), LENGTH),
    "ft": ((3048, 10**4), LENGTH),
    "yd": ((9144, 10**4), LENGTH),
    "mi": ((1609344, 1000), LENGTH),
    "nmi": ((1852, 1), LENGTH),
    "angstrom": ((1, 10**10), LENGTH),
    "au": ((149597870700, 1), LENGTH),
    "ly": ((9460730472580800, 1), LENGTH),
    "pc": ((149597870700 * 648000, math.pi), LENGTH),
    "mph": ((44704, 10**5), (0, 1, -1, 0, 0, 0, 0)),
    "knot": ((1852, 3600), (0, 1, -1, 0, 0, 0, 0)),
    "ha": ((10000, 1), (0, 2, 0, 0, 0, 0, 0)),
    "g0": ((980665, 10**5), (0, 1, -2, 0, 0, 0, 0)),
    "lbf": ((4.4482216152605, 1), PREFIXED["N"][1]),
    "kgf": ((980665, 10**5), PREFIXED["N"][1]),
    "dyn": ((1, 10**5), PREFIXED["N"][1]),
    "atm": ((101325, 1), PREFIXED["Pa"][1]),
    "Torr": ((101325, 760), PREFIXED["Pa"][1]),
    "psi": ((6894.757293168361, 1), PREFIXED["Pa"][1]),
    "erg": ((1, 10**7), PREFIXED["J"][1]),
    "hp": ((745.6998715822702, 1), PREFIXED["W"][1]),
    "G": ((1, 10**4), PREFIXED["T"][1]),
}  # fmt: skip

# Other spellings; the texts are replaced before anything is parsed.
SPELLINGS = {"\u00b5": "u", "\u03bc": "u", "\u2126": "ohm", "\u03a9": "ohm", "Ohm": "ohm", "\u00b0": "deg",
             "\u00b7": "*", "\u22c5": "*", "\u00d7": "*", "\u2212": "-", "\u00a0": " ",
             "\u207b": "^-", "\u00b9": "^1", "\u00b2": "^2", "\u00b3": "^3", "\u2074": "^4"}  # fmt: skip

# What dimensions are called, for messages.
NAMES: dict[Dimension, str] = {
    NONE: "a pure number",
    (1, 0, 0, 0, 0, 0, 0): "mass",
    (0, 1, 0, 0, 0, 0, 0): "length",
    (0, 0, 1, 0, 0, 0, 0): "time",
    (0, 0, 0, 1, 0, 0, 0): "current",
    (0, 0, 0, 0, 1, 0, 0): "temperature",
    (0, 2, 0, 0, 0, 0, 0): "area",
    (0, 3, 0, 0, 0, 0, 0): "volume",
    (0, 1, -1, 0, 0, 0, 0): "speed",
    (0, 1, -2, 0, 0, 0, 0): "acceleration",
    (0, 0, -1, 0, 0, 0, 0): "frequency or angular speed",
    (1, -3, 0, 0, 0, 0, 0): "density",
    (1, 2, 0, 0, 0, 0, 0): "moment of inertia",
    (1, 1, -1, 0, 0, 0, 0): "momentum or impulse",
    (1, 1, -2, 0, 0, 0, 0): "force",
    (1, 2, -1, 0, 0, 0, 0): "angular momentum",
    (1, 2, -2, 0, 0, 0, 0): "energy or torque",
    (1, 2, -3, 0, 0, 0, 0): "power",
    (1, -1, -2, 0, 0, 0, 0): "pressure",
    (1, 0, -2, 0, 0, 0, 0): "stiffness",
    (1, 0, -1, 0, 0, 0, 0): "damping",
    (1, -1, -1, 0, 0, 0, 0): "viscosity",
    (0, 0, 1, 1, 0, 0, 0): "charge",
    (1, 2, -3, -1, 0, 0, 0): "voltage",
    (1, 0, -2, -1, 0, 0, 0): "magnetic field",
}


def dimension(unit: str) -> Dimension:
    """Return the exponents of kg, m, s, A, K, mol and cd in ``unit``. Raises `UnitError`."""
    return parse(unit)[2]


def factor(unit: str) -> float:
    """Return what one ``unit`` is in SI. Raises `UnitError`."""
    above, below, _ = parse(unit)
    return above / below


def check_unit(unit: str) -> None:
    """Raise `UnitError` unless SI numbers can be stated in ``unit``: in ``"rad"`` they can, in ``"deg"`` not."""
    above, below, dim = parse(unit)
    if above != below:
        raise UnitError(f'unit "{unit}" is not SI: one is {above / below:g} {show(dim)}. Declare {show(dim)}')


def show(dim: Dimension) -> str:
    """Return ``dim`` in base units, such as ``"kg*m/s^2"``; ``"1"`` for a pure number."""
    above = [_power(base, exponent) for base, exponent in zip(BASE, dim, strict=True) if exponent > 0]
    below = [_power(base, -exponent) for base, exponent in zip(BASE, dim, strict=True) if exponent < 0]
    text = "*".join(above) or "1"
    if len(below) > 1:
        return f"{text}/({'*'.join(below)})"
    return f"{text}/{below[0]}" if below else text


def name_of(dim: Dimension) -> str:
    """Return what quantities of ``dim`` are called, such as ``"force"``; empty if they have no common name."""
    return NAMES.get(dim, "")


def parse_quantity(text: str, unit: str, where: str = "") -> float:
    """Return the number of ``unit`` that ``text`` states, as ``"9.81 m/s^2"``, ``"1 km"`` or plain ``"9.81"``.

    Parameters
    ----------
    text
        A number, and perhaps a unit; without one, ``unit`` is meant.
    unit
        Wanted; SI, such as ``"m/s^2"``.
    where
        What is being set, for the error's text.

    Raises
    ------
    UnitError
        If the text is no number with a unit, or its unit is of another dimension.

    """
    lead = f"{where} = " if where else ""
    shown = text if len(text) <= LONGEST else text[:LONGEST] + "..."
    number, given = _split(text)
    if not number:
        needed = "a number" if unit == "1" else f'a number with a unit, such as "1 {unit}",'
        raise UnitError(f'{lead}"{shown}": {needed} is needed')
    value = float(number)
    beyond = UnitError(f'{lead}"{shown}": the number is beyond the range of a float')
    if not math.isfinite(value):
        raise beyond
    if not given:
        return value
    try:
        above, below, dim = parse(given)
    except UnitError as wrong:
        raise UnitError(f'{lead}"{shown}": {wrong}') from None
    wanted_above, wanted_below, wanted = parse(unit)
    if dim != wanted:
        needed, meant = ("a pure number", number) if unit == "1" else (unit, f"{number} {unit}")
        raise UnitError(f'{lead}"{shown}": unit {_describe(given, dim)}, needs {needed}. Did you mean {meant}?')
    value = value * above / below * wanted_below / wanted_above
    if not math.isfinite(value):
        raise beyond
    return value


def _describe(unit: str, dim: Dimension) -> str:
    """Return what ``unit`` is, such as ``N is kg*m/s^2 (force)``."""
    base, name = show(dim), name_of(dim)
    if base == unit:
        return f"{unit} is {name}" if name else unit
    return f"{unit} is {base} ({name})" if name else f"{unit} is {base}"


@lru_cache(maxsize=1024)
def parse(unit: str) -> tuple[float, float, Dimension]:
    """Return numerator and denominator of the factor to SI, and the dimension of ``unit``. Raises `UnitError`."""
    if not isinstance(unit, str) or not unit.strip():
        raise UnitError(f'{unit!r} is no unit; write "1" for a pure number')
    if len(unit) > LONGEST:
        raise UnitError(f'"{unit[:20]}..." is no unit: it has {len(unit)} characters, {LONGEST} are allowed')
    if unit in ("degC", "degF", "\u00b0C", "\u00b0F", "\u2103", "\u2109", "celsius", "fahrenheit"):
        raise UnitError(f'"{unit}" counts from another zero, which a factor cannot say; give kelvin (K)')
    try:
        (above, below), dim = _Parser(unit).whole()
        above, below = float(above), float(below)
    except OverflowError:
        above = below = math.inf
    if not (0 < above < math.inf and 0 < below < math.inf and 0 < above / below < math.inf):
        raise UnitError(f'"{unit}" is beyond the range of a float')
    return above, below, dim


class _Parser:
    """Reads one expression by recursive descent: product = power (("*" | "/" | space) power)*."""

    def __init__(self, unit: str) -> None:
        self.unit = unit
        text = unit
        for other, ours in SPELLINGS.items():
            text = text.replace(other, ours)
        self.tokens = _tokens(text.replace("^-^", "^-"), unit)
        self.at = 0

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self) -> str:
        token = self.peek()
        self.at += 1
        return token

    def whole(self) -> tuple[Ratio, Dimension]:
        scale, dim = self.product()
        if self.peek():
            raise UnitError(f'"{self.unit}" is no unit: "{self.peek()}" is not expected there')
        return scale, tuple(int(e) if e == int(e) else e for e in dim)

    def product(self) -> tuple[Ratio, Dimension]:
        (above, below), dim = self.power()
        divided = False
        while self.peek() and self.peek() != ")":
            sign = 1
            if self.peek() in "*/":
                sign = -1 if self.take() == "/" else 1
                divided = divided or sign < 0
            elif divided:
                raise UnitError(
                    f'"{self.unit}" can be read in two ways; write a/(b*c), or a/b*c, instead of a space after "/"'
                )
            (one_above, one_below), one = self.power()
            if sign < 0:
                one_above, one_below = one_below, one_above
            above, below = above * one_above, below * one_below
            dim = tuple(a + sign * b for a, b in zip(dim, one, strict=True))
        return (above, below), dim

    def power(self) -> tuple[Ratio, Dimension]:
        (above, below), dim = self.atom()
        if self.peek() != "^":
            return (above, below), dim
        self.take()
        exponent = self.exponent()
        if exponent < 0:
            above, below = below, above
        size = int(abs(exponent)) if exponent == int(exponent) else abs(exponent)
        return (above**size, below**size), tuple(round(e * exponent, 9) for e in dim)

    def exponent(self) -> float:
        if self.peek() != "(":
            value = self.number()
        else:
            self.take()
            value = self.number()
            if self.peek() == "/":
                self.take()
                below = self.number()
                if below == 0:
                    raise UnitError(f'"{self.unit}" is no unit: an exponent is divided by 0')
                value /= below
            if self.take() != ")":
                raise UnitError(f'"{self.unit}" is no unit: a ")" is missing')
        if not abs(value) <= HIGHEST:  # NaN too
            raise UnitError(f'"{self.unit}" is no unit: exponents go to {HIGHEST}')
        return value

    def number(self) -> float:
        token = self.take()
        sign = 1
        if token in ("+", "-"):
            sign = -1 if token == "-" else 1
            token = self.take()
        try:
            return sign * float(token)
        except ValueError:
            raise UnitError(f'"{self.unit}" is no unit: a number is needed after "^"') from None

    def atom(self) -> tuple[Ratio, Dimension]:
        token = self.take()
        if token == "(":
            inner = self.product()
            if self.take() != ")":
                raise UnitError(f'"{self.unit}" is no unit: a ")" is missing')
            return inner
        if not token:
            raise UnitError(f'"{self.unit}" is no unit: it ends too soon')
        found = PLAIN.get(token) or PREFIXED.get(token) or _with_prefix(token)
        if found is None:
            raise UnitError(f'"{token}" is no unit.{_hint(token)}')
        return found


def _with_prefix(token: str) -> tuple[Ratio, Dimension] | None:
    for length in (2, 1):
        prefix, rest = token[:length], token[length:]
        if prefix in PREFIXES and rest in PREFIXED:
            (above, below), dim = PREFIXED[rest]
            ten = PREFIXES[prefix]
            return (above * 10 ** max(ten, 0), below * 10 ** max(-ten, 0)), dim
    return None


def _tokens(text: str, unit: str) -> list[str]:
    """Return the names, numbers and operators of ``text``; a space is a product unless an operator stands beside it."""
    tokens: list[str] = []
    at = 0
    while at < len(text):
        char = text[at]
        if char.isspace():
            at += 1
        elif text.startswith("**", at):
            tokens.append("^")
            at += 2
        elif char in "*/^()+-%":
            tokens.append(char)
            at += 1
        elif char.isalnum() or char == "." or char == "_":
            end = at + 1
            numeric = char.isdigit() or char == "."
            while end < len(text) and (text[end].isdigit() or (text[end] == "." if numeric else text[end].isalpha())):
                end += 1
            tokens.append(text[at:end])
            at = end
        else:
            raise UnitError(f'"{unit}" is no unit: "{char}" is not expected there')
    return tokens


def _split(text: str) -> tuple[str, str]:
    """Return the number at the start of ``text`` and what follows it; the number is empty if there is none."""
    text = text.strip().replace("\u2212", "-")
    end = 0
    for stop in range(min(len(text), LONGEST), 0, -1):
        head = text[:stop].rstrip()
        if head[-1:].isdigit() or head.endswith("."):
            try:
                float(head)
            except ValueError:
                continue
            end = stop
            break
    rest = text[end:].strip()
    if not end or rest[:1] in ("*", "/", "^", "+", "-", "_") or (rest[:1].isdigit() and not rest.startswith("1/")):
        return ("", "")
    return text[:end].strip(), rest


def _power(base: str, exponent: float) -> str:
    if exponent == 1:
        return base
    return f"{base}^{exponent:g}" if exponent == int(exponent) else f"{base}^({exponent:g})"


def _known(token: str) -> bool:
    return bool(PLAIN.get(token) or PREFIXED.get(token) or _with_prefix(token))


def _hint(token: str) -> str:
    if token == "-":
        return " A negative power is written m^-1, or with /."
    power = re.fullmatch(r"([^\W\d_]+)(\d)", token)
    if power and _known(power[1]):
        return f' Did you mean "{power[1]}^{power[2]}"?'
    names = [*PREFIXED, *PLAIN, "kg", "km", "cm", "mm", "ms", "us", "kN", "kPa", "MPa", "GPa", "kW", "kJ", "mT"]
    for name in names:
        if name.casefold() == token.casefold():
            return f' Did you mean "{name}"?'
    for words, name in (
        (("sec", "secs", "second", "seconds", "sek"), "s"), (("meter", "metre", "meters", "metres"), "m"),
        (("newton", "newtons"), "N"), (("kilogram", "kilograms", "kilo"), "kg"), (("degree", "degrees"), "deg"),
        (("radian", "radians"), "rad"), (("hour", "hours", "hr"), "h"), (("minute", "minutes"), "min"),
        (("joule", "joules"), "J"), (("watt", "watts"), "W"), (("pascal",), "Pa"), (("coulomb",), "C"),
        (("kmh", "kph"), "km/h"), (("hertz",), "Hz"), (("volt", "volts"), "V"), (("tesla",), "T"),
        (("kelvin",), "K"), (("ampere", "amp", "amps"), "A"), (("gram", "grams"), "g"), (("litre", "liter"), "L"),
    ):  # fmt: skip
        if token.casefold() in words:
            return f' Did you mean "{name}"?'
    for at in range(1, len(token)):
        if len(token) < 4 and _known(token[:at]) and _known(token[at:]):
            return f' Did you mean "{token[:at]}*{token[at:]}"?'
    from xpheve.plugins.suggest import did_you_mean

    return did_you_mean(token, names)
