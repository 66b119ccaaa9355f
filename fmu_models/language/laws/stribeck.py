"""Stribeck's fall of friction, with viscous friction.

    lambda = -N (mu(|v|) sgn(v) + mu_v v),    mu(|v|) = mu_k + (mu_s - mu_k) exp(-(|v|/v_s)^n)

v slip speed, lambda friction force along positive slip, N normal force, mu_s and mu_k static and kinetic friction
coefficients, v_s speed over which one falls to the other, mu_v rise of the friction coefficient with slip speed. In
stick |lambda| < N mu_s. n is 2 unless the declaration says otherwise (Gauss's curve; n = 1 without viscous friction is
``tustin``). It is a whole number, for with another the force is no analytic function of the motion where slip begins.

Source: equation (4) of Armstrong-Helouvry, Dupont, Canudas de Wit, A survey of models, analysis tools and compensation
methods for the control of machines with friction, Automatica 30 (1994), after Bo and Pavelescu (1982).
"""

from dataclasses import dataclass, field
from typing import ClassVar, final

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction, braking, falling, falling_over
from fmu_models.language.law_parameter import coefficient, declared, viscous


@final
@dataclass(frozen=True)
class Stribeck(DryFriction):
    """Friction that falls from N mu_s at rest to N mu_k, and rises with viscous friction."""

    label: ClassVar[str] = "Stribeck+viscous"
    N: sympy.Expr
    mu_s: sympy.Expr = field(metadata=coefficient(0.65, "friction coefficient at vanishing slip speed"))
    mu_k: sympy.Expr = field(metadata=coefficient(0.35, "friction coefficient at great slip speed, viscous left out"))
    v_s: sympy.Expr = field(metadata=declared(0.05, "m/s", "slip speed over which friction falls", 1e-4, 100.0))
    mu_v: sympy.Expr = field(metadata=viscous())
    exponent: int = 2

    def __post_init__(self) -> None:
        if not (isinstance(self.exponent, int) and self.exponent > 0):
            raise StickslipError(
                f"Stribeck's exponent is {self.exponent!r}: it must be 1, 2, 3, ... With another the force is no "
                "analytic function of the motion where slip begins, and the steps would shrink to nothing."
            )

    def dry(self, speed: sympy.Expr) -> sympy.Expr:
        """Force without its viscous part, N."""
        decay = sympy.exp(-((speed / self.v_s) ** self.exponent))
        return self.N * (self.mu_k + (self.mu_s - self.mu_k) * decay)

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.dry(speed) + self.N * self.mu_v * speed

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N; its viscous part knows no sign."""
        return -sign * self.dry(sign * slip) - self.N * self.mu_v * slip

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return (falling(self.mu_s, self.mu_k, self.label), falling_over(self.v_s), braking(self.mu_v))


LAW = Stribeck
