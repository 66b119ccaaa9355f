"""The next experiment on a calibrated model: foretold deviations against those of a calibration with such a log."""

from __future__ import annotations

import numpy as np
import pytest
from known_deviation import deviation
from noisy_belt import noisy

from fmu_models.base.errors import StickslipError
from identification.calibration.calibrate import calibrate
from identification.next_step.experiments import rank_experiments


@pytest.fixture(scope="module")
def short(belt):
    """Friction and spring, from a log at one frequency of the drive."""
    return calibrate(belt, noisy(belt, 1, 20.0, 201), free=["a0", "k"], guesses=1, attempts=1)


def test_what_is_foretold_is_what_a_log_like_the_first_would_add(belt, short):
    """The same log once more: deviations fall by the root of two."""
    (again,) = rank_experiments(short, belt, [{}], duration=20.0, samples=200).candidates
    for name in ("a0", "k"):
        assert again.deviations[name] == pytest.approx(deviation(short[name]) / 2**0.5, rel=0.15)


def test_candidates_are_ranked_and_those_without_a_run_refused(belt, short):
    tried = [{"omega": 0.8}, {"f0": 0.0, "v_dr": 1.0}, {"f0": 2.0, "v_dr": 0.3}, {"m": -1.0}]
    found = rank_experiments(short, belt, tried, duration=20.0, samples=200, only=["k"])
    sizes = [one.size for one in found.candidates]
    assert sizes == sorted(sizes) and sizes[0] < sizes[1]
    now = found.deviations["k"]
    assert now is not None and float(np.max(found.frame["sd k"])) < now
    assert found.frame["sd k"].iloc[0] == found.candidates[0].deviations["k"]


@pytest.mark.parametrize(
    ("candidate", "more", "words"),
    [
        ({"kk": 1.0}, {}, "'kk' is nothing that an experiment on forced_stick_slip can set"),
        ({"k": 1.0}, {}, "'k' is nothing"),
        ({}, {"duration": 0.0}, "a duration above 0"),
        ({}, {"only": ["m"]}, "calibrated without 'm'"),
    ],
)
def test_what_no_experiment_can_be_is_a_sentence(belt, short, candidate, more, words):
    with pytest.raises(StickslipError, match=words):
        rank_experiments(short, belt, [candidate], **{"duration": 20.0, **more})
