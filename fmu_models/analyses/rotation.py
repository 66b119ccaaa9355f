"""Rotation numbers: mean turns about a point per step of the section, by weighted Birkhoff averages.

    w = sum of g(k/N) turn(k) / sum of g(k/N),    g(t) = exp(-1/(t (1 - t)))

On a motion of two frequencies such an average converges faster than any power of 1/N; how far 2 N steps change it is
the error. A motion that is locked repeats itself after q steps and p turns.

Source: Das, Sander, Yorke, Measuring quasiperiodicity, EPL 114 (2016); Sander, Meiss, Physica D 411 (2020).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.analyses.aperiodic import birkhoff_weights
from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.sections.system import SectionSystem, named_point


@dataclass(frozen=True)
class RotationNumber(Shown):
    """Turns per step.

    Attributes:
        value: between 0 and 1.
        error: change from half as many steps.
        steps: of the section.
        locked: (p, q) turns and steps after which the motion repeats itself; None if it does not.
    """

    value: float
    error: float
    steps: int
    locked: tuple[int, int] | None = None


def rotation_number(
    system: SectionSystem,
    start: Mapping[str, float] | Sequence[float] | None = None,
    *,
    about: Mapping[str, float],
    steps: int = 20_000,
    transient: int = 0,
    longest: int = 64,
) -> RotationNumber:
    """How often the motion from a start turns about a point, per step.

    Args:
        system: a map, or an oscillator at a section.
        start: on the section.
        about: the point, by two states (or the phase) in which the turns are seen.
        steps: of the section; 2 N.
        transient: steps before that.
        longest: period up to which a locked motion is told.

    Raises:
        StickslipError: not two states, unknown names, fewer than 8 steps, or a motion that does not go on so long.
    """
    for name in about:
        refuse_unknown(name, system.states, f"{system.name} has no state '{name}'.")
    if len(about) != 2 or steps < 8:
        raise StickslipError(
            f"Turns are seen in two states, over at least 8 steps; found {list(about)}, {steps} steps."
        )
    points = system.motion(start, transient, steps).points[0]
    points = system.difference(points - named_point(system.name, system.states, np.zeros(points.shape[1]), about))
    columns = [list(system.states).index(name) for name in about]
    locked = _period(points[:, columns], longest)
    u, v = (points[:, i] / np.abs(points[:, i]).max() for i in columns)
    turns = np.diff(np.arctan2(v, u)) / (2.0 * np.pi)
    # each turn is known up to a whole one: take all within half a turn of their middle on the circle
    middle = np.angle(np.exp(2j * np.pi * turns).mean()) / (2.0 * np.pi)
    turns = middle + np.mod(turns - middle + 0.5, 1.0) - 0.5
    mean, half = _mean(turns), _mean(turns[: len(turns) // 2])
    value = float(np.mod(mean, 1.0))
    named = (round(locked * value) % locked, locked) if locked else None
    return RotationNumber(value if named is None else named[0] / named[1], abs(mean - half), steps, named)


def _mean(turns: Vector) -> float:
    weights = birkhoff_weights(len(turns))
    return float(weights @ turns / weights.sum())


def _period(points: Vector, longest: int) -> int:
    """Steps after which the last points repeat themselves; 0 if they do not."""
    size = np.ptp(points, axis=0) + np.abs(points).max(axis=0)
    for n in range(1, min(longest, len(points) // 4) + 1):
        if (np.abs(points[-n:] - points[-2 * n : -n]) <= 1e-10 * size).all():
            return n
    return 0
