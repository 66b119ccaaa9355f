"""A system without a body: states, flows, and switching functions whose signs the flows know.

    x' = f(t, x, u, s),    s_i = sgn(h_i(t, x, u))

f must be affine in the signs. Where f jumps across h_i = 0 and both sides push onto it, the motion slides along
h_i = 0 with the mean of the two flows that keeps it there (Filippov's convex method); this is derived (lowering), never
typed. A ``Reset`` makes states jump where a switching function falls to zero.

Source: Filippov, Differential equations with discontinuous right-hand sides (1988), chapter 2.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.language.checks import check_names, check_requirements, quantity_names, stranger
from fmu_models.language.contacts import Requirement, create_symbols
from fmu_models.language.declaration import Declaration, Output
from fmu_models.language.quantities import TIME, ContactSymbol, Input, InternalState, Parameter, State
from fmu_models.language.signals import with_signals
from fmu_models.language.units import check_expression_units, signal_units

_SIDES = {"+": 1, "-": 2, "both": 3}


@dataclass(frozen=True, eq=False, kw_only=True)
class Switch(Shown):
    """A switching function.

    Attributes:
        name: for example "fold".
        function: h, from states, inputs, parameters and time.
        unit: of h.
        description: what changes where it is zero.
        sign: +1 where h > 0, -1 where h < 0; for flows.
    """

    name: str
    function: sympy.Expr
    unit: str = "1"
    description: str = ""
    sign: ContactSymbol = field(init=False)
    value: ContactSymbol = field(init=False)
    force: ContactSymbol = field(init=False)

    def __post_init__(self) -> None:
        create_symbols(self, sign="1", value=self.unit, force="1")

    @property
    def abs(self) -> sympy.Expr:
        """|h|, for flows."""
        return self.sign * sympy.sympify(self.function)


@dataclass(frozen=True, eq=False)
class Reset(Shown):
    """States that jump where a switching function falls to zero.

    Attributes:
        switch: whose function it is.
        side: "+" coming from h > 0, "-" from h < 0, or "both".
        to: per state its value after the jump, from the values before; other states keep theirs.
    """

    switch: Switch
    side: str
    to: Mapping[State, sympy.Expr]

    def __post_init__(self) -> None:
        if self.side not in _SIDES:
            raise StickslipError(
                f"the reset of switch '{self.switch.name}' has side={self.side!r}. Say from which side the switching "
                "function falls to zero: '+', '-' or 'both'."
            )

    @property
    def bits(self) -> int:
        """1 for the side plus, 2 for minus, 3 for both."""
        return _SIDES[self.side]


@dataclass(frozen=True, eq=False, kw_only=True)
class Automaton(Declaration):
    """A declared system without a body; see the module for its equation.

    Attributes:
        name, title, source, outputs, requirements: as of a Mechanism.
        states: those of x, in its order.
        flows: per state its rate.
        switches: the switching functions.
        resets: the jumps, at most one per switch.

    Raises:
        StickslipError: the declaration contradicts itself; the message says where.
    """

    name: str
    title: str
    source: str
    states: Sequence[State]
    flows: Mapping[State, sympy.Expr]
    switches: Sequence[Switch] = ()
    outputs: Sequence[Output] = ()
    requirements: Sequence[Requirement] = ()
    resets: Sequence[Reset] = ()

    def __post_init__(self) -> None:
        for name in ("states", "switches", "outputs", "requirements", "resets"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        object.__setattr__(self, "flows", {x: sympy.sympify(e) for x, e in self.flows.items()})
        _check(self)
        check_expression_units(self.name, self.states, _expected_units(self))

    def _contents(self) -> dict[str, object]:
        names = {name: [q.name for q in getattr(self, name)] for name in ("parameters", "all_inputs", "outputs")}
        return {"flows": {state.name: flow for state, flow in self.flows.items()}, "switches": self.switches, **names}

    @property
    def contacts(self) -> tuple[Switch, ...]:
        """The switches, which are to an automaton what contacts are to a mechanism."""
        return tuple(self.switches)

    @property
    def symbols(self) -> set[sympy.Basic]:
        """Quantities that the automaton uses, signs of switches left out."""
        expressions = [
            *self.flows.values(),
            *(s.function for s in self.switches),
            *(o.expression for o in self.outputs),
        ]
        expressions += [e for reset in self.resets for e in reset.to.values()]
        used = set().union(*(sympy.sympify(e).free_symbols for e in expressions))
        return with_signals(used - {switch.sign for switch in self.switches})

    @property
    def internal_states(self) -> tuple[InternalState, ...]:
        """None: an automaton has no laws."""
        return ()


def _expected_units(automaton: Automaton) -> Iterator[tuple[str, sympy.Expr, str]]:
    for state, flow in automaton.flows.items():
        yield f"the flow of {state.name}", flow, state.rate.unit
    for switch in automaton.switches:
        yield f"switch '{switch.name}'", switch.function, switch.unit
    for reset in automaton.resets:
        for state, value in reset.to.items():
            yield f"the reset of {state.name}", value, state.unit
    for output in automaton.outputs:
        yield f"output '{output.name}'", output.expression, output.unit
    yield from signal_units(automaton.signals)


def _check(automaton: Automaton) -> None:
    if not automaton.states:
        raise StickslipError(f"{automaton.name} has no state. An automaton needs at least one.")
    check_names(automaton.name, _names(automaton))
    for state in automaton.states:
        if state not in automaton.flows:
            raise StickslipError(
                f"{automaton.name}: state '{state.name}' has no flow. Give its rate; 0 if it is constant."
            )
    _check_flows(automaton)
    _check_switches(automaton)
    symbols = {*automaton.states, *(state.rate for state in automaton.states), TIME}
    for symbol in sorted(automaton.symbols, key=str):
        if not isinstance(symbol, (Parameter, Input)) and symbol not in symbols:
            raise StickslipError(f"{automaton.name}: {stranger(symbol)}")
    check_requirements(automaton)


def _check_flows(automaton: Automaton) -> None:
    signs = [switch.sign for switch in automaton.switches]
    for state, flow in automaton.flows.items():
        if state not in automaton.states:
            raise StickslipError(f"{automaton.name}: '{state.name}' has a flow but is not a state of it.")
        if flow.has(*(x.rate for x in automaton.states)):
            raise StickslipError(f"{automaton.name}: the flow of '{state.name}' uses a rate; only outputs may use it.")
        if any(sympy.expand(sympy.diff(flow, sign)).has(*signs) for sign in signs):
            raise StickslipError(
                f"{automaton.name}: the flow of '{state.name}' is not affine in the signs of the switches ({flow}). "
                "Write it as f0 + sign1*f1 + sign2*f2; the product of two signs needs a switch of its own."
            )


def _check_switches(automaton: Automaton) -> None:
    signs = {switch.sign for switch in automaton.switches}
    for switch in automaton.switches:
        symbols = sympy.sympify(switch.function).free_symbols
        if symbols & (signs | {x.rate for x in automaton.states}):
            raise StickslipError(f"switch '{switch.name}': its function may use states, inputs and time only.")
        if all(isinstance(symbol, Parameter) for symbol in symbols):
            raise StickslipError(f"switch '{switch.name}': its function never changes ({switch.function}).")
    reset = [r.switch for r in automaton.resets]
    for r in automaton.resets:
        if r.switch not in automaton.switches:
            raise StickslipError(
                f"{automaton.name}: a reset belongs to '{r.switch.name}', which is not a switch of it."
            )
        if reset.count(r.switch) > 1:
            raise StickslipError(f"switch '{r.switch.name}' has two resets; it can have one, with side='both' perhaps.")
        for state, value in r.to.items():
            wrong = sympy.sympify(value).free_symbols & (signs | {x.rate for x in automaton.states})
            if state not in automaton.states or wrong:
                raise StickslipError(
                    f"the reset of switch '{r.switch.name}' sets {state.name} = {value}. It may set states of "
                    f"{automaton.name}, from the states before the jump, inputs and time."
                )


def _names(automaton: Automaton) -> Iterator[tuple[str, str]]:
    yield from quantity_names(automaton.parameters, automaton.all_inputs, automaton.states)
    for output in automaton.outputs:
        yield output.name, f"output '{output.description}'"
    for switch in automaton.switches:
        yield switch.name, f"switch '{switch.name}'"
        yield f"{switch.name}_state", f"the state of switch {switch.name}"
