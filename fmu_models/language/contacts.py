"""Friction contacts, and what every kind of contact shares.

A contact with slip speed y (affine in the velocities v) acts on the body with the generalised force (dy/dv)^T lambda.
During slip its law gives lambda; during stick lambda is whatever keeps y' = 0, up to the capacity of the law.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Protocol

import sympy

from fmu_models.base.shown import Shown
from fmu_models.language.dimensions import way_unit
from fmu_models.language.quantities import InternalState, Quantity, State, per_second


class Requirement(NamedTuple):
    """Something the parameters must satisfy: ``expression`` >= 0, or > 0 if ``strict``.

    ``sentence`` is what the user reads if they do not; ``warning`` what a fit says that found such values of a law,
    with {names} of its parameters and {law}.
    """

    expression: sympy.Expr
    sentence: str
    strict: bool = False
    warning: str = ""


class Law(Protocol):
    """A friction law; one file each in ``laws``. Force and rates are analytic for each sign of the slip speed."""

    sticks: ClassVar[bool]
    """Whether lambda jumps at zero slip, so that the contact can stick."""

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force lambda in stick, N; that against negative slip."""
        ...

    @property
    def capacity_minus(self) -> sympy.Expr:
        """Largest -lambda in stick, N; that against positive slip."""
        ...

    @property
    def states(self) -> tuple[InternalState, ...]:
        """Internal states."""
        ...

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the parameters of the law must satisfy."""
        ...

    @property
    def renewed(self) -> Mapping[State, sympy.Expr]:
        """Internal states, of those that jump where stick begins or ends."""
        ...

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force lambda along positive slip, N, at ``slip`` (m/s) of sign ``sign`` (+1 or -1)."""
        ...

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """Rates of the internal states; in stick the sign is 0."""
        ...


class ContactSymbol(Quantity):
    """A quantity that the engine computes for a contact: its force, slip speed or sign of slip."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Friction(Shown):
    """A contact with a friction law.

    Attributes:
        name: of the contact, for example "disc0".
        slip: slip speed, m/s or rad/s; affine in the velocities.
        law: friction law.
        where: there is contact only where this function of coordinates, inputs and time is not negative; everywhere
            if left out.
        description: what rubs on what.
        force: the friction force lambda along positive slip, N, or its moment, N m, of an angular slip, in whatever
            state the contact is; for outputs.
    """

    name: str
    slip: sympy.Expr
    law: Law
    where: sympy.Expr | None = None
    description: str = ""
    force: ContactSymbol = field(init=False)
    slip_speed: ContactSymbol = field(init=False)
    sign: ContactSymbol = field(init=False)

    def __post_init__(self) -> None:
        way = way_unit(self.slip)
        create_symbols(self, force=FORCE_UNITS[way], slip_speed=per_second(way), sign="1")

    @property
    def shown(self) -> tuple[ContactSymbol, ...]:
        """What outputs may use of it."""
        return (self.force,)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the parameters of its law must satisfy."""
        return self.law.requirements

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        """Everything that the contact is declared by."""
        law = self.law
        bounds = () if self.where is None else (sympy.sympify(self.where),)
        rates = law.rates(self.slip_speed, self.sign)
        force = law.force(self.slip_speed, self.sign)
        return tuple(map(sympy.sympify, (self.slip, *bounds, law.capacity, law.capacity_minus, force, *rates)))

    @property
    def symbols(self) -> set[sympy.Basic]:
        """Quantities that the contact uses: those of its slip speed, its region and its law."""
        return set().union(*(e.free_symbols for e in self.expressions)) - {self.slip_speed, self.sign}


# of what does work along a way, by the unit of the way
FORCE_UNITS = {"m": "N", "rad": "N m", "1": "1"}


def create_symbols(contact: Any, **units: str) -> None:
    """Give a frozen contact the quantities that the engine computes for it, by name and unit."""
    for name, unit in units.items():
        symbol = ContactSymbol._create(f"{contact.name}_{name}", unit, f"{name} of contact {contact.name}")
        object.__setattr__(contact, name, symbol)
