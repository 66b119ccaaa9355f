"""Logs beside a calibration that was read back, its posterior, and its page."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from known_deviation import deviation
from noisy_belt import NOISE, noisy

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load
from fmu_models.simulation.signal import Signal
from identification.calibration.calibrate import calibrate
from identification.calibration.follow import follow
from identification.calibration.log import Reading, model_log
from identification.calibration.result import read_calibration
from identification.calibration.segments import Sensor
from identification.report.calibration_figures import followed_figure
from identification.report.calibration_page import calibration_findings
from identification.report.calibration_summary import followed_sentences
from identification.report.page import page


@pytest.fixture(scope="session")
def read_back(found, tmp_path_factory):
    path = tmp_path_factory.mktemp("calibration") / "r.json"
    path.write_text(json.dumps(found.to_dict(), allow_nan=False), encoding="utf-8")
    return read_calibration(path)


@pytest.fixture(scope="session")
def elsewhere(belt):
    """A log that begins far from where the calibration did."""
    return model_log(noisy(belt, 9, 30.0, 301, start={"x": 0.2, "v": 0.5}), belt, name="elsewhere")


def test_a_log_that_begins_elsewhere_is_followed_to_its_noise(belt, read_back, elsewhere):
    one = follow(read_back, belt, elsewhere)
    (line,) = one.residuals
    assert line.held_out and line.rms == pytest.approx(NOISE, rel=0.15) and line.chance > 1e-3
    assert line.share == pytest.approx(line.rms / np.std(elsewhere.measured["x"]))
    assert one.starts == pytest.approx({"x(0)": 0.2, "v(0)": 0.5}, abs=0.02)
    left = one.log.measured["x"] - one.modelled["x"]
    assert np.sqrt(np.mean(left**2)) == pytest.approx(line.rms)
    assert one.to_dict()["residuals"][0]["log"] == "elsewhere"


def test_contacts_between_start_and_end_do_not_hide_the_start():
    """60 impacts of a hinge from another start: a free run from what the first samples show ends elsewhere."""
    hinge = load("hinge_clearance")
    found = calibrate(hinge, noisy(hinge, 1, 10.0, 201, noise=5e-4), free=["delta"], guesses=1, attempts=1)
    log = model_log(noisy(hinge, 2, 30.0, 601, noise=5e-4, start={"x": 0.005, "v": -0.02}), hinge, name="elsewhere")
    one = follow(found, hinge, log)
    assert one.residuals[0].rms == pytest.approx(5e-4, rel=0.15)
    assert one.starts["v(0)"] == pytest.approx(-0.02, abs=0.01)


def test_a_model_that_differs_is_told_by_rms_and_colour(belt, read_back):
    stiffer = model_log(noisy(belt, 9, 30.0, 301, parameters={"k": 1.1}), belt, name="stiffer")
    (sentence,) = followed_sentences(read_back, [follow(read_back, belt, stiffer)])
    assert "times what it left in the calibration. The model or its parameters differ here." in sentence
    assert "What is left is coloured" in sentence


def test_a_variable_that_was_not_measured_before_is_compared_too(belt, read_back):
    one = follow(read_back, belt, model_log(noisy(belt, 9, 30.0, 301, name="v"), belt))
    assert one.residuals[0].rms == pytest.approx(NOISE, rel=0.15)
    assert "the calibration did not measure it" in followed_sentences(read_back, [one])[0]


def test_beyond_the_horizon_runs_begin_anew(belt, read_back, elsewhere):
    one = follow(replace(read_back, horizon=11.0), belt, elsewhere)
    assert len(one.begins) == 3 and one.begins[0] == 0
    assert one.residuals[0].rms == pytest.approx(NOISE, rel=0.15)
    # each has start states of its own: one log is followed with six unknowns, not two
    assert one.residuals[0].rms < follow(read_back, belt, elsewhere).residuals[0].rms
    assert np.size(followed_figure([one]).axes[0].lines[0].get_xdata()) == 301


def test_sensors_and_reading_are_kept_in_the_result(belt, read_back, tmp_path):
    bent = replace(read_back, sensors={"x": Sensor(2.0, 0.5, clip=(-np.inf, 3.0))}, reading=Reading({"x": "Place"}))
    (tmp_path / "bent.json").write_text(json.dumps(bent.to_dict(), allow_nan=False), encoding="utf-8")
    again = read_calibration(tmp_path / "bent.json")
    assert again == bent
    log = noisy(belt, 9, 30.0, 301)
    log = again.reading.read({"time": log["time"], "Place": np.minimum(2 * log["x"] + 0.5, 3.0)}, belt)
    (line,) = follow(again, belt, log).residuals
    assert line.variable == "x" and 0.5 * NOISE < line.rms < 2.1 * NOISE
    lacking = Reading(inputs={"v_dr": None})
    with pytest.raises(StickslipError, match="no column of the input 'v_dr', which the others had"):
        lacking.read(noisy(belt, 9), belt)


def test_inputs_are_read_as_they_were(belt):
    """A constant that was given is given again; what a signal drove must come with each log."""
    log, time = noisy(belt, 5, 15.0, 151), np.array([0.0, 15.0])
    held = calibrate(belt, log, free=["k"], inputs={"v_dr": 1.0}, guesses=1, attempts=1)
    assert held.reading.inputs == {"v_dr": 1.0}
    driven = calibrate(belt, log, free=["k"], inputs={"v_dr": Signal(time, np.ones(2))}, guesses=1, attempts=1)
    assert driven.reading.inputs == {"v_dr": None}


def test_posterior_of_a_small_case_is_its_normal_distribution(belt):
    log = noisy(belt, 1, 15.0, 151)
    small = calibrate(belt, log, free=["k"], parameters={"v": -0.72}, starts=["x"], guesses=1, attempts=1)
    posterior = small.sample(steps=400)
    assert [one.name for one in posterior.marginals] == ["k", "x(0)"]
    for one in posterior.marginals:
        # nearly linear: mean and deviation of the chains to a tenth of a deviation and 20 %
        assert one.mean == pytest.approx(small[one.name].value, abs=0.15 * deviation(small[one.name]))
        assert one.standard_deviation == pytest.approx(deviation(small[one.name]), rel=0.2)


@pytest.mark.nightly
def test_the_page_holds_values_logs_and_the_model_with_sliders(belt, read_back, elsewhere):
    findings = calibration_findings(read_back, belt, [elsewhere], interactive=True)
    text = page(findings)
    assert findings.notes == [] and text.count("<svg") == 3 and text.count("<iframe sandbox=") == 1
    held = json.loads(re.findall(r'id="data">(.*?)</script>', text, flags=re.S)[0].replace("<\\/", "</"))
    assert held["calibration"] == json.loads(json.dumps(read_back.to_dict()))
    assert "&#x27;x&#x27; is followed to" in text and "How to cite" in text
    low, high = read_back.interval("k")
    assert f'"low": {low!r}, "high": {high!r}' in html.unescape(html.unescape(text))
    still = page(calibration_findings(read_back, belt, []))
    assert "<iframe" not in still and "<script" not in still.replace("<script type=", "")
