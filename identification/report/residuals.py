"""The residuals of a fit, found again from its logs: the estimator is run once more."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.estimators import ESTIMATORS
from identification.estimators.base import Options
from identification.fit.causes import terms_found
from identification.fit.fit import SENSORS
from identification.fit.result import FrictionFit
from identification.inference.problem import Evaluation, solve
from identification.laws import find_law
from identification.laws.joint_law import sought_law
from identification.measurement.pooled import Pool

SAME = 0.1  # standard deviations, up to which the fit counts as reproduced


def refitted(fit: FrictionFit, ready: Pool) -> tuple[Evaluation, tuple[str, ...]]:
    """Residuals at the new solution, and a sentence on how it compares with the stored one. StickslipError: these logs
    cannot be fitted."""
    terms = terms_found(ready, fit.causes)
    known = (*SENSORS, *(term.name for term in terms))
    nuisance = tuple(q.name for q in fit.nuisance if q.name not in known)
    options = Options(nuisance=nuisance, disturbances=terms, given=fit.given)
    law = options.bounded(sought_law(find_law(fit.law_reference), ready.contacts, ready.arrangement))
    estimate = ESTIMATORS.load(fit.estimator).estimate(ready, law, options)
    problem, solution = estimate.problem, estimate.solution
    # as the fit has adjusted them, where these logs state them as those of the fit did
    adjusted = {(constant.name, constant.before): constant.value for constant in fit.constants}
    held = tuple(replace(p, value=adjusted.get((p.name, p.value), p.value)) for p in problem.held)
    if held != problem.held:
        problem = problem.with_held(held)
        solution = solve(problem, solution.values, fixed=options.given.fixed(problem))
    return solution.evaluation, (_reproduced(fit, solution.values),)


def _reproduced(fit: FrictionFit, values: Sequence[float] | np.ndarray) -> str:
    pairs = [(q, value) for q, value in zip(fit.parameters, values, strict=False) if not q.held]
    off = [abs(value - q.value) / q.standard_deviation for q, value in pairs]
    if max(off) <= SAME:
        return "The fit was run again on the logs given here and gave the same values."
    return (
        f"Run again on the logs given here, the fit gives values up to {max(off):.2g} standard deviations away: they "
        "are not the logs that were fitted, or the program has changed since."
    )
