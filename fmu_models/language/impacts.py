"""Rigid one-sided contacts, with restitution and friction.

A contact with gap g(q, t) >= 0 is open (g > 0) or closed (g = 0). Closed it carries a force lambda_N >= 0 that keeps
g' = 0; where g falls to zero with g' = u- < 0 an impulse Lambda_N >= 0 changes the velocities at once, for contacts
that take part in an impact with an impulse, the closed ones among them:

    Newton(e)     u+ = -e u-
    Poisson(e)    Lambda_N = (1 + e) Lambda_C,    Lambda_C the impulse that ends the compression

A contact with a slip speed y rubs by Coulomb's law, |lambda_T| <= mu lambda_N, in an impact |Lambda_T| <= mu Lambda_N.
Newton's restitution with friction can raise the energy in some impacts, Poisson's of one coefficient cannot.

With much friction the laws may have several solutions, or none (Painleve). Of several impacts the one is taken that
loses most energy, of equal ones the one that holds most contacts (up to six contacts with friction at once; of more the
one found from all held). A closed contact that could open or stay closed stays closed. None is an error.

Sources: Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988), for friction with Newton's
restitution; Pfeiffer and Glocker, Multibody dynamics with unilateral contacts (1996), chapter 8, for Poisson's.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NoReturn

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contact_checks import check_place, check_slip
from fmu_models.language.contact_dynamics import ContactDynamics, Rates
from fmu_models.language.contact_kinds import IMPACT, IMPACT_FRICTION, ContactKind
from fmu_models.language.contacts import FORCE_UNITS, Contact, Requirement, create_symbols
from fmu_models.language.dimensions import Dimensions, way_unit
from fmu_models.language.quantities import ContactSymbol, Coordinate, Parameter, per_second

# the effort of an impact and the tables of the run grow with the square of their number
MAX_IMPACTS = 32


@dataclass(frozen=True)
class Newton:
    """Gap speed after the impact = -``e`` times that before, where an impulse acts; ``e`` from parameters."""

    e: sympy.Expr | float


@dataclass(frozen=True)
class Poisson:
    """Impulse of expansion = ``e`` times the impulse of compression; ``e`` from parameters."""

    e: sympy.Expr | float


@dataclass(frozen=True, eq=False, kw_only=True)
class Impact(Contact):
    """A rigid contact; see the module.

    Attributes:
        name: of the contact, for example "table".
        gap: distance, m or rad; a function of coordinates, inputs, parameters and time.
        restitution: Newton(e) or Poisson(e), 0 <= e <= 1.
        slip: slip speed, in the unit of the gap per second, affine in the velocities; without it the contact is smooth.
        mu: coefficient of friction, from parameters; given with ``slip`` and only then.
        description: what hits what.
        force: the normal force lambda_N, N, or its moment, N m, positive in compression; for outputs.
        friction_force: the friction along positive slip, likewise; for outputs, of a contact with ``slip``.

    Raises:
        StickslipError: a restitution of another kind, ``slip`` without ``mu`` or the other way round, or one of the
            coefficients is out of its range or depends on more than parameters.
    """

    kind: ClassVar[ContactKind] = IMPACT

    name: str
    gap: sympy.Expr
    restitution: Newton | Poisson
    slip: sympy.Expr | None = None
    mu: sympy.Expr | float | None = None
    description: str = ""
    force: ContactSymbol = field(init=False)
    rate: ContactSymbol = field(init=False)
    sign: ContactSymbol = field(init=False)
    friction_force: ContactSymbol = field(init=False)
    friction_slip: ContactSymbol = field(init=False)
    friction_sign: ContactSymbol = field(init=False)

    def __post_init__(self) -> None:
        unit = way_unit(self.gap)
        force, speed = FORCE_UNITS[unit], per_second(unit)
        create_symbols(
            self, force=force, rate=speed, sign="1", friction_force=force, friction_slip=speed, friction_sign="1"
        )
        if not isinstance(self.restitution, (Newton, Poisson)):
            raise StickslipError(
                f"contact '{self.name}' has restitution={self.restitution}. Say by which rule: Newton(e) for speeds, "
                "Poisson(e) for impulses."
            )
        if (self.slip is None) != (self.mu is None):
            present, missing = ("mu", "slip") if self.slip is None else ("slip", "mu")
            raise StickslipError(
                f"contact '{self.name}' has {present} but no {missing}. Give both for a contact with friction, neither "
                "for a smooth one."
            )
        self._check_coefficients()

    def _check_coefficients(self) -> None:
        coefficients = {"restitution": self.e} | ({} if self.mu is None else {"mu": self.friction})
        for (name, value), requirement in zip(coefficients.items(), self.requirements, strict=True):
            for symbol in sorted(value.free_symbols, key=str):
                if not isinstance(symbol, Parameter):
                    raise StickslipError(
                        f"contact '{self.name}': {name} = {value} depends on {symbol}; it may use parameters only."
                    )
            if not value.free_symbols and not requirement.expression.is_nonnegative:
                raise StickslipError(f"{requirement.sentence}, found {float(value):g}.")

    @property
    def e(self) -> sympy.Expr:
        """Coefficient of restitution."""
        return sympy.sympify(self.restitution.e)

    @property
    def friction(self) -> sympy.Expr:
        """Coefficient of friction; 0 of a smooth contact."""
        return sympy.S.Zero if self.mu is None else sympy.sympify(self.mu)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """A restitution that gives no more back than was put in, and a mu that brakes."""
        sentence = f"restitution of contact '{self.name}' must lie between 0 and 1"
        requirements = [Requirement(self.e * (1 - self.e), sentence)]
        if self.mu is not None:
            requirements.append(Requirement(self.friction, f"mu of contact '{self.name}' must not be negative"))
        return tuple(requirements)

    @property
    def depth(self) -> sympy.Expr:
        """How far the body would be inside, m; never positive in a motion."""
        return -sympy.sympify(self.gap)

    @property
    def shown(self) -> tuple[ContactSymbol, ...]:
        return (self.force,) if self.slip is None else (self.force, self.friction_force)

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        slip = () if self.slip is None else (sympy.sympify(self.slip),)
        return (sympy.sympify(self.gap), *slip, self.e, self.friction)

    @property
    def directions(self) -> int:
        """Its friction is one more."""
        return 1 if self.slip is None else 2

    @property
    def names(self) -> Iterator[tuple[str, str]]:
        yield from super().names
        if self.slip is not None:
            yield f"{self.name}_friction", f"the friction of contact {self.name}"
            yield f"{self.name}_friction_state", f"the state of the friction of contact {self.name}"
            yield f"{self.name}_friction_force", f"the friction force of contact {self.name}"

    @property
    def rule(self) -> Newton | Poisson:
        return self.restitution

    def exchangeable_law(self, model: str) -> NoReturn:
        """Refuse: it has no law."""
        raise StickslipError(
            f"contact '{self.name}' of {model} is rigid: it has no law that could be another, but a restitution "
            f"({type(self.restitution).__name__}) and perhaps a mu. Set their parameters."
        )

    def check(self, coordinates: Sequence[Coordinate]) -> None:
        check_place(f"contact '{self.name}': gap", self.gap, coordinates)
        if self.slip is not None:
            check_slip(self.name, self.slip, coordinates)

    def check_units(self, units: Dimensions) -> None:
        unit = "1" if units.scaled else "rad" if way_unit(self.gap) == "rad" else "m"
        units.expect(f"the gap of contact '{self.name}'", self.gap, unit)
        if self.slip is not None:
            units.expect(f"the slip of contact '{self.name}'", self.slip, per_second(unit))
        units.expect(f"the restitution of contact '{self.name}'", self.e, "1")
        units.expect(f"mu of contact '{self.name}'", self.friction, "1")
        for force in self.shown:
            units.known[force] = units.of_unit(FORCE_UNITS[unit])

    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        if self.slip is None:
            return (self._normal(rates, partner=None),)
        slip = sympy.sympify(self.slip)
        return self._normal(rates, partner=index + 1), self._friction(slip, rates, partner=index)

    def _normal(self, rates: Rates, partner: int | None) -> ContactDynamics:
        """The normal direction; lambda acts along the growing gap."""
        return self._direction(
            rates,
            rates.of_place(sympy.sympify(self.gap)),
            self.depth,
            sticks=False,
            partner=partner,
            restitution=self.e,
            poisson=isinstance(self.restitution, Poisson),
            force_symbol=self.force,
            slip_symbol=self.rate,
            sign_symbol=self.sign,
        )

    def _friction(self, slip: sympy.Expr, rates: Rates, partner: int) -> ContactDynamics:
        return self._direction(
            rates,
            slip,
            name=f"{self.name}_friction",
            kind=IMPACT_FRICTION,
            sticks=True,
            partner=partner,
            friction=self.friction,
            force_symbol=self.friction_force,
            slip_symbol=self.friction_slip,
            sign_symbol=self.friction_sign,
        )
