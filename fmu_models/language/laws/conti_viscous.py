"""Conti's friction law with viscous friction.

    lambda = -(N mu(|v|) sgn(v) + b v),    mu(|v|) = (mu_s - mu_k)/(1 + p |v|) + mu_k

v slip speed, lambda friction force along positive slip, b viscous friction; the rest as in ``conti``.

Source: equation (2) of Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006), with the viscous part added.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.laws.conti import Conti
from fmu_models.language.quantities import Parameter


@dataclass(frozen=True)
class ContiViscous(DryFriction):
    """Conti's law with ``viscous`` friction, N s/m."""

    N: sympy.Expr
    mu_s: sympy.Expr
    mu_k: sympy.Expr
    p: sympy.Expr
    viscous: sympy.Expr

    @classmethod
    def around(cls, own: Conti, suffix: str = "", *, viscous: float = 0.0) -> Self:
        """Conti's law ``own`` with viscous friction, the parameter ``viscous<suffix>``."""
        friction = Parameter(f"viscous{suffix}", viscous, "N s/m", "viscous friction", minimum=0.0)
        return cls(own.N, own.mu_s, own.mu_k, own.p, friction)

    @property
    def dry(self) -> Conti:
        """The part without viscous friction."""
        return Conti(self.N, self.mu_s, self.mu_k, self.p)

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        """Force, N, for a slip speed without sign, m/s."""
        return self.dry.magnitude(speed) + self.viscous * speed

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        return self.dry.force(slip, sign) - self.viscous * slip

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Those of Conti's law, and no driving viscous friction."""
        sentence = f"{self.viscous} is negative: viscous friction brakes"
        return (*self.dry.requirements, Requirement(sympy.sympify(self.viscous), sentence))
