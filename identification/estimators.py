"""The estimators by name. A new one is a file with ``ESTIMATOR`` and a line here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module

from fmu_models.errors import StickslipError, nearest
from identification.conclusion import Estimator, Options, conclude
from identification.inference import Inference
from identification.laws import LUGRE, find_law
from identification.pooling import Pool, pool
from identification.result import FrictionFit
from rig_io.log import RigLog

ESTIMATORS = {
    "shooting": "identification.shooting",
    "whole-cycle": "identification.whole_cycle",
    "lugre": "identification.lugre",
    "weak-form": "identification.weak_form",
    "savitzky-golay": "identification.inverse_dynamics",
}
DEFAULT = "shooting"
DEFAULT_OPTIONS = Options()
DEFAULT_INFERENCE = Inference()


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
    options: Options = DEFAULT_OPTIONS,
    inference: Inference = DEFAULT_INFERENCE,
    progress: Callable[[float], None] | None = None,
) -> FrictionFit:
    """Friction law from stick-slip logs of one rig, all pooled.

    logs: stick-slip logs of one disc in contact; a free-decay log among them gives k/J and c/J; or a
    `identification.pooling.pool` of them. inference: how its uncertainty is found, and ``progress`` the fraction of
    that work done.

    Raises:
        StickslipError: unknown estimator or law, or logs that cannot be pooled or fitted.
    """
    chosen = estimator_named(estimator)
    form = find_law(law)
    if form is LUGRE and estimator != "lugre":
        raise StickslipError(f"The law '{law}' is fitted by the estimator 'lugre': '{estimator}' sees no micro-slip.")
    ready = logs if isinstance(logs, Pool) else pool(logs)
    made = chosen.estimate(ready, form, options)
    return conclude(
        ready,
        made.estimator,
        made.problem,
        made.solution,
        made.law,
        inference,
        progress=progress,
        warnings=made.warnings,
    )
