"""LuGre output error: a steady law and two parameters of bristles from whole cycles, micro-slip included.

    1  law and motion in slip by slip shooting, which micro-slip hardly touches
    2  stiffness of the bristles from the sticks (presliding.py); where these show none, the rigid model over whole
       cycles: if its residuals are the noise, that is the result; otherwise, of a scan, the stiffness that fits best
    3  one segment per cycle under the LuGre model, as in whole_cycle.py; solve

The runs of the model take time in proportion to the stiffness.
"""

from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators import shooting, whole_cycle
from identification.estimators.base import Estimate, Estimator, Options
from identification.estimators.shooting_segments import ShootingProblem
from identification.inference.problem import Solution, solve
from identification.laws import FittableLaw, bristled
from identification.laws.joint_law import JointLaw
from identification.measurement.pooled import Pool
from identification.measurement.presliding import presliding

SCAN = (1e4, 3e4, 1e5, 3e5)  # N/m
AS_RIGID = 1.05  # of the noise: rms residuals of the rigid model below leave nothing for bristles to explain
FEW = 10  # cycles of a log that tell the stiffness to a per cent
ROUGH = 1e-4  # relative, of the search that gives the stiffness alone
DAMPING = 0.25  # of sqrt(sigma0 J)/R: bristles at first neither ring nor creep

STRUCTURE = (
    "bristles before sliding (LuGre), friction in steady slip by the law that was fitted",
    "the drive turns as its encoder says",
    "J, k, c, N, R, r known but for those estimated beside the law",
)


def estimate(ready: Pool, law: FittableLaw, options: Options) -> Estimate:
    """LuGre's law from pooled logs; ``law``: one of LuGre's, or the steady one behind it (Conti's, Stribeck's). If this
    stage is interrupted or fails, slip shooting's result is returned with a warning. StickslipError: another law, or as
    for slip shooting."""
    if isinstance(law, JointLaw):
        raise StickslipError(
            "The estimator 'lugre' is of one driving disc: with two, the force in stick on one is not known apart from "
            "that of the other. Fit two discs by slip shooting, which micro-slip hardly touches."
        )
    pair = bristled(law)
    if pair is None:
        raise StickslipError(
            f"The estimator 'lugre' has bristles before Conti's law or Stribeck's, not before '{law.name}'. Leave "
            "--law out, or take slip shooting."
        )
    steady, elastic = (options.bounded(form) for form in pair)
    first = shooting.estimate(ready, steady, options)
    return whole_cycle.or_slips(first, "The LuGre model", lambda slips, x: _bristles(slips, x, elastic, options))


def _bristles(slips: ShootingProblem, x: np.ndarray, law: FittableLaw, options: Options) -> Estimate:
    """Stages 2 and 3. slips: slip shooting under the steady law, solved at x; law: with bristles."""
    elastic = presliding(slips.ready, float(x[0]))
    if elastic is not None and elastic.stiffness is not None:
        problem = _problem(slips, x, law, elastic.stiffness, options)
    else:
        rigid, solution = whole_cycle.follow(slips, x, options)
        if whole_cycle.misfit(solution) < AS_RIGID:
            warning = (
                "The logs show no micro-slip: sticks do not give way, and the residuals of the rigid model over whole "
                "cycles are the noise. No stiffness of bristles can be told; this is the result of the whole-cycle "
                "estimator."
            )
            return Estimate(whole_cycle.ESTIMATOR, slips.law, rigid, solution, (warning,))
        problem = min((_problem(slips, x, law, stiffness, options) for stiffness in SCAN), key=_sum_of_squares)
    problem.evaluate(problem.first)
    fixed = options.given.fixed(problem)
    solution = solve(problem, fixed=fixed, progress=options.progress, tolerance=shooting.TOLERANCE)
    return Estimate(ESTIMATOR, problem.law, problem, solution, whole_cycle.excess(solution))


def in_stick(slips: ShootingProblem, x: np.ndarray, stiffness: float) -> tuple[ShootingProblem, Solution] | None:
    """Law and bristles from some cycles of each log; None where the LuGre model does not follow them to the noise.

    slips: slip shooting, solved at x (m,); stiffness: first value, N/m. What else is estimated stays. None also for a
    law that no bristles can be put before.
    """
    count, pair = len(slips.law.parameters), None if isinstance(slips.law, JointLaw) else bristled(slips.law)
    if pair is None:
        return None
    try:
        problem = _problem(slips, x, pair[1], stiffness, Options(workers=slips.workers)).with_held(slips.held)
        logs = [segment.log for segment in problem.segments]
        places = [index for log in dict.fromkeys(logs) for index in np.flatnonzero(np.equal(logs, log))[1 : 1 + FEW]]
        problem = replace(
            problem,
            segments=tuple(problem.segments[index] for index in places),
            starts=tuple(problem.starts[index] for index in places),
        )
        fixed = {u.name: float(v) for u, v in zip(slips.unknowns[count:], x[count:], strict=True)}
        solution = solve(problem, fixed=fixed, tolerance=ROUGH)
    except StickslipError:
        return None
    return None if whole_cycle.excess(solution) or any(solution.at_bound) else (problem, solution)


def _problem(
    slips: ShootingProblem, x: np.ndarray, law: FittableLaw, stiffness: float, options: Options
) -> ShootingProblem:
    damping = DAMPING * float(np.sqrt(stiffness * slips.ready.values.J)) / slips.ready.values.R
    steady = x[: len(slips.law.parameters)]
    q = options.given.put(law.names, np.array([*steady, stiffness, damping]))
    return whole_cycle.cycle_problem(slips, x, law, q, options)


def _sum_of_squares(problem: ShootingProblem) -> float:
    """Sum of squares of the first cycle of each log at the first values."""
    logs = [segment.log for segment in problem.segments]
    chosen = [logs.index(log) for log in dict.fromkeys(logs)]
    segments, starts = tuple(problem.segments[i] for i in chosen), tuple(problem.starts[i] for i in chosen)
    try:
        return float(np.sum(replace(problem, segments=segments, starts=starts).evaluate(problem.first).residual ** 2))
    except StickslipError:
        return np.inf


ESTIMATOR = Estimator("lugre", STRUCTURE, estimate, rigid=False, searches=(0.07, 0.13, 0.2, 0.6))
