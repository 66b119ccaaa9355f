"""Periodic motions by Newton's method on exact derivatives, and their multipliers, against reference values.

The derivatives are carried through the events by the engine (saltation included); nothing here is a finite difference.
"""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.analyses.orbits import find_orbit, orbit_at
from fmu_models.codegen.package import built
from fmu_models.errors import StickslipError
from fmu_models.simulation.fmu import Fmu
from fmu_models.simulation.system import simulate
from fmu_models.simulation.tangent import flow_derivative

SUPPORT = Fmu.open(built("discontinuous_support"))
HINGE = Fmu.open(built("hinge_clearance"))


@pytest.mark.parametrize(
    ("ks", "x", "v", "modulus"),
    [
        (10.0, 3.648464099396639, 2.514570496974713, 0.780117660219),
        (1e5, 3.440645004751037, 2.060653451073986, 0.853376023571),
    ],
)
def test_support_period_1(ks, x, v, modulus):
    """Table 1, omega = 1: a complex pair; its product is exp(-(c T + cs Tc)/m) with Tc the time in contact."""
    orbit = orbit_at(SUPPORT, 2 * np.pi, {"x": x, "v": v}, parameters={"ks": ks})
    assert orbit.residual < 1e-9
    assert orbit.stable
    assert np.abs(orbit.multipliers) == pytest.approx([modulus] * 2, rel=1e-11)
    events = simulate(SUPPORT, 2 * np.pi, start={"x": x, "v": v}, parameters={"ks": ks}).events
    (entry,) = (event.time for event in events if event.after == 3)
    (exit_,) = (event.time for event in events if event.before == 3)
    product = np.exp(-(0.05 * 2 * np.pi + 0.3 * (exit_ - entry)))
    assert np.linalg.det(orbit.monodromy) == pytest.approx(product, rel=1e-8)


def test_support_entry_and_exit_saltation():
    """Entry [[1, 0], [-cs/m, 1]], exit identity: across one event the derivative of the flow is S exp(A t) pieces."""
    from scipy.linalg import expm

    free = np.array([[0.0, 1.0], [-1.0, -0.05]])
    touching = np.array([[0.0, 1.0], [-11.0, -0.35]])
    start = {"x": 3.648464099396639, "v": 2.514570496974713}
    entry, exit_ = 0.156261938048459, 0.764467881781506
    saltation = np.array([[1.0, 0.0], [-0.3, 1.0]])
    inside = expm(touching * (0.5 - entry)) @ saltation @ expm(free * entry)
    assert flow_derivative(SUPPORT, 0.5, start=start).by_start == pytest.approx(inside, abs=1e-8)
    whole = expm(touching * (exit_ - entry)) @ saltation @ expm(free * entry)
    after = expm(free * (2.0 - exit_)) @ whole
    assert flow_derivative(SUPPORT, 2.0, start=start).by_start == pytest.approx(after, abs=1e-8)


def test_support_fold_of_the_contact_branch():
    """ks = 10: at omega = 1.193153181280957 one multiplier is +1 (resonance curve jumps)."""
    omega = 1.193153181280957
    start = {"x": -2.501194103020, "v": 6.067313981204}
    orbit = orbit_at(SUPPORT, 2 * np.pi / omega, start, parameters={"omega": omega})
    assert orbit.residual < 1e-8
    # at a fold the multiplier leaves 1 like the square root of the distance: 1e-12 in the state gives 1e-6
    assert np.abs(orbit.multipliers - 1.0).min() < 1e-5


def test_support_period_3_is_found_from_a_rough_guess():
    """Table 2, omega = 0.92: the period-3 motion that an upward sweep reaches."""
    parameters = {"ks": 300.0, "cs": 0.6, "g": 1.6, "omega": 0.92}
    orbit = find_orbit(SUPPORT, 6 * np.pi / 0.92, {"x": 1.14, "v": -0.27}, parameters=parameters)
    assert [orbit.start["x"], orbit.start["v"]] == pytest.approx([1.140362014614650, -0.270093925370817], abs=1e-9)
    assert orbit.stable


def test_hinge_period_1():
    """f = 0.429: multipliers of the 1-1-1 motion.

    The printed multipliers, -0.8937818817 and -0.2083375874, are reproduced to 1e-7; Richardson's extrapolation of
    differences of runs at 1e-15 agrees with the derivative below to 1e-8 (the force ends like (t_exit - t)^(3/2)).
    """
    orbit = find_orbit(HINGE, 1 / 0.429, {"x": -5e-6, "v": 0.033})
    assert [orbit.start["x"], orbit.start["v"]] == pytest.approx([-5.19128647e-6, 0.03296490834399], abs=1e-11)
    assert np.sort(orbit.multipliers.real) == pytest.approx([-0.8937818817, -0.2083375874], abs=2e-7)
    assert np.abs(orbit.multipliers.imag).max() == 0.0
    columns = []
    for state in ("x", "v"):
        ends = {}
        for steps in (-2, -1, 1, 2):
            start = {**orbit.start, state: orbit.start[state] + steps * 1e-5}
            run = simulate(HINGE, 1 / 0.429, start=start, output_times=[1 / 0.429], tolerance=1e-15)
            ends[steps] = np.array([run["x"][-1], run["v"][-1]])
        columns.append((8 * (ends[1] - ends[-1]) - (ends[2] - ends[-2])) / 12e-5)
    assert orbit.monodromy == pytest.approx(np.stack(columns, axis=1), abs=2e-8)


def test_hinge_doubles_its_period():
    """f = 0.42628837787: one multiplier of the 1-1-1 motion is -1."""
    f = 0.42628837787
    orbit = find_orbit(HINGE, 1 / f, {"x": -5e-6, "v": 0.033}, parameters={"f": f})
    assert np.abs(orbit.multipliers + 1.0).min() < 2e-7


def test_no_orbit_is_said_in_words():
    """Without a spring the mass drifts: the map over a period is a shear, and Newton's equations are singular."""
    drift = {"k": 0.0, "c": 0.0, "g": 1e6}
    with pytest.raises(StickslipError, match="Start nearer"):
        find_orbit(SUPPORT, 2 * np.pi, {"x": 3.0, "v": 1.0}, parameters=drift)
