"""Periodic signals: inputs that the model drives itself, of straight lines between knots that repeat.

    s(t) = the line through the knots at the place  (t - start)/period  modulo 1

Two knots at one place are a jump, as are values at the places 0 and 1 that differ. A signal has its new value from the
jump on (half-open pieces). When it jumps or bends is known beforehand: no state, no root and no reset is made for it.
Contacts and switches are asked anew after each knot; states go on as they were, but for the reset of a switch whose
function the jump takes through zero.
"""

from collections.abc import Callable, Collection, Sequence
from itertools import pairwise
from typing import Any, Self

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.quantities import Input, Parameter

Expression = sympy.Expr | float


class PeriodicSignal(Input):
    """A signal of straight lines that repeats, with jumps or without.

    Args:
        name, unit, description: as for a Parameter.
        period: s, an expression of parameters.
        knots: pairs of a place, in parts of the period from 0 to 1, ascending, and the value there, in ``unit``;
            expressions of parameters.
        start: s, when a period begins (and all others, before and after).

    Raises:
        StickslipError: knots that do not span a period, or expressions of more than parameters.
    """

    period: sympy.Expr
    start: sympy.Expr
    knots: tuple[tuple[sympy.Expr, sympy.Expr], ...]

    def __new__(  # type: ignore[override] # an input has a value, a signal its knots
        cls,
        name: str,
        unit: str,
        description: str,
        *,
        period: Expression,
        knots: Sequence[tuple[Expression, Expression]],
        start: Expression = 0,
    ) -> Self:
        symbol = super().__new__(cls, name, 0.0, unit, description)
        symbol.period, symbol.start = sympy.sympify(period), sympy.sympify(start)
        symbol.knots = tuple((sympy.sympify(place), sympy.sympify(value)) for place, value in knots)
        _check(symbol)
        return symbol

    @classmethod
    def sawtooth(
        cls,
        name: str,
        unit: str,
        description: str,
        *,
        period: Expression,
        low: Expression = 0,
        high: Expression = 1,
        start: Expression = 0,
    ) -> Self:
        """A ramp from ``low`` to ``high`` in every period, which falls back at once; other arguments as above."""
        return cls(name, unit, description, period=period, knots=[(0, low), (1, high)], start=start)

    @classmethod
    def square(
        cls,
        name: str,
        unit: str,
        description: str,
        *,
        period: Expression,
        low: Expression = 0,
        high: Expression = 1,
        duty: Expression = 0.5,
        start: Expression = 0,
    ) -> Self:
        """``high`` for the part ``duty`` of every period, then ``low``; other arguments as above."""
        knots = [(0, high), (duty, high), (duty, low), (1, low)]
        return cls(name, unit, description, period=period, knots=knots, start=start)

    @property
    def shape(self) -> str:
        """A line that says what it is."""
        knots = ", ".join(f"({place}, {value})" for place, value in self.knots)
        return f"{self.name} = lines through {knots} over (t - {self.start})/({self.period}) modulo 1"

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        """All that it is made of."""
        return (self.period, self.start, *(e for knot in self.knots for e in knot))

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A positive period, and places that ascend."""
        ascend = f"the knots of '{self.name}' must ascend from 0 to 1"
        period = Requirement(self.period, f"the period of '{self.name}' must be positive", strict=True)
        gaps = (b - a for (a, _), (b, _) in pairwise(self.knots))
        needed = (period, *(Requirement(gap, ascend) for gap in gaps))
        return tuple(r for r in needed if not _holds(r))

    def folded(self, folded: Callable[[sympy.Basic], Any]) -> Self:
        """The same signal (equal to this one in expressions) with each of its expressions changed by a function."""
        knots = tuple((folded(place), folded(value)) for place, value in self.knots)
        return self._with(period=folded(self.period), start=folded(self.start), knots=knots)


def with_signals(symbols: Collection[sympy.Basic]) -> set[sympy.Basic]:
    """Symbols with those that the signals among them are made of."""
    signals = [symbol for symbol in symbols if isinstance(symbol, PeriodicSignal)]
    return set(symbols).union(*(e.free_symbols for signal in signals for e in signal.expressions))


def _holds(requirement: Requirement) -> bool:
    value = requirement.expression
    return bool(value.is_positive or (value.is_zero and not requirement.strict))


def _check(signal: PeriodicSignal) -> None:
    places = [place for place, _ in signal.knots]
    if len(places) < 2 or places[0] != 0 or places[-1] != 1:
        listed = ", ".join(map(str, places)) or "none"
        raise StickslipError(
            f"The knots of signal '{signal.name}' are at the places {listed}. They must span one period: the first at "
            "0, the last at 1, places in parts of the period."
        )
    for requirement in signal.requirements:
        if not requirement.expression.free_symbols:
            raise StickslipError(f"{requirement.sentence[0].upper()}{requirement.sentence[1:]}.")
    for expression in signal.expressions:
        if strangers := sorted(str(s) for s in expression.free_symbols if not isinstance(s, Parameter)):
            raise StickslipError(
                f"Signal '{signal.name}' is made of {' and '.join(strangers)}; it may use parameters only, for its "
                "jumps must be known beforehand. What depends on states is an expression of the signal, or a Switch."
            )
