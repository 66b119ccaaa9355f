"""Conti's friction law by direction: other coefficients for each sign of the slip speed.

    lambda = -N mu_plus(v)  for v > 0,    lambda = N mu_minus(-v)  for v < 0,    mu(v) = (mu_s - mu_k)/(1 + p v) + mu_k

v slip speed, lambda friction force along positive slip, N normal force; mu_s, mu_k and p as in ``conti``, of each
direction their own. In stick -N mu_s_plus < lambda < N mu_s_minus.

Source: Olsson, Astrom, Canudas de Wit, Gafvert, Lischinsky, Friction models and friction compensation, European Journal
of Control 4 (1998), section 2: friction against speed "is often asymmetrical"; with equation (2) of Casini, Giannini,
Vestroni, Nonlinear Dynamics 46 (2006), for either direction.
"""

from dataclasses import dataclass, field
from typing import ClassVar, final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction, falling
from fmu_models.language.law_parameter import coefficient, declared
from fmu_models.language.laws.conti import Conti


@final
@dataclass(frozen=True)
class Directional(DryFriction):
    """Conti's law with parameters of its own for positive and for negative slip."""

    label: ClassVar[str] = "Conti by direction"
    N: sympy.Expr
    mu_s_plus: sympy.Expr = field(metadata=coefficient(0.65, "friction coefficient at vanishing positive slip speed"))
    mu_k_plus: sympy.Expr = field(metadata=coefficient(0.35, "friction coefficient at great positive slip speed"))
    p_plus: sympy.Expr = field(
        metadata=declared(15.0, "s/m", "slope of the fall of friction with positive slip speed", 0.0, 1e4)
    )
    mu_s_minus: sympy.Expr = field(metadata=coefficient(0.65, "friction coefficient at vanishing negative slip speed"))
    mu_k_minus: sympy.Expr = field(metadata=coefficient(0.35, "friction coefficient at great negative slip speed"))
    p_minus: sympy.Expr = field(
        metadata=declared(15.0, "s/m", "slope of the fall of friction with negative slip speed", 0.0, 1e4)
    )

    @property
    def plus(self) -> Conti:
        """The law of positive slip."""
        return Conti(self.N, self.mu_s_plus, self.mu_k_plus, self.p_plus)

    @property
    def minus(self) -> Conti:
        """The law of negative slip."""
        return Conti(self.N, self.mu_s_minus, self.mu_k_minus, self.p_minus)

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.plus.magnitude(speed)

    def towards(self, speed: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        return (1 + sign) / 2 * self.plus.magnitude(speed) + (1 - sign) / 2 * self.minus.magnitude(speed)

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N, against negative slip."""
        return self.minus.capacity

    @property
    def capacity_minus(self) -> sympy.Expr:
        """Largest force in stick, N, against positive slip."""
        return self.plus.capacity

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        speed = sign * slip
        return (1 - sign) / 2 * self.minus.magnitude(speed) - (1 + sign) / 2 * self.plus.magnitude(speed)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return (falling(self.mu_s_plus, self.mu_k_plus, "Conti"), falling(self.mu_s_minus, self.mu_k_minus, "Conti"))


LAW = Directional
