"""Sliders in parallel, each behind a spring: Maxwell's slip model, of Jenkins elements.

    F = sum_i k_i z_i,    z_i' = x',    |z_i| <= D_i: at its bound z_i stays as long as x goes on outwards

x way, k_i stiffness of a spring, D_i the elongation at which its slider gives way, under the force k_i D_i. What is
rate-independent and forgets by Masing's rules is such a sum.

Source: Iwan, A distributed-element model for hysteresis and its steady-state dynamic response, Journal of Applied
Mechanics 33 (1966); Goldfarb and Celanovic (1997), IEEE Control Systems 17, for the name.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.hysteresis.law import Expr, HysteresisLaw
from fmu_models.language.quantities import InternalState


class Sliders(HysteresisLaw):
    """A law that is a sum of sliders."""

    @property
    @abstractmethod
    def elements(self) -> tuple[tuple[Expr, Expr], ...]:
        """Stiffness k_i and bound D_i of each element."""

    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        return tuple(
            InternalState(f"{name}_z{i}", unit, f"elongation of spring {i} of {name}", nominal=size(bound))
            for i, (_, bound) in enumerate(self.elements, 1)
        )

    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        """The way's, of each that does not slide."""
        return tuple(speed for _ in z)

    def force(self, way: Expr, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> Expr:
        return sympy.Add(*(k * x for (k, _), x in zip(self.elements, z, strict=True)))

    def bounds(self) -> dict[int, Expr]:
        return {i: bound for i, (_, bound) in enumerate(self.elements)}


@dataclass(frozen=True)
class MaxwellSlip(Sliders):
    """Springs of stiffness ``k`` (N/m each), whose sliders give way at elongations ``D`` (m each). StickslipError: no
    element, or not as many bounds as springs."""

    k: Sequence[Expr]
    D: Sequence[Expr]

    def __post_init__(self) -> None:
        if len(self.k) != len(self.D) or not len(self.k):
            raise StickslipError(
                f"MaxwellSlip has {len(self.k)} stiffnesses and {len(self.D)} bounds. Give one of each for every "
                "element: MaxwellSlip(k=(k1, k2), D=(D1, D2))."
            )

    @property
    def elements(self) -> tuple[tuple[Expr, Expr], ...]:
        return tuple(zip(self.k, self.D, strict=True))


def size(bound: Expr) -> float:
    """A bound in numbers, by the values of its parameters; 1 where that is none."""
    values = {s: sympy.Float(getattr(s, "value", 1.0)) for s in sympy.sympify(bound).free_symbols}
    return abs(float(sympy.sympify(bound).xreplace(values))) or 1.0
