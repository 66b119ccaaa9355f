"""One-sided stops that give way.

A stop with gap g(q, t) has the depth d = -g and touches from where d rises above zero. While it touches, its law gives
the compressive force F from depth, rate of depth d' and, if it remembers, the rate v0 at which it was entered; the
stop acts on the body with -(d d'/dv)^T F. It lets go

    release="gap"    where the depth falls to zero, even if it had to pull,
    release="force"  where its force falls to zero: never adhesive. Until the body has left, it touches again where its
                     law would push again.

The second rule is that of a support without mass that relaxes at once when it is free.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contact_checks import check_place
from fmu_models.language.contact_dynamics import ContactDynamics, Rates
from fmu_models.language.contact_kinds import STOP, ContactKind
from fmu_models.language.contacts import FORCE_UNITS, Contact, Requirement, create_symbols
from fmu_models.language.dimensions import Dimensions, way_unit
from fmu_models.language.quantities import ContactSymbol, Coordinate, per_second

_RELEASES = ("gap", "force")


class StopLaw(ABC):
    """A law of a stop; one file each in ``laws``. Its force is analytic inside, but for a root of the depth."""

    remembers: ClassVar[bool]
    """Whether it reads the speed of entry."""

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the parameters of the law must satisfy."""
        return ()

    @abstractmethod
    def force(self, depth: sympy.Expr, rate: sympy.Expr, memory: sympy.Expr) -> sympy.Expr:
        """Compressive force F, N, at depth (m), its rate and the rate at entry (m/s)."""

    def release(self, depth: sympy.Expr, rate: sympy.Expr, memory: sympy.Expr) -> sympy.Expr:
        """An analytic quantity that has the sign of F, itself if it is one."""
        return self.force(depth, rate, memory)


@dataclass(frozen=True, eq=False, kw_only=True)
class Stop(Contact):
    """A stop; see the module.

    Attributes:
        name: of the contact, for example "support".
        gap: distance to the stop, m or rad; a function of coordinates, inputs and time.
        law: law of the force.
        release: "gap" or "force"; to be chosen for every stop.
        description: what stops what.
        force: the force F, N, or its moment, N m, positive in compression, in whatever state the stop is; for
            outputs, as are
        penetration, rate: depth, in the unit of the gap, and its rate.

    Raises:
        StickslipError: ``release`` is missing or another, or the law has a power of the depth without series.
    """

    kind: ClassVar[ContactKind] = STOP
    exchangeable: ClassVar[bool] = True

    name: str
    gap: sympy.Expr
    law: StopLaw
    release: str = ""
    description: str = ""
    force: ContactSymbol = field(init=False)
    penetration: ContactSymbol = field(init=False)
    rate: ContactSymbol = field(init=False)
    memory: ContactSymbol = field(init=False)
    reaction: ContactSymbol = field(init=False)
    sign: ContactSymbol = field(init=False)

    def __post_init__(self) -> None:
        unit = way_unit(self.gap)
        force, speed = FORCE_UNITS[unit], per_second(unit)
        create_symbols(self, force=force, penetration=unit, rate=speed, memory=speed, reaction=force, sign="1")
        if self.release not in _RELEASES:
            release = f"release={self.release!r}" if self.release else "no release rule"
            raise StickslipError(
                f"stop '{self.name}' has {release}. Say when it lets go: release='force' where its force falls to zero "
                "(a support that cannot pull), release='gap' where the body leaves it."
            )
        _ = self.rooted

    @property
    def depth(self) -> sympy.Expr:
        """How far the body is inside, m."""
        return -sympy.sympify(self.gap)

    @property
    def compression(self) -> sympy.Expr:
        """F from ``penetration``, ``rate`` and ``memory``."""
        return sympy.sympify(self.law.force(self.penetration, self.rate, self.memory))

    @property
    def rooted(self) -> bool:
        """Whether the force has half-integer powers of the depth."""
        rooted = False
        for power in self.compression.atoms(sympy.Pow):
            if power.base.has(self.penetration):
                exponent: Any = sympy.nsimplify(power.exp) if power.exp.is_Number else power.exp
                if power.base == self.penetration and not (exponent.is_Rational and exponent > 0 and exponent.q <= 2):
                    raise StickslipError(
                        f"stop '{self.name}': its force has the depth to the power {power.exp}. The power must be a "
                        "positive number, whole or half of a whole one (1, 3/2, 2, ...); Hertz has 3/2."
                    )
                rooted = rooted or (power.base == self.penetration and exponent.q == 2)
        return rooted

    @property
    def shown(self) -> tuple[ContactSymbol, ...]:
        return (self.force, self.penetration, self.rate)

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        return (sympy.sympify(self.gap), self.compression)

    @property
    def symbols(self) -> set[sympy.Basic]:
        return super().symbols - {self.penetration, self.rate, self.memory}

    @property
    def names(self) -> Iterator[tuple[str, str]]:
        yield from super().names
        yield f"{self.name}_memory", f"the speed at which stop {self.name} was entered"

    @property
    def written(self) -> Mapping[sympy.Basic, sympy.Expr]:
        """The compressive force as what it is, the opposite of lambda."""
        return {self.force: -self.reaction}

    @property
    def law_force(self) -> sympy.Expr:
        """Its force while it touches."""
        return self.compression

    def check(self, coordinates: Sequence[Coordinate]) -> None:
        check_place(f"stop '{self.name}': gap", self.gap, coordinates)

    def check_units(self, units: Dimensions) -> None:
        depth = units.expect(f"the gap of stop '{self.name}'", self.gap, None)
        rate = units.product(depth, units.of_unit("1/s"))
        units.known |= {self.penetration: depth, self.rate: rate, self.memory: rate}
        force = units.expect(f"the law of stop '{self.name}'", self.compression, None)
        units.match(f"gap times force of stop '{self.name}'", units.product(force, depth), "J")
        units.known[self.force] = force

    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        release = self.law.release(self.penetration, self.rate, self.memory)
        return (
            self._direction(
                rates,
                rates.of_place(self.depth),
                self.depth,
                force=-self.compression,
                sticks=False,
                release=sympy.sympify(release) if self.release == "force" else None,
                remembers=self.law.remembers,
                rooted=self.rooted,
                force_symbol=self.reaction,
                slip_symbol=self.rate,
                sign_symbol=self.sign,
                depth_symbol=self.penetration,
                memory_symbol=self.memory,
            ),
        )
