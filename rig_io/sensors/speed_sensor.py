"""Velocity sensor of the disc: a tachometer on its shaft (rad/s), or a vibrometer on its border (m/s).

Shown is (1 + gain_error) speed(t - latency) + offset + noise; of the border the speed of R sin(angle).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from rig_io.sensors.motion import Motion


@dataclass(frozen=True)
class SpeedSensor:
    """A velocity sensor to be emulated, in rad/s or m/s. gain_error and offset: standard deviations over specimens
    (relative; of the unit), unknown to the user; noise: rms; latency: s."""

    kind: Literal["tachometer", "vibrometer"] = "tachometer"
    gain_error: float = 0.005
    offset: float = 0.002
    noise: float = 0.01
    latency: float = 1e-3

    def read(
        self,
        motion: Motion,
        ticks: np.ndarray,
        radius: float,
        specimen: np.random.Generator,
        noise: np.random.Generator,
    ) -> np.ndarray:
        """Readings (n,) at the ticks (n,). radius: m; specimen draws gain error and offset, noise the noise."""
        gain_error, offset = specimen.standard_normal(2) * [self.gain_error, self.offset]
        seen = ticks - self.latency
        reading = np.interp(seen, motion.time, motion.speed)
        if self.kind == "vibrometer":
            reading = radius * np.cos(motion.angle_at(seen)) * reading
        return np.round((1 + gain_error) * reading + offset + self.noise * noise.standard_normal(len(ticks)), 9)


SPEED_SENSORS = {
    "tachometer": SpeedSensor(),
    "vibrometer": SpeedSensor("vibrometer", gain_error=0.005, offset=1e-4, noise=2e-4, latency=2e-4),
}


def speed_sensor(kind: str) -> SpeedSensor:
    """A usual one by its kind. StickslipError: no such kind."""
    if kind not in SPEED_SENSORS:
        listing = " and ".join(f"'{name}'" for name in SPEED_SENSORS)
        raise StickslipError(f"There is no velocity sensor '{kind}': {listing} are.{nearest(kind, SPEED_SENSORS)}")
    return SPEED_SENSORS[kind]
