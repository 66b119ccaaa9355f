"""Coulomb's friction law with viscous friction.

    lambda = -N (mu sgn(v) + mu_v v)

v slip speed, lambda friction force along positive slip, mu_v rise of the friction coefficient with slip speed; the rest
as in ``coulomb``.

Source: Coulomb, Theorie des machines simples (1785), with the viscous part added.
"""

from dataclasses import dataclass, field
from typing import ClassVar, final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction, braking
from fmu_models.language.law_parameter import coefficient, viscous


@final
@dataclass(frozen=True)
class CoulombViscous(DryFriction):
    """Coulomb's law with viscous friction in proportion to the normal force."""

    label: ClassVar[str] = "Coulomb+viscous"
    N: sympy.Expr
    mu: sympy.Expr = field(metadata=coefficient(0.5, "friction coefficient at any slip speed"))
    mu_v: sympy.Expr = field(metadata=viscous())

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.N * (self.mu + self.mu_v * speed)

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N; its viscous part knows no sign."""
        return -self.N * (self.mu * sign + self.mu_v * slip)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return (braking(self.mu_v),)


LAW = CoulombViscous
