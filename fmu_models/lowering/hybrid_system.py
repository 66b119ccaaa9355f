"""What every declaration is lowered to: one system in factored form.

    q' = v                          coordinates; a system without a body has none
    v' = a + W lambda               driven states: velocities, or all states of a system without a body
    z' = internal_rates             internal states of the laws
    y  = slip                       slip speed, speed of approach or switching function of each contact
    y' = slip_rate + G lambda       slip_rate without contact forces; G = J W, J = dy/dv

Where the mass matrix M of the driven states is large, its inverse is not written out: a system with an ``inertia`` M
has M a and M W = J^T in the place of a and W, and G = J W is left to the code that factors M.

a is the rate without contact forces, lambda the contact forces. Friction slips (lambda = force), sticks (lambda keeps
y' = 0 while |lambda| < capacity) or is away (lambda = 0); a stop touches (lambda = force), has released or is away
(lambda = 0); a switch with sliding is a friction of capacity 1.

A rigid contact is one or two of these "contacts", its friction directly behind its normal direction. Normal: y is the
rate of the gap, lambda >= 0; open lambda = 0, closed lambda keeps y' = 0. Friction: open as long as the other is,
else it slips (|lambda| = mu times the normal force) or sticks (|lambda| less than that).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contact_dynamics import ContactDynamics, Element
from fmu_models.language.contacts import Requirement
from fmu_models.language.declaration import Declaration, Output
from fmu_models.language.inertia import blocks
from fmu_models.language.quantities import Acceleration, Coordinate, Input, InternalState, Parameter, State, Velocity
from fmu_models.language.signals import PeriodicSignal

_EMPTY = sympy.ImmutableSparseMatrix(0, 0, [])


@dataclass(frozen=True, eq=False, kw_only=True)
class HybridSystem:
    """A lowered declaration; the equations are at the head of the module.

    Attributes:
        name, title, source: as declared.
        parameters, inputs, signals, coordinates, internal_states, outputs: in the order of the FMU's variables.
        driven: the states v.
        rate_symbols: what outputs call the rates of the driven states (``Coordinate.a``).
        acceleration: a, one per driven state; M a with an inertia.
        W: (n_driven, n_contacts), rate of the driven states per contact force; M W with an inertia.
        G: (n_contacts, n_contacts), rate of y per contact force; zero with an inertia.
        inertia: M, by row and column of its entries that are not zero; empty where a, W and G are written out.
        contacts: the contacts.
        internal_rates: one per internal state.
        rule: of a map, per state its next value; its internal states rest meanwhile, and its last parameter is the time
            from one step to the next. Empty of all else.
        modulus: of those of its states that are angles.
        kinetic_energy: the part that is quadratic in v, which impulses change; 0 without a body.
        all_requirements: what the parameters must satisfy beside their own bounds.
        exposed: names of local variables and clocks of the FMU that are to be outputs. States of contacts are none by
            default: importers that know only real outputs have trouble with integers and clocks.
    """

    name: str
    title: str
    source: str
    parameters: tuple[Parameter, ...]
    inputs: tuple[Input, ...]
    signals: tuple[PeriodicSignal, ...]
    all_requirements: tuple[Requirement, ...]
    coordinates: tuple[Coordinate, ...] = ()
    driven: tuple[State, ...] = ()
    rate_symbols: tuple[Acceleration, ...] = ()
    internal_states: tuple[InternalState, ...] = ()
    acceleration: tuple[sympy.Expr, ...] = ()
    W: sympy.ImmutableSparseMatrix = _EMPTY
    G: sympy.ImmutableSparseMatrix = _EMPTY
    contacts: tuple[ContactDynamics, ...] = ()
    internal_rates: tuple[sympy.Expr, ...] = ()
    kinetic_energy: sympy.Expr = sympy.S.Zero
    outputs: tuple[Output, ...] = ()
    exposed: frozenset[str] = frozenset()
    inertia: Mapping[tuple[int, int], sympy.Expr] = field(default_factory=dict)
    rule: Mapping[State, sympy.Expr] = field(default_factory=dict)
    modulus: Mapping[State, sympy.Expr] = field(default_factory=dict)

    @classmethod
    def of(cls, model: Declaration, **parts: Any) -> HybridSystem:
        """A declared model with what is derived from it, by field."""
        names = ("name", "title", "source", "parameters", "inputs", "signals", "all_requirements")
        return cls(**{name: getattr(model, name) for name in names} | parts)

    @cached_property
    def constant_inertia(self) -> bool:
        """Whether M, W and G depend on parameters alone."""
        return only_parameters([*self.W.values(), *self.G.values(), *self.inertia.values()])

    def written_out(self) -> HybridSystem:
        """This system, which must have a, W and G written out, and directions apart. StickslipError: its mass matrix is
        left to the generated code, or friction has two directions."""
        if any(contact.kind.cone for contact in self.contacts):
            raise StickslipError(
                f"{self.name} has friction with two directions, which only the engine knows. Simulate it, "
                "or give the friction one slip speed."
            )
        if self.inertia:
            raise StickslipError(
                f"{self.name}: its mass matrix of {len(self.driven)} coordinates is factored in the generated code; "
                "what needs the accelerations written out takes at most two coupled coordinates (three with a "
                "constant mass matrix). Compare it by the importer's own integration instead."
            )
        return self.with_piles()

    def with_piles(self) -> HybridSystem:
        """This system with the forces of arrays written out."""
        arrays = [c for c in self.contacts if c.elements]
        if not arrays:
            return self
        piles: dict[Any, Any] = {c.pile_symbol: sympy.Add(*(k * z for z, k, _ in c.elements)) for c in arrays}
        return replace(
            self,
            acceleration=tuple(a.xreplace(piles) for a in self.acceleration),
            outputs=tuple(replace(o, expression=sympy.sympify(o.expression).xreplace(piles)) for o in self.outputs),
        )

    @property
    def all_inputs(self) -> tuple[Input, ...]:
        """The inputs, then the signals."""
        return (*self.inputs, *self.signals)

    @property
    def velocities(self) -> tuple[Velocity, ...]:
        """Velocities, one per coordinate."""
        return tuple(q.v for q in self.coordinates)

    @property
    def states(self) -> tuple[State, ...]:
        """Continuous states: coordinates, then driven states, then internal states."""
        return (*self.coordinates, *self.driven, *self.internal_states)

    @property
    def directed(self) -> bool:
        """Whether a contact holds more in one direction than in the other."""
        return any(contact.capacity_minus is not None for contact in self.contacts)

    @property
    def indicator_count(self) -> int:
        """Number of event indicators of all contacts."""
        return sum(len(contact.indicators) for contact in self.contacts)


def elements_of(system: HybridSystem) -> list[Element]:
    """The elements of all arrays, in the order of their states, which are the last."""
    return [element for contact in system.contacts for element in contact.elements]


def acting(system: HybridSystem) -> list[tuple[int, int]]:
    """Driven states and contacts whose forces act on them: where W may be other than zero."""
    if not system.inertia:
        return sorted(system.W.todok())
    group = {i: block for block in blocks(len(system.driven), system.inertia) for i in block}
    return sorted({(i, c) for row, c in system.W.todok() for i in group[row]})


def joined(system: HybridSystem) -> list[tuple[int, int]]:
    """Pairs of contacts of which the second acts on the rate of the first: where G may be other than zero."""
    if not system.inertia:
        return sorted(system.G.todok())
    on: dict[int, list[int]] = {}
    for i, c in acting(system):
        on.setdefault(i, []).append(c)
    return sorted({(c, e) for i, c in system.W.todok() for e in on[i]})


def only_parameters(expressions: Iterable[sympy.Expr]) -> bool:
    """Whether expressions are free of states, inputs and time."""
    return all(isinstance(symbol, Parameter) for expression in expressions for symbol in expression.free_symbols)
