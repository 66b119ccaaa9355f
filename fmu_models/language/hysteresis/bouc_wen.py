"""Bouc and Wen's smooth hysteresis.

    F = k z,    z' = x' - |z|^n (gamma x' + beta |x'| sgn(z))

k stiffness at z = 0; beta > 0 with beta + gamma > 0 takes energy; z grows to (beta + gamma)^(-1/n). The law is mostly
written with four factors A, beta, gamma and a stiffness, of which one is free: A = 1 here. n is a whole number or
a half more: then the step after z = 0 runs in the root of time, in which |z|^n has a Taylor series there.

Source: Wen, Method for random vibration of hysteretic systems, Journal of the Engineering Mechanics Division 102
(1976).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.hysteresis.law import Expr, HysteresisLaw
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class BoucWen(HysteresisLaw):
    """A spring of stiffness ``k`` (N/m) that gives way by ``beta`` and ``gamma`` (1/m^n) to the power ``n``.
    StickslipError: n is neither."""

    k: Expr
    beta: Expr
    gamma: Expr
    n: float = 1

    def __post_init__(self) -> None:
        if int(2 * self.n) != 2 * self.n or self.n < 1:
            raise StickslipError(
                f"Bouc and Wen's law has n = {self.n}. It must be 1, 1.5, 2, 2.5 ...: |z|^n has no Taylor series at "
                "z = 0 otherwise, in time or in its root. Take the nearest; beta and gamma change with it."
            )

    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        """The hysteretic displacement."""
        return (InternalState(f"{name}_z", unit, f"hysteretic displacement of {name}"),)

    def switches(self, speed: Expr, z: Sequence[Expr]) -> dict[str, Expr]:
        return {"speed": speed, "z": z[0]}

    def giving_way(self, speed: Expr, z: Expr, signs: Mapping[str, Expr]) -> Expr:
        """|z|^n (gamma x' + beta |x'| sgn(z))."""
        n = self._exponent
        # of halves the sign stands inside: what has a root is positive
        power = z**n if n.is_integer else (signs["z"] * z) ** n
        even, odd = (signs["z"] * power, power) if n % 2 == 1 else (power, signs["z"] * power)
        return self.gamma * speed * even + self.beta * signs["speed"] * speed * odd

    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        return (speed - self.giving_way(speed, z[0], signs),)

    def force(self, way: Expr, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> Expr:
        return self.k * z[0]

    @property
    def _exponent(self) -> Expr:
        return sympy.Rational(int(2 * self.n), 2)

    @property
    def rooted(self) -> tuple[str, ...]:
        return () if self._exponent.is_integer else ("z",)

    @property
    def full(self) -> tuple[Expr, ...]:
        """Where z' = 0 on the way outwards."""
        return ((self.beta + self.gamma) ** (-1 / self._exponent),)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A z that stays finite."""
        sentence = f"{self.beta} + {self.gamma} must be positive: z has no end otherwise"
        return (Requirement(sympy.sympify(self.beta + self.gamma), sentence, strict=True),)
