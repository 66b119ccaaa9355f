"""The estimators by name. A new one is a file with ``fit`` and a line here."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from fmu_models.errors import StickslipError, nearest
from identification.laws import find_law
from identification.pooling import Pool
from identification.result import FrictionFit
from rig_io.log import RigLog

ESTIMATORS = {"weak-form": "identification.weak_form", "savitzky-golay": "identification.inverse_dynamics"}
DEFAULT = "weak-form"


def fit_friction(
    logs: Sequence[RigLog] | Pool,
    *,
    estimator: str = DEFAULT,
    law: str = "Conti",
    bootstrap: int = 0,
    seed: int = 0,
) -> FrictionFit:
    """Friction law from stick-slip logs of one rig, all pooled.

    logs: stick-slip logs of one disc in contact; a free-decay log among them gives k/J and c/J; or a
    `identification.pooling.pool` of them. bootstrap: draws for the standard deviations (0: jackknife over slip
    segments).

    Raises:
        StickslipError: unknown estimator or law, a negative number of draws, or logs that cannot be pooled or fitted.
    """
    if estimator not in ESTIMATORS:
        raise StickslipError(f"There is no estimator '{estimator}'.{nearest(estimator, ESTIMATORS)}")
    if bootstrap < 0 or 0 < bootstrap < 20:
        raise StickslipError(f"A bootstrap of {bootstrap} draws gives no standard deviation; take 200, or 0 for none.")
    return import_module(ESTIMATORS[estimator]).fit(logs, law=find_law(law), bootstrap=bootstrap, seed=seed)
