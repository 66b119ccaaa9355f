"""Newton's method from many guesses at once, damped where a step leads away.

x <- x - J(x)^-1 r(x);   while |r| is not smaller there, the step is halved, a few times at most
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fmu_models.base.arrays import Flags, Vector

LARGEST = 1e12  # numbers larger than this are on their way to infinity


@dataclass(frozen=True, eq=False)
class NewtonSearch:
    """Results of the guesses that were not lost.

    Attributes:
        points: (m, n) where they ended.
        misses: (m,) largest residual there.
        converged: (m,) whether that is a solution.
    """

    points: Vector
    misses: Vector
    converged: Flags


def newton(
    equations: Callable[[Vector], tuple[Vector, Vector]],
    guesses: Vector,
    *,
    accuracy: float,
    steps: int = 40,
    halvings: int = 0,
    until_settled: bool = False,
    scale: Callable[[Vector], Vector] | None = None,
) -> NewtonSearch:
    """Solve r(x) = 0 from guesses (m, n).

    Args:
        equations: of points (m, n): residuals (m, n) and their derivatives (m, n, n); nan where there are none.
        accuracy: of the residuals, relative to ``scale``.
        steps: at most.
        halvings: of a step that does not make the largest residual smaller, at most.
        until_settled: go on until all steps are within the accuracy too, and one step more, which brings the points to
            rounding.
        scale: (m,) sizes of points (m, n); one more than the largest number if left out.
    """
    scale = scale or (lambda points: 1.0 + _size(points))

    def evaluated(points: Vector) -> tuple[Vector, Vector, Vector]:
        residuals, slopes = np.full_like(points, np.nan), np.full((*points.shape, points.shape[1]), np.nan)
        if (sound := _size(points) < LARGEST).any():
            residuals[sound], slopes[sound] = equations(points[sound])
        return points, residuals, slopes

    with np.errstate(all="ignore"):
        points, residuals, slopes = evaluated(guesses[np.isfinite(guesses).all(axis=1)])
        step, last = np.zeros_like(points), False
        for _ in range(steps):
            if not until_settled and (_size(residuals) <= accuracy * scale(points)).all():
                break
            step = _step(residuals, slopes)
            after = evaluated(points - step)
            for _ in range(halvings):
                worse = ~(_size(after[1]) < _size(residuals))
                if not worse.any():
                    break
                step[worse] /= 2
                for array, retried in zip(after, evaluated(points[worse] - step[worse]), strict=True):
                    array[worse] = retried
            bounded = _size(after[0]) < LARGEST
            step, (points, residuals, slopes) = step[bounded], (array[bounded] for array in after)
            if last or not len(points):
                break
            last = until_settled and bool((_size(step) <= accuracy * scale(points)).all())
        converged = _size(residuals) <= accuracy * scale(points)
        if until_settled:
            converged &= _size(step) <= accuracy * scale(points)
    return NewtonSearch(points, _size(residuals), converged)


def _size(values: Vector) -> Vector:
    """(m,) largest absolute value of each row; nan where one is nan."""
    return np.abs(values).max(axis=1, initial=0.0)


def _step(residuals: Vector, slopes: Vector) -> Vector:
    """(m, n) from each point to the zero of its tangent; nan where the derivative is singular."""
    singular = ~(np.abs(np.linalg.det(slopes)) > 0.0)
    slopes = np.where(singular[:, None, None], np.eye(residuals.shape[1]), slopes)
    step = np.linalg.solve(slopes, residuals[:, :, None])[:, :, 0].astype(float)
    # what is already exact stays, also where the derivative is singular: a double root
    step[singular & (_size(residuals) > 0.0)] = np.nan
    return step
