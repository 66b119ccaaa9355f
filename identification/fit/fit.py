"""From pooled logs to the fit of a friction law, by an estimator that is chosen by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from identification.estimators import ESTIMATORS
from identification.estimators.base import Estimator, Options
from identification.estimators.disturbances import terms_of
from identification.fit.causes import WIDER, find_causes, terms_found
from identification.fit.conclude import conclude
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
    residuals ask for it (one driving disc); or "none".

    Raises:
        StickslipError: unknown estimator or law, or logs that cannot be pooled or fitted.
    """
    if parameters is not None:
        options = replace(options, given=given(parameters))
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
        made = by.estimate(ready, sought, options)
        solved = (ready, made.estimator, made.problem, made.solution, made.law)
        try:
            return conclude(*solved, inference, progress=progress, warnings=made.warnings, wider=wider)
        except KeyboardInterrupt:
            said = (
                f"Interrupted: {inference.covariance} and intervals were not finished; the deviations are the "
                "jackknife's."
            )
            return conclude(*solved, DEFAULT_INFERENCE, warnings=(*made.warnings, said), wider=wider)

    def share(begin: float, end: float) -> Callable[[float], None] | None:
        told = progress
        return None if told is None else lambda done: told(begin + (end - begin) * done)

    if disturbances == NONE:
        return fitted(options, progress)
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
        return plain
    causes = find_causes(ready, sought, named=named)
    if not causes:
        if failed is not None:
            raise failed
        return plain
    terms = terms_found(ready, causes)
    found = fitted(replace(options, disturbances=terms), share(0.5, 1.0), WIDER)
    return replace(found, causes=causes, plain=plain.parameters, structure=(*found.structure, *_assumed(causes)))


def _assumed(causes: Sequence[Cause]) -> list[str]:
    return [f"{cause.words[0].lower()}{cause.words[1:]}: estimated" for cause in causes]


def asks_for_causes(plain: FrictionFit) -> bool:
    """Whether the residuals of a fit of one disc are not those of the noise alone."""
    white = plain.whiteness
    return len(plain.contacts) == 1 and white is not None and bool(white.coloured or white.beyond or white.repeated)
