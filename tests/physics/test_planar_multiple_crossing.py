"""Planar system (8) of Leine and van Campen (2006)."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from closed_form import root
from planar import jacobian
from scipy.linalg import expm

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.oscillators.planar_multiple_crossing import MODEL
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative


@cache
def fmu() -> Fmu:
    return Fmu.open(built("planar_multiple_crossing"))


SADDLE = (7 / 4 + (73 / 16) ** 0.5, 7 / 4 - (73 / 16) ** 0.5)
FOCUS = (-1 / 4 + (7 / 16) ** 0.5 * 1j, -1 / 4 - (7 / 16) ** 0.5 * 1j)


@pytest.mark.parametrize(("x1", "sign", "eigenvalues"), [(2 / 3, 1, SADDLE), (-2.0, -1, FOCUS)])
def test_the_two_equilibria_before(x1, sign, eigenvalues):
    """Equations (9), (11), (12) at mu = -1."""
    found = flow_derivative(fmu(), 0.5, start={"x1": x1, "x2": -2.0})
    assert found.end == pytest.approx([x1, -2.0], abs=1e-14)
    J = np.array(jacobian(MODEL, kink_sign=sign), dtype=float)
    assert found.by_start == pytest.approx(expm(0.5 * J), rel=1e-13)
    for eigenvalue in eigenvalues:
        assert np.abs(np.linalg.eigvals(J) - eigenvalue).min() < 1e-14


def path(q: sympy.Expr) -> Any:
    """Generalised Jacobian (13)."""
    return jacobian(MODEL, kink_sign=2 * q - 1)


def test_the_path_of_the_eigenvalues_crosses_the_axis_twice():
    half = sympy.Rational(1, 2)
    assert path(sympy.Rational(1, 8)).eigenvals() == {half * sympy.I: 1, -half * sympy.I: 1}
    assert path(sympy.Rational(1, 4)).eigenvals() == {sympy.Integer(0): 1, half: 1}


def test_focus_turns_to_node_on_the_path():
    q = sympy.Symbol("q")
    J = path(q)
    discriminant = sympy.lambdify(q, J.trace() ** 2 - 4 * J.det())
    assert root(discriminant, 1 / 8, 1 / 4) == pytest.approx(0.2285533906, abs=5e-11)


def test_the_default_motion_spirals_into_the_focus():
    run = simulate(fmu(), 200.0)
    assert [(event.before, event.after) for event in run.events] == [(1, -1)]
    assert [run["x1"][-1], run["x2"][-1]] == pytest.approx([-2.0, -2.0], abs=1e-12)


def test_across_the_kink_against_matrix_exponentials():
    """Affine on both sides: x(t) = e + expm(J t) (x(0) - e); a kink has no saltation, so derivatives multiply."""
    J = {sign: np.array(jacobian(MODEL, kink_sign=sign), dtype=float) for sign in (1, -1)}
    at = {1: np.array([2 / 3, -2.0]), -1: np.array([-2.0, -2.0])}
    start = np.array([0.2, -3.0])
    crossing = root(lambda t: (at[1] + expm(t * J[1]) @ (start - at[1]))[0], 1e-3, 1.0)
    there = at[1] + expm(crossing * J[1]) @ (start - at[1])
    end = at[-1] + expm((3.0 - crossing) * J[-1]) @ (there - at[-1])
    found = flow_derivative(fmu(), 3.0)
    assert found.end == pytest.approx(end, rel=1e-13)
    assert found.by_start == pytest.approx(expm((3.0 - crossing) * J[-1]) @ expm(crossing * J[1]), rel=1e-12)


def test_without_an_equilibrium_every_motion_escapes():
    """mu = 1: x1' - x2' = x2/2 - mu; from anywhere near the origin the state grows without bound."""
    for x1 in (-1.0, 0.0, 1.0):
        run = simulate(fmu(), 30.0, parameters={"mu": 1.0}, start={"x1": x1, "x2": 0.0})
        assert run["x1"][-1] > 1e6 and np.isfinite(run["x1"]).all()
