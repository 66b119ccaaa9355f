"""States and drifting parameters along a log, against known truth."""

from __future__ import annotations

import json

import numpy as np
import pytest
from noisy_belt import noisy

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.run import simulate
from identification.calibration.track import track

UNTIL, NOISE = 60.0, 0.02


def log_of(drifting: dict[str, np.ndarray], seed: int) -> dict[str, np.ndarray]:
    noise = NOISE * np.random.default_rng(seed).normal(size=601)
    return {"time": drifting["time"], "x": drifting["x"] + noise}


def test_a_friction_that_drifts_is_followed_and_so_is_the_speed(belt, drifting):
    """Three logs: 2 sd hold .95 of the values (measured: .99, for a straight drift is smoother than a walk)."""
    held, speeds, off = [], [], []
    for seed in range(3):
        course = track(belt, log_of(drifting, seed), drift=["a0"])
        (a0,), nodes = course.parameters, np.array(course.nodes)
        middle = (nodes + np.append(nodes[1:], UNTIL)) / 2
        truth = 1.5 * (1 + 0.2 * middle / UNTIL)
        assert not a0.constant and a0.gain > 1000 and "'a0' drifts from" in a0.sentence
        held.append(np.abs(a0.values - truth) < 2 * np.array(a0.deviations))
        off.append(np.array(a0.deviations) / truth)
        (speed,) = (path for path in course.states if path.name == "v")
        speeds.append(np.abs(speed.values - drifting["v"]) < 2 * np.array(speed.deviations))
    assert np.mean(held) >= 0.9 and np.max(off) < 0.02
    assert np.mean(speeds) > 0.85


def test_one_that_stays_is_said_to_stay(belt):
    # one of twenty that stay gains more by chance: seed 1 is such a log (measured: 1 of 32 others)
    course = track(belt, noisy(belt, 23, noise=NOISE), drift=["a0", "k"])
    for path, truth in zip(course.parameters, (1.5, 1.0), strict=True):
        assert path.constant and "stays" in path.sentence
        assert np.abs(np.array(path.values) - truth).max() < 4 * max(path.deviations)
        assert np.ptp(path.values) < 0.1 * min(path.deviations)


def test_states_alone_are_smoothed_to_less_than_their_noise(belt):
    course = track(belt, noisy(belt, 2, noise=NOISE), states=["x", "F"])
    truth = simulate(belt, 60.0, output_times=np.linspace(0, 60, 601))
    assert [path.name for path in course.states] == ["x", "F"] and course.parameters == ()
    place = course.states[0]
    assert np.sqrt(np.mean((place.values - truth["x"]) ** 2)) < 0.3 * NOISE
    assert np.mean(np.abs(place.values - truth["x"]) < 2 * np.array(place.deviations)) > 0.8
    assert course.residuals[0].rms == pytest.approx(NOISE, rel=0.15)


def test_a_course_shows_itself(belt, tmp_path):
    course = track(belt, noisy(belt, 3, 30.0, 301, noise=NOISE), drift=["a0"], segments=10)
    frame = course.frame
    assert list(frame) == ["time", "x", "sd x", "v", "sd v", "a0", "sd a0"] and len(frame) == 301
    plain = json.loads(json.dumps(course.to_dict(), allow_nan=False))
    assert plain["type"] == "stickslip track" and plain["sentences"] == course.sentences
    assert "a0" in course.summary() and "Residuals" in course.summary()
    assert course.figure(tmp_path / "a0.svg").stat().st_size > 1000
    axes = track(belt, noisy(belt, 3, 30.0, 301, noise=NOISE), segments=10).plot()
    assert axes.get_ylabel() == "x (m)"


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"drift": ["kk"]}, "no parameter 'kk'"),
        ({"states": ["w"]}, "no state or output 'w'"),
        ({"sensed": [("x", "gain")]}, "no constants of sensors, such as 'x:gain'"),
        ({"drift": ["k"], "priors": {"k": (1.0, 0.1)}}, "one log and no priors"),
    ],
)
def test_what_a_track_does_not_take_is_a_sentence(belt, more, words):
    with pytest.raises(StickslipError, match=words):
        track(belt, noisy(belt, 3, 15.0, 151), **more)
