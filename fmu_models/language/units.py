"""Units of a declaration: every sum adds like to like, and energies, forces and outputs are what they say."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy

from fmu_models.language.contacts import FORCE_UNITS, Friction
from fmu_models.language.declaration import Body
from fmu_models.language.dimensions import Dimensions, way_unit
from fmu_models.language.impacts import Impact
from fmu_models.language.quantities import Quantity, per_second
from fmu_models.language.stops import Stop


def check_units(mechanism: Body) -> None:
    """Refuse a mechanism whose units do not match.

    Raises:
        StickslipError: which expression, and what does not match in it.
    """
    units = Dimensions(mechanism.name, mechanism.coordinates)
    units.expect("the kinetic energy", mechanism.kinetic_energy, "J")
    units.expect("the potential energy", mechanism.potential_energy, "J")
    units.expect("the dissipation", mechanism.dissipation, "W")
    for q, force in mechanism.applied.items():
        work = None if force == 0 else units.expect(f"the force on {q.name}", force, None)
        if work is not None:
            units.match(f"the force on {q.name} times its velocity", units.times(work, units.of_unit(q.v.unit)), "W")
    for contact in mechanism.contacts:
        if isinstance(contact, Friction):
            _check_friction(units, contact)
        elif isinstance(contact, Impact):
            _check_impact(units, contact)
        else:
            _check_stop(units, contact)
    for output in mechanism.outputs:
        units.expect(f"output '{output.name}'", output.expression, output.unit)


def check_expression_units(
    model: str, states: Sequence[Quantity], expected: Iterable[tuple[str, sympy.Expr, str]]
) -> None:
    """Refuse a model without a body in which an expression, given with what it is, has another unit than it should.

    Raises:
        StickslipError: which expression, and what does not match in it.
    """
    units = Dimensions(model, states)
    for what, expression, unit in expected:
        units.expect(what, expression, unit)


def _check_friction(units: Dimensions, contact: Friction) -> None:
    slip = units.expect(f"the slip of contact '{contact.name}'", contact.slip, None)
    units.known[contact.slip_speed] = slip
    what = f"the law of contact '{contact.name}'"
    force = units.expect(what, contact.law.force(contact.slip_speed, contact.sign), None)
    if force is not None and slip is not None:
        units.match(f"slip times force of contact '{contact.name}'", units.times(force, slip), "W")
    if slip is not None:
        for bound in dict.fromkeys((contact.law.capacity, contact.law.capacity_minus)):
            most = units.expect(f"what contact '{contact.name}' holds in stick", bound, None)
            if most is not None:
                units.match(f"slip times what contact '{contact.name}' holds", units.times(most, slip), "W")
    units.known[contact.force] = force
    for state, rate in zip(contact.law.states, contact.law.rates(contact.slip_speed, contact.sign), strict=True):
        per_second = units.times(units.of_unit(state.unit), units.of_unit("1/s"))
        units.compare(f"the rate of {state.name}", units.expect(f"the rate of {state.name}", rate, None), per_second)
    if contact.where is not None:
        units.expect(f"the region of contact '{contact.name}'", contact.where, None)


def _check_stop(units: Dimensions, stop: Stop) -> None:
    depth = units.expect(f"the gap of stop '{stop.name}'", stop.gap, None)
    rate = None if depth is None else units.times(depth, units.of_unit("1/s"))
    units.known |= {stop.penetration: depth, stop.rate: rate, stop.memory: rate}
    force = units.expect(f"the law of stop '{stop.name}'", stop.compression, None)
    if force is not None and depth is not None:
        units.match(f"gap times force of stop '{stop.name}'", units.times(force, depth), "J")
    units.known[stop.force] = force


def _check_impact(units: Dimensions, contact: Impact) -> None:
    way = "1" if units.scaled else "rad" if way_unit(contact.gap) == "rad" else "m"
    units.expect(f"the gap of contact '{contact.name}'", contact.gap, way)
    if contact.slip is not None:
        units.expect(f"the slip of contact '{contact.name}'", contact.slip, per_second(way))
    units.expect(f"the restitution of contact '{contact.name}'", contact.e, "1")
    units.expect(f"mu of contact '{contact.name}'", contact.friction, "1")
    for force in contact.shown:
        units.known[force] = units.of_unit(FORCE_UNITS[way])
