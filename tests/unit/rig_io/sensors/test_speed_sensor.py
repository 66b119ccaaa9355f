"""Velocity sensors: a motion known in closed form, seen late, through gain and offset of a specimen."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from rig_io.sensors.motion import Motion
from rig_io.sensors.speed_sensor import SpeedSensor

TIME = np.arange(10001) / 5000
SWING = Motion(TIME, 0.3 * np.sin(7 * TIME), 2.1 * np.cos(7 * TIME))
TICKS = 0.1 + 0.001 * np.arange(1800)
RADIUS = 0.125


def shown(sensor: SpeedSensor, seed: int = 2) -> np.ndarray:
    return sensor.read(SWING, TICKS, RADIUS, np.random.default_rng(seed), np.random.default_rng(seed + 1))


@pytest.mark.parametrize("kind", ["tachometer", "vibrometer"])
def test_an_ideal_sensor_shows_the_speed_that_was(kind: Literal["tachometer", "vibrometer"]) -> None:
    """Of the disc, or of its border along the beam: d/dt of R sin(theta)."""
    late = TICKS - 0.02
    speed = 2.1 * np.cos(7 * late)
    if kind == "vibrometer":
        speed = RADIUS * np.cos(0.3 * np.sin(7 * late)) * speed
    ideal = SpeedSensor(kind, gain_error=0.0, offset=0.0, noise=0.0, latency=0.02)
    # linear between samples of the truth: h^2/8 max|w''| = 5e-7; 1e-9 by the print
    np.testing.assert_allclose(shown(ideal), speed, rtol=0, atol=6e-7)


def test_gain_and_offset_belong_to_the_specimen() -> None:
    sensor = SpeedSensor(gain_error=0.01, offset=0.05, noise=0.0, latency=0.0)
    fits = np.array([np.polyfit(2.1 * np.cos(7 * TICKS), shown(sensor, seed), 1) for seed in range(200)])
    # of 200 specimens a standard deviation is known to 5 %
    np.testing.assert_allclose(fits.std(axis=0), [0.01, 0.05], rtol=0.2)
    np.testing.assert_allclose(fits.mean(axis=0), [1.0, 0.0], rtol=0, atol=0.015)
