"""Hyper-dual numbers against SymPy's derivatives of the same expressions."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from fmu_models.base.errors import StickslipError
from identification.machines.hyper_dual import FUNCTIONS, HyperDual

X, Y = sympy.symbols("x y", positive=True)
AT = {X: 0.7, Y: 1.9}
EXPRESSIONS = (
    X * Y + X * X * Y,
    (X * Y) * (X + 3 * Y),
    (2 - X * Y) * (X - Y) - X,
    X * Y / (X + 2 * Y),
    3 / (X * Y + 1),
    (X**2 * Y + 2) ** 1.5,
    -(X * Y) + 5,
    *(getattr(sympy, name)(X * Y / 3 + X / 5) * Y for name in FUNCTIONS),
)


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_first_and_mixed_second_derivatives(expression: sympy.Expr) -> None:
    one, nothing = np.ones(1), np.zeros(1)
    x = HyperDual(np.full(1, AT[X]), one, nothing, nothing)
    y = HyperDual(np.full(1, AT[Y]), nothing, one, nothing)
    value = sympy.lambdify((X, Y), expression, modules=[FUNCTIONS])(x, y)
    found = [float(part[0]) for part in (value.value, value.first, value.second, value.both)]
    expected = [expression, expression.diff(X), expression.diff(Y), expression.diff(X, Y)]
    assert found == pytest.approx([float(part.subs(AT)) for part in expected], rel=1e-13)


def test_both_directions_along_one_number_give_its_second_derivative() -> None:
    x = HyperDual(np.array([0.7]), np.ones(1), np.ones(1), np.zeros(1))
    third = x**3
    assert float(third.both[0]) == pytest.approx(6 * 0.7, rel=1e-14)
    assert float((third / x).both[0]) == pytest.approx(2.0, rel=1e-13)


def test_numbers_stand_on_either_side() -> None:
    x = HyperDual(np.array([0.5]), np.ones(1), np.zeros(1), np.zeros(1))
    assert [float((part).first[0]) for part in (2 * x, x * 2, 1 - x, x - 1, x / 2, 1 / x)] == [2, 2, -1, 1, 0.5, -4]
    with pytest.raises(StickslipError, match="as an exponent"):
        x.__pow__(x)  # type: ignore[arg-type]
