"""LuGre friction before Stribeck's curve, with viscous friction.

    lambda = -(sigma0 z + sigma1 z' + N mu_v v),    z' = v - sigma0 |v| z / g(|v|)
    g(v) = N (mu_k + (mu_s - mu_k) exp(-(v/v_s)^2))

v slip speed, lambda friction force along positive slip, z mean deflection of the bristles, sigma0 their stiffness,
sigma1 their damping; N, mu_s, mu_k, v_s and mu_v as in ``stribeck``, whose friction it has in steady slip.

Source: Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE
Transactions on Automatic Control 40 (1995), equations (2) to (6).
"""

from dataclasses import dataclass
from typing import ClassVar, final

import sympy

from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.laws.lugre import LuGre
from fmu_models.language.laws.stribeck import Stribeck


@final
@dataclass(frozen=True)
class LuGreStribeck(LuGre):
    """Bristles before Stribeck's curve; viscous friction acts beside them."""

    label: ClassVar[str] = "LuGre+Stribeck"
    kept: ClassVar[type[DryFriction]] = Stribeck
    otherwise: ClassVar[type[DryFriction]] = Stribeck

    @property
    def curve(self) -> Stribeck:
        """The law of steady slip."""
        assert isinstance(self.steady, Stribeck)
        return self.steady

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N; its viscous part knows no sign."""
        return super().force(slip, sign) - self.curve.N * self.curve.mu_v * slip

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        speed = sign * slip
        return (slip - self.sigma0 * speed * self.bristle / self.curve.dry(speed),)


LAW = LuGreStribeck
