"""Formulas of files: arithmetic, and nothing that runs anything."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.base.formula import Formula


def test_a_formula_is_arithmetic_of_names():
    formula = Formula.read(" f0/sqrt((k - m*omega**2)**2 + (c*omega)**2) - pi ")
    assert set(formula.names) == {"f0", "k", "m", "omega", "c"}
    omega = np.array([0.5, 0.9])
    found = formula({"f0": 2.0, "k": 1.0, "m": 3.0, "c": 0.1, "omega": omega})
    assert found == pytest.approx(2.0 / np.hypot(1.0 - 3.0 * omega**2, 0.1 * omega) - math.pi, abs=1e-15)
    assert Formula.read("-2**-1 + arctan2(1, 1)*abs(-x)")({"x": 4}) == pytest.approx(-0.5 + math.pi)
    assert np.isnan(Formula.read("sqrt(x)")({"x": -1.0}))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1 +", "is no formula"),
        ("__import__('os')", "is nothing that a formula has"),
        ("x.real", "is nothing that a formula has"),
        ("[1, 2][0]", "is nothing that a formula has"),
        ("'a'", "is nothing that a formula has"),
        ("hypot(1)", "takes 2 values"),
        ("x if x else 1", "is nothing that a formula has"),
    ],
)
def test_what_is_none(text, said):
    with pytest.raises(StickslipError, match=said):
        Formula.read(text)


def test_a_name_without_a_value():
    with pytest.raises(StickslipError, match="'omga' in 'omga' has no value"):
        Formula.read("omga")({"omega": 1.0})
