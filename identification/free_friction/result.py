"""Friction over slip speed as slips tell it, without a law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fmu_models.base.columns import frame_of
from fmu_models.base.digits import value_with_sd
from fmu_models.base.shown import Shown
from identification.free_friction.basis import SpeedBasis

if TYPE_CHECKING:
    import pandas


NOISE = 1.1  # misfit up to which residuals are noise: what is known of that of a sensor


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

    COLUMNS: ClassVar = ("[speed]=speed", "coefficient", "form_deviation", "deviation")

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
        of the constants of the rig.

        Args:
            law: friction coefficient by slip speed (n,), m/s.
        """
        speed, curve, deviation = self.speed, self.coefficient, self.form_deviation
        seen = speed >= self.least
        weight = np.where(seen, deviation**-2, 0.0)
        values = law(speed)
        values = values * float(weight @ (values * curve)) / float(weight @ values**2)
        outside = seen & (np.abs(values - curve) > self.simultaneous * deviation)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], outside.astype(int), [0]]))).reshape(-1, 2)
        off = values / curve - 1
        return [
            Departure(float(speed[a]), float(speed[b - 1]), float(off[a + np.argmax(np.abs(off[a:b]))]))
            for a, b in edges
        ]

    def words(self, law: Callable[[np.ndarray], np.ndarray]) -> str:
        """What is said of the curve, and of a law beside it."""
        shown = np.geomspace(max(self.least, 1e-6), self.greatest, 4)
        deviation = np.interp(shown, self.speed, self.deviation)
        values = ", ".join(
            f"{value_with_sd(float(value), float(sd))} at {speed:.3g} m/s"
            for speed, value, sd in zip(shown, self.at(shown), deviation, strict=True)
        )
        departures = " and ".join(map(str, self.departures(law)))
        text = f"Friction free of any law: {values}. "
        if self.releases:
            rest = value_with_sd(self.values[0], float(self.deviation[0]))
            text += f"At rest it is {rest}, by the release of {self.releases} sticks. "
        text += f"The law departs from its form: {departures}." if departures else "The law keeps to its form."
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
