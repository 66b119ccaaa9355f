"""The fitted model at the normal force and temperature that a log records."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.disturbances.temperature import TERM
from identification.fit.result import FrictionFit
from identification.fitted_model.model import FittedModel
from identification.measurement.motion import DiscMotion

SWAYS = 0.1  # of the mean of a normal force: a model that runs at the mean is no longer that of the log


class SwayedError(StickslipError):
    """No log of a family can be held against a model whose normal force is steady."""


def model_at(fit: FrictionFit, model: FittedModel, motion: DiscMotion) -> FittedModel:
    """The model at the mean normal force and temperature of a log, where it records them."""
    names = [f"N{contact[-1]}" for contact in motion.log.contacts]
    forces = {name: model.parameters[name] for name in names if name in model.parameters}
    if motion.loads is not None:
        means = dict(zip(names, np.mean(motion.loads, axis=1).tolist(), strict=True))
        forces = {name: means[name] for name in forces}
    rise = next((nuisance.value for nuisance in fit.nuisance if nuisance.name == TERM.name), 0.0)
    if rise and motion.log.has("temperature"):
        warmer = float(np.nanmean(motion.log.column("temperature"))) - fit.sensors["temperature"]
        forces = {name: force * (1 + rise * warmer) for name, force in forces.items()}
    return replace(model, parameters={**model.parameters, **forces})


def swayed(motion: DiscMotion) -> Iterator[str]:
    """What to say of a log whose normal force changes."""
    for force in () if motion.loads is None else motion.loads:
        if float(np.ptp(force)) > SWAYS * float(np.mean(force)):
            yield (
                f"The normal force of '{motion.log.name}' goes from {force.min():.3g} to {force.max():.3g} N, the "
                f"model runs at its mean, {np.mean(force):.4g} N: judge such a log by the residuals of its fit."
            )
