"""The hinge with clearance at extreme parameters and awkward starts."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.special import beta
from test_hinge_clearance import AWAY, CLAMPED, HINGE, TOUCHING

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.run import simulate

BOTH = pytest.mark.parametrize("fmu", [HINGE, CLAMPED], ids=["hinge", "clamped"])


@BOTH
@pytest.mark.parametrize(
    "parameters",
    [
        {"k0": 1e9},
        {"k0": 1e9, "ce": 0.0},
        {"zeta": 0.0},
        {"ce": 1.0},
        {"ce": 0.0},
        {"zeta": 0.0, "ce": 1.0},
        {"delta": 1e-12},
        {"k0": 0.0},
        {"zeta": 50.0},
    ],
    ids=str,
)
def test_extreme_parameters(fmu, parameters):
    """Against the run at the tightest tolerance; with hard stops errors grow fourfold per unit of time."""
    setup: dict[str, Any] = {"parameters": parameters, "output_times": [3.0]}
    run, tight = (simulate(fmu, 3.0, tolerance=tolerance, **setup) for tolerance in (1e-12, 1e-15))
    assert [(e.contact, e.after) for e in run.events] == [(e.contact, e.after) for e in tight.events]
    assert [run["x"][0], run["v"][0]] == pytest.approx([tight["x"][0], tight["v"][0]], abs=1e-9)
    assert bool(run.events) == ("zeta" not in parameters or parameters["zeta"] < 50)


@BOTH
@pytest.mark.parametrize("delta", [0.0, 1e-12])
def test_no_clearance(fmu, delta):
    """The mass is always in one of the stops: it goes from one into the other."""
    setup: dict[str, Any] = {"start": {"x": 0.0, "v": 0.05}, "parameters": {"delta": delta}, "output_times": [20.0]}
    run, tight = (simulate(fmu, 20.0, tolerance=tolerance, **setup) for tolerance in (1e-12, 1e-15))
    assert [run["x"][0], run["v"][0]] == pytest.approx([tight["x"][0], tight["v"][0]], abs=1e-9)
    entered = [event for event in run.events if event.after == TOUCHING]
    assert len(entered) > 10
    left = [event for event in run.events if event.after == AWAY]
    for leave in left:
        nearest = min(abs(leave.time - enter.time) for enter in entered)
        assert nearest == 0.0 if delta == 0.0 else nearest < 1e-9


@BOTH
def test_entry_without_speed_is_refused(fmu):
    """No clearance, at rest: the law divides by the speed of entry, which is zero."""
    with pytest.raises(StickslipError, match=r"'right' is entered without speed at t = 0.*start with a speed"):
        simulate(fmu, 1.0, parameters={"delta": 0.0})


def test_an_elastic_impact_keeps_speed_and_has_hertz_duration():
    """mu = 0, hard stop: duration 2 a/v B(2/5, 1/2)/(5/2), a^(5/2) = 5 v^2/(4 k0); restitution 1."""
    k0, v = 1e9, 0.5
    run = simulate(HINGE, 0.2, start={"x": 0.01, "v": v}, parameters={"k0": k0, "ce": 1.0, "zeta": 0.0, "delta": 0.01})
    leave = run.events[0]
    assert leave.after == AWAY
    deepest = (5 * v**2 / (4 * k0)) ** 0.4
    # spring and force change the speed by about one part in 1e-3 s
    assert leave.time == pytest.approx(2 * deepest / v * beta(0.4, 0.5) * 0.4, rel=1e-5)
    at = simulate(
        HINGE,
        0.2,
        start={"x": 0.01, "v": v},
        parameters={"k0": k0, "ce": 1.0, "zeta": 0.0, "delta": 0.01},
        output_times=[leave.time],
    )
    assert at["v"][0] == pytest.approx(-v, rel=1e-4)


def test_damping_of_an_impact_is_that_of_the_law():
    """Hard stop: v_out from the closed form of F = k d^n (1 + mu d'/v0): mu (e' + 1) = ln((1 + mu)/(1 - mu e'))."""
    from scipy.optimize import brentq

    mu = 3 * (1 - 0.9**2) / 4
    restitution: Any = brentq(lambda e: mu * (e + 1) - np.log((1 + mu) / (1 - mu * e)), 0.1, 0.9999)
    start, parameters = {"x": 0.01, "v": 1.0}, {"k0": 1e15, "zeta": 0.0}
    leave = simulate(HINGE, 0.1, start=start, parameters=parameters).events[0]
    at = simulate(HINGE, 0.1, start=start, parameters=parameters, output_times=[leave.time])
    # during the contact, 1e-5 long, spring and force do what they do
    assert at["v"][0] == pytest.approx(-restitution, rel=2e-5)


@BOTH
def test_weak_impacts_cost_more_and_come_to_an_end(fmu):
    """Entry speeds from 1e-2 to 1e-12: steps grow like v0^-0.4; the motion tends to a limit."""
    steps, ends = [], []
    for exponent in range(2, 13, 2):
        run = simulate(fmu, 4.0, start={"x": 0.01, "v": 10.0**-exponent}, parameters={"f": 0.414, "tau": 1.885})
        steps.append(run.steps)
        ends.append(run["x"][-1])
    assert steps[-1] < 40_000
    assert max(after / before for before, after in pairwise(steps)) < 10**0.8 * 1.05
    assert abs(ends[-1] - ends[-2]) < abs(ends[-2] - ends[-3]) < abs(ends[-3] - ends[-4])


@BOTH
def test_impacts_too_weak_for_numbers_are_refused(fmu):
    with pytest.raises(StickslipError, match="cannot be continued beyond"):
        simulate(fmu, 4.0, start={"x": 0.01, "v": 1e-300}, parameters={"tau": 1.5})


@BOTH
def test_energy_balance(fmu):
    """d energy/dt = power_input - power_dissipated - power_stops, integrated over ten periods."""
    t = np.linspace(0.0, 10 / 0.429, 200_001)
    run = simulate(fmu, t[-1], output_times=t)
    supplied = np.trapezoid(run["power_input"] - run["power_dissipated"] - run["power_stops"], t)
    # the trapezoidal rule is good to (1e-4)^(3/2) at each of the forty ends of contacts
    assert run["energy"][-1] - run["energy"][0] == pytest.approx(supplied, abs=1e-8)
    assert supplied != 0.0
    assert (run["power_dissipated"] >= 0.0).all()
