"""Friction as a cubic of the slip speed.

    lambda = -(a0 sgn(v) - a1 v + a3 v^3)

v slip speed, lambda friction force along positive slip; a0 force at rest, a1 its fall with small speed, a3 its rise
with large speed. In stick |lambda| < a0.

Source: Leine, van Campen, Bifurcation phenomena in non-smooth dynamical systems, European Journal of Mechanics A/Solids
25 (2006), equation (16), after Yoshitake and Sueoka (2000).
"""

from dataclasses import dataclass, field
from math import inf
from typing import final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction, fixed_factors
from fmu_models.language.law_parameter import declared


@final
@dataclass(frozen=True)
class StribeckCubic(DryFriction):
    """Friction whose force, not its coefficient, is a cubic."""

    a0: sympy.Expr = field(metadata=declared(1.5, "N", "friction force at rest", 0.0, inf))
    a1: sympy.Expr = field(metadata=declared(1.5, "N s/m", "fall of the force with small slip speeds", -inf, inf))
    a3: sympy.Expr = field(metadata=declared(0.45, "N s3/m3", "rise of the force with large slip speeds", -inf, inf))

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return sympy.sympify(self.a0 - self.a1 * speed + self.a3 * speed**3)

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        return -sign * self.a0 + self.a1 * slip - self.a3 * slip**3

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A force at rest that is not negative."""
        return (Requirement(fixed_factors(self.capacity), f"{self.a0} is negative: the cubic law needs a0 >= 0"),)


LAW = StribeckCubic
