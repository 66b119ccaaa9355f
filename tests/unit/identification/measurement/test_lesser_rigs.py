"""Logs of rigs that have less than a laser, an encoder and an encoder on the drive: truths of the emulator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.estimators.shooting_segments import LINE, ShootingProblem
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.measurement.disc_motion import disc_motion, smooth_drive
from identification.measurement.free_decay import fit_free_decay
from identification.measurement.pooling import pool
from identification.model_check.families import compare_families
from rig_io.bench.disturbances import Disturbances
from rig_io.bench.emulation import Disc, Emulation
from rig_io.bench.emulator import emulate, standard_set
from rig_io.bench.materials import MATERIALS
from rig_io.logs.log import RigLog
from rig_io.packages.datapackage import read_package, write_package
from rig_io.sensors.load_cell import LoadCell

TRUTH = MATERIALS["paper/rubber"].values


@pytest.fixture(scope="module")
def counted() -> list[RigLog]:
    """Two short logs and a free decay, seen by the encoder alone."""
    settings = standard_set(speeds=(0.83, 1.4), duration=8.0, laser=None)
    return [emulate(one, 5, number) for number, one in enumerate(settings)]


@pytest.fixture(scope="module")
def shot(counted: list[RigLog]) -> FrictionFit:
    return fit_friction(counted)


def held(fit: FrictionFit) -> list[bool]:
    ends = [(fit.interval(name), value) for name, value in TRUTH.items()]
    return [low <= value <= high for (low, high), value in ends]


@pytest.mark.nightly
def test_an_encoder_alone_gives_the_law(counted: list[RigLog], shot: FrictionFit) -> None:
    fit = shot
    assert all(held(fit))
    # lines misplaced by 73 urad rms, each passed again and again, are found with the law
    assert np.max(np.abs(fit.law_values / list(TRUTH.values()) - 1)) < 5e-3
    assert [one.name for one in fit.nuisance] == ["zero"]
    assert any("Nothing but the encoder shows the angle" in warning for warning in fit.warnings)
    (family,) = compare_families(fit, counted, uncertainty=False)
    assert all(one.passed for one in family.members)


def test_derivatives_by_lines_and_zero_are_those_of_the_residuals(shot: FrictionFit) -> None:
    assert shot.solved is not None
    problem = shot.solved.problem
    assert isinstance(problem, ShootingProblem)
    x = shot.solved.solution.values
    here = problem.evaluate(x)
    names = [unknown.name for unknown in problem.unknowns]
    lines = problem.segments[0].lines
    assert lines is not None
    for name in ("zero", f"{LINE}{lines[2]}"):
        step = np.where(np.array(names) == name, 1e-5, 0.0)
        # rows and gradient have the start states projected out: their differences do so to first order
        slope = (problem.evaluate(x + step).residual - problem.evaluate(x - step).residual) / 2e-5
        assert slope == pytest.approx(here.gradient[:, names.index(name)], abs=1e-3 * np.abs(slope).max())


@pytest.mark.nightly_for("weak-form")
@pytest.mark.parametrize("estimator", ["weak-form", "savitzky-golay"])
def test_regressions_carry_misplaced_lines_in_their_deviations(counted: list[RigLog], estimator: str) -> None:
    ready = pool(counted)
    fit = fit_friction(ready, estimator=estimator)
    blind = fit_friction(replace(ready, sensors=replace(ready.sensors, rms=0.0)), estimator=estimator)
    assert all(held(fit))
    assert fit["p"].standard_deviation > 1.2 * blind["p"].standard_deviation
    assert fit.whiteness is None


@pytest.mark.nightly
def test_without_a_free_decay_the_zero_is_open_by_half_a_pitch(counted: list[RigLog]) -> None:
    shot, regressed = (fit_friction(counted[:2], estimator=name) for name in ("shooting", "weak-form"))
    # drives in one direction: mu is off by k zero/(R N), with the zero even over a pitch of 2 pi/1000
    rig = counted[0].rig
    loose = 2 * np.pi / 1000 / np.sqrt(12) * rig.value("k") / (rig.value("R") * rig.value("N0"))
    assert shot["mu_k"].standard_deviation == pytest.approx(loose, rel=0.1)
    zero = pool(counted[:2]).zero
    assert zero is not None
    assert zero.standard_uncertainty == pytest.approx(2 * np.pi / 1000 / np.sqrt(12))
    assert regressed["mu_k"].standard_deviation > 0.9 * loose
    assert all(held(shot))


def test_a_free_decay_of_another_sensor_gives_no_zero(counted: list[RigLog]) -> None:
    decay = fit_free_decay(emulate(standard_set()[-1], 5, 2))
    assert decay.sensor == "laser"
    zero = pool(counted[:2], free_decay=decay).zero
    assert zero is not None and zero.standard_uncertainty > 1e-3


def test_a_disc_that_no_sensor_sees_or_that_hardly_moves_is_refused(counted: list[RigLog]) -> None:
    log = counted[0]
    drive = {name: column for name, column in log.columns.items() if name.startswith("drive")}
    with pytest.raises(StickslipError, match="does not show the disc's angle"):
        disc_motion(replace(log, columns=drive))
    still = {name: np.full_like(column, column[0]) for name, column in log.columns.items() if name not in drive}
    with pytest.raises(StickslipError, match="the disc hardly moved"):
        disc_motion(replace(log, columns={**drive, **still}))


def bench(**instruments: Any) -> list[RigLog]:
    settings = standard_set(speeds=(0.83, 1.4), duration=8.0, **instruments)
    return [emulate(one, 6, number) for number, one in enumerate(settings)]


@pytest.fixture(scope="module")
def weighed() -> list[RigLog]:
    """Logs whose normal force changes by 5 % once per turn of the drive, as a load cell shows."""
    return bench(disturbances=Disturbances(once=0.05), load_cell=LoadCell(gain_error=0.005))


def derivative(fit: FrictionFit, name: str) -> tuple[np.ndarray, np.ndarray]:
    """By difference, and as the problem has it."""
    assert fit.solved is not None
    problem, x = fit.solved.problem, fit.solved.solution.values
    place = [unknown.name for unknown in problem.unknowns].index(name)
    step = np.where(np.arange(len(x)) == place, 1e-5, 0.0)
    ahead, behind = (problem.evaluate(x + sign * step).residual for sign in (1, -1))
    return (ahead - behind) / 2e-5, problem.evaluate(x).gradient[:, place]


@pytest.mark.nightly
def test_a_laser_alone_has_its_gain_found_with_the_law() -> None:
    logs = bench(encoder=None)
    fit = fit_friction(logs)
    assert all(held(fit))
    (gain,) = fit.nuisance
    assert gain.name == "laser" and gain.standard_deviation < 0.002
    slope, column = derivative(fit, "laser")
    assert slope == pytest.approx(column, abs=1e-3 * np.abs(slope).max())
    regressed = fit_friction(logs, estimator="weak-form")
    assert all(abs(one.value - TRUTH[one.name]) < 3 * one.total_deviation for one in regressed.parameters)
    assert regressed.constant("laser").standard_uncertainty <= 0.002


def test_a_laser_whose_zero_nothing_shows_is_told_with_what_it_may_cost() -> None:
    logs = bench(encoder=None)
    # mu is off by k zero/(R N)
    rig = logs[0].rig
    cost = 1e-3 * rig.value("k") / (rig.value("R") * rig.value("N0"))
    (told,) = (one for one in pool(logs[:2]).warnings if one.startswith("No free decay shows the zero"))
    assert f"every friction coefficient by {cost:.2g}," in told
    assert not any("No free decay shows" in one for one in pool(logs[:2], free_decay=fit_free_decay(logs[2])).warnings)


@pytest.mark.nightly
def test_a_laser_alone_does_not_judge_the_radius() -> None:
    logs = bench(encoder=None)
    R = logs[0].rig.R
    assert R is not None
    off = replace(R, value=1.03 * R.value)
    fit = fit_friction([replace(log, rig=replace(log.rig, R=off)) for log in logs], disturbances="none")
    kept = fit.constant("R")
    assert (kept.value, kept.standard_uncertainty) == pytest.approx((off.value, off.standard_uncertainty))
    assert not fit.contradictions


@pytest.mark.nightly
def test_a_laser_of_unknown_gain_leaves_intervals_at_least_so_wide() -> None:
    logs = bench(encoder=None)
    laser = logs[0].calibration.laser
    assert laser is not None
    loose = replace(logs[0].calibration, laser=replace(laser, gain_deviation=None))
    fit = fit_friction([replace(log, calibration=loose) for log in logs], estimator="weak-form")
    assert fit.unstated("mu_s") == ("laser",) and fit.at_least("p")


@pytest.mark.nightly
def test_nominal_speeds_are_found_with_the_law() -> None:
    logs = bench(drive_encoder=None, speed_deviation=0.005)
    fit, regressed = (fit_friction(logs, estimator=name) for name in ("shooting", "weak-form"))
    assert all(held(fit))
    assert all(abs(one.value - TRUTH[one.name]) < 3 * one.total_deviation for one in regressed.parameters)
    speeds = {one.name: one for one in fit.nuisance if one.name.startswith("w_")}
    assert list(speeds) == ["w_1", "w_2"] and speeds["w_2"].standard_deviation < 0.004
    slope, column = derivative(fit, "w_2")
    assert slope == pytest.approx(column, abs=1e-3 * np.abs(slope).max())
    # drives faster by 1 % are driving discs larger by 1 %
    both = sum(regressed.constant(f"w_{number}").sensitivity["p"] or 0.0 for number in (1, 2))
    assert both == pytest.approx(regressed.constant("r").sensitivity["p"], rel=0.02)
    assert fit.presliding is None
    assert any("How the drives turned is not recorded" in warning for warning in fit.warnings)


@pytest.mark.nightly
def test_a_drive_of_which_nothing_is_known_is_refused() -> None:
    log = bench(drive_encoder=None)[0]
    with pytest.raises(StickslipError, match=r"or a nominal speed: stickslip describe .* --set 'w:FILE="):
        disc_motion(replace(log, experiment=replace(log.experiment, drive_speed=())))
    unsure = fit_friction([log], estimator="weak-form")
    assert "w_1" in unsure.unstated("p")


@pytest.mark.nightly
def test_a_log_that_begins_before_the_motion_has_settled_is_compared_from_its_own_state(shot: FrictionFit) -> None:
    let_go = {"transient": 0.0, "start_angle": 0.08, "at_rest": True, "duration": 12.0}
    settings = [replace(one, **let_go) for one in standard_set(speeds=(0.83, 1.4))[:2]]
    settings[1] = replace(settings[1], duration=6.0)
    logs = [emulate(one, 3, number) for number, one in enumerate(settings)]
    (family,) = compare_families(shot, logs, uncertainty=False)
    assert family.passed
    grown, growing = (one.settling for one in family.members)
    assert grown is not None and growing is not None
    # the swing grows until it sticks first, and is the cycle from there on
    angle, R = disc_motion(logs[0]).angle, logs[0].rig.value("R")
    speed = np.gradient(np.convolve(angle, np.ones(21) / 21, "same"), 1e-3)
    stuck = float(np.argmax(np.abs(R * speed - 0.06 * 0.83)[50:] < 5e-4)) * 1e-3
    assert grown.measured == pytest.approx(stuck, abs=1.0) and grown.model == pytest.approx(grown.measured, abs=0.2)
    assert growing.measured is None and family.members[1].passed
    assert any("begins before its motion has settled" in note for note in family.notes)
    settled = [emulate(replace(one, transient=20.0), 3, number) for number, one in enumerate(settings[:1])]
    (steady,) = compare_families(shot, settled, uncertainty=False)
    assert steady.members[0].settling is None


@pytest.mark.nightly_for("savitzky-golay", "whole-cycle", "weak-form")
@pytest.mark.parametrize("estimator", ["shooting", "whole-cycle", "weak-form", "savitzky-golay"])
def test_the_force_of_a_load_cell_takes_the_place_of_a_constant(weighed: list[RigLog], estimator: str) -> None:
    # by the sensors' noise alone, as the bound on p is
    fit = fit_friction(weighed, estimator=estimator, law_spread="none", disturbances="none")
    assert all(abs(one.value - TRUTH[one.name]) < 3 * one.total_deviation for one in fit.parameters)
    assert fit["p"].total_deviation < 0.04 * fit["p"].value  # 0.4 of it with a constant force
    force = fit.constant("N")
    assert force.source == "load cell" and force.standard_uncertainty == pytest.approx(0.005 * force.value, rel=0.01)
    if estimator == "shooting":
        (share,) = (one for one in fit.nuisance if one.name == "load")
        assert share.value == pytest.approx(1.0, abs=4 * share.standard_deviation)
        assert share.standard_deviation < 0.003
        slope, column = derivative(fit, "load")
        assert slope == pytest.approx(column, abs=1e-3 * np.abs(slope).max())


def test_what_a_load_cell_says_survives_the_files(weighed: list[RigLog], tmp_path: Path) -> None:
    read = read_package(write_package(tmp_path / "logs", weighed))
    assert read[0].calibration.load0 == weighed[0].calibration.load0 is not None
    unstated = [replace(log, rig=replace(log.rig, N0=None)) for log in read]
    assert pool(unstated).values.N == pool(read).values.N == pytest.approx(4.905, rel=0.02)


def test_a_load_cell_that_cannot_be_used_is_said(weighed: list[RigLog]) -> None:
    half = replace(weighed[1], columns={name: row for name, row in weighed[1].columns.items() if name != "load0"})
    assert any("The load cell is not in all logs" in warning for warning in pool([weighed[0], half]).warnings)
    pulled = replace(weighed[0], columns={**weighed[0].columns, "load0": -weighed[0].column("load0")})
    with pytest.raises(StickslipError, match="a disc that is pulled or away"):
        disc_motion(pulled)


@pytest.mark.parametrize("speed", [0.6355, 0.7447, 1.02])
def test_edges_that_beat_with_the_samples_are_no_unevenness_of_the_drive(speed):
    discs = (Disc(MATERIALS["paper/rubber"], speed),)
    log = emulate(Emulation("beats", discs=discs, duration=12.0, sampling_rate=500.0), 52, 0)
    alone = replace(log, columns={name: column for name, column in log.columns.items() if "edge_time" not in name})
    drives = [smooth_drive(one, log.time)[100:-100] for one in (log, alone)]
    assert np.std(drives[1] - drives[0]) < 0.0025 * speed
