"""Dieterich's friction of rate and state: contacts that age.

    lambda = -N mu sgn(v),    mu = mu_r + a ln((|v| + v_c)/v_r) + b ln(v_r theta/D_c)
    theta' = 1 - (|v| + v_c) theta/D_c,    in steady slip    mu = mu_r - (b - a) ln((|v| + v_c)/v_r)

v slip speed, lambda friction force along positive slip, N normal force, theta mean age of the contacts between the
surfaces, D_c slip that renews them, a and b direct and evolution effect, mu_r friction coefficient in steady slip at
the speed v_r. In stick |lambda| < N mu at v = 0: every factor e of time in stick raises the breakaway by b.
The speed v_c of creep, under which a contact is held to stick, keeps the logarithms finite.

Source: Dieterich, Modeling of rock friction 1, Journal of Geophysical Research 84 (1979); Ruina, Slip instability and
state variable friction laws, Journal of Geophysical Research 88 (1983), whose names of the constants are used.
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self, final

import sympy

from fmu_models.language.contacts import Requirement
from fmu_models.language.dry_friction import DryFriction, fixed_factors
from fmu_models.language.law_parameter import coefficient, declared
from fmu_models.language.quantities import InternalState


@dataclass(frozen=True)
class RateState(DryFriction):
    """Friction by the slip speed and the age of contacts. ``weakening`` is b - a; v_r and v_c are in m/s."""

    N: sympy.Expr
    mu_r: sympy.Expr = field(metadata=coefficient(0.5, "friction coefficient in steady slip at the speed v_r"))
    weakening: sympy.Expr = field(
        metadata=declared(0.02, "1", "fall of steady friction for every factor e in slip speed, b - a", -1.0, 1.0)
    )
    a: sympy.Expr = field(metadata=declared(0.01, "1", "direct effect of slip speed", 0.0, 1.0))
    D_c: sympy.Expr = field(metadata=declared(1e-4, "m", "slip that renews the contacts", 1e-9, 1.0))
    v_r: float = 0.05
    v_c: float = 1e-6
    age: InternalState = field(default_factory=lambda: _age("theta"))

    @classmethod
    def around(cls, own: object, suffix: str = "") -> Self:
        """The law in place of a contact's own, with an age ``theta<suffix>``."""
        return replace(super().around(own, suffix), age=_age(f"theta{suffix}"))

    @property
    def states(self) -> tuple[InternalState, ...]:
        """The age of the contacts."""
        return (self.age,)

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.N * (self.mu_r - self.weakening * sympy.log((speed + self.v_c) / self.v_r))

    def at_age(self, speed: sympy.Expr) -> sympy.Expr:
        """Friction force at the age of the contacts, N."""
        aged = (self.a + self.weakening) * sympy.log(self.v_r * self.age / self.D_c)
        return self.N * (self.mu_r + self.a * sympy.log((speed + self.v_c) / self.v_r) + aged)

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N, which grows with age."""
        return self.at_age(sympy.S.Zero)

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        return -sign * self.at_age(sign * slip)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Contacts that have an age, and friction in creep."""
        scale = f"{self.D_c} must be positive: it is the slip that renews the contacts"
        rests = f"{self.mu_r} is too small: friction in creep at {self.v_c} m/s must not be negative"
        return (
            Requirement(sympy.sympify(self.D_c), scale, strict=True),
            Requirement(fixed_factors(self.magnitude(sympy.S.Zero)), rests),
        )


@final
@dataclass(frozen=True)
class Dieterich(RateState):
    """Contacts age with time, also at rest."""

    label: ClassVar[str] = "Dieterich"

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        return (1 - (sign * slip + self.v_c) * self.age / self.D_c,)


def _age(name: str) -> InternalState:
    return InternalState(name, "s", "mean age of the contacts between the surfaces", start=1.0, nominal=1e-2)


LAW = Dieterich
