"""Set-valued multipliers, where a motion is about to have an event: those of (1 - q) M- + q M+ for q from 0 to 1, M-
without the event and M+ with it. Where one of them passes +1, -1 or the circle, the motion bifurcates there.

After a rigid touch M+ grows as the inverse of the speed, and there is no such hull.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from fmu_models.analyses.continuation.problem import Problem, Vector

# shares that are looked at
SHARES = 2001


def hull_crossings(problem: Problem, without: Vector, with_it: Vector) -> dict[str, list[float]]:
    """Shares q at which a multiplier of (1 - q) M- + q M+ is at +1, -1, or, in a pair, on the unit circle."""

    def own(q: Vector) -> NDArray[np.complex128]:
        share = q[:, None, None]
        return problem.own(np.linalg.eigvals((1.0 - share) * without + share * with_it).astype(complex))

    def circle(found: NDArray[np.complex128]) -> NDArray[np.complex128]:
        n = found.shape[1]
        pairs = [found[:, i] * found[:, j] - 1.0 for i in range(n) for j in range(i)]
        return np.prod(pairs, axis=0) if pairs else np.ones(len(found), complex)

    functions: dict[str, Callable[[NDArray[np.complex128]], NDArray[np.complex128]]] = {
        "+1": lambda found: np.prod(found - 1.0, axis=1),
        "-1": lambda found: np.prod(found + 1.0, axis=1),
        "circle": circle,
    }
    shares = np.linspace(0.0, 1.0, SHARES)
    scanned = own(shares)
    crossings: dict[str, list[float]] = {}
    for name, function in functions.items():

        def value(q: float, function: Any = function) -> float:
            return float(np.real(function(own(np.array([q])))[0]))

        values = np.real(function(scanned))
        places = np.flatnonzero(values[:-1] * values[1:] < 0.0)
        roots = [float(np.asarray(brentq(value, shares[i], shares[i + 1], xtol=1e-14))) for i in places]
        if name == "circle":
            roots = [q for q in roots if (np.abs(own(np.array([q])).imag) > 1e-9).any()]
        if roots:
            crossings[name] = roots
    return crossings
