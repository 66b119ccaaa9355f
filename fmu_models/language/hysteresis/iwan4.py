"""Joints that begin to slip little by little: Segalman's four-parameter model of Iwan.

    F = sum over sliders,    stiffness density rho(D) = R D^chi below D_max, and S at D_max
    D_max = F_S (1 + beta)/(K_T b),    R D_max^(chi + 2) = F_S (chi + 1)/b,    S D_max = F_S beta/b
    b = beta + (chi + 1)/(chi + 2)

F_S force at which all of it slides, K_T stiffness at rest, -1 < chi <= 0 with dissipation a cycle as amplitude to the
power 3 + chi, beta share of what lets go at once. The density is parted into cells of equal width in D, each a slider
with the stiffness of its cell and its force at full slip.

Source: Segalman, A four-parameter Iwan model for lap-type joints, Journal of Applied Mechanics 72 (2005).
"""

from dataclasses import dataclass
from functools import cached_property

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.hysteresis.law import Expr
from fmu_models.language.hysteresis.sliders import Sliders


@dataclass(frozen=True)
class Iwan4(Sliders):
    """A joint of ``F_S`` (N), ``K_T`` (N/m), ``chi`` and ``beta``, by so many ``sliders``."""

    F_S: Expr
    K_T: Expr
    chi: Expr
    beta: Expr
    sliders: int = 20

    @property
    def elements(self) -> tuple[tuple[Expr, Expr], ...]:
        """A slider a cell, and that which lets go last."""
        return self._cells

    @cached_property
    def _cells(self) -> tuple[tuple[Expr, Expr], ...]:
        share = self.beta + (self.chi + 1) / (self.chi + 2)
        last = self.F_S * (1 + self.beta) / (self.K_T * share)
        cells = self.sliders - 1
        elements = []
        for i in range(cells):
            low, high = (sympy.Rational(end, cells) for end in (i, i + 1))
            # integrals of D^chi and of D^(chi + 1) over the cell, in units of D_max
            stiffness, force = (
                (high ** (self.chi + power) - (low ** (self.chi + power) if i else 0)) / (self.chi + power)
                for power in (1, 2)
            )
            elements.append((self.F_S * (self.chi + 1) * stiffness / (share * last), last * force / stiffness))
        return (*elements, (self.F_S * self.beta / (share * last), last))

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A density that can be summed."""
        sentence = f"{self.chi} must lie above -1: the density of sliders has no sum otherwise"
        return (Requirement(sympy.sympify(self.chi + 1), sentence, strict=True),)
