"""Inverse dynamics of one degree of freedom: a recipe and a log give parameters, and what to think of them."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.registry import Reference
from fmu_models.base.shown import Pictured
from identification.inference.choice import coloured_covariance
from identification.inference.comparison import Comparing, LawComparison, compare_problems
from identification.inference.lmfit_exchange import Solved, given
from identification.inference.problem import Solution, among, searched, solve
from identification.inference.uncertainty import LAG_RULE, autocorrelation, inflation, plain_covariance
from identification.machines.axis_problem import PARTS, InverseProblem, inverse_problem, law_problems, regressors
from identification.machines.axis_terms import KINDS, Term, check_terms, read_model
from identification.measurement.recipe import Recipe
from identification.measurement.signals import Prepared, prepare
from rig_io.packages.datapackage import read_columns

if TYPE_CHECKING:
    import pandas
    from lmfit import Minimizer, Parameters

POOR = 0.8  # of the variance: a model that explains less does not describe the machine
UNSEEN_WORSE = 1.5  # times the error of the fit: the parameters belong to the log, not to the machine
TOO_SMALL = 1.5  # times: white standard deviations smaller than that by this are worth a warning


@dataclass(frozen=True)
class Estimate:
    """One parameter. standard_deviation: with the colour of the residuals (Newey-West); white_deviation: as if they
    were white, as publications print it."""

    name: str
    term: str
    value: float
    unit: str
    standard_deviation: float
    white_deviation: float

    @property
    def factor(self) -> float:
        """By how much the white standard deviation is too small."""
        return self.standard_deviation / self.white_deviation if self.white_deviation > 0 else 1.0


@dataclass(frozen=True)
class Score:
    """How well a model explains a log. relative_error: |r|/|y|; explained: share of the variance of the effort."""

    relative_error: float
    explained: float


@dataclass(frozen=True)
class InverseResult:
    """What a log says of a model. unseen: score of blocks of this log left out in turn; held_out: by log; condition: of
    the regressors in their units; neighbour_correlation: of the residuals; effective_samples: how many independent ones
    the samples are worth; covariance: how the standard deviations were found; verdicts: in words.
    """

    title: str
    source: str
    log: str
    samples: int
    estimates: tuple[Estimate, ...]
    score: Score
    unseen: Score
    held_out: dict[str, Score]
    condition: float
    neighbour_correlation: float
    effective_samples: float
    covariance: str
    laws: LawComparison | None
    verdicts: tuple[str, ...]

    def __getitem__(self, name: str) -> float:
        """Value of a parameter."""
        return next(e.value for e in self.estimates if e.name == name)

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return dataclasses.asdict(self)


@dataclass(frozen=True, eq=False)
class InverseRun(Pictured):
    """A result with the signals behind it, for figures; residual: (k,) N or N m, measured less modelled effort, not
    weighted."""

    result: InverseResult
    prepared: Prepared
    problem: InverseProblem
    solved: Solved
    residual: np.ndarray

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each parameter: value, unit, its standard deviation, and that as if residuals were white."""
        import pandas

        names = ("value", "unit", "standard_deviation", "white_deviation")
        rows = [{name: getattr(one, name) for name in names} for one in self.result.estimates]
        return pandas.DataFrame(rows, index=pandas.Index([one.name for one in self.result.estimates], name="parameter"))

    def _heading(self) -> str:
        score = self.result.score
        return f"InverseRun: {self.result.title}, relative error {100 * score.relative_error:.2f} %"

    def _contents(self) -> Mapping[str, Any]:
        return {
            one.name: f"{value_with_sd(one.value, one.standard_deviation)} {one.unit}" for one in self.result.estimates
        }

    def to_lmfit(self) -> tuple[Minimizer, Any]:
        """The fit as lmfit has it, to go on with: see `inference.lmfit_exchange`."""
        return self.solved.to_lmfit()


def inverse_dynamics(
    recipe: Recipe,
    log: str | os.PathLike[str],
    held_out: Sequence[str | os.PathLike[str]] = (),
    *,
    parameters: Parameters | None = None,
    reader: Reference | None = None,
    repair: Collection[str] = (),
) -> InverseRun:
    """Fit the recipe's terms to a log, judge them, and score other logs with the same values.

    parameters: first values, bounds and held parameters of the terms, by name (Fv+ is called Fv_plus). reader, repair:
    as in `rig_io.read_log`.

    Raises:
        StickslipError: the recipe names no terms, a log cannot be read or does not fit the recipe, or cannot tell the
            terms apart.
    """
    model = read_model(recipe)

    def ready(path: str | os.PathLike[str]) -> Prepared:
        return prepare(recipe, read_columns(path, reader=reader), repair)

    prepared = ready(log)
    check_terms(recipe, prepared, model.terms)
    said, problem = given(parameters), inverse_problem(prepared, model.terms)
    said.check([unknown.name for unknown in problem.unknowns])
    problem = replace(problem, unknowns=said.bounded(problem.unknowns))
    found = solve(problem, said.start(problem), fixed=said.fixed(problem))
    others = {os.fspath(other): _elsewhere(ready(other), model.terms, found.values) for other in held_out}
    residual = _off(prepared, model.terms, found.values)
    here, unseen = score(prepared.effort, residual), _unseen(problem, found)
    covariance, white = _covariances(problem, found)
    columns = (model.terms, found.values, np.sqrt(np.diag(covariance)), np.sqrt(np.diag(white)))
    estimates = tuple(
        Estimate(t.name, t.kind, float(value), str(t.unit(prepared.turning)), float(sd), float(as_white))
        for t, value, sd, as_white in zip(*columns, strict=True)
    )
    neighbours = autocorrelation(found.evaluation.residual, np.zeros(len(residual)))
    effective = len(residual) / inflation(white, covariance)
    laws = compared_laws(law_problems(prepared, model), os.fspath(log)) if model.laws else None
    verdicts = (
        *_on_fit(here, unseen, others),
        *_on_values(estimates, found.at_bound),
        *_on_colour(estimates, len(residual), effective, neighbours),
        *((f"Friction laws: {laws.verdict}", *_aside(laws)) if laws else ()),
        *prepared.notes,
    )
    result = InverseResult(
        recipe.title,
        recipe.source,
        os.fspath(log),
        len(residual),
        estimates,
        here,
        unseen,
        others,
        float(np.linalg.cond(problem.design)),
        neighbours,
        effective,
        LAG_RULE,
        laws,
        verdicts,
    )
    return InverseRun(result, prepared, problem, Solved(problem, found, covariance), residual)


def _covariances(problem: InverseProblem, found: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Covariances (m, m) of all parameters, for coloured and for white residuals; 0 for those held."""
    rest, seen, free = searched(problem, found)
    white = plain_covariance(seen.evaluation.gradient, seen.evaluation.residual)
    return among(coloured_covariance(rest, seen, "hac"), free), among(white, free)


def score(effort: np.ndarray, residual: np.ndarray) -> Score:
    """Score of a residual (k,) of an effort (k,)."""
    return Score(
        float(np.linalg.norm(residual) / np.linalg.norm(effort)), float(1 - np.mean(residual**2) / np.var(effort))
    )


def _off(prepared: Prepared, terms: tuple[Term, ...], values: np.ndarray) -> np.ndarray:
    """Measured less modelled effort (k,) of a log, seen or unseen."""
    return prepared.effort - regressors(prepared, terms) @ values


def _elsewhere(prepared: Prepared, terms: tuple[Term, ...], values: np.ndarray) -> Score:
    """How well values (m,) from one log explain another."""
    return score(prepared.effort, _off(prepared, terms, values))


def _unseen(problem: InverseProblem, found: Solution) -> Score:
    """Score of parts of the log, each with the values from the others."""
    labels = np.unique(problem.cluster)
    held = {u.name: float(x) for u, x in zip(problem.unknowns, found.values, strict=True) if u.name in found.fixed}
    part_of = labels * PARTS // (labels[-1] + 1)
    residual = np.empty(len(problem.rows))
    for part in np.unique(part_of):
        values = solve(problem.resampled(labels[part_of != part]), found.values, fixed=held).values
        inside = np.isin(problem.cluster, labels[part_of == part])
        residual[inside] = _off(problem.prepared, problem.terms, values)[inside]
    return score(problem.prepared.effort, residual)


def compared_laws(problems: dict[str, InverseProblem], log: str) -> LawComparison:
    """Laws by their problems of one log, judged by HAC deviations and parts held out; friction that drives is put
    aside."""
    solutions = {name: solve(problem) for name, problem in problems.items()}
    warnings = {name: _meaning(problem, solutions[name]) for name, problem in problems.items()}
    asked = Comparing("hac", PARTS, warnings)
    return compare_problems(problems, [log], solutions=solutions, asked=asked)


def _meaning(problem: InverseProblem, found: Solution) -> tuple[str, ...]:
    """Why the values of a law mean nothing."""
    if problem.law is None:
        friction = [(t.name, v) for t, v in zip(problem.terms, found.values, strict=True) if KINDS[t.kind].friction]
        wrong = [f"{name} = {value:.4g}" for name, value in friction if value < 0]
        return (f"{', '.join(wrong)} below zero: friction that drives.",) if wrong else ()
    named = zip(problem.unknowns, found.values, found.at_bound, strict=True)
    ends = [f"{unknown.name} = {value:.3g} at the end of its range" for unknown, value, at in named if at]
    said = problem.law.warnings(found.values[len(problem.terms) :])
    return (*said, *((f"{', '.join(ends)}.",) if ends else ()))


def _aside(laws: LawComparison) -> tuple[str, ...]:
    return tuple(f"{one.law} is put aside: {' '.join(one.warnings)}" for one in laws.scores if one.warnings)


def _on_fit(here: Score, unseen: Score, others: dict[str, Score]) -> list[str]:
    said = []
    if here.explained < POOR:
        said.append(
            f"Poor fit: the residual is {100 * here.relative_error:.0f} % of the effort, the model fits "
            f"{100 * (1 - here.relative_error):.0f} % of it; {100 * here.explained:.0f} % of its variance explained. "
            "That values can be reproduced does not make them valid: mend the model or the log before you use them "
            "(effort sensor, delay between the signals, play, missing terms)."
        )
    for name, other in {"blocks of this log left out in turn": unseen, **others}.items():
        if other.explained < POOR <= here.explained or other.relative_error > UNSEEN_WORSE * here.relative_error:
            said.append(
                f"Worse on what the fit has not seen: {name}, error {100 * other.relative_error:.0f} % against "
                f"{100 * here.relative_error:.0f} %, {100 * other.explained:.0f} % of the variance explained."
            )
    return said


def _on_values(estimates: Sequence[Estimate], at_bound: Sequence[bool]) -> list[str]:
    said = []
    for e, at in zip(estimates, at_bound, strict=True):
        if at:
            said.append(f"{e.name} = {e.value:.4g} {e.unit} lies on a bound that was given: the log asks for more.")
        elif e.standard_deviation == 0:
            said.append(f"{e.name} was held at {e.value:.4g} {e.unit}.")
        elif KINDS[e.term].positive and e.value < 0:
            said.append(
                f"{e.name} = {e.value:.4g} {e.unit} is below zero, which {KINDS[e.term].meaning} cannot be: check the "
                "signs of effort and motion, or leave the term out."
            )
        elif abs(e.value) < 1.96 * e.standard_deviation:
            said.append(f"{e.name} cannot be told from zero: {value_with_sd(e.value, e.standard_deviation, e.unit)}.")
    return said


def _on_colour(estimates: Sequence[Estimate], samples: int, effective: float, neighbours: float) -> list[str]:
    factors = {e.name: e.factor for e in estimates}
    # neighbours of white residuals are correlated as much in 1 of 20 logs
    if abs(neighbours) < 1.96 / np.sqrt(samples) or max(factors.values()) < TOO_SMALL:
        return []
    told = ", ".join(f"{name} {factor:.1f}" for name, factor in factors.items())
    return [
        f"The residuals are coloured (neighbours {neighbours:+.2f}): {samples} samples are worth {effective:.0f}. "
        f"Standard deviations for white noise are too small by {told}; those given allow for colour ({LAG_RULE})."
    ]
