"""Load cell of a driving disc: normal force with an error of its gain, and noise."""

from dataclasses import dataclass

import numpy as np

from rig_io.logs.log import LoadCalibration


@dataclass(frozen=True)
class LoadCell:
    """A load cell to be emulated. gain_error: relative standard deviation over specimens, stated but not known; noise:
    N rms."""

    gain_error: float = 0.005
    noise: float = 0.01

    @property
    def calibration(self) -> LoadCalibration:
        """The calibration as the user knows it."""
        return LoadCalibration(self.gain_error)

    def read(self, force: np.ndarray, specimen: np.random.Generator, noise: np.random.Generator) -> np.ndarray:
        """Readings (n,) of forces (n,), N; specimen draws the gain error."""
        gain = 1 + self.gain_error * float(specimen.standard_normal())
        return np.round(gain * force + self.noise * noise.standard_normal(len(force)), 6)
