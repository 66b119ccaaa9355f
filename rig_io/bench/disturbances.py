"""What a real bench adds to the emulated one, each disturbance with its size.

    friction  lambda = -load(t) (1 + g(theta)) N mu(|v|) sgn(v)
    load(t)   = (1 + once sin(phi + a) + twice sin(2 phi + b)) (1 + per_log n + within (t/T - 1/2))
    g(theta)  = size (x + x^2/2 - 3 x^3/2)/(largest for |x| <= 1),   x = (theta - ANGLE)/REACH
    laser     shows R sin(theta) + offset_n + drift_n(t);   both angle sensors show theta + zero

phi angle of the drive, n number of the log, t and T its time and duration. Drifts are sums of three slow sines, of the
size stated where they are largest. The counters of the drives run on from log to log.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.base.unit_names import conversion_factor

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu

ANGLE, REACH = 0.1, 0.1  # rad: where the friction is as declared, and how far from there the disc of the rig swings
PERIODS = (15.0, 80.0)  # s, of the sines of a drift
SINES = 3
LARGEST = 0.5  # of any relative disturbance
UNITS: Mapping[str, str] = {
    **dict.fromkeys(("once", "twice", "angle", "per_log", "within"), "1"),
    **{"offset": "m", "drift": "m", "zero": "rad"},
}
_SIZE = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)")
_SHAPE = np.array([0.0, 1.0, 0.5, -1.5])


@dataclass(frozen=True)
class Disturbances(Shown):
    """Sizes; those of friction are relative. once, twice: amplitudes of the normal force per turn of the drive; angle:
    greatest change of the friction with the disc's angle; per_log, within: wear from log to log and from begin to end
    of a log; offset, drift: m, standard deviation over logs and greatest value; zero: rad."""

    once: float = 0.0
    twice: float = 0.0
    angle: float = 0.0
    per_log: float = 0.0
    within: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    zero: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in UNITS.items():
            if unit == "1" and not abs(getattr(self, name)) <= LARGEST:
                raise StickslipError(
                    f"A disturbance '{name}' of {getattr(self, name):g} is out of range: it is a share of the "
                    f"friction, up to {LARGEST:g}."
                )

    @staticmethod
    def said(texts: Sequence[str]) -> Disturbances:
        """Disturbances from texts such as "once=5%", "drift=0.3mm", "zero=2mrad"; a number without unit is SI.

        Raises:
            StickslipError: no disturbance of that name, no size, a unit that does not fit, a name twice, out of range.
        """
        sizes: dict[str, float] = {}
        for text in texts:
            name, _, size = (side.strip() for side in text.partition("="))
            refuse_unknown(name, UNITS, f"There is no disturbance '{name}'.")
            if name in sizes:
                raise StickslipError(f"The disturbance '{name}' is given twice. Give it once.")
            match = _SIZE.fullmatch(size)
            if match is None:
                raise StickslipError(f"A disturbance is given as NAME=SIZE, for example once=5%; found '{text}'.")
            try:
                factor = conversion_factor(match[2], UNITS[name]) if match[2] else 1.0
            except ValueError as error:
                unit = UNITS[name].replace("1", "%")
                raise StickslipError(
                    f"The disturbance '{name}' has no size '{size}' ({error}). Its unit is {unit}."
                ) from error
            sizes[name] = float(match[1]) * factor
        return Disturbances(**sizes)

    def load(
        self, time: np.ndarray, angle: np.ndarray, duration: float, number: int, specimen: np.random.Generator
    ) -> np.ndarray:
        """Factor (n,) of the normal force at times (n,) in s of the log and angles (n,) in rad of the drive; specimen
        draws the phases."""
        first, second = 2 * np.pi * specimen.random(2)
        turning = 1 + self.once * np.sin(angle + first) + self.twice * np.sin(2 * angle + second)
        return turning * (1 + self.per_log * number + self.within * (time / duration - 0.5))

    def by_angle(self, angle: np.ndarray) -> np.ndarray:
        """g at angles (n,) in rad."""
        return np.polynomial.polynomial.polyval((angle - ANGLE) / REACH, self._coefficients)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the disturbed oscillator."""
        return {f"g{power}": float(value) for power, value in enumerate(self._coefficients) if power}

    @property
    def _coefficients(self) -> np.ndarray:
        x = np.linspace(-1, 1, 401)
        return self.angle * _SHAPE / np.max(np.abs(np.polynomial.polynomial.polyval(x, _SHAPE)))

    def displacement(self, time: np.ndarray, noise: np.random.Generator) -> np.ndarray:
        """What the laser shows too much (n,), m, at times (n,) in s of a log."""
        offset = self.offset * noise.standard_normal()
        periods = np.exp(noise.uniform(np.log(PERIODS[0]), np.log(PERIODS[1]), SINES))
        phases = 2 * np.pi * noise.random(SINES)
        curve = np.sum(np.sin(2 * np.pi * time[:, None] / periods + phases), axis=1)
        curve = curve - curve.mean()
        return offset + self.drift * curve / np.max(np.abs(curve))


@cache
def disturbed_oscillator(law: str) -> Fmu:
    """The rig with disc 0, under a law, whose friction follows its input ``load0`` and the angle."""
    from fmu_models.codegen.package import built_of, variant
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.language.contacts import Friction
    from fmu_models.language.laws.conti import Conti
    from fmu_models.language.quantities import Input, Parameter
    from fmu_models.lowering.lower import lower

    rig = variant("disc_rig", ["disc0"])
    (contact,), (theta,) = rig.contacts, rig.coordinates
    assert isinstance(contact, Friction) and isinstance(contact.law, Conti)
    load = Input("load0", 1.0, "1", "factor of the normal force")
    g = [Parameter(f"g{power}", 0.0, "1", f"change of friction with power {power} of the angle") for power in (1, 2, 3)]
    x = (theta - ANGLE) / REACH
    friction = replace(contact.law, N=contact.law.N * load * (1 + x * (g[0] + x * (g[1] + x * g[2]))))
    disturbed = replace(rig.with_law(disc0=friction), name="disturbed_rig")
    return Fmu.open(built_of(lower(variant(disturbed, laws={"disc0": law}))))
