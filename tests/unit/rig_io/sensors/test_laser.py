"""Laser telemeter: what goes in comes out, but for the faults it is built with."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import Experiment, InstrumentCalibrations, LaserCalibration, RigConstants, RigLog, StatedQuantity
from rig_io.sensors import Laser, laser_angle, laser_clipped, laser_displacement
from rig_io.sensors.motion import Motion

TICKS = 0.001 * np.arange(4001)
TIME = np.arange(20001) / 5000
SWING = Motion(TIME, 0.3 * np.sin(7 * TIME), 2.1 * np.cos(7 * TIME))
IDEAL = Laser(noise=0.0, resolution=0.0, gain_error=0.0)
SEEN = [("sine", 0.0), ("sine", 0.05), ("arc", 0.0), ("tangent", 0.0), ("tangent", -0.04)]


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


@pytest.mark.parametrize(
    ("beam", "tilt", "shown"),
    [("arc", 0.3, 0.2), ("tangent", 0.0, np.tan(0.2)), ("sine", 0.1, np.sin(0.3) - np.sin(0.1))],
)
def test_a_laser_gives_the_angle_back_whatever_it_sees(beam: str, tilt: float, shown: float) -> None:
    laser = replace(IDEAL, beam=beam, tilt=tilt)
    np.testing.assert_allclose(laser_angle(seen(laser)), 0.3 * np.sin(7 * TICKS), atol=1e-9)
    log = seen(laser, Motion(np.array([0.0, 4.0]), np.array([0.2, 0.2]), np.zeros(2)))
    np.testing.assert_allclose(laser_displacement(log), 0.125 * shown, atol=1e-10)


@pytest.mark.parametrize(
    ("true", "taken"),
    [((a, x), (b, y)) for a, x in SEEN for b, y in SEEN if (a, x) != (b, y) and not (a == "arc" == b)],
    ids=str,
)
def test_the_beam_that_would_explain_a_bend_is_named(true: tuple[str, float], taken: tuple[str, float]) -> None:
    """What an encoder would tell: the bend that is left, over R and its slope, from the displacement alone."""
    angle = np.linspace(-0.08, 0.08, 81)
    shown = LaserCalibration(1.0, beam=true[0], tilt=true[1]).shown(angle)
    laser = LaserCalibration(1.0, beam=taken[0], tilt=taken[1])
    sine = np.sin(laser.angle(shown))
    straight, square, cubic = np.linalg.lstsq(np.column_stack([np.sin(angle), angle**2, angle**3]), sine, rcond=None)[0]
    words = laser.bent(square / straight, cubic / straight)
    if true[0] != taken[0]:
        assert f"laser_beam={true[0]}" in words
    else:
        assert float(re.findall(r"'\w+ (\S+) deg'", words)[0]) == pytest.approx(np.degrees(true[1]), abs=0.3)
