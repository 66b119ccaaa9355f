"""A map: states that jump from one value to the next by a rule.

    x(k+1) = f(x(k), p)

It is the positive map; its inverse, where it has one, is the negative map, which runs the same motions backwards. A
state may be an angle, known up to a modulus; its rule is written without taking remainders, so that it can be
differentiated.
"""

import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.checks import check_names, check_requirements, quantity_names
from fmu_models.language.contacts import Requirement
from fmu_models.language.declaration import Declaration
from fmu_models.language.quantities import Parameter, State
from fmu_models.language.units import check_expression_units

# a wrong inverse misses by far more than rounding, a right one by no more than that of a few operations
_INVERSE_ACCURACY = 1e-8
_INVERSE_TRIALS = 8


@dataclass(frozen=True, eq=False, kw_only=True)
class Map(Declaration):
    """A declared map; see the module for its equation.

    Attributes:
        name, title, source, requirements: as of a Mechanism.
        states: x.
        rule: per state its next value, from states and parameters; Piecewise where it jumps.
        box: per state the range that its interesting motions lie in; 0 to the modulus if it has one.
        inverse: per state its previous value, from states and parameters; None if there is no unique one.
        modulus: of the states that are angles, such as 2*pi.

    Raises:
        StickslipError: the declaration contradicts itself; the message says where.
    """

    name: str
    title: str
    source: str
    states: Sequence[State]
    rule: Mapping[State, sympy.Expr]
    box: Mapping[State, tuple[float, float]] = field(default_factory=dict)
    inverse: Mapping[State, sympy.Expr] | None = None
    modulus: Mapping[State, sympy.Expr] = field(default_factory=dict)
    requirements: Sequence[Requirement] = ()
    contacts: ClassVar[tuple[()]] = ()

    def _contents(self) -> dict[str, object]:
        rule = {f"{state.name}(k+1)": value for state, value in self.rule.items()}
        return {**rule, "parameters": [q.name for q in self.parameters]}

    def __post_init__(self) -> None:
        for name in ("states", "requirements"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in ("rule", "modulus", "inverse"):
            mapping = getattr(self, name)
            if mapping is not None:
                object.__setattr__(self, name, {x: sympy.sympify(e) for x, e in mapping.items()})
        _check(self)
        periods = {state: (0.0, float(turn)) for state, turn in self.modulus.items()}
        object.__setattr__(self, "box", {x: (periods | dict(self.box))[x] for x in self.states})
        rules = ((f"the rule of {state.name}", after, state.unit) for state, after in self.rule.items())
        check_expression_units(self.name, self.states, rules)
        if self.inverse is not None:
            _check_inverse(self, self.inverse)

    @property
    def symbols(self) -> set[sympy.Basic]:
        expressions = [*self.rule.values(), *(self.inverse or {}).values()]
        return set().union(*(e.free_symbols for e in expressions))


def _check(declared: Map) -> None:
    if not declared.states:
        raise StickslipError(f"{declared.name} has no state. A map needs at least one.")
    check_names(declared.name, quantity_names(declared.parameters, (), declared.states))
    _check_states(declared, "rule", declared.rule)
    if declared.inverse is not None:
        _check_states(declared, "inverse", declared.inverse)
    for symbol in sorted(declared.symbols, key=str):
        if not isinstance(symbol, Parameter) and symbol not in declared.states:
            raise StickslipError(
                f"{declared.name}: '{symbol}' is not a quantity of it. A map is made of its states and of parameters; "
                "it knows neither time nor inputs."
            )
    for state, turn in declared.modulus.items():
        if state not in declared.states or not (turn.is_number and turn.is_positive):
            raise StickslipError(
                f"{declared.name}: the modulus of '{state.name}' is {turn}. Give a positive number, such as 2*pi, and "
                "only for states of the map."
            )
    _check_box(declared)
    check_requirements(declared)


def _check_states(declared: Map, kind: str, rules: Mapping[State, sympy.Expr]) -> None:
    for state in declared.states:
        if state not in rules:
            raise StickslipError(
                f"{declared.name}: state '{state.name}' has no {kind}. Say what it becomes; itself if it stays."
            )
    for state in rules:
        if state not in declared.states:
            raise StickslipError(f"{declared.name}: '{state.name}' has a {kind} but is not a state of it.")


def _check_box(declared: Map) -> None:
    for state in declared.box:
        if state not in declared.states:
            raise StickslipError(f"{declared.name}: '{state.name}' has a box but is not a state of it.")
    for state in declared.states:
        if state not in declared.box and state not in declared.modulus:
            raise StickslipError(
                f"{declared.name}: state '{state.name}' has no box. Say between which two values its motions are to be "
                f"sought, as box={{{state.name}: (-2.0, 2.0)}}."
            )
        low, high = declared.box.get(state, (0.0, 1.0))
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise StickslipError(
                f"{declared.name}: the box of '{state.name}' goes from {low} to {high}. Give two numbers, the smaller "
                "one first."
            )


def _check_inverse(declared: Map, inverse: Mapping[State, sympy.Expr]) -> None:
    """Refuse an inverse that does not lead back, tried with the default parameters at places in the box."""
    values = {p: sympy.Float(p.value) for p in declared.parameters}
    chance = random.Random(0)
    for _ in range(_INVERSE_TRIALS):
        before = {x: sympy.Float(chance.uniform(*declared.box[x])) for x in declared.states}
        after = {x: _number(e, values | before) for x, e in declared.rule.items()}
        for state in declared.states:
            image = _number(inverse[state], values | after)
            miss = float(image - before[state]) if image.is_real else math.nan
            if state in declared.modulus:
                miss = math.remainder(miss, float(declared.modulus[state]))
            low, high = declared.box[state]
            if not abs(miss) <= _INVERSE_ACCURACY * (high - low):
                origin = ", ".join(f"{x.name} = {float(value):.6g}" for x, value in before.items())
                raise StickslipError(
                    f"{declared.name}: the inverse does not undo the rule: from {origin} it leads back to {state.name} "
                    f"= {image}. Solve the rule for its states; leave the inverse out if there are several solutions."
                )


def _number(expression: sympy.Expr, values: Mapping[Any, Any]) -> sympy.Expr:
    return sympy.N(expression.xreplace(dict(values)))
