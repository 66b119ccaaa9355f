"""Autoregressions of residuals: exact whitening, order, and efficiency where residuals are coloured."""

from __future__ import annotations

import numpy as np
import pytest

from identification.inference.colour import Autoregression, autoregression


def _coloured(count: int, rho: float, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=count)
    values = np.empty(count)
    values[0] = noise[0]
    for i in range(1, count):
        values[i] = rho * values[i - 1] + np.sqrt(1 - rho**2) * noise[i]
    return values


def test_filter_is_the_inverse_root_of_the_covariance_of_the_autoregression():
    """L Cov L' = v I for an AR(2), covariance by its own Yule-Walker equations."""
    a = np.array([1.1, -0.4])
    rho1 = a[0] / (1 - a[1])
    correlation = [1.0, rho1]
    for _ in range(10):
        correlation.append(a[0] * correlation[-1] + a[1] * correlation[-2])
    covariance = np.array([[correlation[abs(i - j)] for j in range(12)] for i in range(12)])
    last = 1 - a[0] * rho1 - a[1] * correlation[2]
    first = 1 - rho1**2
    exact = Autoregression((np.zeros(0), np.array([rho1]), a), np.array([1.0, first, last]) / last)
    lower = exact.filtered(np.eye(12))
    assert lower @ covariance @ lower.T == pytest.approx(last * np.eye(12), abs=1e-12)


def test_white_residuals_are_left_and_coloured_ones_whitened():
    white = np.random.default_rng(1).normal(size=2000)
    assert autoregression(white).order == 0
    assert autoregression(white).filtered(white) == pytest.approx(white)
    coloured = _coloured(2000, 0.95, 2)
    found = autoregression(coloured)
    assert found.order >= 1
    left = found.filtered(coloured)
    # lag 1 of white values: 1/sqrt(n) = .022
    assert abs(float(left[1:] @ left[:-1] / (left @ left))) < 0.07
    assert np.var(left) == pytest.approx(1 - 0.95**2, rel=0.1)


def test_constant_zero_residuals_are_white():
    assert autoregression(np.zeros(50)).order == 0


def test_what_a_fit_has_taken_off_is_put_back():
    """A polynomial follows slow noise: its residuals alone look whiter than the noise, by more than chance."""
    columns = np.polynomial.legendre.legvander(np.linspace(-1, 1, 400), 7)
    exact = Autoregression((np.zeros(0), np.array([0.95])), np.array([1 / (1 - 0.95**2), 1.0]))
    alone, corrected = [], []
    for seed in range(40):
        noise = _coloured(400, 0.95, seed)
        rows, white = exact.filtered(columns), exact.filtered(noise)
        residual = noise - columns @ np.linalg.lstsq(rows, white, rcond=None)[0]
        covariance = np.linalg.inv(rows.T @ rows) * (1 - 0.95**2)
        taken = columns @ np.linalg.cholesky(covariance)
        for found, fitted in ((alone, None), (corrected, taken)):
            filter_ = autoregression(residual, fitted)
            found.append(filter_.predictors[1][0] if filter_.order else 0.0)
    error = np.std(corrected) / np.sqrt(40)
    assert abs(np.mean(corrected) - 0.95) < max(4 * error, 0.006)
    assert np.mean(alone) < np.mean(corrected) - 0.015
