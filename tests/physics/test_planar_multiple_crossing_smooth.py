"""Smoothed planar system (14) of Leine and van Campen (2006), eps = 20.

The paper prints its homoclinic bifurcation at mu = -0.0013987, which is off by 1.3e-4 relative.
"""

from __future__ import annotations

from functools import cache
from typing import Any, cast

import numpy as np
import pytest
import sympy
from planar import jacobian, symbols

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.lowering.lower import lower
from fmu_models.oscillators.planar_multiple_crossing_smooth import MODEL
from fmu_models.sections.orbits import find_orbit
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

HOMOCLINIC = -0.0013985188342794350
HOPF, HOPF_X1 = 0.0025561976547262552, -0.0410676544604
SADDLE_NODE, SADDLE_NODE_X1 = 0.0051946258921224642, -0.0220805395853
FOCUS_NODE = 0.0051403779775442


@cache
def fmu() -> Fmu:
    return Fmu.open(built("planar_multiple_crossing_smooth"))


def equilibrium_with(condition: Any, guess: tuple[float, float, float]) -> list[float]:
    """x1, x2, mu at which the derived flow and a condition on its Jacobian vanish."""
    known = symbols(MODEL)
    equations = [e.xreplace({known["eps"]: sympy.Integer(20)}) for e in (*lower(MODEL).acceleration, condition)]
    return [
        float(v) for v in cast(Any, sympy.nsolve(equations, [known["x1"], known["x2"], known["mu"]], guess, prec=30))
    ]


J = jacobian(MODEL)


def test_hopf_bifurcation():
    x1, x2, mu = equilibrium_with(J.trace(), (-0.041, 0.01, 0.0026))
    assert mu == pytest.approx(HOPF, rel=1e-14)
    assert x1 == pytest.approx(HOPF_X1, abs=1e-13)
    # the flow of the FMU agrees: at rest there, and it keeps areas
    found = flow_derivative(fmu(), 3.0, start={"x1": x1, "x2": x2}, parameters={"mu": mu})
    assert found.end == pytest.approx([x1, x2], abs=1e-15)
    assert np.linalg.det(found.by_start) == pytest.approx(1.0, abs=1e-13)


def test_saddle_node_bifurcation():
    x1, x2, mu = equilibrium_with(J.det(), (-0.022, 0.01, 0.0052))
    assert mu == pytest.approx(SADDLE_NODE, rel=1e-14)
    assert x1 == pytest.approx(SADDLE_NODE_X1, abs=1e-13)
    found = flow_derivative(fmu(), 3.0, start={"x1": x1, "x2": x2}, parameters={"mu": mu})
    assert np.abs(np.linalg.eigvals(found.by_start) - 1.0).min() < 1e-7


def test_focus_turns_to_node():
    *_, mu = equilibrium_with(J.trace() ** 2 - 4 * J.det(), (-0.025, 0.01, 0.00514))
    assert mu == pytest.approx(FOCUS_NODE, rel=1e-11)


def test_the_unstable_cycle():
    cycle = find_orbit(fmu(), 15.4, {"x1": -0.008, "x2": 0.0064}, autonomous=True)
    assert cycle.period == pytest.approx(15.35753971563, rel=1e-12)
    assert cycle.multipliers[0].real == pytest.approx(88.92905975, rel=1e-10)
    assert cycle.multipliers[1].real == pytest.approx(1.0, abs=1e-9)
    assert not cycle.stable


def test_the_hopf_bifurcation_is_subcritical():
    """Just before it a small unstable cycle surrounds the stable focus; its period nears that of the imaginary pair."""
    x1, x2, _ = equilibrium_with(J.trace(), (-0.041, 0.01, 0.0026))
    at_hopf = jacobian(MODEL, x1=x1, x2=x2, eps=20)
    period = 2 * np.pi / float(at_hopf.det()) ** 0.5
    start = {"x1": x1 + 0.005, "x2": x2}
    cycle = find_orbit(fmu(), period, start, autonomous=True, parameters={"mu": 0.99 * HOPF})
    assert cycle.period == pytest.approx(period, rel=0.02)
    assert not cycle.stable


@pytest.mark.parametrize("eps", [0.02, 2e5])
def test_only_mu_times_eps_matters(eps):
    scale = 20.0 / eps
    cycle = find_orbit(fmu(), 15.4, {"x1": -0.008, "x2": 0.0064}, autonomous=True, parameters={"mu": 1e-5})
    start = {name: scale * value for name, value in cycle.start.items()}
    found = flow_derivative(fmu(), cycle.period, start=start, parameters={"mu": 1e-5 * scale, "eps": eps})
    assert found.end == pytest.approx(list(start.values()), rel=1e-9)
    assert found.by_start == pytest.approx(cycle.monodromy, rel=1e-9)


def returns_left_of_the_saddle(mu: float) -> bool:
    """Where the unstable manifold of the saddle goes when it comes back to it: inside the loop, or away for good."""
    known = symbols(MODEL)
    values = {known["eps"]: sympy.Integer(20), known["mu"]: sympy.Float(mu, 30)}
    x = [known["x1"], known["x2"]]
    saddle = cast(
        Any, sympy.nsolve([e.xreplace(values) for e in lower(MODEL).acceleration], x, (0.003, -0.003), prec=30)
    )
    here = np.array([float(v) for v in saddle])
    values_of, vectors = np.linalg.eig(np.array(jacobian(MODEL, x1=here[0], x2=here[1], eps=20), dtype=float))
    out = vectors[:, values_of.argmax()]
    begin = here - 1e-7 * out * np.sign(out[0])
    run = simulate(fmu(), 60.0, parameters={"mu": mu}, start={"x1": begin[0], "x2": begin[1]})
    return bool(np.abs(run["x1"]).max() < 1.0)


def test_homoclinic_bifurcation():
    """Below it the manifold falls into the focus, above it escapes; the border by bisection to 1e-10 relative."""
    below, middle, above = -0.0015, -0.0014, -0.0013
    assert returns_left_of_the_saddle(below) != returns_left_of_the_saddle(above)
    inside = returns_left_of_the_saddle(below)
    while above - below > 1e-10 * abs(HOMOCLINIC):
        middle = (below + above) / 2
        below, above = (middle, above) if returns_left_of_the_saddle(middle) == inside else (below, middle)
    assert middle == pytest.approx(HOMOCLINIC, rel=1e-9)
