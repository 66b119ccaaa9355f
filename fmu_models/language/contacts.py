"""Friction contacts.

A contact with slip speed y (affine in the velocities v) acts on the body with the generalised force (dy/dv)^T lambda.
During slip its law gives lambda; during stick lambda is whatever keeps y' = 0, up to the capacity of the law.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple, Protocol

import sympy

from fmu_models.language.quantities import InternalState, Quantity


class Requirement(NamedTuple):
    """Something the parameters must satisfy: ``expression`` >= 0, or > 0 if ``strict``.

    ``sentence`` is what the user reads if they do not.
    """

    expression: sympy.Expr
    sentence: str
    strict: bool = False


class Law(Protocol):
    """A friction law; one file each in ``laws``. Force and rates are analytic for each sign of the slip speed."""

    sticks: ClassVar[bool]
    """Whether lambda jumps at zero slip, so that the contact can stick."""

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N."""
        ...

    @property
    def states(self) -> tuple[InternalState, ...]:
        """Internal states."""
        ...

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the parameters of the law must satisfy."""
        ...

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force lambda along positive slip, N, at ``slip`` (m/s) of sign ``sign`` (+1 or -1)."""
        ...

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """Rates of the internal states."""
        ...


class ContactSymbol(Quantity):
    """A quantity that the engine computes for a contact: its force, slip speed or sign of slip."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Friction:
    """A contact with a friction law.

    Attributes:
        name: of the contact, for example "disc0".
        slip: slip speed, m/s; affine in the velocities.
        law: friction law.
        description: what rubs on what.
        force: the friction force lambda along positive slip, N, in whatever state the contact is; for outputs.
    """

    name: str
    slip: sympy.Expr
    law: Law
    description: str = ""
    force: ContactSymbol = field(init=False)
    slip_speed: ContactSymbol = field(init=False)
    sign: ContactSymbol = field(init=False)

    def __post_init__(self) -> None:
        symbols = {"force": "N", "slip_speed": "m/s", "sign": "1"}
        for name, unit in symbols.items():
            symbol = ContactSymbol._create(f"{self.name}_{name}", unit, f"{name} of contact {self.name}")
            object.__setattr__(self, name, symbol)

    @property
    def symbols(self) -> set[sympy.Basic]:
        """Quantities that the contact uses: those of its slip speed and of its law."""
        expressions = [self.slip, self.law.capacity, self.law.force(self.slip_speed, self.sign)]
        expressions += self.law.rates(self.slip_speed, self.sign)
        used = set().union(*(sympy.sympify(e).free_symbols for e in expressions))
        return used - {self.slip_speed, self.sign}
