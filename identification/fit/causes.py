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
    found: Solution

    @property
    def sum(self) -> float:
        return self.found.evaluation.sum

    @property
    def effective(self) -> float:
        """How many independent residuals these are worth: as many as there are slips, or more."""
        here = self.found.evaluation
        if not determines(information(self.problem, here)):
            return 0.0
        coloured = coloured_covariance(self.problem, self.found, "jackknife")
        plain = plain_covariance(here.gradient, here.residual, prior=prior_precision(self.problem))
        worth = len(here.residual) / inflation(plain, coloured)
        return max(worth, float(len(np.unique(here.cluster))))


class _Search:
    """Fits of one law with sets of causes, each made once."""

    def __init__(self, ready: Pool, law: FittableLaw, workers: int | None = None) -> None:
        self.ready = ready
        self.bare = weak_form.of_few_nodes(ready, law, Options(workers=workers))
        self.kept: dict[frozenset[str], _Fit] = {}
        self.slips = len(np.unique(self.bare.regression.cluster))

    def judges(self, causes: Sequence[str]) -> bool:
        """Whether there are more slips than unknowns with these causes."""
        return len(replace(self.bare, terms=terms_of(self.ready, causes)).unknowns) < self.slips

    def fit(self, causes: Sequence[str], begin: _Fit | None = None) -> _Fit:
        """With these causes, from the law's own guess and from another fit: the better of the two."""
        key = frozenset(causes)
        if key not in self.kept:
            problem = replace(self.bare, terms=terms_of(self.ready, causes))
            starts = [problem.start()] if begin is None else [_carried(begin, problem), problem.start()]
            fits = [_Fit(tuple(causes), problem, solve(problem, start, tolerance=SEARCH)) for start in starts]
            self.kept[key] = min(fits, key=lambda fit: fit.sum)
        return self.kept[key]

    def promising(self, now: _Fit, causes: Sequence[str]) -> list[str]:
        """The causes by which the sum of squares falls most to first order, per BIC."""
        falls = {}
        for one in causes:
            problem = replace(self.bare, terms=terms_of(self.ready, (*now.causes, one)))
            evaluation = problem.evaluate(_carried(now, problem))
            step = np.linalg.lstsq(evaluation.gradient, evaluation.residual, rcond=None)[0]
            left = evaluation.residual - evaluation.gradient @ step
            falls[one] = float(np.log(now.sum / (left @ left))) / len(problem.terms)
        return sorted(causes, key=lambda one: -falls[one])[:TRIED]

    def judged(self, less: _Fit, more: _Fit) -> tuple[float, float]:
        """Fall of BIC from one fit to a richer one, and the probability of its F by chance."""
        from scipy.special import fdtrc

        terms, effective = len(more.problem.terms) - len(less.problem.terms), more.effective
        if not effective or not more.found.converged:
            return -np.inf, 1.0
        freedom = max(effective - len(more.problem.unknowns), 1.0)
        fall = max(less.sum - more.sum, 0.0)
        gain = effective * float(np.log1p(fall / more.sum)) - terms * float(np.log(effective))
        return gain, float(fdtrc(terms, freedom, fall / terms / (more.sum / freedom)))


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
    now, chosen = search.fit(()), list[str]()
    progress(0.5)
    if named:
        now = search.fit(named, now)
        return tuple(_cause(search, now, cause) for cause in now.causes)
    while True:
        progress((1 + len(chosen)) / (2 + len(chosen)))  # after each cause one more is sought
        rivals = {rival for name in chosen for rival in _rivals(disturbances, name)}
        open_ = [name for name in seen if name not in rivals and search.judges((*chosen, name))]
        tried = {one: search.fit((*chosen, one), now) for one in search.promising(now, open_)}
        judged = {one: search.judged(now, fit) for one, fit in tried.items()}
        # Holm: the least of the probabilities counts as often as there are causes left
        sure = [one for one, (gain, chance) in judged.items() if gain > 0 and chance * len(open_) < CHANCE]
        if not sure:
            break
        best = max(sure, key=lambda one: judged[one][0])
        chosen.append(best)
        now = tried[best]
    for mimic in seen:
        # slow changes of friction and of the zero look alike, and what has few terms is met first
        original = disturbances[mimic].mimics
        rest = [name for name in chosen if name != original]
        if original not in chosen or not search.judges((*rest, mimic)):
            continue
        other = search.fit((*rest, mimic), search.fit(rest, now))
        terms = len(other.problem.terms) - len(now.problem.terms)
        if other.effective * np.log(now.sum / other.sum) > terms * np.log(max(other.effective, 1.0)):
            chosen, now = [*rest, mimic], other
    for one in [*chosen[:-1]]:  # what came first may be explained by what came later
        rest = tuple(name for name in chosen if name != one)
        gain, chance = search.judged(search.fit(rest, now), now)
        if gain <= 0 or chance * len(chosen) >= CHANCE:
            chosen.remove(one)
            now = search.fit(rest, now)
    return tuple(_cause(search, now, one) for one in chosen)


def _rivals(disturbances: Mapping[str, Disturbance], chosen: str) -> set[str]:
    """The disturbance itself and those that do the same or look like it, of which the better one is taken."""
    own = disturbances[chosen]
    same = {name for name, other in disturbances.items() if chosen in (other.same_as, other.mimics)}
    return {chosen, own.same_as, own.mimics, *same}


def explain_more(ready: Pool, law: FittableLaw, causes: Sequence[Cause], radii: Mapping[str, float]) -> bool:
    """Whether these disturbances explain the logs of one driving disc better than a wrong radius does. radii: what the
    logs ask for to first order, m, by name.

    Raises:
        StickslipError: the logs cannot be fitted by the weak form.
    """
    from scipy.optimize import minimize_scalar

    plain = weak_form.estimate(ready, law, Options())
    problem, begin = plain.problem, plain.solution.values
    estimate = weak_form.estimate(ready, law, Options(disturbances=terms_found(ready, causes)))
    assert isinstance(problem, RegressionProblem) and isinstance(estimate.problem, RegressionProblem)
    with_causes = _Fit(tuple(cause.name for cause in causes), estimate.problem, estimate.solution)
    sums = []
    for place, one in enumerate(problem.held):
        if one.name not in radii:
            continue

        def left(off: float, place: int = place, value: float = one.value) -> float:
            held = (*problem.held[:place], replace(problem.held[place], value=value * float(np.exp(off))))
            moved = problem.with_held((*held, *problem.held[place + 1 :]))
            try:
                least = solve(moved, begin, tolerance=SEARCH).evaluation.sum
            except StickslipError:
                return np.inf
            # rows that a constant makes smaller are not better explained
            return least * (problem.regression.noise / moved.regression.noise) ** 2

        ends = sorted((0.0, BEYOND * float(np.log(radii[one.name] / one.value))))
        best = minimize_scalar(left, bounds=ends, method="bounded", options={"xatol": RADIUS})
        sums.append(float(best.fun))  # type: ignore[reportAttributeAccessIssue]  # the stubs know an object only
    effective = max(with_causes.effective, 1.0)
    more = len(estimate.problem.terms) - 1
    return effective * float(np.log(min(sums) / with_causes.sum)) > more * float(np.log(effective))


def terms_found(ready: Pool, causes: Sequence[Cause]) -> tuple[DisturbanceTerm, ...]:
    """The terms of causes that were found."""
    return terms_of(ready, [cause.name for cause in causes], {cause.name: cause.size for cause in causes})


def _cause(search: _Search, now: _Fit, name: str) -> Cause:
    rest = tuple(cause for cause in now.causes if cause != name)
    gain, chance = search.judged(search.fit(rest, now), now)
    count, where = len(now.problem.law.parameters), now.problem.regression.where
    assert where is not None
    terms = tuple(term for term in now.problem.terms if term.cause == name)
    values = dict(zip([term.name for term in now.problem.terms], now.found.values[count:], strict=True))
    mine = np.array([values[term.name] for term in terms])
    sensor, disturbances = terms[0].effect.sensor, ranked([name])
    if sensor:
        misreading, _ = misread(terms, mine, where)
        size = (search.ready.values.R if sensor == LASER else 1.0) * float(np.max(np.abs(misreading)))
    else:
        factor, _ = disturbed(terms, mine, where)
        size = 0.5 * float(np.ptp(factor))
    disturbance = disturbances[name]
    words = disturbance.words + disturbance.remark(search.ready, terms)
    count = len(DISTURBANCES.names())
    return Cause(name, words, size, SENSOR_UNITS.get(sensor, "1"), float(gain), min(chance * count, 1.0))


def _carried(begin: _Fit, problem: RegressionProblem) -> np.ndarray:
    """The solution of a fit as a start of another; 0 for what it does not have."""
    names = [unknown.name for unknown in begin.problem.unknowns]
    values = dict(zip(names, begin.found.values, strict=True))
    first = {term.name: term.first for term in problem.terms}
    return np.array([values.get(one.name, first.get(one.name, 0.0)) for one in problem.unknowns])
