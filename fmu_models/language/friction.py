"""Friction contacts, of one slip speed and of two.

During slip the law gives the force; during stick it is whatever keeps the slip speed at zero, up to the capacity.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contact_checks import check_place, check_slip, check_turning
from fmu_models.language.contact_dynamics import ContactDynamics, Rates, terms
from fmu_models.language.contact_kinds import CONE, CONE_SIDE, FRICTION, ContactKind
from fmu_models.language.contacts import FORCE_UNITS, Contact, Law, create_symbols
from fmu_models.language.dimensions import Dimensions, way_unit
from fmu_models.language.quantities import ContactSymbol, Coordinate, InternalState, per_second


@dataclass(frozen=True, eq=False, kw_only=True)
class _Rubbing(Contact):
    """Friction against slip speeds, in the region ``where``, or everywhere if that is None."""

    exchangeable: ClassVar[bool] = True

    name: str
    slip: Any
    law: Law
    where: sympy.Expr | None = None
    description: str = ""
    force: ContactSymbol = field(init=False)
    slip_speed: ContactSymbol = field(init=False)
    sign: ContactSymbol = field(init=False)

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
        units.match(f"slip times force of contact '{self.name}'", units.product(force, slip), "W")
        for bound in dict.fromkeys((self.law.capacity, self.law.capacity_minus)) if slip is not None else ():
            capacity = units.expect(f"what contact '{self.name}' holds in stick", bound, None)
            units.match(f"slip times what contact '{self.name}' holds", units.product(capacity, slip), "W")
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

    slip: tuple[sympy.Expr, sympy.Expr]
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
        along, across = (units.expect(f"the slip of contact '{self.name}'", slip, None) for slip in self.slip)
        units.compare(f"the second slip of contact '{self.name}'", across, along)
        units.known[self.slip_speed] = along
        force = units.expect(f"the law of contact '{self.name}'", self.law_force, None)
        units.match(f"slip times force of contact '{self.name}'", units.product(force, along), "W")
        for symbol in (self.force, *self.shown):
            units.known[symbol] = force
        self._check_region(units)

    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        x, y = self.slip
        speed: Any = sympy.sqrt(x**2 + y**2)
        direction = self._direction(
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
        return dataclasses.replace(direction, slip=speed, slip_terms=(*terms(x), *terms(y))), *sides
