"""Calibration of models with known truth: values, intervals, what is not told, and what bad input answers."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from known_deviation import deviation
from noisy_belt import FREE, NOISE, OFF, TRUE, noisy
from threadpoolctl import threadpool_info, threadpool_limits

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from identification.calibration.calibrate import calibrate
from identification.calibration.descent import Minimum, best_first
from identification.calibration.log import model_log
from identification.calibration.nodes import nodes_of
from identification.calibration.pose import Settings, problem_of
from identification.calibration.result import read_calibration
from identification.calibration.search import Plan, Search
from identification.calibration.segments import Sensor
from identification.inference.problem import Solution


def test_stick_slip_is_found_from_half_off_within_its_deviations(found):
    """Residuals are the noise, and every value within four deviations, which are a few per cent at most."""
    assert found.residuals[0].rms == pytest.approx(NOISE, rel=0.1)
    for name, value in TRUE.items():
        sd = deviation(found[name])
        assert abs(found[name].value - value) < 4 * sd
        assert sd < 0.03 * value
    assert found["x(0)"].value == pytest.approx(1.040922, abs=0.015)
    assert found.residuals[0].order == 0 and found.directions == () and found.horizon is None


def test_held_out_log_is_followed_to_its_noise(found):
    held_out = found.residuals[-1]
    assert held_out.held_out and held_out.samples == 401
    assert held_out.rms == pytest.approx(NOISE, rel=0.15)


def test_free_run_profile_and_lmfit_agree_with_the_result(found):
    log = found.log()
    assert np.sqrt(np.mean((found.free_run()["x"] - log.measured["x"]) ** 2)) == pytest.approx(found.residuals[0].rms)
    low, high = found.interval("k")
    (interval,) = found.profiles("k")
    # the profile of a nearly linear parameter is its interval to a tenth of its width
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=0.1 * (high - low))
    assert found.to_lmfit()[1].params["a0"].value == pytest.approx(found["a0"].value)


def test_result_is_read_back_and_shows_itself(found, tmp_path):
    path = tmp_path / "r.json"
    path.write_text(json.dumps(found.to_dict(), allow_nan=False), encoding="utf-8")
    again = read_calibration(path)
    assert again == dataclasses.replace(found, solved=None)
    assert "a3" in again.summary() and "held out" in again.summary()
    assert found.figure(tmp_path / "r.svg").stat().st_size > 1000
    with pytest.raises(StickslipError, match="read from a file"):
        again.free_run()


def test_two_logs_share_parameters_or_keep_their_own(belt):
    logs = [noisy(belt, 1), noisy(belt, 2, parameters={"f0": 0.2})]
    first = {"f0": 0.12, "k": 0.9}
    both = calibrate(belt, logs, free=["k", "f0"], parameters=first, each=["f0"])
    assert [one.name for one in both.parameters] == ["k", "f0 [log 1]", "f0 [log 2]"]
    for name, value in (("k", 1.0), ("f0 [log 1]", 0.1), ("f0 [log 2]", 0.2)):
        assert abs(both[name].value - value) < 4 * deviation(both[name])
    shared = calibrate(belt, logs, free=["k", "f0"], parameters=first, attempts=1)
    # the log that does not fit counts as noisy, and says so
    assert shared.residuals[1].rms > 5 * both.residuals[1].rms


@pytest.mark.nightly
def test_input_is_a_column_of_the_log(belt):
    time = np.linspace(0, 30, 301)
    speed = 1 + 0.3 * np.sin(0.7 * time)
    log = noisy(belt, 5, 30.0, 301, inputs={"v_dr": Signal(time, speed)})
    right = calibrate(belt, {**log, "v_dr": speed}, free=["k", "a0"], parameters={"k": 1.3})
    assert right.residuals[0].rms == pytest.approx(NOISE, rel=0.12)
    assert abs(right["k"].value - 1) < 4 * deviation(right["k"])
    held = calibrate(belt, {**log, "v_dr": speed}, free=["k", "a0"], parameters={"k": 1.3}, hold=["v_dr"])
    assert held.residuals[0].rms > right.residuals[0].rms


@pytest.mark.nightly
def test_sensor_with_delay_offset_and_clip(belt):
    """30 ms of delay at 100 ms between samples, read at shifted times of the run."""
    log = noisy(belt, 6)
    late = simulate(belt, 60.0, output_times=np.maximum(log["time"] - 0.03, 0.0)[1:])
    noise = NOISE * np.random.default_rng(8).normal(size=600)
    seen = {"time": log["time"][1:], "x": np.clip(late["x"] + 0.2 + noise, -10.0, 1.3)}
    found = calibrate(
        belt,
        seen,
        free=["k", "f0"],
        parameters={"k": 0.8, "f0": 0.13},
        sensors={"x": Sensor(clip=(-10.0, 1.3), longest=0.2)},
        sensed=[("x", "offset"), ("x", "delay")],
    )
    for name, value in (("x delay", 0.03), ("x offset", 0.2), ("k", 1.0)):
        assert abs(found[name].value - value) < 4 * deviation(found[name])
    assert deviation(found["x delay"]) < 0.02


def test_residuals_alone_are_those_with_slopes(belt):
    """With a delay, a clip and segments that are to meet; slopes agree with differences of residuals."""
    log = {**noisy(belt, 6, 20.0, 201), "t_stick": np.append([3.0, 7.0, 11.0, 15.0], np.full(197, np.nan))}
    settings = Settings(sensors={"x": Sensor(clip=(-10.0, 1.3))}, sensed=[("x", "delay")], events={"belt": "t_stick"})
    problem, _ = problem_of(belt, [model_log(log, belt, events=settings.events)], ["k", "a0"], settings)
    nodes = nodes_of(problem, [problem.first], {"x": "v"}, 4)
    problem, x = nodes.placed(problem.first, nodes.rolled(problem.first)[0])
    here = problem.evaluate(x)
    np.testing.assert_allclose(problem.residual(x), here.residual, atol=1e-9)
    for place in range(len(x)):
        step = 1e-6 * np.eye(len(x))[place]
        slope = (problem.residual(x + step) - problem.residual(x - step)) / 2e-6
        smooth = np.abs(slope - here.gradient[:, place]) < 1e-3 * (1 + np.abs(slope).max())
        assert np.mean(smooth) > 0.95  # but for samples within a step of an event or a limit of the sensor


def test_collinear_parameters_are_named(belt):
    """Mass, spring and all forces only set the scale of the forces."""
    with pytest.warns(UserWarning, match="At the guess m, .* move together unseen"):
        found = calibrate(belt, noisy(belt, 3), free=["m", *FREE], parameters={"k": 0.9}, attempts=1)
    assert len(found.directions) == 1
    assert all(name in found.directions[0] for name in ("m", "k", "a0", "a1", "a3", "f0"))
    assert found["m"].standard_deviation is None and found.interval("m") == (-np.inf, np.inf)


def test_prior_closes_a_direction(belt):
    found = calibrate(
        belt, noisy(belt, 3), free=["m", *FREE], parameters={"k": 0.9}, priors={"m": (1.0, 0.02)}, attempts=1
    )
    assert found.directions == ()
    assert deviation(found["m"]) == pytest.approx(0.02, rel=0.1)
    assert abs(found["k"].value - 1.0) < 4 * deviation(found["k"])


@pytest.mark.parametrize(
    ("change", "more", "words"),
    [
        (lambda log: {**log, "z": log["x"]}, {}, "Column 'z' of .* is no state, output or input"),
        (lambda log: {"time": log["time"]}, {}, "measures nothing"),
        (lambda log: {"x": log["x"]}, {}, "no column 'time'"),
        (lambda log: {**log, "time": log["time"][::-1]}, {}, "run back"),
        (lambda log: {**log, "x": np.where(log["time"] == 3.0, np.nan, log["x"])}, {}, "1 cells without a number.* 31"),
        (lambda log: log, {"inputs": {"v_dr": Signal([0, 10], [1, 1])}}, "'v_dr' covers 0 s to 10 s.*60 s"),
        (lambda log: log, {"free": ["kk"]}, "no parameter 'kk'"),
        (lambda log: log, {"free": ["k", "k"]}, "free twice"),
        (lambda log: log, {"free": ["k", "x"]}, "'x' is a state. Its start is sought"),
        (lambda log: log, {"free": []}, "at least one parameter"),
        (lambda log: log, {"bounds": {"k": (2.0, 3.0)}}, "'k' begins at 1 N/m, outside of its bounds 2 to 3"),
        (lambda log: log, {"priors": {"m": (1.0, 0.1)}}, "'m' has a bound or a prior and is not free"),
        (lambda log: log, {"each": ["m"]}, "'m' is to have a value for each log"),
        (lambda log: log, {"starts": ["w"]}, "no start state 'w'"),
        (
            lambda log: {name: values[:3] for name, values in log.items()},
            {},
            "3 samples cannot determine the 3 unknowns",
        ),
        (lambda log: log, {"sensed": [("x", "colour")]}, "A sensor is VARIABLE"),
    ],
)
def test_bad_input_is_a_sentence_before_any_search(belt, change, more, words):
    log = change(noisy(belt, 3))
    with pytest.raises(StickslipError, match=words):
        calibrate(belt, log, **{"free": ["k"], **more})


def test_first_values_that_exclude_each_other_are_refused_and_no_guess_has_such():
    block = load("block_on_belt")
    log = noisy(block, 3, noise=1e-4)
    with pytest.raises(StickslipError, match=r"No motion can begin with the first values.*mu_k exceeds mu_s"):
        calibrate(block, log, free=["mu_s", "mu_k"], parameters={"mu_s": 0.3})
    free, parameters = ["mu_s", "mu_k"], {"mu_s": 0.5, "mu_k": 0.45}
    posed = problem_of(block, [model_log(log, block)], free, Settings(parameters=parameters))
    drawn = np.array(Search(*posed, Plan(guesses=40)).draws)
    assert len(drawn) == 40 and (drawn[:, 0] >= drawn[:, 1]).all()


def test_parameter_without_effect_is_refused():
    ball = load("bouncing_ball")
    with pytest.raises(StickslipError, match="'m' has no effect"):
        calibrate(ball, noisy(ball, 1, 0.3, 101, noise=5e-5), free=["m", "e"], guesses=4)


def test_an_interrupt_keeps_the_best_so_far(belt):
    def stop(fraction):
        if fraction > 0.31:  # behind the scan
            raise KeyboardInterrupt

    found = calibrate(belt, noisy(belt, 3), free=FREE, parameters=OFF, progress=stop)
    assert found.interrupted and "Interrupted" in found.warnings[-1]
    assert found.residuals[0].rms < 20 * NOISE


def test_an_interrupt_of_segments_parted_otherwise_keeps_what_was_found(belt, monkeypatch):
    minima, parted = Search.minima, []

    def interrupted(self: Search) -> tuple[Minimum, ...]:
        parted.append(self.plan.segments)
        if self.plan.segments:
            raise KeyboardInterrupt
        return minima(self)

    monkeypatch.setattr(Search, "minima", interrupted)
    monkeypatch.setattr(Search, "_anew", lambda self, minima: minima)  # which would end in the same
    settings = {"guesses": 2, "attempts": 1, "noise": {"x": NOISE / 2}}
    found = calibrate(belt, noisy(belt, 3, 40.0, 401), free=["k"], **settings)
    assert parted[0] is None and parted[1] and found.interrupted
    assert abs(found["k"].value - TRUE["k"]) < 0.01


def test_an_interrupt_of_a_worse_search_is_said_of_the_best(belt):
    problem, _ = problem_of(belt, [model_log(noisy(belt, 3, 10.0, 101), belt)], ["k"], Settings())
    best, worse = (
        Minimum(problem, Solution(x, problem.evaluate(x), True, "", (False,) * len(x)), None, interrupted)
        for x, interrupted in ((problem.first, False), (1.2 * problem.first, True))
    )
    assert best.misfit < worse.misfit
    ordered = best_first([worse, best])
    assert ordered[0].misfit == best.misfit and ordered[0].interrupted
    assert not best_first([best])[0].interrupted


def test_small_matrices_stay_in_one_thread(belt):
    """Threads that wait for each other at every column cost more than the search."""
    threads = set()

    def look(_):
        threads.update(library["num_threads"] for library in threadpool_info())
        raise KeyboardInterrupt

    with threadpool_limits(2), pytest.raises(KeyboardInterrupt):
        calibrate(belt, noisy(belt, 3), free=["k"], progress=look)
    assert threads == {1}
