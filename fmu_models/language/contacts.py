"""What every kind of contact shares.

A contact with slip speed y (affine in the velocities v) acts on the body with the generalised force (dy/dv)^T lambda.
During slip its law gives lambda; during stick lambda is whatever keeps y' = 0, up to the capacity of the law.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Self

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.language.contact_dynamics import ContactDynamics, Element, Rates, terms
from fmu_models.language.contact_kinds import ContactKind
from fmu_models.language.dimensions import Dimensions
from fmu_models.language.quantities import ContactSymbol, Coordinate, InternalState, State, per_second


class Requirement(NamedTuple):
    """Something the parameters must satisfy: ``expression`` >= 0, or > 0 if ``strict``.

    ``sentence`` is what the user reads if they do not; ``warning`` what a fit says that found such values of a law,
    with {names} of its parameters and {law}.
    """

    expression: sympy.Expr
    sentence: str
    strict: bool = False
    warning: str = ""


class Law(ABC):
    """A friction law; one file each in ``laws``. Force and rates are analytic for each sign of the slip speed. One that
    says nothing else has no internal states."""

    sticks: ClassVar[bool]
    """Whether lambda jumps at zero slip, so that the contact can stick."""

    @property
    @abstractmethod
    def capacity(self) -> sympy.Expr:
        """Largest force lambda in stick, N; that against negative slip."""

    @property
    def capacity_minus(self) -> sympy.Expr:
        """Largest -lambda in stick, N; that against positive slip, of most laws the same."""
        return self.capacity

    @property
    def states(self) -> tuple[InternalState, ...]:
        """Internal states."""
        return ()

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the parameters of the law must satisfy beside their bounds."""
        return ()

    @property
    def renewed(self) -> Mapping[State, sympy.Expr]:
        """Internal states, of those that jump where stick begins or ends."""
        return {}

    @abstractmethod
    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force lambda along positive slip, N, at ``slip`` (m/s) of sign ``sign`` (+1 or -1)."""

    def rates(self, slip: sympy.Expr, sign: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """Rates of the internal states; in stick the sign is 0."""
        return ()


class Contact(Shown, ABC):
    """A declared contact: what checks, lowering and reports ask of it, whatever its kind.

    A new one is a frozen dataclass with the ``kind`` of its (first) direction and ``dynamics``; what it does not say
    itself has a default here.
    """

    kind: ClassVar[ContactKind]
    exchangeable: ClassVar[bool] = False
    """Whether its ``law`` could be another."""
    name: str
    description: str
    force: ContactSymbol

    @property
    def driven(self) -> bool:
        """Whether forces may hold its states: they are driven states of the system, like velocities."""
        return False

    @property
    def array(self) -> tuple[Element, ...]:
        """Its elements, where they are many and equal."""
        return ()

    @property
    def shown(self) -> tuple[ContactSymbol, ...]:
        """What outputs may use of it."""
        return (self.force,)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the parameters must satisfy for it, or else for its law."""
        return self.rule.requirements

    @property
    @abstractmethod
    def expressions(self) -> tuple[sympy.Expr, ...]:
        """Everything that it is declared by."""

    @abstractmethod
    def check(self, coordinates: Sequence[Coordinate]) -> None:
        """Refuse a slip speed or a gap that is none."""

    @abstractmethod
    def check_units(self, units: Dimensions) -> None:
        """Refuse parts whose units do not match."""

    @abstractmethod
    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        """What it is lowered to, to stand at ``index`` among the contacts of the system."""

    def _direction(
        self, rates: Rates, slip: sympy.Expr, depth: sympy.Expr | None = None, **columns: Any
    ) -> ContactDynamics:
        """A row of ``dynamics``: along a slip speed, in touch where a depth is positive; its other columns by name."""
        common = {"name": self.name, "description": self.description, "kind": self.kind}
        along = {"slip": slip, "slip_rate": rates.of_speed(sympy.sympify(slip)), "slip_terms": terms(slip)}
        inside = {} if depth is None else {"depth": depth, "depth_terms": terms(depth)}
        return ContactDynamics(**{**common, **along, **inside, **columns})

    @property
    def symbols(self) -> set[sympy.Basic]:
        """Quantities that the contact uses."""
        return set().union(*(e.free_symbols for e in self.expressions))

    @property
    def directions(self) -> int:
        """How many rows ``dynamics`` has."""
        return 1

    @property
    def slips(self) -> tuple[sympy.Expr, ...]:
        """The slip speeds that its friction rubs against."""
        slip: Any = getattr(self, "slip", None)
        return () if slip is None else slip if isinstance(slip, tuple) else (sympy.sympify(slip),)

    @property
    def names(self) -> Iterator[tuple[str, str]]:
        """Every name that a user of the model will meet, with what it belongs to."""
        yield self.name, f"contact '{self.name}'"
        yield f"{self.name}_state", f"the state of contact {self.name}"
        yield f"{self.name}_force", f"the force of contact {self.name}, which every model shows"

    @property
    def written(self) -> Mapping[sympy.Basic, sympy.Expr]:
        """What outputs show of it, from the forces lambda of its directions; nothing where it is one of them."""
        return {}

    @property
    def steady(self) -> tuple[sympy.Expr, sympy.Expr] | None:
        """A force lambda that acts in every state of the contact, and the speed along which it does; None without."""
        return None

    @property
    def law_force(self) -> sympy.Expr | None:
        """Its force by a law, of the quantities that the law reads; None without a law."""
        return None

    @property
    def place(self) -> sympy.Expr | None:
        """Where it is: its gap, or the function that is negative outside its region; None if it is everywhere."""
        return getattr(self, "gap", None)

    @property
    def rule(self) -> Any:
        """What says how it acts: its law, of a rigid contact its restitution."""
        return getattr(self, "law", None)

    @property
    def states(self) -> tuple[InternalState, ...]:
        """Internal states of its law."""
        return ()

    @property
    def rates(self) -> tuple[sympy.Expr, ...]:
        """Rates of the internal states."""
        return ()

    def exchangeable_law(self, model: str) -> Any:
        """The law that could be another; ``model`` is whose contact it is. StickslipError: it has none."""
        if not self.exchangeable:
            raise StickslipError(
                f"contact '{self.name}' of {model} has no law that could be another. Set its parameters."
            )
        contact: Any = self  # one that has a law
        return contact.law

    def _check_rates(self, units: Dimensions) -> None:
        for state, rate in zip(self.states, self.rates, strict=True):
            units.expect(f"the rate of {state.name}", rate, per_second(state.unit))

    def with_law(self, law: object) -> Self:
        """The contact with another law."""
        contact: Any = self  # a frozen dataclass that has a law
        return dataclasses.replace(contact, law=law)


# of what does work along a way, by the unit of the way
FORCE_UNITS = {"m": "N", "rad": "N m", "1": "1"}


def create_symbols(contact: Any, **units: str) -> None:
    """Give a frozen contact the quantities that the engine computes for it, by name and unit."""
    for name, unit in units.items():
        symbol = ContactSymbol._create(f"{contact.name}_{name}", unit, f"{name} of contact {contact.name}")
        object.__setattr__(contact, name, symbol)
