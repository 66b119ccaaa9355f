"""Which law the data ask for: laws compared by information criteria, and by the prediction of data not yet seen.

Residuals are coloured, so that n of them say less than n independent ones. With C the covariance that allows for colour
and C_w that of white residuals, both of the law that fits best,
    inflation = trace(C_w^-1 C)/m,    n_e = n/inflation      effective number of observations
    AIC = n_e ln(S/n) + 2 (m + 1),    AICc = AIC + 2 (m + 1)(m + 2)/(n_e - m - 2),    BIC = n_e ln(S/n) + (m + 1) ln n_e
(quasi-likelihood, one overdispersion for all laws). Where the noise of the sensors is known, residuals are in units of
it, and with s^2 the mean square of the best law's, if that is above 1, else 1,
    AIC = AICc = (n_e/n) S/s^2 + 2 m,    BIC = (n_e/n) S/s^2 + m ln n_e
The weight of a law is exp(-AIC/2) over its sum over laws (Akaike): how far its values count. Held out: each log in turn
is predicted by the law fitted to the others (with one log alone: each part of it); S_h is the sum of squares over all;
laws that are far behind are not asked. Laws are ordered by BIC, those whose values contradict what they mean last. How
sure that is, is told by the lead over the next law, and by the difference of S_h against its chance (scatter from
cluster to cluster, and the spread of the fits that predict). Nothing is sure where the residuals of even the first law
are not those of noise.

Sources: Burnham & Anderson (2002), Model Selection and Multimodel Inference, sections 2.5 (quasi-AIC), 2.9 (weights);
Kass & Raftery (1995), J. Am. Stat. Assoc. 90, 773 (what a lead in BIC means: above 2 positive, above 6 strong, above 10
very strong).
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Pictured, Shown
from identification.inference.choice import coloured_covariance
from identification.inference.defaults import COVARIANCE
from identification.inference.problem import FitProblem, Solution, determines, information, prior_precision, solve
from identification.inference.uncertainty import inflation, plain_covariance
from identification.inference.whiteness import whiteness

POSITIVE, VERY_STRONG = 2.0, 10.0  # leads in BIC
BEHIND = 500.0  # in BIC: a law that far behind predicts nothing better
SURE = 2.0  # standard errors of a difference in held-out prediction
SEARCH = 1e-6  # relative, of a fit to some of the logs
SAME = 1.01  # ratio of the numbers of residuals up to which the same logs were cut at slightly other instants
FEWEST = 4  # clusters, of which halves can be made


@dataclass(frozen=True)
class LawScore(Shown):
    """How well one law does.

    values, deviations (standard; NaN where the data do not determine a parameter), units: of all unknowns; rms: root
    mean square of the residuals; criteria as above; weight: Akaike's, 0 of a law that is put aside; held_out: root mean
    square of the held-out residuals, relative to the fit of the law that fits best (1: predicts as well as that fits);
    worse: by how many standard errors its held-out prediction is worse than that of the first law (both None where it
    was not asked); bounds: parameters that lie on a bound; warnings: why
    its values mean nothing, empty if they do.
    """

    law: str
    values: Mapping[str, float]
    deviations: Mapping[str, float]
    units: Mapping[str, str]
    rms: float
    aic: float
    aicc: float
    bic: float
    weight: float
    held_out: float | None
    worse: float | None
    bounds: tuple[str, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class LawComparison(Pictured, Recorded):
    """Laws, best first. residuals: number of residuals; effective: of them, as independent ones; warnings: what speaks
    against even the first law; verdict: what decides, and how sure it is; estimator: whose residuals they are; causes:
    disturbances that were estimated beside every law; aside: laws that were not compared, and why; elastic: whether
    sticks give way, which none of these laws does. frame: a row for each law, with criteria, error of held-out logs,
    and by how many standard errors it is worse."""

    COLUMNS = (
        *("[law]=scores.law", "bic=scores.bic", "aicc=scores.aicc", "aic=scores.aic"),
        *("weight=scores.weight", "held_out=scores.held_out", "worse=scores.worse"),
    )

    scores: tuple[LawScore, ...]
    residuals: int
    effective: float
    warnings: tuple[str, ...]
    verdict: str
    estimator: str = ""
    causes: tuple[str, ...] = ()
    aside: Mapping[str, str] = field(default_factory=dict)
    elastic: bool = False

    def _heading(self) -> str:
        return f"LawComparison: {self.verdict}"

    def _contents(self) -> Mapping[str, Any]:
        least = self.best.bic
        return {
            score.law: f"BIC {score.bic - least:+.1f}"
            + ("" if score.held_out is None else f", held out {score.held_out:.3g}")
            for score in self.scores
        }

    @property
    def best(self) -> LawScore:
        """The law that comes first."""
        return self.scores[0]

    @property
    def preferred(self) -> str | None:
        """Name of the best law; None if the values of none mean what it says."""
        return None if self.best.warnings else self.best.law


@dataclass(frozen=True)
class Comparing:
    """How laws are compared. covariance: "jackknife" over clusters or "hac"; folds: of a log that stands alone, each
    predicted by the law fitted to the others; warnings: by law, why its values mean nothing: it is put aside; nested:
    pairs of laws of which the second contains the first, those whose unknowns it has if None; doubts: what speaks
    against every law of those compared."""

    covariance: str = COVARIANCE
    folds: int = 2
    warnings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    nested: Collection[tuple[str, str]] | None = None
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A law's problem with its solution, covariance (m, m), the held-out sum of squares of each cluster (k,), and the
    variance of their sum that comes from the fits to the other logs; none where they were not asked."""

    name: str
    problem: FitProblem
    solution: Solution
    covariance: np.ndarray | None
    warnings: tuple[str, ...]
    held_out: np.ndarray | None = None
    chance: float = 0.0

    @property
    def sum(self) -> float:
        return self.solution.evaluation.sum

    @property
    def rows(self) -> int:
        return len(self.solution.evaluation.residual)

    @property
    def count(self) -> int:
        return sum(unknown.prior is None for unknown in self.problem.unknowns)


DEFAULT = Comparing()


def compare_problems(
    problems: Mapping[str, FitProblem],
    logs: Sequence[str],
    *,
    solutions: Mapping[str, Solution] | None = None,
    options: Comparing = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> LawComparison:
    """Compare laws by their problems, which hold the same residuals (the same logs, reduced in the same way).

    solutions: of the problems that are solved already; logs: names by the numbers of the evaluations. ``progress`` is
    told the fraction done. StickslipError: no two laws, residuals that differ in number, or too few clusters to hold
    any out.
    """
    if len(problems) < 2:
        raise StickslipError("A comparison needs two laws or more.")
    report = progress if progress is not None else lambda _: None
    candidates = []
    for number, (name, problem) in enumerate(problems.items()):
        solution = solutions[name] if solutions else solve(problem)
        warnings = tuple(options.warnings.get(name, ()))
        candidates.append(_Candidate(name, problem, solution, _covariance(problem, solution, options), warnings))
        report(0.5 * (number + 1) / len(problems))
    sizes = sorted({candidate.rows for candidate in candidates})
    if sizes[-1] > SAME * sizes[0]:
        raise StickslipError(
            f"The laws were fitted to different numbers of residuals ({', '.join(map(str, sizes))}): compare them with "
            "an estimator that reduces the logs in the same way for every law (weak-form)."
        )
    scale = _scale(candidates)
    ranked = sorted(candidates, key=lambda law: (bool(law.warnings), scale.criteria(law)[2]))
    least = scale.criteria(ranked[0])[2]
    for rank, law in enumerate(ranked):
        if rank < 2 or scale.criteria(law)[2] < least + BEHIND:
            held_out, chance = _held_out(law.problem, law.solution, options)
            ranked[rank] = replace(law, held_out=held_out, chance=chance)
        report(0.5 + 0.5 * (rank + 1) / len(ranked))
    scores = _scores(ranked, scale)
    doubts = (*options.doubts, *whiteness(ranked[0].solution.evaluation, logs).warnings)
    folds = f"held-out {'logs' if len(logs) > 1 else 'parts of the log'}"
    verdict = _verdict(scores, folds, doubts, options.nested)
    return LawComparison(scores, scale.rows, scale.effective, doubts, verdict)


def single_law(
    name: str, problem: FitProblem, solution: Solution, logs: Sequence[str], verdict: str, doubts: Sequence[str] = ()
) -> LawComparison:
    """The comparison that holds one law alone. doubts: what speaks against it."""
    law = _Candidate(name, problem, solution, _covariance(problem, solution, DEFAULT), ())
    held_out, chance = _held_out(problem, solution, DEFAULT)
    law, scale = replace(law, held_out=held_out, chance=chance), _scale([law])
    doubts = (*doubts, *whiteness(solution.evaluation, logs).warnings)
    verdict += f" But even {name} is not the whole truth, see below." if doubts else ""
    return LawComparison(_scores([law], scale), scale.rows, scale.effective, doubts, verdict)


def _covariance(problem: FitProblem, solution: Solution, options: Comparing) -> np.ndarray | None:
    """Covariance (m, m); None where the data do not determine the unknowns one by one."""
    if not determines(information(problem, solution.evaluation)):
        return None
    return coloured_covariance(problem, solution, options.covariance)


def _held_out(problem: FitProblem, solution: Solution, options: Comparing) -> tuple[np.ndarray, float]:
    """Sum of squares (k,) of each cluster, in the order of their labels, by the law fitted to the other folds; and the
    variance of their sum by chance of these fits: with covariance C of a fit and H = G'G of what it predicts, the
    variance 2 tr (C H)^2 of the prediction's own square."""
    cluster, log = solution.evaluation.cluster, solution.evaluation.log
    labels, first = np.unique(cluster, return_index=True)
    fold = log[first]
    if len(np.unique(fold)) == 1:
        if len(labels) < max(FEWEST, options.folds):
            raise StickslipError(
                f"The logs hold {len(labels)} slips, too few to fit some and predict the others. Record longer, or at "
                "more drive speeds."
            )
        edges = [len(labels) * i // options.folds for i in range(1, options.folds)]
        fold = np.searchsorted(edges, np.arange(len(labels)), side="right")
    sums, chance = np.zeros(len(labels)), 0.0
    for number in np.unique(fold):
        others = solve(problem.resampled(labels[fold != number]), solution.values, tolerance=SEARCH)
        predicted = np.zeros((len(problem.unknowns),) * 2)
        for index in np.flatnonzero(fold == number):
            seen = problem.resampled(labels[index : index + 1]).evaluate(others.values)
            sums[index] = seen.residual @ seen.residual
            predicted = predicted + seen.gradient.T @ seen.gradient
        covariance = _covariance(problem, others, options)
        if covariance is not None:
            spread = covariance @ predicted
            chance += 2 * float(np.sum(spread * spread.T))
    return sums, chance


@dataclass(frozen=True)
class _Scale:
    """What one law's residuals are judged by, from those of the law that fits best: their sum of squares and number,
    how many independent ones they are worth, and their variance where the noise is known."""

    sum: float
    rows: int
    effective: float
    variance: float | None

    def criteria(self, law: _Candidate) -> tuple[float, float, float]:
        """AIC, AICc and BIC; a variance that is estimated counts as a parameter."""
        if self.variance is not None:
            misfit, count = float(self.effective / self.rows * law.sum / self.variance), law.count
            aic = misfit + 2 * count
            return aic, aic, misfit + count * float(np.log(self.effective))
        count, misfit = law.count + 1, self.effective * float(np.log(law.sum / law.rows))
        aic = misfit + 2 * count
        spare = max(self.effective - count - 1, 1.0)
        return aic, aic + 2 * count * (count + 1) / spare, misfit + count * float(np.log(self.effective))


def _scale(candidates: Sequence[_Candidate]) -> _Scale:
    best = min(candidates, key=lambda law: (law.covariance is None, law.sum))
    evaluation, effective = best.solution.evaluation, float(best.rows)
    if best.covariance is not None:
        plain = plain_covariance(evaluation.gradient, evaluation.residual, prior=prior_precision(best.problem))
        effective /= inflation(plain, best.covariance)
    variance = None
    if all(candidate.problem.noise_known for candidate in candidates):
        variance = max(best.sum / max(best.rows - evaluation.eliminated - best.count, 1), 1.0)
    return _Scale(best.sum, best.rows, effective, variance)


def weights_of(criterion: np.ndarray) -> np.ndarray:
    """Weights (k,) of laws, sum 1, by their AIC (Akaike's) or BIC (k,)."""
    likelihood = np.exp(-0.5 * (criterion - np.min(criterion)))
    return likelihood / likelihood.sum()


def _scores(ranked: Sequence[_Candidate], scale: _Scale) -> tuple[LawScore, ...]:
    trusted = np.array([not law.warnings for law in ranked])
    weights = weights_of(np.where(trusted, [scale.criteria(law)[0] for law in ranked], np.inf if trusted.any() else 0))
    return tuple(_score(law, ranked[0], scale, float(weight)) for law, weight in zip(ranked, weights, strict=True))


def _score(law: _Candidate, best: _Candidate, scale: _Scale, weight: float) -> LawScore:
    aic, aicc, bic = scale.criteria(law)
    names = [unknown.name for unknown in law.problem.unknowns]
    deviations = np.full(len(names), np.nan) if law.covariance is None else np.sqrt(np.diag(law.covariance))
    return LawScore(
        law=law.name,
        values=dict(zip(names, map(float, law.solution.values), strict=True)),
        deviations=dict(zip(names, map(float, deviations), strict=True)),
        units={unknown.name: unknown.unit for unknown in law.problem.unknowns},
        rms=float(np.sqrt(law.sum / law.rows)),
        aic=aic,
        aicc=aicc,
        bic=bic,
        weight=weight,
        held_out=None if law.held_out is None else float(np.sqrt(np.sum(law.held_out) / scale.sum)),
        worse=_worse(law, best) if law is not best else 0.0,
        bounds=tuple(name for name, at in zip(names, law.solution.at_bound, strict=True) if at),
        warnings=law.warnings,
    )


def _worse(law: _Candidate, best: _Candidate) -> float | None:
    """Difference of held-out sums in standard errors: their scatter from cluster to cluster, and the chance of fits."""
    sums, least = law.held_out, best.held_out
    if sums is None or least is None:
        return None
    if len(sums) == len(least):
        scatter = len(sums) * float(np.var(sums - least, ddof=1))
    else:
        scatter = len(sums) * float(np.var(sums, ddof=1)) + len(least) * float(np.var(least, ddof=1))
    error = float(np.sqrt(scatter + law.chance + best.chance))
    return float(np.sum(sums) - np.sum(least)) / error if error > 0 else 0.0


def _verdict(
    scores: Sequence[LawScore], folds: str, doubts: Sequence[str], nested: Collection[tuple[str, str]] | None
) -> str:
    best, second = scores[:2]
    if best.warnings:
        return "None of the laws has values that mean what it says."
    if second.warnings:
        return f"{best.law}: it alone has values that mean what it says."
    lead, worse = second.bic - best.bic, second.worse or 0.0
    agreement = (
        f"{folds} agree ({worse:.1f} standard errors)"
        if worse > SURE
        else f"{folds} speak for {second.law} ({-worse:.1f} standard errors)"
        if worse < -SURE
        else f"{folds} do not tell the two apart ({worse:+.1f} standard errors)"
    )
    words = f"{best.law} before {second.law} by {lead:.3g} in BIC; {agreement}."
    if doubts:
        return f"{words} But even {best.law} is not the whole truth, see below."
    simple = min(scores[:2], key=lambda score: len(score.values))
    inside = set(second.values) > set(best.values) if nested is None else (best.law, second.law) in nested
    if worse < -SURE:
        sure = "Undecided: the two criteria disagree."
    elif inside and lead > POSITIVE:
        sure = f"Likely: what {second.law} has more gains nothing."
    elif lead > VERY_STRONG:
        sure = "Sure."
    elif lead > POSITIVE:
        sure = "Likely, not sure."
    elif worse > SURE:
        sure = "Likely: the held-out logs decide."
    else:
        fewer = f"; {simple.law} has fewer parameters" if len(best.values) != len(second.values) else ""
        sure = f"Undecided: a lead below {POSITIVE:g} says nothing{fewer}."
    return f"{words} {sure}"
