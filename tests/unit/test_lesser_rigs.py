"""Logs of rigs that have less than a laser, an encoder and an encoder on the drive: truths of the emulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.estimators.shooting_segments import LINE, ShootingProblem
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.measurement.disc_motion import disc_motion
from identification.measurement.free_decay import fit_free_decay
from identification.measurement.pooling import pool
from identification.model_check.families import compare_families
from rig_io.bench.emulator import MATERIALS, emulate, standard_set
from rig_io.logs.log import RigLog

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


@pytest.mark.parametrize("estimator", ["weak-form", "savitzky-golay"])
def test_regressions_carry_misplaced_lines_in_their_deviations(counted: list[RigLog], estimator: str) -> None:
    ready = pool(counted)
    fit = fit_friction(ready, estimator=estimator)
    blind = fit_friction(replace(ready, sensors=replace(ready.sensors, rms=0.0)), estimator=estimator)
    assert all(held(fit))
    assert fit["p"].standard_deviation > 1.2 * blind["p"].standard_deviation
    assert fit.whiteness is None


def test_without_a_free_decay_the_zero_is_open_by_half_a_pitch(counted: list[RigLog]) -> None:
    shot, regressed = (fit_friction(counted[:2], estimator=name) for name in ("shooting", "weak-form"))
    # drives in one direction: mu is off by k zero/(R N), with the zero even over a pitch of 2 pi/1000
    rig = counted[0].rig
    loose = 2 * np.pi / 1000 / np.sqrt(12) * rig.value("k") / (rig.value("R") * rig.value("N0"))
    assert shot["mu_k"].standard_deviation == pytest.approx(loose, rel=0.1)
    zero = regressed.constant("zero")
    assert zero.standard_uncertainty == pytest.approx(2 * np.pi / 1000 / np.sqrt(12))
    assert regressed["mu_k"].scale_deviation > 0.9 * loose
    assert all(held(shot))


def test_a_free_decay_of_another_sensor_gives_no_zero(counted: list[RigLog]) -> None:
    decay = fit_free_decay(emulate(standard_set()[-1], 5, 2))
    assert decay.sensor == "laser"
    (zero,) = (prior for prior in pool(counted[:2], free_decay=decay).priors if prior.name == "zero")
    assert zero.standard_uncertainty > 1e-3


def test_a_disc_that_no_sensor_sees_or_that_hardly_moves_is_refused(counted: list[RigLog]) -> None:
    log = counted[0]
    drive = {name: column for name, column in log.columns.items() if name.startswith("drive")}
    with pytest.raises(StickslipError, match="does not show the disc's angle"):
        disc_motion(replace(log, columns=drive))
    still = {name: np.full_like(column, column[0]) for name, column in log.columns.items() if name not in drive}
    with pytest.raises(StickslipError, match="the disc hardly moved"):
        disc_motion(replace(log, columns={**drive, **still}))
