"""Conti's friction law with viscous friction.

    lambda = -N (mu(|v|) sgn(v) + mu_v v),    mu(|v|) = (mu_s - mu_k)/(1 + p |v|) + mu_k

v slip speed, lambda friction force along positive slip, mu_v rise of the friction coefficient with slip speed; the rest
as in ``conti``.

Source: equation (2) of Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006), with the viscous part added.
"""

from dataclasses import dataclass, field
from typing import ClassVar, final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import braking
from fmu_models.language.law_parameter import viscous
from fmu_models.language.laws.conti import Conti


@final
@dataclass(frozen=True)
class ContiViscous(Conti):
    """Conti's law with viscous friction in proportion to the normal force."""

    label: ClassVar[str] = "Conti+viscous"
    mu_v: sympy.Expr = field(metadata=viscous())

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return super().magnitude(speed) + self.N * self.mu_v * speed

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N; its viscous part knows no sign."""
        return -sign * super().magnitude(sign * slip) - self.N * self.mu_v * slip

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Requirements of Conti's law, and no driving viscous friction."""
        return (*super().requirements, braking(self.mu_v))


LAW = ContiViscous
