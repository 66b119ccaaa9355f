"""Coulomb's friction law.

    lambda = -N mu sgn(v)

v slip speed, lambda friction force along positive slip, N normal force, mu friction coefficient. In stick
|lambda| < N mu.

Source: Coulomb, Theorie des machines simples (1785).
"""

from dataclasses import dataclass, field
from typing import final

import sympy

from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.law_parameter import coefficient


@final
@dataclass(frozen=True)
class Coulomb(DryFriction):
    """Friction of the magnitude N mu at every slip speed."""

    N: sympy.Expr
    mu: sympy.Expr = field(metadata=coefficient(0.5, "friction coefficient at any slip speed"))

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.N * self.mu


LAW = Coulomb
