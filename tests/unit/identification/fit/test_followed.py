"""Normal force and temperature that a bench records: friction follows them in every estimator, and it is said how."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from identification import fit_friction
from identification.estimators.base import Options
from identification.fit.result import FrictionFit
from identification.fitted_model.model import fitted_model
from identification.inference.lmfit_exchange import Given
from identification.measurement.disc_motion import disc_motion
from identification.measurement.pooling import pool
from identification.model_check.at_log import model_at
from identification.model_check.families import compare_families
from rig_io.bench.emulation import Disc, Emulation
from rig_io.bench.emulator import emulate
from rig_io.bench.materials import MATERIALS
from rig_io.logs.log import RigLog
from tests.helpers.weighed_logs import CELL, COURSES, MEAN, ROOM, weighed_logs

RISE = 0.004  # 1/K
TRUTH = {**MATERIALS["paper/rubber"].values, "load": 1.0, "a_T": RISE}


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    """Normal forces that step, ramp and swing; 8 K warmer at the end."""
    return weighed_logs(["steps", "ramps", "sine"], RISE)


def plain(logs: list[RigLog], estimator: str = "weak-form", **options: object) -> FrictionFit:
    return fit_friction(logs, estimator=estimator, law_spread="none", disturbances="none", **options)  # type: ignore[arg-type]


def with_column(log: RigLog, **columns: np.ndarray) -> RigLog:
    return replace(log, columns={**log.columns, **columns})


def without(log: RigLog, *names: str) -> RigLog:
    return replace(log, columns={name: row for name, row in log.columns.items() if name not in names})


def shares(fit: FrictionFit, words: str) -> list[float]:
    """What an assumption says that the law misses, %, and what without."""
    (line,) = (line for line in fit.structure if words in line)
    return [float(number) for number in re.findall(r"by ([\d.]+) %", line)]


@pytest.mark.nightly_for("shooting", "savitzky-golay", "whole-cycle", "lugre")
@pytest.mark.parametrize("estimator", ["weak-form", "shooting", "savitzky-golay", "whole-cycle", "lugre"])
def test_every_estimator_follows_both(logs: list[RigLog], estimator: str) -> None:
    fit = plain(logs, estimator)
    found = {one.name: one for one in (*fit.parameters, *fit.nuisance)}
    for name, true in TRUTH.items():
        assert abs(found[name].value - true) < 3 * found[name].total_deviation, name
    rough = estimator == "savitzky-golay"
    assert found["a_T"].standard_deviation < (0.1 if rough else 0.05) * RISE
    assert found["p"].standard_deviation < (0.1 if rough else 0.01) * 15
    kept, mean = shares(fit, "normal force of the load cell, 3.4")
    assert kept < 1 and mean > 15
    kept, ignored = shares(fit, "the law is that at 295 K (21.9 degC)")
    assert kept < 1 and 0.4 < ignored < 1


@pytest.mark.parametrize("name", ["load", "a_T"])
def test_derivatives_in_shooting_are_differences(logs: list[RigLog], name: str) -> None:
    solved = plain([logs[0], logs[-1]], "shooting").solved
    assert solved is not None
    problem, x = solved.problem, solved.solution.values
    place = [unknown.name for unknown in problem.unknowns].index(name)
    step = np.where(np.arange(len(x)) == place, 1e-6, 0.0)
    ahead, behind = (problem.evaluate(x + sign * step).residual for sign in (1, -1))
    column = problem.evaluate(x).gradient[:, place]
    assert (ahead - behind) / 2e-6 == pytest.approx(column, abs=1e-3 * np.abs(column).max())


def test_a_normal_force_that_is_held_at_its_mean_ruins_the_fit(logs: list[RigLog]) -> None:
    held = Given(held={"load": 0.0}, bounds={"load": (-1.0, 1.0)}, first={"load": 0.0})
    fit = plain(logs, options=Options(given=held))
    assert fit.rms_residual > 20 * plain(logs).rms_residual
    assert not any("load cell" in line for line in fit.structure)


def test_a_temperature_that_hardly_changes_is_not_sought_and_that_is_said() -> None:
    calm = weighed_logs(["sine", "ramps"], rise=1.0, speeds=(0.83, 1.4))
    fit = plain(calm)
    assert "a_T" not in {one.name for one in fit.nuisance}
    assert any("294.5 to 295.5 K, changes too little" in line for line in fit.structure)


def test_what_is_not_recorded_everywhere_is_said(logs: list[RigLog]) -> None:
    ready = pool([without(logs[0], "temperature"), *logs[1:]])
    assert not ready.warms and any("The temperature is recorded in" in warning for warning in ready.warnings)
    both = emulate(Emulation("both", discs=(Disc(), Disc(drive_speed=0.41)), duration=4.0, transient=1.0))
    both = with_column(both, temperature=np.linspace(ROOM, ROOM + 9, len(both.time)))
    both = replace(both, units={**both.units, "temperature": "K"})
    assert any("temperature does to friction is followed with one disc" in warning for warning in pool([both]).warnings)


def test_a_force_that_steps_is_not_smoothed_over_its_steps(logs: list[RigLog]) -> None:
    motion = disc_motion(logs[0])
    assert motion.loads is not None
    true = MEAN * COURSES["steps"](motion.time)
    off = np.abs(motion.loads[0] - true)
    edges = np.flatnonzero(np.diff(true))
    away = np.min(np.abs(motion.time[:, None] - motion.time[edges]), axis=1) > 0.006  # the bench's step takes 5 ms
    assert len(edges) >= 5 and off[away].max() < 6 * CELL
    assert np.sqrt(np.mean(off[away] ** 2)) < 0.5 * CELL  # and smoothed elsewhere


def test_a_normal_force_near_nothing_is_told(logs: list[RigLog]) -> None:
    slack = np.where(np.abs(logs[0].time - 4) < 0.3, 0.1, logs[0].column("load0"))
    (warning,) = disc_motion(with_column(logs[0], load0=slack)).warnings
    assert "comes down to 0.09" in warning or "comes down to 0.1 N" in warning
    assert not disc_motion(logs[0]).warnings


@pytest.fixture(scope="module")
def constant() -> list[RigLog]:
    """Logs of steady loads, each 1.5 K warmer than the last, of a friction that rises by 4 % with each kelvin."""
    return weighed_logs(["none", "none", "none"], 0.04, rise=6.0, duration=10.0, transient=15.0)


@pytest.mark.nightly
def test_a_log_is_compared_at_its_own_load_and_temperature(constant: list[RigLog], logs: list[RigLog]) -> None:
    fit = plain(constant, "shooting")
    assert fit.sensors["temperature"] == pytest.approx(ROOM, abs=0.02)
    read = FrictionFit.from_dict(fit.to_dict())
    (family,) = compare_families(read, constant, uncertainty=False)
    assert sum("Assumed: " in note for note in family.notes) == 2
    assert family.passed
    # as if all logs were at the mean temperature: friction 8 % off at either end
    (cold,) = compare_families(read, [without(log, "temperature") for log in constant], uncertainty=False)
    assert not cold.passed
    (swayed,) = compare_families(read, logs[:1], uncertainty=False)
    assert any("goes from 3.4" in note and "runs at its mean" in note for note in swayed.notes)


def test_a_heavier_load_and_a_warmer_room_are_one_friction_of_the_model(logs: list[RigLog]) -> None:
    fit = replace(plain(logs), sensors={"temperature": ROOM})
    rise = next(one.value for one in fit.nuisance if one.name == "a_T")
    model, rows = fitted_model(fit), len(logs[0].time)
    warm = with_column(logs[0], load0=np.full(rows, 6.0), temperature=np.full(rows, ROOM + 10))
    at = model_at(fit, model, disc_motion(warm))
    assert at.parameters["N0"] == pytest.approx(6.0 * (1 + 10 * rise), rel=1e-9)
    assert {name: at.parameters[name] for name in ("mu_s0", "J")} == {n: model.parameters[n] for n in ("mu_s0", "J")}
