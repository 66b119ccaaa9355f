"""Lagrange's equations, solved for the accelerations.

M a = -dU/dq - dD/dv + Q + dT/dq - (d2T/dv dq) v - d2T/dv dt - (d2T/dv du) u',    M = d2T/dv2
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Input


def inverse(matrix: sympy.Matrix) -> sympy.Matrix:
    """Inverse of a mass matrix with one common denominator, which generated code then computes once."""
    if matrix.is_diagonal():
        return sympy.diag(*(1 / entry for entry in matrix.diagonal()))
    determinant = sympy.simplify(sympy.sympify(matrix.det()))
    return matrix.adjugate().applyfunc(sympy.simplify) / determinant


def generalised_forces(mechanism: Mechanism) -> sympy.Matrix:
    """Right-hand side of the equation at the head of the module without contact forces, (n_coordinates, 1)."""
    T, U, D = mechanism.kinetic_energy, mechanism.potential_energy, mechanism.dissipation
    rows = []
    for q in mechanism.coordinates:
        momentum = sympy.diff(T, q.v)
        drift = time_derivative(momentum, mechanism.coordinates, mechanism.inputs, with_accelerations=False)
        applied = mechanism.applied.get(q, sympy.S.Zero)
        rows.append(-sympy.diff(U, q) - sympy.diff(D, q.v) + applied + sympy.diff(T, q) - drift)
    return sympy.Matrix(rows)


def time_derivative(
    expression: sympy.Expr, coordinates: Sequence[Coordinate], inputs: Sequence[Input], *, with_accelerations: bool
) -> sympy.Expr:
    """Time derivative along the motion, by the chain rule; without accelerations, the terms of v' are left out."""
    result = sympy.diff(expression, TIME)
    for q in coordinates:
        result += sympy.diff(expression, q) * q.v
        if with_accelerations:
            result += sympy.diff(expression, q.v) * q.a
    for u in inputs:
        result += sympy.diff(expression, u) * u.rate
    return result
