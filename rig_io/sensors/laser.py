"""Laser telemeter of the disc: d as its beam says, seen late, with gain error, noise, limits and resolution.

laser [V] = zero + rounded(clip((1 + gain_error) d(angle(t - latency)) + noise)) / gain
"""

from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import LaserCalibration, RigLog, stretches
from rig_io.sensors.motion import Motion

LEAST_LEVELS = 20  # different readings: with fewer the end of the range cannot be told from a rest
PILED = 5.0  # times as many readings at the end of the range as at the next value
STRAY = 0.01  # of the samples may be stray readings
RUN = 8  # samples in a row at the end of the range


@dataclass(frozen=True)
class Laser:
    """A laser telemeter to be emulated; lengths in m.

    noise: rms; resolution: step of the reading; gain_error: standard deviation over specimens, unknown to the user;
    latency: s; range: largest displacement either way; gain: m/V; zero: V at no displacement; beam, tilt: as in
    `LaserCalibration`.
    """

    noise: float = 20e-6
    resolution: float = 10e-6
    gain_error: float = 0.002
    latency: float = 0.0
    range: float = 0.05
    gain: float = 0.01
    zero: float = 5.0
    beam: str = "sine"
    tilt: float = 0.0

    @property
    def calibration(self) -> LaserCalibration:
        """The calibration as the user knows it."""
        reach = self.range / abs(self.gain)
        ends = self.zero - reach, self.zero + reach
        known = LaserCalibration(self.gain, self.zero, self.latency, self.noise, *ends)
        return replace(known, beam=self.beam, tilt=self.tilt)

    def read(
        self,
        motion: Motion,
        ticks: np.ndarray,
        radius: float,
        specimen: np.random.Generator,
        noise: np.random.Generator,
    ) -> np.ndarray:
        """Volts (n,) at the ticks (n,). radius: m; specimen draws the gain error, noise the noise."""
        gain_error = self.gain_error * float(specimen.standard_normal())
        shown = self.calibration.shown(motion.angle_at(ticks - self.latency))
        displacement = (1.0 + gain_error) * radius * shown
        displacement = np.clip(displacement + self.noise * noise.standard_normal(len(ticks)), -self.range, self.range)
        if self.resolution > 0:
            displacement = np.round(displacement / self.resolution) * self.resolution
        return np.round(self.zero + displacement / self.gain, 9)


def laser_displacement(log: RigLog) -> np.ndarray:
    """Displacement (n_samples,) that it shows, m, gain*(laser - zero). StickslipError: no laser in the log, or
    no calibration for it."""
    calibration: LaserCalibration = log.calibration.need("laser")
    return calibration.gain * (log.column("laser") - calibration.zero)


def laser_clipped(log: RigLog) -> np.ndarray:
    """Where (n_samples,) the laser stands at an end of its range, stated or shown by the readings.

    Errors as in `laser_displacement`.
    """
    calibration: LaserCalibration = log.calibration.need("laser")
    volts = log.column("laser")
    slack = 1e-9 * max(1.0, abs(calibration.zero))
    return (volts <= calibration.lowest + slack) | (volts >= calibration.highest - slack) | saturated(volts)


def saturated(volts: np.ndarray) -> np.ndarray:
    """Where (n,) readings stand at their greatest or least value because the instrument shows no more.

    A motion that turns back spends 2.4 times as long on the outermost step of the reading as on the next; a saturated
    reading stays `PILED` times as long and more, in runs. Noise at the end would be seen as motion.
    """
    clipped = np.zeros(len(volts), dtype=bool)
    levels = np.unique(volts[np.isfinite(volts)])
    if len(levels) < LEAST_LEVELS:
        return clipped
    for extreme, following in ((levels[-1], levels[-2]), (levels[0], levels[1])):
        at_extreme = volts == extreme
        longest = int(np.ptp(stretches(at_extreme), axis=1).max())
        if longest >= RUN and np.count_nonzero(at_extreme) >= PILED * np.count_nonzero(volts == following):
            clipped |= at_extreme
    return clipped


def laser_angle(log: RigLog) -> np.ndarray:
    """Angle (n_samples,) in rad of the instants ``log.time - latency``; NaN for a reading that no angle gives.
    StickslipError: as in `laser_displacement`; R is not given; there are more of these than stray readings."""
    shown = laser_displacement(log) / log.rig.value("R")
    angle = log.calibration.need("laser").angle(shown)
    beyond = np.flatnonzero(np.isnan(angle) & np.isfinite(shown))
    if beyond.size > STRAY * len(angle):
        raise StickslipError(
            f"Log '{log.name}': the laser's displacement exceeds the radius R = {log.rig.value('R'):g} m in "
            f"{beyond.size} samples, first at {log.time[beyond[0]]:g} s. Check gain (m/V), zero (V) and R, and whether "
            "the readings are volts (state 'mV' as their unit if they are millivolts)."
        )
    return angle
