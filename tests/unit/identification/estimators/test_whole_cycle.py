"""Output error over whole cycles: rigid and with bristles, from short emulated logs of known truth."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from short_bench import bench

from fmu_models.base.errors import StickslipError
from fmu_models.scene.read import read_scene
from identification.estimators import lugre, shooting, whole_cycle
from identification.estimators.base import Options
from identification.estimators.segment_runs import Start
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.fit import fit_friction
from identification.fitted_model.model import fitted_model
from identification.laws import find_law
from identification.measurement.pooled import Pool
from rig_io.bench.emulation import Disc, Emulation, MicroSlip
from rig_io.bench.emulator import emulate

CONTI = find_law("Conti")
TRUTH = np.array([0.65, 0.35, 15.0])
BRISTLES = np.array([0.65, 0.35, 15.0, 2e4, 100.0])


@pytest.fixture(scope="module")
def rigid() -> Pool:
    return bench(None)


@pytest.fixture(scope="module")
def elastic() -> Pool:
    return bench(MicroSlip(2e4))


def shot(ready: Pool) -> tuple[ShootingProblem, np.ndarray]:
    made = shooting.estimate(ready, CONTI, Options())
    assert isinstance(made.problem, ShootingProblem)
    return made.problem, made.solution.values


def exact(problem: ShootingProblem) -> ShootingProblem:
    """The same problem with logs that the model follows exactly at the first values."""
    segments = [replace(a, measured=problem._seen(i, problem.first, [])[0]) for i, a in enumerate(problem.segments)]
    return replace(problem, segments=tuple(segments), starts=tuple(Start(s.at(problem.first)) for s in problem.starts))


def check_gradient(problem: ShootingProblem, steps: dict[str, float], near: float) -> None:
    problem = exact(problem)
    here = problem.evaluate(problem.first)
    for place, unknown in enumerate(problem.unknowns):
        if unknown.name not in steps:
            continue
        step = steps[unknown.name] * np.eye(len(problem.unknowns))[place]
        more, less = (problem.evaluate(problem.first + sign * step).residual for sign in (1, -1))
        column = here.gradient[:, place]
        slope = (more - less) / (2 * steps[unknown.name])
        # within a step an event moves past a sample or two, where the motion bends: those rows have no derivative
        off = np.abs(column - slope) > near * np.max(np.abs(column))
        assert np.mean(off) < 5e-3, (unknown.name, np.flatnonzero(off))


def test_gradient_reaches_through_stick_and_release(rigid: Pool) -> None:
    slips, x = shot(rigid)
    problem = whole_cycle.cycle_problem(slips, x, CONTI, TRUTH, Options())
    problem = replace(problem, segments=problem.segments[:2], starts=problem.starts[:2])
    check_gradient(problem, {"mu_s": 1e-6, "mu_k": 1e-6, "p": 1e-4, "gain": 1e-6}, 1e-6)


def test_gradient_of_bristles(elastic: Pool) -> None:
    slips, x = shot(elastic)
    problem = whole_cycle.cycle_problem(slips, x, find_law("LuGre"), BRISTLES, Options())
    problem = replace(problem, segments=problem.segments[:2], starts=problem.starts[:2])
    check_gradient(problem, {"mu_s": 1e-6, "mu_k": 1e-6, "p": 1e-4, "sigma0": 1.0, "sigma1": 0.01}, 3e-6)


def test_cycles_hold_a_stick_each_and_end_before_the_next_slip(rigid: Pool) -> None:
    slips, x = shot(rigid)
    problem = whole_cycle.cycle_problem(slips, x, CONTI, x[:3], Options())
    gap = whole_cycle.ONSET * rigid.natural_period
    for log in (0, 1):
        segments = [segment for segment in problem.segments if segment.log == log]
        gaps = [after.time[0] - before.time[-1] for before, after in pairwise(segments)]
        np.testing.assert_allclose(gaps, gap, atol=1.1e-3)
    slip, cluster = (getattr(problem.evaluate(problem.first), name) for name in ("slip", "cluster"))
    whole = [label for label, segment in enumerate(problem.segments) if segment.time[-1] < 5.9]
    assert all(np.isnan(slip[cluster == label]).any() for label in whole)


def test_whole_cycles_find_the_truth_closer_than_slip_does(rigid: Pool) -> None:
    slip, whole = (fit_friction(rigid, estimator=name) for name in ("shooting", "whole-cycle"))
    assert whole.estimator == "whole-cycle"
    for value, near, far in zip(TRUTH, whole.parameters, slip.parameters, strict=True):
        assert near.bound is not None and far.bound is not None
        assert near.bound < 0.6 * far.bound
        assert abs(near.value - value) < 5 * near.bound


@pytest.mark.nightly
def test_micro_slip_is_told_by_the_rigid_model_and_found_by_bristles(elastic: Pool) -> None:
    wrong = fit_friction(elastic, estimator="whole-cycle")
    assert any("times the noise" in warning and "micro-slip" in warning for warning in wrong.warnings)
    found = fit_friction(elastic, estimator="lugre")
    assert (found.estimator, found.law) == ("lugre", "LuGre")
    for value, parameter in zip(BRISTLES, found.parameters, strict=True):
        assert parameter.bound is not None
        # the bound knows nothing of the drive's errors, a jackknife over nine cycles little
        assert abs(parameter.value - value) < 4 * np.hypot(parameter.bound, parameter.standard_deviation)
        assert parameter.bound < 0.03 * value


@pytest.mark.nightly
def test_without_micro_slip_bristles_are_not_made_up(rigid: Pool) -> None:
    found = fit_friction(rigid, estimator="lugre")
    assert (found.estimator, found.law) == ("whole-cycle", "Conti")
    assert "show no micro-slip" in found.warnings[0]


def test_an_interrupted_stage_leaves_the_one_before(rigid: Pool) -> None:
    counts: list[int] = []

    def stop(count: int, _: float) -> None:
        counts.append(count)
        # each search counts anew: weak form, two of slip shooting, then this one
        if counts.count(1) == 4:
            raise KeyboardInterrupt

    found = fit_friction(rigid, estimator="whole-cycle", options=Options(progress=stop))
    assert found.estimator == "shooting"
    assert found.warnings[0] == "Interrupted: this is the result of slip shooting."


def test_laws_that_bristles_do_not_fit_are_refused(rigid: Pool) -> None:
    with pytest.raises(StickslipError, match="bristles before Conti's law or Stribeck's, not before 'Coulomb'"):
        lugre.estimate(rigid, find_law("Coulomb"), Options())
    with pytest.raises(StickslipError, match="fitted by the estimator 'lugre'"):
        fit_friction(rigid, law="LuGre")


@pytest.mark.nightly
def test_bristles_before_stribecks_curve_are_found(tmp_path: Path) -> None:
    truth = {"mu_s": 0.65, "mu_k": 0.35, "v_s": 0.06, "mu_v": 0.3, "sigma0": 3e4, "sigma1": 100.0}
    values = ", ".join(f"{name}0 = {value}" for name, value in truth.items())
    path = tmp_path / "rig.toml"
    path.write_text(
        'title = "rig"\nmodel = "disc_rig"\ncontacts = ["disc0"]\nlaws = { disc0 = "lugre_stribeck" }\nstop_time = 8\n'
        f"free = {{ {values} }}\ndrives = {{ w0 = 0.83 }}\ncompute = {{ kind = 'trajectory' }}\n",
        encoding="utf-8",
    )
    scene = read_scene(path)
    speeds = (0.41, 0.83, 1.4)
    settings = [Emulation(f"{w:g}", (Disc(drive_speed=w),), duration=6.0, transient=1.0, scene=scene) for w in speeds]
    logs = [emulate(one, 5, number) for number, one in enumerate(settings)]
    fit = fit_friction(logs, estimator="lugre", law="Stribeck+viscous")
    assert (fit.estimator, fit.law) == ("lugre", "LuGre+Stribeck")
    for one in fit.parameters:
        assert one.value == pytest.approx(truth[one.name], rel=0.01)
        assert abs(one.value - truth[one.name]) < 3 * one.total_deviation
    # steady sliding is that of Stribeck's curve: N R mu(r w)/k, nearly
    found = fitted_model(fit).sliding({"disc0": 2.0})
    assert found is not None
    mu = 0.35 + 0.3 * np.exp(-((0.12 / 0.06) ** 2)) + 0.3 * 0.12
    assert found.angle == pytest.approx(4.905 * 0.125 * mu / 2.62, rel=0.01)
