"""From a declaration to the one factored form that code is generated from."""

import dataclasses
from collections.abc import Iterable
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.automaton import Automaton
from fmu_models.language.contact_dynamics import ContactDynamics, Rates
from fmu_models.language.declaration import Output
from fmu_models.language.inertia import Entries, mass_entries
from fmu_models.language.maps import Map
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Acceleration, per_second
from fmu_models.lowering.energy import derived_outputs, quadratic_energy
from fmu_models.lowering.filippov import lower_automaton
from fmu_models.lowering.hybrid_system import HybridSystem
from fmu_models.lowering.iterated import iterated
from fmu_models.lowering.lagrange import TimeDerivative, generalised_forces, has_small_inverse, inverse


def lower(model: Mechanism | Automaton | Map) -> HybridSystem:
    """Derive accelerations, slip and stick dynamics of a mechanism, the sliding of an automaton, or steps of a map."""
    if isinstance(model, Map):
        return iterated(model)
    if isinstance(model, Automaton):
        return lower_automaton(model)
    coordinates = tuple(model.coordinates)
    held = [pair for c in model.contacts if c.driven for pair in zip(c.states, c.rates, strict=True)]
    index: dict[Any, int] = {x: i for i, x in enumerate((*(q.v for q in coordinates), *(z for z, _ in held)))}
    contacts: tuple[ContactDynamics, ...] = ()
    changes = {z: Acceleration._create(f"{z.name}_rate", per_second(z.unit), f"rate of {z.name}") for z, _ in held}
    rates = Rates(
        TimeDerivative(coordinates, model.all_inputs, with_accelerations=False),
        TimeDerivative(coordinates, model.all_inputs, with_accelerations=True, rates=changes),
    )
    for contact in model.contacts:
        contacts += contact.dynamics(rates, len(contacts))
    levers = [
        {index[v]: sympy.diff(c.slip, v) for v in c.slip.free_symbols if v in index and not c.kind.cone}
        for c in contacts
    ]
    mass = {**mass_entries(model), **{(i, i): sympy.S.One for i in range(len(coordinates), len(index))}}
    a, W, G, inertia = _solved(mass, [*generalised_forces(model), *(rate for _, rate in held)], levers)
    carried = [{index[z]: rate for z, rate in c.carries.items()} for c in contacts]
    if any(carried):
        if inertia:
            raise StickslipError(
                f"{model.name}: its mass matrix is too large to stand beside a play before a law without "
                "sliders. Put sliders behind the play, or take fewer coordinates."
            )
        W = _summed([*W.items(), *(((i, c), rate) for c, row in enumerate(carried) for i, rate in row.items())])
        by_state = [{c: row[i] for c, row in enumerate(carried) if i in row} for i in range(len(index))]
        G = _summed([*G.items(), *_times_rows(levers, by_state).items()])
    # the states of arrays come last
    inner = sorted((c for c in model.contacts if not c.driven), key=lambda c: bool(c.array))
    return HybridSystem.of(
        model,
        coordinates=coordinates,
        driven=tuple(index),
        rate_symbols=(*(q.a for q in coordinates), *changes.values()),
        internal_states=tuple(state for contact in inner for state in contact.states),
        acceleration=tuple(a),
        W=sympy.ImmutableSparseMatrix(len(index), len(contacts), W),
        G=sympy.ImmutableSparseMatrix(len(contacts), len(contacts), G),
        inertia=inertia,
        contacts=contacts,
        internal_rates=tuple(rate for contact in inner for rate in contact.rates),
        kinetic_energy=quadratic_energy(model),
        outputs=(*_declared_outputs(model), *derived_outputs(model, contacts)),
    )


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
        ((i, k), entry * factor)
        for i, row in enumerate(left)
        for j, entry in row.items()
        for k, factor in right[j].items()
    )


def _summed(products: Iterable[tuple[tuple[int, int], Any]]) -> Entries:
    """Sums of the parts of each entry, without those that vanish."""
    by_entry: dict[tuple[int, int], list[Any]] = {}
    for index, term in products:
        by_entry.setdefault(index, []).append(term)
    sums = {index: sympy.Add(*terms) for index, terms in by_entry.items()}
    return {index: total for index, total in sums.items() if total != 0}


def _declared_outputs(mechanism: Mechanism) -> tuple[Output, ...]:
    """Outputs with what contacts show written from the forces lambda."""
    forces = {symbol: force for contact in mechanism.contacts for symbol, force in contact.written.items()}
    return tuple(
        dataclasses.replace(o, expression=sympy.sympify(o.expression).xreplace(forces)) for o in mechanism.outputs
    )
