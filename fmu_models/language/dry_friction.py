"""What all set-valued friction laws without internal states have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.quantities import InternalState


class DryFriction(ABC):
    """lambda = -magnitude(|v|) sgn(v) in slip, |lambda| < magnitude(0) in stick."""

    sticks: ClassVar[bool] = True

    @abstractmethod
    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        """Friction force, N, for a slip speed without sign, m/s."""

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """None beside the bounds of the parameters."""
        return ()

    @property
    def states(self) -> tuple[InternalState, ...]:
        """No internal states."""
        return ()

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N."""
        return self.magnitude(sympy.S.Zero)

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        return -sign * self.magnitude(sign * slip)

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """None, without internal states."""
        return ()
