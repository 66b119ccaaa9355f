"""What every mechanism shows beside its own outputs: its energy, what changes it, and the forces of its contacts.

    E = T + U
    E' = power_input - power_dissipated - power_stops

With y = J v + b for each contact (b the part that drives prescribe) and T = T2 + T1 + T0 by its degree in v:

    power_input       v Q + dU/dt - dT/dt + (T1 + 2 T0)' - sum lambda b      (d/dt: explicit time and inputs)
    power_dissipated  v dD/dv - sum of lambda y over the friction contacts
    power_stops       -sum of lambda y over the stops, that is F d'

A closed rigid contact does no work in its normal direction, where y = 0; its b is the speed of a moving wall, its
friction counts as friction. In an impact E jumps by what no power shows: the work that the event reports, and that of
moving walls.

The terms of T come from d(v dT/dv - T)/dt = v (dU/dq + forces) - dT/dt; they vanish for a kinetic energy that is
quadratic in v and does not know the time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy

from fmu_models.language.declaration import Output
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME
from fmu_models.lowering.hybrid_system import ContactDynamics
from fmu_models.lowering.lagrange import time_derivative


def derived_outputs(mechanism: Mechanism, contacts: Sequence[ContactDynamics]) -> tuple[Output, ...]:
    """Energy, powers and contact forces of a mechanism with these contacts."""
    coordinates = mechanism.coordinates
    velocities = [q.v for q in coordinates]
    T, U = mechanism.kinetic_energy, mechanism.potential_energy
    at_rest = dict.fromkeys(velocities, sympy.S.Zero)
    constant, linear = _lower_degrees(mechanism)
    frame = sympy.expand(linear + 2 * constant)
    supplied = sum((force * q.v for q, force in mechanism.applied.items()), sympy.S.Zero)
    supplied += _explicit_rate(U, mechanism) - _explicit_rate(T, mechanism)
    supplied += time_derivative(frame, coordinates, mechanism.inputs, with_accelerations=True)
    lost = sum((v * sympy.diff(mechanism.dissipation, v) for v in velocities), sympy.S.Zero)
    stored = sympy.S.Zero
    for contact in contacts:
        supplied -= contact.force_symbol * sympy.expand(contact.slip).xreplace(at_rest)
        power = -contact.force_symbol * contact.slip_symbol
        if contact.kind == "stop":
            stored += power
        elif contact.kind != "impact":
            lost += power
    outputs = [
        Output("energy", T + U, "J", "kinetic and potential energy"),
        Output("power_input", supplied, "W", "power that applied forces, moving supports and drives supply"),
        Output("power_dissipated", lost, "W", "power that dashpots and friction take"),
    ]
    if any(contact.kind == "stop" for contact in contacts):
        outputs.append(Output("power_stops", stored, "W", "power that goes into stops"))
    return (*outputs, *(_force(contact) for contact in contacts))


def quadratic_energy(mechanism: Mechanism) -> sympy.Expr:
    """T2, the part of the kinetic energy that is quadratic in the velocities."""
    constant, linear = _lower_degrees(mechanism)
    if constant == 0 and linear == 0:
        return mechanism.kinetic_energy
    return sympy.expand(mechanism.kinetic_energy - constant - linear)


def _lower_degrees(mechanism: Mechanism) -> tuple[Any, Any]:
    """T0 and T1, the parts without velocities and linear in them."""
    T, velocities = mechanism.kinetic_energy, [q.v for q in mechanism.coordinates]
    at_rest = dict.fromkeys(velocities, sympy.S.Zero)
    linear = sum((v * sympy.diff(T, v).xreplace(at_rest) for v in velocities), sympy.S.Zero)
    return T.xreplace(at_rest), linear


def _force(contact: ContactDynamics) -> Output:
    what = contact.description or contact.name
    normal = contact.kind in ("stop", "impact")
    kind = "compressive force" if normal else "friction force, positive with the slip"
    force = contact.force_symbol if contact.kind == "impact" else -contact.force_symbol
    return Output(f"{contact.name}_force", force, contact.force_symbol.unit, f"{kind}: {what}")


def _explicit_rate(expression: sympy.Expr, mechanism: Mechanism) -> sympy.Expr:
    """Rate of an expression while the coordinates and velocities stay."""
    return sympy.diff(expression, TIME) + sum(
        (sympy.diff(expression, u) * u.rate for u in mechanism.inputs), sympy.S.Zero
    )
