"""Drive ripple: its size, its lock to the angle, its correlation."""

from __future__ import annotations

import numpy as np
import pytest

from rig_io.bench.drive import Ripple


def ripple(nominal: float, duration: float, seed: int = 0, **settings: float) -> tuple[np.ndarray, np.ndarray]:
    rngs = np.random.default_rng(seed), np.random.default_rng(seed + 1)
    return Ripple(**settings).speed(nominal, duration, *rngs)[:2]


@pytest.mark.parametrize("nominal", [0.2, 0.83, -0.5, 2.7])
def test_the_whole_stays_within_eight_per_mille(nominal: float) -> None:
    time, speed = ripple(nominal, 25.0)
    assert time[0] == 0.0 and time[-1] == pytest.approx(25.0)
    departure = np.abs(speed / nominal - 1.0)
    assert 0.004 < departure.max() <= 0.008


def test_harmonics_are_locked_to_the_angle_of_the_drive() -> None:
    _, speed = ripple(0.83, 200.0, noise=0.0)
    angle = np.concatenate([[0.0], np.cumsum(0.0005 * (speed[1:] + speed[:-1]))])
    basis = np.stack([f(n * angle) for n in (1, 8) for f in (np.sin, np.cos)], axis=1)
    fit, *_ = np.linalg.lstsq(basis, speed / 0.83 - 1.0, rcond=None)
    np.testing.assert_allclose(np.hypot(fit[::2], fit[1::2]), [0.004, 0.001], rtol=1e-6)
    np.testing.assert_allclose(basis @ fit, speed / 0.83 - 1.0, atol=1e-9)


def test_noise_has_the_stated_size_and_correlation() -> None:
    _, speed = ripple(1.0, 400.0, once=0.0, eighth=0.0)
    noise = speed - 1.0
    # the cut at two standard deviations takes 8 % off the standard deviation; 2000 independent stretches give 2 %
    assert noise.std() == pytest.approx(0.0015 * 0.92, rel=0.07)
    lagged = np.corrcoef(noise[:-100], noise[100:])[0, 1]
    assert lagged == pytest.approx(np.exp(-1), abs=0.06)


def test_a_seed_repeats_the_drive() -> None:
    np.testing.assert_array_equal(ripple(0.83, 3.0)[1], ripple(0.83, 3.0)[1])
    assert not np.array_equal(ripple(0.83, 3.0)[1], ripple(0.83, 3.0, seed=1)[1])


def test_a_specimen_may_be_anywhere_in_its_turn() -> None:
    """Over many specimens the unevenness at a given angle has no mean, whatever that angle is."""
    for begin in range(4):
        uneven = Ripple(once=0.1, eighth=0.0, noise=0.0)
        starts = [
            uneven.speed(1.0, 0.001, np.random.default_rng(seed), np.random.default_rng(begin))[1][0]
            for seed in range(600)
        ]
        # a sine of an even phase: 0.1/sqrt(2 * 600) = 0.003
        assert abs(np.mean(starts) - 1.0) < 0.012
        assert np.std(starts) == pytest.approx(0.1 / np.sqrt(2), rel=0.1)
