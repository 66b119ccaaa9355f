"""A force with memory along a way, between bodies or to the ground.

    lambda = -load (F(x, x', z) + damping x'),    z' = g(x', z) + what holds z at its bounds

x way, lambda force along it, which acts on the body with (dx/dq)^T lambda. It is lowered to

    z                  driven states
    a sign             a switch that is crossed: F and g know its side
    a bound, on either side    y = D - z or D + z, y' = -+ z': a switch that slides. Beyond it the flow leads back at
                       unit rate, lambda_y = 1 + outflow, inside lambda_y = 0; sliding along y = 0 is to yield

    many sliders       an array: the sign of their way, and one switch, what is left to the next that yields

so that a way that turns ends the yielding, and nothing else of the engine knows of it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import sympy

from fmu_models.language.contact_checks import check_place
from fmu_models.language.contact_dynamics import ContactDynamics, Element, Rates
from fmu_models.language.contact_kinds import SWITCH, YIELD, ContactKind
from fmu_models.language.contacts import FORCE_UNITS, Contact, Law, Requirement, create_symbols
from fmu_models.language.dimensions import Dimensions, way_unit
from fmu_models.language.hysteresis.law import Expr, HysteresisLaw, OfSlip
from fmu_models.language.quantities import TIME, ContactSymbol, Coordinate, Input, InternalState, per_second

# sliders that have switches of their own: so few have tables for lanes
_FEW = 2


class _Row(NamedTuple):
    """A sign (outflow None), a bound or an array of ``elements``; ``symbols``: its force, value and sign; ``carries``:
    what its force moves."""

    name: str
    function: Expr
    outflow: Expr | None
    symbols: tuple[ContactSymbol, ContactSymbol, ContactSymbol]
    carries: Mapping[InternalState, Expr] = {}
    elements: tuple[Element, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Hysteresis(Contact):
    """A force with memory; see the module.

    Attributes:
        name: of the contact, for example "joint".
        way: x, m or rad; a function of coordinates, inputs and time.
        law: its law: MaxwellSlip, Iwan4, Play, Dahl, BoucWen, BoucWenBaberNoori, or a friction law with bristles.
        load: factor of the force, such as an input that is the normal force over its usual value.
        damping: viscous damping beside the law, N s/m.
        description: what rubs on what.
        force: the whole force, positive with the way; for outputs.
    """

    kind: ClassVar[ContactKind] = YIELD
    exchangeable: ClassVar[bool] = True

    name: str
    way: Expr
    law: HysteresisLaw | Law
    load: Expr = sympy.S.One
    damping: Expr = sympy.S.Zero
    description: str = ""
    force: ContactSymbol = field(init=False)
    pile: ContactSymbol = field(init=False, repr=False)
    held: tuple[InternalState, ...] = field(init=False)
    rows: tuple[_Row, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        unit = way_unit(self.way)
        create_symbols(self, force=FORCE_UNITS[unit], pile=FORCE_UNITS[unit])
        object.__setattr__(self, "held", self.memory.states(self.name, unit))
        object.__setattr__(self, "rows", tuple(self._signs_and_bounds(unit)))

    def _signs_and_bounds(self, unit: str) -> Iterator[_Row]:
        elements = self.memory.elements if len(self.states) > _FEW else ()
        switches = {"speed": self.speed} if elements else self.memory.switches(self.speed, self.states)
        units = {"speed": per_second(unit)}
        signs = {name: self._symbols(f"{name}_side", units.get(name, unit)) for name in switches}
        for name, function in switches.items():
            yield _Row(f"{self.name}_{name}_side", function, None, signs[name])
        sides = {name: s[2] for name, s in signs.items()}
        if elements:
            symbols = self._symbols("next", unit)
            array = (Element(z, *element) for z, element in zip(self.states, elements, strict=True))
            yield _Row(f"{self.name}_next", symbols[1], None, symbols, elements=tuple(array))
            return
        flows = self.memory.rates(self.speed, self.states, sides)
        for i, bound in self.memory.bounds().items():
            number = str(i + 1) if len(self.memory.bounds()) > 1 else ""
            for side, outward in (("upper", 1), ("lower", -1)):
                name = f"{side}{number}"
                room = bound - outward * self.states[i]
                along = self.memory.carried(self.states, sides, i, outward)
                carries = {self.states[j]: rate for j, rate in along.items()}
                yield _Row(f"{self.name}_{name}", room, outward * flows[i], self._symbols(name, unit), carries)

    def _symbols(self, row: str, unit: str) -> tuple[ContactSymbol, ContactSymbol, ContactSymbol]:
        names = {"force": per_second(unit), "value": unit, "sign": "1"}
        force, value, sign = (
            ContactSymbol._create(f"{self.name}_{row}_{quantity}", of, f"{quantity} of {row} of {self.name}")
            for quantity, of in names.items()
        )
        return force, value, sign

    @property
    def memory(self) -> HysteresisLaw:
        """The law; one of friction along the way."""
        return self.law.lowered if isinstance(self.law, HysteresisLaw) else OfSlip(self.law)

    @property
    def array(self) -> tuple[Element, ...]:
        return self.rows[-1].elements if self.rows else ()

    @property
    def driven(self) -> bool:
        return not self.array

    @cached_property
    def speed(self) -> Expr:
        """x', from velocities and rates of inputs."""
        way: Any = sympy.sympify(self.way)
        rates = {s: s.v for s in way.free_symbols if isinstance(s, Coordinate)}
        rates |= {s: s.rate for s in way.free_symbols if isinstance(s, Input)}
        return sympy.Add(way.diff(TIME), *(way.diff(s) * rate for s, rate in rates.items()))

    @property
    def states(self) -> tuple[InternalState, ...]:
        """The states z of the law; outputs may use them, and start values load them beforehand."""
        return self.held

    @property
    def signs(self) -> dict[str, ContactSymbol]:
        """Signs that the law reads, by its names of them."""
        rows = zip(self.memory.switches(self.speed, self.states), self.rows, strict=False)
        return {name: row.symbols[2] for name, row in rows}

    @property
    def _law(self) -> Expr:
        return self.memory.force(self.way, self.speed, self.states, self.signs)

    @property
    def resistance(self) -> Expr:
        """What resists the way."""
        law = self.pile if self.array else self._law
        return self.load * (law + self.damping * self.speed)

    @property
    def rates(self) -> tuple[Expr, ...]:
        return self.memory.rates(self.speed, self.states, self.signs)

    @property
    def steady(self) -> tuple[Expr, Expr]:
        return -self.resistance, self.speed

    @property
    def written(self) -> Mapping[sympy.Basic, sympy.Expr]:
        """The force by the law."""
        return {self.force: self.resistance}

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """Those of the law, and bounds that leave room."""
        return (*self.law.requirements, *self._room)

    @cached_property
    def _room(self) -> tuple[Requirement, ...]:
        return tuple(
            Requirement(sympy.sympify(bound), f"{bound} must be positive: contact '{self.name}' yields there", True)
            for bound in self.memory.bounds().values()
            if sympy.sympify(bound).free_symbols
        )

    @property
    def expressions(self) -> tuple[sympy.Expr, ...]:
        rows = (row.function for row in self.rows)
        carried = (rate for row in self.rows for rate in row.carries.values())
        law = (self._law, *self.memory.bounds().values()) if self.array else ()
        return tuple(map(sympy.sympify, (self.way, self.resistance, *law, *self.rates, *rows, *carried)))

    @property
    def symbols(self) -> set[sympy.Basic]:
        """Quantities that it uses, rates of inputs left out, which enter by themselves."""
        rates = {s.rate for s in sympy.sympify(self.way).free_symbols if isinstance(s, Input)}
        return super().symbols - {*self.signs.values(), self.pile, *(row.symbols[1] for row in self.rows)} - rates

    @property
    def directions(self) -> int:
        """One for each sign, two for each bound."""
        return len(self.rows)

    @property
    def names(self) -> Iterator[tuple[str, str]]:
        yield self.name, f"contact '{self.name}'"
        yield f"{self.name}_force", f"the force of contact {self.name}, which every model shows"
        for row in self.rows:
            yield row.name, f"a part of contact '{self.name}'"
            yield f"{row.name}_state", f"the state of {row.name}"

    def check(self, coordinates: Sequence[Coordinate]) -> None:
        if not any(isinstance(s, Input) for s in sympy.sympify(self.way).free_symbols):
            check_place(f"contact '{self.name}': way", self.way, coordinates)

    def check_units(self, units: Dimensions) -> None:
        way = units.expect(f"the way of contact '{self.name}'", self.way, None)
        speed = units.expect(f"the way of contact '{self.name}'", self.speed, None)
        units.known[self.pile] = units.expect(f"the law of contact '{self.name}'", self._law, None)
        force = units.expect(f"the law of contact '{self.name}'", self.resistance, None)
        units.match(f"the force of contact '{self.name}' times its speed", units.product(force, speed), "W")
        units.known[self.force] = force
        self._check_rates(units)
        for element in self.array:
            bound = units.expect(f"'{self.name}_next'", element.bound, None)
            units.compare(f"a bound of contact '{self.name}'", bound, way)
        for row in self.rows:
            if row.elements:
                continue
            dimension = units.expect(f"'{row.name}'", row.function, None)
            if row.outflow is not None:
                units.compare(f"a bound of contact '{self.name}'", dimension, way)
            for state, rate in row.carries.items():
                units.expect(f"the rate of {state.name}", rate * self.speed, per_second(state.unit))

    def dynamics(self, rates: Rates, index: int) -> tuple[ContactDynamics, ...]:
        return tuple(self._lowered(rates, row) for row in self.rows)

    def _lowered(self, rates: Rates, row: _Row) -> ContactDynamics:
        force, value, sign = row.symbols
        about: dict[str, Any] = {"force_symbol": force, "slip_symbol": value, "sign_symbol": sign, "name": row.name}
        about["description"] = f"{self.description or self.name}: {row.name}"
        if row.elements:
            about |= {"elements": row.elements, "pile_symbol": self.pile, "sticks": False, "kind": YIELD}
            side = self.rows[0].symbols[2]
            return ContactDynamics(
                slip=value,
                slip_rate=sympy.S.Zero,
                slip_terms=(value,),
                reset={element.state: side * element.bound for element in row.elements},
                reset_sides=1,
                **about,
            )
        if row.outflow is None:
            if row.name in (f"{self.name}_{name}_side" for name in self.memory.rooted):
                # zero exactly where it passes zero: its series in the root of time begins there
                about |= {"rooted": True, "reset": {row.function: sympy.S.Zero}, "reset_sides": 3}
            return self._direction(rates, row.function, kind=SWITCH, sticks=False, **about)
        back = 1 + row.outflow
        about |= {"capacity": back, "capacity_minus": sympy.S.Zero, "force": (1 - sign) / 2 * back}
        about["carries"] = row.carries
        return self._direction(rates, row.function, kind=YIELD, sticks=True, **about)
