"""A velocity sensor beside the angle: its calibration, the angle that the two give, and what a fit makes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.estimators.segment_runs import ShootingSegment
from identification.estimators.windows import coloured, whitening
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.measurement.disc_motion import disc_motion, fuse
from identification.measurement.pooling import pool
from rig_io.bench.emulator import emulate, standard_set
from rig_io.bench.materials import MATERIALS
from rig_io.logs.log import RigLog
from rig_io.packages.datapackage import read_package, write_package
from rig_io.sensors.speed_sensor import SpeedSensor

TRUTH = MATERIALS["paper/rubber"].values
WINDOW = 0.04
SENSOR = SpeedSensor("vibrometer", gain_error=0.01, offset=1e-3, noise=2e-4, latency=2e-3)


@pytest.fixture(scope="module")
def plain() -> list[RigLog]:
    return [emulate(one, 5, number) for number, one in enumerate(standard_set(speeds=(0.83, 1.4), duration=8.0)[:-1])]


@pytest.fixture(scope="module")
def seen() -> list[RigLog]:
    """The same logs, the same noise, and a vibrometer."""
    settings = standard_set(speeds=(0.83, 1.4), duration=8.0, speed_sensor=SENSOR)[:-1]
    return [emulate(one, 5, number) for number, one in enumerate(settings)]


def other(log: RigLog, change: Callable[[np.ndarray], np.ndarray]) -> RigLog:
    return replace(log, columns={**log.columns, "vibrometer": change(log.column("vibrometer"))})


def exact(sensor: str, gain: float = 1.0) -> tuple[RigLog, np.ndarray]:
    """A log whose angle is a sine in white noise, its speed the derivative in other noise, 3 ms late; and the sine."""
    (settings,) = standard_set(speeds=(0.83,), duration=8.0, ripple=None)[:-1]
    log, noise = emulate(settings, 1), np.random.default_rng(3)
    t, late = log.time, log.time - 3e-3
    true = 0.2 * np.sin(6.9 * t)
    R = log.rig.value("R")
    lever = 1.0 if sensor == "tachometer" else R * np.cos(0.2 * np.sin(6.9 * late))
    speed = gain * lever * 0.2 * 6.9 * np.cos(6.9 * late) + 0.01 + noise.normal(0, 0.02 * R, len(t))
    columns = {**log.columns, "angle": true + noise.normal(0, 2e-4, len(t)), sensor: speed}
    return replace(log, columns={k: v for k, v in columns.items() if not k.startswith(("laser", "encoder"))}), true


@pytest.mark.parametrize("sensor", ["tachometer", "vibrometer"])
def test_gain_delay_and_the_joined_angle_are_those_of_a_known_motion(sensor: str) -> None:
    log, true = exact(sensor, 1.012)
    (motion,), fit = fuse([disc_motion(log)], WINDOW)
    found, colour = fit.velocity, motion.colour
    assert found is not None and colour is not None
    assert found.gain == pytest.approx(1.012, abs=4 * found.gain_deviation) and found.gain_deviation < 1e-3
    assert found.delay == pytest.approx(3e-3, abs=4 * found.delay_deviation) and found.delay_deviation < 2e-4
    off = (motion.angle - true)[200:-200]
    # the noise that is left is the one that is said, by size and by colour
    assert off.std() == pytest.approx(colour.noise, rel=0.25) and colour.noise < 0.7 * 2e-4
    lag = round(colour.memory / motion.step)
    assert np.corrcoef(off[lag:], off[:-lag])[0, 1] == pytest.approx(np.exp(-1), abs=0.25)


def test_noise_of_first_order_is_whitened() -> None:
    memory, rows = 7.0, 400
    root = np.linalg.cholesky(coloured(rows, memory))
    bare = ShootingSegment(0.0, np.arange(rows) * 1e-3, np.zeros(0), np.zeros(0), 2.0, 0, (), 1, True, np.zeros(2))
    white = replace(bare, memory=memory * 1e-3).whitened(2.0 * root)
    assert white @ white.T == pytest.approx(np.eye(rows), abs=1e-9)
    weights = np.hanning(31)
    windows = np.zeros((20, rows))
    for place in range(20):
        windows[place, 15 * place : 15 * place + 31] = weights
    found = whitening(weights, 15, 20, memory) @ windows @ root
    assert (found @ found.T) / (found @ found.T)[0, 0] == pytest.approx(np.eye(20), abs=0.02)


@pytest.mark.nightly_for("weak-form", "shooting")
@pytest.mark.parametrize("estimator", ["shooting", "weak-form", "savitzky-golay"])
def test_a_velocity_sensor_makes_a_fit_surer(plain: list[RigLog], seen: list[RigLog], estimator: str) -> None:
    def fitted(logs: list[RigLog]) -> FrictionFit:
        return fit_friction(logs, estimator=estimator, disturbances="none")

    before, after = fitted(plain), fitted(seen)
    for name, truth in TRUTH.items():
        assert after[name].standard_deviation < 0.8 * before[name].standard_deviation
        assert abs(after[name].value - truth) < 3 * after[name].total_deviation
    assert after.sensors["velocity_delay"] == pytest.approx(2e-3, abs=2e-4)
    assert any("The vibrometer shows" in warning for warning in after.warnings)


def test_a_velocity_sensor_survives_the_files(seen: list[RigLog], tmp_path: Path) -> None:
    read = read_package(write_package(tmp_path / "logs", seen))
    assert np.array_equal(pool(read).motions[0].angle, pool(seen).motions[0].angle)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: 1000 * v, "it is in thousandths of the stated unit"),
        (lambda v: -v, "give it the other sign"),
        (lambda v: 1.2 * v, r"shows 1\.2\d* times the speed of the angle; its calibration is wrong"),
        (lambda v: np.roll(v, 80), "lags behind the angle by"),
        (lambda v: np.where(np.arange(len(v)) % 3 < 2, np.nan, v), "holds no number in 67 % of the samples"),
    ],
)
def test_a_sensor_that_contradicts_the_angle_is_refused(
    seen: list[RigLog], change: Callable[[np.ndarray], np.ndarray], message: str
) -> None:
    with pytest.raises(StickslipError, match=message):
        fuse([disc_motion(other(seen[0], change))], WINDOW)


def test_where_it_tells_nothing_it_is_not_used_and_that_is_said(seen: list[RigLog]) -> None:
    loud = other(seen[0], lambda v: v + np.random.default_rng(1).normal(0, 0.2, len(v)))
    (motion,), fit = fuse([disc_motion(loud)], WINDOW)
    assert motion.colour is None and any("too loud" in said for said in fit.warnings)
    counted = replace(seen[0], columns={k: v for k, v in seen[0].columns.items() if k != "laser"})
    (motion,), fit = fuse([disc_motion(counted)], WINDOW)
    assert motion.colour is None and any("edges of an encoder alone" in said for said in fit.warnings)
    both = replace(seen[0], columns={**seen[0].columns, "tachometer": seen[0].column("vibrometer")})
    with pytest.raises(StickslipError, match="holds a tachometer and a vibrometer"):
        fuse([disc_motion(both)], WINDOW)


def test_a_gap_of_the_sensor_is_bridged_by_the_angle(seen: list[RigLog]) -> None:
    gap = (seen[0].time > 3.0) & (seen[0].time < 3.2)
    (motion,), _ = fuse([disc_motion(other(seen[0], lambda v: np.where(gap, np.nan, v)))], WINDOW)
    (whole,), _ = fuse([disc_motion(seen[0])], WINDOW)
    away = np.abs(motion.time - 3.1) > 0.5
    assert np.abs(motion.angle - whole.angle).max() < 1e-3
    assert np.abs(motion.angle - whole.angle)[away].max() < 2e-5
