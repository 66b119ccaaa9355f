"""Lines of branches: smooth where a branch is, with corners where it has them."""

import numpy as np
import pytest

from fmu_models.report.branch_views import STRAIGHT, smoothed


def amplitude(omega):
    """Of a forced oscillator, damped lightly."""
    return 0.5 / np.sqrt((1.0 - omega**2) ** 2 + (0.05 * omega) ** 2)


def off(points, form):
    """How far lines between points are from a closed form, in shares of the picture."""
    share = np.linspace(0.0, 1.0, 11)[:, None]
    x, y = (points[:-1, i] + share * np.diff(points[:, i]) for i in range(2))
    return np.abs(y - form(x)).max() / np.ptp(points[:, 1])


def test_a_resonance_through_few_points_is_smooth():
    x = np.linspace(1.05, 1.4, 36)
    points = np.stack([x, amplitude(x)], 1)
    stable = x[1:] < 1.2
    fine, solid = smoothed(points, stable, np.zeros(len(x), bool))
    assert off(points, amplitude) > 5.0 * STRAIGHT
    assert off(fine, amplitude) < 2.0 * STRAIGHT
    assert len(solid) == len(fine) - 1
    assert (np.diff(solid.astype(int)) != 0).sum() == 1
    assert fine[:-1][solid, 0].max() < 1.2 and set(map(tuple, points)) <= set(map(tuple, fine))


def test_a_fold_is_round():
    y = np.linspace(-1.0, 1.0, 21)
    points = np.stack([1.0 - y**2, y], 1)
    fine, _ = smoothed(points, np.ones(20, bool), np.zeros(21, bool))
    assert np.abs(fine[:, 0] - (1.0 - fine[:, 1] ** 2)).max() < STRAIGHT


@pytest.mark.parametrize("told", [True, False])
def test_a_corner_stays_where_it_is_told(told):
    x = np.linspace(-1.0, 1.0, 9)
    points = np.stack([x, np.where(x < 0.0, x**2, 2.0 * x)], 1)
    fine, _ = smoothed(points, np.ones(8, bool), (x == 0.0) if told else np.zeros(9, bool))
    at = np.flatnonzero(fine[:, 0] == 0.0).item()
    slopes = np.diff(fine[at - 1 : at + 2], axis=0)
    turned = slopes[1, 1] / slopes[1, 0] - slopes[0, 1] / slopes[0, 0]
    assert (turned > 1.7) == told


def test_a_gap_stays_a_gap():
    y = np.array([0.0, 1.0, 4.0, np.nan, 16.0, 25.0, 36.0])
    fine, solid = smoothed(np.stack([np.arange(7.0), y], 1), np.ones(6, bool), np.zeros(7, bool))
    assert np.isnan(fine[:, 1]).sum() == 1 and len(solid) == len(fine) - 1
    assert np.interp(2.0, *fine[: np.flatnonzero(np.isnan(fine[:, 1])).item()].T) == 4.0
