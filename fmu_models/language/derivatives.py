"""Derivatives of expressions that share parts: every part is differentiated once, and only where it moves.

SymPy's own ``diff`` walks through the whole expression for every symbol, and rebuilds what an expression of many bodies
has in common for each of them: its cost grows with the square of their number and beyond.
"""

from collections.abc import Mapping
from typing import Any

import sympy

Expr = Any  # SymPy annotates the arguments of every expression as Basic, which has no arithmetic


class Derivatives:
    """Derivatives of expressions along given rates of their symbols.

    >>> x, y = sympy.symbols("x y")
    >>> derivatives = Derivatives()
    >>> derivatives.by(x * y**2, y), derivatives.along(x * y, {x: y, y: sympy.Integer(3)})
    (2*x*y, 3*x + y**2)
    """

    def __init__(self) -> None:
        self._symbols: dict[Expr, frozenset[sympy.Basic]] = {}
        self._holders: dict[Expr, dict[sympy.Basic, list[int]]] = {}
        self._by: dict[sympy.Basic, dict[Expr, Expr]] = {}

    def by(self, expression: Expr, symbol: sympy.Basic) -> Expr:
        """Partial derivative by a symbol."""
        return self._derive(expression, {symbol: sympy.S.One}, self._by.setdefault(symbol, {}))

    def along(self, expression: Expr, rates: Mapping[sympy.Basic, Expr], cache: dict[Expr, Expr] | None = None) -> Expr:
        """Total derivative; symbols that have no rate stand still. ``cache`` keeps what several calls share."""
        return self._derive(expression, rates, {} if cache is None else cache)

    def symbols(self, expression: Expr) -> frozenset[sympy.Basic]:
        """Free symbols."""
        symbols = self._symbols.get(expression)
        if symbols is None:
            symbols = frozenset([expression]) if expression.is_Symbol else frozenset()
            symbols = symbols.union(*map(self.symbols, expression.args))
            self._symbols[expression] = symbols
        return symbols

    def _derive(self, e: Expr, rates: Mapping[sympy.Basic, Expr], cache: dict[Expr, Expr]) -> Expr:
        if e.is_Symbol:
            return rates.get(e, sympy.S.Zero)
        derivative = cache.get(e)
        if derivative is None:
            moving = self._moving(e, rates)
            derivative = self._composed(e, {i: self._derive(e.args[i], rates, cache) for i in moving})
            cache[e] = derivative
        return derivative

    def _moving(self, e: Expr, rates: Mapping[sympy.Basic, Expr]) -> list[int]:
        """Indices of the arguments that hold a symbol with a rate."""
        if e not in self._holders:
            holders: dict[sympy.Basic, list[int]] = {}
            for i, argument in enumerate(e.args):
                for symbol in self.symbols(argument):
                    holders.setdefault(symbol, []).append(i)
            self._holders[e] = holders
        holders = self._holders[e]
        if len(rates) == 1:
            return holders.get(next(iter(rates)), [])
        return sorted({i for symbol, places in holders.items() if symbol in rates for i in places})

    @staticmethod
    def _composed(e: Expr, inner: Mapping[int, Expr]) -> Expr:
        """The derivative from those of the arguments."""
        inner = {i: rate for i, rate in inner.items() if rate != 0}
        if not inner:
            return sympy.S.Zero
        if e.is_Add:
            return sympy.Add(*inner.values())
        if e.is_Mul:
            return sympy.Add(*(sympy.Mul(*e.args[:i], rate, *e.args[i + 1 :]) for i, rate in inner.items()))
        if e.is_Pow and set(inner) == {0}:
            return e * inner[0] * e.exp / e.base
        if isinstance(e, sympy.Function):
            return sympy.Add(*(e.fdiff(i + 1) * rate for i, rate in inner.items()))
        slots = [sympy.Dummy() for _ in e.args]
        shape = e.func(*slots)
        slopes = (sympy.diff(shape, slots[i]).xreplace(dict(zip(slots, e.args, strict=True))) for i in inner)
        return sympy.Add(*(slope * rate for slope, rate in zip(slopes, inner.values(), strict=True)))
