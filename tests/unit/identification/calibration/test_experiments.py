"""The next experiment on a calibrated model: foretold deviations against those of a calibration with such a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_deviation import deviation
from noisy_belt import NOISE, noisy

from fmu_models import Automaton, Input, Parameter, State
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from identification.calibration.calibrate import calibrate
from identification.next_step.experiments import rank_experiments
from identification.next_step.signals import SignalShape, design_experiment, signal_frame

SPEEDS = {"v_dr": (0.6, 1.4)}


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


def of_second_log(belt, seed: int, speed: Signal) -> dict[str, float]:
    """Deviations of a calibration from the first log and one with this speed of the belt."""
    time = np.linspace(0.0, 20.0, 241)
    run = simulate(belt, 20.0, output_times=time, inputs={"v_dr": speed})
    noise = NOISE * np.random.default_rng(seed).normal(size=241)
    column = np.interp(time, speed.time, speed.value)
    logs = [noisy(belt, 1, 20.0, 201), {"time": time, "x": run["x"] + noise, "v_dr": column}]
    both = calibrate(belt, logs, free=["a0", "k"], guesses=1, attempts=1)
    for name, truth in (("a0", 1.5), ("k", 1.0)):
        assert abs(both[name].value - truth) < 4 * deviation(both[name])
    return {name: deviation(both[name]) for name in ("a0", "k")}


@pytest.mark.nightly
def test_a_designed_input_comes_true_and_is_better_than_a_random_one(belt, short):
    """Both within the same limits; logs of both are made and calibrated."""
    found = design_experiment(short, belt, inputs=SPEEDS, duration=20.0, samples=240)
    designed, drawn = found.candidates[:2]
    assert (designed.label, drawn.label) == ("designed", "best of random") and designed.size < drawn.size - 0.1
    speed = designed.signals["v_dr"]
    assert speed.value.min() >= 0.6 - 1e-12 and speed.value.max() <= 1.4 + 1e-12
    came = of_second_log(belt, 5, speed)
    for name, foretold in designed.deviations.items():
        assert came[name] == pytest.approx(foretold, rel=0.2)
    random = SignalShape().signal(SignalShape().draw(np.random.default_rng(3)), SPEEDS["v_dr"], 20.0)
    other = of_second_log(belt, 6, random)
    assert np.prod(list(came.values())) < 0.7 * np.prod(list(other.values()))


def test_levels_and_constants_are_designed_and_written(belt, short, tmp_path):
    limits = {"omega": (0.8, 2.0), "x": (0.5, 1.5)}
    found = design_experiment(
        short, belt, inputs=SPEEDS, within=limits, duration=20.0, shape=SignalShape(levels=4), samples=100, only=["k"]
    )
    designed = found.candidates[0]
    assert designed.label == "designed" and designed.size < found.candidates[1].size - 0.1
    assert list(designed.deviations) == ["k"]
    for name, (low, high) in limits.items():
        assert low <= designed.settings[name] <= high
    frame = signal_frame(designed, belt)
    assert list(frame) == ["time [s]", "v_dr [m/s]"] and len(frame) == 9 and len(set(frame["v_dr [m/s]"].tolist())) <= 4
    frame.to_csv(tmp_path / "u.csv", index=False)
    settings = {name: value for name, value in designed.settings.items() if name == "omega"}
    runs = [
        simulate(belt, 20.0, parameters=settings, inputs={"v_dr": form}, output_times=np.linspace(0, 20, 50))
        for form in (designed.signals["v_dr"], f"{tmp_path / 'u.csv'}:v_dr")
    ]
    assert runs[0]["x"] == pytest.approx(runs[1]["x"], abs=1e-9)


def test_the_best_input_of_an_integrator_is_at_its_limit():
    """x' = p u from a start that is sought: sd = noise/(u sqrt(sum (t - mean)^2)), so that the largest |u| is best."""
    x, p, u = State("x", "m", "place"), Parameter("p", 2.0, "1", "gain"), Input("u", 1.0, "m/s", "speed")
    model = Automaton(name="integrator", title="Integrator", source="closed form", states=[x], flows={x: p * u})
    fmu = load(model)
    first = calibrate(fmu, noisy(fmu, 1, 5.0, 51), free=["p"], guesses=1, attempts=1)
    found = design_experiment(
        first, fmu, inputs={"u": (-1.0, 3.0)}, duration=5.0, shape=SignalShape(levels=1), samples=100
    )
    times = np.linspace(0.0, 5.0, 101)[1:]
    now = deviation(first["p"])
    then = first.residuals[0].rms / (3.0 * np.sqrt(np.sum((times - times.mean()) ** 2)))
    assert found.candidates[0].signals["u"].value == pytest.approx(3.0, abs=1e-6)
    assert found.candidates[0].deviations["p"] == pytest.approx((now**-2 + then**-2) ** -0.5, rel=1e-4)


def test_what_would_tell_what_the_logs_do_not_is_said(belt, short):
    """Mass, spring and all forces set a scale alone, which a measured force tells."""
    free = ["m", "k", "a0", "a1", "a3", "f0"]
    with pytest.warns(UserWarning, match="move together"):
        scaled = calibrate(belt, noisy(belt, 1, 20.0, 201), free=free, guesses=1, attempts=1)
    (said,) = rank_experiments(scaled, belt, [{"v_dr": 0.8}], duration=20.0, samples=200).sentences
    assert "Nothing that was tried tells m, k, a0, a1, a3, f0" in said and "or measure one of F, " in said
    untold = replace(short["k"], standard_deviation=None)
    lacking = replace(short, parameters=(short["a0"], untold))
    found = rank_experiments(lacking, belt, [{"omega": 0.8}], duration=20.0, samples=200)
    assert found.deviations["k"] is None
    assert found.sentences[0].startswith("The logs do not tell k. This would: omega = 0.8, after which k = 0.99999 ±")


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({}, "Say what may be set"),
        ({"inputs": {"u": (0, 1)}}, "has no input 'u'"),
        ({"inputs": SPEEDS, "within": SPEEDS}, "either a signal or a constant"),
        ({"within": {"omega": (2.0, 1.0)}}, "leave nothing"),
        ({"inputs": SPEEDS, "shape": SignalShape(period=0.0)}, "must be above 0"),
        ({"within": {"m": (-2.0, -1.0)}}, "has a run"),
    ],
)
def test_limits_without_an_experiment_are_a_sentence(belt, short, asked, words):
    with pytest.raises(StickslipError, match=words):
        design_experiment(short, belt, duration=20.0, samples=50, **asked)


@pytest.mark.parametrize("shape", [SignalShape(harmonics=3, period=4.0), SignalShape(levels=5)])
def test_signals_of_any_size_stay_within_limits(shape):
    random = np.random.default_rng(1)
    values = [shape.signal(size * shape.draw(random), (-1.0, 3.0), 10.0).value for size in (0.1, 1.0, 10.0)]
    assert all(value.min() >= -1.0 - 1e-12 and value.max() <= 3.0 + 1e-12 for value in values)
    assert np.ptp(values[0]) < 1.5 and max(np.abs(values[2] - 1.0)) == pytest.approx(2.0)
