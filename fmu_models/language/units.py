"""Units of a declaration: every sum adds like to like, and energies, forces and outputs are what they say."""

from collections.abc import Iterable, Iterator, Sequence

import sympy

from fmu_models.language.declaration import Body
from fmu_models.language.dimensions import Dimensions
from fmu_models.language.quantities import Quantity
from fmu_models.language.signals import PeriodicSignal


def check_units(mechanism: Body) -> None:
    """Refuse a mechanism whose units do not match. StickslipError: which expression, and what does not match in it."""
    units = Dimensions(mechanism.name, mechanism.coordinates)
    units.expect("the kinetic energy", mechanism.kinetic_energy, "J")
    units.expect("the potential energy", mechanism.potential_energy, "J")
    units.expect("the dissipation", mechanism.dissipation, "W")
    for q, force in mechanism.applied.items():
        work = None if force == 0 else units.expect(f"the force on {q.name}", force, None)
        units.match(f"the force on {q.name} times its velocity", units.product(work, units.of_unit(q.v.unit)), "W")
    for contact in mechanism.contacts:
        contact.check_units(units)
    for output in mechanism.outputs:
        units.expect(f"output '{output.name}'", output.expression, output.unit)
    for label, expression, unit in signal_units(mechanism.signals):
        units.expect(label, expression, unit)


def signal_units(signals: Iterable[PeriodicSignal]) -> Iterator[tuple[str, sympy.Expr, str]]:
    """What signals are made of: what each expression is, the expression, and the unit that it should have."""
    for signal in signals:
        yield f"the period of '{signal.name}'", signal.period, "s"
        yield f"the start of '{signal.name}'", signal.start, "s"
        for place, value in signal.knots:
            yield f"a place of '{signal.name}'", place, "1"
            yield f"a value of '{signal.name}'", value, signal.unit


def check_expression_units(
    model: str, states: Sequence[Quantity], expected: Iterable[tuple[str, sympy.Expr, str]]
) -> None:
    """Refuse a model without a body in which an expression, given with what it is, has another unit than it should.
    StickslipError: which expression, and what does not match in it."""
    units = Dimensions(model, states)
    for label, expression, unit in expected:
        units.expect(label, expression, unit)
