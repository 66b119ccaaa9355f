"""Other laws on the very residuals of a fit, so that they can be judged by the likelihood of its estimator.

Each starts one Gauss-Newton step from the better of two places: where a thinned weak form puts it, and where a law
nested in it, one that it is with some parameters at zero, ended. A law that ends with a larger sum of squares than
one nested in it has not converged: it is sought once more from there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators import weak_form
from identification.estimators.base import Estimate, FrictionProblem, Options
from identification.estimators.chart import Charted
from identification.estimators.regression import RegressionProblem
from identification.estimators.segment_runs import Start
from identification.estimators.shooting_problem import under
from identification.estimators.shooting_segments import ShootingProblem
from identification.inference.problem import Evaluation, Solution, solve
from identification.laws import FittableLaw
from identification.measurement.pooled import Pool

SEARCH = 1e-7  # relative: of some 4e4 residuals of unit variance 0.004, to an AIC that is read to 0.1
MOST = 40  # evaluations of a law, which starts near its best where the logs do not rule it out
WEAK = 1e-5  # relative, of the weak form that only begins
FAR = 3.0  # times the root mean square residual of the best law in the weak form: not worth more work
SAME = 1e-6  # of the root mean square: residuals that differ less are those of one law


@dataclass(frozen=True, eq=False)
class Rival:
    """A fitted law: its problem and solution."""

    law: FittableLaw
    problem: FrictionProblem
    solution: Solution

    @property
    def law_values(self) -> np.ndarray:
        """Values (m,) of the law's parameters."""
        return self.solution.values[: len(self.law.parameters)]

    @property
    def sum(self) -> float:
        """Sum of squares."""
        return self.solution.evaluation.sum


@dataclass(frozen=True, eq=False)
class Rivals:
    """fitted: by name, those that could be; refused: what kept the others from it; nested: pairs of names, of which the
    second is a law that contains the first."""

    fitted: Mapping[str, Rival]
    refused: Mapping[str, str]
    nested: tuple[tuple[str, str], ...]


_last: WeakKeyDictionary[Pool, dict[str, Rival]] = WeakKeyDictionary()


def weak_fits(ready: Pool, laws: Mapping[str, FittableLaw], options: Options) -> dict[str, Rival]:
    """Laws by a weak form of few nodes, with the disturbances of these options: what costs next to nothing. The last
    fits are kept with the pool. StickslipError: the logs cannot be fitted by the weak form."""
    before, fits = _last.get(ready, {}), dict[str, Rival]()
    seen = tuple(term for term in options.disturbances if term.by_inverse_dynamics)
    options, zeros = replace(options, disturbances=seen), np.zeros(len(seen))
    for name, law in laws.items():
        problem = weak_form.of_few_nodes(ready, law, options)
        last = before.get(name)
        kept = last.problem if last is not None and last.law is law else None
        if last is not None and isinstance(kept, RegressionProblem) and kept.terms == problem.terms:
            fits[name] = last
            continue
        start = np.concatenate([problem.start()[: len(law.parameters)], zeros])
        fits[name] = Rival(law, problem, solve(problem, start, tolerance=WEAK))
    _last[ready] = fits
    return fits


def not_far(weak: Mapping[str, Rival]) -> list[str]:
    """Laws that the weak form leaves worth more work."""
    least = min(rival.sum for rival in weak.values())
    return [name for name, rival in weak.items() if rival.sum <= FAR**2 * least]


def fit_rivals(
    first: Estimate,
    laws: Mapping[str, FittableLaw],
    start: Callable[[FittableLaw], np.ndarray],
    *,
    progress: Callable[[float], None] | None = None,
) -> Rivals:
    """Fit laws to the residuals of a solved estimate. start: first values (m,) of a law's parameters; ``progress`` is
    told the fraction done. StickslipError: the estimate is of two discs."""
    base = Rival(first.law, first.problem, first.solution)
    fitted, refused, nested = {}, {}, list[tuple[str, str]]()
    for number, (name, law) in enumerate(sorted(laws.items(), key=lambda item: len(item[1].parameters))):
        try:
            rival = base if law.reference == first.law.reference else _fitted(base, law, start(law), fitted.values())
        except StickslipError as error:
            refused[name] = str(error)
            continue
        for less_name, less in fitted.items():
            inside = _inside(less, rival.problem)
            if inside is not None:
                nested.append((less_name, name))
                if rival.sum > less.sum * (1 + SEARCH):
                    again = Rival(law, inside.problem, inside.solved)
                    rival = min((rival, again), key=lambda one: one.sum)
        fitted[name] = rival
        if progress is not None:
            progress((number + 1) / len(laws))
    return Rivals({name: fitted[name] for name in laws if name in fitted}, refused, tuple(nested))


@dataclass(frozen=True, eq=False)
class _Candidate:
    """Where (m,) a search may start: of a problem, whose start states are near those there. What is evaluated at one x
    is not the beginning of another: of each begin the problem is its own."""

    problem: FrictionProblem
    x: np.ndarray

    def at(self, x: np.ndarray) -> _Candidate:
        """The same problem at another point, with start states as they are here."""
        if not isinstance(self.problem, ShootingProblem):
            return _Candidate(self.problem, x)
        return _Candidate(replace(self.problem, starts=tuple(replace(start) for start in self.problem.starts)), x)

    @cached_property
    def evaluation(self) -> Evaluation:
        return self.problem.evaluate(self.x)

    @property
    def sum(self) -> float:
        try:
            return self.evaluation.sum
        except StickslipError:
            return np.inf

    @property
    def stepped(self) -> _Candidate:
        """After one Gauss-Newton step, as far as the bounds allow, if that is better."""
        evaluation = self.evaluation
        step = np.linalg.lstsq(evaluation.gradient, -evaluation.residual, rcond=None)[0]
        after = self.at(np.clip(self.x + step, *self.problem.limits))
        return after if after.sum < evaluation.sum else self

    @property
    def solved(self) -> Solution:
        """The solution found from here, if this is none; steps to where the model does not follow a log are taken
        back."""
        if (at_bound := self._least()) is not None:
            return Solution(self.x, self.evaluation, True, "a law nested in this one fits as well", at_bound)
        careful = Charted(self.problem, ()) if isinstance(self.problem, ShootingProblem) else self.problem
        return solve(careful, self.x, tolerance=SEARCH, evaluations=MOST)

    def _least(self) -> tuple[bool, ...] | None:
        """Which unknowns lie on a bound, if no step within the bounds lowers the sum to first order."""
        from scipy.optimize import lsq_linear

        if not np.isfinite(self.sum):
            return None
        unknowns, evaluation = self.problem.unknowns, self.evaluation
        priors = [(index, unknown.prior) for index, unknown in enumerate(unknowns) if unknown.prior is not None]
        rows = [np.eye(len(unknowns))[index] / prior.standard_uncertainty for index, prior in priors]
        off = [(self.x[index] - prior.value) / prior.standard_uncertainty for index, prior in priors]
        slope, residual = np.vstack([evaluation.gradient, *rows]), np.concatenate([evaluation.residual, off])
        norms = np.linalg.norm(slope, axis=0)
        if not np.all(norms > 0):
            return None
        basis, triangle = np.linalg.qr(slope / norms)
        low, high = self.problem.limits
        if np.any((self.x < low) | (self.x > high)):
            return None
        at_bound = (self.x == low) | (self.x == high)
        toward = -basis.T @ residual
        solution = lsq_linear(triangle, toward, bounds=((low - self.x) * norms, (high - self.x) * norms))
        fall = toward @ toward - np.sum((triangle @ solution.x - toward) ** 2)
        return tuple(bool(flag) for flag in at_bound) if fall < SEARCH * float(residual @ residual) else None


def _fitted(base: Rival, law: FittableLaw, q: np.ndarray, simpler: Iterable[Rival]) -> Rival:
    problem = _under(base, law, q)
    first = _Candidate(_under(base, law, q), np.concatenate([q, base.solution.values[len(base.law.parameters) :]]))
    starts = [first, *(start for less in simpler if (start := _inside(less, problem)) is not None)]
    usable = [start for start in starts if np.isfinite(start.sum)] or [first]
    if isinstance(problem, ShootingProblem):  # a search costs as much as a fit
        usable = [min((start.stepped for start in usable), key=lambda start: start.sum)]
    return min((Rival(law, start.problem, start.solved) for start in usable), key=lambda rival: rival.sum)


def _under(base: Rival, law: FittableLaw, q: np.ndarray) -> FrictionProblem:
    if isinstance(base.problem, ShootingProblem):
        return under(base.problem, base.solution.values, law, q)
    if type(base.problem) is RegressionProblem:
        return replace(base.problem, law=law, rebuild=None)
    raise StickslipError("Laws are compared on logs of one driving disc. Fit the logs of each disc by itself.")


def _inside(less: Rival, problem: FrictionProblem) -> _Candidate | None:
    """Where a problem gives the residuals of a law with fewer parameters; None if that law is not nested in it."""
    names = [unknown.name for unknown in problem.unknowns]
    values = {u.name: float(v) for u, v in zip(less.problem.unknowns, less.solution.values, strict=True)}
    if not set(values) < set(names):
        return None
    if isinstance(problem, ShootingProblem) and isinstance(less.problem, ShootingProblem):
        problem = replace(problem, starts=tuple(Start(start.at(less.solution.values)) for start in less.problem.starts))
    start = _Candidate(problem, np.array([values.get(name, 0.0) for name in names]))
    try:
        residual = problem.evaluate(start.x).residual
    except StickslipError:
        return None
    expected = less.solution.evaluation.residual
    same = np.sqrt(np.mean((residual - expected) ** 2)) < SAME * np.sqrt(np.mean(expected**2))
    return start if same else None
