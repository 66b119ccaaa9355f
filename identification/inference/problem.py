"""What every estimator reduces its logs to: whitened residuals of unknowns, and their least-squares solution.

    minimise  |r(x)|^2 + sum_i ((x_i - x0_i)/sd_i)^2        the second sum over the unknowns with a prior

Residuals are of unit variance where the noise of the sensors is known, otherwise of one unknown variance. Unknowns that
concern one stretch of a log alone (its start states) are projected out before: r is what remains at their best values,
and r'(dr/dx) is the exact gradient of the minimum (variable projection; Golub & Pereyra (1973), SIAM J. Numer. Anal.
10, 413; the rows of dr/dx are those of Kaufman (1975), BIT 15, 49). Everything that is said about uncertainty follows
from a `Problem` and its `Solution`.
"""

from __future__ import annotations

import keyword
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown

Progress = Callable[[int, float], None]
"""Called with the number of evaluations so far and the sum of squares; what it raises ends the search."""

TOLERANCE = 1e-12  # relative, of the search: sum of squares, step, gradient
EVALUATIONS = 500
# condition of the scaled gradient from which on the parameters cannot be told apart; its square is what is computed,
# and rounding hides all beyond 1e15
SINGULAR = 1e7
SOFT = 3.0  # deviations of a residual from which on a loss that is not the square is soft
INSIDE = 1e-6  # of the range between two bounds: a start on a bound has no room to leave it


@dataclass(frozen=True)
class Prior:
    """A constant as it is known: name, value, unit, standard uncertainty and where it is from. stated: whether anybody
    says how well it is known; if not, the uncertainty is 0 only because it has to be a number; many: whether it is one
    of many of a kind, which nobody wants to see one by one."""

    name: str
    value: float
    unit: str
    standard_uncertainty: float
    source: str
    stated: bool = True
    many: bool = False


@dataclass(frozen=True)
class Unknown:
    """Something to be found: unit, bounds of the search, and what is known of it beforehand (a parameter of a law has
    no prior, a nuisance parameter has one)."""

    name: str
    unit: str
    minimum: float = -np.inf
    maximum: float = np.inf
    description: str = ""
    prior: Prior | None = None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Residuals at one x.

    residual: (n,) whitened; gradient: (n, m) their derivatives; cluster: (n,) labels, equal where residuals may depend
    on one another; log: (n,) number of the log; slip: (n,) m/s, slip speed of the row, NaN if it has none; eliminated:
    number of local unknowns that were projected out (n less these and m are the degrees of freedom).
    """

    residual: np.ndarray
    gradient: np.ndarray
    cluster: np.ndarray
    log: np.ndarray
    slip: np.ndarray
    eliminated: int = 0

    @property
    def sum(self) -> float:
        """Sum of squares of the residuals."""
        return float(self.residual @ self.residual)


class FitProblem(ABC):
    """Logs reduced by an estimator.

    unknowns: what x holds, in order; noise_known: whether residuals have unit variance by what is known of the sensors
    (else their variance is to be estimated).
    """

    unknowns: tuple[Unknown, ...]
    noise_known: bool

    @property
    def beforehand(self) -> np.ndarray:
        """Rows (k, m) of unknowns together that were 0 within a unit deviation before these logs, about the solution;
        none of most problems. They count in what is known, and a search does not heed them."""
        return np.zeros((0, len(self.unknowns)))

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of the search (m,), below and above."""
        return np.array([unknown.minimum for unknown in self.unknowns]), np.array(
            [unknown.maximum for unknown in self.unknowns]
        )

    @abstractmethod
    def start(self) -> np.ndarray:
        """Where the search begins, (m,)."""

    @abstractmethod
    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Residuals and gradient at x (m,)."""

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Residuals (n,) at x (m,) alone."""
        return self.evaluate(x).residual

    def squares(self) -> Callable[[np.ndarray], float]:
        """The function that gives the sum of squares at x (m,) without a gradient, near the last evaluation.

        It raises as `evaluate`.
        """
        return lambda x: self.evaluate(x).sum

    @abstractmethod
    def resampled(self, clusters: np.ndarray) -> FitProblem:
        """The problem of these clusters alone (k,), labels as in `Evaluation.cluster`; one that is drawn several times
        counts as so many different ones. For the bootstrap."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Least-squares solution: values (m,) of all unknowns; the problem's evaluation there (rows of priors not among
    its); ``at_bound``: whether an unknown ended on a bound; ``fixed``: names of unknowns that were held."""

    values: np.ndarray
    evaluation: Evaluation
    converged: bool
    message: str
    at_bound: tuple[bool, ...]
    fixed: tuple[str, ...] = field(default=())


@dataclass(frozen=True, eq=False)
class Wrapped(FitProblem):
    """A problem as another one sees it: what that does not say itself is as in ``problem``."""

    problem: FitProblem

    @property
    def unknowns(self) -> tuple[Unknown, ...]:  # type: ignore[override]  # those of the problem
        return self.problem.unknowns

    @property
    def noise_known(self) -> bool:  # type: ignore[override]  # that of the problem
        return self.problem.noise_known

    def start(self) -> np.ndarray:
        return self.problem.start()

    def resampled(self, clusters: np.ndarray) -> Self:
        return replace(self, problem=self.problem.resampled(clusters))


@dataclass(frozen=True, eq=False)
class Held(Wrapped):
    """The problem that is left when some unknowns are held. values: (m,) of all; free: (m,) which are left."""

    values: np.ndarray
    free: np.ndarray

    @property
    def unknowns(self) -> tuple[Unknown, ...]:  # type: ignore[override]  # those left
        return tuple(unknown for unknown, free in zip(self.problem.unknowns, self.free, strict=True) if free)

    @property
    def beforehand(self) -> np.ndarray:
        """As in `Problem`, of those left."""
        return self.problem.beforehand[:, self.free]

    def full(self, x: np.ndarray) -> np.ndarray:
        """All unknowns (m,) from those left."""
        result = self.values.copy()
        result[self.free] = x
        return result

    def start(self) -> np.ndarray:
        """Where the problem was solved."""
        return self.values[self.free]

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Residuals of the problem, with the gradient by the unknowns left."""
        evaluation = self.problem.evaluate(self.full(x))
        return replace(evaluation, gradient=evaluation.gradient[:, self.free])


def searched(problem: FitProblem, solution: Solution) -> tuple[FitProblem, Solution, np.ndarray]:
    """A solved problem without the unknowns that were held, and which (m,) were not: what can be uncertain."""
    free = np.array([unknown.name not in solution.fixed for unknown in problem.unknowns])
    if free.all():
        return problem, solution, free
    point = solution.evaluation
    at_bound = tuple(at for at, is_free in zip(solution.at_bound, free, strict=True) if is_free)
    core = replace(solution, values=solution.values[free], evaluation=replace(point, gradient=point.gradient[:, free]))
    return Held(problem, solution.values, free), replace(core, at_bound=at_bound, fixed=()), free


def among(matrix: np.ndarray, free: np.ndarray) -> np.ndarray:
    """A matrix of the searched unknowns within that of all (m, m); 0 for those held."""
    full = np.zeros((len(free),) * 2)
    full[np.ix_(free, free)] = matrix
    return full


def prior_rows(problem: FitProblem) -> np.ndarray:
    """What is known beforehand as rows (m + k, m): 1/sd of each unknown, 0 where there is no prior; and of several
    together."""
    roots = [0.0 if u.prior is None else 1 / u.prior.standard_uncertainty for u in problem.unknowns]
    return np.vstack([np.diag(roots), problem.beforehand])


def prior_precision(problem: FitProblem) -> np.ndarray:
    """What is known beforehand, (m, m): 1/sd^2 on the diagonal, 0 where there is no prior."""
    rows = prior_rows(problem)
    return rows.T @ rows


def information(problem: FitProblem, evaluation: Evaluation) -> np.ndarray:
    """Gauss-Newton matrix (m, m) of the whole sum, priors included: the Fisher information where the noise is known."""
    return evaluation.gradient.T @ evaluation.gradient + prior_precision(problem)


def determines(information: np.ndarray) -> bool:
    """Whether a Gauss-Newton matrix (m, m) tells its parameters apart, whatever their units."""
    norms = np.sqrt(np.diag(information))
    # the eigenvalues of the scaled matrix are the squared singular values of the scaled gradient
    return bool(np.all(norms > 0) and np.linalg.cond(information / np.outer(norms, norms)) <= SINGULAR**2)


def identifier(name: str) -> str:
    """The name of an unknown as lmfit takes it: k/J is k_per_J, F+ is F_plus."""
    words = name.replace("/", "_per_").replace("+", "_plus").replace("-", "_minus")
    cleaned = re.sub(r"\W", "_", words)
    return f"x_{cleaned}" if not cleaned.isidentifier() or keyword.iskeyword(cleaned) else cleaned


def solve(
    problem: FitProblem,
    start: np.ndarray | None = None,
    *,
    fixed: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    tolerance: float = TOLERANCE,
    evaluations: int = EVALUATIONS,
    loss: str = "linear",
) -> Solution:
    """Solve a problem by the least squares of SciPy (trust region, bounds, exact gradient).

    start: (m,) or None for the problem's own; fixed: unknowns to be held at these values; tolerance: relative, of sum
    of squares, step and gradient; evaluations: the most that are made; loss: of SciPy's, soft beyond `SOFT` deviations.
    StickslipError: an unknown that is fixed is not there, or there are no more equations than unknowns.
    """
    fixed = dict(fixed or {})
    names = [unknown.name for unknown in problem.unknowns]
    for name in fixed:
        refuse_unknown(name, names, f"The problem has no unknown '{name}'.")
    search = FitSearch(problem, [name not in fixed for name in names], progress)
    initial = np.array(problem.start() if start is None else start, dtype=float)
    initial[[names.index(name) for name in fixed]] = list(fixed.values())
    if not search.free.any():
        evaluation = problem.evaluate(initial)
        return Solution(initial, evaluation, True, "nothing to be searched", (False,) * len(names), tuple(fixed))
    values, converged, message = search.run(initial, tolerance, evaluations, loss)
    at_bound = search.free & at_bounds(problem, values)
    return Solution(
        values, problem.evaluate(values), converged, message, tuple(bool(b) for b in at_bound), tuple(fixed)
    )


def at_bounds(problem: FitProblem, values: np.ndarray) -> np.ndarray:
    """(m,) which unknowns ended on a bound of the search."""
    low, high = problem.limits
    edge = 1e-6 * np.maximum(np.abs(values), 1e-3)
    return (values - low < edge) | (high - values < edge)


class FitSearch:
    """One search: residual and gradient from one evaluation, rows of priors appended."""

    def __init__(self, problem: FitProblem, free: list[bool], progress: Progress | None) -> None:
        self.problem, self.free, self.progress = problem, np.array(free), progress
        self.known = [(i, u.prior) for i, u in enumerate(problem.unknowns) if u.prior is not None and free[i]]
        self.count = 0
        self._last: tuple[bytes, np.ndarray, np.ndarray] | None = None

    def run(
        self, start: np.ndarray, tolerance: float, evaluations: int, loss: str = "linear"
    ) -> tuple[np.ndarray, bool, str]:
        from scipy.optimize import least_squares

        low, high = self.problem.limits
        room = np.where(np.isfinite(high - low), INSIDE * (high - low), INSIDE)
        start = np.where(self.free, np.clip(start, low + room, high - room), start)
        rows = len(self.at(start)[0])
        if rows <= int(self.free.sum()):
            names = ", ".join(u.name for u, free in zip(self.problem.unknowns, self.free, strict=True) if free)
            raise StickslipError(
                f"{rows} values cannot determine the {int(self.free.sum())} unknowns {names}. Record longer logs, or "
                "at more drive speeds."
            )

        def expanded(free: np.ndarray) -> np.ndarray:
            every = start.copy()
            every[self.free] = free
            return every

        # a step to where the model cannot be evaluated gives infinite residuals, which the trust region answers by
        # shrinking
        with np.errstate(invalid="ignore", divide="ignore"):
            solution = least_squares(
                lambda free: self.at(expanded(free))[0],
                start[self.free],
                jac=lambda free: self.at(expanded(free))[1],  # type: ignore[reportArgumentType]  # the stubs know a word only
                bounds=(low[self.free], high[self.free]),
                x_scale="jac",
                loss=loss,
                f_scale=SOFT,
                ftol=tolerance,
                xtol=tolerance,
                gtol=tolerance,
                max_nfev=evaluations,
            )
        return expanded(solution.x), bool(solution.success), str(solution.message)

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual (n + priors,) and gradient by the free unknowns."""
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            try:
                evaluation = self.problem.evaluate(x)
            except StickslipError:
                if self._last is None:  # there is no model where the search begins
                    raise
                return np.full_like(self._last[1], np.inf), self._last[2]
            unit = np.eye(len(x))
            rows = [(x[i] - p.value) / p.standard_uncertainty for i, p in self.known]
            slopes = [unit[i] / p.standard_uncertainty for i, p in self.known]
            residual = np.concatenate([evaluation.residual, rows])
            gradient = np.vstack([evaluation.gradient, *slopes])[:, self.free]
            self._last = (key, residual, gradient)
            self.count += 1
            if self.progress is not None:
                self.progress(self.count, float(residual @ residual))
        return self._last[1], self._last[2]
