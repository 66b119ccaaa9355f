"""Fit of the Conti law to friction coefficients with known truth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from identification.estimators.regression import Regression, RegressionProblem
from identification.inference.problem import solve
from identification.laws import find_law

pytestmark = pytest.mark.digits

CONTI = find_law("Conti")


def points(slip: np.ndarray, measured: np.ndarray) -> RegressionProblem:
    """Equations of single values, each its own cluster."""
    ones = tuple(np.ones(1) for _ in slip)
    cluster = np.arange(len(slip))
    return RegressionProblem(CONTI, Regression(slip[:, None], np.ones(1), measured, cluster, 0 * cluster, ones))


@settings(max_examples=40, deadline=None)
@given(mu_k=st.floats(0.05, 0.6), drop=st.floats(0.02, 0.6), p=st.floats(3, 200))
def test_exact_coefficients_give_the_law_back_without_a_start(mu_k: float, drop: float, p: float) -> None:
    truth = np.array([mu_k + drop, mu_k, p])
    slip = np.linspace(0.01, 0.25, 60)
    found = solve(points(slip, CONTI.value(slip, truth)))
    assert found.converged
    np.testing.assert_allclose(found.values, truth, rtol=1e-5)
    assert not any(found.at_bound)


def test_windows_average_the_law_not_the_speed() -> None:
    truth = np.array([0.65, 0.35, 15.0])
    slip = np.linspace(0.01, 0.2, 30)[:, None] + np.linspace(-0.009, 0.05, 41)
    average = np.full(41, 1 / 41)
    ones = tuple(np.ones(1) for _ in slip)
    regression = Regression(slip, average, CONTI.value(slip, truth) @ average, np.arange(30), np.zeros(30), ones)
    np.testing.assert_allclose(solve(RegressionProblem(CONTI, regression)).values, truth, rtol=1e-6)


@pytest.mark.parametrize("q", [np.array([0.65, 0.35, 15.0]), np.array([0.3, 0.4, 80.0])])
def test_gradient_is_the_derivative(q: np.ndarray) -> None:
    slip = np.linspace(0, 0.3, 7)
    for place in range(3):
        step = np.zeros(3)
        step[place] = 1e-6 * q[place]
        slope = (CONTI.value(slip, q + step) - CONTI.value(slip, q - step)) / (2 * step[place])
        np.testing.assert_allclose(CONTI.gradient(slip, q)[place], slope, rtol=1e-6, atol=1e-9)


def test_whitening_weighs_clusters() -> None:
    # two clusters that contradict each other: the one with the greater weight wins
    slip = np.tile(np.linspace(0.01, 0.2, 20), 2)
    strong, weak = np.array([0.65, 0.35, 15.0]), np.array([0.5, 0.3, 10.0])
    measured = np.concatenate([CONTI.value(slip[:20], strong), CONTI.value(slip[20:], weak)])
    cluster = np.repeat([0, 1], 20)
    regression = Regression(slip[:, None], np.ones(1), measured, cluster, 0 * cluster, (np.full(20, 1e4), np.eye(20)))
    np.testing.assert_allclose(solve(RegressionProblem(CONTI, regression)).values, strong, rtol=1e-5)


def test_rising_friction_is_flagged() -> None:
    slip = np.linspace(0.01, 0.2, 50)
    found = solve(points(slip, 0.3 + 0.5 * slip))
    said = CONTI.warnings(found.values)
    assert len(said) == 1
    assert "mu_s" in said[0] and "rises with slip speed" in said[0]
    assert CONTI.warnings(np.array([0.6, 0.3, 10.0])) == ()


def test_a_bound_that_is_reached_is_told() -> None:
    # negative friction at great slip speeds: mu_k goes to its bound at zero
    slip = np.linspace(0.01, 0.5, 50)
    found = solve(points(slip, 0.5 / (1 + 20 * slip) - 0.05))
    assert found.at_bound[1]


def test_too_few_values_are_refused() -> None:
    with pytest.raises(StickslipError, match="3 values cannot determine the 3 unknowns mu_s, mu_k, p"):
        solve(points(np.array([0.01, 0.1, 0.2]), np.array([0.6, 0.5, 0.4])))
