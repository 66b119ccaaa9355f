"""What a law with memory says: how its states move with the way, and which force they make.

    F = f(x, x', z),    z' = g(x', z),    |z_i| <= D_i of those that have a bound

x way, F force that resists it. A law is made of numbers and parameters alone; its states are made by its contact, which
knows their names and the unit of the way.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Law, Requirement
from fmu_models.language.quantities import InternalState

# SymPy annotates the arguments of expressions as Basic, which has no arithmetic
Expr = Any


class HysteresisLaw(ABC):
    """A law with memory. Force and rates are analytic for each choice of the signs that they read."""

    @abstractmethod
    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        """The states z of a contact of this name, whose way is in ``unit``."""

    @abstractmethod
    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        """Rates of the states, at ``speed`` along the way and with the signs of `switches`."""

    @abstractmethod
    def force(self, way: Expr, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> Expr:
        """Force F that resists the way, N, or its moment, N m."""

    def switches(self, speed: Expr, z: Sequence[Expr]) -> dict[str, Expr]:
        """Functions whose signs force and rates read, by a name."""
        return {}

    def bounds(self) -> dict[int, Expr]:
        """D_i by the number of the state, of those that have a bound."""
        return {}

    @property
    def rooted(self) -> tuple[str, ...]:
        """Names of switches that are a state, of which it reads half-integer powers above 1, as (sign z)^(3/2)."""
        return ()

    @property
    def elements(self) -> tuple[tuple[Expr, Expr], ...]:
        """Stiffness and bound of each slider, of a law that is a sum of sliders."""
        return ()

    def carried(self, z: Sequence[Expr], signs: Mapping[str, Expr], bound: int, outward: int) -> dict[int, Expr]:
        """Rates of further states by their number, per unit of speed at which a state is held at its ``bound``;
        ``outward``: +1 at the upper, -1 at the lower end."""
        return {}

    @property
    def lowered(self) -> HysteresisLaw:
        """The law as a contact computes it."""
        return self

    @property
    def full(self) -> tuple[Expr, ...]:
        """The largest states, to which a long way leads, of as many as have one."""
        return tuple(self.bounds().values())

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the parameters must satisfy beside the bounds' being positive."""
        return ()


@dataclass(frozen=True)
class OfSlip(HysteresisLaw):
    """A friction law whose bristles remember, such as LuGre, along the way of a contact."""

    law: Law

    def __post_init__(self) -> None:
        if not hasattr(self.law, "rates") or self.law.sticks:
            raise StickslipError(
                f"{type(self.law).__name__} is no law with memory: it sticks by itself. Write it as "
                "Friction(slip=..., law=...); LuGre, Dahl, MaxwellSlip, Iwan4 and BoucWen are laws of a Hysteresis."
            )

    def states(self, name: str, unit: str) -> tuple[InternalState, ...]:
        return self.law.states

    def switches(self, speed: Expr, z: Sequence[Expr]) -> dict[str, Expr]:
        return {"speed": speed}

    def rates(self, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> tuple[Expr, ...]:
        return self.law.rates(speed, signs["speed"])

    def force(self, way: Expr, speed: Expr, z: Sequence[Expr], signs: Mapping[str, Expr]) -> Expr:
        return -sympy.sympify(self.law.force(speed, signs["speed"]))

    @property
    def full(self) -> tuple[Expr, ...]:
        """What the law itself says."""
        return getattr(self.law, "full", ())

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return self.law.requirements
