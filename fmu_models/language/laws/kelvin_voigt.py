"""Spring and dashpot side by side.

    F = k d + c d'

F compressive force, d depth, k stiffness, c damping. With c > 0 the force jumps to c d' at entry and would pull while
the body still leaves: a stop that cannot pull needs release="force".

Source: Voigt's model; the support of an oscillator with a discontinuous support.
"""

from dataclasses import dataclass
from typing import ClassVar

import sympy

from fmu_models.language.stops import StopLaw


@dataclass(frozen=True)
class KelvinVoigt(StopLaw):
    """Stop of stiffness ``k`` (N/m) and damping ``c`` (N s/m)."""

    k: sympy.Expr
    c: sympy.Expr
    remembers: ClassVar[bool] = False

    def force(self, depth: sympy.Expr, rate: sympy.Expr, memory: sympy.Expr) -> sympy.Expr:
        return self.k * depth + self.c * rate


LAW = KelvinVoigt
