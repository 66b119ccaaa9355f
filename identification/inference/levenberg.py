"""Least squares where slopes cost far more than residuals: several steps are tried for each gradient.

    (J'WJ + lambda D^2) step = -J'W r,    W weights of the loss, D longest columns of J so far

From one gradient the damping lambda falls as long as the loss does, or rises until it does; each trial costs residuals
alone. Half of the second derivative along the step, seen at a tenth of it, bends the step into the valley that it would
leave. A step beyond a bound ends there, and the other unknowns answer. Rows of a soft loss are weighed anew at every
gradient.

Source: Marquardt (1963); scaling of More (1978), Lecture Notes in Mathematics 630, 105; geodesic acceleration of
Transtrum, Machta and Sethna (2011), Phys. Rev. E 83, 036701.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.inference.problem import SOFT, FitProblem, Solution, at_bounds

BEGIN = 1e-3  # damping
FACTOR = 10.0  # between dampings that are tried
PROBE = 0.1  # of a step, at which its curvature is seen
BENT = 0.4  # of a step: the most that its curvature may add
LEAST, MOST = 1e-14, 1e8  # damping


def levenberg(
    problem: FitProblem, start: np.ndarray, *, tolerance: float, evaluations: int, loss: str = "linear"
) -> Solution:
    """A minimum of a problem near ``start`` (m,), with at most so many ``evaluations`` of its gradient.

    tolerance: relative, of loss and step; loss: "linear", or "cauchy", soft beyond `SOFT` deviations.
    """
    descent = _Descent(problem, np.asarray(start, dtype=float), loss == "cauchy")
    damping, message, converged = BEGIN, "as many evaluations as allowed", False
    while descent.evaluations < evaluations and not converged:
        before, x = descent.cost, descent.x
        damping = descent.lower(damping)
        settled = np.linalg.norm(descent.x - x) < tolerance * (tolerance + np.linalg.norm(x))
        if damping > MOST or settled or before - descent.cost <= tolerance * before:
            message, converged = "neither loss nor step changes any more", True
    at_bound = at_bounds(problem, descent.x)
    return Solution(descent.x, descent.here, converged, message, tuple(at_bound.tolist()))


class _Descent:
    """Where a search stands. x: (m,); here: evaluation there; cost: its loss; scale: (m,) longest columns so far."""

    def __init__(self, problem: FitProblem, start: np.ndarray, soft: bool) -> None:
        self.problem, self.soft = problem, soft
        self.low, self.high = problem.limits
        priors = [(row, unknown.prior) for row, unknown in enumerate(problem.unknowns) if unknown.prior is not None]
        self.known = np.array([row for row, _ in priors], dtype=int)
        self.expected = np.array([prior.value for _, prior in priors])
        self.precision = np.array([1 / prior.standard_uncertainty for _, prior in priors])
        self.scale = np.zeros(len(start))
        self.evaluations, self.cost = 0, np.inf
        self._evaluate(np.clip(start, self.low, self.high))

    def _evaluate(self, x: np.ndarray) -> bool:
        """Go to x if its gradient is there too and its loss is lower."""
        evaluation = self.problem.evaluate(x)
        cost = self._cost(evaluation.residual, x)
        self.evaluations += 1
        if not cost < self.cost and self.evaluations > 1:
            return False
        self.x, self.here, self.cost = x, evaluation, cost
        return True

    def _rows(self, residual: np.ndarray, x: np.ndarray) -> np.ndarray:
        return np.append(residual, (x[self.known] - self.expected) * self.precision)

    def _cost(self, residual: np.ndarray, x: np.ndarray) -> float:
        squares = self._rows(residual, x) ** 2
        return float(np.sum(SOFT**2 * np.log1p(squares / SOFT**2) if self.soft else squares))

    def lower(self, damping: float) -> float:
        """Go on by the best of the steps that are tried, from ``damping`` on. Returns the damping to begin with at the
        next gradient, beyond `MOST` if no step lowers the loss."""
        factors, damping, least = self._factors(), max(damping, LEAST), LEAST
        while damping <= MOST:
            x, damping = self._best(factors, damping, least)
            if damping > MOST or self._evaluate(x):
                break
            # residuals with their gradient may differ in the last digits: a smaller damping would end there again
            damping = least = damping * FACTOR**2
        return damping

    def _factors(self) -> _Factors:
        """The weighed gradient at x."""
        rows = self._rows(self.here.residual, self.x)
        slopes = np.vstack([self.here.gradient, np.eye(len(self.x))[self.known] * self.precision[:, None]])
        weights = 1 / np.sqrt(1 + (rows / SOFT) ** 2) if self.soft else np.ones(len(rows))
        slopes = weights[:, None] * slopes
        self.scale = np.maximum(self.scale, np.linalg.norm(slopes, axis=0))
        scale = np.where(self.scale > 0, self.scale, 1.0)
        basis, triangle = np.linalg.qr(slopes / scale)
        bounds = (self.low - self.x) * scale, (self.high - self.x) * scale
        return _Factors(weights, rows, scale, basis, triangle, np.linalg.svd(triangle), *bounds)

    def _best(self, factors: _Factors, damping: float, least: float) -> tuple[np.ndarray, float]:
        """Where the best of the steps of at least some damping leads to, and its damping."""
        best, cost, used, rising = self.x, self.cost, np.inf, False
        while least <= damping <= MOST:
            x = self._bent(factors, damping)
            lower = False
            if x is not None and (trial := self._cost(self.problem.residual(x), x)) < cost:
                best, cost, used, lower = x, trial, damping, True
            if lower and not rising:
                damping /= FACTOR
            elif best is self.x:
                damping, rising = damping * FACTOR, True
            else:
                break
        return best, used

    def _bent(self, factors: _Factors, damping: float) -> np.ndarray | None:
        """Where a step with its curvature leads to; None where the curvature is so large that it says nothing."""
        step, free = factors.step(damping)
        probe = self.x + PROBE * step / factors.scale
        rows = self._rows(self.problem.residual(probe), probe)
        if not np.isfinite(rows).all():
            return None
        curved = factors.weights * (rows - factors.rows) / PROBE - factors.basis @ (factors.triangle @ step)
        bend = factors.bend(damping, curved / PROBE, free)
        if not np.linalg.norm(bend) <= BENT * np.linalg.norm(step):
            return None
        return np.clip(self.x + (step + bend) / factors.scale, self.low, self.high)


@dataclass(frozen=True, eq=False)
class _Factors:
    """A gradient in units of its columns. weights, rows: (n,) of the loss, and residuals; scale: (m,); basis, triangle:
    of the weighed and scaled gradient; singular: vectors and values of the triangle; low, high: (m,) longest steps."""

    weights: np.ndarray
    rows: np.ndarray
    scale: np.ndarray
    basis: np.ndarray
    triangle: np.ndarray
    singular: Any
    low: np.ndarray
    high: np.ndarray

    def _solved(self, damping: float, target: np.ndarray, fixed: np.ndarray, free: np.ndarray) -> np.ndarray:
        """(m,) damped least squares of the free unknowns. target: (n,); fixed: (m,) of the others."""
        if free.all():
            left, size, right = self.singular
            return right.T @ (size / (size**2 + damping) * (left.T @ (self.basis.T @ target)))
        count = len(free)
        rows = np.vstack([self.triangle, np.sqrt(damping) * np.eye(count)])
        right_side = np.append(self.basis.T @ target, np.zeros(count)) - rows[:, ~free] @ fixed[~free]
        step = fixed.copy()
        step[free] = np.linalg.lstsq(rows[:, free], right_side, rcond=None)[0]
        return step

    def step(self, damping: float) -> tuple[np.ndarray, np.ndarray]:
        """(m,) the step, and which unknowns it does not take to a bound that is in their way."""
        step, free = np.zeros(len(self.scale)), np.ones(len(self.scale), dtype=bool)
        while free.any():
            step = self._solved(damping, -self.weights * self.rows, step, free)
            beyond = free & ((step < self.low) | (step > self.high))
            if not beyond.any():
                break
            step[beyond] = np.clip(step, self.low, self.high)[beyond]
            free &= ~beyond
        return step, free

    def bend(self, damping: float, curvature: np.ndarray, free: np.ndarray) -> np.ndarray:
        """(m,) what answers half of the second derivative (n,) of the residuals along a step."""
        return self._solved(damping, -curvature, np.zeros(len(free)), free) if free.any() else np.zeros(len(free))
