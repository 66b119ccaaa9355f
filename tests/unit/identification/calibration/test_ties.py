"""Unknowns of a calibration as `lmfit.Parameters`."""

from __future__ import annotations

import numpy as np
import pytest
from known_deviation import deviation
from lmfit import Parameters
from noisy_belt import noisy

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load
from identification.calibration.calibrate import calibrate
from identification.calibration.follow import follow
from identification.calibration.subject import Stretch, Window
from identification.calibration.systems import subject_of
from identification.calibration.ties import TiedSubject, of_lmfit


@pytest.fixture(scope="module")
def belt():
    return load("forced_stick_slip")


@pytest.fixture
def parameters() -> Parameters:
    """The truth is a0 = a1 = 1.5, k = 1."""
    them = Parameters()
    them.add("k", 1.3, min=0.5, max=3.0)
    them.add("a1", 1.2)
    them.add("m", 1.0, vary=False)
    them.add("a0", expr="a1*m")
    return them


def test_values_bounds_held_ones_and_expressions_are_taken(belt, parameters):
    found = calibrate(belt, noisy(belt, 3, 40.0, 401), free=parameters, attempts=1)
    assert [one.name for one in found.parameters] == ["k", "a1"]
    assert (found["k"].first, found["k"].minimum, found["k"].maximum) == (1.3, 0.5, 3.0)
    for name, value in (("k", 1.0), ("a1", 1.5)):
        assert abs(found[name].value - value) < 4 * deviation(found[name])
    assert found.held["m"] == 1.0 and found.held["a0"] == pytest.approx(found["a1"].value, rel=1e-12)
    followed = follow(found, belt, found.log())  # with the expressions' values
    assert followed.residuals[0].rms == pytest.approx(found.residuals[0].rms, rel=1e-3)


def test_slopes_follow_the_expressions(belt, parameters):
    """Also of times of events; by the difference of whole runs."""
    free, settings = of_lmfit(belt, parameters)
    ties = settings["ties"]
    subject = TiedSubject(subject_of(belt, (*free, *ties.tied.values()), ["x", "belt"]), ties)
    time = np.linspace(0.5, 9.0, 18)

    def run(a1: float):
        stretch = Stretch(Window(0.0, time, {}), {"k": 1.0, "a1": a1, "m": 1.0}, {"x": 1.0, "v": 0.0})
        return subject.respond(stretch)

    here, low, high = run(1.5), run(1.5 - 1e-5), run(1.5 + 1e-5)
    place = subject.by.index("a1")
    assert here.slopes.shape[2] == len(subject.by) == 4
    assert here.slopes[:, 0, place] == pytest.approx((high.values - low.values)[:, 0] / 2e-5, abs=1e-4)
    times, slopes = here.hits["belt"]
    assert slopes[:, place] == pytest.approx((high.hits["belt"][0] - low.hits["belt"][0]) / 2e-5, abs=1e-4)
    assert times.size


def test_states_named_there_are_starts(belt):
    them = Parameters()
    them.add("k", 1.3)
    them.add("x", 0.9)
    them.add("v", 0.0, vary=False)
    free, settings = of_lmfit(belt, them)
    assert free == ["k"] and settings["starts"] == ["x"]
    assert settings["parameters"] == {"k": 1.3, "x": 0.9, "v": 0.0} and settings["bounds"] == {}


def test_what_does_not_do_is_said(belt, parameters):
    with pytest.raises(StickslipError, match="'a0' is tied to others"):
        calibrate(belt, noisy(belt, 3, 20.0, 201), free=parameters, each=["k"])
    parameters.add("zz", 1.0)
    with pytest.raises(StickslipError, match="no parameter or state 'zz'"):
        of_lmfit(belt, parameters)
