"""Numbers that tell chaos from other irregular motions: dimension, the 0-1 test, surrogates, recurrence, crossings.

Sources: Grassberger, Procaccia, Physica D 9 (1983), without pairs that are near in time (Theiler, Phys. Rev. A 34,
1986); Gottwald, Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009), with their damping of noise; Schreiber, Schmitz, Phys.
Rev. Lett. 77 (1996), for surrogates; Marwan, Romano, Thiel, Kurths, Physics Reports 438 (2007), for recurrence.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.series.divergence import resampled
from identification.series.embedding import windowed
from rig_io.logs.log import stretches

REFERENCES, LIBRARY = 800, 6000
RADII = 40
DECADE = 0.5  # of radii, over which the slope of the correlation sum is read, at least
ANGLES, LENGTH, FEWEST = 100, 3000, 50  # of the 0-1 test: angles, values at most and at least
DAMPED = 2.5  # its weight of the damping term
SURROGATES = 19  # one-sided, 5 %
ROUNDS = 60  # in which a surrogate comes to both the spectrum and the values
PREDICTED = 2048  # samples of a surrogate
RECURRENCE = 1200  # points of a plot
RATE = 0.05  # of recurrences, which sets the radius
SHORTEST = 2  # points of a diagonal


@dataclass(frozen=True)
class Dimension:
    """Correlation dimension. value, error; radii, slopes: (m,) its local slopes; plateau: radii between which it is
    read."""

    RECORD: ClassVar = ("value", "error", "plateau")

    value: float
    error: float
    radii: np.ndarray
    slopes: np.ndarray
    plateau: tuple[float, float]


def correlation_dimension(points: np.ndarray, apart: int, noise: float, seed: int = 0) -> Dimension:
    """Of points (n, d) along a series; pairs nearer than ``apart`` samples in time do not count, nor distances that are
    noise (standard deviation in each coordinate)."""
    references = np.unique(np.linspace(0, len(points) - 1, min(REFERENCES, len(points))).astype(int))
    library = np.arange(0, len(points), max(len(points) // LIBRARY, 1))
    rows = []
    for at in references:
        distance = np.linalg.norm(points[library] - points[at], axis=1)
        rows.append(np.sort(distance[np.abs(library - at) > apart]))
    sample = np.concatenate([row[:: max(len(row) // 200, 1)] for row in rows])
    low = max(4 * noise * np.sqrt(points.shape[1]), float(np.quantile(np.concatenate([r[:2] for r in rows]), 0.7)))
    radii = np.geomspace(min(low, 0.5 * np.median(sample)), float(np.median(sample)), RADII)
    counts = np.array([np.searchsorted(row, radii) / max(len(row), 1) for row in rows])
    slopes = np.gradient(np.log(np.maximum(counts.mean(0), 1e-12)), np.log(radii))
    span = max(int(DECADE * np.log(10) / np.log(radii[1] / radii[0])), 4)
    span = min(span, RADII - 2)
    starts = range(RADII - span)
    first = min(starts, key=lambda i: float(np.std(slopes[i : i + span])))
    inside = slice(first, first + span + 1)
    drawn = np.log(np.maximum(resampled(counts[:, inside], np.random.default_rng(seed)), 1e-12))
    scatter = np.polyfit(np.log(radii[inside]), drawn.T, 1)[0].std(ddof=1)
    error = np.hypot(scatter, np.std(slopes[inside], ddof=1))
    return Dimension(
        float(slopes[inside].mean()), float(error), radii, slopes, (float(radii[first]), float(radii[first + span]))
    )


def zero_one_test(x: np.ndarray, every: int, *, seed: int = 0) -> tuple[float, float] | None:
    """K, near 0 of regular and near 1 of chaotic motion, and half its interquartile range over angles; None where the
    values are fewer than 50. every: samples between the values, a cycle, for more of them hide its irregularity."""
    values = x[::every][-LENGTH:]
    if len(values) < FEWEST:
        return None
    values = values - values.mean()  # an offset oscillates in what follows, and is no motion
    lags = np.arange(1, len(values) // 10 + 1)
    steps = np.arange(1, len(values) + 1)
    correlations = []
    for angle in np.random.default_rng(seed).uniform(np.pi / 5, 4 * np.pi / 5, ANGLES):
        path = np.cumsum(values * np.exp(1j * angle * steps))
        count = len(values) - lags[-1]
        spread = np.array([np.mean(np.abs(path[lag : lag + count] - path[:count]) ** 2) for lag in lags])
        spread += DAMPED * values.var() * np.sin(np.sqrt(2) * lags)  # against noise
        correlations.append(np.corrcoef(lags, spread)[0, 1])
    low, middle, high = np.quantile(correlations, (0.25, 0.5, 0.75))
    return float(middle), float(high - low) / 2


def surrogate(x: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A series with the spectrum and the values of another one, and nothing else of it."""
    ordered, amplitudes = np.sort(x), np.abs(np.fft.rfft(x))
    made = random.permutation(x)
    for _ in range(ROUNDS):
        phases = np.exp(1j * np.angle(np.fft.rfft(made)))
        made = ordered[np.argsort(np.argsort(np.fft.irfft(amplitudes * phases, len(x)), kind="stable"), kind="stable")]
    return made


def surrogate_test(x: np.ndarray, cycle: int, window: int, seed: int = 0) -> tuple[float, float]:
    """Share of surrogates that are foretold as well as the series (below .05: it is no linear stochastic process), and
    error of prediction of the series over the mean of theirs."""
    random = np.random.default_rng(seed)
    every = max(cycle // 10, 1)
    values, ahead = x[::every][-PREDICTED:], max(cycle // (2 * every), 1)
    short = max(window // every, 2)
    own_error = _prediction_error(values, short, ahead, max(cycle // every, 1))
    others = [
        _prediction_error(surrogate(values, random), short, ahead, max(cycle // every, 1)) for _ in range(SURROGATES)
    ]
    return float(np.mean([own_error >= error for error in others])), own_error / float(np.mean(others))


def _prediction_error(x: np.ndarray, window: int, ahead: int, apart: int) -> float:
    """Of a local mean over six neighbours, rms."""
    from scipy.spatial import KDTree

    points = windowed(x, window, 4)[:-ahead]
    future = x[window - 1 + ahead :]
    _, index = KDTree(points).query(points, k=min(6 + 2 * apart + 1, len(points)))
    away = np.abs(index - np.arange(len(points))[:, None]) > apart
    order = np.argsort(~away, axis=1, kind="stable")[:, :6]
    return float(np.sqrt(np.mean((future[np.take_along_axis(index, order, 1)].mean(1) - future) ** 2)))


@dataclass(frozen=True, eq=False)
class Recurrence:
    """A recurrence plot and its numbers. matrix: (m, m); every: samples between its points; radius: of recurrences, by
    which ``rate`` of pairs recur; determinism: their share on diagonals; longest, mean_length: of diagonals, in points;
    entropy: of their lengths, nats; laminarity: share on verticals."""

    RECORD: ClassVar = ("rate", "determinism", "longest", "mean_length", "entropy", "laminarity")

    matrix: np.ndarray
    every: int
    radius: float
    rate: float
    determinism: float
    longest: int
    mean_length: float
    entropy: float
    laminarity: float


def recurrence(points: np.ndarray, every: int, apart: int = 1) -> Recurrence:
    """Of the last points (n, d) of a series, every so many; those nearer than ``apart`` in time do not count."""
    seen = points[::every][-RECURRENCE:]
    distance = np.linalg.norm(seen[:, None] - seen[None], axis=2)
    away = np.abs(np.subtract.outer(np.arange(len(seen)), np.arange(len(seen)))) > max(apart // every, 1)
    radius = float(np.quantile(distance[away], RATE))
    matrix = distance <= radius
    counted = matrix & away
    diagonals = np.concatenate([_runs(np.diagonal(counted, k)) for k in range(1, len(seen))])
    uprights = np.concatenate([_runs(column) for column in counted.T])
    long = diagonals[diagonals >= SHORTEST]
    shares = np.unique(long, return_counts=True)[1] / max(len(long), 1)
    return Recurrence(
        *(matrix, every, radius, float(counted.sum() / away.sum())),
        float(long.sum() / max(diagonals.sum(), 1)),
        int(long.max(initial=0)),
        float(long.mean()) if len(long) else 0.0,
        float(-np.sum(shares * np.log(shares))),
        float(uprights[uprights >= SHORTEST].sum() / max(uprights.sum(), 1)),
    )


def _runs(marked: np.ndarray) -> np.ndarray:
    """Lengths of runs of what is true."""
    return np.diff(stretches(marked)).ravel()


def level_crossings(x: np.ndarray, level: float | None = None, dead_band: float = 0.0) -> np.ndarray:
    """Where (samples, between them by a straight line) a series (n,) crosses a level, by default its mean, upwards. A
    crossing counts once the series was ``dead_band`` below the level before it and gets as far above after it, so that
    noise does not cross; it is the middle one of those that noise makes of it."""
    y = x - (x.mean() if level is None else level)
    side = np.where(y > dead_band, 1, np.where(y < -dead_band, -1, 0))
    sure = np.flatnonzero(side)
    ups = np.flatnonzero((side[sure[:-1]] < 0) & (side[sure[1:]] > 0))
    crossings = []
    for before, after in zip(sure[ups], sure[ups + 1], strict=True):
        between = y[before : after + 1]
        rises = np.flatnonzero((between[:-1] <= 0) & (between[1:] > 0))
        at = int(rises[len(rises) // 2])
        crossings.append(before + at - between[at] / (between[at + 1] - between[at]))
    return np.array(crossings)
