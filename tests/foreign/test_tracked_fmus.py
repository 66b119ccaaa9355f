"""Tracks of FMUs of others: states that are shown, and one that shows none."""

from __future__ import annotations

import numpy as np
import pytest
from models import Models

from fmu_models.base.errors import StickslipError
from fmu_models.importer.simulate import simulate_any
from identification.calibration.online import track_online
from identification.calibration.track import track


def test_the_parameter_of_another_tools_fmu_is_tracked(model: Models):
    """Van der Pol from x with noise of 1 %: mu stays, and the speed is followed."""
    fmu, time = model("van_der_pol"), np.linspace(0, 10, 201)
    run = simulate_any(fmu, 10.0, output_times=time, tolerance=1e-10)
    names = list(fmu.states)
    log = {"time": time, names[0]: run[names[0]] + 0.02 * np.random.default_rng(2).normal(size=201)}
    course = track(fmu, log, drift=["mu"], segments=8)
    (mu,), (_, speed) = course.parameters, course.states
    assert mu.constant and mu.values[0] == pytest.approx(1.0, abs=4 * mu.deviations[0])
    assert np.mean(np.abs(speed.values - run[names[1]]) < 2 * np.array(speed.deviations)) > 0.8


@pytest.mark.parametrize(
    ("name", "measured", "until", "noise", "rates"),
    [("van_der_pol", "x", 10.0, 0.02, {"mu": 0.01}), ("ball", "h", 1.6, 0.005, {"e": 0.0})],
)
def test_another_tools_fmu_is_followed_sample_by_sample(model: Models, name, measured, until, noise, rates):
    """A parameter that walks, and one that only impacts tell."""
    fmu, time = model(name), np.linspace(0, until, 321)
    run = simulate_any(fmu, until, output_times=time, tolerance=1e-10)
    log = {"time": time, measured: run[measured] + noise * np.random.default_rng(2).normal(size=321)}
    (sought,) = rates
    known = {sought: 1.1 * fmu.start_of(sought)}
    course = track_online(fmu, log, drift=[sought], rates=rates, noise={measured: noise}, parameters=known)
    (parameter,) = course.parameters
    assert parameter.values[-1] == pytest.approx(fmu.start_of(sought), abs=3 * parameter.deviations[-1])
    assert parameter.deviations[-1] < 0.05 * fmu.start_of(sought)
    for path in course.states:
        assert np.mean(np.abs(path.values - run[path.name])[40:] < 2.5 * np.array(path.deviations)[40:]) > 0.8


def test_what_shows_no_states_is_refused(model: Models):
    log = {"time": np.linspace(0, 1, 101), "h": np.linspace(1, 0, 101)}
    with pytest.raises(StickslipError, match="co-simulated and does not show its states"):
        track(model("ball_steps"), log, drift=["g"])
