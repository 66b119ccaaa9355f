"""From a declared mechanism to the one factored form that code is generated from."""

from __future__ import annotations

import sympy

from fmu_models.language.contacts import Friction
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Parameter
from fmu_models.lowering.hybrid_system import ContactDynamics, HybridSystem
from fmu_models.lowering.lagrange import generalised_forces, inverse, mass_matrix, time_derivative


def lower(mechanism: Mechanism) -> HybridSystem:
    """Derive accelerations, slip and stick dynamics of a mechanism."""
    coordinates = tuple(mechanism.coordinates)
    velocities = [q.v for q in coordinates]
    compliance = inverse(mass_matrix(mechanism))
    jacobian = sympy.Matrix([[sympy.diff(c.slip, v) for v in velocities] for c in mechanism.contacts])
    jacobian = jacobian.reshape(len(mechanism.contacts), len(coordinates))
    W = compliance * jacobian.T
    G = jacobian * W
    return HybridSystem(
        name=mechanism.name,
        title=mechanism.title,
        source=mechanism.source,
        parameters=mechanism.parameters,
        inputs=mechanism.inputs,
        coordinates=coordinates,
        driven=tuple(velocities),
        rate_symbols=tuple(q.a for q in coordinates),
        internal_states=mechanism.internal_states,
        acceleration=tuple(compliance * generalised_forces(mechanism)),
        W=W.as_immutable(),
        G=G.as_immutable(),
        constant_inertia=_only_parameters(W) and _only_parameters(G),
        contacts=tuple(_contact_dynamics(contact, mechanism) for contact in mechanism.contacts),
        internal_rates=tuple(
            rate for contact in mechanism.contacts for rate in contact.law.rates(contact.slip_speed, contact.sign)
        ),
        outputs=tuple(mechanism.outputs),
        all_requirements=mechanism.all_requirements,
    )


def _contact_dynamics(contact: Friction, mechanism: Mechanism) -> ContactDynamics:
    return ContactDynamics(
        name=contact.name,
        description=contact.description,
        kind="friction",
        slip=contact.slip,
        slip_rate=time_derivative(contact.slip, mechanism.coordinates, mechanism.inputs, with_accelerations=True),
        slip_terms=sympy.Add.make_args(sympy.expand(contact.slip)),
        capacity=sympy.sympify(contact.law.capacity),
        force=contact.law.force(contact.slip_speed, contact.sign),
        sticks=contact.law.sticks,
        force_symbol=contact.force,
        slip_symbol=contact.slip_speed,
        sign_symbol=contact.sign,
    )


def _only_parameters(matrix: sympy.Matrix) -> bool:
    return all(isinstance(symbol, Parameter) for symbol in matrix.free_symbols)
