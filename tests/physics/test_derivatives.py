"""Derivatives of a motion carried through its events, against closed forms and against differences of tight runs."""

from __future__ import annotations

import numpy as np
import pytest
from steady_cycle import disc_rig

from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

pytestmark = pytest.mark.digits

ONE, TWO = ("disc0",), ("disc0", "disc1")
STATES = ("theta", "omega")


def differences(fmu, name, step, stop, *, start, parameters, inputs):
    """Central difference of the end states of two tight runs, by a start state or a parameter."""
    ends = []
    for side in (1, -1):
        begin, values = dict(start), dict(parameters)
        (begin if name in STATES else values)[name] += side * step
        run = simulate(fmu, stop, start=begin, parameters=values, inputs=inputs, output_times=[stop], tolerance=1e-15)
        ends.append([run[state][-1] for state in STATES])
    return (np.array(ends[0]) - np.array(ends[1])) / (2 * step)


def test_linear_oscillator_has_the_matrix_exponential():
    """Without contacts: x(t) = exp(A t) x(0), A = [[0, 1], [-k/J, -c/J]]."""
    from scipy.linalg import expm

    found = flow_derivative(disc_rig(()), 3.0, start={"theta": 0.15}, by=["k"])
    A = np.array([[0.0, 1.0], [-2.62 / 0.0548, -0.055 / 0.0548]])
    assert found.by_start == pytest.approx(expm(3.0 * A), abs=1e-12)
    # d/dk of exp(A t) x0, from the exponential of the block matrix [[A, dA/dk], [0, A]]
    block = np.block([[A, np.array([[0, 0], [-1 / 0.0548, 0]])], [np.zeros((2, 2)), A]])
    by_k = expm(3.0 * block)[:2, 2:] @ [0.15, 0.0]
    assert found.by_parameter["k"] == pytest.approx(by_k, abs=1e-12)


@pytest.mark.parametrize(
    ("contacts", "inputs"),
    [(ONE, {"w0": 0.41}), (ONE, {"w0": 0.83}), (TWO, {"w0": 1.4, "w1": 0.83}), (TWO, {"w0": 1.5, "w1": -0.5})],
)
@pytest.mark.parametrize("name", ["theta", "omega", "mu_s0", "mu_k0", "p0", "N0", "J", "c"])
def test_stick_slip_agrees_with_differences(contacts, inputs, name):
    """1.3 s holds slip, landing, stick and release; the differences of tight runs are good to 1e-6."""
    fmu = disc_rig(contacts)
    start = {"theta": 0.05, "omega": 0.0}
    parameters = {p: float(fmu.variables[p].start or 0) for p in fmu.parameters}
    by = [name] if name not in STATES else []
    found = flow_derivative(fmu, 1.3, start=start, inputs=inputs, by=by)
    exact = found.by_start[:, STATES.index(name)] if name in STATES else found.by_parameter[name]
    size = max(1e-3, abs(start.get(name, parameters.get(name, 0.0))))
    rough = differences(fmu, name, 1e-5 * size, 1.3, start=start, parameters=parameters, inputs=inputs)
    assert exact == pytest.approx(rough, rel=1e-6, abs=1e-6 * max(1.0, float(np.abs(rough).max())))


def test_stick_forgets_where_it_came_from():
    """While the disc sticks theta is r w/R (t - t_landing) + theta_landing and omega is r w/R, whatever the past."""
    found = flow_derivative(disc_rig(ONE), 0.3, start={"theta": 0.0, "omega": 0.0}, inputs={"w0": 0.2})
    assert found.end[1] == pytest.approx(0.06 * 0.2 / 0.125, rel=1e-14)
    assert np.abs(found.by_start[1]).max() < 1e-12
    assert abs(np.linalg.det(found.by_start)) < 1e-12


def test_a_release_has_no_memory_of_anything_but_its_angle():
    """Closed form: d x(t)/d theta(0) = x'(t)/v after a release from stick at speed v = r w/R.

    Whatever the start, release is at theta_r = (R N mu_s - c v)/k; a neighbour that sticks dtheta further along lets go
    dtheta/v earlier and follows the same motion that much earlier.
    """
    v = 0.06 * 0.2 / 0.125
    run = simulate(disc_rig(ONE), 1.0, start={"theta": 0.1, "omega": v}, inputs={"w0": 0.2}, output_times=[1.0])
    assert [event.after for event in run.events] == [1]
    found = flow_derivative(disc_rig(ONE), 1.0, start={"theta": 0.1, "omega": v}, inputs={"w0": 0.2})
    rates = np.array([run["der(theta)"][-1], run["der(omega)"][-1]])
    assert found.by_start[:, 0] == pytest.approx(rates / v, rel=1e-9)
