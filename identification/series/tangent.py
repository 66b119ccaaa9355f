"""The largest exponent from local linear maps, corrected for noise: what a difference grows by along the series.

    y(t + s) = a + J (y(t) - y(t0)) over the neighbours of y(t0),    lambda = mean of ln |R_11| / s,    J Q = Q' R

y are principal components of a window, in which noise has a known variance. Among neighbours the covariance of y is
that of the motion and the noise; the noise is taken off in directions that stand clear of it, and the others are left
out: without that J comes out small, and the exponent with it. So many neighbours are taken at each point as the motion
needs to stand clear. Windows and dimensions are judged by how well the maps foretell the series, and those that do
about equally well are averaged; their spread counts as error.

Sources: Sano, Sawada, Phys. Rev. Lett. 55 (1985); Eckmann, Kamphorst, Ruelle, Ciliberto, Phys. Rev. A 34 (1986).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.series.embedding import windowed

COUNTS = (15, 30, 60, 120, 240)  # neighbours
# variances of noise, which the widest direction of a neighbourhood has to have, alone and summed over neighbours
CLEAR, KNOWN = 10.0, 600.0
KEPT, SLOPED = 2.0, 150.0  # the same of each direction that counts: slopes that are noise make differences grow
THIN = 1e-3  # of the variance along the widest direction, below which one is curvature
FAST = 0.5  # exponent times cycle, from which maps over half a cycle are looked at too
EQUAL = 1.15  # times the best error of prediction
SETTLE = 20  # maps until differences lie along the fastest direction
REFERENCES = 1500  # maps that are computed, at most
LIBRARY = 12000  # points among which neighbours are looked for
BATCHES = 20


@dataclass(frozen=True)
class Tangent:
    """value, error: exponent per sample and its standard deviation, by batches and by the spread over ``choices``
    (window, dimension, exponent each); foretold: error of prediction over a cycle, in parts of the rms."""

    value: float
    error: float
    foretold: float
    choices: tuple[tuple[int, int, float], ...]


@dataclass(frozen=True)
class _Choice:
    """foretold: error of prediction; window, dimension; rates: (n,) growth a sample; lost: share of maps whose
    neighbourhoods do not stand clear of noise."""

    foretold: float
    window: int
    dimension: int
    rates: np.ndarray
    lost: float


def tangent_exponent(x: np.ndarray, cycle: int, windows: Sequence[int], noise: float) -> Tangent:
    """Of a series (n,) of unit variance. cycle: samples; windows: samples, of which the best are taken."""
    kept = _choices(x, cycle, cycle, windows, noise)
    foretold = min(choice.foretold for choice in kept)
    if np.mean([choice.rates.mean() for choice in kept]) * cycle > FAST and cycle > 1:
        # over half a cycle noise counts twice, and over a whole one folds do: their difference is an error of either
        kept += _choices(x, cycle, cycle // 2, windows, noise)
    values = np.array([choice.rates.mean() for choice in kept])
    batches = np.array([batch.mean() for batch in np.array_split(kept[0].rates, BATCHES)])
    spread = values.std(ddof=1) if len(values) > 1 else 0.0
    # where noise hides the neighbourhoods the maps say little, and nobody knows how little
    unknown = np.mean([choice.lost for choice in kept]) * np.abs(values.mean())
    error = np.sqrt(batches.var(ddof=1) / BATCHES + spread**2 + unknown**2)
    choices = tuple((choice.window, choice.dimension, float(choice.rates.mean())) for choice in kept)
    return Tangent(float(values.mean()), float(error), foretold, choices)


def _choices(x: np.ndarray, cycle: int, step: int, windows: Sequence[int], noise: float) -> list[_Choice]:
    """Those that foretell best by maps over ``step`` samples."""
    choices = []
    for window in sorted({max(window, 2) for window in windows}):
        for dimension in (4, 6) if window >= 6 else (window,):
            jacobians, error, lost = _local_maps(windowed(x, window, dimension), x, window, step, cycle, noise)
            choices.append(_Choice(error, window, dimension, growth(jacobians)[SETTLE:] / step, lost))
    best = min(choice.foretold for choice in choices)
    return [choice for choice in choices if choice.foretold <= EQUAL * best]


def growth(jacobians: np.ndarray) -> np.ndarray:
    """Logarithms (n,) of what the fastest difference grows by in each of successive maps (n, d, d)."""
    grown = np.empty(len(jacobians))
    direction = np.ones(jacobians.shape[1])
    for i, jacobian in enumerate(jacobians):
        direction = jacobian @ (direction / np.linalg.norm(direction))
        # a map that takes every difference away starts anew: noise, not the motion, decided its directions
        grown[i] = np.log(np.linalg.norm(direction)) if np.any(direction) else 0.0
        direction = direction if np.any(direction) else np.ones(len(direction))
    return grown


def _local_maps(
    points: np.ndarray, x: np.ndarray, window: int, step: int, apart: int, noise: float
) -> tuple[np.ndarray, float, float]:
    """Successive maps (n, d, d) over ``step`` samples, the rms error by which they foretell ``x``, and the share of
    them whose neighbourhoods noise hides."""
    from scipy.spatial import KDTree

    count = min(len(points) - step, len(x) - window + 1 - step)
    future = x[window - 1 + step :]
    references = np.arange(0, count - step, step)[:REFERENCES]
    library = np.arange(0, count, max(count // LIBRARY, max(apart // 8, 1)))
    stride = int(library[1])
    queried = min(COUNTS[-1] + 2 * (apart // stride) + 2, len(library))
    _, index = KDTree(points[library]).query(points[references], k=queried)
    neighbours = library[index]
    near_in_time = np.abs(neighbours - references[:, None]) <= apart
    neighbours = np.take_along_axis(neighbours, np.argsort(near_in_time, axis=1, kind="stable"), 1)
    fewest = int(queried - near_in_time.sum(1).max())
    dimension = points.shape[1]
    jacobians = np.zeros((len(references), dimension, dimension))
    errors, todo, lost = np.zeros(len(references)), np.arange(len(references)), 0
    # more neighbours than a tenth of all are no neighbourhood
    counts = [k for k in COUNTS if k <= min(fewest, max(len(library) // 10, COUNTS[0]))] or [fewest]
    for k in counts:
        if not len(todo):
            lost = 0
            break
        rows, at = neighbours[todo, :k], references[todo]
        near = points[rows] - points[at][:, None]
        ends = np.concatenate(
            [points[rows + step] - points[at + step][:, None], (future[rows] - future[at, None])[..., None]], 2
        )
        distance = np.linalg.norm(near, axis=2)
        weights = (1 - (distance / (1.0001 * distance.max(1, keepdims=True) + 1e-300)) ** 3) ** 2
        weights /= weights.sum(1, keepdims=True)
        middle, end = (np.einsum("nk,nkd->nd", weights, vectors) for vectors in (near, ends))
        near, ends = near - middle[:, None], ends - end[:, None]
        scatter = np.einsum("nk,nki,nkj->nij", weights, near, near)
        variances, axes = np.linalg.eigh(scatter)
        enough = variances > np.maximum(max(KEPT, SLOPED / k) * noise**2, THIN * variances[:, -1:])
        inverse = np.where(enough, 1 / np.where(enough, variances - noise**2, 1.0), 0.0)
        slopes = axes @ (inverse[..., None] * (axes.swapaxes(1, 2) @ np.einsum("nk,nki,nkj->nij", weights, near, ends)))
        clear = variances[:, -1] > max(CLEAR, KNOWN / k) * noise**2
        lost = int(np.sum(~clear))
        clear |= k == counts[-1]
        jacobians[todo[clear]] = slopes[clear][:, :, :dimension].swapaxes(1, 2)
        errors[todo] = end[:, -1] - np.einsum("nd,nd->n", middle, slopes[:, :, -1])
        todo = todo[~clear]
    return jacobians, float(np.sqrt(np.mean(errors**2))), lost / len(references)
