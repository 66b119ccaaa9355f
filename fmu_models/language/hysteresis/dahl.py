"""Dahl's friction: a spring that creeps towards its sliding force.

    F = sigma z,    z' = x' (1 - sgn(x') sigma z/F_c)

sigma stiffness at rest, F_c sliding force. Its small loops drift: it does not forget by Masing's rules.

Source: Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14 (1976), exponent 1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.hysteresis.law import Expr, HysteresisLaw
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class Dahl(HysteresisLaw):
    """A spring of stiffness ``sigma`` (N/m) with the sliding force ``F_c`` (N)."""

    sigma: Expr
    F_c: Expr

    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        return (InternalState(f"{name}_z", unit, f"elongation of {name}"),)

    def switches(self, speed: Expr, z: Sequence[Expr]) -> dict[str, Expr]:
        return {"speed": speed}

    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        return (speed * (1 - signs["speed"] * self.sigma * z[0] / self.F_c),)

    def force(self, way: Expr, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> Expr:
        return self.sigma * z[0]

    @property
    def full(self) -> tuple[Expr, ...]:
        """Where the spring slides."""
        return (self.F_c / self.sigma,)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A sliding force that the spring can lean against."""
        sentence = f"{self.F_c} must be positive: Dahl's law divides by its sliding force"
        return (Requirement(sympy.sympify(self.F_c), sentence, strict=True),)
