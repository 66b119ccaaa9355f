"""The estimators by name. A new one is a file with ``ESTIMATOR`` and a line here."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from fmu_models.errors import StickslipError, nearest
from identification.conclusion import Estimator, Options, conclude
from identification.laws import LAWS
from identification.pooling import Pool, pool
from identification.result import FrictionFit
from rig_io.log import RigLog

ESTIMATORS = {
    "shooting": "identification.shooting",
    "weak-form": "identification.weak_form",
    "savitzky-golay": "identification.inverse_dynamics",
}
DEFAULT = "shooting"
DEFAULT_OPTIONS = Options()


def estimator_named(name: str) -> Estimator:
    """An estimator.

    Raises:
        StickslipError: there is none of this name.
    """
    if name not in ESTIMATORS:
        raise StickslipError(f"There is no estimator '{name}'.{nearest(name, ESTIMATORS)}")
    return import_module(ESTIMATORS[name]).ESTIMATOR


def fit_friction(
    logs: Sequence[RigLog] | Pool,
    *,
    estimator: str = DEFAULT,
    law: str = "Conti",
    bootstrap: int = 0,
    seed: int = 0,
    options: Options = DEFAULT_OPTIONS,
) -> FrictionFit:
    """Friction law from stick-slip logs of one rig, all pooled.

    logs: stick-slip logs of one disc in contact; a free-decay log among them gives k/J and c/J; or a
    `identification.pooling.pool` of them. bootstrap: draws for the standard deviations (0: jackknife over slip
    segments).

    Raises:
        StickslipError: unknown estimator or law, a negative number of draws, or logs that cannot be pooled or fitted.
    """
    chosen = estimator_named(estimator)
    if law not in LAWS:
        raise StickslipError(f"There is no friction law '{law}'.{nearest(law, LAWS)}")
    if bootstrap < 0 or 0 < bootstrap < 20:
        raise StickslipError(f"A bootstrap of {bootstrap} draws gives no standard deviation; take 200, or 0 for none.")
    ready = logs if isinstance(logs, Pool) else pool(logs)
    made = chosen.estimate(ready, LAWS[law], options)
    return conclude(
        ready,
        made.estimator,
        made.problem,
        made.solution,
        LAWS[law],
        bootstrap=bootstrap,
        seed=seed,
        warnings=made.warnings,
    )
