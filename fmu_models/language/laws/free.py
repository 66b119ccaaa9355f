"""Friction free of any form: a smooth curve through values between which it never overshoots.

    lambda = -N mu(|v|) sgn(v),    mu(v) = mu_0 + sum_i (mu_i - mu_(i-1)) s_i(v),    i = 1 .. 8
    s_i(v) = (y^4 - 1)/(y^4 + exp(4 h (i - 1/2))),    y = 1 + v/V,    h = 1/2,    V = v_end/(exp(7 h) - 1)

v slip speed, lambda friction force along positive slip, N normal force; mu_0 friction coefficient at rest, mu_i that
about the knot v_i = V (exp(i h) - 1): the seventh is v_end, the greatest slip speed that was seen, and far beyond it
friction is N mu_8. In stick |lambda| < N mu_0. The steps s_i are analytic where splines are not, so that a motion may
be followed by its Taylor series; mu is a mean of the mu_i with weights that are positive and sum to one.

Source: logistic steps in ln y in place of B-splines, whose sum is one too: de Boor, A Practical Guide to Splines
(1978), chapter 9.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar, final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.law_parameter import KNOT_SPACING, KNOTS_INSIDE, STEEPNESS, coefficient, declared


@final
@dataclass(frozen=True)
class Free(DryFriction):
    """A curve of friction coefficients over slip speed."""

    label: ClassVar[str] = "free"
    spans: ClassVar[str] = "v_end"
    N: sympy.Expr
    mu_0: sympy.Expr = field(metadata=coefficient(0.6, "friction coefficient at vanishing slip speed"))
    mu_1: sympy.Expr = field(metadata=coefficient(0.55, "friction coefficient about 0.020 v_end"))
    mu_2: sympy.Expr = field(metadata=coefficient(0.5, "friction coefficient about 0.053 v_end"))
    mu_3: sympy.Expr = field(metadata=coefficient(0.45, "friction coefficient about 0.11 v_end"))
    mu_4: sympy.Expr = field(metadata=coefficient(0.42, "friction coefficient about 0.20 v_end"))
    mu_5: sympy.Expr = field(metadata=coefficient(0.4, "friction coefficient about 0.35 v_end"))
    mu_6: sympy.Expr = field(metadata=coefficient(0.39, "friction coefficient about 0.59 v_end"))
    mu_7: sympy.Expr = field(metadata=coefficient(0.38, "friction coefficient about v_end"))
    mu_8: sympy.Expr = field(metadata=coefficient(0.38, "friction coefficient far beyond v_end"))
    v_end: sympy.Expr = field(metadata=declared(0.3, "m/s", "greatest slip speed of the curve", 1e-4, 100.0))

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        values = (self.mu_0, self.mu_1, self.mu_2, self.mu_3, self.mu_4, self.mu_5, self.mu_6, self.mu_7, self.mu_8)
        # numbers are exact: a floating-point one would pass for a quantity of any unit
        spacing = sympy.Rational(KNOT_SPACING)
        power = (1 + speed * (sympy.exp(KNOTS_INSIDE * spacing) - 1) / self.v_end) ** STEEPNESS
        mu = sympy.sympify(self.mu_0)
        for number, (before, after) in enumerate(pairwise(values)):
            step = sympy.exp(STEEPNESS * spacing * (number + sympy.S.Half))
            mu += (after - before) * (power - 1) / (power + step)
        return self.N * mu

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A speed to which the curve reaches."""
        return (
            Requirement(sympy.sympify(self.v_end), f"{self.v_end} must be positive: the curve ends there", strict=True),
        )


LAW = Free
