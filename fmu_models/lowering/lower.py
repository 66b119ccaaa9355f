"""From a declaration to the one factored form that code is generated from."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any, NamedTuple

import sympy

from fmu_models.language.automaton import Automaton
from fmu_models.language.contacts import Friction
from fmu_models.language.declaration import Contact, Output
from fmu_models.language.impacts import Impact, Poisson
from fmu_models.language.inertia import Entries, mass_entries
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.stops import Stop
from fmu_models.lowering.energy import derived_outputs, quadratic_energy
from fmu_models.lowering.filippov import lower_automaton
from fmu_models.lowering.hybrid_system import ContactDynamics, HybridSystem, only_parameters, terms
from fmu_models.lowering.lagrange import TimeDerivative, generalised_forces, has_small_inverse, inverse


def lower(model: Mechanism | Automaton) -> HybridSystem:
    """Derive accelerations, slip and stick dynamics of a mechanism, or the sliding of an automaton."""
    if isinstance(model, Automaton):
        return lower_automaton(model)
    coordinates = tuple(model.coordinates)
    place: dict[Any, int] = {q.v: i for i, q in enumerate(coordinates)}
    contacts: tuple[ContactDynamics, ...] = ()
    rates = _Rates(
        TimeDerivative(coordinates, model.inputs, with_accelerations=False),
        TimeDerivative(coordinates, model.inputs, with_accelerations=True),
    )
    for contact in model.contacts:
        contacts += _contact_dynamics(contact, rates, len(contacts))
    levers = [{place[v]: sympy.diff(c.slip, v) for v in c.slip.free_symbols if v in place} for c in contacts]
    a, W, G, inertia = _solved(mass_entries(model), generalised_forces(model), levers)
    return HybridSystem(
        name=model.name,
        title=model.title,
        source=model.source,
        parameters=model.parameters,
        inputs=model.inputs,
        coordinates=coordinates,
        driven=tuple(place),
        rate_symbols=tuple(q.a for q in coordinates),
        internal_states=model.internal_states,
        acceleration=tuple(a),
        W=sympy.ImmutableSparseMatrix(len(coordinates), len(contacts), W),
        G=sympy.ImmutableSparseMatrix(len(contacts), len(contacts), G),
        inertia=inertia,
        constant_inertia=only_parameters([*W.values(), *G.values(), *inertia.values()]),
        contacts=contacts,
        internal_rates=tuple(
            rate for contact in model.frictions for rate in contact.law.rates(contact.slip_speed, contact.sign)
        ),
        kinetic_energy=quadratic_energy(model),
        outputs=(*_declared_outputs(model), *derived_outputs(model, contacts)),
        all_requirements=model.all_requirements,
    )


class _Rates(NamedTuple):
    """Time derivatives of positions, and of speeds."""

    of_place: TimeDerivative
    of_speed: TimeDerivative


def _solved(
    mass: Entries, forces: list[Any], levers: list[dict[int, Any]]
) -> tuple[list[Any], Entries, Entries, Entries]:
    """a, W, G and M as a `HybridSystem` has them; ``levers``: d slip/dv of every contact."""
    n = len(forces)
    if not has_small_inverse(n, mass):
        return forces, {(i, c): lever for c, row in enumerate(levers) for i, lever in row.items()}, {}, mass
    rows: list[dict[int, Any]] = [{} for _ in range(n)]
    for (i, j), entry in inverse(n, mass).items():
        rows[j][i] = entry
    W = {(i, c): entry for (c, i), entry in _times_rows(levers, rows).items()}
    moved: list[dict[int, Any]] = [{} for _ in range(n)]
    for (i, c), entry in W.items():
        moved[i][c] = entry
    G = _times_rows(levers, moved)
    a = _summed(((i, 0), entry * forces[j]) for j in range(n) for i, entry in rows[j].items())
    return [a.get((i, 0), sympy.S.Zero) for i in range(n)], W, G, {}


def _times_rows(left: list[dict[int, Any]], right: list[dict[int, Any]]) -> Entries:
    """The product of two matrices, given row by row."""
    return _summed(
        ((i, k), entry * other)
        for i, row in enumerate(left)
        for j, entry in row.items()
        for k, other in right[j].items()
    )


def _summed(parts: Iterable[tuple[tuple[int, int], Any]]) -> Entries:
    """Sums of the parts of each entry, without those that vanish."""
    found: dict[tuple[int, int], list[Any]] = {}
    for place, part in parts:
        found.setdefault(place, []).append(part)
    sums = {place: sympy.Add(*terms) for place, terms in found.items()}
    return {place: total for place, total in sums.items() if total != 0}


def _declared_outputs(mechanism: Mechanism) -> tuple[Output, ...]:
    """Outputs with the compressive force of a stop written as what it is, the opposite of lambda."""
    forces = {stop.force: -stop.reaction for stop in mechanism.contacts if isinstance(stop, Stop)}
    return tuple(
        dataclasses.replace(o, expression=sympy.sympify(o.expression).xreplace(forces)) for o in mechanism.outputs
    )


def _contact_dynamics(contact: Contact, rates: _Rates, index: int) -> tuple[ContactDynamics, ...]:
    """What a contact is lowered to, to stand at ``index`` among the contacts of the system."""
    if isinstance(contact, Friction):
        return (_friction(contact, rates),)
    if isinstance(contact, Stop):
        return (_stop(contact, rates),)
    if contact.slip is None:
        return (_impact(contact, rates, partner=None),)
    slip = sympy.sympify(contact.slip)
    return (
        _impact(contact, rates, partner=index + 1),
        _impact_friction(contact, slip, rates, partner=index),
    )


def _friction(contact: Friction, rates: _Rates) -> ContactDynamics:
    where = None if contact.where is None else sympy.sympify(contact.where)
    minus = contact.law.capacity_minus
    return ContactDynamics(
        name=contact.name,
        description=contact.description,
        kind="friction",
        slip=contact.slip,
        slip_rate=rates.of_speed(sympy.sympify(contact.slip)),
        slip_terms=terms(contact.slip),
        capacity=sympy.sympify(contact.law.capacity),
        capacity_minus=None if minus == contact.law.capacity else sympy.sympify(minus),
        force=contact.law.force(contact.slip_speed, contact.sign),
        sticks=contact.law.sticks,
        reset=dict(contact.law.renewed),
        reset_sides=4 if contact.law.renewed else 0,
        depth=where,
        depth_terms=() if where is None else terms(where),
        force_symbol=contact.force,
        slip_symbol=contact.slip_speed,
        sign_symbol=contact.sign,
    )


def _stop(stop: Stop, rates: _Rates) -> ContactDynamics:
    rate = rates.of_place(stop.depth)
    release = stop.law.release(stop.penetration, stop.rate, stop.memory)
    return ContactDynamics(
        name=stop.name,
        description=stop.description,
        kind="stop",
        slip=rate,
        slip_rate=rates.of_speed(rate),
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


def _impact(impact: Impact, rates: _Rates, partner: int | None) -> ContactDynamics:
    """The normal direction; lambda acts along the growing gap."""
    rate = rates.of_place(sympy.sympify(impact.gap))
    return ContactDynamics(
        name=impact.name,
        description=impact.description,
        kind="impact",
        slip=rate,
        slip_rate=rates.of_speed(rate),
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


def _impact_friction(impact: Impact, slip: sympy.Expr, rates: _Rates, partner: int) -> ContactDynamics:
    return ContactDynamics(
        name=f"{impact.name}_friction",
        description=impact.description,
        kind="impact_friction",
        slip=slip,
        slip_rate=rates.of_speed(slip),
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
