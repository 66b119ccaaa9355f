"""Which disturbances the logs show, by name: forward selection in the weak form, checked backward.

A cause (terms of `identification.disturbances`) is taken up where its F test, corrected for the number of causes tried
(Holm), and BIC both ask for it. Residuals are coloured, so that n of them are worth n_e = n/inflation independent ones
(`inference.comparison`), though never fewer than there are slips, and both tests count these:
    F = ((S_0 - S_1)/m)/(S_1/(n_e - p)),     gain = n_e ln(S_0/S_1) - m ln n_e
S_0, S_1 sums of squares without and with the cause, m its terms, p all unknowns with it. Slips are independent of one
another, and no correlation inside a slip inflates a variance by more than its number of residuals: where the inflation
says so, the jackknife takes for colour that one slip determines a term nearly alone. A set with as many unknowns as
there are slips leaves nothing by which to judge it, and is not tried. Each fit is made from the one before it and from
the law's own guess, and the better is kept: in a local minimum a cause explains little, and what it leaves is coloured.
After a selection deviations are too small by about a half (`WIDER`), for the same logs have chosen and judged. A radius
that is wrong looks like a disturbance, and the other way round: BIC, where the radius is one unknown, tells which.

Sources: Holm (1979), Scand. J. Statist. 6, 65; Kass & Raftery (1995), J. Am. Stat. Assoc. 90, 773.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.disturbances import DISTURBANCES
from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import LASER, SENSOR_UNITS, DisturbanceTerm, disturbed, misread
from identification.disturbances.terms import ranked, terms_of
from identification.estimators import weak_form
from identification.estimators.base import Options
from identification.estimators.regression import RegressionProblem
from identification.fit.parts import Cause
from identification.free_friction.contest import Verdict
from identification.inference.choice import coloured_covariance
from identification.inference.defaults import AUTO, NONE
from identification.inference.problem import Solution, determines, information, prior_precision, solve
from identification.inference.uncertainty import inflation, plain_covariance
from identification.laws import FittableLaw
from identification.measurement.pooled import Pool

CHANCE = 0.01  # of any cause being taken up where there is none, by F alone
WIDER = 1.5  # deviations after a selection
SEARCH = 1e-5  # relative, of the fits that only select
RADIUS = 1e-3  # relative, of a radius that is sought only to be judged
BEYOND = 2.0  # times the logarithm by which a radius is off to first order: so far it is sought
TRIED = 2  # causes that are fitted in each round: those that promise most to first order


@dataclass(frozen=True, eq=False)
class _Fit:
    """A set of causes fitted."""

    causes: tuple[str, ...]
    problem: RegressionProblem
    solution: Solution

    @property
    def sum(self) -> float:
        return self.solution.evaluation.sum

    @property
    def effective(self) -> float:
        """How many independent residuals these are worth: as many as there are slips, or more."""
        evaluation = self.solution.evaluation
        if not determines(information(self.problem, evaluation)):
            return 0.0
        coloured = coloured_covariance(self.problem, self.solution, "jackknife")
        plain = plain_covariance(evaluation.gradient, evaluation.residual, prior=prior_precision(self.problem))
        worth = len(evaluation.residual) / inflation(plain, coloured)
        return max(worth, float(len(np.unique(evaluation.cluster))))


class _Search:
    """Fits of one law with sets of causes, each made once."""

    def __init__(self, ready: Pool, law: FittableLaw, workers: int | None = None) -> None:
        self.ready = ready
        self.bare = weak_form.of_few_nodes(ready, law, Options(workers=workers))
        self.fits: dict[frozenset[str], _Fit] = {}
        self.slips = len(np.unique(self.bare.regression.cluster))

    def judges(self, causes: Sequence[str]) -> bool:
        """Whether there are more slips than unknowns with these causes."""
        return len(replace(self.bare, terms=terms_of(self.ready, causes)).unknowns) < self.slips

    def fit(self, causes: Sequence[str], first: _Fit | None = None) -> _Fit:
        """The fit with these causes, from the law's own guess and from another fit: the better of the two."""
        key = frozenset(causes)
        if key not in self.fits:
            problem = replace(self.bare, terms=terms_of(self.ready, causes))
            starts = [problem.start()] if first is None else [_carried(first, problem), problem.start()]
            fits = [_Fit(tuple(causes), problem, solve(problem, start, tolerance=SEARCH)) for start in starts]
            self.fits[key] = min(fits, key=lambda fit: fit.sum)
        return self.fits[key]

    def promising(self, current: _Fit, causes: Sequence[str]) -> list[str]:
        """The causes by which the sum of squares falls most to first order, per BIC."""
        falls = {}
        for cause in causes:
            problem = replace(self.bare, terms=terms_of(self.ready, (*current.causes, cause)))
            evaluation = problem.evaluate(_carried(current, problem))
            step = np.linalg.lstsq(evaluation.gradient, evaluation.residual, rcond=None)[0]
            remainder = evaluation.residual - evaluation.gradient @ step
            falls[cause] = float(np.log(current.sum / (remainder @ remainder))) / len(problem.terms)
        return sorted(causes, key=lambda cause: -falls[cause])[:TRIED]

    def judged(self, simple: _Fit, rich: _Fit) -> tuple[float, float]:
        """Fall of BIC from one fit to a richer one, and the probability of its F by chance."""
        from scipy.special import fdtrc

        terms, effective = len(rich.problem.terms) - len(simple.problem.terms), rich.effective
        if not effective or not rich.solution.converged:
            return -np.inf, 1.0
        freedom = max(effective - len(rich.problem.unknowns), 1.0)
        fall = max(simple.sum - rich.sum, 0.0)
        gain = effective * float(np.log1p(fall / rich.sum)) - terms * float(np.log(effective))
        return gain, float(fdtrc(terms, freedom, fall / terms / (rich.sum / freedom)))


def asked_for(disturbances: str | Sequence[str]) -> tuple[str, ...]:
    """Names of the disturbances that are asked for; none for `AUTO` and `NONE`."""
    if isinstance(disturbances, str):
        return () if disturbances in (AUTO, NONE) else (disturbances,)
    return tuple(disturbances)


def find_causes(
    ready: Pool,
    law: FittableLaw,
    *,
    named: Sequence[str] = (),
    workers: int | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> tuple[Cause, ...]:
    """The disturbances that pooled logs of one driving disc show under a law; the strongest first. named: those that
    are taken without asking the logs, and then no others; workers: threads; progress: told the fraction done.

    Raises:
        StickslipError: the logs cannot be fitted by the weak form.
    """
    search = _Search(ready, law, workers)
    disturbances = ranked()
    seen = [name for name, disturbance in disturbances.items() if not disturbance.hidden(ready)]
    current, chosen = search.fit(()), list[str]()
    progress(0.5)
    if named:
        current = search.fit(named, current)
        return tuple(_cause(search, current, cause) for cause in current.causes)
    while True:
        progress((1 + len(chosen)) / (2 + len(chosen)))  # after each cause one more is sought
        rivals = {rival for name in chosen for rival in _rivals(disturbances, name)}
        open_ = [name for name in seen if name not in rivals and search.judges((*chosen, name))]
        tried = {cause: search.fit((*chosen, cause), current) for cause in search.promising(current, open_)}
        judged = {cause: search.judged(current, fit) for cause, fit in tried.items()}
        # Holm: the least of the probabilities counts as often as there are causes left
        sure = [cause for cause, (gain, chance) in judged.items() if gain > 0 and chance * len(open_) < CHANCE]
        if not sure:
            break
        best = max(sure, key=lambda cause: judged[cause][0])
        chosen.append(best)
        current = tried[best]
    for mimic in seen:
        # slow changes of friction and of the zero look alike, and what has few terms is met first
        original = disturbances[mimic].mimics
        others = [name for name in chosen if name != original]
        if original not in chosen or not search.judges((*others, mimic)):
            continue
        swapped = search.fit((*others, mimic), search.fit(others, current))
        terms = len(swapped.problem.terms) - len(current.problem.terms)
        if swapped.effective * np.log(current.sum / swapped.sum) > terms * np.log(max(swapped.effective, 1.0)):
            chosen, current = [*others, mimic], swapped
    for cause in [*chosen[:-1]]:  # what came first may be explained by what came later
        others = tuple(name for name in chosen if name != cause)
        gain, chance = search.judged(search.fit(others, current), current)
        if gain <= 0 or chance * len(chosen) >= CHANCE:
            chosen.remove(cause)
            current = search.fit(others, current)
    return tuple(_cause(search, current, cause) for cause in chosen)


def _rivals(disturbances: Mapping[str, Disturbance], chosen: str) -> set[str]:
    """The disturbance itself and those that do the same or look like it, of which the better one is taken."""
    disturbance = disturbances[chosen]
    same = {name for name, candidate in disturbances.items() if chosen in (candidate.same_as, candidate.mimics)}
    return {chosen, disturbance.same_as, disturbance.mimics, *same}


def explain_more(ready: Pool, law: FittableLaw, causes: Sequence[Cause], radii: Mapping[str, float]) -> bool:
    """Whether these disturbances explain the logs of one driving disc better than a wrong radius does. radii: what the
    logs ask for to first order, m, by name.

    Raises:
        StickslipError: the logs cannot be fitted by the weak form.
    """
    from scipy.optimize import minimize_scalar

    plain = weak_form.estimate(ready, law, Options())
    problem, start = plain.problem, plain.solution.values
    estimate = weak_form.estimate(ready, law, Options(disturbances=terms_found(ready, causes)))
    assert isinstance(problem, RegressionProblem) and isinstance(estimate.problem, RegressionProblem)
    with_causes = _Fit(tuple(cause.name for cause in causes), estimate.problem, estimate.solution)
    sums = []
    for index, prior in enumerate(problem.held):
        if prior.name not in radii:
            continue

        def misfit(off: float, index: int = index, value: float = prior.value) -> float:
            priors = (*problem.held[:index], replace(problem.held[index], value=value * float(np.exp(off))))
            moved = problem.with_held((*priors, *problem.held[index + 1 :]))
            try:
                least = solve(moved, start, tolerance=SEARCH).evaluation.sum
            except StickslipError:
                return np.inf
            # rows that a constant makes smaller are not better explained
            return least * (problem.regression.noise / moved.regression.noise) ** 2

        ends = sorted((0.0, BEYOND * float(np.log(radii[prior.name] / prior.value))))
        best = minimize_scalar(misfit, bounds=ends, method="bounded", options={"xatol": RADIUS})
        sums.append(float(best.fun))  # type: ignore[reportAttributeAccessIssue]  # the stubs know an object only
    effective = max(with_causes.effective, 1.0)
    count = len(estimate.problem.terms) - 1
    return effective * float(np.log(min(sums) / with_causes.sum)) > count * float(np.log(effective))


def terms_found(ready: Pool, causes: Sequence[Cause]) -> tuple[DisturbanceTerm, ...]:
    """The terms of causes that were found."""
    return terms_of(ready, [cause.name for cause in causes], {cause.name: cause.size for cause in causes})


def causes_of(verdict: Verdict, ready: Pool) -> tuple[Cause, ...]:
    """What slips show without a law, in words."""
    return tuple(
        Cause(
            one.name,
            _words(one.name, one.terms, ready),
            one.size,
            one.unit,
            one.gain,
            float(np.exp(-one.gain / 2)),
            one.alike,
        )
        for one in verdict.explanations
    )


def _words(name: str, terms: Sequence[DisturbanceTerm], ready: Pool) -> str:
    disturbance = ranked([name])[name]
    return disturbance.words + disturbance.remark(ready, terms)


def _cause(search: _Search, current: _Fit, name: str) -> Cause:
    others = tuple(cause for cause in current.causes if cause != name)
    gain, chance = search.judged(search.fit(others, current), current)
    count, where = len(current.problem.law.parameters), current.problem.regression.where
    assert where is not None
    terms = tuple(term for term in current.problem.terms if term.cause == name)
    values = dict(zip([term.name for term in current.problem.terms], current.solution.values[count:], strict=True))
    mine = np.array([values[term.name] for term in terms])
    sensor = terms[0].effect.sensor
    if sensor:
        misreading, _ = misread(terms, mine, where)
        size = (search.ready.values.R if sensor == LASER else 1.0) * float(np.max(np.abs(misreading)))
    else:
        factor, _ = disturbed(terms, mine, where)
        size = 0.5 * float(np.ptp(factor))
    words = _words(name, terms, search.ready)
    count = len(DISTURBANCES.names())
    return Cause(name, words, size, SENSOR_UNITS.get(sensor, "1"), float(gain), min(chance * count, 1.0))


def _carried(fit: _Fit, problem: RegressionProblem) -> np.ndarray:
    """The solution of a fit as a start of another; 0 for what it does not have."""
    names = [unknown.name for unknown in fit.problem.unknowns]
    values = dict(zip(names, fit.solution.values, strict=True))
    first = {term.name: term.first for term in problem.terms}
    return np.array([values.get(unknown.name, first.get(unknown.name, 0.0)) for unknown in problem.unknowns])
