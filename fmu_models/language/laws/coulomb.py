"""Coulomb's friction law.

    lambda = -N mu sgn(v)

v slip speed, lambda friction force along positive slip, N normal force, mu friction coefficient. In stick
|lambda| < N mu.

Source: Coulomb, Theorie des machines simples (1785).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class Coulomb:
    """Friction of the magnitude N mu at every slip speed."""

    N: sympy.Expr
    mu: sympy.Expr
    sticks: ClassVar[bool] = True

    @property
    def states(self) -> tuple[InternalState, ...]:
        """No internal states."""
        return ()

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N."""
        return self.N * self.mu

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        return -sign * self.N * self.mu

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """None, without internal states."""
        return ()

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """None beside the bounds of the parameters."""
        return ()
