"""How well a minimum is known: noise from the residuals, their colour taken off, a covariance, what is not told.

Segments meet exactly (`untold.meeting`), so that the weight of the search is in none of the numbers. Residuals are
whitened by an autoregression for each series, and the solution is found again; the sandwich (Newey-West) of the same
rows is the check.
"""

from dataclasses import dataclass, replace

import numpy as np

from identification.calibration.descent import Minimum
from identification.calibration.problem import SegmentProblem
from identification.calibration.untold import column_norms, meeting, untold_directions
from identification.inference.colour import Whitened, whitened
from identification.inference.identifiability import Collinearity, of_gradient
from identification.inference.problem import Solution, prior_precision, solve
from identification.inference.uncertainty import newey_west, plain_covariance

REFIT = 1e-8  # relative, of the solution by whitened rows
ROUNDS = 3  # of the noise of several series, and of its colour
MISTRUSTED = 1.5  # times the deviation: a sandwich so much wider is taken instead


@dataclass(frozen=True, eq=False)
class Concluded:
    """problem, whitened: with the noise that the residuals show; solution: by whitened rows; covariance: (m, m) of all
    unknowns; untold: names that move together unseen; collinearity: of the parameters and sensors; inflation: largest
    ratio of the sandwich's deviations to those of whitened rows, which it replaces from `MISTRUSTED` on."""

    problem: SegmentProblem
    whitened: Whitened
    solution: Solution
    covariance: np.ndarray
    untold: tuple[tuple[str, ...], ...]
    collinearity: Collinearity
    inflation: float


def conclude(minimum: Minimum) -> Concluded:
    """What is known at a minimum. Where whitened rows are as coloured as before, by their sandwich, the model misses
    something that no noise explains: then the plain solution stays, with the sandwich of its own rows."""
    problem, plain = _weighed(minimum)
    series, values, concluded, fitted = len(problem.series), plain.values, None, None
    evaluation = plain.evaluation
    for _ in range(ROUNDS):
        filtered = whitened(problem, evaluation, series, fitted)
        if not any(rule.order for rule in filtered.filters.values()):
            break
        concluded = _judged(filtered, problem, solve(filtered, values, tolerance=REFIT, evaluations=10))
        values, evaluation = concluded.solution.values, concluded.solution.evaluation
        slopes = evaluation.gradient[evaluation.log < series]
        size, vectors = np.linalg.eigh(concluded.covariance * np.outer(norms := column_norms(slopes), norms))
        fitted = slopes / norms @ (vectors * np.sqrt(np.maximum(size, 0.0)))
    if concluded is not None and concluded.inflation <= MISTRUSTED:
        return concluded
    return _judged(Whitened(problem, {}), problem, plain)


def _judged(filtered: Whitened, problem: SegmentProblem, solution: Solution) -> Concluded:
    """What is known at a solution of filtered rows."""
    series, shared, values = len(problem.series), problem.shared, solution.values
    white = filtered.evaluate(values)
    basis = meeting(white, problem)
    prior = basis.T @ prior_precision(problem) @ basis
    data = white.log < series
    slopes = white.gradient[data] @ basis
    names = [unknown.name for unknown in problem.unknowns[:shared]]
    told, untold = untold_directions(slopes, prior, problem.unknowns[:shared], values)
    known = told.T @ prior @ told
    inner = plain_covariance(slopes @ told, white.residual[data], prior=known)
    check = newey_west(slopes @ told, white.residual[data], log=white.log[data], prior=known)
    ratio = np.sqrt(
        np.maximum(np.diag(told @ check @ told.T), 0.0) / np.maximum(np.diag(told @ inner @ told.T), 1e-300)
    )
    inflation = float(np.max(ratio[:shared], initial=0.0))
    covariance = basis @ told @ (check if inflation > MISTRUSTED else inner) @ told.T @ basis.T
    columns, starts = slopes[:, :shared], slopes[:, shared:] / column_norms(slopes[:, shared:])
    # as far as start states cannot do the same
    projected = columns - starts @ np.linalg.lstsq(starts, columns, rcond=None)[0]
    collinear = of_gradient(projected, names, values[:shared], covariance[:shared, :shared])
    solution = replace(solution, evaluation=problem.evaluate(values))
    return Concluded(problem, filtered, solution, covariance, untold, collinear, inflation)


def _weighed(minimum: Minimum) -> tuple[SegmentProblem, Solution]:
    """The minimum with the noise that its residuals show, where nobody stated it."""
    problem, solution = minimum.problem, minimum.solution
    series = problem.series
    if problem.noise_known:
        return problem, solution
    for _ in range(ROUNDS if len(series) > 1 else 1):
        here = solution.evaluation
        sizes = [float(np.sqrt(np.mean(here.residual[here.log == n] ** 2))) for n in range(len(series))]
        noise = {key: problem.noise[key] * max(size, 1e-12) for key, size in zip(series, sizes, strict=True)}
        problem = replace(problem, noise=noise)
        if len(series) > 1:
            solution = solve(problem, solution.values, tolerance=REFIT, evaluations=20)
        else:
            solution = replace(solution, evaluation=problem.evaluate(solution.values))
    return problem, solution
