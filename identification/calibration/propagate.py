"""What the uncertainty of a calibration, or of a fitted law, makes of numbers that are computed from its parameters:
exponents, multipliers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from identification.calibration.result import LEVEL
from identification.inference.defaults import SEED
from identification.inference.uncertainty import Joint

TRIES = 100  # draws for each that lies within the bounds of the parameters


@dataclass(frozen=True, eq=False)
class Propagated(Shown):
    """value: at the calibrated parameters, a number or (n,); interval: (2,) or (2, n), quantiles of the ``samples``
    (draws,) or (draws, n); failed: draws for which the number could not be computed."""

    value: np.ndarray
    interval: np.ndarray
    samples: np.ndarray = field(repr=False)
    failed: int = 0


class Estimated(Protocol):
    """A Calibration, or a FrictionFit, whose constants of the rig come after the parameters of its law."""

    @property
    def joint(self) -> Joint:
        """What was estimated, and its covariance. StickslipError: the logs do not tell all of it."""
        ...


def propagate(
    found: Estimated,
    quantity: Callable[[Mapping[str, float]], float | np.ndarray],
    *,
    draws: int = 100,
    level: float = LEVEL,
    seed: int = SEED,
) -> Propagated:
    """A number computed from calibrated or fitted parameters, with an interval that carries their covariance.

    Args:
        found: of a law its covariance is that of noise, constants of the rig and, where asked, choice of the law.
        quantity: of the parameters by name (and of a fit, the constants of the rig), a number or (n,) numbers, such as
            ``lambda p: lyapunov(Strobe(model, forcing="omega", parameters=p)).per_time``.
        draws: sets of parameters from a normal distribution with the covariance, within their bounds; the interval of a
            ``level`` lies between quantiles, with an error of about 1/sqrt(draws) of its width.

    Raises:
        StickslipError: fewer than 20 draws, parameters that the logs do not tell, bounds that few draws meet, or a
            number that cannot be computed at the values found, or for more than half of the draws.
    """
    if draws < 20 or not 0 < level < 1:
        raise StickslipError(f"{draws} draws at a level of {level:g}: take at least 20, and a level between 0 and 1.")
    names, middle, low, high, covariance = found.joint
    random = np.random.default_rng(seed)
    sets = random.multivariate_normal(middle, covariance, draws * TRIES, method="eigh")
    sets = np.where(np.diag(covariance) > 0.0, sets, middle)
    sets = sets[np.all((sets >= low) & (sets <= high), axis=1)][:draws]
    if len(sets) < draws:
        raise StickslipError(
            "Nearly all sets of parameters leave their bounds: an estimate at a bound has no interval."
        )
    value = np.asarray(quantity(dict(zip(names, map(float, middle), strict=True))), dtype=float)
    samples = []
    for values in sets:
        try:
            samples.append(np.asarray(quantity(dict(zip(names, map(float, values), strict=True))), dtype=float))
        except StickslipError:
            continue
    if len(samples) < draws / 2:
        raise StickslipError(
            f"For {draws - len(samples)} of {draws} sets of parameters the number could not be computed: the motion is "
            "lost within the uncertainty of the parameters."
        )
    ends = np.quantile(samples, ((1 - level) / 2, (1 + level) / 2), axis=0)
    return Propagated(value, ends, np.array(samples), draws - len(samples))
