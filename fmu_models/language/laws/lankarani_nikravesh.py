"""Hertz's contact with the damping of Lankarani and Nikravesh.

    F = k d^n (1 + mu d'/v0),    mu = 3 (1 - e^2)/4

F compressive force, d depth, v0 the speed at which the stop was entered (always positive, taken anew at every entry),
e coefficient of restitution, n = 3/2 for two spheres. Near the end of a contact 1 + mu d'/v0 may fall below zero after
a very slow entry: release="force" then lets go.

Source: Lankarani, Nikravesh, A contact force model with hysteresis damping for impact analysis of multibody systems,
Journal of Mechanical Design 112 (1990), equation (22).
"""

from dataclasses import dataclass
from typing import ClassVar

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.stops import StopLaw


@dataclass(frozen=True)
class LankaraniNikravesh(StopLaw):
    """Stop of stiffness ``k`` (N/m^n), exponent ``n`` (a number) and coefficient of ``restitution``."""

    k: sympy.Expr
    n: sympy.Expr | float
    restitution: sympy.Expr
    remembers: ClassVar[bool] = True

    def force(self, depth: sympy.Expr, rate: sympy.Expr, memory: sympy.Expr) -> sympy.Expr:
        exponent = sympy.nsimplify(self.n) if sympy.sympify(self.n).is_Number else self.n
        return self.k * depth**exponent * self.release(depth, rate, memory)

    def release(self, depth: sympy.Expr, rate: sympy.Expr, memory: sympy.Expr) -> sympy.Expr:
        """1 + mu d'/v0, without unit."""
        return 1 + 3 * (1 - self.restitution**2) / 4 * rate / memory

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A restitution that gives no energy back that was not put in."""
        e = self.restitution
        sentence = f"{e} must lie between 0 and 1: the coefficient of restitution of Lankarani and Nikravesh"
        return (Requirement(1 - e**2, sentence),)


LAW = LankaraniNikravesh
