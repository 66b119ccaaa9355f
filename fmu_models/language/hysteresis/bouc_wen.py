"""Bouc and Wen's smooth hysteresis.

    F = k z,    z' = x' - |z|^n (gamma x' + beta |x'| sgn(z))

k stiffness at z = 0; beta > 0 with beta + gamma > 0 takes energy; z grows to (beta + gamma)^(-1/n). The law is mostly
written with four factors A, beta, gamma and a stiffness, of which one is free: A = 1 here. n is a whole number: |z|^n
of any other has no Taylor series at z = 0.

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

    Raises:
        StickslipError: n is no whole number.
    """

    k: Expr
    beta: Expr
    gamma: Expr
    n: int = 1

    def __post_init__(self) -> None:
        if int(self.n) != self.n or self.n < 1:
            raise StickslipError(
                f"Bouc and Wen's law has n = {self.n}. It must be a whole number, 1, 2, 3 ...: |z|^n has no Taylor "
                "series at z = 0 otherwise. Take the nearest; beta and gamma change with it."
            )

    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        """The hysteretic displacement."""
        return (InternalState(f"{name}_z", unit, f"hysteretic displacement of {name}"),)

    def switches(self, speed: Expr, z: Sequence[Expr]) -> dict[str, Expr]:
        return {"speed": speed, "z": z[0]}

    def giving_way(self, speed: Expr, z: Expr, signs: Mapping[str, Expr]) -> Expr:
        """|z|^n (gamma x' + beta |x'| sgn(z))."""
        odd = z**self.n
        even, odd = (signs["z"] * odd, odd) if self.n % 2 else (odd, signs["z"] * odd)
        return self.gamma * speed * even + self.beta * signs["speed"] * speed * odd

    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        return (speed - self.giving_way(speed, z[0], signs),)

    def force(self, way: Expr, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> Expr:
        return self.k * z[0]

    @property
    def full(self) -> tuple[Expr, ...]:
        """Where z' = 0 on the way outwards."""
        return ((self.beta + self.gamma) ** (-sympy.Rational(1, self.n)),)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A z that stays finite."""
        sentence = f"{self.beta} + {self.gamma} must be positive: z has no end otherwise"
        return (Requirement(sympy.sympify(self.beta + self.gamma), sentence, strict=True),)
