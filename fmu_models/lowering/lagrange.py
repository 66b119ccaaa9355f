"""Lagrange's equations and the mass matrix.

M a = -dU/dq - dD/dv + Q + dT/dq - (d2T/dv dq) v - d2T/dv dt - (d2T/dv du) u',    M = d2T/dv2

The inverse of M is written out as long as it is small: blocks of two coordinates, and of three that depend on
parameters alone. Else M itself goes into the generated code and is factored there (engine/model/mass_matrix.h).
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import sympy

from fmu_models.language.contact_dynamics import multiplied_out
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.inertia import CLOSED_FORM, Entries, blocks
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Input, Parameter


def has_small_inverse(n: int, mass: Entries) -> bool:
    """Whether the inverse of a mass matrix of n coordinates is written out."""
    for block in blocks(n, mass):
        symbols = set().union(*(entry.free_symbols for (i, _), entry in mass.items() if i in block))
        constant = all(isinstance(symbol, Parameter) for symbol in symbols)
        if len(block) > (CLOSED_FORM if constant else CLOSED_FORM - 1):
            return False
    return True


def inverse(n: int, mass: Entries) -> dict[tuple[int, int], Any]:
    """Entries of the inverse of a mass matrix, those of a block with one denominator, which code computes once."""
    entries: dict[tuple[int, int], Any] = {}
    for block in blocks(n, mass):
        if len(block) == 1:
            entries[block[0], block[0]] = 1 / mass[block[0], block[0]]
            continue
        square = sympy.Matrix([[mass.get((i, j), sympy.S.Zero) for j in block] for i in block])
        determinant: Any = square.det()
        determinant = multiplied_out(determinant)
        adjugate = square.adjugate().applyfunc(multiplied_out)
        entries |= {
            (i, j): adjugate[a, b] / determinant
            for a, i in enumerate(block)
            for b, j in enumerate(block)
            if adjugate[a, b] != 0
        }
    return entries


def generalised_forces(mechanism: Mechanism) -> list[Any]:
    """Right-hand side of the equation at the head of the module, one per coordinate; of the contact forces those that
    act whatever happens."""
    T, U, D = mechanism.kinetic_energy, mechanism.potential_energy, mechanism.dissipation
    derivatives = Derivatives()
    drift = TimeDerivative(mechanism.coordinates, mechanism.all_inputs, with_accelerations=False)
    by = derivatives.by
    steady = [pair for contact in mechanism.contacts if (pair := contact.steady)]
    return [
        sympy.Add(
            *(-by(U, q), -by(D, q.v), mechanism.applied.get(q, sympy.S.Zero), by(T, q), -drift(by(T, q.v))),
            *(by(speed, q.v) * force for force, speed in steady),
        )
        for q in mechanism.coordinates
    ]


class TimeDerivative:
    """Time derivatives along the motion, by the chain rule; without accelerations, the terms of v' are left out."""

    def __init__(
        self,
        coordinates: Sequence[Coordinate],
        inputs: Sequence[Input],
        *,
        with_accelerations: bool,
        rates: Mapping[Any, Any] = MappingProxyType({}),
    ) -> None:
        """rates: of further states."""
        self._rates: dict[sympy.Basic, Any] = {TIME: sympy.S.One, **rates}
        self._rates |= {q: q.v for q in coordinates} | {u: u.rate for u in inputs}
        if with_accelerations:
            self._rates |= {q.v: q.a for q in coordinates}
        self._derivatives = Derivatives()
        self._known: dict[Any, Any] = {}

    def __call__(self, expression: sympy.Expr) -> sympy.Expr:
        return self._derivatives.along(expression, self._rates, self._known)
