"""Dimensions of expressions: exponents of kilogram, meter, second and so on; angles have none.

A floating-point number in an expression may stand for a quantity of any unit, so that what it multiplies is not
checked. In a scaled model, whose coordinates (or states) all have the unit "1", time is scaled too and is left out of
every dimension.

Units are read only when a model is declared.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import base_units
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.quantities import Quantity, State

Dimension = tuple[tuple[str, sympy.Rational], ...]
NONE: Dimension = ()


class Mismatch(Exception):
    """Two dimensions that cannot go together; the message says which."""


class Dimensions:
    """Dimensions of the expressions of one model; None stands for one that is not checked."""

    def __init__(self, model: str, states: Sequence[Quantity]) -> None:
        self.model = model
        self.scaled = all(state.unit == "1" for state in states)
        self.known: dict[sympy.Basic, Dimension | None] = {}
        self.parts: dict[sympy.Basic, Dimension | None] = {}
        self.symbols = Derivatives().symbols

    def of_unit(self, unit: str) -> Dimension:
        try:
            return tuple((name, power) for name, power in _dimension(unit) if not (self.scaled and name == "second"))
        except Exception as error:
            raise StickslipError(
                f"{self.model}: '{unit}' is not a unit. Write units such as 'kg m2', 'N s/m', 'rad/s', '1'."
            ) from error

    @staticmethod
    def times(a: Dimension, b: Dimension, power: sympy.Expr | int = 1) -> Dimension:
        """a times b to a power."""
        total: dict[str, Any] = dict(a)
        for name, exponent in b:
            total[name] = total.get(name, sympy.S.Zero) + exponent * power
        return tuple(sorted((name, exponent) for name, exponent in total.items() if exponent != 0))

    def expect(self, label: str, expression: sympy.Expr | float, unit: str | None) -> Dimension | None:
        """Dimension of an expression, which must be that of the unit if there is one."""
        try:
            dimension = self.of(sympy.sympify(expression))
        except Mismatch as error:
            raise StickslipError(f"{self.model}: units do not match in {label}: {error}") from error
        if unit is not None and sympy.sympify(expression) != 0:
            self.match(label, dimension, unit)
        return dimension

    def match(self, label: str, dimension: Dimension | None, unit: str) -> None:
        """Refuse a dimension that is not that of the unit; a scaled model has energies and powers without unit."""
        mechanical = self.scaled and unit in ("J", "W")
        self.compare(label, dimension, NONE if mechanical else self.of_unit(unit), unit)

    def compare(self, label: str, dimension: Dimension | None, expected: Dimension | None, unit: str = "") -> None:
        """Refuse two dimensions that differ."""
        if dimension is not None and expected is not None and dimension != expected:
            raise StickslipError(
                f"{self.model}: units do not match: {label} is in {_text(dimension)}, not in {unit or _text(expected)}"
                f"{f' = {_text(expected)}' if unit and unit != _text(expected) else ''}. Look at the units of its "
                "parameters."
            )

    def of(self, e: sympy.Basic) -> Dimension | None:
        if isinstance(e, Quantity):
            if e not in self.known:
                self.known[e] = self.of_unit(e.unit)
            return self.known[e]
        if e not in self.parts:
            self.parts[e] = self._composed(e)
        return self.parts[e]

    def _composed(self, e: sympy.Basic) -> Dimension | None:
        if not self.symbols(e) and e.has(sympy.Float):
            return None
        if e.is_Add:
            return self._sum(e)
        if e.is_Mul:
            return self.product(*map(self.of, e.args))
        if isinstance(e, sympy.Pow):
            return self._power(e)
        if isinstance(e, sympy.Function):
            for argument in e.args:
                dimension = self.of(argument)
                if dimension:
                    raise Mismatch(f"{e.func}({argument}) of a quantity in {_text(dimension)}; it must be a number")
        return NONE

    def _sum(self, e: sympy.Basic) -> Dimension | None:
        seen: dict[Dimension, sympy.Basic] = {}
        for term in e.args:
            dimension = self.of(term)
            if dimension is not None:
                seen.setdefault(dimension, term)
        if len(seen) > 1:
            (first, a), (second, b) = list(seen.items())[:2]
            raise Mismatch(f"{a} is in {_text(first)}, {b} in {_text(second)}; they cannot be added")
        return next(iter(seen), None)

    def product(self, *dimensions: Dimension | None) -> Dimension | None:
        """Of all of them; None where one is not known."""
        total: Dimension | None = NONE
        for dimension in dimensions:
            total = None if total is None or dimension is None else self.times(total, dimension)
        return total

    def _power(self, e: sympy.Pow) -> Dimension | None:
        base, exponent = self.of(e.base), self.of(e.exp)
        if exponent:
            raise Mismatch(f"the exponent of {e} is in {_text(exponent)}; it must be a number")
        if not base:
            return base
        if not e.exp.is_Number:
            raise Mismatch(f"{e.base} in {_text(base)} to a power that is not a number")
        return self.times(NONE, base, sympy.nsimplify(e.exp))


@cache
def _dimension(unit: str) -> Dimension:
    powers = {name: sympy.nsimplify(power) for name, power in base_units(unit).powers if name != "radian"}
    return tuple(sorted(powers.items()))


def _text(dimension: Dimension) -> str:
    short = {"kilogram": "kg", "meter": "m", "second": "s"}
    return " ".join(f"{short.get(n, n)}{'' if p == 1 else f'^{p}'}" for n, p in dimension) or "1"


def way_unit(along: sympy.Expr) -> str:
    """Unit of a gap, or of the way that grows at a slip speed: "m", "rad", or "1" in a scaled model.

    An expression whose units do not match, or say nothing, is taken for one in m: `check_units` tells what is wrong.
    """
    along = sympy.sympify(along)
    try:
        length = Dimensions("", ()).of(along)  # time is left out: a slip speed has the dimension of its way
    except (Mismatch, StickslipError):
        return "m"
    if length != NONE:
        return "m"
    return "rad" if any(isinstance(s, State) and s.unit.startswith("rad") for s in along.free_symbols) else "1"
