"""Times of events as what is measured: alone, as heard, and beside samples."""

from __future__ import annotations

import numpy as np
import pytest
from known_deviation import deviation

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate
from identification.calibration.calibrate import calibrate
from identification.calibration.follow import follow
from identification.calibration.log import model_log

TRUE = {"e": 0.7, "A": 6e-3}
NOISE = 1e-5  # s


@pytest.fixture(scope="module")
def ball():
    return load("bouncing_ball")


@pytest.fixture(scope="module")
def hits(ball):
    """18 impacts of a chaotic motion, 0.1 to 0.3 s apart."""
    times = np.array([event.time for event in simulate(ball, 3.0, parameters=TRUE).impacts])
    return times + NOISE * np.random.default_rng(4).normal(size=times.size)


def test_ball_is_found_from_its_sound_alone(ball, hits, tmp_path):
    file = tmp_path / "impacts.csv"
    np.savetxt(file, 1e3 * hits, header="t_hit [ms]", comments="")
    first = {"e": 0.95, "A": 3.6e-3, "phi0": 0.25}
    found = calibrate(ball, str(file), free=list(first), parameters=first, events={"table": "t_hit"})
    for name, value in {**TRUE, "phi0": 0.0}.items():
        assert abs(found[name].value - value) < 4 * deviation(found[name])
    assert deviation(found["e"]) < 2e-4
    (line,) = found.residuals
    assert (line.variable, line.unit, line.samples) == ("table", "s", hits.size)
    # 5 of 18 times go into the unknowns
    assert 0.5 * NOISE < line.rms < 1.4 * NOISE
    assert found.horizon is not None and found.horizon < 3.0


def test_exact_times_give_an_exact_fit_and_are_followed_from_the_start_that_was_found(ball):
    """23 impacts, from elsewhere than where the model starts by itself."""
    elsewhere = {"x": 0.006, "v": -0.3}
    times = np.array([event.time for event in simulate(ball, 3.0, parameters=TRUE, start=elsewhere).impacts])
    log = model_log({"t_hit": times}, ball, events={"table": "t_hit"}, name="heard")
    told = calibrate(ball, log, free=["e"], parameters={**TRUE, **elsewhere}, guesses=1, attempts=1)
    # to rounding: runs with derivatives take series of a flight, which is one step without them
    assert told.residuals[0].rms < 1e-15 and [one.misfit for one in told.minima] == [1.0]
    found = calibrate(ball, log, free=["e"], parameters=TRUE, attempts=1)
    assert [one.value for one in found.starts] == pytest.approx([0.006, -0.3], rel=1e-6)
    (line,) = follow(found, ball, log).residuals
    assert line.samples == 23 and line.rms < NOISE


def test_event_times_beside_samples(ball, hits):
    time = np.linspace(0, 3, 1501)
    run = simulate(ball, 3.0, parameters=TRUE, output_times=time)
    x = run["x"] + 2e-4 * np.random.default_rng(5).normal(size=1501)
    log = {"time": time, "x": x, "t_hit": np.append(hits, np.full(1501 - hits.size, np.nan))}
    settings = {"free": ["e", "A"], "parameters": {"e": 0.5, "A": 8e-3}}
    both = calibrate(ball, log, events={"table": "t_hit"}, **settings)
    samples = calibrate(ball, {"time": time, "x": x}, **settings)
    for name, value in TRUE.items():
        assert abs(both[name].value - value) < 4 * deviation(both[name])
    assert [line.unit for line in both.residuals] == ["m", "s"]
    assert deviation(both["e"]) < deviation(samples["e"])


@pytest.mark.parametrize(
    ("log", "events", "words"),
    [
        ({"t": [1.0, 2, 3, 4]}, {"floor": "t"}, "no contact 'floor'"),
        ({"t": [1.0, 2, 3, 4]}, {"table": "hit"}, "no column 'hit'"),
        ({"t": [1.0, 2, 3]}, {"table": "t"}, "3 event times; 4 or more"),
        ({"t": [1.0, 3, 2, 4]}, {"table": "t"}, "ascending"),
    ],
)
def test_event_times_that_do_not_do(ball, log, events, words):
    with pytest.raises(StickslipError, match=words):
        model_log(log, ball, events=events)
