"""One page about a model: equations as derived, parameters, contacts with their states, outputs, source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy

from fmu_models.codegen.lane_tables import lane_obstacles
from fmu_models.language.contact_kinds import INDICATORS
from fmu_models.language.inertia import mass_matrix
from fmu_models.language.mechanism import Mechanism
from fmu_models.lowering.equations import Line, of_contact, states_of
from fmu_models.lowering.lagrange import generalised_forces
from fmu_models.lowering.lower import lower
from fmu_models.lowering.piecewise_linear import obstacles

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fmu_models.language.contact_dynamics import ContactDynamics
    from fmu_models.language.contacts import Contact
    from fmu_models.lowering.hybrid_system import HybridSystem


def sheet(mechanism: Mechanism) -> dict[str, Any]:
    """The page as plain data, ready for JSON."""
    system = lower(mechanism)
    declared = {contact.name: contact for contact in mechanism.contacts}
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "source": mechanism.source,
        "equations": _equations(mechanism, system),
        "parameters": _listed(system.parameters, "name", "value", "unit", "description", "minimum", "maximum"),
        "inputs": _listed(system.inputs, "name", "value", "unit", "description"),
        "states": _listed(system.states, "name", "start", "unit", "description"),
        "contacts": [_contact(contact, declared.get(contact.name)) for contact in system.contacts],
        "outputs": [
            {"name": y.name, "expression": readable(y.expression), "unit": y.unit, "description": y.description}
            for y in system.outputs
        ],
        "requirements": [requirement.sentence for requirement in system.all_requirements],
        "exact_flow": _exact_flow(system),
    }


def _listed(quantities: Iterable[Any], *attributes: str) -> list[dict[str, Any]]:
    return [{name: getattr(quantity, name) for name in attributes} for quantity in quantities]


def _exact_flow(system: HybridSystem) -> dict[str, Any]:
    """Whether every mode is linear with constant coefficients, and whether strobes are made by its exact flow in lanes;
    why not."""
    reasons, lanes = obstacles(system), lane_obstacles(system)
    return {"linear": not reasons, "lanes": not lanes, "obstacles": list(reasons or lanes)}


def _contact(contact: ContactDynamics, declared: Contact | None) -> dict[str, Any]:
    """What a contact is made of, by its kind."""
    return {
        "name": contact.name,
        "kind": contact.kind.words,
        "description": contact.description,
        "law": _law(contact, declared),
        "equations": {name: _said(line) for name, line in of_contact(contact).items()},
        "states": states_of(contact),
        "indicators": [INDICATORS[indicator][1] for indicator in contact.indicators],
    }


def _law(contact: ContactDynamics, declared: Contact | None) -> str | None:
    if contact.kind.led:
        return "Coulomb"
    rule = getattr(declared, "rule", None)
    return None if rule is None else type(rule).__name__


def _said(line: Line) -> str:
    return "".join(token if isinstance(token, str) else readable(token) for token in line)


def readable(expression: sympy.Basic) -> str:
    """An expression in plain letters."""
    names = {symbol: sympy.Symbol(symbol.name) for symbol in expression.atoms(sympy.Dummy)}
    return sympy.sstr(expression.xreplace(names))


def _equations(mechanism: Mechanism, system: HybridSystem) -> list[str]:
    lines = [f"{q.name}' = {q.v.name}" for q in system.coordinates]
    forces = sympy.Matrix([sympy.Symbol(f"lambda_{contact.name}") for contact in system.contacts])
    if isinstance(mechanism, Mechanism) and not mass_matrix(mechanism).is_diagonal():
        lines += _coupled(mechanism, system, forces)
    else:
        by_contacts: Any = system.W * forces if system.contacts else sympy.zeros(len(system.driven), 1)
        for i, state in enumerate(system.driven):
            lines.append(f"{state.name}' = {readable(sympy.expand(system.acceleration[i]) + by_contacts[i])}")
    for state, rate in zip(system.internal_states, system.internal_rates, strict=True):
        lines.append(f"{state.name}' = {readable(rate)}")
    return [*lines, *(signal.shape for signal in system.signals)]


def _coupled(mechanism: Mechanism, system: HybridSystem, forces: sympy.Matrix) -> list[str]:
    """Mass matrix times accelerations = forces: solved, these would fill pages."""
    rates = sympy.Matrix([sympy.Symbol(f"{q.v.name}'") for q in mechanism.coordinates])
    inertia: Any = mass_matrix(mechanism) * rates
    free: Any = generalised_forces(mechanism)
    lines = []
    for i, q in enumerate(mechanism.coordinates):
        right: Any = sympy.expand(free[i])
        for c, contact in enumerate(system.contacts):
            right += sympy.S.Zero if contact.kind.cone else sympy.diff(contact.slip, q.v) * forces[c]
        lines.append(f"{readable(inertia[i])} = {readable(right)}")
    return lines
