"""Periodic motions of forced oscillators, by Newton's method on the exact map over a period, and their multipliers.

P(x) = state one period after state x;  P(x*) = x*;  multipliers = eigenvalues of dP/dx at x*
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.errors import StickslipError
from fmu_models.simulation.fmu import Fmu
from fmu_models.simulation.tangent import flow_derivative

STEPS = 30


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion.

    Attributes:
        period: s.
        start: states at the start time, by name.
        monodromy: (n, n) derivative of the map over a period at the start.
        multipliers: (n,) its eigenvalues, largest modulus first.
        residual: largest distance by which the motion misses its start after a period.
    """

    period: float
    start: Mapping[str, float]
    monodromy: NDArray[np.float64]
    multipliers: NDArray[np.complex128]
    residual: float

    @property
    def stable(self) -> bool:
        """Whether every multiplier lies inside the unit circle."""
        return bool(np.abs(self.multipliers).max() < 1.0)


def orbit_at(fmu: Fmu, period: float, start: Mapping[str, float], *, start_time: float = 0.0, **run: Any) -> Orbit:
    """What the motion from ``start`` does over one period; run: parameters, inputs, tolerance of ``flow_derivative``.

    Raises:
        StickslipError: as for ``flow_derivative``.
    """
    found = flow_derivative(fmu, start_time + period, start_time=start_time, start=start, **run)
    multipliers = np.linalg.eigvals(found.by_start).astype(complex)
    multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
    begin = np.array([start.get(name, _start(fmu, name)) for name in found.states])
    residual = float(np.abs(found.end - begin).max())
    return Orbit(period, dict(zip(found.states, begin, strict=True)), found.by_start, multipliers, residual)


def find_orbit(
    fmu: Fmu,
    period: float,
    guess: Mapping[str, float],
    *,
    start_time: float = 0.0,
    accuracy: float = 1e-11,
    **run: Any,
) -> Orbit:
    """The periodic motion near a guess, stable or not.

    Args:
        period: s, of the motion: a multiple of that of the forcing.
        guess: states at ``start_time``.
        accuracy: by which start and end may differ, relative to the size of the states.
        run: parameters, inputs, tolerance of ``flow_derivative``.

    Raises:
        StickslipError: Newton's method does not converge; says how far it came.
    """
    states = fmu.states
    x = np.array([guess.get(name, _start(fmu, name)) for name in states])
    gap = np.inf
    for _ in range(STEPS):
        begin = dict(zip(states, x.tolist(), strict=True))
        found = flow_derivative(fmu, start_time + period, start_time=start_time, start=begin, **run)
        gap = float(np.abs(found.end - x).max())
        if gap <= accuracy * max(1e-3, float(np.abs(x).max())):
            return orbit_at(fmu, period, begin, start_time=start_time, **run)
        try:
            x = x - np.linalg.solve(found.by_start - np.eye(len(x)), found.end - x)
        except np.linalg.LinAlgError:
            break
        if not np.isfinite(x).all():
            break
    raise StickslipError(
        f"No motion of period {period:g} s was found from that guess: after {STEPS} steps at most it still misses its "
        f"start by {gap:.2g}. Start nearer, for example from a long run, or check the period."
    )


def _start(fmu: Fmu, state: str) -> float:
    return float(fmu.variables[state].start or 0.0)
