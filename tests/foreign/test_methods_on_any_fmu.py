"""Methods of integration of the master, by solutions known in closed form or made by independent code."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest
from models import Models
from scipy.integrate import solve_ivp

from fmu_models.importer.driver import Driver
from fmu_models.importer.simulate import simulate_any

METHODS = ("dopri5", "dop853", "stiff", "auto")


@functools.cache
def van_der_pol(mu: float, stop: float, method: str) -> np.ndarray:
    """(2, 101) x and v at equally spaced times, by scipy."""
    solution = solve_ivp(
        lambda t, y: (y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]),
        (0.0, stop),
        (2.0, 0.0),
        method=method,
        t_eval=np.linspace(0.0, stop, 101),
        rtol=1e-12,
        atol=1e-12,
    )
    return solution.y


@pytest.mark.parametrize("method", METHODS)
def test_van_der_pol(model: Models, method: str) -> None:
    run = simulate_any(model("van_der_pol"), 20.0, method=method, tolerance=1e-9)
    # the cycle attracts, the phase does not: some hundred times the tolerance over three periods
    assert np.abs([run["x"][-1], run["v"][-1]] - van_der_pol(1.0, 20.0, "DOP853")[:, -1]).max() < 3e-7
    assert "because" not in run.method


@pytest.mark.parametrize("method", METHODS)
def test_dense_output_is_as_good_as_the_steps(model: Models, method: str) -> None:
    times = np.linspace(0.0, 5.0, 997)
    run = simulate_any(model("grumble"), 0.9, method=method, tolerance=1e-10, output_times=times[times < 0.9])
    assert np.abs(run["x"] - np.exp(-run.time)).max() < 2e-9


@pytest.mark.parametrize("method", ["stiff", "auto"])
def test_stiff_van_der_pol(model: Models, method: str) -> None:
    run = simulate_any(model("van_der_pol"), 2000.0, method=method, tolerance=1e-8, parameters={"mu": 1000.0})
    assert np.abs([run["x"][-1], run["v"][-1]] - van_der_pol(1000.0, 2000.0, "Radau")[:, -1]).max() < 1e-6
    # an explicit method would need some 400 000 steps: 2000 s times the rate 1000 by a stability of 6
    assert run.steps < 3000
    assert ("because stability limited the steps" in run.method) == (method == "auto")


@pytest.mark.parametrize("method", ["stiff", "auto"])
def test_robertson(model: Models, method: str) -> None:
    run = simulate_any(model("robertson"), 400.0, method=method, tolerance=1e-8)
    # Hairer & Wanner II, section IV.10, stiff problem ROBER at t = 400 (its atol is below 1e-13 there)
    solution = solve_ivp(
        lambda t, y: (
            -0.04 * y[0] + 1e4 * y[1] * y[2],
            0.04 * y[0] - 1e4 * y[1] * y[2] - 3e7 * y[1] ** 2,
            3e7 * y[1] ** 2,
        ),
        (0.0, 400.0),
        (1.0, 0.0, 0.0),
        method="Radau",
        rtol=1e-11,
        atol=1e-14,
    )
    end = np.array([run[name][-1] for name in "abc"])
    assert np.abs(end / solution.y[:, -1] - 1).max() < 1e-6
    assert abs(end.sum() - 1) < 1e-9
    assert run.steps < 1000


@pytest.mark.parametrize("method", METHODS)
def test_the_error_follows_the_tolerance(model: Models, method: str) -> None:
    times = np.linspace(0.0, 100.0, 101)
    exact = van_der_pol(1.0, 100.0, "DOP853")
    errors = []
    for tolerance in 10.0 ** np.arange(-3, -11, -1):
        run = simulate_any(model("van_der_pol"), 100.0, method=method, tolerance=tolerance, output_times=times)
        errors.append(np.abs(run["x"] - exact[0]).max())
    # every decade of the tolerance is worth something
    assert all(later < 0.7 * earlier for earlier, later in itertools.pairwise(errors))
    assert errors[-1] < 1e-4 * errors[2]


def test_a_directional_derivative_saves_evaluations(model: Models, fmi: int) -> None:
    if fmi == 1:
        pytest.skip("FMI 1.0 has none")
    options = {"method": "stiff", "tolerance": 1e-6, "parameters": {"mu": 100.0}, "output_times": [200.0]}
    exact = simulate_any(model("van_der_pol"), 200.0, **options)
    # three stages and the end of the step, two or three iterations: a Jacobian by differences would add two each
    assert exact.evaluations < 11 * exact.steps
    assert exact.method.endswith("Jacobians by the FMU's directional derivatives")
    assert "directional" not in simulate_any(model("robertson"), 1.0, method="stiff").method


def test_fast_parts_between_stiff_ones_are_made_by_explicit_steps(model: Models) -> None:
    options = {"tolerance": 1e-6, "parameters": {"mu": 100.0}, "output_times": [200.0]}
    auto, stiff = (simulate_any(model("van_der_pol"), 200.0, method=method, **options) for method in ("auto", "stiff"))
    # two jumps from one slow branch to the other: there and back each, after the first change
    assert "(5 changes between the two)" in auto.method
    assert auto.steps < 0.7 * stiff.steps
    assert auto["x"][-1] == pytest.approx(stiff["x"][-1], abs=1e-4)


def test_outputs_within_the_step_before_the_method_changes_are_those_of_that_step(model: Models) -> None:
    times = np.linspace(0.0, 0.3, 3001)
    changing, explicit = (Driver(model("robertson"), method=m, tolerance=1e-6) for m in ("auto", "dop853"))
    run, other = (driver.run(0.3, output_times=times) for driver in (changing, explicit))
    assert "because stability limited the steps" in run.method
    # the nominal value of each state is 1: the tolerance is absolute
    assert max(np.abs(run[name] - other[name]).max() for name in "abc") < 1e-6
    # and what one run leaves behind is nothing to the next
    assert all(np.array_equal(changing.run(0.3, output_times=times)[name], run[name]) for name in "abc")
