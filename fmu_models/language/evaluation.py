"""Expressions as numbers, each shared part once: what a check needs to know of them at some points."""

import math
import random
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import sympy

from fmu_models.language.declaration import Body
from fmu_models.language.quantities import TIME

Values = dict[Any, float]

_FUNCTIONS: Mapping[Any, Callable[[float], float]] = {
    sympy.exp: math.exp,
    sympy.log: math.log,
    sympy.sin: math.sin,
    sympy.cos: math.cos,
    sympy.tan: math.tan,
    sympy.sinh: math.sinh,
    sympy.cosh: math.cosh,
    sympy.tanh: math.tanh,
    sympy.atan: math.atan,
}


def evaluated(expression: sympy.Basic, values: Values) -> float:
    """Value of an expression; ``values`` has those of its symbols and keeps those of its parts.

    Returns:
        nan where it has no real value.
    """
    if expression not in values:
        values[expression] = _value(expression, values)
    return values[expression]


def at_start(body: Body) -> Values:
    """Start values of all quantities that the energies of a body may use, at rest."""
    values: Values = {TIME: 0.0}
    values |= {q: q.value for q in (*body.parameters, *body.all_inputs)}
    values |= {u.rate: u.rate.value for u in body.all_inputs}
    for q in body.coordinates:
        values |= {q: q.start, q.v: q.v.start}
    return values


def near_start(body: Body, points: int) -> Iterator[Values]:
    """The same at random places around the start, the same ones each time: no relation holds there by accident."""
    source = random.Random(0)
    for _ in range(points):
        yield {
            quantity: value * (1.0 + 0.2 * source.random()) if value else source.uniform(0.1, 1.0)
            for quantity, value in at_start(body).items()
        }


def _value(e: sympy.Basic, values: Values) -> float:
    try:
        inner = [evaluated(argument, values) for argument in e.args]
        if e.is_Add:
            return math.fsum(inner)
        if e.is_Mul:
            return math.prod(inner)
        if e.is_Pow:
            return math.pow(*inner)
        if e.func in _FUNCTIONS:
            return _FUNCTIONS[e.func](*inner)
        return float(e.func(*inner)) if inner else float(e)  # pyright: ignore[reportArgumentType]
    except (ValueError, OverflowError, TypeError, ZeroDivisionError):
        return math.nan
