"""Set-valued multipliers, where a motion is about to have an event: those of (1 - q) M- + q M+ for q from 0 to 1, M-
without the event and M+ with it. Where one of them passes +1, -1 or the circle, the motion bifurcates there.

Set-valued eigenvalues of an equilibrium at a switching surface are the same of the Jacobians on its sides, and
bifurcate where one passes zero or a pair the imaginary axis; where a pair meets on the real line, a focus becomes a
node.

After a rigid touch M+ grows as the inverse of the speed, and there is no such hull.

Source: Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), equations (5), (6), (13).
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fmu_models.base.arrays import Complex
from fmu_models.continuation.problem.problem import Problem, Vector, product_of_pairs

# (m, n) multipliers or eigenvalues to (m,) numbers that change their sign where one of them passes something
Tests = Mapping[str, Callable[[Complex], Complex]]

SHARES = 2001  # shares that are looked at
REAL = 1e-9  # below that an imaginary part is rounding


def hull_crossings(problem: Problem, without: Vector, with_it: Vector) -> dict[str, list[float]]:
    """Shares q at which a multiplier of (1 - q) M- + q M+ is at +1, -1, or, in a pair, on the unit circle."""

    def own(q: Vector) -> Complex:
        return problem.own(hull(without, with_it, q))

    tests: Tests = {
        "+1": lambda spectrum: np.prod(spectrum - 1.0, axis=1),
        "-1": lambda spectrum: np.prod(spectrum + 1.0, axis=1),
        "circle": lambda spectrum: _pairs(spectrum, lambda a, b: a * b - 1.0),
    }
    return _crossings(own, tests, "circle")


def eigenvalue_crossings(minus: Vector, plus: Vector) -> dict[str, list[float]]:
    """Shares q at which an eigenvalue of (1 - q) J- + q J+ is "zero", a pair on the "imaginary axis", or a pair a
    "double" one on the real line."""
    tests: Tests = {
        "zero": lambda eigenvalues: np.prod(eigenvalues, axis=1),
        "imaginary axis": lambda eigenvalues: _pairs(eigenvalues, lambda a, b: a + b),
        "double": lambda eigenvalues: _pairs(eigenvalues, lambda a, b: (a - b) ** 2),
    }
    return _crossings(lambda q: hull(minus, plus, q), tests, "imaginary axis")


def hull(without: Vector, with_it: Vector, q: Vector) -> Complex:
    """(m, n) eigenvalues at shares (m,)."""
    share = q[:, None, None]
    return np.linalg.eigvals((1.0 - share) * without + share * with_it).astype(complex)


def _pairs(spectrum: Complex, function: Callable[[Any, Any], Any]) -> Complex:
    n = spectrum.shape[1]
    pairs = [function(spectrum[:, i], spectrum[:, j]) for i in range(n) for j in range(i)]
    return product_of_pairs(np.array(pairs)) if pairs else np.ones(len(spectrum), complex)


def _crossings(spectrum_at: Callable[[Vector], Complex], tests: Tests, paired: str) -> dict[str, list[float]]:
    """Shares at which tests change their signs, of the one that is ``paired`` with complex numbers alone."""
    shares = np.linspace(0.0, 1.0, SHARES)
    scanned = spectrum_at(shares)
    crossings: dict[str, list[float]] = {}
    for name, function in tests.items():

        def value(q: float, function: Any = function) -> float:
            return float(np.real(function(spectrum_at(np.array([q])))[0]))

        values = np.real(function(scanned))
        places = np.flatnonzero(values[:-1] * values[1:] < 0.0)
        roots = [float(np.asarray(brentq(value, shares[i], shares[i + 1], xtol=1e-14))) for i in places]
        roots += [float(q) for q in shares[1:-1][values[1:-1] == 0.0]]
        if name == paired:
            roots = [q for q in roots if (np.abs(spectrum_at(np.array([q])).imag) > REAL).any()]
        if roots:
            crossings[name] = sorted(roots)
    return crossings
