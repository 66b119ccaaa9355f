"""What checks and lowering know of a declared body: its energies, contacts and outputs, whatever class holds them."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self, TypeVar

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


class Body(Protocol):
    """A body with its contacts; the attributes are those of a `Mechanism`."""

    @property
    def name(self) -> str: ...
    @property
    def coordinates(self) -> Sequence[Coordinate]: ...
    @property
    def kinetic_energy(self) -> sympy.Expr: ...
    @property
    def potential_energy(self) -> sympy.Expr: ...
    @property
    def dissipation(self) -> sympy.Expr: ...
    @property
    def applied(self) -> Mapping[Coordinate, sympy.Expr]: ...
    @property
    def contacts(self) -> Sequence[Contact]: ...
    @property
    def outputs(self) -> Sequence[Output]: ...
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...
    @property
    def inputs(self) -> tuple[Input, ...]: ...
    @property
    def signals(self) -> tuple[PeriodicSignal, ...]: ...
    @property
    def all_inputs(self) -> tuple[Input, ...]: ...
    @property
    def internal_states(self) -> tuple[InternalState, ...]: ...
    @property
    def impacts(self) -> tuple[Contact, ...]: ...
    @property
    def symbols(self) -> set[sympy.Basic]: ...
    @property
    def all_requirements(self) -> tuple[Requirement, ...]: ...


def quantities_of_type(symbols: set[sympy.Basic], kind: type[Q]) -> tuple[Q, ...]:
    """Those of one kind among the symbols, in the order of their declaration."""
    return tuple(sorted((s for s in symbols if isinstance(s, kind)), key=lambda s: s.declared))
