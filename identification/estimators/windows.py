"""Windows of the weak form: the bump that averages, and the whitening of windows that overlap."""

import numpy as np

from identification.measurement.pooled import RigValues

WINDOW = 0.264  # natural periods
SPACING = 0.022  # natural periods between windows
SPEED_WINDOW, SPEED_ORDER = 0.122, 4  # natural periods; order of the local polynomial that gives the slip speed
BUMP = 4  # power of 1 - s^2: three derivatives vanish at the ends, so that sums stand for integrals
UNMODELLED = 1e-3  # of the noise power, added white: no whitening matrix then trusts a direction without noise


def bump(count: int, step: float, rig: RigValues) -> tuple[np.ndarray, np.ndarray]:
    """Weights (count,) of mu, of sum 1, and weights (count,) of the angle that give the averaged friction
    coefficient."""
    s = np.linspace(-1, 1, count)
    half = 0.5 * (count - 1) * step
    inside = 1 - s**2
    bump = inside**BUMP
    first = -2 * BUMP * s * inside ** (BUMP - 1) / half
    second = (4 * BUMP * (BUMP - 1) * s**2 * inside ** (BUMP - 2) - 2 * BUMP * inside ** (BUMP - 1)) / half**2
    weights = (rig.J * second - rig.c * first + rig.k * bump) / (rig.R * rig.N)
    return bump / bump.sum(), weights / bump.sum()


def stride_of(spare: int, step: float, period: float) -> int:
    """Samples between windows: about `SPACING`, in a slip that has ``spare`` samples more than one window."""
    return max(spare // max(round(spare * step / (SPACING * period)), 1), 1)


def windows(values: np.ndarray, count: int, stride: int) -> np.ndarray:
    """The (rows, count) windows ``stride`` samples apart of (n,) values; a view.

    What `sliding_window_view` gives, in less time: a fit asks for tens of thousands.
    """
    values = np.ascontiguousarray(values)
    shape = (len(values) - count) // stride + 1, count
    return np.ndarray(shape, values.dtype, values, strides=(stride * values.itemsize, values.itemsize))


def coloured(count: int, memory: float) -> np.ndarray:
    """Covariance (count, count) of noise of first order at even samples, of unit variance. memory: samples."""
    index = np.arange(count)
    return np.exp(-np.abs(index[:, None] - index) / memory)


def whitening(weights: np.ndarray, stride: int, rows: int, memory: float = 0.0) -> np.ndarray:
    """Matrix (rows, rows) that makes the noise of windows ``stride`` samples apart white, of the variance of one
    window. memory: of the angle's noise, samples; 0 where it is white."""
    count = len(weights)
    if memory:
        # of the lag between samples of two windows, and how often each lag occurs
        lags = np.arange(1 - count, count + rows * stride)
        overlap = np.correlate(weights, weights, "full")
        by_lag = np.convolve(np.exp(-np.abs(lags) / memory), overlap, "valid")
        lagged = by_lag[::stride][:rows]
    else:
        lagged = np.array([weights[lag * stride :] @ weights[: max(count - lag * stride, 0)] for lag in range(rows)])
    index = np.arange(rows)
    covariance = lagged[np.abs(index[:, None] - index)] / lagged[0] + UNMODELLED * np.eye(rows)
    return np.linalg.inv(np.linalg.cholesky(covariance))
