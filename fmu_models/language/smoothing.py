"""Laws with the jump at zero slip smoothed over a width; the shapes are in ``laws/tanh.py`` and ``laws/arctan.py``.

    lambda = law(v, sgn(v))  becomes  law(v, shape(v/width))

This is a regularisation for comparison with codes that need one. The contact never sticks: where the law would hold
it, it creeps at a fraction of the width. The equations become stiff as 1/width, so that run time and error of such a
model depend on the width, unlike those of the law itself.
"""

from abc import abstractmethod
from dataclasses import dataclass, field
from math import inf
from types import SimpleNamespace
from typing import ClassVar, Self

import sympy

from fmu_models.language.contacts import Law, Requirement
from fmu_models.language.dry_friction import parts_around
from fmu_models.language.law_parameter import declared
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class Smoothed(Law):
    """A set-valued ``law`` smoothed over the slip speed ``width``, m/s."""

    law: Law
    width: sympy.Expr = field(metadata=declared(1e-4, "m/s", "slip speed that friction is smoothed over", 1e-12, inf))
    sticks: ClassVar[bool] = False

    @classmethod
    def around(cls, own: object, suffix: str = "") -> Self:
        """A contact's own law smoothed over a parameter ``width<suffix>``."""
        return cls(**parts_around(cls, SimpleNamespace(law=own), suffix))

    @abstractmethod
    def shape(self, ratio: sympy.Expr) -> sympy.Expr:
        """An odd function that rises from -1 to 1."""

    @property
    def states(self) -> tuple[InternalState, ...]:
        return self.law.states

    @property
    def capacity(self) -> sympy.Expr:
        return self.law.capacity

    @property
    def capacity_minus(self) -> sympy.Expr:
        return self.law.capacity_minus

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        return self.law.force(slip, self.shape(slip / self.width))

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        return self.law.rates(slip, self.shape(slip / self.width))

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Requirements of the law, and a width above zero."""
        sentence = f"{self.width} must be positive: friction is smoothed over it"
        return (*self.law.requirements, Requirement(sympy.sympify(self.width), sentence, strict=True))
