"""Friction as a cubic of the slip speed.

    lambda = -(a0 sgn(v) - a1 v + a3 v^3)

v slip speed, lambda friction force along positive slip; a0 force at rest, a1 its fall with small speed, a3 its rise
with large speed. In stick |lambda| < a0.

Source: Yoshitake, Sueoka (2000), in Leine, Bifurcations of equilibria and periodic solutions of non-smooth systems,
equation (16) of its forced stick-slip oscillator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class StribeckCubic:
    """Friction with the coefficients ``a0`` (N), ``a1`` (N s/m) and ``a3`` (N s3/m3)."""

    a0: sympy.Expr
    a1: sympy.Expr
    a3: sympy.Expr
    sticks: ClassVar[bool] = True

    @property
    def states(self) -> tuple[InternalState, ...]:
        """No internal states."""
        return ()

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N."""
        return sympy.sympify(self.a0)

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        return -sign * self.a0 + self.a1 * slip - self.a3 * slip**3

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """None, without internal states."""
        return ()

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A force at rest that is not negative."""
        return (Requirement(self.capacity, f"{self.a0} is negative: the cubic law needs a0 >= 0"),)
