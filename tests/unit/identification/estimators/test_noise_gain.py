"""What a window of a local polynomial makes of the noise of the angle, against fits of NumPy to unit impulses."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimators.savitzky_golay import ORDER, _noise_gain, _window_gain
from identification.measurement.pooled import RigValues

STEP = 0.02
RIG = RigValues(J=1.3, k=48.0, c=9.0, R=0.1, r=0.05, forces=(20.0,))


def answers(count: int) -> np.ndarray:
    """(count, count): J th'' + c th' + k th at each sample of a window, to an impulse of each sample's angle."""
    time = np.arange(count) * STEP
    columns = []
    for impulse in np.eye(count):
        fit = np.polynomial.Polynomial.fit(time, impulse, ORDER)
        columns.append(RIG.J * fit.deriv(2)(time) + RIG.c * fit.deriv()(time) + RIG.k * fit(time))
    return np.array(columns).T


@pytest.mark.parametrize("memory", [0.0, 2.5])
def test_deviation_of_the_equation_of_motion_at_each_sample(memory: float) -> None:
    count = 11
    lag = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    noise = np.exp(-lag / memory) if memory else np.eye(count)
    weights = answers(count)
    expected = np.sqrt(np.diag(weights @ noise @ weights.T))
    assert _window_gain(count, STEP, RIG, memory) == pytest.approx(expected, rel=1e-9)


def test_samples_inside_a_segment_have_a_window_around_them() -> None:
    one = _window_gain(7, STEP, RIG, 0.0)
    gain = _noise_gain(12, 7, STEP, RIG)
    assert gain == pytest.approx([*one[:3], *[one[3]] * 6, *one[4:]], rel=1e-12)
