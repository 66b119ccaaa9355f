"""The uncertainty exponent of the borders between basins, from labels on a grid.

Of starts with an error d the share N(d) that may come to another attractor grows as d to a power: 1 where the border is
smooth, n - D where it has the dimension D < n. Along each axis of the grid N(d) is counted at distances of 1, 2, 4, ...
cells, from the same starts each; the power is that of the axis along which it is least. Its standard error holds what
SLABS of the grid say of it, and how far the shares lie off a power.

Source: McDonald, Grebogi, Ott, Yorke, Fractal basin boundaries, Physica D 17 (1985).
"""

import math

import numpy as np

from fmu_models.base.arrays import Integers

SLABS, FEWEST, LEAST = 16, 8, 3  # parts of the grid; pairs that differ at a distance, and distances, at the least
LONGEST = 8  # the longest distance is so many times in an axis
FILLED = 0.5  # share of what mixed labels would show, above which distances say nothing


def uncertainty_exponent(labels: Integers) -> tuple[float, float]:
    """The exponent of labels on a grid of any dimension, and its standard error; nan where the grid is too coarse."""
    shares = np.unique(labels, return_counts=True)[1] / labels.size
    most = FILLED * (1.0 - float(shares @ shares)) * labels.size
    powers = [_along(np.moveaxis(labels, axis, 0), most) for axis in range(labels.ndim)]
    return min((power for power in powers if math.isfinite(power[0])), default=(math.nan, math.nan))


def _along(labels: Integers, most: float) -> tuple[float, float]:
    """The power along the first axis, as far as no more than so many pairs differ."""
    distances, counts = [], []
    window = len(labels) - len(labels) // LONGEST
    for distance in (2**k for k in range((len(labels) // LONGEST).bit_length())):
        differs = labels[distance : distance + window] != labels[:window]
        if differs.sum() > most:
            break
        if differs.sum() >= FEWEST:
            distances.append(distance)
            slabs = np.array_split(differs, SLABS, axis=min(1, labels.ndim - 1))
            counts.append([float(slab.sum()) for slab in slabs])
    if len(distances) < LEAST:
        return math.nan, math.nan
    x, pairs = np.log(distances), np.array(counts)
    remaining = np.column_stack([pairs.sum(axis=1), pairs.sum(axis=1, keepdims=True) - pairs])  # all, and without one
    y = np.log(remaining[:, (remaining > 0.0).all(axis=0)])
    slopes, heights = np.polyfit(x, y, 1)
    misses = y[:, 0] - slopes[0] * x - heights[0]
    off = float(misses @ misses) / (len(x) - 2) / (len(x) * x.var())
    jackknife = (len(slopes) - 2) * slopes[1:].var() if len(slopes) > 1 else 0.0
    return float(slopes[0]), math.sqrt(off + jackknife)
