"""Planar system (2) of Leine and van Campen (2006). Reference values from arithmetic of 40 digits."""

from __future__ import annotations

import cmath
from functools import cache

import numpy as np
import pytest
import sympy
from planar import extremes, jacobian
from scipy.linalg import expm

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.oscillators.planar_hopf import MODEL
from fmu_models.sections.orbits import Orbit, find_orbit
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

pytestmark = pytest.mark.digits

PERIOD = 7.161378395771368995
MULTIPLIER = 0.01126519358321108


@cache
def fmu() -> Fmu:
    return Fmu.open(built("planar_hopf"))


@cache
def cycle(mu: float = 1.0) -> Orbit:
    return find_orbit(fmu(), 7.0, {"x1": 0.0, "x2": 2.0 * mu}, autonomous=True, parameters={"mu": mu}, accuracy=1e-13)


def test_period_and_multipliers():
    found = cycle()
    assert found.period == pytest.approx(PERIOD, rel=1e-13)
    assert found.multipliers.imag == pytest.approx([0.0, 0.0])
    assert found.multipliers[0].real == pytest.approx(1.0, rel=1e-12)
    assert found.multipliers[1].real == pytest.approx(MULTIPLIER, rel=1e-11)
    assert found.stable
    # Liouville: trace 1/2 below the kink, -5/2 above it; a kink has no saltation
    above, below = 2.688908906215790, 4.472469489555579
    assert np.linalg.det(found.monodromy) == pytest.approx(np.exp(below / 2 - above * 5 / 2), rel=1e-12)


def test_the_parts_of_a_period():
    events = simulate(fmu(), 100.0).events
    up, down, again = [event for event in events if event.time > 80.0][:3]
    parts = {up.after: down.time - up.time, down.after: again.time - down.time}
    assert parts == pytest.approx({1: 2.688908906215790, -1: 4.472469489555579}, rel=1e-12)


def test_extremes_of_the_cycle():
    start = cycle().start
    assert extremes(fmu(), "x1", PERIOD, start) == pytest.approx([-4.964955488427316, 0.039632961471342], abs=1e-12)
    assert extremes(fmu(), "x2", PERIOD, start) == pytest.approx([-2.465423702747400, 2.028003694536352], abs=1e-12)


@pytest.mark.parametrize("mu", [1e-9, 0.125, 1e6])
def test_the_cycle_scales_with_mu(mu):
    start = {name: mu * value for name, value in cycle().start.items()}
    found = flow_derivative(fmu(), PERIOD, start=start, parameters={"mu": mu})
    assert found.end == pytest.approx([start["x1"], start["x2"]], rel=1e-12)
    assert np.linalg.eigvals(found.by_start).min() == pytest.approx(MULTIPLIER, rel=1e-11)


@pytest.mark.parametrize(("mu", "eigenvalues"), [(-1.0, (-2.0, -0.5)), (1.0, (0.25 + 15**0.5 / 4 * 1j,))])
def test_the_equilibrium_is_a_node_before_and_a_focus_after(mu, eigenvalues):
    """Equations (3), (4), from the derivative of the flow: expm(J t)."""
    found = flow_derivative(fmu(), 0.5, start={"x1": -1.5, "x2": 0.0}, parameters={"mu": mu})
    assert found.end == pytest.approx([-1.5, 0.0], abs=1e-14)
    J = np.array(jacobian(MODEL, kink_sign=-np.sign(mu)), dtype=float)
    assert found.by_start == pytest.approx(expm(0.5 * J), abs=1e-13)
    for eigenvalue in eigenvalues:
        assert np.abs(np.linalg.eigvals(J) - eigenvalue).min() < 1e-14


@pytest.mark.parametrize("q", [0, "1/12", "1/6", "1/2", "5/6", "11/12", 1])
def test_the_path_of_the_eigenvalues(q):
    """Equations (5), (6); with the whole set-valued sign 2 q - 1 in the derived Jacobian."""
    q = sympy.Rational(q)
    found = {complex(e) for e in jacobian(MODEL, kink_sign=2 * q - 1).eigenvals()}
    root = cmath.sqrt((1 - 6 * float(q)) ** 2 - 16) / 4
    expected = {0.25 - 1.5 * float(q) + root, 0.25 - 1.5 * float(q) - root}
    assert sorted(found, key=str) == pytest.approx(sorted(expected, key=str), abs=1e-14)


def test_the_path_crosses_the_axis_at_one_sixth_and_meets_itself_at_five_sixths():
    assert jacobian(MODEL, kink_sign=sympy.Rational(2, 6) - 1).eigenvals() == {sympy.I: 1, -sympy.I: 1}
    assert jacobian(MODEL, kink_sign=sympy.Rational(10, 6) - 1).eigenvals() == {sympy.Integer(-1): 2}


def test_at_mu_zero_the_size_of_a_motion_does_not_matter():
    """The flow is homogeneous of degree one then; the kink runs through the equilibrium, where nothing moves."""
    small = simulate(fmu(), 40.0, parameters={"mu": 0.0}, start={"x1": 1e-3, "x2": 0.0})
    large = simulate(fmu(), 40.0, parameters={"mu": 0.0}, start={"x1": 1e3, "x2": 0.0})
    assert large["x1"] * 1e-6 == pytest.approx(small["x1"], abs=1e-15)
    at_rest = simulate(fmu(), 40.0, parameters={"mu": 0.0}, start={"x1": 0.0, "x2": 0.0})
    assert not at_rest["x1"].any() and not at_rest["x2"].any()
