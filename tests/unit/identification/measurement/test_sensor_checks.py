"""Logs that a fit must not take as they are: what pooling makes of them, and what it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from checkout import ROOT

from fmu_models.base.errors import StickslipError
from identification.fit.fit import fit_friction
from identification.measurement.disc_motion import disc_motion
from identification.measurement.free_decay import fit_free_decay
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.model_check.processing import measured_motions
from rig_io.bench.emulation import RIG
from rig_io.logs.log import EncoderCalibration, Experiment, InstrumentCalibrations, LaserCalibration, RigLog
from rig_io.packages.datapackage import read_package

DATA = ROOT / "data" / "rigs" / "paper_rubber"


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    """At 0.41, 0.83, 1.4 rad/s, and a free decay."""
    return read_package(DATA)


def columns(log: RigLog, **new: np.ndarray) -> RigLog:
    return replace(log, columns={**log.columns, **new})


def rows(log: RigLog, kept: np.ndarray, **changes: object) -> RigLog:
    """The log with these samples alone."""
    chosen = {name: values[kept] for name, values in log.columns.items()}
    return replace(log, time=log.time[kept], columns=chosen, **changes)


def pooled(logs: list[RigLog], change: Callable[[RigLog], RigLog], number: int = 1) -> Pool:
    """One stick-slip log of the set, changed, and the free decay."""
    return pool([change(logs[number]), logs[3]])


def without(log: RigLog, first: float, last: float) -> RigLog:
    return rows(log, np.flatnonzero((log.time < first) | (log.time >= last)))


def test_nothing_crosses_a_gap(logs: list[RigLog]) -> None:
    ready = pooled(logs, lambda log: without(log, 8.0, 10.0))
    assert [m.log.name for m in ready.motions] == ["paper-rubber-0.83", "paper-rubber-0.83, part 2"]
    assert "'paper-rubber-0.83' is in 2 pieces" in ready.warnings[0]
    whole = pooled(logs, lambda log: log)
    for motion, reference in zip(ready.motions, (8.0, 20.0), strict=True):
        assert motion.time[-1] <= reference and len(set(np.round(np.diff(motion.time), 6))) == 1
    # away from the ends of the pieces the segments are those of the whole log
    begins = {round(s.motion.time[s.first], 2) for s in whole.segments}
    mine = {round(s.motion.time[s.first], 2) for s in ready.segments}
    assert len(mine & begins) >= len(begins) - 4


def test_a_piece_too_short_for_cycles_is_left_out(logs: list[RigLog]) -> None:
    ready = pooled(logs, lambda log: without(log, 17.5, 19.0))
    assert [m.log.name for m in ready.motions] == ["paper-rubber-0.83"]
    assert any("part 2', one of several pieces, was left out. " in w and "too short" in w for w in ready.warnings)
    with pytest.raises(StickslipError, match="too short"):
        pooled(logs, lambda log: without(log, 1.0, 19.0))
    with pytest.raises(StickslipError, match=r"is in 2 pieces.*take its pieces\(\)"):
        disc_motion(without(logs[1], 8.0, 10.0))


def test_a_free_decay_in_pieces_is_fitted_on_the_longest(logs: list[RigLog]) -> None:
    whole, found = fit_free_decay(logs[3]), fit_free_decay(without(logs[3], 16.0, 17.0))
    assert "is in 2 pieces; the longest, of 16 s, was used" in found.warnings[0]
    assert found.stiffness_ratio == pytest.approx(whole.stiffness_ratio, rel=1e-3)


def test_jitter_is_kept_in_time_and_said() -> None:
    ticks = np.arange(5000) / 1000
    jitter = np.random.default_rng(0).uniform(0, 3e-4, len(ticks))

    def swinging(time: np.ndarray) -> RigLog:
        seen = {"angle": 0.1 * np.sin(7 * time), "drive0_speed": np.full(len(time), 0.8)}
        return RigLog("x", time, seen, {}, RIG, InstrumentCalibrations(), Experiment())

    motion = disc_motion(swinging(ticks + jitter))
    assert motion.step == pytest.approx(1e-3, rel=1e-9) and not motion.filled.any()
    assert "sampled unevenly: intervals depart from 0.001 s by 13 % (rms)" in motion.warnings[0]
    # read at the ticks the angle would be wrong by up to 0.7 rad/s of the jitter, 2e-4 rad
    np.testing.assert_allclose(motion.angle, 0.1 * np.sin(7 * motion.time), atol=2e-6)
    with pytest.raises(StickslipError, match="no even clock"):
        disc_motion(swinging(ticks + 3 * jitter))


def test_lost_samples_are_filled_and_their_slips_left_out(logs: list[RigLog]) -> None:
    whole = pooled(logs, lambda log: log)
    slip = whole.segments[5]
    lost = (slip.first + slip.last) // 2
    ready = pooled(logs, lambda log: rows(log, np.delete(np.arange(len(log.time)), [lost, lost + 1])))
    assert len(ready.segments) == len(whole.segments) - 1
    assert any("lacks 2 samples" in w for w in ready.warnings)
    (motion,) = ready.motions
    assert np.flatnonzero(motion.filled).tolist() == [lost, lost + 1]


def test_cells_without_a_number_cost_their_slip_alone(logs: list[RigLog]) -> None:
    whole = pooled(logs, lambda log: log)
    laser = logs[1].column("laser").copy()
    laser[whole.segments[5].first + 20] = np.nan
    assert len(pooled(logs, lambda log: columns(log, laser=laser)).segments) == len(whole.segments) - 1
    count = logs[1].column("drive0_count").copy()
    count[700] = np.nan
    with pytest.raises(StickslipError, match=r"'drive0_count' holds no number in 1 samples, first at 0\.7 s"):
        pooled(logs, lambda log: columns(log, drive0_count=count))


def test_stray_readings_of_the_laser_are_left_out(logs: list[RigLog]) -> None:
    laser = logs[1].column("laser").copy()
    laser[[4000, 9000, 9001, 15000]] = [9.9, 0.2, 0.2, 300.0]  # the last is beyond R
    motion = disc_motion(columns(logs[1], laser=laser))
    assert np.flatnonzero(motion.filled).tolist() == [4000, 9000, 9001, 15000]
    assert any(
        "leaps and comes back" in warning and "in 3 samples, first at 4 s" in warning for warning in motion.warnings
    )
    with pytest.raises(StickslipError, match=r"displacement exceeds the radius.*millivolts"):
        disc_motion(columns(logs[1], laser=1000 * logs[1].column("laser")))


@pytest.mark.parametrize("stated", [True, False])
def test_a_saturated_laser_is_masked_and_its_share_said(logs: list[RigLog], stated: bool) -> None:
    log = logs[1]
    volts = log.column("laser")
    limit = float(np.quantile(volts, 0.93))
    laser: LaserCalibration = log.calibration.need("laser")
    known = replace(laser, highest=limit if stated else float("inf"))
    cut = columns(
        replace(log, calibration=replace(log.calibration, laser=known)), laser=np.minimum(volts, round(limit, 3))
    )
    motion = disc_motion(cut)
    assert np.mean(motion.filled) == pytest.approx(np.mean(volts >= round(limit, 3)), abs=1e-3)
    assert f"the laser is saturated in {100 * np.mean(motion.filled):.2g} % of the samples" in motion.warnings[0]
    assert not disc_motion(log).filled.any()


def test_two_recorders_show_by_a_delay_that_drifts(logs: list[RigLog]) -> None:
    rate = 150e-6

    def drifting(log: RigLog) -> RigLog:
        return columns(log, laser=np.interp(log.time * (1 - rate), log.time, log.column("laser")))

    ready = pool([drifting(logs[0]), logs[1], logs[2], logs[3]])
    (warning,) = [w for w in ready.warnings if "drifts" in w]
    assert "'paper-rubber-0.41': the laser's delay" in warning
    value, deviation = (float(part.split()[-1]) for part in warning.partition(" ms")[0].split(" ± "))
    # over 20 s the laser falls behind by 3 ms
    assert value == pytest.approx(3.0, abs=4 * deviation + 0.05) and deviation < 0.3
    assert "rates differ by 1" in warning


def test_recorders_started_apart_show_by_their_delay(logs: list[RigLog]) -> None:
    late = columns(logs[0], laser=np.interp(logs[0].time - 2e-3, logs[0].time, logs[0].column("laser")))
    ready = pool([late, logs[1], logs[2], logs[3]])
    assert any("'paper-rubber-0.41': the laser lags by 1.9" in w for w in ready.warnings)


ENCODERS = {
    "four edges counted": (EncoderCalibration(250), r"shows 3\.9\d* times.*\"quadrature\": true"),
    "one edge counted": (EncoderCalibration(1000, quadrature=True), r"shows 0\.2\d* times.*\"quadrature\": false"),
    "half the pulses": (EncoderCalibration(500), r"agree with \"pulses_per_revolution\": 1000 .*gain is 0\.0199 m/V"),
}


@pytest.mark.parametrize(("encoder", "said"), ENCODERS.values(), ids=ENCODERS)
def test_a_wrong_resolution_of_the_encoder_is_named(logs: list[RigLog], encoder: EncoderCalibration, said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        pooled(logs, lambda log: replace(log, calibration=replace(log.calibration, encoder=encoder)))


def test_a_laser_that_looks_the_other_way_is_named(logs: list[RigLog]) -> None:
    def turned(log: RigLog) -> RigLog:
        laser: LaserCalibration = log.calibration.need("laser")
        return replace(log, calibration=replace(log.calibration, laser=replace(laser, gain=-laser.gain)))

    with pytest.raises(StickslipError, match="opposite directions"):
        pool([turned(logs[1]), turned(logs[3])])


DRIVES = {
    "four edges counted": (EncoderCalibration(250), r"four times too fast.*\"quadrature\": true"),
    "one edge counted": (EncoderCalibration(1000, quadrature=True), r"four times too slow"),
    "twice the pulses": (EncoderCalibration(2000), r"twice too slow"),
}


@pytest.mark.parametrize(("drive0", "said"), DRIVES.values(), ids=DRIVES)
def test_a_wrong_resolution_of_the_drive_is_named(logs: list[RigLog], drive0: EncoderCalibration, said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        pooled(logs, lambda log: replace(log, calibration=replace(log.calibration, drive0=drive0)), number=0)


def test_angles_in_degrees_show_by_the_speed_in_sticks(logs: list[RigLog]) -> None:
    motion = disc_motion(logs[1])
    converted = {"angle": np.degrees(motion.angle), "drive0_speed": motion.drive}
    log = replace(logs[1], columns=converted, rig=logs[1].rig)
    with pytest.raises(StickslipError, match="angle is in degrees where radians are stated"):
        pool([log])
    slow = replace(log, columns={"angle": motion.angle, "drive0_speed": motion.drive * 30 / np.pi})
    with pytest.raises(StickslipError, match="revolutions per minute where rad/s"):
        pool([slow])


def test_a_drive_that_is_not_as_stated_is_said(logs: list[RigLog]) -> None:
    stated = replace(logs[1], experiment=replace(logs[1].experiment, drive_speed=(0.83 / 1.5,)))
    (warning,) = pool([stated, logs[3]]).warnings[:1]
    assert "turns at 0.8297 rad/s, 1.5 times" in warning and '"pulses_per_revolution": 1500' in warning


def test_a_missing_free_decay_is_said(logs: list[RigLog]) -> None:
    unknown = [replace(log, rig=replace(log.rig, c=None)) for log in logs[:3]]
    with pytest.raises(StickslipError, match=r"does not state c, and there is no free decay.*Record one"):
        pool(unknown)
    pool([*unknown, logs[3]])


def test_a_log_that_passes_one_line_alone_is_no_singular_matrix(logs: list[RigLog]) -> None:
    still = logs[1].column("encoder_count").copy()
    middle = float(np.median(still))
    few = columns(logs[1], encoder_count=np.where(still > middle, middle + 1, middle))
    few = replace(few, columns={n: c for n, c in few.columns.items() if n != "encoder_edge_time"})
    ready = pool([few, logs[0], logs[3]])
    assert ready.sensors.lines >= 5 and np.isfinite(ready.sensors.covariance).all()


def test_what_was_mended_is_in_the_result(logs: list[RigLog]) -> None:
    ready = pool([replace(logs[1], warnings=("time was rebuilt.",)), logs[3]])
    assert ready.warnings[0] == "Log 'paper-rubber-0.83': time was rebuilt."


def test_friction_that_rises_with_speed_is_said_to_need_another_law() -> None:
    from scipy.integrate import solve_ivp

    time = np.arange(2500) / 500
    drive = 0.75 + 0.6 * np.sin(2 * time)

    def rate(t: float, state: np.ndarray) -> tuple[float, float]:
        slip = RIG.value("r") * (0.75 + 0.6 * np.sin(2 * t)) - RIG.value("R") * state[1]
        torque = RIG.value("R") * RIG.value("N0") * (0.3 + 1.0 * slip)
        return state[1], (torque - RIG.value("c") * state[1] - RIG.value("k") * state[0]) / RIG.value("J")

    angle = solve_ivp(rate, (0, 5), (0.08, 0.0), t_eval=time, rtol=1e-9, atol=1e-9).y[0]
    noise = np.random.default_rng(0).normal(0, 1e-5, len(time))
    log = RigLog(
        "x", time, {"angle": angle + noise, "drive0_speed": drive}, {}, RIG, InstrumentCalibrations(), Experiment()
    )
    found = fit_friction(pool([log], allow_no_stick=True), estimator="weak-form")
    assert found["mu_s"].value < found["mu_k"].value
    (warning,) = [warning for warning in found.warnings if "is less than mu_k" in warning]
    assert "viscous" in warning


def test_comparison_takes_the_pieces_that_hold_cycles(logs: list[RigLog]) -> None:
    motions = measured_motions([without(logs[1], 8.0, 16.0), logs[0], logs[3]], natural_period=0.9)[("disc0",)]
    assert [m.log.name for m in motions] == ["paper-rubber-0.83", "paper-rubber-0.41"]
    assert motions[0].time[-1] < 8.0
