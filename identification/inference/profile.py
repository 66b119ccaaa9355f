"""Profile likelihood intervals: how far one unknown can be moved before the fit, all others searched anew, is refused.

    S(x) = min over the others of |r|^2 + priors at q_j = x;     interval = {x : S(x) - S_min <= t^2 C_jj/(M^-1)_jj}

with C the covariance that the colour of the residuals asks for, M = G'G + priors, and t Student's quantile: the
quasi-likelihood ratio scaled so that on a linear problem it is the interval value +- t sqrt(C_jj) exactly. An end where
S stays below the limit up to the bound of the search is open: the data do not bound the unknown there, which is a
result, not a failure.

Sources: Venzon & Moolgavkar (1988), Appl. Statist. 37, 87; Raue et al. (2009), Bioinformatics 25, 1923 (open ends);
Rotnitzky & Jewell (1990), Biometrika 77, 485 (scaling by the sandwich).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.problem import FitProblem, Solution, information, solve

DOUBLINGS = 12  # of the first step, before the bound of the search itself is tried
ACCURACY = 0.01  # of the half-width, of an end: far below what an interval means
ROUNDS = 30  # of the search for an end
SEARCH = 1e-8  # relative, of a fit with one unknown held
REFUSED = 1e3  # half-widths: what counts as the distance of a value with which there is no fit
RIDGE = 1e-12  # relative, added to M: an exactly flat direction has no inverse


@dataclass(frozen=True)
class Interval:
    """Confidence interval of one parameter; an end that is None is open: the data do not bound it there.

    kind: "profile" or "bootstrap".
    """

    name: str
    level: float
    low: float | None
    high: float | None
    kind: str

    @property
    def ends(self) -> tuple[float, float]:
        """Low and high, infinite where it is open."""
        return (-np.inf if self.low is None else self.low), (np.inf if self.high is None else self.high)

    @property
    def sides(self) -> str:
        """Which ends the data give: "two-sided", "lower bound only", "upper bound only", "open"."""
        if self.low is not None and self.high is not None:
            return "two-sided"
        if self.low is None and self.high is None:
            return "open"
        return "upper bound only" if self.low is None else "lower bound only"


@dataclass(frozen=True)
class Profiles:
    """Intervals of the unknowns asked for, and the lowest sum of squares met on the way, relative to the solution's
    (below 1: the search had not found the best fit)."""

    intervals: tuple[Interval, ...]
    lowest: float


def profile(
    problem: FitProblem,
    solution: Solution,
    covariance: np.ndarray,
    names: Sequence[str],
    *,
    quantile: float,
    level: float = 0.95,
    progress: Callable[[float], None] | None = None,
) -> Profiles:
    """Intervals of the unknowns ``names``. covariance: (m, m) of all unknowns; quantile: Student's, of ``level``.
    StickslipError: an unknown is not there."""
    profiled = [_Profile(problem, solution, covariance, name, quantile) for name in names]
    intervals = []
    for number, (name, curve) in enumerate(zip(names, profiled, strict=True)):
        ends = []
        for side in (-1, 1):
            ends.append(curve.end(side))
            if progress is not None:
                progress((2 * number + len(ends)) / (2 * len(profiled)))
        intervals.append(Interval(name, level, ends[0], ends[1], "profile"))
    least = _sum(problem, solution)
    lowest = min((curve.lowest for curve in profiled), default=least)
    return Profiles(tuple(intervals), lowest / least if least > 0 else 1.0)


def _sum(problem: FitProblem, solution: Solution) -> float:
    """Sum of squares, priors included."""
    priors = sum(
        ((value - u.prior.value) / u.prior.standard_uncertainty) ** 2
        for u, value in zip(problem.unknowns, solution.values, strict=True)
        if u.prior is not None
    )
    return solution.evaluation.sum + float(priors)


class _Profile:
    """The profile of one unknown: sums of squares found so far."""

    def __init__(
        self, problem: FitProblem, solved: Solution, covariance: np.ndarray, name: str, quantile: float
    ) -> None:
        names = [u.name for u in problem.unknowns]
        if name not in names:
            raise StickslipError(f"The problem has no unknown '{name}'; it has {', '.join(names)}.")
        self.problem, self.solution, self.name, self.index = problem, solved, name, names.index(name)
        self.least = self.lowest = _sum(problem, solved)
        normal = information(problem, solved.evaluation)
        naive = np.linalg.inv(normal + RIDGE * np.diag(np.diag(normal)))[self.index, self.index]
        variance = covariance[self.index, self.index]
        usable = np.isfinite(variance) and variance > 0
        white = 1.0 if problem.noise_known else self.least / len(solved.evaluation.residual)
        self.limit = quantile**2 * max(variance / naive if usable else white, np.finfo(float).tiny)
        self.step = quantile * float(np.sqrt(variance)) if usable else 0.1 * max(abs(solved.values[self.index]), 1e-3)
        self.near = solved.values  # all unknowns at the last fit, where the next begins

    def end(self, side: int) -> float | None:
        """The end of the interval below (-1) or above (+1) the estimate; None if it is open."""
        unknown, value = self.problem.unknowns[self.index], float(self.solution.values[self.index])
        bound = unknown.minimum if side < 0 else unknown.maximum
        self.near = self.solution.values
        # the root of the excess is nearly linear in x, and known at the estimate without a fit
        inside, below = value, -1.0
        for doubling in range(DOUBLINGS + 1):
            outside = value + side * self.step * 2**doubling
            if side * (outside - bound) >= 0 or doubling == DOUBLINGS:
                outside = bound
            if not np.isfinite(outside) or outside == inside:
                return None
            above = self.excess(outside)
            if abs(above) < ACCURACY and outside != bound:
                return outside
            if above > 0:
                return self._between(inside, below, outside, above)
            if outside == bound:
                return None
            inside, below = outside, above
        return None

    def _between(self, inside: float, below: float, outside: float, above: float) -> float:
        """Where the excess vanishes between two values with these excesses: false position, of Illinois' kind."""
        middle, last = inside, 0
        for _ in range(ROUNDS):
            middle = (inside * above - outside * below) / (above - below)
            excess = self.excess(middle)
            if abs(excess) < ACCURACY:
                break
            if excess > 0:
                outside, above, below = middle, excess, below / 2 if last > 0 else below
            else:
                inside, below, above = middle, excess, above / 2 if last < 0 else above
            last = 1 if excess > 0 else -1
        return float(middle)

    def excess(self, x: float) -> float:
        """Root of what the sum of squares with the unknown at x has above the least, relative to that of the limit,
        less one; large where no fit is possible."""
        start = self.near.copy()
        start[self.index] = x
        try:
            solution = solve(self.problem, start, fixed={self.name: x}, tolerance=SEARCH)
        except StickslipError:
            return REFUSED
        total = _sum(self.problem, solution)
        if not np.isfinite(total):
            return REFUSED
        self.near, self.lowest = solution.values, min(self.lowest, total)
        return min(float(np.sqrt(max(total - self.least, 0.0) / self.limit)) - 1, REFUSED)
