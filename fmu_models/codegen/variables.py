"""The variables of an FMU.

Their order is that of the value references, from 1, which engine/fmi/variables.c counts through: time, parameters,
inputs, rates of the inputs, states, memories of stops, derivatives, outputs, states of the contacts, indicators; the
clocks of FMI 3 follow.
Outputs that are the same quantity share one reference in FMI 2.0, and the places of all others stay their references.
In FMI 3.0, where an alias is no variable of its own, they stay apart: checkers miss such outputs among the initial
unknowns. The derivative of a coordinate is listed beside its velocity: it has to name the state that it belongs to.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fmu_models.base.unit_names import base_units, conversion_factor
from fmu_models.language import contact_kinds
from fmu_models.language.quantities import TIME, Parameter, State, per_second

if TYPE_CHECKING:
    import sympy

    from fmu_models.language.contact_dynamics import ContactDynamics
    from fmu_models.language.declaration import Output
    from fmu_models.lowering.hybrid_system import HybridSystem

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
# states in these units are outputs, so that tools which list outputs only can connect a motion
MOTIONS = ({"m": 1}, {"m": 1, "s": -1}, {"rad": 1}, {"s": -1, "rad": 1})


def _role(causality: str, variability: str, initial: str | None = None, **others: Any) -> dict[str, Any]:
    return {"causality": causality, "variability": variability, "initial": initial, **others}


# what variables are, as FMI says it
ROLES = {
    "time": _role("independent", "continuous"),
    "parameter": _role("parameter", "tunable", "exact"),
    "input": _role("input", "continuous"),
    "state": _role("local", "continuous", "exact", intermediate=True),
    "memory": _role("local", "discrete", "exact"),
    "derivative": _role("local", "continuous", "calculated", intermediate=True),
    "output": _role("output", "continuous", "calculated", intermediate=True),
    "contact state": _role("local", "discrete", "calculated"),
    "indicator": _role("local", "continuous", "calculated"),
    "state of a map": _role("output", "discrete", "exact"),
}


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One variable of an FMU; ``None`` leaves the attribute out.

    Attributes:
        derivative: the reference of the state that it is the derivative of.
        intermediate: it can be read, an input set, inside a step of Co-Simulation (FMI 3).
        same_as: a variable listed before that is the same quantity.
    """

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
    same_as: Variable | None = None

    @property
    def shared_reference(self) -> int:
        """Its reference where variables of the same quantity share one."""
        return self.reference if self.same_as is None else self.same_as.reference

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


class Variables:
    """The variables of one lowered system, in the order of their references, and the units that they are in.

    The states of a map are discrete outputs, which change at its time events alone; their rates are not listed.

    Attributes:
        references: of what can be set beside parameters, and of the time.
        parameters: references of the parameters.
    """

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        self.listed: list[Variable] = []
        self._add("time", "time", "time", unit="s")
        self.references: dict[sympy.Basic, int] = {TIME: 1}
        self.parameters: dict[sympy.Basic, int] = {p: self._add_parameter(p).reference for p in system.parameters}
        for symbol in (*system.inputs, *(u.rate for u in system.inputs)):
            values = {"start": symbol.value, "unit": symbol.unit, "intermediate": symbol in system.inputs}
            variable = self._add("input", symbol.name, symbol.description, **values)
            self.references[symbol] = variable.reference
        self.states = [self._add_state(state) for state in system.states]
        self.memories = [self._add_memory(contact) for contact in system.contacts if contact.remembers]
        self.derivatives = [] if system.rule else [self._add_derivative(state) for state in self.states]
        self.outputs: list[Variable] = []
        for output in system.outputs:
            self.outputs.append(self._add_output(output))
        self.contact_states = [self._add_contact_state(contact) for contact in system.contacts]
        kinds = sorted({contact.kind for contact in system.contacts}, key=lambda kind: kind.name)
        self.types = {kind.type_name: kind.meaning for kind in kinds}
        self.indicators = [
            self._add(
                "indicator",
                f"{contact.name}_{contact_kinds.INDICATORS[indicator][0]}",
                f"{contact.description}: falls to zero where the contact changes its state",
            )
            for contact in system.contacts
            for indicator in contact.indicators
        ]
        self.clocks = list(self._clocks())

    def _add(self, role: str, name: str, description: str, **attributes: Any) -> Variable:
        """A variable of a role; ``attributes`` go before those of the role."""
        reference = len(self.listed) + 1
        if name in self.system.exposed:
            attributes["causality"] = "output"
        variable = Variable(reference=reference, name=name, description=description, **{**ROLES[role], **attributes})
        self.listed.append(variable)
        return variable

    def _add_parameter(self, p: Parameter) -> Variable:
        values = {"start": p.value, "unit": p.unit, "minimum": p.minimum, "maximum": p.maximum}
        return self._add("parameter", p.name, p.description, **values)

    @property
    def units(self) -> dict[str, dict[str, float] | None]:
        """Per unit its exponents of SI base units and its factor, for FMI's element BaseUnit; None if it cannot say."""
        names = dict.fromkeys(v.unit for v in self.listed if v.unit)
        return {name: base_unit(name) for name in names}

    @property
    def display_units(self) -> dict[str, dict[str, float]]:
        """Per unit those that its variables are shown in, with how many of them one of it is."""
        units: dict[str, dict[str, float]] = {}
        for v in self.listed:
            if v.unit and v.display_unit:
                units.setdefault(v.unit, {})[v.display_unit] = conversion_factor(v.unit, v.display_unit)
        return units

    def _add_state(self, state: State) -> Variable:
        role, nominal = ("state of a map", None) if self.system.rule else ("state", state.nominal)
        values: dict[str, Any] = {"start": state.start, "unit": state.unit, "nominal": nominal}
        if state not in self.system.internal_states and base_unit(state.unit) in MOTIONS:
            values["causality"] = "output"
        variable = self._add(role, state.name, state.description, **values)
        self.references[state] = variable.reference
        return variable

    def _add_derivative(self, state: Variable) -> Variable:
        attributes = {"unit": per_second(state.unit or "1"), "derivative": state.reference}
        return self._add("derivative", f"der({state.name})", f"rate of {state.name}", **attributes)

    def _add_output(self, output: Output) -> Variable:
        before = zip(self.system.outputs, self.outputs, strict=False)
        same = next((v for o, v in before if (o.expression, o.unit) == (output.expression, output.unit)), None)
        return self._add("output", output.name, output.description, unit=output.unit, same_as=same)

    def _add_memory(self, contact: ContactDynamics) -> Variable:
        description = f"{contact.description}: speed at which the stop was last entered; to be given for a start inside"
        values = {"start": 0.0, "unit": contact.slip_symbol.unit, "minimum": 0.0}
        return self._add("memory", f"{contact.name}_memory", description, **values)

    def _add_contact_state(self, contact: ContactDynamics) -> Variable:
        states = contact_kinds.CONTACT_STATES
        return self._add(
            "contact state",
            f"{contact.name}_state",
            f"{contact.description}: {contact.kind.meaning}",
            **{"declared_type": contact.kind.type_name, "minimum": min(states), "maximum": max(states)},
        )

    def _clocks(self) -> Iterator[Variable]:
        """The clocks of FMI 3, whose references follow those of the variables."""
        names = [(c, name) for c in self.system.contacts for name in c.clocks]
        for reference, (contact, name) in enumerate(names, start=len(self.listed) + 1):
            exposed = f"{contact.name}.{name}" in self.system.exposed
            yield Variable(
                reference=reference,
                name=f"{contact.name}.{name}",
                description=f"{contact.description}: {contact_kinds.TICKS[name]}",
                causality="output" if exposed else "local",
                variability="discrete",
            )


def base_unit(unit: str) -> dict[str, float] | None:
    """FMI attributes of a unit such as "N m/rad"; the radian is a base unit of FMI, and its exponents are whole.

    >>> base_unit("N m/rad"), base_unit("N/m1.5")
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
