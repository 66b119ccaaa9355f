"""Delay reconstruction that bears noise: a state from the samples of a window.

The delay is the first minimum of the mutual information of x(t) and x(t + delay) (Fraser, Swinney, Phys. Rev. A 33,
1986); the dimension the least at which few neighbours are false (Kennel, Brown, Abarbanel, Phys. Rev. A 45, 1992), a
difference counting only where noise does not explain it. Of all samples in the window the principal components are
taken (Broomhead, King, Physica D 20, 1986): they average noise over the window, and its variance in each of them is
that of a sample, which the components without signal show.
"""

from dataclasses import dataclass

import numpy as np

BINS = 16  # of the mutual information, equally filled
FALSE = 10.0  # times the distance of neighbours: farther apart in the next coordinate, they are false
SHARE = 0.02  # of false neighbours that noise and folds leave in any dimension
DEEPEST = 8  # dimensions that are looked at
NOISE_WINDOW = 48  # samples, whose least components tell the noise
COARSE = 0.03  # of the rms, the most that noise is taken to be where samples are too few a cycle to show it
SAMPLES = 4000  # points that judge neighbours


@dataclass(frozen=True)
class Reconstruction:
    """delay (samples); dimension; noise: standard deviation of a sample; information: (n,) mutual information over
    delays from 1; false: (n,) shares of false neighbours over dimensions from 1."""

    delay: int
    dimension: int
    noise: float
    information: np.ndarray
    false: np.ndarray


def reconstruct(x: np.ndarray, cycle: int, delay: int | None = None, dimension: int | None = None) -> Reconstruction:
    """Delay and dimension of a series (n,) whose cycle takes so many samples; those that are given stay."""
    information = mutual_information(x, max(cycle, 3))
    falls = np.flatnonzero((information[1:-1] <= information[:-2]) & (information[1:-1] < information[2:]))
    # a series that forgets within a sample has its minimum in noise
    first = int(falls[0]) + 2 if len(falls) else int(np.argmin(information)) + 1
    chosen = delay or (1 if cycle <= 2 else min(first, max(cycle // 3, 1)))
    noise = noise_level(x) if cycle > 4 else min(noise_level(x), COARSE)
    shares = false_neighbours(x, chosen, noise, cycle)
    few = np.flatnonzero(shares <= SHARE)
    least = int(few[0]) + 1 if len(few) else int(np.argmin(shares)) + 1
    return Reconstruction(chosen, dimension or max(least, 2), noise, information, shares)


def mutual_information(x: np.ndarray, longest: int) -> np.ndarray:
    """In nats, over delays of 1 to ``longest`` samples."""
    rank = np.argsort(np.argsort(x, kind="stable"), kind="stable") * BINS // len(x)
    bits = np.empty(min(longest, len(x) // 4))
    for lag in range(1, len(bits) + 1):
        joint = np.bincount(rank[:-lag] * BINS + rank[lag:], minlength=BINS**2).reshape(BINS, BINS) / (len(x) - lag)
        independent = np.outer(joint.sum(1), joint.sum(0))
        seen = joint > 0
        bits[lag - 1] = np.sum(joint[seen] * np.log(joint[seen] / independent[seen]))
    return bits


def noise_level(x: np.ndarray) -> float:
    """Standard deviation of white noise on a series that is sampled finely: that of the components without signal. Of
    a coarse series it is an upper bound."""
    window = min(NOISE_WINDOW, len(x) // 10)
    variances, _ = _components(x, window)
    return float(np.sqrt(max(np.mean(variances[-(window // 4) :]), 0.0)))


def false_neighbours(x: np.ndarray, delay: int, noise: float, apart: int) -> np.ndarray:
    """Shares over dimensions from 1; neighbours are at least ``apart`` samples apart in time."""
    from scipy.spatial import KDTree

    shares = []
    for dimension in range(1, DEEPEST + 1):
        points = delayed(x, delay, dimension + 1)
        if len(points) < 50:
            break
        stride = max(len(points) // SAMPLES, 1)
        seen = np.arange(0, len(points), stride)
        tree = KDTree(points[seen, :-1])
        distance, index = tree.query(points[seen, :-1], k=min(2 + 2 * apart // stride, 60, len(seen)))
        index = np.asarray(index)
        allowed = np.abs(seen[index] - seen[:, None]) > apart
        rows = np.flatnonzero(allowed.any(1))
        first = np.argmax(allowed[rows], 1)
        gap = np.abs(points[seen[rows], -1] - points[seen[index[rows, first]], -1])
        near = distance[rows, first]
        false = gap > np.maximum(FALSE * np.maximum(near, 1e-12), 6 * noise)
        shares.append(float(false.mean()) if len(rows) else 1.0)
    return np.array(shares)


def delayed(x: np.ndarray, delay: int, dimension: int) -> np.ndarray:
    """Delay vectors (n, dimension), the oldest sample first."""
    count = len(x) - (dimension - 1) * delay
    return np.column_stack([x[i * delay : i * delay + count] for i in range(dimension)])


def windowed(x: np.ndarray, window: int, dimension: int) -> np.ndarray:
    """The first principal components (n - window + 1, dimension) of all windows of a series."""
    _, axes = _components(x, window)
    views = np.lib.stride_tricks.sliding_window_view(x, window)
    return (views - x.mean()) @ axes[:, : min(dimension, window)]


def _components(x: np.ndarray, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Variances, largest first, and axes (window, window) of the windows of a series."""
    views = np.lib.stride_tricks.sliding_window_view(x, window)[:: max(len(x) // 20000, 1)]
    variances, axes = np.linalg.eigh(np.cov(views.T))
    return variances[::-1], axes[:, ::-1]
