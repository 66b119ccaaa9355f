"""Which law the logs of the rig ask for: friction laws on the same logs, and a rigid contact against bristles.

How laws are compared: `inference.comparison`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.disturbances.terms import terms_of
from identification.estimators import ESTIMATORS
from identification.estimators.base import Options
from identification.fit.causes import asked_for, judged
from identification.fit.rivals import fit_rivals, not_far, weak_fits
from identification.inference.comparison import Comparing, LawComparison, compare_problems, single_law
from identification.inference.defaults import AUTO, DISTURBANCES, ESTIMATOR, LAW
from identification.laws import FittableLaw, find_law, slip_laws
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.measurement.presliding import presliding
from rig_io.logs.log import RigLog

RIGID, BRISTLES = "Conti, rigid", "LuGre"
CLOSE = 1.1  # times the least sum of squares of the weak form: as good, to begin with
TWO = 2  # laws, the least that are compared


def compare_laws(
    logs: Sequence[RigLog] | Pool,
    laws: Sequence[str] | None = None,
    *,
    estimator: str = ESTIMATOR,
    disturbances: str | Sequence[str] = DISTURBANCES,
    progress: Callable[[float], None] | None = None,
) -> LawComparison:
    """Compare friction laws on the same logs, all pooled, by the likelihood of an estimator.

    logs: as for `fit_friction`; laws: as `find_law` takes them; all of slip speed alone if None; disturbances: as for
    `fit_friction`. "auto": those that slips show without a law are estimated beside every law. Laws that the weak form
    finds far off are left aside. StickslipError: as in `compare_problems`, or the logs cannot be fitted.
    """
    ready = logs if isinstance(logs, Pool) else pool(logs)
    sought = slip_laws() if laws is None else {find_law(name).name: find_law(name) for name in laws}
    if len(sought) < TWO:
        raise StickslipError("A comparison needs two laws or more.")
    report = progress if progress is not None else lambda _: None
    causes = asked_for(disturbances)
    if disturbances == AUTO and (verdict := judged(ready)) is not None:
        causes = tuple(explanation.name for explanation in verdict.explanations)
    comparison = _compared(ready, sought, estimator, causes, report)
    report(1.0)
    return comparison


def _compared(
    ready: Pool, laws: Mapping[str, FittableLaw], estimator: str, causes: Sequence[str], report: Callable[[float], None]
) -> LawComparison:
    """Laws by the residuals of an estimator, cut by the law that the weak form finds best."""
    options = Options(disturbances=terms_of(ready, causes))
    weak = weak_fits(ready, laws, options)
    least = min(fit.sum for fit in weak.values())
    top = {name: laws[name] for name in not_far(weak)}
    ordered = sorted(weak, key=lambda name: weak[name].sum)
    top |= {name: laws[name] for name in ordered[:TWO]}
    aside = {
        name: f"off by {np.sqrt(fit.sum / least):.2g} times the residuals of {ordered[0]} in the weak form"
        for name, fit in weak.items()
        if name not in top
    }
    # of laws that are as good the one with the fewest parameters; one whose values the model refuses cuts nothing
    order = sorted((name for name in top), key=lambda name: (weak[name].sum > CLOSE * least, len(laws[name].names)))
    cuts = (ESTIMATORS.load(estimator).estimate(ready, laws[name], options) for name in order)
    cut = next(cuts)
    while cut.estimator.name != estimator and (following := next(cuts, None)) is not None:
        cut = following
    report(0.3)
    fits = fit_rivals(cut, top, lambda law: weak[law.name].law_values, progress=lambda done: report(0.3 + 0.4 * done))
    at_rest = float(cut.law.value(np.zeros(1), cut.solution.values[: len(cut.law.parameters)])[0])
    sticks = presliding(ready, at_rest) if len(ready.contacts) == 1 else None
    elastic = sticks is not None and sticks.elastic
    doubts = (*cut.warnings, *(sticks.warnings if sticks is not None and elastic else ()))
    names = [motion.log.name for motion in ready.motions]
    if len(fits.fitted) < TWO:
        ((name, only),) = fits.fitted.items()
        verdict = f"{name}: no other law follows the logs."
        comparison = single_law(name, only.problem, only.solution, names, verdict, doubts)
    else:
        comparison = compare_problems(
            {name: fit.problem for name, fit in fits.fitted.items()},
            names,
            solutions={name: fit.solution for name, fit in fits.fitted.items()},
            options=Comparing(nested=fits.nested, doubts=doubts),
            progress=lambda done: report(0.7 + 0.3 * done),
        )
    comparison = replace(comparison, estimator=cut.estimator.name, causes=tuple(causes), elastic=elastic)
    return replace(comparison, aside={**aside, **fits.refused})


def compare_contacts(
    logs: Sequence[RigLog] | Pool, *, progress: Callable[[float], None] | None = None
) -> LawComparison:
    """Compare a rigid contact with bristles (LuGre) before the same law (Conti's), by the output error of whole cycles,
    in which alone the two differ. StickslipError: the logs cannot be followed through whole cycles by both, or as in
    `compare_problems`."""
    ready = logs if isinstance(logs, Pool) else pool(logs)
    names = [motion.log.name for motion in ready.motions]
    estimates = {}
    for number, (name, estimator) in enumerate({RIGID: "whole-cycle", BRISTLES: "lugre"}.items()):
        estimates[name] = ESTIMATORS.load(estimator).estimate(ready, find_law(LAW), Options())
        if progress is not None:
            progress(0.3 * (number + 1))
    rigid, elastic = estimates[RIGID], estimates[BRISTLES]
    if rigid.estimator.name != "whole-cycle":
        raise StickslipError(f"Rigid contact and bristles cannot be compared. {' '.join(rigid.warnings)}")
    if elastic.estimator.name != "lugre":
        return single_law(RIGID, rigid.problem, rigid.solution, names, " ".join(elastic.warnings))
    return compare_problems(
        {name: estimate.problem for name, estimate in estimates.items()},
        names,
        solutions={name: estimate.solution for name, estimate in estimates.items()},
        progress=None if progress is None else lambda done: progress(0.6 + 0.4 * done),
    )
