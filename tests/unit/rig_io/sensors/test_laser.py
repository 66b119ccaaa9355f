"""Laser telemeter: what goes in comes out, but for the faults it is built with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import Experiment, InstrumentCalibrations, RigConstants, RigLog, StatedQuantity
from rig_io.sensors import Laser, laser_angle, laser_clipped
from rig_io.sensors.motion import Motion

TICKS = 0.001 * np.arange(4001)
TIME = np.arange(20001) / 5000
SWING = Motion(TIME, 0.3 * np.sin(7 * TIME), 2.1 * np.cos(7 * TIME))
IDEAL = Laser(noise=0.0, resolution=0.0, gain_error=0.0)


def seen(laser: Laser, motion: Motion = SWING, seed: int = 2) -> RigLog:
    volts = laser.read(motion, TICKS, 0.125, np.random.default_rng(seed), np.random.default_rng(seed + 1))
    rig = RigConstants(R=StatedQuantity(0.125, "m"))
    return RigLog("x", TICKS, {"laser": volts}, {}, rig, InstrumentCalibrations(laser=laser.calibration), Experiment())


def test_an_ideal_laser_gives_the_angle_back() -> None:
    # volts are logged to 1e-9: 1e-11 m over R cos(0.3)
    np.testing.assert_allclose(laser_angle(seen(IDEAL)), 0.3 * np.sin(7 * TICKS), atol=1e-9)


def test_noise_and_resolution_have_the_stated_size() -> None:
    still = Motion(np.array([0.0, 4.0]), np.array([0.1, 0.1]), np.zeros(2))
    log = seen(replace(IDEAL, noise=20e-6, resolution=10e-6), still)
    steps = np.diff(np.unique(log.column("laser"))) * 0.01 / 10e-6
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    error = 0.125 * np.sin(laser_angle(log)) - 0.125 * np.sin(0.1)
    # noise and rounding (step/sqrt 12) together; 4001 samples give 1.1 %
    assert error.std() == pytest.approx(np.hypot(20e-6, 10e-6 / np.sqrt(12)), rel=0.05)
    assert abs(error.mean()) < 5e-6 / 2


def test_the_gain_error_belongs_to_the_specimen() -> None:
    def error(seed: int) -> float:
        truth, far = 0.3 * np.sin(7 * TICKS), np.abs(np.sin(7 * TICKS)) > 0.3
        shown = laser_angle(seen(replace(IDEAL, gain_error=0.002), seed=seed))
        ratio = np.sin(shown[far]) / np.sin(truth[far])
        assert ratio.std() < 1e-6
        return float(ratio.mean()) - 1.0

    errors = np.array([error(seed) for seed in range(60)])
    assert error(3) == errors[3]
    assert 0.0014 < errors.std() < 0.0026


def test_latency_is_stated_and_taken_off_the_times() -> None:
    log = seen(replace(IDEAL, latency=0.004))
    assert log.calibration.need("laser").latency == 0.004
    time, angle = log.time - log.calibration.need("laser").latency, laser_angle(log)
    inside = time >= 0
    np.testing.assert_allclose(angle[inside], 0.3 * np.sin(7 * time[inside]), atol=1e-9)


def test_the_range_clips_and_the_clipped_samples_are_known() -> None:
    log = seen(replace(IDEAL, range=0.02))
    beyond = np.abs(0.125 * np.sin(0.3 * np.sin(7 * TICKS))) >= 0.02
    np.testing.assert_array_equal(laser_clipped(log), beyond)
    assert 0.2 < beyond.mean() < 0.7


def test_readings_that_pile_up_at_an_end_are_clipped_even_where_no_range_is_stated() -> None:
    fine = replace(IDEAL, resolution=1e-5)
    beyond = 1 - 2 / np.pi * np.arcsin(np.arcsin(0.02 / 0.125) / 0.3)  # share of the time
    for laser, share in ((replace(fine, range=0.02), beyond), (fine, 0.0)):
        log = seen(laser)
        unstated = replace(laser.calibration, lowest=-np.inf, highest=np.inf)
        clipped = laser_clipped(replace(log, calibration=InstrumentCalibrations(laser=unstated)))
        np.testing.assert_array_equal(clipped, laser_clipped(log))
        assert clipped.mean() == pytest.approx(share, abs=0.02)


def test_a_wrong_gain_is_named() -> None:
    log = seen(IDEAL)
    wrong = replace(log, calibration=InstrumentCalibrations(laser=replace(IDEAL.calibration, gain=1.0)))
    with pytest.raises(StickslipError, match=r"exceeds the radius R = 0\.125 m"):
        laser_angle(wrong)
