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

from collections.abc import Sequence
from typing import Any

import sympy

from fmu_models.language.contact_dynamics import ContactDynamics, multiplied_out
from fmu_models.language.declaration import Output
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Velocity
from fmu_models.lowering.lagrange import TimeDerivative


def derived_outputs(mechanism: Mechanism, contacts: Sequence[ContactDynamics]) -> tuple[Output, ...]:
    """Energy, powers and contact forces of a mechanism with these contacts."""
    T: Any = mechanism.kinetic_energy
    U: Any = mechanism.potential_energy
    velocities = [q.v for q in mechanism.coordinates]
    at_rest = dict.fromkeys(velocities, sympy.S.Zero)
    standing: dict[sympy.Basic, Any] = {TIME: sympy.S.One}
    standing |= {u: u.rate for u in mechanism.all_inputs}
    along = Derivatives().along
    frame = multiplied_out(_linear(T, velocities) + 2 * T.xreplace(at_rest))
    moving = TimeDerivative(mechanism.coordinates, mechanism.all_inputs, with_accelerations=True)
    supplied = [force * q.v for q, force in mechanism.applied.items()]
    supplied += [along(U, standing), -along(T, standing), moving(frame)]
    lost = [along(mechanism.dissipation, {v: v for v in velocities})]
    stored, bodily = [], [contact for contact in contacts if not (contact.kind.surface or contact.kind.cone)]
    for force, speed in filter(None, (contact.steady for contact in mechanism.contacts)):
        supplied.append(-force * multiplied_out(speed).xreplace(at_rest))
        lost.append(-force * speed)
    for contact in bodily:
        driven = multiplied_out(contact.slip).xreplace(at_rest)
        supplied.append(-contact.force_symbol * driven)
        power = -contact.force_symbol * contact.slip_symbol
        if contact.kind.compliant:
            stored.append(power)
        elif not contact.kind.impulsive:
            lost.append(power)
    outputs = [
        Output("energy", T + U, "J", "kinetic and potential energy"),
        Output(
            "power_input", sympy.Add(*supplied), "W", "power that applied forces, moving supports and drives supply"
        ),
        Output("power_dissipated", sympy.Add(*lost), "W", "power that dashpots and friction take"),
    ]
    if any(contact.kind.compliant for contact in contacts):
        outputs.append(Output("power_stops", sympy.Add(*stored), "W", "power that goes into stops"))
    steady = [contact for contact in mechanism.contacts if contact.steady]
    outputs += [
        Output(f"{c.name}_force", c.written[c.force], c.force.unit, f"force with memory: {c.description or c.name}")
        for c in steady
    ]
    return (*outputs, *(_force(contact) for contact in bodily))


def quadratic_energy(mechanism: Mechanism) -> sympy.Expr:
    """T2, the part of the kinetic energy that is quadratic in the velocities."""
    T, velocities = mechanism.kinetic_energy, [q.v for q in mechanism.coordinates]
    constant, linear = T.xreplace(dict.fromkeys(velocities, sympy.S.Zero)), _linear(T, velocities)
    return T if constant == 0 and linear == 0 else multiplied_out(T - constant - linear)


def _force(contact: ContactDynamics) -> Output:
    name = contact.description or contact.name
    normal = contact.kind.normal
    kind = "compressive force" if normal else "friction force, positive with the slip"
    force = contact.force_symbol if contact.kind.impulsive else -contact.force_symbol
    return Output(f"{contact.name}_force", force, contact.force_symbol.unit, f"{kind}: {name}")


def _linear(T: sympy.Expr, velocities: Sequence[Velocity]) -> sympy.Expr:
    """The part of T that is linear in the velocities."""
    directions: dict[Any, Any] = {v: sympy.Dummy(v.name, real=True) for v in velocities}
    slope = Derivatives().along(T, directions).xreplace(dict.fromkeys(velocities, sympy.S.Zero))
    return slope.xreplace({direction: v for v, direction in directions.items()})
