"""Derivatives of shared parts, and expressions as numbers, against SymPy's own."""

from __future__ import annotations

import math

import pytest
import sympy

from fmu_models.language.derivatives import Derivatives
from fmu_models.language.inertia import blocks, evaluated

x, y, z = sympy.symbols("x y z", real=True)
EXPRESSIONS = [
    sympy.Integer(3),
    x,
    x * y * z + 2 * y,
    (x + 2 * y) ** 3 / (1 + z**2),
    sympy.sqrt(1 + x**2) * sympy.exp(-y) * sympy.sin(x * z),
    sympy.tanh(x) + sympy.log(2 + y**2) * sympy.atan(z),
    (2 + x**2) ** y,
    2**x,
    sympy.cos(x) ** 2 + (sympy.sin(x) + y) ** 2,
    sympy.Max(x, y) * z,
]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_derivatives_are_those_of_sympy(expression):
    derivatives = Derivatives()
    for symbol in (x, y, z):
        assert sympy.simplify(derivatives.by(expression, symbol) - sympy.diff(expression, symbol)) == 0
    rates = {x: y, y: sympy.sin(z)}
    expected = sympy.diff(expression, x) * y + sympy.diff(expression, y) * sympy.sin(z)
    assert sympy.simplify(derivatives.along(expression, rates) - expected) == 0


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_numbers_are_those_of_sympy(expression):
    values = {x: 0.7, y: -0.3, z: 1.9}
    expected = float(expression.subs(values))
    assert evaluated(expression, dict(values)) == pytest.approx(expected, rel=1e-14)


def test_what_has_no_real_value_is_no_number():
    assert math.isnan(evaluated(sympy.sqrt(x), {x: -1.0}))
    assert math.isnan(evaluated(1 / x + y, {x: 0.0, y: 1.0}))


def test_blocks_are_what_entries_connect():
    entries = dict.fromkeys([(0, 0), (0, 3), (3, 0), (1, 1), (2, 2), (2, 4), (4, 2), (3, 3)], sympy.S.One)
    assert blocks(5, entries) == [[0, 3], [1], [2, 4]]
