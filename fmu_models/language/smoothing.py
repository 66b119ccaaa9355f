"""Laws with the jump at zero slip smoothed over a width; the shapes are in ``laws/tanh.py`` and ``laws/arctan.py``.

    lambda = law(v, sgn(v))  becomes  law(v, shape(v/width))

This is a regularisation for comparison with codes that need one. The contact never sticks: where the law would hold
it, it creeps at a fraction of the width. The equations become stiff as 1/width, so that run time and error of such a
model depend on the width, unlike those of the law itself.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Self

import sympy

from fmu_models.language.contacts import Law, Requirement
from fmu_models.language.quantities import InternalState, Parameter


@dataclass(frozen=True)
class Smoothed(ABC):
    """A set-valued ``law`` smoothed over the slip speed ``width``, m/s."""

    law: Law
    width: sympy.Expr
    sticks: ClassVar[bool] = False

    @classmethod
    def around(cls, law: Law, suffix: str = "", *, width: float = 1e-4) -> Self:
        """The law smoothed over a parameter ``width<suffix>``."""
        return cls(
            law, Parameter(f"width{suffix}", width, "m/s", "slip speed that friction is smoothed over", positive=True)
        )

    @abstractmethod
    def shape(self, ratio: sympy.Expr) -> sympy.Expr:
        """An odd function that rises from -1 to 1."""

    @property
    def states(self) -> tuple[InternalState, ...]:
        """Those of the law."""
        return self.law.states

    @property
    def capacity(self) -> sympy.Expr:
        """That of the law, N."""
        return self.law.capacity

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        return self.law.force(slip, self.shape(slip / self.width))

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """Those of the law."""
        return self.law.rates(slip, self.shape(slip / self.width))

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Those of the law, and a width."""
        sentence = f"{self.width} must be positive: friction is smoothed over it"
        return (*self.law.requirements, Requirement(sympy.sympify(self.width), sentence, strict=True))
