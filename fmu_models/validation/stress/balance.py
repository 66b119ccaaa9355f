"""The energy balance of a run: E at the end of a stretch without event, minus E at its start, against the powers.

The integral of the powers is taken by tanh-sinh quadrature, whose nodes crowd doubly exponentially at both ends, where
the layers of stiff laws are; stretches that it does not resolve are cut in four, twice at most, and else not judged.

Source: Takahasi and Mori, Double exponential formulas for numerical integration (1974).
"""

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fmu_models.language.contact_kinds import CHATTERING
from fmu_models.simulation.trajectory import Trajectory
from fmu_models.validation.stress.equations import StressFindings
from fmu_models.validation.stress.jumps import leeway

Run = Callable[[NDArray[np.float64]], Trajectory]

_STEP = 0.125
_U = np.arange(-26, 27) * _STEP
_PLACES = 1.0 / (1.0 + np.exp(-np.pi * np.sinh(_U)))  # in (0, 1)
_WEIGHTS = _STEP * np.pi * np.cosh(_U) * _PLACES * (1.0 - _PLACES)

MOST = 24  # stretches judged of one run
ROUNDS = 3
RESOLVED = 1e-10
ROUNDING = 64 * 2.0**-53


def stretches(trajectory: Trajectory) -> list[tuple[float, float]]:
    """Ends of stretches without event, evenly chosen of all; those too short for the digits of time are left out."""
    times = trajectory.time
    ends = [times[0], *sorted({event.time for event in trajectory.events}), times[-1]]
    intervals = []
    for a, b in itertools.pairwise(ends):
        off = leeway(trajectory, b)
        if b - a > 2.0**20 * off:
            intervals.append((a + off, b - off))
    chosen = np.unique(np.linspace(0, len(intervals) - 1, min(MOST, len(intervals))).astype(int)) if intervals else []
    return [intervals[i] for i in chosen]


def nodes(pieces: list[tuple[float, float]]) -> NDArray[np.float64]:
    """Times (n,) of all nodes with the ends of the stretches, ascending."""
    inner = [a + (b - a) * _PLACES for a, b in pieces]
    return np.unique(np.concatenate([*inner, np.ravel(pieces)]))


def imbalance(run: Run, first: Trajectory, gross: float) -> tuple[StressFindings, int]:
    """Largest imbalance of the stretches that could be resolved, and how many these were.

    It is relative to energies and work of a stretch, but to no less than rounding of the ``gross`` energy, J, explains.
    """
    pieces = stretches(first)
    worst, judged = StressFindings(0.0, ""), 0
    for _ in range(ROUNDS):
        if not pieces:
            break
        trajectory = run(nodes(pieces))
        remainder: list[tuple[float, float]] = []
        for a, b in pieces:
            error = _of_piece(trajectory, a, b, gross)
            if error is None:
                cuts = np.linspace(a, b, 5)
                remainder += list(zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))
                continue
            judged += 1
            if error > worst.error:
                worst = StressFindings(error, f"energy from {a:.6g} s to {b:.6g} s")
        pieces = remainder[: 4 * MOST]
    return worst, judged


def _of_piece(trajectory: Trajectory, a: float, b: float, gross_energy: float) -> float | None:
    """Relative imbalance of one stretch; None if the quadrature does not resolve it."""
    times = np.clip(a + (b - a) * _PLACES, a, b)
    rows = np.searchsorted(trajectory.time, times)
    first, end = np.searchsorted(trajectory.time, [a, b])
    states = [name for name in trajectory.values if name.endswith("_state")]
    if any((trajectory[name][first : end + 1] == CHATTERING).any() for name in states):
        return 0.0
    with np.errstate(all="ignore"):
        power = trajectory["power_input"][rows] - trajectory["power_dissipated"][rows]
        gross = np.abs(trajectory["power_input"][rows]) + np.abs(trajectory["power_dissipated"][rows])
        if "power_stops" in trajectory.values:
            power = power - trajectory["power_stops"][rows]
            gross = gross + np.abs(trajectory["power_stops"][rows])
        fine = (b - a) * float(np.sum(_WEIGHTS * power))
        coarse = (b - a) * float(np.sum(2.0 * _WEIGHTS[::2] * power[::2]))
        energy = trajectory["energy"]
        size = float(np.abs(energy).max()) + (b - a) * float(np.sum(_WEIGHTS * gross))
        if not np.isfinite([fine, coarse, size]).all():
            return None
        if size == 0.0:
            return 0.0
        if abs(fine - coarse) > RESOLVED * size:
            return None
        wrong = abs(float(energy[end] - energy[first]) - fine) - ROUNDING * gross_energy
        return max(0.0, wrong) / size
