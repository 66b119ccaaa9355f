"""What the slip speed and the gap of a contact can get wrong, and the lesson each mistake is answered with."""

from collections.abc import Sequence
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.quantities import Coordinate


def check_slip(contact: str, slip: sympy.Expr, coordinates: Sequence[Coordinate]) -> None:
    """Refuse a slip speed that is not affine in velocities of the body."""
    where = f"contact '{contact}': slip"
    slip = sympy.sympify(slip)
    symbols = slip.free_symbols
    for q in coordinates:
        if q.a in symbols:
            raise StickslipError(f"{where} depends on acceleration {q.a.name}; write it with {q.name}.v")
    velocities = {q.v for q in coordinates} & symbols
    if not velocities:
        raise StickslipError(
            f"{where} = {slip} is independent of every velocity, so friction could not act on anything; "
            f"write it with {coordinates[0].name}.v"
        )
    if any(sympy.diff(slip, v).free_symbols & velocities for v in velocities):
        raise StickslipError(
            f"{where} = {slip} is not affine in the velocities; a slip speed is a difference of speeds such as "
            f"R*{coordinates[0].name}.v - v_belt"
        )


def check_turning(contact: str, slip: Any, law: Any) -> None:
    """Refuse slips and laws that make no cone."""
    where = f"contact '{contact}'"
    if len(slip) != 2:
        raise StickslipError(f"{where} has {len(slip)} slip speeds; a contact rubs along one direction or two.")
    name, v = type(law).__name__, sympy.Dummy("v")
    if not hasattr(law, "capacity_minus"):
        raise StickslipError(f"{where}: {name} is no law of friction, which alone acts in two directions.")
    if law.states:
        raise StickslipError(
            f"{where}: the law {name} has internal states ({', '.join(s.name for s in law.states)}) of one direction. "
            "In two directions a law of the slip speed alone will do, such as Coulomb, Conti or Stribeck."
        )
    if law.capacity_minus != law.capacity or law.force(v, sympy.S.One) + law.force(-v, -sympy.S.One) != 0:
        raise StickslipError(
            f"{where}: the law {name} has other friction one way than the other. In two directions it must be the same "
            "whichever way the contact slips."
        )
    if not law.sticks:
        raise StickslipError(
            f"{where}: the law {name} never sticks. With two directions the contact is to stick: take the law that it "
            "smooths, or one contact for each direction."
        )


def check_place(where: str, region: sympy.Expr, coordinates: Sequence[Coordinate]) -> None:
    """Refuse a gap or a region that depends on speeds, or on no coordinate."""
    region = sympy.sympify(region)
    symbols = region.free_symbols
    for q in coordinates:
        if {q.v, q.a} & symbols:
            moving = q.v if q.v in symbols else q.a
            raise StickslipError(
                f"{where} = {region} depends on {moving.name}; it says where the contact is, so write it with "
                f"coordinates such as {q.name}."
            )
    if not symbols.intersection(coordinates):
        raise StickslipError(
            f"{where} = {region} is the same wherever the body is; write it with a coordinate such as "
            f"{coordinates[0].name}."
        )
