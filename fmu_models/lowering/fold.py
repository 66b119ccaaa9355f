"""A lowered system with some of its quantities fixed: what is known becomes a number in every expression.

Parameters and inputs that have a value vanish (an input with its rate, which is zero), SymPy adds and multiplies what
is left of the expressions, and code is generated for the rest: a term with the factor 0 costs nothing any more, and
a sum of constants is one constant.
"""

import dataclasses
from collections.abc import Callable, Collection, Mapping
from typing import Any

import sympy

from fmu_models.language.contact_dynamics import ContactDynamics, Element
from fmu_models.lowering.hybrid_system import HybridSystem

# beyond it a float is whole because it has no digits left, not because somebody meant a whole number
_WHOLE = 2.0**53


def fold(
    system: HybridSystem,
    *,
    fixed: Mapping[str, float],
    values: Mapping[str, float],
    start: Mapping[str, float],
    outputs: Collection[str],
) -> HybridSystem:
    """The system with constants folded and only some of its outputs.

    Args:
        fixed: values of parameters and inputs that become constants of the code, in the unit of each.
        values: of the other parameters and inputs, as their start values.
        start: start values of states.
        outputs: names of those to keep, with the states of contacts that are to be among them.

    Returns:
        A system of the same states and contacts.
    """
    constants: dict[sympy.Basic, Any] = {}
    for quantity in (*system.parameters, *system.inputs):
        if quantity.name in fixed:
            constants[quantity] = number(fixed[quantity.name])
    constants |= {u.rate: sympy.S.Zero for u in system.inputs if u in constants}

    def folded(expression: sympy.Basic) -> sympy.Basic:
        return sympy.sympify(expression).xreplace(constants)

    requirements = (r._replace(expression=folded(r.expression)) for r in system.all_requirements)
    return dataclasses.replace(
        system,
        parameters=tuple(p.with_value(values.get(p.name, p.value)) for p in system.parameters if p not in constants),
        inputs=tuple(u.with_value(values.get(u.name, u.value)) for u in system.inputs if u not in constants),
        signals=tuple(signal.folded(folded) for signal in system.signals),
        coordinates=tuple(q.with_start(start.get(q.name, q.start)) for q in system.coordinates),
        driven=tuple(v.with_start(start.get(v.name, v.start)) for v in system.driven),
        internal_states=tuple(z.with_start(start.get(z.name, z.start)) for z in system.internal_states),
        acceleration=tuple(folded(a) for a in system.acceleration),
        W=system.W.xreplace(constants),
        G=system.G.xreplace(constants),
        inertia={index: folded(entry) for index, entry in system.inertia.items()},
        contacts=tuple(_folded_contact(contact, folded) for contact in system.contacts),
        internal_rates=tuple(folded(rate) for rate in system.internal_rates),
        rule={state: folded(after) for state, after in system.rule.items()},
        kinetic_energy=folded(system.kinetic_energy),
        outputs=tuple(
            dataclasses.replace(o, expression=folded(o.expression)) for o in system.outputs if o.name in outputs
        ),
        exposed=frozenset(outputs),
        # the others hold already: values are checked before they are folded
        all_requirements=tuple(r for r in requirements if sympy.sympify(r.expression).free_symbols),
    )


def number(value: float) -> sympy.Expr:
    """A value for expressions: whole numbers exactly, so that factors 0 and 1 vanish; others in double precision."""
    return sympy.Integer(int(value)) if value.is_integer() and abs(value) < _WHOLE else sympy.Float(value)


def _folded_contact(contact: ContactDynamics, folded: Callable[[sympy.Basic], sympy.Basic]) -> ContactDynamics:
    parts: dict[str, Any] = {name: value for name, value in vars(contact).items() if isinstance(value, sympy.Basic)}
    return dataclasses.replace(
        contact,
        **{name: folded(value) for name, value in parts.items()},
        slip_terms=tuple(map(folded, contact.slip_terms)),
        depth_terms=tuple(map(folded, contact.depth_terms)),
        elements=tuple(Element(e.state, folded(e.stiffness), folded(e.bound)) for e in contact.elements),
        reset={state: folded(value) for state, value in contact.reset.items()},
    )
