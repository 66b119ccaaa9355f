"""Control charts of what a bench's logs give, one after the other: has it changed since it was set up?

EWMA   z_i = w x_i + (1 - w) z_(i-1), z_0 the target; out of control beyond L s sqrt(w/(2-w) (1 - (1-w)^2i))
CUSUM  C+_i = max(0, C+_(i-1) + (x_i - target)/s - K), likewise C-; out of control beyond H

Target and s are mean and standard deviation of the first logs; s is no less than what a single log leaves open. With
w = 0.2, L = 3 and K = 0.5, H = 5 a bench in order is called changed once in some 500 logs. EWMA serves a slow drift,
CUSUM a small step. Source: Montgomery, Introduction to Statistical Quality Control, chapter 9.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

WEIGHT, WIDTH = 0.2, 3.0
SLACK, DECISION = 0.5, 5.0
FIRST = 4  # logs that say what is usual


@dataclass(frozen=True, eq=False)
class ControlChart:
    """target, deviation: of the first logs; level: (n,) EWMA; low, high: (n,) its limits; sums: (n,) larger of the two
    CUSUM; out: (n,) whether either chart calls. Before there are `FIRST` values nothing is called."""

    target: float
    deviation: float
    level: np.ndarray
    low: np.ndarray
    high: np.ndarray
    sums: np.ndarray
    out: np.ndarray


def control_chart(values: ArrayLike, deviations: ArrayLike) -> ControlChart:
    """The charts of values (n,) with the standard deviation (n,) of each."""
    x, sd = np.asarray(values, float), np.asarray(deviations, float)
    first = x[:FIRST]
    target = float(first.mean()) if len(first) else 0.0
    scatter = float(first.std(ddof=1)) if len(first) > 1 else 0.0
    deviation = max(scatter, float(np.median(sd[:FIRST])) if len(sd) else 0.0, 1e-12 * max(abs(target), 1e-300))
    number = np.arange(1, len(x) + 1)
    reach = WIDTH * deviation * np.sqrt(WEIGHT / (2 - WEIGHT) * (1 - (1 - WEIGHT) ** (2 * number)))
    level, sums = np.empty(len(x)), np.empty(len(x))
    z, up, down = target, 0.0, 0.0
    for i, value in enumerate(x):
        z = WEIGHT * value + (1 - WEIGHT) * z
        up = max(0.0, up + (value - target) / deviation - SLACK)
        down = max(0.0, down - (value - target) / deviation - SLACK)
        level[i], sums[i] = z, max(up, down)
    out = (np.abs(level - target) > reach) | (sums > DECISION)
    out[:FIRST] = False
    return ControlChart(target, deviation, level, target - reach, target + reach, sums, out)
