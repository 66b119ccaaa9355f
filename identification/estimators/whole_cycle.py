"""Whole-cycle output error: the rigid model through slip, stick and release, each cycle an initial-value problem.

    1  law and motion in slip by slip shooting
    2  one segment per cycle, from where one slip passes the threshold, through stick, to the release before the next
    3  solve: the law, and the start of each cycle projected out (shooting_segments.py)

The instants of sticking and release, and the way that the drive carries the disc between them, tell more of the law
than the motion in slip does. The drive limits what can be had: longer segments would tell more if it were known
exactly, but its errors add up along a segment (with segments of a whole log the error of mu_k is 7 times as large); and
unevenness too fast for its encoder makes contacts let go early, so that cycles that see much of a release bias p by
-0.1 %. The price is the structure: micro-slip shows in every cycle and biases the rigid model (a contact of 5e4 N/m: p
by some -20 %). Residuals beyond the noise say so.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators import shooting
from identification.estimators.base import Estimate, Estimator, Options
from identification.estimators.chart import solve_straight
from identification.estimators.segment_runs import ShootingSegment
from identification.estimators.shooting_problem import sensed, shooting_problem
from identification.estimators.shooting_segments import ShootingProblem
from identification.inference.problem import Solution
from identification.laws import FittableLaw
from identification.laws.joint_law import JointLaw
from identification.measurement.pooled import Pool, RigValues

ONSET = 0.04  # natural periods before a slip passes the threshold, where the cycle before it ends
EXCESS = 1.5  # of the noise: residuals beyond are those of a wrong model

STRUCTURE = (
    "rigid contact: the disc sticks or slides, no micro-slip",
    "friction depends on slip speed alone, static friction is its limit at rest",
    "the drive turns as its encoder says",
    "J, k, c, N, R, r known but for those estimated beside the law",
)


def estimate(ready: Pool, law: FittableLaw, options: Options) -> Estimate:
    """Friction law from pooled logs. If this stage is interrupted or fails, slip shooting's result is returned with a
    warning. Errors as for slip shooting.
    """

    def over_cycles(slips: ShootingProblem, x: np.ndarray) -> Estimate:
        problem, solution = follow(slips, x, options)
        return Estimate(ESTIMATOR, law, problem, solution, excess(solution))

    return or_slips(shooting.estimate(ready, law, options), "The model", over_cycles)


def or_slips(first: Estimate, model: str, further: Callable[[ShootingProblem, np.ndarray], Estimate]) -> Estimate:
    """What ``further`` makes of slip shooting solved at x (m,); where it is interrupted or fails, slip shooting's
    result with a warning."""
    if not isinstance(first.problem, ShootingProblem):
        return first
    try:
        return further(first.problem, first.solution.values)
    except KeyboardInterrupt:
        return replace(first, warnings=("Interrupted: this is the result of slip shooting.",))
    except StickslipError as error:
        warning = f"{model} cannot be run through whole cycles: {error} This is the result of slip shooting."
        return replace(first, warnings=(warning,))


def misfit(solution: Solution) -> float:
    """Root mean square of the residuals, in deviations of the noise."""
    fit = solution.evaluation
    return float(np.sqrt(fit.residual @ fit.residual / (len(fit.residual) - fit.eliminated - len(solution.values))))


def excess(solution: Solution) -> tuple[str, ...]:
    """What to say where the residuals are larger than the noise."""
    ratio = misfit(solution)
    if ratio < EXCESS:
        return ()
    return (
        f"Over whole cycles the model is off by {ratio:.3g} times the noise: its structure is wrong (micro-slip, other "
        "friction in stick, a drive that is not measured well), and the parameters are biased beyond their deviations. "
        "Slip shooting does not depend on what happens in stick; --estimator lugre models micro-slip.",
    )


def follow(slips: ShootingProblem, x: np.ndarray, options: Options) -> tuple[ShootingProblem, Solution]:
    """Stages 2 and 3. slips: slip shooting, solved at x. StickslipError: the model cannot be run, or does not follow a
    log even roughly."""
    problem = cycle_problem(slips, x, slips.law, x[: len(slips.law.parameters)], options)
    problem.evaluate(problem.first)
    bends = shooting.straight(slips.ready, slips.law, x[: len(slips.law.parameters)])
    fixed = options.given.fixed(problem)
    solution = solve_straight(problem, bends, fixed=fixed, progress=options.progress, tolerance=shooting.TOLERANCE)
    return problem, solution


def cycle_problem(
    slips: ShootingProblem, x: np.ndarray, law: FittableLaw, q: np.ndarray, options: Options
) -> ShootingProblem:
    """Cycles under a law from slip shooting solved at x. q: (m,) first values of the law's parameters."""
    ready = slips.ready
    segments = [
        replace(segment, bristles=_deflection(segment, ready.values, law, q)) for segment in cycle_segments(slips, x)
    ]
    problem = shooting_problem(ready, law, segments, q, options, slips.noise_known)
    return replace(problem, first=np.concatenate([q, x[len(slips.law.parameters) :]]))


def _deflection(segment: ShootingSegment, rig: RigValues, law: FittableLaw, q: np.ndarray) -> float:
    """Deflection of bristles in steady slip at the start of a segment, m; 0 without bristles and for two discs."""
    stiffness = None if isinstance(law, JointLaw) else dict(zip(law.names, q, strict=True)).get("sigma0")
    if stiffness is None:
        return 0.0
    drive = segment.drives[0]
    slip = rig.r * float(np.interp(segment.start_time, drive.time, drive.value)) - rig.R * float(segment.guess[1])
    return segment.sign * rig.N * float(law.value(law.along(np.array([abs(slip)]), segment.sign), q)[0]) / stiffness


def cycle_segments(slips: ShootingProblem, x: np.ndarray) -> list[ShootingSegment]:
    """One segment per cycle, and one from the last slip of a log to its end. slips: slip shooting, solved at x."""
    ready, segments = slips.ready, []
    for log, motion in enumerate(ready.motions):
        mine = [number for number, segment in enumerate(slips.segments) if segment.log == log]
        begins = [float(slips.segments[number].time[0]) for number in mine]
        seen = sensed(motion, ready.values.R)
        ends = [start - ONSET * ready.natural_period for start in begins[1:]]
        for number, start, end in zip(mine, begins, [*ends, np.inf], strict=True):
            cycle = seen.within(slips.segments[number], start, np.nextafter(end, start))
            label = np.full(len(cycle.time), len(segments))
            segments.append(replace(cycle, cluster=label, guess=slips.starts[number].at(x)))
    return segments


ESTIMATOR = Estimator("whole-cycle", STRUCTURE, estimate, searches=(0.1, 0.2, 0.3, 0.4))
