"""Whole-cycle output error: the rigid model through slip, stick and release, each cycle an initial-value problem.

    1  law and motion in slip by slip shooting
    2  one arc per cycle, from where one slip passes the threshold, through stick, to the release before the next
    3  solve: the law, and the start of each cycle projected out (arcs.py)

The instants of sticking and release, and the way that the drive carries the disc between them, tell more of the law
than the motion in slip does. The drive limits what can be had: longer arcs would tell more if it were known exactly,
but its errors add up along an arc (with arcs of a whole log the error of mu_k is 7 times as large); and unevenness too
fast for its encoder makes contacts let go early, so that cycles that see much of a release bias p by -0.1 %. The price
is the structure: micro-slip shows in every cycle and biases the rigid model (a contact of 5e4 N/m: p by some -20 %).
Residuals beyond the noise say so.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators import shooting
from identification.estimators.base import Estimate, Estimator, Options
from identification.estimators.chart import solve_straight
from identification.estimators.shooting_segments import Arc, ArcProblem, arc_problem, measured
from identification.inference.problem import Solution
from identification.laws import FittableLaw
from identification.laws.joint_law import JointLaw
from identification.measurement.pooling import Pool, RigValues

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
    warning.

    Raises:
        StickslipError: as for slip shooting.
    """
    first = shooting.estimate(ready, law, options)
    if not isinstance(first.problem, ArcProblem):
        return first
    try:
        problem, found = follow(first.problem, first.solution.values, options)
    except KeyboardInterrupt:
        return replace(first, warnings=("Interrupted: this is the result of slip shooting.",))
    except StickslipError as error:
        said = f"The model cannot be run through whole cycles: {error} This is the result of slip shooting."
        return replace(first, warnings=(said,))
    return Estimate(ESTIMATOR, law, problem, found, excess(found))


def misfit(found: Solution) -> float:
    """Root mean square of the residuals, in deviations of the noise."""
    here = found.evaluation
    return float(np.sqrt(here.residual @ here.residual / (len(here.residual) - here.eliminated - len(found.values))))


def excess(found: Solution) -> tuple[str, ...]:
    """What to say where the residuals are larger than the noise."""
    ratio = misfit(found)
    if ratio < EXCESS:
        return ()
    return (
        f"Over whole cycles the model is off by {ratio:.3g} times the noise: its structure is wrong (micro-slip, other "
        "friction in stick, a drive that is not measured well), and the parameters are biased beyond their deviations. "
        "Slip shooting does not depend on what happens in stick; --estimator lugre models micro-slip.",
    )


def follow(slips: ArcProblem, x: np.ndarray, options: Options) -> tuple[ArcProblem, Solution]:
    """Stages 2 and 3. slips: slip shooting, solved at x.

    Raises:
        StickslipError: the model cannot be run, or does not follow a log even roughly.
    """
    problem = cycle_problem(slips, x, slips.law, x[: len(slips.law.parameters)], options)
    problem.evaluate(problem.first)
    bends = shooting.straight(slips.ready, slips.law, x[: len(slips.law.parameters)])
    return problem, solve_straight(problem, bends, progress=options.progress, tolerance=shooting.TOLERANCE)


def cycle_problem(slips: ArcProblem, x: np.ndarray, law: FittableLaw, q: np.ndarray, options: Options) -> ArcProblem:
    """Cycles under a law from slip shooting solved at x. q: (m,) first values of the law's parameters."""
    ready = slips.ready
    arcs = [replace(arc, bristles=_deflection(arc, ready.values, law, q)) for arc in cycle_arcs(slips, x)]
    problem = arc_problem(ready, law, arcs, q, options.nuisance, slips.noise_known)
    return replace(problem, first=np.concatenate([q, x[len(slips.law.parameters) :]]))


def _deflection(arc: Arc, rig: RigValues, law: FittableLaw, q: np.ndarray) -> float:
    """Of the bristles in steady slip at the start of an arc, m; 0 for a law without any, as those of two discs are."""
    stiffness = None if isinstance(law, JointLaw) else dict(zip(law.names, q, strict=True)).get("sigma0")
    if stiffness is None:
        return 0.0
    drive = arc.drives[0]
    slip = rig.r * float(np.interp(arc.start_time, drive.time, drive.value)) - rig.R * float(arc.guess[1])
    return arc.sign * rig.N * float(law.value(np.array([abs(slip)]), q)[0]) / stiffness


def cycle_arcs(slips: ArcProblem, x: np.ndarray) -> list[Arc]:
    """One arc per cycle, and one from the last slip of a log to its end. slips: slip shooting, solved at x."""
    ready, arcs = slips.ready, []
    for log, motion in enumerate(ready.motions):
        mine = [number for number, arc in enumerate(slips.arcs) if arc.log == log]
        begins = [float(slips.arcs[number].time[0]) for number in mine]
        shown = measured(motion, ready.values.R)[0]
        ends = [begin - ONSET * ready.natural_period for begin in begins[1:]]
        for number, begin, end in zip(mine, begins, [*ends, np.inf], strict=True):
            inside = (motion.time >= begin) & (motion.time < end) & ~motion.filled
            arcs.append(
                replace(
                    slips.arcs[number],
                    time=motion.time[inside],
                    measured=shown[inside],
                    cluster=np.full(np.count_nonzero(inside), len(arcs)),
                    guess=slips.starts[number].at(x),
                )
            )
    return arcs


ESTIMATOR = Estimator("whole-cycle", STRUCTURE, estimate)
