"""Friction over slip speed as slips tell it, without a law: as the law ``free`` has it (``language/laws/free.py``).

    mu(v) = sum_i mu_i b_i(v),    b_i = s_i - s_(i+1),    s_i = (y^4 - 1)/(y^4 + a_i),    y = 1 + v/V

with s_0 = 1 and s_9 = 0: the b_i are positive, and their sum is one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fmu_models.base.columns import frame_of
from fmu_models.base.digits import value_with_sd
from fmu_models.base.shown import Shown
from fmu_models.language.law_parameter import KNOT_SPACING, KNOTS_INSIDE, STEEPNESS
from rig_io.logs.log import stretches

if TYPE_CHECKING:
    import pandas

COEFFICIENTS = KNOTS_INSIDE + 2
POINTS = 61
BEND = 0.05  # standard deviation of second differences of coefficients, beforehand: level and slope are free
BENDS = np.diff(np.eye(COEFFICIENTS), 2, axis=0) / BEND  # rows of what is assumed of the coefficients beforehand
STEPS = np.exp(STEEPNESS * KNOT_SPACING * (np.arange(1, COEFFICIENTS) - 0.5))  # a_i
NOISE = 1.1  # misfit up to which residuals are noise: what is known of that of a sensor


@dataclass(frozen=True, eq=False)
class SpeedBasis:
    """Weights of the values mu_i over slip speed. greatest: v_end, m/s."""

    greatest: float

    @cached_property
    def scale(self) -> float:
        """V, m/s."""
        return self.greatest / np.expm1(KNOT_SPACING * KNOTS_INSIDE)

    @cached_property
    def grid(self) -> np.ndarray:
        """Slip speeds from rest to the greatest (POINTS,), m/s, even between knots."""
        return self.scale * np.expm1(np.linspace(0.0, KNOT_SPACING * KNOTS_INSIDE, POINTS))

    def deviation(self, covariance: np.ndarray) -> np.ndarray:
        """Standard deviation (POINTS,) of the curve on its grid, by the covariance of its coefficients."""
        weights = self.weights(self.grid)
        return np.sqrt(np.einsum("ij,jk,ik->i", weights, covariance, weights))

    def weights(self, speed: np.ndarray, derivative: int = 0) -> np.ndarray:
        """b_i (..., COEFFICIENTS) at slip speeds (...) in m/s, or derivatives by the speed (derivative 1)."""
        y = 1 + np.maximum(speed, 0.0) / self.scale
        power = (y**STEEPNESS)[..., None]
        if derivative == 0:
            return -np.diff((power - 1) / (power + STEPS), prepend=1.0, append=0.0)
        rate = STEEPNESS * y ** (STEEPNESS - 1) / self.scale * (speed >= 0)
        return -np.diff((1 + STEPS) / (power + STEPS) ** 2 * rate[..., None], prepend=0.0, append=0.0)

    def value(self, coefficients: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Friction coefficient at slip speeds (...), m/s: what an integrator asks for at each of its steps."""
        power = (1 + np.maximum(speed, 0.0) / self.scale) ** STEEPNESS
        return coefficients[0] + (power - 1) * (1 / (power[..., None] + STEPS) @ np.diff(coefficients))


@dataclass(frozen=True)
class Departure:
    """Where a law leaves the band of the curve: from and to, m/s, and its greatest distance there, relative."""

    low: float
    high: float
    share: float

    def __str__(self) -> str:
        return f"by {100 * self.share:+.2g} % from {self.low:.3g} to {self.high:.3g} m/s"


@dataclass(frozen=True)
class FreeFriction(Shown):
    """Friction coefficient over slip speed, of no law.

    Attributes:
        greatest: m/s, the greatest slip speed seen.
        values: 1, mu_0, mu_1 ... of the law `free` with ``greatest`` as its v_end.
        form_covariance: of these, with the constants of the rig as they are.
        covariance: of these, with what is known of the constants.
        simultaneous: deviations within which the whole curve lies, with a probability of 95 %.
        least: m/s, the least slip speed seen; the band opens below.
        unexplained: deviation of the friction coefficient, within slips, that no term explains.
        misfit: sum of squares over the count of samples, 1 where nothing but noise is left.
        signature: what goes with the torque that no term explains.
        shares: of its squares, for each of these.
        constants: of the rig with which this is the curve, SI units.
        releases: sticks whose release tells the curve below ``least``, as if breakaway did not age; 0: nothing does.
    """

    greatest: float
    values: tuple[float, ...]
    form_covariance: tuple[tuple[float, ...], ...]
    covariance: tuple[tuple[float, ...], ...]
    simultaneous: float
    least: float
    unexplained: float
    misfit: float
    signature: tuple[str, ...] = ()
    shares: tuple[float, ...] = ()
    constants: Mapping[str, float] = field(default_factory=dict)
    releases: int = 0

    COLUMNS: ClassVar[tuple[str, ...]] = ("[speed]=speed", "coefficient", "form_deviation", "deviation")

    @cached_property
    def basis(self) -> SpeedBasis:
        """Weights of the values over slip speed."""
        return SpeedBasis(self.greatest)

    @property
    def speed(self) -> np.ndarray:
        """Slip speeds (n,), m/s, from rest to the greatest seen."""
        return self.basis.grid

    @property
    def coefficient(self) -> np.ndarray:
        """Friction coefficient at these (n,)."""
        return self.at(self.speed)

    @property
    def form_deviation(self) -> np.ndarray:
        """Its standard deviation (n,), with the constants of the rig as they are."""
        return self.basis.deviation(np.array(self.form_covariance))

    @property
    def deviation(self) -> np.ndarray:
        """Its standard deviation (n,), with what is known of the constants."""
        return self.basis.deviation(np.array(self.covariance))

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each speed: coefficient and its deviations."""
        return frame_of(self)

    @property
    def explains(self) -> bool:
        """Whether the curve leaves nothing but noise of the slips."""
        return self.unexplained == 0.0 and self.misfit < NOISE

    def at(self, speed: np.ndarray) -> np.ndarray:
        """Friction coefficient at slip speeds (n,), m/s."""
        return self.basis.value(np.array(self.values), speed)

    def departures(self, law: Callable[[np.ndarray], np.ndarray]) -> list[Departure]:
        """Where the form of a law leaves the band of the whole curve. Its level may be off by one factor, which is that
        of the constants of the rig. law: friction coefficient by slip speed (n,), m/s."""
        speed, curve, deviation = self.speed, self.coefficient, self.form_deviation
        seen = speed >= self.least
        weight = np.where(seen, deviation**-2, 0.0)
        values = law(speed)
        values = values * float(weight @ (values * curve)) / float(weight @ values**2)
        outside = seen & (np.abs(values - curve) > self.simultaneous * deviation)
        off = values / curve - 1
        return [
            Departure(float(speed[a]), float(speed[b - 1]), float(off[a + np.argmax(np.abs(off[a:b]))]))
            for a, b in stretches(outside)
        ]

    def words(self, law: Callable[[np.ndarray], np.ndarray]) -> str:
        """What is said of the curve, and of a law beside it."""
        speeds = np.geomspace(max(self.least, 1e-6), self.greatest, 4)
        deviation = np.interp(speeds, self.speed, self.deviation)
        values = ", ".join(
            f"{value_with_sd(float(value), float(sd))} at {speed:.3g} m/s"
            for speed, value, sd in zip(speeds, self.at(speeds), deviation, strict=True)
        )
        departures = " and ".join(map(str, self.departures(law)))
        text = f"Friction free of any law: {values}. "
        if self.releases:
            at_rest = value_with_sd(self.values[0], float(self.deviation[0]))
            text += f"At rest it is {at_rest}, by the release of {self.releases} sticks. "
        if departures:
            text += f"The law departs from its form: {departures}."
        else:
            seen = self.speed >= self.least
            told = float(np.max((self.simultaneous * self.form_deviation / np.abs(self.coefficient))[seen]))
            text += f"The law keeps to its form as far as the slips tell it, within {100 * told:.2g} % at every speed."
        if self.unexplained:
            text += (
                f" In slips a torque acts that nothing in the model explains, of {self.unexplained:.1g} in units of "
                "friction; the deviations allow for it as far as it varies from slip to slip."
            )
            signs = [
                f"{100 * share:.0f} % of it {words}" for words, share in zip(self.signature, self.shares, strict=True)
            ]
            text += f" Of its squares {', '.join(signs)}." if signs else ""
        return text
