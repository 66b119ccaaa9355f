"""From a declaration to the one factored form that code is generated from."""

from __future__ import annotations

import dataclasses

import sympy

from fmu_models.language.automaton import Automaton
from fmu_models.language.contacts import Friction
from fmu_models.language.declaration import Contact, Output
from fmu_models.language.impacts import Impact, Poisson
from fmu_models.language.inertia import mass_matrix
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.stops import Stop
from fmu_models.lowering.energy import derived_outputs, quadratic_energy
from fmu_models.lowering.filippov import lower_automaton
from fmu_models.lowering.hybrid_system import ContactDynamics, HybridSystem, only_parameters, terms
from fmu_models.lowering.lagrange import generalised_forces, inverse, time_derivative


def lower(model: Mechanism | Automaton) -> HybridSystem:
    """Derive accelerations, slip and stick dynamics of a mechanism, or the sliding of an automaton."""
    if isinstance(model, Automaton):
        return lower_automaton(model)
    coordinates = tuple(model.coordinates)
    velocities = [q.v for q in coordinates]
    contacts: tuple[ContactDynamics, ...] = ()
    for contact in model.contacts:
        contacts += _contact_dynamics(contact, model, len(contacts))
    compliance = inverse(mass_matrix(model))
    jacobian = sympy.Matrix([[sympy.diff(c.slip, v) for v in velocities] for c in contacts])
    jacobian = jacobian.reshape(len(contacts), len(coordinates))
    W = compliance * jacobian.T
    G = jacobian * W
    return HybridSystem(
        name=model.name,
        title=model.title,
        source=model.source,
        parameters=model.parameters,
        inputs=model.inputs,
        coordinates=coordinates,
        driven=tuple(velocities),
        rate_symbols=tuple(q.a for q in coordinates),
        internal_states=model.internal_states,
        acceleration=tuple(compliance * generalised_forces(model)),
        W=W.as_immutable(),
        G=G.as_immutable(),
        constant_inertia=only_parameters(W) and only_parameters(G),
        contacts=contacts,
        internal_rates=tuple(
            rate for contact in model.frictions for rate in contact.law.rates(contact.slip_speed, contact.sign)
        ),
        kinetic_energy=quadratic_energy(model),
        outputs=(*_declared_outputs(model), *derived_outputs(model, contacts)),
        all_requirements=model.all_requirements,
    )


def _declared_outputs(mechanism: Mechanism) -> tuple[Output, ...]:
    """Outputs with the compressive force of a stop written as what it is, the opposite of lambda."""
    forces = {stop.force: -stop.reaction for stop in mechanism.contacts if isinstance(stop, Stop)}
    return tuple(
        dataclasses.replace(o, expression=sympy.sympify(o.expression).xreplace(forces)) for o in mechanism.outputs
    )


def _contact_dynamics(contact: Contact, mechanism: Mechanism, index: int) -> tuple[ContactDynamics, ...]:
    """What a contact is lowered to, to stand at ``index`` among the contacts of the system."""
    if isinstance(contact, Friction):
        return (_friction(contact, mechanism),)
    if isinstance(contact, Stop):
        return (_stop(contact, mechanism),)
    if contact.slip is None:
        return (_impact(contact, mechanism, partner=None),)
    slip = sympy.sympify(contact.slip)
    return (
        _impact(contact, mechanism, partner=index + 1),
        _impact_friction(contact, slip, mechanism, partner=index),
    )


def _friction(contact: Friction, mechanism: Mechanism) -> ContactDynamics:
    where = None if contact.where is None else sympy.sympify(contact.where)
    return ContactDynamics(
        name=contact.name,
        description=contact.description,
        kind="friction",
        slip=contact.slip,
        slip_rate=time_derivative(contact.slip, mechanism.coordinates, mechanism.inputs, with_accelerations=True),
        slip_terms=terms(contact.slip),
        capacity=sympy.sympify(contact.law.capacity),
        force=contact.law.force(contact.slip_speed, contact.sign),
        sticks=contact.law.sticks,
        depth=where,
        depth_terms=() if where is None else terms(where),
        force_symbol=contact.force,
        slip_symbol=contact.slip_speed,
        sign_symbol=contact.sign,
    )


def _stop(stop: Stop, mechanism: Mechanism) -> ContactDynamics:
    body = mechanism.coordinates, mechanism.inputs
    rate = time_derivative(stop.depth, *body, with_accelerations=False)
    release = stop.law.release(stop.penetration, stop.rate, stop.memory)
    return ContactDynamics(
        name=stop.name,
        description=stop.description,
        kind="stop",
        slip=rate,
        slip_rate=time_derivative(rate, *body, with_accelerations=True),
        slip_terms=terms(rate),
        capacity=sympy.S.Zero,
        force=-stop.compression,
        sticks=False,
        depth=stop.depth,
        depth_terms=terms(stop.depth),
        release=sympy.sympify(release) if stop.release == "force" else None,
        remembers=stop.law.remembers,
        rooted=stop.rooted,
        force_symbol=stop.reaction,
        slip_symbol=stop.rate,
        sign_symbol=stop.sign,
        depth_symbol=stop.penetration,
        memory_symbol=stop.memory,
    )


def _impact(impact: Impact, mechanism: Mechanism, partner: int | None) -> ContactDynamics:
    """The normal direction; lambda acts along the growing gap."""
    body = mechanism.coordinates, mechanism.inputs
    rate = time_derivative(sympy.sympify(impact.gap), *body, with_accelerations=False)
    return ContactDynamics(
        name=impact.name,
        description=impact.description,
        kind="impact",
        slip=rate,
        slip_rate=time_derivative(rate, *body, with_accelerations=True),
        slip_terms=terms(rate),
        capacity=sympy.S.Zero,
        force=sympy.S.Zero,
        sticks=False,
        depth=impact.depth,
        depth_terms=terms(impact.depth),
        partner=partner,
        restitution=impact.e,
        poisson=isinstance(impact.restitution, Poisson),
        force_symbol=impact.force,
        slip_symbol=impact.rate,
        sign_symbol=impact.sign,
    )


def _impact_friction(impact: Impact, slip: sympy.Expr, mechanism: Mechanism, partner: int) -> ContactDynamics:
    return ContactDynamics(
        name=f"{impact.name}_friction",
        description=impact.description,
        kind="impact_friction",
        slip=slip,
        slip_rate=time_derivative(slip, mechanism.coordinates, mechanism.inputs, with_accelerations=True),
        slip_terms=terms(slip),
        capacity=sympy.S.Zero,
        force=sympy.S.Zero,
        sticks=True,
        partner=partner,
        friction=impact.friction,
        force_symbol=impact.friction_force,
        slip_symbol=impact.friction_slip,
        sign_symbol=impact.friction_sign,
    )
