"""Motions on a common scale and their slip segments, from logs built by hand with known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.measurement.disc_motion import disc_motion, fuse
from identification.measurement.motion import odd_count
from identification.measurement.pooling import pool
from identification.measurement.slip_segments import TRIM, long_enough, slip_segments, stretches
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import (
    EncoderCalibration,
    Experiment,
    InstrumentCalibrations,
    LaserCalibration,
    RigConstants,
    RigLog,
    StatedQuantity,
)
from rig_io.sensors import Laser

PERIOD = 0.9
TICKS = np.arange(10_000) / 1000
RIG = RigConstants(
    *(
        StatedQuantity(value, unit)
        for value, unit in (
            (0.0548, "kg*m^2"),
            (2.62, "N*m/rad"),
            (0.055, "N*m*s/rad"),
            (0.125, "m"),
            (0.06, "m"),
            (4.905, "N"),
        )
    )
)
DRIVE = 0.5  # rad/s


def log_of(angle: np.ndarray, **changes: object) -> RigLog:
    """A log with converted angle and drive speed."""
    columns = {"angle": angle, "drive0_speed": np.full(len(angle), DRIVE)}
    return replace(RigLog("x", TICKS, columns, {}, RIG, InstrumentCalibrations(), Experiment()), **changes)


def saw(stick: float = 0.4) -> np.ndarray:
    """Sticks for ``stick`` s of each second, then goes back along half a cosine on a falling line, C1."""
    phase = TICKS % 1.0
    rate = 0.06 / 0.125 * DRIVE
    slip = (phase - stick) / (1 - stick)
    # rate*t + jump*smooth step that returns to the start with equal rate at both ends
    step = slip - np.sin(2 * np.pi * slip) / (2 * np.pi)
    return rate * phase - np.where(phase > stick, rate * step, 0.0)


def test_stretches() -> None:
    mask = np.array([1, 1, 0, 0, 1, 0, 1, 1, 1], dtype=bool)
    assert stretches(mask).tolist() == [[0, 2], [4, 5], [6, 9]]
    assert stretches(np.zeros(3, dtype=bool)).tolist() == []


def test_segments_lie_inside_the_slips_and_hold_most_of_them() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-4, len(TICKS))
    motion = disc_motion(log_of(saw() + noise))
    segments = slip_segments(motion, PERIOD)
    long = [s for s in segments if s.last - s.first > 100]
    assert len(long) == 10
    trim = TRIM * 0.045 * PERIOD
    for place, segment in enumerate(long):
        first, last = motion.time[segment.first], motion.time[segment.last - 1]
        assert place + 0.4 < first < place + 0.4 + 2 * trim + 0.09
        # the last slip is cut by the end of the log and not trimmed there
        assert place + 1.0 - 2 * trim - 0.09 < last <= place + 1.0
        assert segment.sign == 1


def test_a_drive_turned_round_gives_the_other_sign() -> None:
    log = log_of(-saw())
    log = replace(log, columns={**log.columns, "drive0_speed": -log.column("drive0_speed")})
    assert {s.sign for s in slip_segments(disc_motion(log), PERIOD)} == {-1}


def test_segments_with_missing_samples_are_left_out() -> None:
    angle = saw()
    angle[2600:2610] = np.nan
    segments = slip_segments(disc_motion(log_of(angle)), PERIOD)
    assert len(segments) == 9
    assert not any(s.first < 2600 < s.last for s in segments)


@pytest.mark.parametrize(
    ("angle", "said"),
    [
        (0.06 / 0.125 * DRIVE * TICKS, "no slip"),
        (0.05 * np.sin(7 * TICKS) * 0.1, "no stick"),
        (np.where(TICKS < 9.2, 0.06 / 0.125 * DRIVE * TICKS, 0.0), "too short"),
    ],
)
def test_logs_without_slip_or_stick_or_cycles_are_refused(angle: np.ndarray, said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        slip_segments(disc_motion(log_of(angle)), PERIOD)


def test_steady_sliding_can_be_allowed() -> None:
    motion = disc_motion(log_of(0.05 * np.sin(7 * TICKS) * 0.1))
    assert len(slip_segments(motion, PERIOD, allow_no_stick=True)) == 1


def test_segments_too_short_for_a_window_are_named() -> None:
    segments = slip_segments(disc_motion(log_of(saw())), PERIOD)
    assert long_enough(segments, 0.2) == segments
    with pytest.raises(StickslipError, match=r"longer than the window of 2 s \(longest 0\.[345]"):
        long_enough(segments, 2.0)


@pytest.mark.parametrize("window", [0.01, 0.0403, 0.111])
def test_windows_have_an_odd_count(window: float) -> None:
    count = odd_count(window, 1e-3)
    assert count % 2 == 1
    assert abs(count - window / 1e-3) <= 1


def sensed(gain: float, delay: float, *, seed: int = 0) -> RigLog:
    """Laser with a wrong gain and a delay that nobody stated, and an encoder of 2000 misplaced lines."""
    rng = np.random.default_rng(seed)
    pitch = 2 * np.pi / 2000
    fine = np.arange(200_000) / 20_000

    def truth(t: np.ndarray) -> np.ndarray:
        return 0.08 + 0.07 * np.sin(6 * t) + 0.01 * np.sin(2.3 * t)

    lines = rng.normal(0, 0.02 * pitch, 2000)
    count = np.floor(truth(fine) / pitch).astype(int)
    count = np.where(truth(fine) < pitch * count + lines[count], count - 1, count)
    last = np.maximum.accumulate(np.where(np.diff(count, prepend=count[0]) != 0, np.arange(len(fine)), 0))
    laser = 0.125 * np.sin(truth(TICKS - delay)) * (1 + gain) + rng.normal(0, 20e-6, len(TICKS))
    columns = {
        "laser": laser / 0.01,
        "encoder_count": count[::20].astype(float),
        "encoder_edge_time": fine[last[::20]],
        "drive0_speed": np.full(len(TICKS), DRIVE),
    }
    calibration = InstrumentCalibrations(laser=LaserCalibration(gain=0.01), encoder=EncoderCalibration(2000))
    return RigLog("x", TICKS, columns, {}, RIG, calibration, Experiment())


def test_the_encoder_scales_and_dates_the_laser() -> None:
    for seed in range(3):
        motions, found = fuse([disc_motion(sensed(0.004, 0.003, seed=seed))], 0.04)
        deviation = np.sqrt(np.diag(found.covariance))
        # the laser shows 1.004 times the truth; edges are stamped to half a fine sample, 25 us
        assert found.gain == pytest.approx(1 / 1.004 - 1, abs=4 * deviation[0])
        assert found.delay == pytest.approx(0.003, abs=4 * deviation[1] + 3e-5)
        assert deviation[0] < 5e-4 and deviation[1] < 5e-5
        truth = 0.08 + 0.07 * np.sin(6 * motions[0].time) + 0.01 * np.sin(2.3 * motions[0].time)
        assert np.sqrt(np.mean((motions[0].angle - truth) ** 2)) < 2e-4


def test_a_calibration_that_is_plainly_wrong_is_refused() -> None:
    with pytest.raises(StickslipError, match="Laser and encoder disagree"):
        fuse([disc_motion(sensed(0.05, 0.0))], 0.04)


def test_a_laser_that_sees_something_else_is_told_from_a_wrong_calibration() -> None:
    log = emulate(replace(standard_set("paper/rubber", [0.83], duration=4.0)[0], laser=Laser(beam="tangent")))
    laser = replace(log.calibration.need("laser"), beam="sine")
    taken = replace(log, calibration=replace(log.calibration, laser=laser))
    with pytest.raises(StickslipError, match=r"bends with the angle.*laser_beam=tangent"):
        fuse([disc_motion(taken)], 0.04)


def test_logs_of_different_rates_are_not_pooled() -> None:
    coarse = log_of(saw(), name="y")
    coarse = replace(coarse, time=coarse.time[::2], columns={n: c[::2] for n, c in coarse.columns.items()})
    with pytest.raises(StickslipError, match=r"every 0\.001 s and 0\.002 s"):
        pool([log_of(saw()), coarse])


def test_logs_of_different_rigs_are_not_pooled() -> None:
    heavier = replace(RIG, J=StatedQuantity(0.06, "kg*m^2"))
    with pytest.raises(StickslipError, match=r"different rigs: J = 0\.0548 and 0\.06 kg"):
        pool([log_of(saw()), log_of(saw(), rig=heavier, name="y")])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"experiment": Experiment(contacts=("disc0", "disc1"))}, "rig constant N1 .* is needed"),
        ({"experiment": Experiment(kind="free-decay")}, "no stick-slip log"),
        ({"rig": replace(RIG, N0=None)}, "rig constant N0 .* is needed"),
        ({"rig": replace(RIG, J=StatedQuantity(-1.0, "kg*m^2"))}, "J is -1"),
    ],
)
def test_logs_that_cannot_be_fitted_are_refused(changes: dict, said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        pool([log_of(saw(), **changes)])
