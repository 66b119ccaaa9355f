"""The mass matrix M = d2T/dv2, and that it is positive definite: without that an impulse has no unique answer.

It is, if and only if the determinants of its upper left squares are positive (Sylvester).
"""

from __future__ import annotations

from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Requirement
from fmu_models.language.declaration import Body
from fmu_models.language.quantities import TIME, Parameter


def mass_matrix(mechanism: Body) -> sympy.Matrix:
    """M, (n_coordinates, n_coordinates)."""
    return sympy.hessian(mechanism.kinetic_energy, [q.v for q in mechanism.coordinates])


def inertia_requirements(mechanism: Body) -> tuple[Requirement, ...]:
    """What makes M positive definite, as far as the parameters alone decide it and their signs do not show it."""
    found = []
    for n, determinant in enumerate(_minors(mass_matrix(mechanism)), start=1):
        minor: Any = sympy.expand(determinant)
        if not minor.is_positive and all(isinstance(symbol, Parameter) for symbol in minor.free_symbols):
            sentence = f"the mass matrix must be positive definite; {_determinant(n)} is not positive"
            found.append(Requirement(minor, sentence, strict=True))
    return tuple(found)


def check_definite(mechanism: Body) -> None:
    """Refuse a mass matrix that is not positive definite at the start values of everything.

    Raises:
        StickslipError: which determinant shows it.
    """
    quantities = (*mechanism.parameters, *mechanism.inputs)
    point: dict[sympy.Basic, Any] = {q: sympy.Rational(q.value) for q in quantities}
    point |= {q: sympy.Rational(q.start) for q in mechanism.coordinates} | {TIME: sympy.S.Zero}
    for n, determinant in enumerate(_minors(mass_matrix(mechanism).xreplace(point)), start=1):
        minor: Any = sympy.N(determinant)
        if not minor.is_positive:
            raise StickslipError(
                f"{mechanism.name}: the mass matrix is not positive definite at the start values ({_determinant(n)} "
                f"is {minor:g}), so that some motion would have no positive kinetic energy and an impact no answer. "
                "Look at the signs and cross terms of the kinetic energy."
            )


def _minors(matrix: Any) -> list[Any]:
    return [matrix[:n, :n].det() for n in range(1, matrix.rows + 1)]


def _determinant(n: int) -> str:
    return "its first entry" if n == 1 else f"the determinant of its first {n} rows and columns"
