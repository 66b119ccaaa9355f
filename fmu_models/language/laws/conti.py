"""Conti's friction law.

    lambda = -N mu(|v|) sgn(v),    mu(|v|) = (mu_s - mu_k)/(1 + p |v|) + mu_k

v slip speed, lambda friction force along positive slip, N normal force, mu_s and mu_k static and kinetic friction
coefficients, p steepness of the descent from one to the other. In stick |lambda| < N mu_s.

Source: Casini, Giannini, Vestroni, Experimental evidence of non-standard bifurcations in non-smooth oscillator
dynamics, Nonlinear Dynamics 46 (2006), equation (2).
"""

from dataclasses import dataclass, field

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction, falling
from fmu_models.language.law_parameter import coefficient, declared


@dataclass(frozen=True)
class Conti(DryFriction):
    """Friction that falls hyperbolically from N mu_s at rest to N mu_k at high slip speed."""

    N: sympy.Expr
    mu_s: sympy.Expr = field(metadata=coefficient(0.65, "friction coefficient at vanishing slip speed"))
    mu_k: sympy.Expr = field(metadata=coefficient(0.35, "friction coefficient at great slip speed"))
    p: sympy.Expr = field(metadata=declared(15.0, "s/m", "slope of the fall of friction with slip speed", 0.0, 1e4))

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.N * ((self.mu_s - self.mu_k) / (1 + self.p * speed) + self.mu_k)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return (falling(self.mu_s, self.mu_k, "Conti"),)


LAW = Conti
