"""Friction over slip speed as the law ``free`` has it (``language/laws/free.py``), as sums that are quick to evaluate.

    mu(v) = sum_i mu_i b_i(v),    b_i = s_i - s_(i+1),    s_i = (y^4 - 1)/(y^4 + a_i),    y = 1 + v/V

with s_0 = 1 and s_9 = 0: the b_i are positive, and their sum is one.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fmu_models.language.law_parameter import KNOT_SPACING, KNOTS_INSIDE, STEEPNESS

COEFFICIENTS = KNOTS_INSIDE + 2
POINTS = 61
BEND = 0.05  # standard deviation of second differences of coefficients, beforehand: level and slope are free
BENDS = np.diff(np.eye(COEFFICIENTS), 2, axis=0) / BEND  # rows of what is assumed of the coefficients beforehand
STEPS = np.exp(STEEPNESS * KNOT_SPACING * (np.arange(1, COEFFICIENTS) - 0.5))  # a_i


@dataclass(frozen=True, eq=False)
class SpeedBasis:
    """Weights of the values mu_i over slip speed. greatest: v_end, m/s."""

    greatest: float

    @cached_property
    def scale(self) -> float:
        """V, m/s."""
        return self.greatest / np.expm1(KNOT_SPACING * KNOTS_INSIDE)

    @cached_property
    def grid(self) -> np.ndarray:
        """Slip speeds from rest to the greatest (POINTS,), m/s, even between knots."""
        return self.scale * np.expm1(np.linspace(0.0, KNOT_SPACING * KNOTS_INSIDE, POINTS))

    def deviation(self, covariance: np.ndarray) -> np.ndarray:
        """Standard deviation (POINTS,) of the curve on its grid, by the covariance of its coefficients."""
        weights = self.weights(self.grid)
        return np.sqrt(np.einsum("ij,jk,ik->i", weights, covariance, weights))

    def weights(self, speed: np.ndarray, derivative: int = 0) -> np.ndarray:
        """b_i (..., COEFFICIENTS) at slip speeds (...) in m/s, or derivatives by the speed (derivative 1)."""
        y = 1 + np.maximum(speed, 0.0) / self.scale
        power = (y**STEEPNESS)[..., None]
        if derivative == 0:
            return -np.diff((power - 1) / (power + STEPS), prepend=1.0, append=0.0)
        rate = STEEPNESS * y ** (STEEPNESS - 1) / self.scale * (speed >= 0)
        return -np.diff((1 + STEPS) / (power + STEPS) ** 2 * rate[..., None], prepend=0.0, append=0.0)

    def value(self, coefficients: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Friction coefficient at slip speeds (...), m/s: what an integrator asks for at each of its steps."""
        power = (1 + np.maximum(speed, 0.0) / self.scale) ** STEEPNESS
        return coefficients[0] + (power - 1) * (1 / (power[..., None] + STEPS) @ np.diff(coefficients))
