"""What the parameters and inputs of a declaration do, read from where they stand in it.

A parameter in the potential energy is a stiffness if the energy is curved by it, else a field; one in the dissipation
is a damping, one in the kinetic energy an inertia. In forces, gaps and flows the factor of a function of time is an
amplitude, the factor of the time in it a frequency; what is left of a gap is its width. The fields of a law say what
its parameters are. A scaled model has the same roles, though all its units are "1".
"""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy

from fmu_models.language.automaton import Automaton
from fmu_models.language.contacts import Contact
from fmu_models.language.impacts import Impact
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Parameter

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Model = Mechanism | Automaton

# by the name of a field of a law
_FIELDS = {
    "k": "stiffness",
    "sigma0": "stiffness",
    "c": "damping",
    "sigma1": "damping",
    "mu_v": "damping",
    "p": "steepness",
    "N": "load",
    "a0": "load",
    "mu": "friction",
    "mu_s": "friction",
    "mu_k": "friction",
    "restitution": "restitution",
}


@dataclass(frozen=True)
class ParameterRole:
    """One quantity: its name, what it does, and the kind of contact that it belongs to ("body" if to none)."""

    name: str
    does: str
    of: str


def roles(model: Model) -> tuple[ParameterRole, ...]:
    """The roles of all parameters and inputs that have one, each once."""
    roles_by_name: dict[str, ParameterRole] = {}
    for role in _all_roles(model):
        roles_by_name.setdefault(role.name, role)
    return tuple(roles_by_name.values())


def _all_roles(model: Model) -> Iterator[ParameterRole]:
    if isinstance(model, Automaton):
        for switch in model.switches:
            yield from _of_expression(switch.function, model.states, "switch", "gap")
        for flow in model.flows.values():
            yield from _of_expression(flow, model.states, "body", "rate")
        yield from (ParameterRole(u.name, "drive", "switch") for u in model.inputs)
        return
    for contact in model.contacts:
        kind = _kind(contact)
        if isinstance(contact, Impact):
            yield from _of_value(contact.restitution.e, "restitution", kind)
            yield from _of_value(contact.mu, "friction", kind)
            yield from _of_expression(contact.gap, model.coordinates, kind, "gap")
            continue
        yield from _of_law(contact.rule, kind)
        if contact.place is not None:
            yield from _of_expression(sympy.sympify(contact.place), model.coordinates, kind, "gap")
    yield from _of_body(model)
    yield from (ParameterRole(u.name, "drive", "friction" if model.frictions else "body") for u in model.inputs)


def _of_body(model: Mechanism) -> Iterator[ParameterRole]:
    velocities = [q.v for q in model.coordinates]
    for symbol in _parameters(sympy.sympify(model.kinetic_energy)):
        if not any(symbol in sympy.sympify(c.place).free_symbols for c in model.impacts):
            yield ParameterRole(symbol.name, "inertia", "body")
    yield from (ParameterRole(s.name, "damping", "body") for s in _parameters(model.dissipation))
    curvature = sympy.hessian(model.potential_energy, list(model.coordinates))
    yield from (ParameterRole(s.name, "stiffness", "body") for s in _parameters(curvature))
    yield from _of_expression(model.potential_energy, (*model.coordinates, *velocities), "body", "field")
    for force in model.applied.values():
        yield from _of_expression(force, (*model.coordinates, *velocities), "body", "field")


def _kind(contact: Contact) -> str:
    return "friction" if contact.kind.rubs else "impact" if contact.kind.rigid else "stop"


def _of_value(value: object, does: str, kind: str) -> Iterator[ParameterRole]:
    if isinstance(value, Parameter):
        yield ParameterRole(value.name, does, kind)


def _of_law(law: "DataclassInstance | type[DataclassInstance]", kind: str) -> Iterator[ParameterRole]:
    for field in dataclasses.fields(law):
        value = getattr(law, field.name)
        if isinstance(value, Parameter):
            yield ParameterRole(value.name, _FIELDS.get(field.name, "law"), kind)
        elif dataclasses.is_dataclass(value):
            yield from _of_law(value, kind)


def _of_expression(
    expression: sympy.Expr, states: Sequence[sympy.Symbol], kind: str, default_role: str
) -> Iterator[ParameterRole]:
    """Amplitudes and frequencies of functions of time; ``rest`` are parameters that no state is multiplied by."""
    for term in sympy.Add.make_args(sympy.expand(expression)):
        waves = [f for f in term.atoms(sympy.Function) if f.has(TIME)]
        within = set().union(*(wave.free_symbols for wave in waves)) if waves else set()
        for symbol in _parameters(term):
            if symbol in within:
                if any(sympy.diff(wave.args[0], TIME).has(symbol) for wave in waves):
                    yield ParameterRole(symbol.name, "frequency", kind)
            elif waves:
                yield ParameterRole(symbol.name, "amplitude", kind)
            elif term.has(*states):
                if kind == "body":
                    yield ParameterRole(symbol.name, _with_states(term, states, flow=default_role == "rate"), kind)
            else:
                yield ParameterRole(symbol.name, "field" if default_role == "rate" else default_role, kind)


def _with_states(term: sympy.Expr, states: Sequence[sympy.Symbol], *, flow: bool) -> str:
    """What a factor of states does: a rate in a flow; in an energy a stiffness, or a field if it is linear."""
    if flow:
        return "rate"
    curved = any(sympy.diff(term, a, b) != 0 for a in states for b in states)
    return "stiffness" if curved else "field"


def _parameters(expression: sympy.Basic | sympy.MatrixBase) -> list[Parameter]:
    return sorted((s for s in expression.free_symbols if isinstance(s, Parameter)), key=lambda s: s.declared)
