"""Periodic motions by Newton's method on the exact map over a period, and their multipliers.

P(x) = state one period after state x;  P(x*) = x*;  multipliers = eigenvalues of dP/dx at x*

The period of a forced motion is given. That of an autonomous one is unknown; what fixes it, and the phase, is that a
step of Newton's method is at right angles to the flow f:

    [ dP/dx - 1   f(P(x)) ] [dx]   [ x - P(x) ]
    [  f(x)^T        0    ] [dT] = [    0     ]
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.arrays import Complex, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.newton import newton
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

STEPS, HALVINGS = 30, 3


@dataclass(frozen=True, eq=False)
class Orbit(Shown):
    """A periodic motion.

    Attributes:
        period: s.
        start: states at the start time, by name; in a stop that remembers its speed of entry also ``<stop>_memory``.
        monodromy: (n, n) derivative of the map over a period at the start.
        multipliers: (n,) its eigenvalues, largest modulus first.
        residual: largest distance by which the motion misses its start after a period.
        autonomous: nothing forces the motion: one of the multipliers, the shift along the motion, is 1.
        one_sided: the motion passes a corner, where several events come at one instant: monodromy and multipliers are
            those of neighbours on one side, and ``stable`` says nothing of the others.
    """

    period: float
    start: Mapping[str, float]
    monodromy: Vector
    multipliers: Complex
    residual: float
    autonomous: bool = False
    one_sided: bool = False

    @property
    def stable(self) -> bool:
        """Whether every multiplier, but the 1 of an autonomous motion, lies inside the unit circle."""
        others = self.multipliers
        if self.autonomous:
            others = np.delete(others, np.abs(others - 1.0).argmin())
        return bool((np.abs(others) < 1.0).all())


def orbit_at(
    fmu: Fmu,
    period: float,
    start: Mapping[str, float],
    *,
    start_time: float = 0.0,
    autonomous: bool = False,
    **run: Any,
) -> Orbit:
    """What the motion from ``start`` does over one period; run: parameters, inputs, tolerance of ``flow_derivative``.

    Errors as for ``flow_derivative``.
    """
    flow = flow_derivative(fmu, start_time + period, start_time=start_time, start=start, **run)
    multipliers = np.linalg.eigvals(flow.by_start).astype(complex)
    multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
    initial = np.array([start.get(name, fmu.start_of(name)) for name in flow.states])
    residual, states = float(np.abs(flow.end - initial).max()), dict(zip(flow.states, initial.tolist(), strict=True))
    return Orbit(period, states, flow.by_start, multipliers, residual, autonomous, flow.one_sided)


def find_orbit(
    fmu: Fmu,
    period: float,
    guess: Mapping[str, float],
    *,
    start_time: float = 0.0,
    autonomous: bool = False,
    accuracy: float = 1e-11,
    **run: Any,
) -> Orbit:
    """The periodic motion near a guess, stable or not.

    Args:
        period: s, of the motion: a multiple of that of the forcing; a guess if ``autonomous``.
        guess: states at ``start_time``; inside a stop that remembers its speed of entry also ``<stop>_memory``.
        autonomous: nothing forces the motion, and its period is to be found too.
        accuracy: by which start and end may differ, relative to the size of the states.
        run: parameters, inputs, tolerance of ``flow_derivative``.

    Raises:
        StickslipError: Newton's method does not converge; says how far it came.
    """
    states, gap = [*fmu.states, *(name for name in fmu.memories if name in guess)], np.inf
    guessed = [guess.get(name, fmu.start_of(name)) for name in states]

    def equations(points: Vector) -> tuple[Vector, Vector]:
        nonlocal gap
        x, time = points[0, : len(states)], float(points[0, -1]) if autonomous else period
        if time <= 0.0:
            return np.full_like(points, np.nan), np.full((1, len(points[0]), len(points[0])), np.nan)
        initial = dict(zip(states, x.tolist(), strict=True))
        flow = flow_derivative(fmu, start_time + time, start_time=start_time, start=initial, **run)
        matrix, miss = flow.by_start - np.eye(len(x)), flow.end - x
        gap = float(np.abs(miss).max())
        if autonomous:
            f = _rates(fmu, time, initial, start_time, **run)
            matrix, miss = np.block([[matrix, f[1][:, None]], [f[0], 0.0]]), np.append(miss, 0.0)
        return miss[None], matrix[None]

    def scale(points: Vector) -> Vector:
        return np.maximum(1e-3, np.abs(points[:, : len(states)]).max(axis=1))

    guesses = np.array([[*guessed, period] if autonomous else guessed])
    search = newton(equations, guesses, accuracy=accuracy, steps=STEPS, halvings=HALVINGS, scale=scale)
    if not search.converged.any():
        raise StickslipError(
            f"No motion of period {period:g} s was found from that guess: after {STEPS} steps at most it still misses "
            f"its start by {gap:.2g}. Start nearer, for example from a long run, or check the period."
        )
    start = dict(zip(states, search.points[0].tolist(), strict=False))
    period = float(search.points[0, -1]) if autonomous else period
    return orbit_at(fmu, period, start, start_time=start_time, autonomous=autonomous, **run)


def _rates(fmu: Fmu, period: float, initial: Mapping[str, float], start_time: float, **run: Any) -> Vector:
    """(2, n) rates of the states at the start and after a period."""
    end = start_time + period
    motion = simulate(fmu, end, start_time=start_time, start=initial, output_times=[start_time, end], **run)
    still = np.zeros(2)  # a memory, but for the events that set it
    return np.stack([motion[f"der({name})"] if name in fmu.states else still for name in initial], axis=1)
