"""A stop in two stages: beyond a second gap a second spring helps the first.

    F = F1(d1) + F2(d2),    d1 = -gap, d2 = -second_gap,    each where its own depth is positive

Each stage is a stop of its own that begins and lets go by the same rule; the force of the whole is their sum.

Source: Shaw and Holmes, Journal of Sound and Vibration 90 (1983), for oscillators whose stiffness rises by stages.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contact_dynamics import ContactDynamics, Rates
from fmu_models.language.contact_kinds import STOP, ContactKind
from fmu_models.language.contacts import Contact, Requirement, create_symbols
from fmu_models.language.dimensions import Dimensions, way_unit
from fmu_models.language.quantities import ContactSymbol, Coordinate
from fmu_models.language.stops import Stop, StopLaw


@dataclass(frozen=True, eq=False, kw_only=True)
class TwoStageStop(Contact):
    """Two stops, ``<name>_first`` and ``<name>_second``, that act as one; see the module.

    Attributes:
        name: of the whole, for example "buffer".
        gap, second_gap: distances to the stages, in the same unit; functions of coordinates, inputs and time.
        law, second_law: laws of their forces.
        release: "gap" or "force", as of a `Stop`.
        description: what stops what.
        force: the sum of both forces, positive in compression; for outputs.
        first, second: the stages; outputs may use what they show.

    Raises:
        StickslipError: gaps of two units, or what a `Stop` refuses.
    """

    kind: ClassVar[ContactKind] = STOP
    exchangeable: ClassVar[bool] = True  # that of the first stage

    name: str
    gap: sympy.Expr
    law: StopLaw
    second_gap: sympy.Expr
    second_law: StopLaw
    release: str = ""
    description: str = ""
    force: ContactSymbol = field(init=False)
    first: Stop = field(init=False)
    second: Stop = field(init=False)

    def __post_init__(self) -> None:
        units = way_unit(self.gap), way_unit(self.second_gap)
        if units[0] != units[1]:
            raise StickslipError(
                f"stop '{self.name}': its gap is in {units[0]}, its second gap in {units[1]}. Both stages stop the "
                "same motion: write both gaps in one unit."
            )
        stages = {"first": (self.gap, self.law), "second": (self.second_gap, self.second_law)}
        for stage, (gap, law) in stages.items():
            described = f"{self.description or self.name}, {stage} stage"
            stop = Stop(name=f"{self.name}_{stage}", gap=gap, law=law, release=self.release, description=described)
            object.__setattr__(self, stage, stop)
        create_symbols(self, force=self.first.force.unit)

    @property
    def shown(self) -> tuple[ContactSymbol, ...]:
        return (self.force, *self.first.shown, *self.second.shown)

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        return (*self.first.requirements, *self.second.requirements)

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        return (*self.first.expressions, *self.second.expressions)

    @property
    def symbols(self) -> set[sympy.Basic]:
        return self.first.symbols | self.second.symbols

    @property
    def directions(self) -> int:
        return 2

    @property
    def names(self) -> Iterator[tuple[str, str]]:
        yield self.name, f"contact '{self.name}'"
        yield from (*self.first.names, *self.second.names)

    @property
    def written(self) -> Mapping[sympy.Basic, sympy.Expr]:
        """The forces from the reactions of its stages."""
        total = -self.first.reaction - self.second.reaction
        return {self.force: total, **self.first.written, **self.second.written}

    @property
    def law_force(self) -> sympy.Expr:
        """Its force while both stages touch."""
        return self.first.compression + self.second.compression

    @property
    def rule(self) -> tuple[StopLaw, StopLaw]:
        return self.law, self.second_law

    def check(self, coordinates: Sequence[Coordinate]) -> None:
        self.first.check(coordinates)
        self.second.check(coordinates)

    def check_units(self, units: Dimensions) -> None:
        self.first.check_units(units)
        self.second.check_units(units)
        units.known[self.force] = units.known[self.first.force]

    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        return (*self.first.dynamics(rates, index), *self.second.dynamics(rates, index + 1))
