"""Encoder: edges, counts and speeds against motions known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import Experiment, InstrumentCalibrations, RigConstants, RigLog
from rig_io.sensors import Encoder, drive_speed, edges, velocity_mid_interval
from rig_io.sensors.motion import Motion

TICKS = 0.001 * np.arange(2001)


def harmonic(amplitude: float, frequency: float, offset: float = 0.0, duration: float = 2.0) -> Motion:
    """offset + amplitude sin(2 pi frequency t), sampled like the emulator's truth; frequency in Hz."""
    time = np.arange(round(5000 * duration) + 1) / 5000
    phase = 2 * np.pi * frequency * time
    return Motion(time, offset + amplitude * np.sin(phase), 2 * np.pi * frequency * amplitude * np.cos(phase))


def turning(speed: float, duration: float = 2.0) -> Motion:
    """A shaft at constant speed (rad/s)."""
    time = np.arange(round(5000 * duration) + 1) / 5000
    return Motion(time, speed * time, np.full(len(time), speed))


def seen(motion: Motion, encoder: Encoder, seed: int = 3) -> RigLog:
    """The log of a motion seen by one specimen of an encoder."""
    count, edge_time = encoder.ruled(np.random.default_rng(seed)).read(motion, TICKS)
    columns = {"encoder_count": count, "encoder_edge_time": edge_time}
    return RigLog(
        "x", TICKS, columns, {}, RigConstants(), InstrumentCalibrations(encoder=encoder.calibration), Experiment()
    )


def test_hermite_interpolation_and_turning_points_of_a_harmonic() -> None:
    motion = harmonic(0.1, 1.3, 0.05)
    time = np.random.default_rng(0).uniform(0, 2, 500)
    truth = 0.05 + 0.1 * np.sin(2 * np.pi * 1.3 * time)
    # h^4/384 max|angle''''| = 2e-13
    np.testing.assert_allclose(motion.angle_at(time), truth, rtol=0, atol=1e-12)
    turned = motion.turned()
    added = turned.time[turned.speed == 0.0]
    np.testing.assert_allclose(added, (0.25 + 0.5 * np.arange(5)) / 1.3, atol=1e-8)
    assert np.all(np.diff(turned.time) > 0)
    np.testing.assert_allclose(turned.angle, 0.05 + 0.1 * np.sin(2 * np.pi * 1.3 * turned.time), rtol=0, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    amplitude=st.floats(1e-4, 0.3),
    frequency=st.floats(0.1, 3.0),
    offset=st.floats(-7.0, 7.0),
    quadrature=st.booleans(),
    line_error=st.floats(0.0, 0.1),
    seed=st.integers(0, 1000),
)
def test_what_the_encoder_says_is_true_within_a_pitch(
    amplitude: float, frequency: float, offset: float, quadrature: bool, line_error: float, seed: int
) -> None:
    encoder = Encoder(quadrature=quadrature, line_error=line_error)
    motion = harmonic(amplitude, frequency, offset)
    log, pitch = seen(motion, encoder, seed), encoder.calibration.pitch
    counted = pitch * log.column("encoder_count")
    assert np.abs(counted - motion.angle_at(TICKS)).max() <= pitch * (1 + line_error)
    found = edges(log)
    error = found.angle - motion.angle_at(found.time)
    # one shift common to all edges, line errors, and the way within a clock period, either way
    clock = 1e-6 * 2 * np.pi * frequency * amplitude
    assert error.size == 0 or np.abs(error).max() <= pitch * (0.5 + line_error) + clock + 1e-12
    assert error.size == 0 or np.ptp(error) <= 2 * line_error * pitch + 2 * clock + 1e-12


@settings(max_examples=40, deadline=None)
@given(amplitude=st.floats(0.001, 0.2), frequency=st.floats(0.1, 3.0), offset=st.floats(-1.0, 1.0))
def test_an_edge_passed_back_is_the_same_edge(amplitude: float, frequency: float, offset: float) -> None:
    encoder = Encoder(clock=1e-9)
    motion = harmonic(amplitude, frequency, offset)
    ruling = encoder.ruled(np.random.default_rng(5))
    time, after = ruling.passed(motion)
    before = np.concatenate([ruling.count(motion.angle[:1]), after[:-1]])
    assert np.all(np.abs(after - before) == 1)
    line = np.maximum(before, after)  # the edge between the two cells
    speed = 2 * np.pi * frequency * amplitude
    np.testing.assert_allclose(motion.angle_at(time), ruling.position(line), atol=1e-9 * speed + 1e-12)
    back = np.flatnonzero(np.sign(np.diff(after)) != np.sign(np.diff(before)))
    np.testing.assert_array_equal(line[back], line[back + 1])


def test_count_before_the_first_edge_and_after_a_whole_turn() -> None:
    encoder = Encoder(line_error=0.0)
    log = seen(turning(2 * np.pi, 2.0), encoder)
    assert log.column("encoder_count")[0] == 0
    assert log.column("encoder_edge_time")[0] == 0.0
    np.testing.assert_array_equal(log.column("encoder_count")[[1000, 2000]], [1000, 2000])
    still = seen(Motion(np.array([0.0, 2.0]), np.array([0.1, 0.1]), np.zeros(2)), encoder)
    assert np.ptp(still.column("encoder_count")) == 0 and edges(still).time.size == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_speeds_of_an_even_turn(sign: int) -> None:
    log = seen(turning(sign * 1.3), Encoder(line_error=0.0))
    time, speed = velocity_mid_interval(log)
    # 1 us in an interval of 4.8 ms
    np.testing.assert_allclose(speed, sign * 1.3, rtol=3e-4)
    found = edges(log)
    np.testing.assert_allclose(time, 0.5 * (found.time[1:] + found.time[:-1]))


def test_mid_interval_speeds_are_second_order_and_leave_reversals_out() -> None:
    motion = harmonic(0.15, 1.0)
    log = seen(motion, Encoder(line_error=0.0, clock=1e-9))
    time, speed = velocity_mid_interval(log)
    truth = 0.15 * 2 * np.pi * np.cos(2 * np.pi * time)
    jerk = 0.15 * (2 * np.pi) ** 3
    gaps = np.interp(time, *_gaps(log))
    # mean over an interval h less the value at its middle: at most h^2/24 |jerk|
    assert np.all(np.abs(speed - truth) <= gaps**2 / 24 * jerk + 1e-5)
    turns = (0.25 + 0.5 * np.arange(4)) / 1.0
    found = edges(log)
    for turn in turns:
        last, first = found.time[found.time < turn].max(), found.time[found.time > turn].min()
        assert not np.any((time > last) & (time < first))


def _gaps(log: RigLog) -> tuple[np.ndarray, np.ndarray]:
    time = edges(log).time
    return 0.5 * (time[1:] + time[:-1]), np.diff(time)


def test_an_edge_passed_and_passed_back_within_a_tick_joins_nothing() -> None:
    encoder = Encoder(line_error=0.0)
    count = np.zeros(40)
    stamps = np.zeros(40)
    count[10:], stamps[10:] = 1, 0.0095
    stamps[20:] = 0.0195  # passed up and down again: the count is as before, the time is not
    count[30:], stamps[30:] = 2, 0.0295
    columns = {"encoder_count": count, "encoder_edge_time": stamps}
    log = RigLog(
        "x",
        1e-3 * np.arange(40),
        columns,
        {},
        RigConstants(),
        InstrumentCalibrations(encoder=encoder.calibration),
        Experiment(),
    )
    assert velocity_mid_interval(log)[0].size == 0
    np.testing.assert_array_equal(edges(log).time, [0.0095, 0.0295])


def test_without_edge_times_an_edge_lies_between_its_ticks() -> None:
    full = seen(turning(0.9), Encoder())
    bare = RigLog(
        "x", TICKS, {"encoder_count": full.column("encoder_count")}, {}, RigConstants(), full.calibration, Experiment()
    )
    np.testing.assert_allclose(edges(bare).time, edges(full).time, atol=0.5001e-3)
    np.testing.assert_array_equal(edges(bare).angle, edges(full).angle)


def test_drive_speed_from_encoder_or_column_or_a_clear_error() -> None:
    seen_drive = seen(turning(0.83), Encoder(line_error=0.0))
    columns = {name.replace("encoder", "drive0"): values for name, values in seen_drive.columns.items()}
    calibration = InstrumentCalibrations(drive0=Encoder().calibration)
    log = RigLog("x", TICKS, columns, {}, RigConstants(), calibration, Experiment())
    np.testing.assert_allclose(drive_speed(log)[1], 0.83, rtol=3e-4)
    with_column = RigLog(
        "x", TICKS, {"drive0_speed": TICKS}, {}, RigConstants(), InstrumentCalibrations(), Experiment()
    )
    np.testing.assert_array_equal(drive_speed(with_column)[1], TICKS)
    with pytest.raises(StickslipError, match="how disc 1 turned"):
        drive_speed(log, 1)
