"""Tustin's law: friction that falls exponentially with slip speed.

    lambda = -N mu(|v|) sgn(v),    mu(|v|) = mu_k + (mu_s - mu_k) exp(-|v|/v_s)

v slip speed, lambda friction force along positive slip, N normal force, mu_s and mu_k static and kinetic friction
coefficients, v_s speed over which one falls to the other. In stick |lambda| < N mu_s.

Source: Tustin (1947), in Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and
compensation methods for the control of machines with friction, Automatica 30 (1994).
"""

from dataclasses import dataclass, field
from typing import final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction, falling, falling_over
from fmu_models.language.law_parameter import coefficient, declared


@final
@dataclass(frozen=True)
class Tustin(DryFriction):
    """Friction that falls exponentially from N mu_s at rest to N mu_k at high slip speed."""

    N: sympy.Expr
    mu_s: sympy.Expr = field(metadata=coefficient(0.65, "friction coefficient at vanishing slip speed"))
    mu_k: sympy.Expr = field(metadata=coefficient(0.35, "friction coefficient at great slip speed"))
    v_s: sympy.Expr = field(metadata=declared(0.05, "m/s", "slip speed over which friction falls", 1e-4, 100.0))

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.N * (self.mu_k + (self.mu_s - self.mu_k) * sympy.exp(-speed / self.v_s))

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return (falling(self.mu_s, self.mu_k, "Tustin"), falling_over(self.v_s))


LAW = Tustin
