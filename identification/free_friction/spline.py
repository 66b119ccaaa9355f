"""Friction over slip speed as a cubic spline in asinh(v/V), V = 0.02 m/s: dense where friction changes most."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

SCALE = 0.02  # m/s
COEFFICIENTS = 9
BEND = 0.05  # standard deviation of second differences of coefficients, beforehand: level and slope are free


@dataclass(frozen=True, eq=False)
class SpeedSpline:
    """Cubic B-splines from rest to ``greatest`` (m/s), beyond which friction stays as it is."""

    greatest: float

    @cached_property
    def knots(self) -> np.ndarray:
        """Even in asinh(v/V) (COEFFICIENTS + 4,)."""
        end = float(np.arcsinh(self.greatest / SCALE))
        return end / (COEFFICIENTS - 3) * np.arange(-3.0, COEFFICIENTS + 1)

    def basis(self, speed: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Values (..., COEFFICIENTS) at slip speeds (...) in m/s, or derivatives by the speed (derivative 1)."""
        from scipy.interpolate import BSpline

        inside = np.clip(speed, 0.0, self.greatest)
        spline = BSpline(self.knots, np.eye(COEFFICIENTS), 3)
        if derivative == 0:
            return spline(np.arcsinh(inside / SCALE))
        within = (speed >= 0) & (speed <= self.greatest)
        return spline.derivative()(np.arcsinh(inside / SCALE)) * (within / np.hypot(SCALE, inside))[..., None]

    def pieces(self, coefficients: np.ndarray) -> np.ndarray:
        """Polynomials (4, COEFFICIENTS - 3) between knots, from the highest power of the distance to the knot."""
        from scipy.interpolate import BSpline, PPoly

        return PPoly.from_spline(BSpline(self.knots, coefficients, 3)).c[:, 3:-3]

    def value(self, pieces: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Friction coefficient at slip speeds (n,), from `pieces`: what an integrator asks for at each of its steps."""
        place = np.arcsinh(np.clip(speed, 0.0, self.greatest) / SCALE)
        width = self.knots[1] - self.knots[0]
        piece = np.clip((place / width).astype(np.intp), 0, pieces.shape[1] - 1)
        distance = place - width * piece
        cubic, square, slope, level = pieces[:, piece]
        return level + distance * (slope + distance * (square + distance * cubic))

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Precision (COEFFICIENTS, COEFFICIENTS) of what is assumed of the coefficients beforehand."""
        bends = np.diff(np.eye(COEFFICIENTS), 2, axis=0) / BEND
        return bends.T @ bends
