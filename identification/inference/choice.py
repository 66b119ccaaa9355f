"""How well a solution is known: covariance, intervals, the bound of the sensors, identifiability, residuals.

All of it follows from a `Problem` and its `Solution`, so that every estimator says the same things in the same way.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from identification.inference.bootstrap import LEAST, bootstrap
from identification.inference.defaults import COVARIANCE, DRAWS, SEED
from identification.inference.identifiability import Collinearity, collinearity
from identification.inference.problem import FitProblem, Solution, information, prior_precision
from identification.inference.profile import Interval, profile
from identification.inference.uncertainty import clustered_covariance, newey_west, student
from identification.inference.whiteness import Whiteness, whiteness

COVARIANCES = ("jackknife", "hac", "bootstrap")
BETTER = 1e-6  # relative fall of the sum of squares, met by a profile, that is a better fit and not rounding


@dataclass(frozen=True)
class Inference(Shown):
    """What is asked for. covariance: "jackknife" over clusters, "hac" (Newey-West) or "bootstrap" of clusters with
    ``draws`` full refits from ``seed``; profile: whether to profile each parameter's likelihood; level: of intervals.
    StickslipError: there is no such covariance, or too few draws."""

    covariance: str = COVARIANCE
    draws: int = DRAWS
    seed: int = SEED
    profile: bool = False
    level: float = 0.95

    def __post_init__(self) -> None:
        refuse_unknown(self.covariance, COVARIANCES, f"There is no covariance '{self.covariance}'.")
        if self.covariance == "bootstrap" and self.draws < LEAST:
            raise StickslipError(
                f"A bootstrap of {self.draws} draws gives no standard deviation; take {LEAST} or more, usually 200."
            )


@dataclass(frozen=True, eq=False)
class Inferred:
    """covariance: (m, m) of all unknowns from noise, instruments and priors; bound: (m, m) of Cramer and Rao, None
    where the noise is not known; the rest as their types say."""

    covariance: np.ndarray
    bound: np.ndarray | None
    intervals: tuple[Interval, ...]
    collinearity: Collinearity
    whiteness: Whiteness | None
    warnings: tuple[str, ...]


def infer(
    problem: FitProblem,
    solution: Solution,
    rule: Inference,
    *,
    count: int,
    logs: Sequence[str],
    instruments: np.ndarray | float = 0.0,
    tested: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Inferred:
    """How well ``solution`` is known.

    count: number of parameters of the law, the first unknowns; logs: names of the logs by their numbers; instruments:
    (m, m) covariance that instruments add to that of the residuals; tested: whether the residuals tell anything.
    Errors as for `bootstrap`.
    """
    share = 0.0 if rule.covariance != "bootstrap" else 0.5 if rule.profile else 1.0  # of the work: the bootstrap's
    draws = None
    if rule.covariance == "bootstrap":
        step = None if progress is None else lambda done: progress(share * done)
        draws = bootstrap(problem, solution, draws=rule.draws, seed=rule.seed, progress=step)
    covariance = draws.covariance if draws else coloured_covariance(problem, solution, rule.covariance)
    covariance = covariance + instruments
    names = [unknown.name for unknown in problem.unknowns[:count]]
    collinear = collinearity(problem, solution, covariance)
    white = whiteness(solution.evaluation, logs) if tested else None
    warnings = [*collinear.warnings, *(white.warnings if white else ()), *(draws.warnings if draws else ())]
    intervals: tuple[Interval, ...] = ()
    if rule.profile:
        later = None if progress is None else lambda done: progress(share + (1 - share) * done)
        quantile = student(len(np.unique(solution.evaluation.cluster)) - count, rule.level)
        profiles = profile(problem, solution, covariance, names, quantile=quantile, level=rule.level, progress=later)
        intervals = profiles.intervals
        warnings += _open_ends(intervals)
        if profiles.lowest < 1 - BETTER:
            warnings.append(
                f"The profile met a better fit (sum of squares {100 * (1 - profiles.lowest):.2g} % lower): the search "
                "had stopped in a local minimum. Start it elsewhere, with another estimator before it."
            )
    elif draws is not None and np.ndim(instruments) == 0:
        intervals = tuple(draws.interval(index, name, rule.level) for index, name in enumerate(names))
    # of Cramer and Rao: residuals have unit variance, the information of rows and priors is G'G + P
    bound = np.linalg.inv(information(problem, solution.evaluation)) if problem.noise_known else None
    return Inferred(covariance, bound, intervals, collinear, white, tuple(warnings))


def coloured_covariance(problem: FitProblem, solution: Solution, kind: str) -> np.ndarray:
    """Covariance (m, m) of all unknowns that allows for coloured residuals. kind: "jackknife" or "hac"."""
    evaluation, prior = solution.evaluation, prior_precision(problem)
    if kind == "hac":
        return newey_west(evaluation.gradient, evaluation.residual, log=evaluation.log, prior=prior)
    return clustered_covariance(evaluation.gradient, evaluation.residual, evaluation.cluster, prior=prior)


def _open_ends(intervals: Sequence[Interval]) -> list[str]:
    warnings = []
    for interval in intervals:
        if interval.sides != "two-sided":
            ends = {"lower bound only": "from above", "upper bound only": "from below"}.get(
                interval.sides, "on either side"
            )
            warnings.append(
                f"The data do not bound {interval.name} {ends} (profile likelihood): any value up to the bound of the "
                "search fits as well. Its standard deviation says nothing about that side; `stickslip design` names "
                "experiments that would."
            )
    return warnings
