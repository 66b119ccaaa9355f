"""Stribeck's fall of friction as an exponential.

    lambda = -N mu(|v|) sgn(v),    mu(|v|) = mu_k + (mu_s - mu_k) exp(-|v|/v_s)

v slip speed, lambda friction force along positive slip, N normal force, mu_s and mu_k static and kinetic friction
coefficients, v_s speed over which one falls to the other. In stick |lambda| < N mu_s.

Source: Tustin's exponential, in Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and
compensation methods for the control of machines with friction, Automatica 30 (1994).
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
class ExponentialStribeck(DryFriction):
    """Friction that falls exponentially from N mu_s at rest to N mu_k at high slip speed."""

    N: sympy.Expr
    mu_s: sympy.Expr
    mu_k: sympy.Expr
    v_s: sympy.Expr

    @classmethod
    def around(cls, own: Conti, suffix: str = "", *, v_s: float = 0.05) -> Self:
        """Between the coefficients of Conti's law ``own``, over the speed ``v_s<suffix>``, a parameter."""
        speed = Parameter(f"v_s{suffix}", v_s, "m/s", "slip speed over which friction falls", positive=True)
        return cls(own.N, own.mu_s, own.mu_k, speed)

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        """N mu(speed), N, for a slip speed without sign, m/s."""
        return self.N * (self.mu_k + (self.mu_s - self.mu_k) * sympy.exp(-speed / self.v_s))

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Friction falls with the slip speed, over a speed that is positive."""
        falls = f"{self.mu_k} exceeds {self.mu_s}: Stribeck's law needs mu_s >= mu_k"
        speed = f"{self.v_s} must be positive: it is the speed over which friction falls"
        return (Requirement(self.mu_s - self.mu_k, falls), Requirement(sympy.sympify(self.v_s), speed, strict=True))
