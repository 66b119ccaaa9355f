"""What designed motions and signals share: Fourier series, and the search for the best from random draws.

q(t) = middle + sum_h (a_h sin h w t + b_h cos h w t),    w = 2 pi/period
"""

from collections.abc import Callable

import numpy as np

from fmu_models.base.arrays import Vector

DRAWS = 200
SEARCHES = 3  # from the best of the draws


def fourier(
    middle: Vector, sines: Vector, cosines: Vector, period: float, time: Vector
) -> tuple[Vector, Vector, Vector]:
    """Series with coefficients (k, harmonics), and its first and second derivatives, each (n, k) at times (n,) s."""
    wave = 2 * np.pi / period * np.arange(1, sines.shape[1] + 1)
    s, c = np.sin(np.outer(time, wave)), np.cos(np.outer(time, wave))
    q = middle + s @ sines.T + c @ cosines.T
    v = c @ (sines * wave).T - s @ (cosines * wave).T
    a = -s @ (sines * wave**2).T - c @ (cosines * wave**2).T
    return q, v, a


def best_of_draws(
    cost: Callable[[Vector], float],
    draw: Callable[[np.random.Generator], Vector],
    seed: int,
    evaluations: int,
    progress: Callable[[float], None],
) -> tuple[Vector, Vector]:
    """What costs least, (m,) by searches (Powell), each of so many evaluations, from the best of random draws; and the
    best draw."""
    from scipy.optimize import minimize

    random = np.random.default_rng(seed)
    ranked = sorted((draw(random) for _ in range(DRAWS)), key=cost)
    progress(0.2)
    optima = []
    for number, start in enumerate(ranked[:SEARCHES]):
        optima.append(minimize(cost, start, method="Powell", options={"maxfev": evaluations, "xtol": 1e-2}).x)
        progress(0.2 + 0.8 * (number + 1) / SEARCHES)
    return min((*optima, ranked[0]), key=cost), ranked[0]
