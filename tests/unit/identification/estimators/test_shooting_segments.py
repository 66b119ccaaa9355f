"""Shooting segments of short emulated logs: gradient, start states projected out, nuisance parameters, refusals."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from fmu_models.base.errors import StickslipError
from identification.estimators import ESTIMATORS, shooting
from identification.estimators.base import Options
from identification.estimators.segment_runs import Start
from identification.estimators.shooting_problem import noise
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.adjust import as_stated
from identification.fit.conclude import conclude
from identification.fit.fit import fit_friction
from identification.inference.choice import Inference
from identification.inference.problem import solve
from identification.laws import find_law
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import RigLog, StatedQuantity

pytestmark = pytest.mark.digits

CONTI = find_law("Conti")
TRUTH = np.array([0.65, 0.35, 15.0])


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    """Two drive speeds, 6 s each."""
    settings = standard_set(speeds=(0.83, 1.4), duration=6.0)[:2]
    return [emulate(one, 7, number) for number, one in enumerate(settings)]


@pytest.fixture(scope="module")
def ready(logs: list[RigLog]) -> Pool:
    return pool(logs)


def problem_of(
    ready: Pool, law: str = "Conti", q: np.ndarray = TRUTH, nuisance: tuple[str, ...] = ()
) -> ShootingProblem:
    segments, known = shooting.slip_shooting(ready)
    return shooting.shooting_problem(ready, find_law(law), segments, q, Options(nuisance), known)


def exact(problem: ShootingProblem, x: np.ndarray) -> ShootingProblem:
    """The same problem with logs that the model follows exactly at x."""
    segments = []
    for number, segment in enumerate(problem.segments):
        seen = problem._seen(number, x, [])[0]
        segments.append(replace(segment, measured=seen))
    return replace(problem, segments=tuple(segments), starts=tuple(Start(start.at(x)) for start in problem.starts))


STEPS = {"mu_s": 1e-5, "mu_k": 1e-5, "mu": 1e-5, "mu_v": 1e-5, "p": 1e-3, "v_s": 1e-6, "gain": 1e-5, "delay": 1e-6}


@pytest.mark.parametrize(
    ("law", "q"),
    [
        ("Conti", TRUTH),
        ("Conti+viscous", np.array([0.65, 0.35, 15.0, 0.02])),
        ("Coulomb", np.array([0.45])),
        ("Coulomb+viscous", np.array([0.45, 0.05])),
        ("Tustin", np.array([0.6, 0.4, 0.05])),
    ],
)
def test_gradient_is_the_derivative_for_every_law(ready: Pool, law: str, q: np.ndarray) -> None:
    nuisance = ("J", "k", "c", "R", "r", "N", "zero") if law in ("Conti", "Conti+viscous") else ()
    problem = problem_of(ready, law, q, nuisance)
    problem = replace(problem, segments=problem.segments[:3], starts=problem.starts[:3])
    problem = exact(problem, problem.first)
    here = problem.evaluate(problem.first)
    assert np.max(np.abs(here.residual)) < 1e-6
    # the projection takes most of a column away, whose rounding stays
    raw = np.abs(problem._seen(0, problem.first, [u.name for u in problem.unknowns])[2]).max(axis=0)
    raw /= problem.segments[0].deviation
    for place, unknown in enumerate(problem.unknowns):
        step = np.zeros(len(problem.unknowns))
        step[place] = STEPS.get(unknown.name, 1e-5 * max(abs(problem.first[place]), 1e-2))
        more, less = (problem.evaluate(problem.first + sign * step).residual for sign in (1, -1))
        slope = (more - less) / (2 * step[place])
        near = 1e-6 * np.max(np.abs(here.gradient[:, place])) + 1e-9 * raw[place]
        np.testing.assert_allclose(here.gradient[:, place], slope, atol=near, err_msg=unknown.name)


def test_the_gradient_of_the_sum_of_squares_is_exact_away_from_the_solution(ready: Pool) -> None:
    problem = problem_of(ready)
    x = problem.first * [1.02, 0.97, 1.1, 1.0, 1.0]

    def cost(x: np.ndarray) -> float:
        return 0.5 * float(np.sum(problem.evaluate(x).residual ** 2))

    here = problem.evaluate(x)
    slope = here.gradient.T @ here.residual
    for place, h in enumerate((1e-6, 1e-6, 1e-4)):
        step = h * np.eye(len(x))[place]
        assert slope[place] == pytest.approx((cost(x + step) - cost(x - step)) / (2 * h), rel=1e-6)


def test_projection_equals_the_joint_solve_with_starts_as_unknowns(ready: Pool) -> None:
    problem = problem_of(replace(ready, sensors=replace(ready.sensors, covariance=np.zeros((2, 2)))))
    assert [unknown.name for unknown in problem.unknowns] == ["mu_s", "mu_k", "p"]
    problem = replace(problem, segments=problem.segments[:3], starts=problem.starts[:3])
    found = solve(problem, tolerance=1e-10)

    def joint(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        starts = tuple(Start(pair) for pair in z[3:].reshape(-1, 2))
        these = replace(problem, starts=starts)
        residual, gradient = [], []
        for number, segment in enumerate(problem.segments):
            seen, by_start, columns, _ = these._seen(number, z[:3], ["mu_s", "mu_k", "p"])
            rows = np.zeros((len(seen), len(z)))
            rows[:, :3], rows[:, 3 + 2 * number : 5 + 2 * number] = columns, by_start
            residual.append((seen - segment.measured) / segment.deviation)
            gradient.append(rows / segment.deviation)
        return np.concatenate(residual), np.vstack(gradient)

    z = np.concatenate([TRUTH, *(start.at(problem.first) for start in problem_of(ready).starts[:3])])

    options: Any = {"jac": lambda z: joint(z)[1]}
    other = least_squares(lambda z: joint(z)[0], z, **options, x_scale="jac", ftol=1e-14, xtol=1e-14)
    np.testing.assert_allclose(found.values, other.x[:3], rtol=1e-6)
    residual, gradient = joint(other.x)
    assert found.evaluation.residual @ found.evaluation.residual == pytest.approx(residual @ residual, rel=1e-9)
    # what the projected gradient says of the parameters is what the joint one says of them
    projected = np.linalg.inv(found.evaluation.gradient.T @ found.evaluation.gradient)
    np.testing.assert_allclose(projected, np.linalg.inv(gradient.T @ gradient)[:3, :3], rtol=1e-3)


def test_shooting_finds_the_truth_and_says_how_well(ready: Pool) -> None:
    made = ESTIMATORS.load("shooting").estimate(ready, CONTI, Options())
    found = conclude(ready, as_stated(made), Inference())
    assert found.estimator == "shooting" and made.warnings == ()
    assert [q.name for q in found.nuisance] == ["gain", "delay"]
    for value, parameter in zip(TRUTH, found.parameters, strict=True):
        assert parameter.bound is not None
        assert abs(parameter.value - value) < 4 * parameter.bound
        assert parameter.standard_deviation == pytest.approx(parameter.bound, rel=0.6)
    # residuals have the variance that the sensor promises, and their rms its size
    here = made.solution.evaluation
    freedom = len(here.residual) - here.eliminated - 5
    assert here.residual @ here.residual == pytest.approx(freedom, rel=5 * np.sqrt(2 / freedom))
    assert found.residual_unit == "m" and found.rms_residual == pytest.approx(20.2e-6, rel=0.03)


def test_ends_of_arcs_are_those_of_the_solved_motion(ready: Pool) -> None:
    made = ESTIMATORS.load("shooting").estimate(ready, CONTI, Options())
    slip = made.solution.evaluation.slip
    assert slip.min() > 0.009
    # the first and last sample of a segment lie within a sample's change of slip speed of the threshold
    problem, first = made.problem, np.flatnonzero(np.diff(made.solution.evaluation.cluster, prepend=-1))
    assert isinstance(problem, ShootingProblem)
    inner = [i for i, segment in enumerate(problem.segments) if segment.time[0] > 0.1 and segment.time[-1] < 5.9]
    assert np.all(slip[first[inner]] < 0.0115)
    assert np.all(slip[np.append(first[1:], len(slip))[inner] - 1] < 0.0115)


def test_what_is_freed_carries_its_prior_into_the_deviations(ready: Pool) -> None:
    plain, freed = fit_friction(ready), fit_friction(ready, options=Options(nuisance=("J", "k", "c", "N")))
    assert [q.name for q in freed.nuisance] == ["gain", "delay", "J", "k", "c", "N"]
    assert {c.name for c in freed.constants} == {"R", "r"}
    # what was a scale deviation is now in the noise's: N and J pass to mu one to one, the logs say nothing of N
    assert freed["mu_s"].standard_deviation > 0.65 * 0.005 / 4.905
    assert freed.nuisance[-1].standard_deviation == pytest.approx(0.005, rel=1e-3)
    assert freed["mu_s"].value == pytest.approx(plain["mu_s"].value, abs=4 * freed["mu_s"].standard_deviation)


def test_resampled_arcs_count_as_often_as_they_are_drawn(ready: Pool) -> None:
    problem = problem_of(ready)
    here = problem.evaluate(problem.first)
    drawn = problem.resampled(np.array([2, 0, 2])).evaluate(problem.first)
    norm = {label: np.sum(here.residual[here.cluster == label] ** 2) for label in (0, 2)}
    parts = [np.sum(drawn.residual[drawn.cluster == label] ** 2) for label in range(3)]
    # the two draws of a segment are one segment with each sample twice, so that the sum alone is comparable
    assert sum(parts) == pytest.approx(norm[0] + 2 * norm[2], rel=1e-6)


def test_a_problem_travels_to_another_process(ready: Pool) -> None:
    problem = problem_of(ready)
    first = problem.evaluate(problem.first).residual
    other = pickle.loads(pickle.dumps(problem))
    np.testing.assert_allclose(other.evaluate(problem.first).residual, first, atol=1e-6)


def test_noise_is_known_from_the_calibration_and_estimated_without(ready: Pool, logs: list[RigLog]) -> None:
    deviation, known = noise(ready.motions[0], 0.125)
    assert known and deviation == pytest.approx(np.hypot(20e-6, 10e-6 / np.sqrt(12)))
    laser = logs[0].calibration.laser
    assert laser is not None
    silent = replace(logs[0], calibration=replace(logs[0].calibration, laser=replace(laser, noise=0.0)))
    estimate, known = noise(pool([silent]).motions[0], 0.125)
    assert not known and estimate == pytest.approx(deviation, rel=0.05)


def test_an_interrupted_search_returns_the_first_values_with_a_warning(ready: Pool) -> None:
    seen = []

    def stop(count: int, cost: float) -> None:
        seen.append(cost)
        if cost > 1.0:  # the sum of squares of the weak form is that of coefficients, that of segments is in deviations
            raise KeyboardInterrupt

    found = fit_friction(ready, options=Options(progress=stop))
    assert found.estimator == "weak-form"
    assert "Interrupted" in found.warnings[0]
    assert found.law_values == pytest.approx(fit_friction(ready, estimator="weak-form").law_values)


def test_what_cannot_be_estimated_or_simulated_is_said(ready: Pool, logs: list[RigLog]) -> None:
    with pytest.raises(StickslipError, match=r"'zerro' cannot be estimated beside the law\. Known are: J, .*zero"):
        fit_friction(ready, options=Options(nuisance=("zerro",)))
    certain = [replace(log, rig=replace(log.rig, N0=StatedQuantity(4.905, "N"))) for log in logs]
    with pytest.raises(StickslipError, match="N is stated without uncertainty"):
        fit_friction(certain, options=Options(nuisance=("N",)))
    with pytest.raises(shooting.Unmodelled, match="mu_s >= mu_k"):
        shooting.shoot(ready, CONTI, np.array([0.3, 0.4, 10.0]), Options())
    short = replace(ready, segments=tuple(replace(s, last=s.first + 50) for s in ready.segments))
    with pytest.raises(StickslipError, match="0 slips last longer than"):
        shooting.slip_shooting(short)
