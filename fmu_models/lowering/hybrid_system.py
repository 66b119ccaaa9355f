"""What every declaration is lowered to: one system in factored form.

    q' = v
    v' = a + W lambda               a acceleration without contact forces, lambda contact forces
    z' = internal_rates             internal states of the laws
    y  = slip                       slip speed of each contact
    y' = slip_rate + G lambda       slip_rate without contact forces; G = J W, J = dy/dv

A contact slips (lambda = force), sticks (lambda keeps y' = 0 while |lambda| < capacity) or is away (lambda = 0).
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy

from fmu_models.language.contacts import ContactSymbol, Requirement
from fmu_models.language.mechanism import Output
from fmu_models.language.quantities import Coordinate, Input, InternalState, Parameter, State, Velocity


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactDynamics:
    """One friction contact.

    Attributes:
        name, description: as declared.
        slip: slip speed, m/s, from states, inputs and time.
        slip_rate: its rate without contact forces, m/s2; may use accelerations ``Coordinate.a``, which then stand for
            the accelerations without contact forces, and ``Input.rate``.
        slip_terms: the terms of which slip is the sum.
        capacity: largest force in stick, N.
        force: force law, N, from ``slip_symbol`` and ``sign_symbol`` besides states and inputs.
        sticks: whether it can stick.
        force_symbol, slip_symbol, sign_symbol: what outputs and laws call its force, slip speed and sign of slip.
    """

    name: str
    description: str
    slip: sympy.Expr
    slip_rate: sympy.Expr
    slip_terms: tuple[sympy.Expr, ...]
    capacity: sympy.Expr
    force: sympy.Expr
    sticks: bool
    force_symbol: ContactSymbol
    slip_symbol: ContactSymbol
    sign_symbol: ContactSymbol


@dataclass(frozen=True, eq=False, kw_only=True)
class HybridSystem:
    """A lowered mechanism; the equations are at the head of the module.

    Attributes:
        name, title, source: as declared.
        parameters, inputs, coordinates, internal_states, outputs: in the order of the FMU's variables.
        acceleration: a, one per coordinate.
        W: (n_coordinates, n_contacts), acceleration per contact force.
        G: (n_contacts, n_contacts), rate of slip speed per contact force.
        constant_inertia: W and G depend on parameters alone.
        contacts: the contacts.
        internal_rates: one per internal state.
        all_requirements: what the parameters must satisfy beside their own bounds.
    """

    name: str
    title: str
    source: str
    parameters: tuple[Parameter, ...]
    inputs: tuple[Input, ...]
    coordinates: tuple[Coordinate, ...]
    internal_states: tuple[InternalState, ...]
    acceleration: tuple[sympy.Expr, ...]
    W: sympy.ImmutableDenseMatrix
    G: sympy.ImmutableDenseMatrix
    constant_inertia: bool
    contacts: tuple[ContactDynamics, ...]
    internal_rates: tuple[sympy.Expr, ...]
    outputs: tuple[Output, ...]
    all_requirements: tuple[Requirement, ...]

    @property
    def velocities(self) -> tuple[Velocity, ...]:
        """Velocities, one per coordinate."""
        return tuple(q.v for q in self.coordinates)

    @property
    def states(self) -> tuple[State, ...]:
        """Continuous states: coordinates, then velocities, then internal states."""
        return (*self.coordinates, *self.velocities, *self.internal_states)
