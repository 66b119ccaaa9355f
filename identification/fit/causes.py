"""Which disturbances a fit of one driving disc takes up: those that its slips show without any law, or those named."""

from collections.abc import Sequence

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.disturbances import DISTURBANCES
from identification.disturbances.term import DisturbanceTerm
from identification.disturbances.terms import ranked, terms_of
from identification.estimators.base import Estimate
from identification.estimators.shooting import slip_shooting
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.adjust import REFUSED
from identification.fit.parts import Cause
from identification.free_friction.contest import Verdict, contest
from identification.inference.defaults import AUTO, ESTIMATOR, NONE
from identification.measurement.pooled import Pool


def asked_for(disturbances: str | Sequence[str]) -> tuple[str, ...]:
    """Names of the disturbances that are asked for; none for `AUTO` and `NONE`."""
    if isinstance(disturbances, str):
        return () if disturbances in (AUTO, NONE) else (disturbances,)
    return tuple(disturbances)


def judged(ready: Pool, estimate: Estimate | None = None, named: Sequence[str] | None = None) -> Verdict | None:
    """What slips say without a law; None where they cannot tell.

    Args:
        ready: logs of one rig.
        estimate: by shooting, whose slips are cut where its law slips; else they are cut by the speeds measured.
        named: as for `contest`.
    """
    try:
        if estimate is not None and estimate.estimator.name == ESTIMATOR:
            problem = estimate.problem
            assert isinstance(problem, ShootingProblem)
            return contest(problem.ready, problem.segments, problem.noise_known, named)
        return contest(ready, *slip_shooting(ready), named)
    except (StickslipError, np.linalg.LinAlgError):
        return None


def causes_of(verdict: Verdict, ready: Pool) -> tuple[Cause, ...]:
    """What slips show, in words."""
    causes = []
    for explanation in verdict.explanations:
        one, alike = explanation, [name for name in explanation.alike if name in DISTURBANCES.names()]
        words, chance = _words(one.name, one.terms, ready, one.values), float(np.exp(-one.gain / 2))
        would = dict.fromkeys(disturbance.told_by for disturbance in ranked([one.name, *alike]).values())
        told_by = "; or ".join(text for text in would if text) if one.alike else ""
        causes.append(Cause(one.name, words, one.size, one.unit, one.gain, chance, one.alike, told_by))
    return tuple(causes)


def causes_named(names: Sequence[str], ready: Pool) -> tuple[Cause, ...]:
    """Disturbances that are taken for granted where slips do not judge them: nothing is known of their size."""
    terms = {name: [term for term in terms_of(ready, [name]) if term.cause == name] for name in names}
    return tuple(Cause(name, _words(name, own, ready), 0.0, "1", 0.0, 1.0) for name, own in terms.items())


def _words(name: str, terms: Sequence[DisturbanceTerm], ready: Pool, values: Sequence[float] = ()) -> str:
    disturbance = ranked([name])[name]
    return disturbance.words + disturbance.remark(ready, terms, values)


def radii_of(verdict: Verdict, ready: Pool) -> dict[str, float]:
    """Radii that slips ask for in place of those measured, m, where one is off by more than a measurement can be: none
    that needs a disturbance beside it to explain the logs, for it is one more of what they may be."""
    off = {name: off for name, (off, _) in verdict.wrong.items() if name in ("R", "r")}
    if not verdict.curve.explains or verdict.explanations or max(map(abs, off.values()), default=0.0) < REFUSED:
        return {}
    stated = {prior.name: prior.value for prior in ready.priors}
    return {name: stated[name] * float(np.exp(share)) for name, share in off.items()}


def terms_found(ready: Pool, causes: Sequence[Cause]) -> tuple[DisturbanceTerm, ...]:
    """The terms of causes that were found."""
    sizes = {cause.name: cause.size for cause in causes if cause.size}
    return terms_of(ready, [cause.name for cause in causes], sizes)
