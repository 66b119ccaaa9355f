"""What checks and lowering know of a declared body: its energies, contacts and outputs, whatever class holds them."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self, TypeVar

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.language.contacts import Contact, Requirement
from fmu_models.language.quantities import Coordinate, Input, InternalState, Parameter, Quantity
from fmu_models.language.signals import PeriodicSignal

Q = TypeVar("Q", bound=Quantity)


@dataclass(frozen=True, eq=False)
class Output(Shown):
    """A quantity to be shown; its expression may also use accelerations and what contacts show, such as forces."""

    name: str
    expression: sympy.Expr
    unit: str
    description: str


class Declaration(Shown, ABC):
    """A declared model: a mechanism, an automaton or a map."""

    name: str
    title: str
    source: str
    requirements: Sequence[Requirement]

    def _heading(self) -> str:
        return f"{type(self).__name__} '{self.name}': {self.title}"

    @property
    @abstractmethod
    def symbols(self) -> set[sympy.Basic]:
        """Quantities that it uses."""

    def restricted_to(self, contacts: Iterable[str]) -> Self:
        """Refused: raises StickslipError, but of a mechanism."""
        raise StickslipError(
            f"{self.name} has no contacts to choose from ({', '.join(contacts)}): what switches is part of it."
        )

    def with_law(self, **laws: Any) -> Self:
        """Refused: raises StickslipError, but of a mechanism."""
        raise StickslipError(f"{self.name} has no contacts that could have another law ({', '.join(laws)}).")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters used, in the order of their declaration."""
        return quantities_of_type(self.symbols, Parameter)

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The inputs used, in the order of their declaration."""
        return tuple(u for u in quantities_of_type(self.symbols, Input) if not isinstance(u, PeriodicSignal))

    @property
    def signals(self) -> tuple[PeriodicSignal, ...]:
        """The periodic signals used, in the order of their declaration."""
        return quantities_of_type(self.symbols, PeriodicSignal)

    @property
    def all_inputs(self) -> tuple[Input, ...]:
        """The inputs, then the signals."""
        return (*self.inputs, *self.signals)

    @property
    def all_requirements(self) -> tuple[Requirement, ...]:
        """What the parameters must satisfy together."""
        return (*self.requirements, *(r for signal in self.signals for r in signal.requirements))


@dataclass(frozen=True, eq=False, kw_only=True)
class Body(Declaration):
    """A body with its contacts, as a `Mechanism` declares it."""

    name: str
    title: str
    source: str
    coordinates: Sequence[Coordinate]
    kinetic_energy: sympy.Expr
    potential_energy: sympy.Expr = sympy.S.Zero
    dissipation: sympy.Expr = sympy.S.Zero
    applied: Mapping[Coordinate, sympy.Expr] = field(default_factory=dict)
    contacts: Sequence[Contact] = ()
    outputs: Sequence[Output] = ()
    requirements: Sequence[Requirement] = ()

    @property
    def internal_states(self) -> tuple[InternalState, ...]:
        """The internal states of the laws, contact by contact."""
        return tuple(state for contact in self.contacts for state in contact.states)

    @property
    def impacts(self) -> tuple[Contact, ...]:
        """The rigid contacts."""
        return tuple(contact for contact in self.contacts if contact.kind.impulsive)


def quantities_of_type(symbols: set[sympy.Basic], kind: type[Q]) -> tuple[Q, ...]:
    """Those of one kind among the symbols, in the order of their declaration."""
    return tuple(sorted((s for s in symbols if isinstance(s, kind)), key=lambda s: s.declared))
