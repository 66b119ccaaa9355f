"""Estimators of friction: one file each, with the estimator as ``ESTIMATOR``; what several share is in files beside."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.registry import Registry

if TYPE_CHECKING:
    from identification.estimators.base import Estimator

ESTIMATORS: Registry[Estimator] = Registry(
    kind="estimator",
    package=__name__,
    attribute="ESTIMATOR",
    group="stickslip.estimators",
    types=("identification.estimators.base.Estimator",),
    separator="-",
)
