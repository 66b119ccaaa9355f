"""Whether every mode of a system is linear with constant coefficients, and the rows of its flow if so.

Modes are not enumerated. Where W and G hold parameters alone and every rate, slip, depth, force, capacity, release and
reset is affine in

    z = (states, cos and sin of each harmonic of the time, the time, 1)

for each sign, so is every mode: contact forces, of law or of constraint, solve linear equations with constant factors.
Inputs count as constants.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import sympy

from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.language.quantities import TIME, Parameter
from fmu_models.lowering.hybrid_system import HybridSystem

Row = tuple[Any, ...]
APART = 1e-6  # relative, of two values that are no rounding of one


@dataclass(frozen=True, eq=False)
class Lifted:
    """The coordinates z of a system.

    Attributes:
        states: symbols of the states.
        harmonics: arguments a of the harmonics of the time; z holds cos a and sin a of each, in turns.
        phasors: the symbols that stand for these.
    """

    states: tuple[sympy.Basic, ...]
    harmonics: tuple[Any, ...]
    phasors: tuple[sympy.Basic, ...]

    @classmethod
    def of(cls, system: HybridSystem) -> Lifted:
        """The lifted states of a system; harmonics whose argument is not affine in the time are left out."""
        arguments: dict[Any, None] = {}
        for _, expression in _expressions(system):
            for wave in sorted(expression.atoms(sympy.sin, sympy.cos), key=str):
                if _is_harmonic(wave.args[0]):
                    arguments[wave.args[0]] = None
        symbols = [sympy.Dummy(f"{name}{i}", real=True) for i in range(len(arguments)) for name in ("cos", "sin")]
        return cls(system.states, tuple(arguments), tuple(symbols))

    def row(self, expression: sympy.Basic, *further: sympy.Basic) -> Row | None:
        """Factors of z, one more for each of ``further``, in an expression; None where it is not affine in them."""
        phasor_of = {
            wave: self.phasors[2 * i + k]
            for i, argument in enumerate(self.harmonics)
            for k, wave in enumerate((sympy.cos(argument), sympy.sin(argument)))
        }
        lifted = sympy.sympify(expression).xreplace(phasor_of)
        unknowns = (*self.states, *self.phasors, *further)
        present = lifted.free_symbols
        factors = [sympy.diff(lifted, z) if z in present else sympy.S.Zero for z in unknowns]
        changing = {*unknowns, TIME}
        for factor in factors:
            if not factor.free_symbols & changing:
                continue
            if _changes(factor, changing) or sympy.expand(factor).free_symbols & changing:
                return None
        constant = lifted.xreplace(dict.fromkeys(unknowns, sympy.S.Zero))
        if TIME in constant.free_symbols:
            return None
        n = len(unknowns) - len(further)
        return (*factors[:n], constant, *factors[n:])


def _changes(factor: sympy.Expr, changing: AbstractSet[Any]) -> bool:
    """Whether two values of an expression show that it hangs on some symbols: much sooner than its expansion does."""
    symbols = sorted(factor.free_symbols, key=str)
    # fractions: what cancels is zero, where rounding of it would be told from other rounding
    near = {symbol: sympy.Rational(30 + 7 * number, 100) for number, symbol in enumerate(symbols)}
    far = {symbol: value + (sympy.Rational(29, 100) if symbol in changing else 0) for symbol, value in near.items()}
    first, second = (sympy.N(factor.xreplace(values)) for values in (near, far))
    return bool(first.is_real and second.is_real and abs(first - second) > APART * (abs(first) + abs(second)))


def obstacles(system: HybridSystem) -> tuple[str, ...]:
    """Why some mode is not linear with constant coefficients, a sentence each; empty where all are."""
    if system.rule:
        return ("a map has no flow",)
    if system.signals:
        return (f"'{system.signals[0].name}' jumps or bends at times of its own, and no strobe in lanes stops there",)
    if system.inertia or not system.constant_inertia:
        return ("the mass matrix, or a lever of a contact, changes with the motion",)
    lifted = Lifted.of(system)
    sentences = []
    for name, contact, expression in _named(system):
        local = () if contact is None else _local(contact)
        if lifted.row(expression, *local, TIME) is None:
            sentences.append(_sentence(lifted, name, contact, sympy.sympify(expression)))
    for contact in system.contacts:
        if contact.remembers:
            sentences.append(f"contact '{contact.name}': the factors of its force change with the speed of entry")
    return tuple(dict.fromkeys(sentences))


def ramps(system: HybridSystem) -> tuple[str, ...]:
    """The parts of a system without obstacles that rise with the time itself, a sentence each."""
    lifted = Lifted.of(system)
    return tuple(
        f"{name} rises with the time: it is another at each strobe"
        for name, contact, expression in _named(system)
        if lifted.row(expression, *(() if contact is None else _local(contact))) is None
    )


def _local(contact: ContactDynamics) -> tuple[sympy.Basic, ...]:
    """What a law reads of its contact that is affine in z itself."""
    return (contact.slip_symbol, *(() if contact.depth_symbol is None else (contact.depth_symbol,)))


def _named(system: HybridSystem) -> Iterable[tuple[str, ContactDynamics | None, Any]]:
    """Everything that must be affine, with what it is."""
    for state, rate in zip(system.driven, system.acceleration, strict=True):
        yield f"the rate of {state.name}", None, rate
    for state, rate in zip(system.internal_states, system.internal_rates, strict=True):
        yield f"the rate of {state.name}", None, _inlined(system, rate)
    for contact in system.contacts:
        where = f"contact '{contact.name}'"
        for expression in (contact.force, *contact.capacities, contact.slip, contact.depth, contact.release):
            if expression is not None:
                yield where, contact, expression
        for state, value in contact.reset.items():
            yield f"{where}: the jump of {state.name}", contact, value


def _inlined(system: HybridSystem, expression: sympy.Basic) -> sympy.Basic:
    """Slip speeds written out."""
    return sympy.sympify(expression).xreplace({c.slip_symbol: c.slip for c in system.contacts})


def _expressions(system: HybridSystem) -> Iterable[tuple[str, Any]]:
    for name, _, expression in _named(system):
        yield name, sympy.sympify(expression)


def _is_harmonic(argument: sympy.Expr) -> bool:
    slope = sympy.diff(argument, TIME)
    offset = argument.xreplace({TIME: sympy.S.Zero})
    symbols = slope.free_symbols | offset.free_symbols
    return slope != 0 and all(isinstance(symbol, Parameter) for symbol in symbols)


def _sentence(lifted: Lifted, name: str, contact: ContactDynamics | None, expression: sympy.Basic) -> str:
    """What of an expression is not affine, and for which parameters it would be."""
    names: dict[sympy.Basic, str] = {} if contact is None else {contact.slip_symbol: "v", contact.sign_symbol: "sgn(v)"}
    if contact is not None and contact.depth_symbol is not None:
        names[contact.depth_symbol] = "d"
    local = () if contact is None else _local(contact)
    worst = _smallest(lifted, expression, local)
    if contact is not None and contact.sign_symbol in worst.free_symbols and contact.slip_symbol in worst.free_symbols:
        # sign times speed is its magnitude
        magnitude = sympy.Symbol("|v|")
        worst = worst.xreplace({contact.sign_symbol * contact.slip_symbol: magnitude})
        worst = worst.subs(contact.sign_symbol * contact.slip_symbol, magnitude)
    printed = worst.xreplace({s: sympy.Symbol(names.get(s, getattr(s, "name", str(s)))) for s in worst.free_symbols})
    of = "the depth" if contact is not None and contact.depth_symbol in worst.free_symbols else "the speed"
    of = of if contact is not None else "the states"
    unless = _remedy(lifted, expression, local)
    return f"{name}: {printed} is not linear in {of}" + (f", but for {unless}" if unless else "")


def _smallest(lifted: Lifted, expression: sympy.Basic, local: Sequence[sympy.Basic]) -> sympy.Basic:
    """The smallest part of an expression that is not affine by itself."""
    for term in expression.args:
        if term.free_symbols and lifted.row(term, *local, TIME) is None:
            return _smallest(lifted, term, local)
    return expression


def _remedy(lifted: Lifted, expression: sympy.Basic, local: Sequence[sympy.Basic]) -> str:
    """Values of parameters for which an expression is affine after all."""
    parameters = sorted((s for s in expression.free_symbols if isinstance(s, Parameter)), key=lambda s: s.declared)
    for parameter in parameters:
        if not parameter.is_positive and _is_affine(lifted, expression, local, {parameter: sympy.S.Zero}):
            return f"{parameter.name} = 0"
    for first, second in combinations(parameters, 2):
        if first.unit == second.unit and _is_affine(lifted, expression, local, {first: second}):
            return f"{first.name} = {second.name}"
    return ""


def _is_affine(lifted: Lifted, expression: sympy.Basic, local: Sequence[sympy.Basic], values: dict[Any, Any]) -> bool:
    """Whether an expression is affine, and does not vanish, with these values."""
    changed = expression.xreplace(values)
    return changed != 0 and not changed.has(sympy.nan, sympy.zoo) and lifted.row(changed, *local, TIME) is not None
