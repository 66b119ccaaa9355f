"""The smooth pieces of the rule of a map, and the borders between them.

A border is where a condition of the rule changes: h(x, p) = 0, of Piecewise, an absolute value, a least or largest one.
On a given side of every border the rule is one smooth formula, which does not end where the border is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy
from sympy.core.relational import Relational

from fmu_models.base.arrays import Vector
from fmu_models.language.maps import Map

Sides = tuple[int, ...]  # of each border, 1 where h > 0, -1 elsewhere


@dataclass(frozen=True, eq=False)
class RulePieces:
    """The rule of a map, forward or backward, with derivatives by states and some parameters.

    Attributes:
        borders: (k,) h of each.
        parameters: names of those to differentiate by.
    """

    declared: Map
    rule: dict[Any, sympy.Expr]
    conditions: dict[Relational, tuple[int, int]]
    borders: tuple[sympy.Expr, ...]
    parameters: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the borders: h."""
        return tuple(str(h) for h in self.borders)

    def at_borders(self, x: Vector, values: Sequence[float]) -> tuple[Vector, Vector]:
        """(k,) h, and (k, n + parameters) its derivatives."""
        return self._evaluated(_compiled(self, None), x, values)

    def of(self, sides: Sides, x: Vector, values: Sequence[float]) -> tuple[Vector, Vector]:
        """(n,) the image of a point by the piece on these sides, and (n, n + parameters) its derivatives; not finite
        where the piece has none."""
        return self._evaluated(_compiled(self, sides), x, values)

    def _evaluated(self, function: Callable[..., Any], x: Vector, values: Sequence[float]) -> tuple[Vector, Vector]:
        with np.errstate(all="ignore"):
            numbers = np.array(function(*x, *values), dtype=float)
        rows = numbers.reshape(-1, 1 + len(x) + len(self.parameters))
        return rows[:, 0], rows[:, 1:]


@cache
def pieces_of(declared: Map, backward: bool, parameters: tuple[str, ...]) -> RulePieces:
    """Those of a map, to be differentiated by these parameters."""
    declared_rule = (declared.inverse if backward else declared.rule) or {}
    rule = {x: declared_rule[x].rewrite(sympy.Piecewise) for x in declared.states}
    borders: list[sympy.Expr] = []
    conditions: dict[Relational, tuple[int, int]] = {}
    relations = set().union(*(expression.atoms(Relational) for expression in rule.values()))
    for condition in sorted(relations, key=str):
        if isinstance(condition, sympy.Eq | sympy.Ne):
            continue
        left, right = (sympy.sympify(side) for side in condition.args)
        h: Any = left - right  # type: ignore[operator] # both are numbers
        positive = 1 if isinstance(condition, sympy.Gt | sympy.Ge) else -1
        for i, border in enumerate(borders):
            for sign in (1, -1):
                if sympy.expand(h - sign * border) == 0:
                    conditions[condition] = i, sign * positive
        if condition not in conditions:
            conditions[condition] = len(borders), positive
            borders.append(h)
    return RulePieces(declared, rule, conditions, tuple(borders), parameters)


@cache
def _compiled(pieces: RulePieces, sides: Sides | None) -> Callable[..., Any]:
    """The borders, or the piece on these sides, each with its derivatives."""
    declared = pieces.declared
    expressions = list(pieces.borders)
    if sides is not None:
        chosen = {c: sympy.true if sides[i] == sense else sympy.false for c, (i, sense) in pieces.conditions.items()}
        expressions = [expression.xreplace(chosen) for expression in pieces.rule.values()]
    by = [*declared.states, *(p for name in pieces.parameters for p in declared.parameters if p.name == name)]
    entries = [entry for e in expressions for entry in (e, *(sympy.diff(e, symbol) for symbol in by))]
    return sympy.lambdify([*declared.states, *declared.parameters], entries, "numpy", cse=True)
