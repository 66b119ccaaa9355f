"""LuGre friction: a layer of bristles in front of a steady law.

    lambda = -(sigma0 z + sigma1 z'),    z' = v - sigma0 |v| z / g(|v|)

v slip speed, lambda friction force along positive slip, z mean deflection of the bristles, sigma0 their stiffness,
sigma1 their damping, g the steady friction force (at constant v: lambda = -g(|v|) sgn(v)). Below the breakaway force
the bristles give way elastically: the contact slips a little (micro-slip) and never sticks exactly.

Source: Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE
Transactions on Automatic Control 40 (1995), equations (2) to (4), without viscous friction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Self

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.laws.conti import Conti
from fmu_models.language.quantities import InternalState, Parameter


@dataclass(frozen=True)
class LuGre:
    """Bristles of ``stiffness`` (N/m) and ``damping`` (N s/m) whose steady force is that of the law ``steady``."""

    steady: Conti
    stiffness: sympy.Expr
    damping: sympy.Expr
    bristle: InternalState = field(default_factory=lambda: _bristle("z"))
    sticks: ClassVar[bool] = False

    @classmethod
    def around(cls, steady: Conti, suffix: str = "", *, stiffness: float = 2e5, damping: float = 100.0) -> Self:
        """LuGre law with parameters ``sigma0<suffix>``, ``sigma1<suffix>`` and internal state ``z<suffix>``."""
        return cls(
            steady,
            Parameter(f"sigma0{suffix}", stiffness, "N/m", "stiffness of the bristles", positive=True),
            Parameter(f"sigma1{suffix}", damping, "N s/m", "damping of the bristles", minimum=0.0),
            _bristle(f"z{suffix}"),
        )

    @property
    def states(self) -> tuple[InternalState, ...]:
        """The deflection of the bristles."""
        return (self.bristle,)

    @property
    def capacity(self) -> sympy.Expr:
        """Breakaway force, N."""
        return self.steady.capacity

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        (rate,) = self.rates(slip, sign)
        return -(self.stiffness * self.bristle + self.damping * rate)

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """Rate of the deflection of the bristles, m/s."""
        speed = sign * slip
        return (slip - self.stiffness * speed * self.bristle / self.steady.magnitude(speed),)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Those of the steady law, and a steady force that the bristles can lean against."""
        sentence = f"{self.steady.N} or {self.steady.mu_s} is zero: LuGre's law divides by the steady friction force"
        return (*self.steady.requirements, Requirement(self.steady.capacity, sentence, strict=True))


def _bristle(name: str) -> InternalState:
    return InternalState(name, "m", "mean deflection of the bristles", nominal=1e-5)
