"""Calibration of FMUs of others: Model Exchange by differences of whole runs, Co-Simulation with its solver."""

from __future__ import annotations

import numpy as np
import pytest
from benchmark_scripts import benchmark_script
from known_deviation import deviation
from models import Models, foreign

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from identification.calibration.calibrate import calibrate
from identification.calibration.log import ModelLog
from identification.calibration.subject import Stretch, Window
from identification.calibration.systems import SOLVER, subject_of

bench = benchmark_script("bench_calibrate")


def noisy(fmu, name, until, samples, noise, seed, **more):
    time = np.linspace(0, until, samples)
    run = simulate_any(fmu, until, output_times=time, tolerance=1e-10, **more)
    return {"time": time, name: run[name] + noise * np.random.default_rng(seed).normal(size=samples)}


def test_differences_of_runs_are_derivatives(model: Models):
    """Of exp(-k t) x0: -t exp(-k t) x0 and exp(-k t), to the square of the step (1e-8)."""
    subject = subject_of(model("dahlquist"), ["k"], ["x"])
    time = np.linspace(0, 3, 31)
    run = subject.respond(Stretch(Window(0.0, time, {}), {"k": 0.7}, {"x": 2.0}))
    decay = np.exp(-0.7 * time)
    assert run.slopes[:, 0, 0] == pytest.approx(-2 * time * decay, abs=3e-8)
    assert run.slopes[:, 0, 1] == pytest.approx(decay, abs=3e-8)


def test_differences_go_through_impacts(model: Models):
    """Behind the third one, v = e^3 u - g t + (1 + 2 e + 2 e^2) u with u = sqrt(2 g h); slopes to the square of the
    step, by states and parameters, and in whatever order these are named."""
    subject, time = subject_of(model("ball"), ["g", "e"], ["v"]), np.array([1.7])
    g, e, h = 9.81, 0.7, 1.0
    u, passed = np.sqrt(2 * g * h), 1 + 2 * e + 2 * e**2
    by_speed = e**3 + passed
    expected = [by_speed * u / (2 * g) - 1.7, (3 * e**2 + 2 + 4 * e) * u, by_speed * u / (2 * h)]
    window = Window(0.0, time, {})
    for values in ({"g": g, "e": e}, {"e": e, "g": g}):
        run = subject.respond(Stretch(window, values, {"h": h, "v": 0.0}))
        assert run.values[0, 1] == pytest.approx(by_speed * u - g * 1.7, abs=1e-9)
        assert run.slopes[0, 1, :3] == pytest.approx(expected, rel=1e-7)


def test_derivative_just_behind_an_impact_is_that_of_the_flight(model: Models):
    """v = (1 + e) g t1 - g t with t1 = sqrt(2 h/g): a difference over the impact would be v/step, some 10 000."""
    subject = subject_of(model("ball"), ["g"], ["v"])
    e, g, fall = 0.7, 9.81, np.sqrt(2 / 9.81)
    for after in (1e-6, -1e-6):
        time = np.array([fall + after])
        run = subject.respond(Stretch(Window(0.0, time, {}), {"g": g, "e": e}, {"h": 1.0, "v": 0.0}))
        expected = (1 + e) * fall / 2 - fall if after > 0 else -fall
        # one side only: to the first power of the step, and its rounding
        assert run.slopes[0, 1, 0] == pytest.approx(expected, abs=1e-3)


def test_a_sample_on_the_wrong_side_of_a_jump_is_no_wall(model: Models):
    """Of this log every descent ends with a sample at 40 deviations beside an impact."""
    assert bench.run_seed(bench.CASES["BouncingBall-v"], model("ball"), 0).fits(0.0)


def test_van_der_pol_is_found_as_lmfit_over_fmpy_finds_it(model: Models, tmp_path):
    """From half off; value and deviation by runs, differences and a search that are not ours."""
    case = bench.CASES["VanDerPol"]
    ours = bench.run_seed(case, model("van_der_pol"), 1)
    peer = bench.run_seed(case, Fmu.open(foreign("van_der_pol", tmp_path, 2)), 1, bench.peer)
    assert ours.fits(0.0) and abs(ours.z[0]) < 4
    assert ours.z == pytest.approx(peer.z, abs=0.01)
    assert ours.values["mu"] == pytest.approx(peer.values["mu"], abs=1e-5)


@pytest.mark.parametrize(("name", "noise"), [("h", 0.01), ("v", 0.05)])
def test_ball_is_found_from_its_height_and_from_a_speed_that_jumps(model: Models, name, noise):
    fmu = model("ball")
    log = noisy(fmu, name, 2.2, 441, noise, 2, on_zeno="hold")
    found = calibrate(fmu, log, free=["e", "g"], parameters={"e": 0.5, "g": 14.0})
    for parameter, truth in (("e", 0.7), ("g", 9.81)):
        assert abs(found[parameter].value - truth) < 4 * deviation(found[parameter])
    assert deviation(found["e"]) < 0.003


def test_co_simulation_identifies_model_and_solver(model: Models):
    fmu = model("ball_steps")
    log = noisy(fmu, "h", 1.0, 101, 0.01, 3, communication_step=0.01)
    found = calibrate(fmu, log, free=["g"], parameters={"g": 8.0})
    assert SOLVER in found.warnings
    assert found["g"].value == pytest.approx(9.81, rel=0.05)


def test_unknown_parameter_is_refused(model: Models):
    with pytest.raises(StickslipError, match="'zz'"):
        calibrate(model("ball"), ModelLog("log", np.arange(20.0), {"h": np.arange(20.0)}), free=["zz"])
