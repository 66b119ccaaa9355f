"""Any friction law, warmer or colder than where it was found.

    lambda = (1 + a_T (T - T_ref)) lambda_0

lambda_0 friction force of the law within, and likewise what it holds in stick; T temperature of the contact, an input
or a parameter; T_ref temperature at which friction is that of the law; a_T share by which it rises with each kelvin.
Internal states of the law (bristles, ages) move as they do at T_ref.

Source: the first term of the expansion in temperature, as in Bittencourt & Gunnarsson, Static friction in a robot
joint: modeling and identification of load and temperature effects, Journal of Dynamic Systems, Measurement, and Control
134 (2012), where friction of gears is linear in T.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import ClassVar, Self, final

import sympy

from fmu_models.language.contacts import Law, Requirement
from fmu_models.language.dry_friction import parts_around
from fmu_models.language.law_parameter import declared
from fmu_models.language.laws.conti import Conti
from fmu_models.language.quantities import Input, InternalState, State

ROOM = 293.15  # K


@final
@dataclass(frozen=True)
class Warmed(Law):
    """Friction of the law ``law`` times 1 + a_T (T - T_ref)."""

    sticks: ClassVar[bool] = True
    law: Law
    T: sympy.Expr
    a_T: sympy.Expr = field(metadata=declared(0.0, "1/K", "share by which friction rises with each kelvin", -0.2, 0.2))
    T_ref: sympy.Expr = field(
        metadata=declared(ROOM, "K", "temperature at which friction is that of the law", 1.0, 3000.0)
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "sticks", self.law.sticks)  # as the law within does

    @classmethod
    def around(cls, own: object, suffix: str = "") -> Self:
        """A contact's own law with a temperature ``T<suffix>`` as an input; Conti's where it has none."""
        law = own if hasattr(own, "force") else Conti.around(own, suffix)
        T = Input(f"T{suffix}", ROOM, "K", "temperature of the contact")
        return cls(**parts_around(cls, SimpleNamespace(law=law, T=T), suffix))

    @property
    def factor(self) -> sympy.Expr:
        """Of friction, 1."""
        return 1 + self.a_T * (self.T - self.T_ref)

    @property
    def states(self) -> tuple[InternalState, ...]:
        """Those of the law within."""
        return self.law.states

    @property
    def renewed(self) -> Mapping[State, sympy.Expr]:
        """Those of the law within that jump."""
        return self.law.renewed

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N."""
        return self.factor * self.law.capacity

    @property
    def capacity_minus(self) -> sympy.Expr:
        return self.factor * self.law.capacity_minus

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        return self.factor * self.law.force(slip, sign)

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        return self.law.rates(slip, sign)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Those of the law within."""
        return self.law.requirements


LAW = Warmed
