"""Filters sample by sample: against Kalman's in closed form, the smoother, and known truth with contacts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from noisy_belt import noisy
from scipy.linalg import expm

from fmu_models import Automaton, Input, Output, Parameter, State, load
from fmu_models.base.errors import StickslipError
from fmu_models.simulation.run import simulate
from identification.calibration.online import OnlineTrack, track_online
from identification.calibration.track import track

K, C = 3.0, 0.4
NOISE = 0.02


@pytest.fixture(scope="module")
def oscillator():
    """x'' + C x' + K x = u + p, p to be followed."""
    x, v = State("x", "m", "place", start=0.5), State("v", "m/s", "speed")
    p, u = Parameter("p", 0.0, "m/s2", "load"), Input("u", 0.0, "m/s2", "drive")
    stiffness, damping = Parameter("k", K, "1/s2", "stiffness"), Parameter("c", C, "1/s", "damping")
    flow: dict[State, Any] = {x: v, v: u + p - damping * v - stiffness * x}
    outputs = [Output("a", flow[v], "m/s2", "acceleration")]
    return load(
        Automaton(name="linear", title="Oscillator", source="closed form", states=[x, v], flows=flow, outputs=outputs)
    )


def test_of_a_linear_model_it_is_kalmans_filter(oscillator):
    """Uneven samples, one of two variables missing now and then, a drive that jumps, walks of a state and a load."""
    random, time = np.random.default_rng(3), 0.0
    rates, noise = {"p": 0.3, "v": 0.1}, {"x": 0.02, "a": 0.5}
    run = OnlineTrack(oscillator, noise, rates=rates, deviations={"x": 0.3, "v": 0.2, "p": 1.0})
    flow = np.zeros((4, 4))  # of x, v, p, u
    flow[:2] = [[0, 1, 0, 0], [-K, -C, 1, 1]]
    walk = np.diag([0.0, rates["v"], rates["p"]]) ** 2
    mean, covariance, likelihood = np.array([0.5, 0.0, 0.0]), np.diag([0.3, 0.2, 1.0]) ** 2, 0.0
    for number in range(60):
        u, measured = float(random.normal()), {"x": 0.3 * random.normal(), "a": random.normal()}
        if number % 3 == 0:
            measured["a"] = np.nan
        if number:
            step = random.uniform(0.02, 0.3)
            time += step
            moved = expm(flow * step)
            mean = moved[:3, :3] @ mean + moved[:3, 3] * u
            covariance = moved[:3, :3] @ (covariance + walk * step) @ moved[:3, :3].T
        seen = {"x": (np.array([1.0, 0, 0]), 0.0), "a": (np.array([-K, -C, 1]), u)}
        here = [name for name in ("x", "a") if np.isfinite(measured[name]) and (number or name == "x")]
        rows, shift = np.array([seen[name][0] for name in here]), np.array([seen[name][1] for name in here])
        spread = rows @ covariance @ rows.T + np.diag([noise[name] ** 2 for name in here])
        gain, off = covariance @ rows.T @ np.linalg.inv(spread), np.array([measured[name] for name in here])
        off = off - rows @ mean - shift
        likelihood -= (off @ np.linalg.solve(spread, off) + np.linalg.slogdet(2 * np.pi * spread)[1]) / 2
        mean, covariance = mean + gain @ off, covariance - gain @ rows @ covariance
        found = run.update(time, measured, {"u": u})
        assert [found.values[name] for name in ("x", "v", "p")] == pytest.approx(mean, abs=1e-8)
        assert [found.deviations[name] for name in ("x", "v", "p")] == pytest.approx(
            np.sqrt(np.diag(covariance)), rel=1e-7
        )
    assert run.log_likelihood == pytest.approx(likelihood, rel=1e-8)


def test_a_friction_that_drifts_is_followed_as_the_smoother_does(belt, drifting):
    log = {"time": drifting["time"], "x": drifting["x"] + NOISE * np.random.default_rng(0).normal(size=601)}
    course = track_online(belt, log, drift=["a0"], rates={"a0": 0.01}, noise={"x": NOISE})
    (a0,), late = course.parameters, np.array(course.times) > 10
    truth = 1.5 * (1 + 0.2 * np.array(course.times) / 60.0)
    sd = np.array(a0.deviations)
    off = ((np.array(a0.values) - truth) / sd)[late]
    assert np.mean(np.abs(off) < 2) > 0.9 and np.max(sd[late]) < 0.03 and np.sqrt(np.mean(off**2)) > 0.3
    assert not a0.constant and a0.gain > 500
    (speed,) = (path for path in course.states if path.name == "v")
    assert np.mean(np.abs(speed.values - drifting["v"])[late] < 2 * np.array(speed.deviations)[late]) > 0.85
    smooth = track(belt, log, drift=["a0"], noise={"x": NOISE}).parameters[0]
    # at the end both know the same samples
    assert a0.values[-1] == pytest.approx(smooth.values[-1], abs=2 * sd[-1])
    assert np.median(smooth.deviations) < np.median(sd[late])
    assert course.residuals[0].rms == pytest.approx(NOISE, rel=0.15) and "sample by sample" in course.summary()


@pytest.mark.parametrize(
    ("model", "until", "noise"), [("impact_damper", 20.0, 0.005), ("discontinuous_support", 30.0, 0.01)]
)
def test_states_are_followed_through_contacts(model, until, noise):
    """Walls that no run may begin behind, and a stop with a memory."""
    fmu = load(model)
    log = noisy(fmu, 1, until, 401, noise=noise)
    truth = simulate(fmu, until, output_times=log["time"])
    course = track_online(fmu, log, noise={"x": noise}, rates={fmu.states[-1]: 1e-3})
    for path in course.states:
        assert np.mean(np.abs(path.values - truth[path.name])[20:] < 2 * np.array(path.deviations)[20:]) > 0.75
    assert np.std(course.states[0].values - truth["x"]) < noise


def test_one_that_stays_is_said_to_be_what_all_samples_tell(belt):
    (k,) = track_online(belt, noisy(belt, 1, 20.0, 201), drift=["k"], rates={"k": 1e-3}).parameters
    assert k.constant and k.sentence.startswith(f"'k' stays: {k.values[-1]:.4f}")


def test_six_states_are_followed_by_one():
    """A woodpecker's swing tells where it is on the bar, and how the sleeve turns."""
    fmu = load("woodpecker")
    log = noisy(fmu, 1, 0.4, 401, noise=1e-3, name="phi_S")
    truth = simulate(fmu, 0.4, output_times=log["time"])
    assert len(truth.events) > 30
    course = track_online(fmu, log, noise={"phi_S": 1e-3})
    for path in course.states:
        off = np.array(path.values) - truth[path.name]
        assert np.sqrt(np.mean(off**2)) < 0.03 * np.std(truth[path.name])


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"noise": {}}, "needs the noise"),
        ({"noise": {"y": 1.0}}, "no state or output 'y'"),
        ({"noise": {"x": 0.1}, "rates": {"kk": 1.0}}, "no parameter 'kk'"),
    ],
)
def test_what_a_filter_cannot_be_is_a_sentence(belt, asked, words):
    with pytest.raises(StickslipError, match=words):
        OnlineTrack(belt, **asked)


def test_a_rate_of_what_does_not_drift_is_refused(belt):
    with pytest.raises(StickslipError, match="'k' has a rate and does not drift"):
        track_online(belt, noisy(belt, 1, 10.0, 101), rates={"k": 0.1})


def test_samples_that_do_not_follow_are_refused(belt):
    run = OnlineTrack(belt, {"x": 0.1})
    run.update(1.0, {"x": 1.0})
    with pytest.raises(StickslipError, match="one after the other"):
        run.update(1.0, {"x": 1.0})
    with pytest.raises(StickslipError, match="no noise of 'v'"):
        run.update(1.1, {"v": 1.0})
