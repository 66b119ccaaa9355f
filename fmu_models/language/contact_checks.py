"""What the slip speed and the gap of a contact can get wrong, and the lesson each mistake is answered with."""

from collections.abc import Sequence

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
