"""From pooled logs to the fit of a friction law, by an estimator that is chosen by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from identification.estimators import ESTIMATORS
from identification.estimators.base import Options
from identification.fit.conclude import conclude
from identification.fit.result import FrictionFit
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


def fit_friction(
    logs: Sequence[RigLog] | Pool,
    *,
    estimator: str = DEFAULT,
    law: str = "Conti",
    options: Options = DEFAULT_OPTIONS,
    parameters: Parameters | None = None,
    inference: Inference = DEFAULT_INFERENCE,
    progress: Callable[[float], None] | None = None,
) -> FrictionFit:
    """Friction law from stick-slip logs of one rig, all pooled.

    logs: stick-slip logs of one driving disc or two; a free-decay log among them gives k/J and c/J; or a
    `measurement.pooling.pool` of them. law: as `find_law` takes it. parameters: first values, bounds and held
    unknowns, by name (of the law, of the nuisance parameters, ``gain`` and ``delay`` of the laser; k/J is called
    k_per_J). An interrupt (Ctrl-C) once there is a solution ends the search for its uncertainty, and the fit says so.
    inference: how its uncertainty is found, and ``progress`` the fraction of that work done.

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
    made = chosen.estimate(ready, sought, options)
    solved = (ready, made.estimator, made.problem, made.solution, made.law)
    try:
        return conclude(*solved, inference, progress=progress, warnings=made.warnings)
    except KeyboardInterrupt:
        said = (
            f"Interrupted: {inference.covariance} and intervals were not finished; the deviations are the jackknife's."
        )
        return conclude(*solved, DEFAULT_INFERENCE, warnings=(*made.warnings, said))
