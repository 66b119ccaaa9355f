"""The XML files of an FMU: modelDescription.xml (FMI 2.0 and 3.0) and buildDescription.xml (FMI 3.0).

The order of ``variables`` is that of the value references, from 1, which engine/fmi/variables.c counts through: time,
parameters, inputs, rates of the inputs, states, memories of stops, derivatives, outputs, states of the contacts,
indicators.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from fmu_models.base.unit_names import base_units, conversion_factor
from fmu_models.codegen import contact_states
from fmu_models.codegen.c_structures import declarations
from fmu_models.codegen.rights import Rights
from fmu_models.language.inertia import blocks
from fmu_models.language.quantities import TIME, Acceleration, Input, Rate, State, per_second
from fmu_models.lowering.hybrid_system import acting

if TYPE_CHECKING:
    import sympy

    from fmu_models.lowering.hybrid_system import ContactDynamics, HybridSystem

FMI_VERSIONS = ("2.0", "3.0")
BASE_UNITS = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}
# what people read angles in; the speed that an input asks of a drive is one of turns
DISPLAY_UNITS = {"rad": "deg", "rad/s": "deg/s", "rad/s2": "deg/s2"}
DRIVE_DISPLAY_UNITS = {"rad/s": "rpm"}
# as in engine/fmi/instance.c
LOG_CATEGORIES = {
    "logStatusError": "why a call was refused",
    "logStatusWarning": "what was asked for and is not done as it was asked",
    "logEvents": "every change of the state of a contact, and every impact",
}

# operations up to which it is asked how an expression depends on what is in it
_LARGEST_EXPRESSION = 100

_INDICATOR_NAMES = {
    "depth": "bound",
    "slip": "indicator",
    "release": "release",
    "function": "indicator",
    "gap": "indicator",
}


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One variable of an FMU; ``None`` leaves the attribute out. ``derivative`` is the reference of the state."""

    reference: int
    name: str
    description: str
    causality: str
    variability: str
    declared_type: str | None = None
    initial: str | None = None
    start: float | None = None
    unit: str | None = None
    nominal: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    derivative: int | None = None
    intermediate: bool = False

    @property
    def integer(self) -> bool:
        """Whether it counts: the state of a contact, whose declared type names the kind of contact."""
        return self.declared_type is not None

    @property
    def display_unit(self) -> str | None:
        """The unit to show it in, where that is another; of a parameter none, as frequencies of motions stay."""
        if self.unit is None or self.causality == "parameter":
            return None
        drives = DRIVE_DISPLAY_UNITS if self.causality == "input" else {}
        return drives.get(self.unit) or DISPLAY_UNITS.get(self.unit)

    @property
    def attributes(self) -> dict[str, str | None]:
        """Attributes of the value, beside what every variable has."""
        numbers = {"min": self.minimum, "max": self.maximum, "nominal": self.nominal, "start": self.start}
        kind = int if self.integer else float
        words = {"declaredType": self.declared_type, "unit": self.unit, "displayUnit": self.display_unit}
        return words | {key: None if v is None else repr(kind(v)) for key, v in numbers.items()}


@dataclass(frozen=True)
class Unknown:
    """An entry of the model structure: a variable and the references it depends on, all of them if ``None``.

    ``kinds`` says of each how: by a constant factor, by one of parameters ("tunable"), or in another way ("dependent").
    """

    variable: Variable
    dependencies: tuple[int, ...] | None = None
    kinds: tuple[str, ...] | None = None

    @property
    def attributes(self) -> dict[str, str | None]:
        """Attributes of its element, beside the reference."""
        lists = {"dependencies": self.dependencies, "dependenciesKind": self.kinds}
        return {key: None if v is None else " ".join(map(str, v)) for key, v in lists.items()}


class Description:
    """What is written about one lowered system.

    Value references are places in ``variables``, counted from 1, as are the indices by which FMI 2.0 refers to
    variables, and importers that take the ones for the others are right with both.
    """

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        self.variables: list[Variable] = []
        self._reference: dict[sympy.Basic, int] = {TIME: 1}
        self._parameters: dict[sympy.Basic, int] = {}
        self._add("time", "time", causality="independent", variability="continuous", unit="s")
        self._add_values()
        self.states = [self._add_state(state) for state in system.states]
        self.memories = [self._add_memory(contact) for contact in system.contacts if contact.remembers]
        self.derivatives = [self._add_derivative(state) for state in self.states]
        continuous = {"causality": "output", "variability": "continuous", "initial": "calculated", "intermediate": True}
        self.outputs = [self._add(o.name, o.description, unit=o.unit, **continuous) for o in system.outputs]
        self.contact_states = [self._add_contact_state(contact) for contact in system.contacts]
        kinds = sorted({contact.kind for contact in system.contacts})
        self.types = {contact_states.type_name(kind): contact_states.meaning(kind) for kind in kinds}
        self.indicators = [
            self._add(
                f"{contact.name}_{_INDICATOR_NAMES[what]}",
                f"{contact.description}: falls to zero where the contact changes its state",
                causality="local",
                variability="continuous",
                initial="calculated",
            )
            for contact in system.contacts
            for what in contact.indicators
        ]
        self.clocks = list(self._clocks())

    @property
    def _next(self) -> int:
        return len(self.variables) + 1

    def _add(self, name: str, description: str, **attributes: Any) -> Variable:
        variable = Variable(reference=self._next, name=name, description=description, **attributes)
        self.variables.append(variable)
        return variable

    def _add_values(self) -> None:
        for p in self.system.parameters:
            self._parameters[p] = self._next
            self._add(
                p.name,
                p.description,
                causality="parameter",
                variability="tunable",
                initial="exact",
                start=p.value,
                unit=p.unit,
                minimum=p.minimum,
                maximum=p.maximum,
            )
        for symbol in (*self.system.inputs, *(u.rate for u in self.system.inputs)):
            self._reference[symbol] = self._next
            self._add(
                symbol.name,
                symbol.description,
                causality="input",
                variability="continuous",
                start=symbol.value,
                unit=symbol.unit,
            )

    def _add_state(self, state: State) -> Variable:
        self._reference[state] = self._next
        return self._add(
            state.name,
            state.description,
            causality="local",
            variability="continuous",
            initial="exact",
            start=state.start,
            unit=state.unit,
            nominal=state.nominal,
            intermediate=True,
        )

    def _add_derivative(self, state: Variable) -> Variable:
        return self._add(
            f"der({state.name})",
            f"rate of {state.name}",
            causality="local",
            variability="continuous",
            initial="calculated",
            unit=per_second(state.unit or "1"),
            derivative=state.reference,
            intermediate=True,
        )

    def _add_memory(self, contact: ContactDynamics) -> Variable:
        return self._add(
            f"{contact.name}_memory",
            f"{contact.description}: speed at which the stop was last entered; to be given for a start inside",
            causality="local",
            variability="discrete",
            initial="exact",
            start=0.0,
            unit="m/s",
            minimum=0.0,
        )

    def _add_contact_state(self, contact: ContactDynamics) -> Variable:
        return self._add(
            f"{contact.name}_state",
            f"{contact.description}: {contact_states.meaning(contact.kind)}",
            causality="output" if contact.name in self.system.shown_states else "local",
            variability="discrete",
            initial="calculated",
            declared_type=contact_states.type_name(contact.kind),
            minimum=min(contact_states.CONTACT_STATES),
            maximum=max(contact_states.CONTACT_STATES),
        )

    def _clocks(self) -> Iterator[Variable]:
        """The clocks of FMI 3, whose references follow those of the variables."""
        names = [(c, name) for c in self.system.contacts for name in contact_states.CLOCKS[c.kind]]
        for reference, (contact, name) in enumerate(names, start=self._next):
            yield Variable(
                reference=reference,
                name=f"{contact.name}.{name}",
                description=f"{contact.description}: {contact_states.TICKS[name]}",
                causality="output" if contact.name in self.system.shown_clocks else "local",
                variability="discrete",
            )

    # model structure

    @property
    def clock_unknowns(self) -> list[Unknown]:
        """The clocks among the outputs, which depend on everything through the events."""
        return [Unknown(v) for v in self.clocks if v.causality == "output"]

    @property
    def output_unknowns(self) -> list[Unknown]:
        """Outputs, and the contact states among them, which depend on everything through the events."""
        found = [
            self._unknown(v, self._symbols([o.expression]), o.expression)
            for v, o in zip(self.outputs, self.system.outputs, strict=True)
        ]
        return found + [Unknown(v) for v in self._shown_states]

    @property
    def derivative_unknowns(self) -> list[Unknown]:
        """Derivatives of the states."""
        system = self.system
        sources = [
            *({q.v} for q in system.coordinates),
            *(self._accelerations[a] for a in system.rate_symbols),
            *(self._symbols([rate]) for rate in system.internal_rates),
        ]
        rates = [*(q.v for q in system.coordinates), *system.rate_symbols, *system.internal_rates]
        return [self._unknown(v, s, e) for v, s, e in zip(self.derivatives, sources, rates, strict=True)]

    @property
    def indicator_unknowns(self) -> list[Unknown]:
        """Indicators of the contacts."""
        sources = []
        for c in self.system.contacts:
            behind = {
                "depth": [c.depth],
                "gap": [c.depth, c.force_symbol],
                "slip": [c.slip, c.capacity, c.force_symbol],
                "release": [c.release],
                "function": [c.slip, c.force_symbol],
            }
            sources += [self._symbols([e for e in behind[what] if e is not None]) for what in c.indicators]
        return [self._unknown(v, s) for v, s in zip(self.indicators, sources, strict=True)]

    @property
    def initial_unknowns(self) -> list[Unknown]:
        """What initialization computes, in order of reference.

        It chooses the states of the contacts, by everything, and lets bodies bounce that move into a wall.
        """
        system = self.system
        rates = [*(q.v for q in system.coordinates), *system.rate_symbols, *system.internal_rates]
        sources = [*rates, *(o.expression for o in system.outputs)]
        variables = (*self.derivatives, *self.outputs)
        found = [
            self._unknown(v, behind, e, initial=True) if (behind := self._start_values([e])) is not None else Unknown(v)
            for v, e in zip(variables, sources, strict=True)
        ]
        return found + [Unknown(v) for v in self._shown_states]

    def _start_values(self, expressions: Iterable[sympy.Expr]) -> set[sympy.Basic] | None:
        """What is given at the start behind expressions, parameters too; None if the state of a contact is."""
        contacts = self.system.contacts
        if any(c.reset or c.kind in ("impact", "impact_friction") for c in contacts):
            return None
        behind: dict[Any, set[sympy.Basic]] = {c.slip_symbol: c.slip.free_symbols for c in contacts}
        behind |= {c.depth_symbol: c.depth.free_symbols for c in contacts if c.depth is not None}
        if not contacts:
            behind |= self._free_accelerations
        found: set[sympy.Basic] = set()
        for symbol in set().union(*(expression.free_symbols for expression in expressions)):
            found |= behind.get(symbol, {symbol})
        return found if found <= self._reference.keys() | self._parameters.keys() else None

    def _unknown(
        self,
        variable: Variable,
        symbols: Iterable[sympy.Basic],
        expression: sympy.Expr | None = None,
        *,
        initial: bool = False,
    ) -> Unknown:
        """An entry with what it depends on; its expression, if given, says how."""
        known = self._reference | (self._parameters if initial else {})
        ordered = sorted(((known[s], s) for s in symbols if s in known), key=lambda pair: pair[0])
        kinds = ["dependent"] * len(ordered)
        direct = self._reference.keys() | self._parameters.keys()
        if (
            expression is not None
            and expression.free_symbols <= direct
            and expression.count_ops() <= _LARGEST_EXPRESSION
        ):
            for i, (_, symbol) in enumerate(ordered):
                factors = expression.diff(symbol).free_symbols
                if not factors:
                    kinds[i] = "constant"
                elif not initial and factors <= self._parameters.keys():
                    kinds[i] = "tunable"
        return Unknown(variable, tuple(reference for reference, _ in ordered), tuple(kinds))

    @property
    def _shown_states(self) -> list[Variable]:
        return [v for v in self.contact_states if v.causality == "output"]

    @cached_property
    def _free_accelerations(self) -> dict[Acceleration, set[sympy.Basic]]:
        system = self.system
        found = [set(e.free_symbols) for e in system.acceleration]
        for block in blocks(len(found), system.inertia) if system.inertia else ():
            together = set().union(*(found[i] for i in block))
            together |= set().union(*(e.free_symbols for (i, _), e in system.inertia.items() if i in block))
            for i in block:
                found[i] = together
        return dict(zip(system.rate_symbols, found, strict=True))

    @cached_property
    def _forces(self) -> dict[Any, set[sympy.Basic]]:
        """Symbols on which the force of each contact depends, in slip or in stick."""
        contacts = self.system.contacts
        laws = {c.force_symbol: self._symbols([c.force], contact=c) for c in contacts}
        held = [self._symbols([c.slip_rate, c.capacity], free=True) for c in contacts]
        inertia = self._inertia_symbols
        together = set().union(inertia, *laws.values(), *held)
        return {c.force_symbol: together if c.sticks or c.kind == "impact" else laws[c.force_symbol] for c in contacts}

    @cached_property
    def _accelerations(self) -> dict[Acceleration, set[sympy.Basic]]:
        """Symbols on which each acceleration depends, contact forces included."""
        found = {a: set(symbols) for a, symbols in self._free_accelerations.items()}
        for i, k in acting(self.system):
            a, contact = self.system.rate_symbols[i], self.system.contacts[k]
            entry: Any = self.system.W[i, k]
            lever = self._inertia_symbols if self.system.inertia else entry.free_symbols
            found[a] |= lever | self._forces[contact.force_symbol]
        return found

    @cached_property
    def _inertia_symbols(self) -> set[sympy.Basic]:
        """Symbols on which G depends; with a mass matrix, those of it and of all levers."""
        system = self.system
        entries = [*system.inertia.values(), *(system.W if system.inertia else system.G).values()]
        return set().union(*(entry.free_symbols for entry in entries))

    def _symbols(
        self, expressions: Iterable[sympy.Expr], *, contact: ContactDynamics | None = None, free: bool = False
    ) -> set[sympy.Basic]:
        """Known quantities behind expressions. free: accelerations in them stand for those without contact forces."""
        slips: dict[Any, set[sympy.Basic]] = {c.slip_symbol: c.slip.free_symbols for c in self.system.contacts}
        slips |= {c.depth_symbol: c.depth.free_symbols for c in self.system.contacts if c.depth is not None}
        found: set[sympy.Basic] = set()
        for symbol in set().union(*(expression.free_symbols for expression in expressions)):
            if symbol in slips:
                found |= slips[symbol]
            elif isinstance(symbol, Acceleration):
                found |= (self._free_accelerations if free else self._accelerations)[symbol]
            elif contact is None and not free and symbol in self._forces:
                found |= self._forces[symbol]
            elif symbol is TIME or isinstance(symbol, State | Input | Rate):
                found.add(symbol)
        return found

    # units

    @property
    def units(self) -> dict[str, dict[str, float] | None]:
        """Per unit its exponents of SI base units and its factor, for FMI's element BaseUnit; None if it cannot say."""
        names = dict.fromkeys(v.unit for v in self.variables if v.unit)
        return {name: _base_unit(name) for name in names}

    @property
    def display_units(self) -> dict[str, dict[str, float]]:
        """Per unit those that its variables are shown in, with how many of them one of it is."""
        found: dict[str, dict[str, float]] = {}
        for v in self.variables:
            if v.unit and v.display_unit:
                found.setdefault(v.unit, {})[v.display_unit] = conversion_factor(v.unit, v.display_unit)
        return found


def _base_unit(unit: str) -> dict[str, float] | None:
    """FMI attributes of a unit such as "N m/rad"; the radian is a base unit of FMI, and its exponents are whole.

    >>> _base_unit("N m/rad"), _base_unit("N/m1.5")
    ({'kg': 1, 'm': 2, 's': -2, 'rad': -1}, None)
    """
    base = base_units(unit)
    if any(power % 1 for _, power in base.powers):
        return None
    exponents = {BASE_UNITS[name]: int(power) for name, power in base.powers}
    attributes: dict[str, float] = {name: exponents[name] for name in BASE_UNITS.values() if name in exponents}
    if base.factor != 1.0:
        attributes["factor"] = base.factor
    return attributes


def render(template: str, **values: Any) -> str:
    """Fill one of the templates beside this module; values are escaped for XML."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("fmu_models.codegen"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template(template).render(**values)


def model_description(system: HybridSystem, token: str, fmi_version: str, tool: str, rights: Rights) -> str:
    """Text of modelDescription.xml; token as in the compiled model, tool the program that writes it."""
    values = {"d": Description(system), "system": system, "token": token, "tool": tool, "rights": rights.attributes}
    most = declarations("engine/fmi/variables.h").constants("Most", "MOST_")
    values |= {"log_categories": LOG_CATEGORIES, "output_order": most.OUTPUT_ORDER}
    return render(f"fmi{fmi_version[0]}.xml.j2", **values)
