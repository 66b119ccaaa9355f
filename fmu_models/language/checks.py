"""What a declaration can get wrong, and the lesson each mistake is answered with."""

import re
from collections.abc import Iterable, Iterator

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.declaration import Body, Declaration
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.impacts import MAX_IMPACTS
from fmu_models.language.inertia import check_definite, is_singular, mass_entries
from fmu_models.language.quantities import TIME, Acceleration, ContactSymbol, Input, Parameter, Rate, State

# what lowering adds to the outputs of every mechanism
POWERS = ("energy", "power_input", "power_dissipated", "power_stops")
# the engine has room for the forces of so many on the stack of a thread (step/contact_factor.c)
MAX_CONTACTS = 200
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def check_mechanism(mechanism: Body) -> None:
    """Refuse a declaration that contradicts itself. StickslipError: where, what is wrong, and how it is written
    instead."""
    if not mechanism.coordinates:
        raise StickslipError(f"{mechanism.name} has no coordinate. A mechanism needs at least one.")
    check_names(mechanism.name, _names(mechanism))
    _check_energies(mechanism)
    for contact in mechanism.contacts:
        contact.check(mechanism.coordinates)
    _check_cones(mechanism)
    _check_symbols(mechanism)
    _check_numbers(mechanism)


def check_names(model: str, pairs: Iterable[tuple[str, str]]) -> None:
    """Refuse names that are none, and one name for two things; ``pairs`` has names with what they belong to.
    StickslipError: which name, and what bears it."""
    names = list(pairs)
    for name, _ in [*names, (model, "model")]:
        if not _IDENTIFIER.fullmatch(name):
            raise StickslipError(f"'{name}' is not a name: use a letter followed by letters, digits or underscores.")
    seen = {"time": "the time"}
    for name, owner in names:
        if name in seen:
            raise StickslipError(
                f"{model}: '{name}' names both {seen[name]} and {owner}. Give every quantity its own name."
            )
        seen[name] = owner


def quantity_names(
    parameters: Iterable[Parameter], inputs: Iterable[Input], states: Iterable[State] = ()
) -> Iterator[tuple[str, str]]:
    """Names of parameters, inputs, rates of inputs and states, each with what it belongs to."""
    for parameter in parameters:
        yield parameter.name, f"parameter '{parameter.description}'"
    for source in inputs:
        yield source.name, f"input '{source.description}'"
        yield source.rate.name, f"the rate of input {source.name}"
    for state in states:
        yield state.name, f"state '{state.description}'"


def _names(mechanism: Body) -> Iterator[tuple[str, str]]:
    """Every name that a user of the model will meet, with what it belongs to."""
    yield from quantity_names(mechanism.parameters, mechanism.all_inputs)
    for q in mechanism.coordinates:
        yield q.name, f"coordinate '{q.description}'"
        yield q.v.name, f"the velocity of {q.name}"
    for state in mechanism.internal_states:
        yield state.name, f"internal state '{state.description}'"
    for output in mechanism.outputs:
        yield output.name, f"output '{output.description}'"
    for contact in mechanism.contacts:
        yield from contact.names
    for name in POWERS:
        yield name, "a quantity that every mechanism shows"


def _check_energies(mechanism: Body) -> None:
    velocities, symbols = {q.v for q in mechanism.coordinates}, Derivatives().symbols
    if velocities & symbols(mechanism.potential_energy):
        raise StickslipError(
            f"{mechanism.name}: the potential energy depends on a velocity. Write damping as dissipation=c*q.v**2/2."
        )
    for q in mechanism.applied:
        if q not in mechanism.coordinates:
            raise StickslipError(
                f"{mechanism.name}: a force is applied to '{q.name}', which is not a coordinate of it."
            )
    inertia = mass_entries(mechanism)
    if any(velocities & symbols(entry) for entry in inertia.values()):
        raise StickslipError(
            f"{mechanism.name}: the kinetic energy is not quadratic in the velocities "
            f"({mechanism.kinetic_energy}). Write it as m*q.v**2/2."
        )
    moved = {i for i, _ in inertia}
    for i, q in enumerate(mechanism.coordinates):
        if i not in moved:
            raise StickslipError(
                f"coordinate '{q.name}' has no inertia: the kinetic energy does not contain its velocity. "
                f"Add its term, for example m*{q.name}.v**2/2."
            )
    if is_singular(mechanism):
        raise StickslipError(
            f"{mechanism.name}: some motion of the coordinates has no kinetic energy (singular mass matrix). "
            "Give it inertia, or leave out a coordinate."
        )


def _check_cones(mechanism: Body) -> None:
    """Refuse a second friction on a motion that friction with two directions rubs on: who holds how much is open."""
    speeds = [q.v for q in mechanism.coordinates]
    for contact in mechanism.contacts:
        for sibling in mechanism.contacts if contact.kind.cone else ():
            slips = [*contact.slips, *sibling.slips]
            slopes = sympy.Matrix([[sympy.diff(slip, v) for v in speeds] for slip in slips])
            if sibling is not contact and sibling.slips and slopes.rank() < len(slips):
                raise StickslipError(
                    f"{mechanism.name}: contacts '{contact.name}' and '{sibling.name}' rub on the same motion, one "
                    "of them in two directions: nothing says which holds how much at rest. Put them into one law."
                )


def _check_numbers(mechanism: Body) -> None:
    impacts = mechanism.impacts
    directions = sum(contact.directions for contact in mechanism.contacts)
    if directions > MAX_CONTACTS:
        raise StickslipError(
            f"{mechanism.name} has {directions} contacts (the friction of a rigid one is one more); at most "
            f"{MAX_CONTACTS} can be held at rest together. Leave some out."
        )
    if len(impacts) > MAX_IMPACTS:
        raise StickslipError(
            f"{mechanism.name} has {len(impacts)} rigid contacts; at most {MAX_IMPACTS} can be answered together in an "
            "impact. Leave some out, or make some of them a Stop."
        )
    if impacts:
        check_definite(mechanism)


def _check_symbols(mechanism: Body) -> None:
    """Every symbol is a quantity of this mechanism, used where it exists."""
    states = {s for q in mechanism.coordinates for s in (q, q.v)} | set(mechanism.internal_states) | {TIME}
    contacts = {symbol for contact in mechanism.contacts for symbol in contact.shown}
    accelerations = {q.a for q in mechanism.coordinates}
    used = mechanism.symbols
    for symbol in sorted(used, key=str):
        declared = isinstance(symbol, (Parameter, Input)) or symbol in states | contacts | accelerations
        if not declared:
            raise StickslipError(f"{mechanism.name}: {stranger(symbol)}")
    body = (mechanism.kinetic_energy, mechanism.potential_energy, mechanism.dissipation, *mechanism.applied.values())
    for contact in mechanism.contacts:
        for symbol in sorted(contact.symbols, key=str):
            if isinstance(symbol, (Acceleration, ContactSymbol)):
                raise StickslipError(f"contact '{contact.name}' uses {symbol.name}; only outputs may use it.")
    symbols = Derivatives().symbols
    for expression in body:
        for symbol in sorted(symbols(expression), key=str):
            if isinstance(symbol, (Acceleration, ContactSymbol)):
                raise StickslipError(f"{mechanism.name}: {symbol.name} is used in an energy; only outputs may use it.")
    check_requirements(mechanism)
    for requirement in mechanism.all_requirements:
        if lost := sorted(map(str, sympy.sympify(requirement.expression).free_symbols - used)):
            raise StickslipError(
                f"{mechanism.name}: {' and '.join(lost)} drops out: no energy, contact or output depends on it, though "
                f"'{requirement.sentence}' is required. It does so where two parameters of a law are one, such as mu_s "
                "and mu_k: give each its own, or take a law without it."
            )


def check_requirements(declared: Declaration) -> None:
    """Refuse requirements of more than parameters. StickslipError: which requirement."""
    for requirement in declared.all_requirements:
        if not all(isinstance(s, Parameter) for s in sympy.sympify(requirement.expression).free_symbols):
            raise StickslipError(f"{declared.name}: the requirement '{requirement.sentence}' may use parameters only.")


def stranger(symbol: sympy.Basic) -> str:
    """The lesson for a symbol that is no quantity of the model."""
    if isinstance(symbol, Rate):
        return f"{symbol} is used directly; rates of inputs enter by themselves."
    if isinstance(symbol, ContactSymbol):
        return f"{symbol} belongs to a contact that is not part of this mechanism."
    return f"'{symbol}' is not a quantity of it; declare it as Parameter, Input or Coordinate."
