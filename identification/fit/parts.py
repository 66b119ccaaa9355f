"""What the result of a fit is made of."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fmu_models.base.shown import Shown

AT_LEAST = "at least "  # before an interval that lacks the uncertainty of a constant


@dataclass(frozen=True)
class FittedParameter(Shown):
    """One parameter. standard_deviation: from noise, colour of the residuals included; plain_deviation: as if they were
    white (for comparison); scale_deviation: from the rig's constants; law_deviation: from the choice of the law, None
    where other laws were not asked or have no such quantity; bounds of the search, None where there is none;
    ``at_bound``: it ended on one; bound: standard deviation of Cramer and Rao, None where the sensors' noise is not
    known.
    """

    name: str
    value: float
    unit: str
    standard_deviation: float
    plain_deviation: float
    scale_deviation: float
    minimum: float | None
    maximum: float | None
    at_bound: bool
    description: str = ""
    bound: float | None = None
    law_deviation: float | None = None

    @property
    def held(self) -> bool:
        """Whether it was held at its value rather than found: its bounds are one."""
        return self.minimum is not None and self.minimum == self.maximum

    @property
    def efficiency(self) -> float | None:
        """Variance of the Cramer-Rao bound over the stated one: 1 is the best that the sensors allow (a stated one
        below the bound is chance, and counts as 1); None where their noise is not known."""
        if self.bound is None or not self.standard_deviation > 0:
            return None
        return min((self.bound / self.standard_deviation) ** 2, 1.0)

    @property
    def total_deviation(self) -> float:
        """Noise, scale and law together, same unit."""
        return float(np.hypot(self.standard_deviation, self.given_deviation))

    @property
    def given_deviation(self) -> float:
        """Standard deviation from what is taken as given: the constants of the rig and the law."""
        return float(np.hypot(self.scale_deviation, self.law_deviation or 0.0))


@dataclass(frozen=True)
class Constant(Shown):
    """A constant that the fit took as given. sensitivity: d ln(parameter) / d ln(constant), by parameter (None where
    that is zero); stated: whether it is known how well. before: as it was stated, with its standard uncertainty (None:
    not stated), where it was adjusted to the logs."""

    name: str
    value: float
    unit: str
    standard_uncertainty: float
    source: str
    sensitivity: Mapping[str, float | None]
    stated: bool = True
    before: float | None = None
    before_uncertainty: float | None = None


@dataclass(frozen=True)
class StatedConstant(Shown):
    """A stated constant that contradicts the others. other: what it would have to be by them; deviations: by which it
    is off; together: readings that cannot be told apart by this; parameters: of the law, if this reading is right."""

    name: str
    value: float
    unit: str
    other: float
    deviations: float
    together: tuple[str, ...]
    parameters: Mapping[str, float]

    @property
    def sentence(self) -> str:
        """What is said of it."""
        law = ", ".join(f"{name} = {value:.4g}" for name, value in self.parameters.items())
        return f"with {self.name} as stated {law} (the others ask for {self.name} = {self.other:.5g} {self.unit})"


@dataclass(frozen=True)
class LogSummary:
    """What one log gave: mean drive speed rad/s of each disc in contact, number of slip segments used, least and
    greatest slip speed m/s, duration s."""

    name: str
    drive_speeds: tuple[float, ...]
    segments: int
    least_slip: float
    greatest_slip: float
    duration: float


@dataclass(frozen=True)
class SpeedBin:
    """Friction of one driving disc in one range of slip speeds: mean slip speed m/s, friction coefficient and its
    standard error, the fitted law there, number of values; the error is None where one slip segment gave all of them.
    Of two discs that touch together the modelled friction of the other is taken off."""

    slip: float
    coefficient: float
    standard_error: float | None
    fitted: float
    count: int
    contact: str = "disc0"


@dataclass(frozen=True)
class Cause(Shown):
    """A disturbance that was found. size: greatest change of friction that it makes in the logs, either way, relative,
    or greatest error of the sensor, in ``unit`` (rad, m); gain: by which BIC, or -2 ln of the likelihood without a law,
    falls with it, the others being there; chance: probability that this is chance; alike: other disturbances, or
    constants that are wrong, which these logs do not tell from it; told_by: what would."""

    name: str
    words: str
    size: float
    unit: str
    gain: float
    chance: float
    alike: tuple[str, ...] = ()
    told_by: str = ""

    @property
    def sentence(self) -> str:
        """What is said of it."""
        size = f"{100 * self.size:.2g} %" if self.unit == "1" else f"{1e3 * self.size:.2g} m{self.unit}"
        text = f"{' or '.join((self.name, *self.alike))}: {self.words}"
        text += f", ± {size} (BIC {self.gain:.3g} better with it)." if self.size else "."
        if self.alike:
            text += " These logs do not tell which"
            text += f"; this would: {self.told_by}." if self.told_by else "."
        return text


@dataclass(frozen=True)
class RivalLaw(Shown):
    """A law on the same evidence, that of the fit among them. weight: by BIC; lead: by which its BIC exceeds the least;
    values: what it makes of the parameters of the fit, those that mean the same in it; curve: friction coefficient at
    the speeds of the free curve, nothing where there is none."""

    law: str
    weight: float
    lead: float
    values: Mapping[str, float]
    curve: tuple[float, ...] = ()
