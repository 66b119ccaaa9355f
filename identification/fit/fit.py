"""From pooled logs to the fit of a friction law, by an estimator that is chosen by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError, nearest
from identification.estimators import ESTIMATORS
from identification.estimators.base import Estimate, Estimator, FrictionProblem, Options
from identification.estimators.disturbances import terms_of
from identification.fit.causes import WIDER, find_causes
from identification.fit.conclude import conclude
from identification.fit.law_spread import MODES, causes_beside_law, contest, with_spread
from identification.fit.result import Cause, FrictionFit
from identification.inference.choice import Inference
from identification.inference.lmfit_exchange import given
from identification.laws import find_law
from identification.laws.joint_law import sought_law
from identification.measurement.pooling import Pool, pool
from rig_io.logs.log import RigLog

if TYPE_CHECKING:
    from lmfit import Parameters

SENSORS = ("gain", "delay")  # nuisance parameters that an estimator takes up by itself
DEFAULT = "shooting"
DEFAULT_OPTIONS = Options()
DEFAULT_INFERENCE = Inference()
WEAK = "weak-form"  # the estimator that runs no model
AUTO, NONE = "auto", "none"  # disturbances: those that the logs show, or none


def fit_friction(
    logs: Sequence[RigLog] | Pool,
    *,
    estimator: str = DEFAULT,
    law: str = "Conti",
    options: Options = DEFAULT_OPTIONS,
    disturbances: str | Sequence[str] = NONE,
    law_spread: str = NONE,
    parameters: Parameters | None = None,
    inference: Inference = DEFAULT_INFERENCE,
    progress: Callable[[float], None] | None = None,
) -> FrictionFit:
    """Friction law from stick-slip logs of one rig, all pooled.

    logs: stick-slip logs of one driving disc or two; a free-decay log among them gives k/J and c/J; or a
    `measurement.pooling.pool` of them. law: as `find_law` takes it. parameters: first values, bounds and held
    unknowns, by name (of the law, of the nuisance parameters, ``gain`` and ``delay`` of the laser; k/J is called
    k_per_J). An interrupt (Ctrl-C) once there is a solution ends the search for its uncertainty, and the fit says so.
    inference: how its uncertainty is found, and ``progress`` the fraction of that work done. disturbances: names of
    `estimators.disturbances.CAUSES`, estimated beside the law; "auto": those that the logs show, sought only where the
    residuals ask for it (one driving disc); or "none". law_spread: whether the intervals carry the spread over laws
    that the logs cannot tell apart, and over which: those that the weak form leaves within reach ("auto"), "all" that
    are not far off, or "none". A law that had not converged, as one nested in it shows, is taken from there.

    Raises:
        StickslipError: unknown estimator or law, or logs that cannot be pooled or fitted.
    """
    if parameters is not None:
        options = replace(options, given=given(parameters))
    if law_spread not in MODES:
        raise StickslipError(f"There is no spread over laws '{law_spread}'.{nearest(law_spread, MODES)}")
    chosen = ESTIMATORS.load(estimator)
    form = find_law(law)
    if not form.sticks and estimator != "lugre":
        raise StickslipError(
            f"The law '{form.name}' is fitted by the estimator 'lugre': '{estimator}' sees no micro-slip."
        )
    ready = logs if isinstance(logs, Pool) else pool(logs)
    sought = options.bounded(sought_law(form, ready.contacts, ready.arrangement))
    bristles = find_law("LuGre").names if estimator == "lugre" else ()
    options.given.check((*sought.names, *bristles, *SENSORS, *options.nuisance))

    def fitted(
        options: Options, progress: Callable[[float], None] | None, wider: float = 1.0, by: Estimator = chosen
    ) -> FrictionFit:
        return concluded(by.estimate(ready, sought, options), progress, wider)

    def concluded(made: Estimate, progress: Callable[[float], None] | None, wider: float) -> FrictionFit:
        solved = (ready, made.estimator, made.problem, made.solution, made.law)
        try:
            return conclude(*solved, inference, progress=progress, warnings=made.warnings, wider=wider)
        except KeyboardInterrupt:
            said = (
                f"Interrupted: {inference.covariance} and intervals were not finished; the deviations are the "
                "jackknife's."
            )
            return conclude(*solved, DEFAULT_INFERENCE, warnings=(*made.warnings, said), wider=wider)

    def contested(fit: FrictionFit, wider: float = 1.0) -> FrictionFit:
        if law_spread == NONE or fit.solved is None:
            return fit
        by, (problem, solution) = ESTIMATORS.load(fit.estimator), (fit.solved.problem, fit.solved.solution)
        assert isinstance(problem, FrictionProblem)
        made = Estimate(by, sought, problem, solution)
        found = contest(ready, made, law_spread)
        if found is None:
            return fit
        better = found.fitted[found.own].found
        if better is not solution:
            fit = concluded(replace(made, solution=better), None, wider)
        return with_spread(fit, found)

    def share(begin: float, end: float) -> Callable[[float], None] | None:
        told = progress
        return None if told is None else lambda done: told(begin + (end - begin) * done)

    if disturbances == NONE:
        return contested(fitted(options, progress))
    named = () if disturbances == AUTO else (disturbances,) if isinstance(disturbances, str) else tuple(disturbances)
    terms_of(ready, named)  # names are judged before the work
    failed = None
    try:
        plain = fitted(options, share(0.0, 0.4))
    except StickslipError as error:
        # without a strong disturbance the model may not follow the logs at all; the weak form runs none
        if len(ready.contacts) > 1 or estimator == WEAK:
            raise
        failed, plain = error, fitted(options, share(0.0, 0.4), by=ESTIMATORS.load(WEAK))
    if failed is None and not named and not asks_for_causes(plain):
        return contested(plain)
    alone = bool(named) or not sought.sticks
    causes = find_causes(ready, sought, named=named) if alone else causes_beside_law(ready, sought)
    if not causes:
        if failed is not None:
            raise failed
        return contested(plain)
    terms = terms_of(ready, [cause.name for cause in causes])
    found = contested(fitted(replace(options, disturbances=terms), share(0.5, 1.0), WIDER), WIDER)
    return replace(found, causes=causes, plain=plain.parameters, structure=(*found.structure, *_assumed(causes)))


def _assumed(causes: Sequence[Cause]) -> list[str]:
    return [f"{cause.words[0].lower()}{cause.words[1:]}: estimated" for cause in causes]


def asks_for_causes(plain: FrictionFit) -> bool:
    """Whether the residuals of a fit of one disc are not those of the noise alone."""
    return len(plain.contacts) == 1 and plain.whiteness is not None and plain.whiteness.more_than_noise
