"""What a declaration can get wrong, and the lesson each mistake is answered with."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import sympy

from fmu_models.errors import StickslipError
from fmu_models.language.contacts import ContactSymbol, Friction
from fmu_models.language.quantities import TIME, Acceleration, Coordinate, Input, Parameter, Rate

if TYPE_CHECKING:
    from fmu_models.language.mechanism import Mechanism

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def check_mechanism(mechanism: Mechanism) -> None:
    """Refuse a declaration that contradicts itself.

    Raises:
        StickslipError: where, what is wrong, and how it is written instead.
    """
    if not mechanism.coordinates:
        raise StickslipError(f"{mechanism.name} has no coordinate. A mechanism needs at least one.")
    _check_names(mechanism)
    _check_energies(mechanism)
    for contact in mechanism.contacts:
        _check_slip(contact, mechanism.coordinates)
    _check_symbols(mechanism)


def _check_names(mechanism: Mechanism) -> None:
    names = list(_names(mechanism))
    for name, _ in [*names, (mechanism.name, "mechanism")]:
        if not _IDENTIFIER.fullmatch(name):
            raise StickslipError(f"'{name}' is not a name: use a letter followed by letters, digits or underscores.")
    seen = {"time": "the time"}
    for name, owner in names:
        if name in seen:
            raise StickslipError(
                f"{mechanism.name}: '{name}' names both {seen[name]} and {owner}. Give every quantity its own name."
            )
        seen[name] = owner


def _names(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Every name that a user of the model will meet, with what it belongs to."""
    for parameter in mechanism.parameters:
        yield parameter.name, f"parameter '{parameter.description}'"
    for source in mechanism.inputs:
        yield source.name, f"input '{source.description}'"
        yield source.rate.name, f"the rate of input {source.name}"
    for q in mechanism.coordinates:
        yield q.name, f"coordinate '{q.description}'"
        yield q.v.name, f"the velocity of {q.name}"
    for state in mechanism.internal_states:
        yield state.name, f"internal state '{state.description}'"
    for output in mechanism.outputs:
        yield output.name, f"output '{output.description}'"
    for contact in mechanism.contacts:
        yield contact.name, f"contact '{contact.name}'"
        yield f"{contact.name}_state", f"the state of contact {contact.name}"


def _check_energies(mechanism: Mechanism) -> None:
    velocities = [q.v for q in mechanism.coordinates]
    if mechanism.potential_energy.has(*velocities):
        raise StickslipError(
            f"{mechanism.name}: the potential energy depends on a velocity. Write damping as dissipation=c*q.v**2/2."
        )
    for q in mechanism.applied:
        if q not in mechanism.coordinates:
            raise StickslipError(
                f"{mechanism.name}: a force is applied to '{q.name}', which is not a coordinate of it."
            )
    inertia = sympy.hessian(mechanism.kinetic_energy, velocities)
    if inertia.has(*velocities):
        raise StickslipError(
            f"{mechanism.name}: the kinetic energy is not quadratic in the velocities "
            f"({mechanism.kinetic_energy}). Write it as m*q.v**2/2."
        )
    for i, q in enumerate(mechanism.coordinates):
        if all(entry == 0 for entry in inertia.row(i)):
            raise StickslipError(
                f"coordinate '{q.name}' has no inertia: the kinetic energy does not contain its velocity. "
                f"Add its term, for example m*{q.name}.v**2/2."
            )
    if sympy.simplify(inertia.det()) == 0:
        raise StickslipError(
            f"{mechanism.name}: some motion of the coordinates has no kinetic energy (singular mass matrix). "
            "Give it inertia, or leave out a coordinate."
        )


def _check_slip(contact: Friction, coordinates: Sequence[Coordinate]) -> None:
    where = f"contact '{contact.name}': slip"
    slip = sympy.sympify(contact.slip)
    for q in coordinates:
        if slip.has(q.a):
            raise StickslipError(f"{where} depends on acceleration {q.a.name}; write it with {q.name}.v")
    velocities = [q.v for q in coordinates]
    if not slip.has(*velocities):
        raise StickslipError(
            f"{where} = {slip} is independent of every velocity, so friction could not act on anything; "
            f"write it with {coordinates[0].name}.v"
        )
    if any(entry.has(*velocities) for entry in sympy.Matrix([slip]).jacobian(velocities)):
        raise StickslipError(
            f"{where} = {slip} is not affine in the velocities; a slip speed is a difference of speeds such as "
            f"R*{coordinates[0].name}.v - v_belt"
        )


def _check_symbols(mechanism: Mechanism) -> None:
    """Every symbol is a quantity of this mechanism, used where it exists."""
    states = {s for q in mechanism.coordinates for s in (q, q.v)} | set(mechanism.internal_states) | {TIME}
    contacts = {contact.force for contact in mechanism.contacts}
    accelerations = {q.a for q in mechanism.coordinates}
    for symbol in sorted(mechanism.symbols, key=str):
        known = isinstance(symbol, (Parameter, Input)) or symbol in states | contacts | accelerations
        if not known:
            raise StickslipError(f"{mechanism.name}: {_stranger(symbol)}")
    body = (mechanism.kinetic_energy, mechanism.potential_energy, mechanism.dissipation, *mechanism.applied.values())
    for expression in body:
        for symbol in sorted(expression.free_symbols, key=str):
            if isinstance(symbol, (Acceleration, ContactSymbol)):
                raise StickslipError(f"{mechanism.name}: {symbol.name} is used in an energy; only outputs may use it.")
    for requirement in mechanism.all_requirements:
        if not all(isinstance(s, Parameter) for s in sympy.sympify(requirement.expression).free_symbols):
            raise StickslipError(f"{mechanism.name}: the requirement '{requirement.sentence}' may use parameters only.")


def _stranger(symbol: sympy.Basic) -> str:
    if isinstance(symbol, Rate):
        return f"{symbol} is used directly; rates of inputs enter by themselves."
    if isinstance(symbol, ContactSymbol):
        return f"{symbol} belongs to a contact that is not part of this mechanism."
    return f"'{symbol}' is not a quantity of it; declare it as Parameter, Input or Coordinate."
