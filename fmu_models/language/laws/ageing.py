"""Conti's friction law whose breakaway ages: the longer a contact sticks, the more it holds.

    in slip    lambda = -N mu(|v|) sgn(v),    mu(v) = (mu_s - mu_k)/(1 + p v) + mu_k
    in stick   |lambda| < N (mu_s + b log10(1 + t/t_0))

v slip speed, lambda friction force along positive slip, N normal force; mu_s, mu_k and p as in ``conti``; t time since
the contact has begun to stick, b growth of the breakaway coefficient with every decade of it, t_0 the time after which
growth is by decades. What has aged is lost where slip begins: the force falls there by N b log10(1 + t/t_0).

Source: Dieterich, Time-dependent friction in rocks, Journal of Geophysical Research 77 (1972), whose breakaway is
mu_0 + A log10(1 + B t); slip by equation (2) of Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self, final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.law_parameter import T_0, declared
from fmu_models.language.laws.conti import Conti
from fmu_models.language.quantities import InternalState, State


@final
@dataclass(frozen=True)
class Ageing(Conti):
    """Conti's law with a breakaway that grows with the logarithm of the time in stick."""

    label: ClassVar[str] = "Conti+ageing"
    b: sympy.Expr = field(metadata=declared(0.01, "1", "growth of breakaway per decade of time in stick", 0.0, 1.0))
    t_0: sympy.Expr = field(
        metadata=declared(T_0, "s", "time in stick after which breakaway grows by decades", 1e-9, 1e4)
    )
    clock: InternalState = field(default_factory=lambda: _clock("t_stick"))

    @classmethod
    def around(cls, own: object, suffix: str = "") -> Self:
        """The law in place of a contact's own, with a clock ``t_stick<suffix>``."""
        return replace(super().around(own, suffix), clock=_clock(f"t_stick{suffix}"))

    @property
    def states(self) -> tuple[InternalState, ...]:
        """The time in stick."""
        return (self.clock,)

    @property
    def renewed(self) -> Mapping[State, sympy.Expr]:
        """The clock starts at zero."""
        return {self.clock: sympy.S.Zero}

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N, which grows with its time."""
        return self.N * (self.mu_s + self.b * sympy.log(1 + self.clock / self.t_0) / sympy.log(10))

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """The clock goes in stick alone."""
        return (1 - sign**2,)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Requirements of Conti's law, and a time that is positive."""
        positive = f"{self.t_0} must be positive: it is the time after which breakaway grows"
        return (*super().requirements, Requirement(sympy.sympify(self.t_0), positive, strict=True))


def _clock(name: str) -> InternalState:
    return InternalState(name, "s", "time since the contact has begun to stick, 0 in slip", nominal=0.1)


LAW = Ageing
