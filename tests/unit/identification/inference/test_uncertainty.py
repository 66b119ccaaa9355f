"""Standard deviations of coloured residuals, against known variance inflation and repeated sampling."""

from __future__ import annotations

import numpy as np
import pytest

from identification.inference.uncertainty import (
    autocorrelation,
    bartlett,
    clustered_covariance,
    correlation,
    lag_count,
    newey_west,
    plain_covariance,
)

pytestmark = pytest.mark.digits


def coloured(rng: np.random.Generator, count: int, colour: float) -> np.ndarray:
    """First-order autoregression (count,) of unit variance."""
    value, values = rng.standard_normal(), []
    for kick in rng.standard_normal(count) * np.sqrt(1 - colour**2):
        values.append(value)
        value = colour * value + kick
    return np.array(values)


def test_newey_west_finds_the_inflation_of_a_mean_of_coloured_values() -> None:
    colour, count = 0.8, 40_000
    residual = coloured(np.random.default_rng(1), count, colour)
    # variance of a mean of AR(1) values: (1 + a)/(1 - a) times the white one
    inflation = bartlett(residual[:, None], 60, np.zeros(count))[0, 0] / float(residual @ residual)
    assert inflation == pytest.approx((1 + colour) / (1 - colour), rel=0.15)


def test_newey_west_leaves_white_residuals_alone() -> None:
    rng = np.random.default_rng(2)
    gradient = rng.standard_normal((20_000, 2))
    residual = rng.standard_normal(20_000)
    spread = bartlett(gradient * residual[:, None], 10, np.zeros(20_000))
    np.testing.assert_allclose(np.diag(spread), 20_000, rtol=0.1)


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9])
def test_intervals_of_a_coloured_mean_cover(colour: float) -> None:
    """600 logs of 400 values: the share of 1.96 deviations that hold the truth has itself a deviation of 0.9 %. Plain
    ones of the strongest colour hold it in 35 %."""
    rng = np.random.default_rng(3)
    column, held, plain = np.ones((400, 1)), 0, 0
    for _ in range(600):
        values = coloured(rng, 400, colour)
        off = values - values.mean()
        held += abs(values.mean()) < 1.96 * np.sqrt(newey_west(column, off)[0, 0])
        plain += abs(values.mean()) < 1.96 * np.sqrt(plain_covariance(column, off)[0, 0])
    # Bartlett's weights over 20 lags miss some of a correlation that lasts 10
    assert (0.87 if colour == 0.9 else 0.92) < held / 600 < 0.975
    assert colour < 0.9 or plain / 600 < 0.5


def test_lags_are_a_twentieth_of_the_samples() -> None:
    assert [lag_count(count) for count in (5, 40, 2480)] == [1, 2, 124]


def test_no_correlation_reaches_from_log_to_log() -> None:
    residual = np.array([1.0, 2.0, 3.0, 4.0])
    apart = bartlett(residual[:, None], 1, np.array([0, 0, 1, 1]))[0, 0]
    # 1 + 4 + 9 + 16 and half of twice (1*2 + 3*4)
    assert apart == pytest.approx(30 + 14)
    assert bartlett(residual[:, None], 1, np.zeros(4))[0, 0] == pytest.approx(30 + 20)
    # of four values less one, over 4^2; one lag is two of four rows: 1.96 becomes the quantile of a half, 3.48
    widened = (1.96 + 2.9694 / 2 + 0.4160 / 4 - 0.5324 / 8) / 1.96
    assert newey_west(np.ones((4, 1)), residual)[0, 0] == pytest.approx(widened**2 * 50 / 16 * 4 / 3)


def clustered_problem(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A line fitted to 40 clusters of 15 values that share an offset: gradient, values, labels."""
    rng = np.random.default_rng(seed)
    cluster = np.repeat(np.arange(40), 15)
    place = np.tile(np.linspace(0, 1, 15), 40)
    gradient = np.stack([np.ones_like(place), place], axis=1)
    return gradient, rng.standard_normal(40)[cluster] + 0.3 * rng.standard_normal(len(cluster)), cluster


def test_clusters_give_the_spread_of_repeated_sampling_where_plain_fails() -> None:
    estimates, clustered, plain = [], [], []
    for seed in range(300):
        gradient, values, cluster = clustered_problem(seed)
        estimate = np.linalg.lstsq(gradient, values, rcond=None)[0]
        residual = gradient @ estimate - values
        estimates.append(estimate)
        clustered.append(np.diag(clustered_covariance(gradient, residual, cluster)))
        plain.append(np.diag(plain_covariance(gradient, residual)))
    spread = np.var(estimates, axis=0)
    np.testing.assert_allclose(np.mean(clustered, axis=0), spread, rtol=0.2)
    # 15 values with a common offset: the mean is 3.6 times less certain than 600 white values would leave it
    assert np.mean(plain, axis=0)[0] < 0.5 * spread[0]


def test_clusters_are_left_out_one_by_one() -> None:
    # of a linear problem the first order is exact: the covariance is that of real fits without each cluster
    gradient, values, cluster = clustered_problem(0)
    few = cluster < 5
    gradient, values, cluster = gradient[few], values[few], cluster[few]
    without = np.array([np.linalg.lstsq(gradient[cluster != g], values[cluster != g], rcond=None)[0] for g in range(5)])
    expected = 4 / 5 * (without - without.mean(axis=0)).T @ (without - without.mean(axis=0))
    residual = gradient @ np.linalg.lstsq(gradient, values, rcond=None)[0] - values
    np.testing.assert_allclose(clustered_covariance(gradient, residual, cluster), expected, rtol=1e-9)


def test_correlation_has_ones_on_its_diagonal() -> None:
    found = correlation(np.array([[4.0, -3.0], [-3.0, 9.0]]))
    np.testing.assert_allclose(found, [[1.0, -0.5], [-0.5, 1.0]])


def test_autocorrelation_does_not_reach_across_clusters() -> None:
    residual = np.array([1.0, 1.0, -1.0, -1.0])
    assert autocorrelation(residual, np.array([0, 0, 1, 1])) == pytest.approx(1.0)
    assert autocorrelation(residual, np.array([0, 1, 2, 3])) == 0.0
