"""Units as they are written, read by a grammar of their own; pint knows what each name means.

    unit      =  factor { [ "*" | "." | "·" | blank | "/" ] factor }       from left to right: N m/rad s = N m s/rad
    factor    =  ( name | "1" | "(" unit ")" ) [ power ]
    power     =  exponent  |  ( "^" | "**" ) ( exponent | "(" exponent ")" )
    exponent  =  [ "+" | "-" ] digits [ "." digits ] [ "/" digits ]        a quotient in brackets only

pint itself would evaluate what it is given: 9**9**9 has no end.
"""

import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import sealed_text
from fmu_models.base.version import version_of

if TYPE_CHECKING:
    import pint
    from pint.facets.plain import PlainQuantity, PlainUnit

LONGEST = 100  # characters
LARGEST_POWER = 12
DEEPEST = 8  # brackets in brackets

_TOKEN = re.compile(
    r"\s*(?:(?P<name>°?[^\W\d]+|°|%)|(?P<power>\*\*|\^)|(?P<number>\d+(?:\.\d+)?)|(?P<sign>[-+])|(?P<mark>[*./·()]))"
)
# what pint does not take as a name; U/min on German recorders is turns, where pint means units of an enzyme
_NAMES = {"%": "percent", "°": "degree", "°C": "degC", "°F": "degF", "U": "turn"}

_TEMPERATURE = re.compile(r"(?:°|deg(?:rees?)?_?)? ?([CF])(?:elsius|ahrenheit)?", re.IGNORECASE)
_SCALES = {"c": (1.0, 273.15), "f": (5 / 9, 459.67 * 5 / 9)}  # kelvin of one degree, and at zero

# how to state an angle or its rate: 1/min, Hz and 1 may count turns as well as radians
_ANGLES = {"rad": "rad, deg or turn", "rad/s": "rad/s, deg/s, turn/s or rpm"}
_DEGREE_OR_GON = re.compile(r"\b[gG]rad\b")


@lru_cache(maxsize=1024)
def parse_unit(unit: str) -> "PlainQuantity[float]":
    """A unit such as "N m/rad", "kg.m2", "m/s^2" or "1/min" as a pint quantity of one of it.

    Raises:
        ValueError: it is none; says what is wrong in it.
    """
    if len(unit) > LONGEST:
        raise ValueError(f"a unit has at most {LONGEST} characters, found {len(unit)}")
    return _Reader(unit).read()


class OtherDimensionError(ValueError):
    """Two units of which none is a multiple of the other."""


@dataclass(frozen=True)
class BaseUnits:
    """A unit as so many times a product of powers of base units, these by their full names."""

    factor: float
    powers: tuple[tuple[str, float], ...]


@cache
def base_units(unit: str) -> BaseUnits:
    """A unit in base units; from the user's cache, because pint takes longer to load than a model to declare.

    Raises:
        ValueError: it is none; says what is wrong in it.
    """

    def found() -> tuple[float, list[tuple[str, Any]]]:
        base = parse_unit(unit).to_base_units()
        return float(base.magnitude), [(str(name), power) for name, power in base.unit_items()]

    factor, powers = _cached(found, unit)
    return BaseUnits(factor, tuple((name, power) for name, power in powers))


@cache
def conversion_factor(unit: str, to: str) -> float:
    """How many of another unit one of this is; from the user's cache likewise.

    Raises:
        OtherDimensionError: they do not measure the same, or from another zero.
        ValueError: one of them is none.
    """

    def found() -> float | str:
        from pint import DimensionalityError, PintError

        try:
            quantity, target = parse_unit(unit), parse_unit(to).units
            if type(quantity)(0.0, quantity.units).to(target).magnitude != 0.0:
                return f"'{unit}' has another zero than '{to}'"
            return float(quantity.to(target).magnitude)
        except DimensionalityError as error:
            return str(error)
        except PintError as error:
            raise ValueError(str(error)) from error

    factor = _cached(found, unit, to)
    if isinstance(factor, str):
        raise OtherDimensionError(factor)
    return factor


def conversion(unit: str, expected: str, where: str) -> float:
    """Factor from one unit to another. StickslipError: the unit is unknown, has another dimension, or leaves open which
    angle it means (1/min, Grad); the message begins with ``where``."""
    if unit == expected:
        return 1.0
    expectation = _ANGLES.get(expected, f"{expected} or a multiple of it")
    if "rad" in expected and _DEGREE_OR_GON.search(unit):
        raise StickslipError(f"{where} is in '{unit}', which may be degrees or gon. Write deg or gon.")
    try:
        factor = conversion_factor(unit, expected)
        counts_angles = "radian" in dict(base_units(unit).powers)
    except OtherDimensionError as error:
        advice = "Check the unit, or whether columns were mixed up."
        if expected == "1":  # or the model says none
            advice = f"The model states no unit of it: give numbers as the model has them, without '{unit}'."
        raise StickslipError(f"{where} is in '{unit}', which cannot be converted to {expected}. {advice}") from error
    except ValueError as error:
        raise StickslipError(f"{where} has the unknown unit '{unit}'. Write {expectation}.") from error
    if expected in _ANGLES and not counts_angles:
        raise StickslipError(f"{where} is in '{unit}', which counts radians or whole turns. Write {expectation}.")
    return factor


def scale_of(unit: str, expected: str, where: str) -> tuple[float, float]:
    """Factor and zero from one unit to another: those of a temperature differ in both, and °C may be written as C.
    Errors as in `conversion`.

    >>> scale_of("degC", "K", "room")
    (1.0, 273.15)
    """
    degrees = _TEMPERATURE.fullmatch(unit) if expected == "K" else None
    return _SCALES[degrees[1].lower()] if degrees else (conversion(unit, expected, where), 0.0)


def _cached(compute: Callable[[], Any], *units: str) -> Any:
    """The result of ``compute`` for units, from the user's cache where it was computed before."""
    try:
        key = digest(*units, version_of("pint"), Path(__file__).read_bytes())
        text = sealed_text(cache_folder() / "units" / f"{key}.json", lambda: json.dumps(compute()))
    except StickslipError:  # neither declarations nor logs need a cache
        return compute()
    return json.loads(text)


@cache
def known_units() -> tuple[str, ...]:
    """Names and symbols of all units, without prefixes."""
    return tuple(sorted(name for name in dir(_registry()) if not name.startswith("_")))


@cache
def _registry() -> "pint.UnitRegistry":
    """One pint registry per process: it takes long to make."""
    import pint

    return pint.UnitRegistry()


class _Reader:
    """The grammar, one method per rule."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = _tokens(text)
        self._at = 0
        self._depth = 0

    def read(self) -> "PlainQuantity[float]":
        units = self._unit()
        if self._peek():
            raise ValueError(f"'{self._peek()}' is out of place in the unit '{self._text}'")
        quantity = _registry().Quantity(1.0, units)
        try:
            size = abs(float(quantity.to_base_units().magnitude))
        except TypeError as error:  # as pint says what is not a scale of its own: degrees Celsius squared, decibels
            raise ValueError(f"the unit '{self._text}' multiplies one whose zero is not that of its base") from error
        except OverflowError:
            size = math.inf
        if not 0.0 < size < math.inf:
            raise ValueError(f"the unit '{self._text}' is beyond the range of numbers")
        return quantity

    def _unit(self) -> "PlainUnit":
        unit = self._factor()
        while self._peek() and self._peek() != ")":
            divides = self._take("/")
            if not divides:
                self._take("*", ".", "·")
            factor = self._factor()
            unit = unit / factor if divides else unit * factor
        return unit

    def _factor(self) -> "PlainUnit":
        kind, text = self._next()
        if text == "(":
            self._depth += 1
            if self._depth > DEEPEST:
                raise ValueError(f"the unit '{self._text}' has more than {DEEPEST} brackets in brackets")
            base = self._unit()
            if not self._take(")"):
                raise ValueError(f"a bracket of the unit '{self._text}' is not closed")
            self._depth -= 1
        elif kind == "name":
            base = _named(text)
        elif text == "1":
            base = _registry().Unit("dimensionless")
        else:
            token = f"'{text}'" if text else "nothing"
            raise ValueError(f"the unit '{self._text}' has {token} where a name belongs")
        kind = self._kind()
        if kind == "power":
            self._next()
            if self._take("("):
                exponent = self._exponent(quotient=True)
                if not self._take(")"):
                    raise ValueError(f"a bracket of the unit '{self._text}' is not closed")
                return base**exponent
            return base ** self._exponent()
        return base ** self._exponent() if kind in ("number", "sign") else base

    def _exponent(self, quotient: bool = False) -> float:
        sign = -1.0 if self._take("-") else 1.0
        if sign > 0:
            self._take("+")
        value = sign * self._number()
        if quotient and self._take("/"):
            divisor = self._number()
            if divisor == 0.0:
                raise ValueError(f"an exponent of the unit '{self._text}' is divided by zero")
            value /= divisor
        if abs(value) > LARGEST_POWER:
            raise ValueError(f"the exponent {value:g} of the unit '{self._text}' is larger than {LARGEST_POWER}")
        return int(value) if value.is_integer() else value

    def _number(self) -> float:
        kind, text = self._next()
        if kind != "number":
            raise ValueError(f"an exponent of the unit '{self._text}' is no number")
        return float(text)

    def _next(self) -> tuple[str, str]:
        token = self._tokens[self._at] if self._at < len(self._tokens) else ("", "")
        self._at += 1
        return token

    def _kind(self) -> str:
        return self._tokens[self._at][0] if self._at < len(self._tokens) else ""

    def _peek(self) -> str:
        return self._tokens[self._at][1] if self._at < len(self._tokens) else ""

    def _take(self, *texts: str) -> bool:
        taken = self._peek() in texts
        self._at += taken
        return taken


def _tokens(text: str) -> list[tuple[str, str]]:
    tokens: list[tuple[str, str]] = []
    at, end = 0, len(text.rstrip())
    while at < end:
        match = _TOKEN.match(text, at)
        if match is None:
            raise ValueError(f"'{text[at:].strip()[:1]}' has no meaning in the unit '{text}'")
        kind = str(match.lastgroup)
        # a number that stands apart is no exponent
        separate = kind in ("number", "sign") and match.start(kind) > at
        tokens.append(("apart" if separate else kind, match[kind]))
        at = match.end()
    if not tokens:
        raise ValueError("a unit without any name is none; write 1 for a pure number")
    return tokens


@cache
def _named(name: str) -> "PlainUnit":
    """One unit by its name or symbol, with a prefix perhaps."""
    from pint import PintError

    registry = _registry()
    try:
        (symbol,) = registry.Unit(_NAMES.get(name, name))._units
        return registry.Unit(symbol)
    except (PintError, ValueError, TypeError, AttributeError, SyntaxError):
        raise ValueError(f"'{name}' is not a unit") from None
