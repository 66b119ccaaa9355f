"""Friction contacts, and what every kind of contact shares.

A contact with slip speed y (affine in the velocities v) acts on the body with the generalised force (dy/dv)^T lambda.
During slip its law gives lambda; during stick lambda is whatever keeps y' = 0, up to the capacity of the law.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.language.contact_checks import check_place, check_slip, check_turning
from fmu_models.language.contact_dynamics import ContactDynamics, Element, Rates, terms
from fmu_models.language.contact_kinds import CONE, CONE_SIDE, FRICTION, ContactKind
from fmu_models.language.dimensions import Dimensions, way_unit
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


class _Rubbing(Contact):
    """Friction against slip speeds, in the region ``where``, or everywhere if that is None."""

    where: sympy.Expr | None

    @property
    def place(self) -> sympy.Expr | None:
        """The region of the contact."""
        return None if self.where is None else sympy.sympify(self.where)

    @property
    def _bounds(self) -> tuple[sympy.Expr, ...]:
        return () if self.place is None else (self.place,)

    def check(self, coordinates: Sequence[Coordinate]) -> None:
        for slip in self.slips:
            check_slip(self.name, slip, coordinates)
        for bound in self._bounds:
            check_place(f"contact '{self.name}': where", bound, coordinates)

    def _check_region(self, units: Dimensions) -> None:
        for bound in self._bounds:
            units.expect(f"the region of contact '{self.name}'", bound, None)


@dataclass(frozen=True, eq=False, kw_only=True)
class Friction(_Rubbing):
    """A contact with a friction law.

    Attributes:
        name: of the contact, for example "disc0".
        slip: slip speed, m/s or rad/s; affine in the velocities. Two of them at right angles, (v_x, v_y), make it a
            `Cone`: one contact that rubs against their vector.
        law: friction law.
        where: there is contact only where this function of coordinates, inputs and time is not negative; everywhere
            if left out.
        description: what rubs on what.
        force: the friction force lambda along positive slip, N, or its moment, N m, of an angular slip, in whatever
            state the contact is; for outputs.
    """

    kind: ClassVar[ContactKind] = FRICTION
    exchangeable: ClassVar[bool] = True

    name: str
    slip: Any
    law: Law
    where: sympy.Expr | None = None
    description: str = ""
    force: ContactSymbol = field(init=False)
    slip_speed: ContactSymbol = field(init=False)
    sign: ContactSymbol = field(init=False)

    def __new__(cls, **declared: Any) -> Any:
        slip = declared.get("slip")
        return Cone(**declared) if isinstance(slip, (tuple, list, sympy.Tuple)) else super().__new__(cls)

    def __post_init__(self) -> None:
        unit = way_unit(self.slip)
        create_symbols(self, force=FORCE_UNITS[unit], slip_speed=per_second(unit), sign="1")

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        capacities = self.law.capacity, self.law.capacity_minus
        return tuple(map(sympy.sympify, (self.slip, *self._bounds, *capacities, self.law_force, *self.rates)))

    @property
    def symbols(self) -> set[sympy.Basic]:
        return super().symbols - {self.slip_speed, self.sign}

    @property
    def law_force(self) -> sympy.Expr:
        """Its force in slip, from ``slip_speed`` and ``sign``."""
        return self.law.force(self.slip_speed, self.sign)

    @property
    def states(self) -> tuple[InternalState, ...]:
        return self.law.states

    @property
    def rates(self) -> tuple[sympy.Expr, ...]:
        return self.law.rates(self.slip_speed, self.sign)

    def check_units(self, units: Dimensions) -> None:
        slip = units.expect(f"the slip of contact '{self.name}'", self.slip, None)
        units.known[self.slip_speed] = slip
        label = f"the law of contact '{self.name}'"
        force = units.expect(label, self.law_force, None)
        if force is not None and slip is not None:
            units.match(f"slip times force of contact '{self.name}'", units.times(force, slip), "W")
        if slip is not None:
            for bound in dict.fromkeys((self.law.capacity, self.law.capacity_minus)):
                capacity = units.expect(f"what contact '{self.name}' holds in stick", bound, None)
                if capacity is not None:
                    units.match(f"slip times what contact '{self.name}' holds", units.times(capacity, slip), "W")
        units.known[self.force] = force
        self._check_rates(units)
        self._check_region(units)

    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        minus = self.law.capacity_minus
        return (
            self._direction(
                rates,
                self.slip,
                self.place,
                capacity=sympy.sympify(self.law.capacity),
                capacity_minus=None if minus == self.law.capacity else sympy.sympify(minus),
                force=self.law_force,
                sticks=self.law.sticks,
                reset=dict(self.law.renewed),
                reset_sides=4 if self.law.renewed else 0,
                force_symbol=self.force,
                slip_symbol=self.slip_speed,
                sign_symbol=self.sign,
            ),
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Cone(_Rubbing):
    """Friction with two directions, `Friction` with ``slip=(v_x, v_y)``: a cone, not two contacts at right angles.

    With v = (v_x, v_y) and f the force that the law has for a slip |v| the contact

        slips    lambda = -f(|v|) v/|v|
        sticks   lambda is whatever keeps v at zero, as long as |lambda| < capacity

    Slip begins at |lambda| = capacity, against lambda, and ends where |v| falls to zero and the capacity holds what
    drives it; where it does not the slip goes on from zero along the drive. A slip that passes close to zero goes on.
    All laws of one slip speed that stick will do, if they are the same in both directions and without internal states.

    Two rigid bodies that hit each other with friction in two directions are open: an `Impact` has one slip speed.

    Attributes:
        name, law, where, description: as of `Friction`.
        slip: the two slip speeds, m/s or rad/s, of directions at right angles; each affine in the velocities.
        force_x, force_y: the friction forces lambda along them, N or N m; for outputs.
        slip_speed: |v|.

    Raises:
        StickslipError: a law with internal states, of unlike directions or that never sticks; not two slip speeds.
    """

    kind: ClassVar[ContactKind] = CONE
    exchangeable: ClassVar[bool] = True

    name: str
    slip: tuple[sympy.Expr, sympy.Expr]
    law: Law
    where: sympy.Expr | None = None
    description: str = ""
    force: ContactSymbol = field(init=False)
    slip_speed: ContactSymbol = field(init=False)
    sign: ContactSymbol = field(init=False)
    force_x: ContactSymbol = field(init=False)
    force_y: ContactSymbol = field(init=False)

    def __post_init__(self) -> None:
        check_turning(self.name, self.slip, self.law)
        object.__setattr__(self, "slip", tuple(map(sympy.sympify, self.slip)))
        unit = way_unit(self.slip[0])
        force = FORCE_UNITS[unit]
        create_symbols(self, force=force, force_x=force, force_y=force, slip_speed=per_second(unit), sign="1")

    @property
    def shown(self) -> tuple[ContactSymbol, ...]:
        return self.force_x, self.force_y

    @property
    def law_force(self) -> sympy.Expr:
        """The magnitude of its force in slip, from ``slip_speed``."""
        return -self.law.force(self.slip_speed, sympy.S.One)

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        return (*self.slip, *self._bounds, sympy.sympify(self.law.capacity), sympy.sympify(self.law_force))

    @property
    def symbols(self) -> set[sympy.Basic]:
        return super().symbols - {self.slip_speed}

    @property
    def directions(self) -> int:
        """Its sides are two more."""
        return 3

    @property
    def names(self) -> Iterator[tuple[str, str]]:
        yield self.name, f"contact '{self.name}'"
        yield f"{self.name}_state", f"the state of contact {self.name}"
        for side in "xy":
            yield f"{self.name}_{side}_state", f"the state of contact {self.name} along {side}"
            yield f"{self.name}_{side}_force", f"the force of contact {self.name} along {side}"

    def check(self, coordinates: Sequence[Coordinate]) -> None:
        super().check(coordinates)
        speeds = [q.v for q in coordinates]
        if sympy.Matrix([[sympy.diff(slip, v) for v in speeds] for slip in self.slip]).rank() < 2:
            raise StickslipError(
                f"contact '{self.name}': its two slip speeds, {self.slip[0]} and {self.slip[1]}, go with each other. "
                "Give those of two directions at right angles, or one slip speed alone."
            )

    def check_units(self, units: Dimensions) -> None:
        one, other = (units.expect(f"the slip of contact '{self.name}'", slip, None) for slip in self.slip)
        if one is not None:
            units.compare(f"the second slip of contact '{self.name}'", other, one)
        units.known[self.slip_speed] = one
        force = units.expect(f"the law of contact '{self.name}'", self.law_force, None)
        if force is not None and one is not None:
            units.match(f"slip times force of contact '{self.name}'", units.times(force, one), "W")
        for symbol in (self.force, *self.shown):
            units.known[symbol] = force
        self._check_region(units)

    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        x, y = self.slip
        speed: Any = sympy.sqrt(x**2 + y**2)
        whole = self._direction(
            rates,
            sympy.S.Zero,
            self.place,
            capacity=sympy.sympify(self.law.capacity),
            force=self.law_force,
            sticks=True,
            force_symbol=self.force,
            slip_symbol=self.slip_speed,
            sign_symbol=self.sign,
        )
        sides = (
            self._direction(
                rates,
                slip,
                name=f"{self.name}_{side}",
                description=f"{self.description or self.name}, along {side}",
                kind=CONE_SIDE,
                sticks=False,
                force_symbol=force,
                **{
                    f"{what}_symbol": ContactSymbol._create(f"{self.name}_{side}_{what}", of, f"{what} of {self.name}")
                    for what, of in (("slip", self.slip_speed.unit), ("sign", "1"))
                },
            )
            for side, slip, force in zip("xy", self.slip, self.shown, strict=True)
        )
        return dataclasses.replace(whole, slip=speed, slip_terms=(*terms(x), *terms(y))), *sides


# of what does work along a way, by the unit of the way
FORCE_UNITS = {"m": "N", "rad": "N m", "1": "1"}


def create_symbols(contact: Any, **units: str) -> None:
    """Give a frozen contact the quantities that the engine computes for it, by name and unit."""
    for name, unit in units.items():
        symbol = ContactSymbol._create(f"{contact.name}_{name}", unit, f"{name} of contact {contact.name}")
        object.__setattr__(contact, name, symbol)
