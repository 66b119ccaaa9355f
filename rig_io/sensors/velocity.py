"""Speed from an encoder, three ways.

count:         (count(t) - count(t - window)) pitch / window, on the ticks; coarse at the rig's speeds
real time:     pitch over the last interval between edges, held until the next edge, on the ticks; late by more than
               half an interval, which ruins any friction law drawn from it (what a data-acquisition system shows)
mid-interval:  pitch over each interval between edges, dated at its middle; offline, exact to second order
"""

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import RigLog
from rig_io.sensors.encoder import Edges, edges

WINDOW = 0.010  # s


def velocity_by_count(log: RigLog, instrument: str = "encoder", window: float = WINDOW) -> np.ndarray:
    """Speed (n_samples,) in rad/s from the counts of the last ``window`` seconds; NaN in the first window.

    Raises:
        StickslipError: no such encoder in the log, or the window is shorter than a sample or longer than the log.
    """
    count = log.column(f"{instrument}_count")
    pitch = log.calibration.need(instrument).pitch
    samples = round(window / float(np.median(np.diff(log.time))))
    if not 1 <= samples < len(count):
        raise StickslipError(f"A window of {window:g} s holds {samples} samples of log '{log.name}'. Choose another.")
    speed = np.full(len(count), np.nan)
    speed[samples:] = pitch * (count[samples:] - count[:-samples]) / (log.time[samples:] - log.time[:-samples])
    return speed


def velocity_real_time_period(log: RigLog, instrument: str = "encoder") -> np.ndarray:
    """Speed (n_samples,) in rad/s: pitch over the last interval, with the sign of its last edge, held; 0 before it.

    Raises:
        StickslipError: no such encoder in the log.
    """
    measured = edges(log, instrument)
    pitch = log.calibration.need(instrument).pitch
    passed = measured.direction[1:] * pitch / np.diff(measured.time)
    return np.concatenate([[0.0, 0.0], passed])[np.searchsorted(measured.time, log.time, side="right")]


def velocity_mid_interval(log: RigLog, instrument: str = "encoder") -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) in s and speeds (m,) in rad/s at the middle of each interval between edges passed in one direction.

    Raises:
        StickslipError: no such encoder in the log.
    """
    measured = edges(log, instrument)
    same = _joined(measured)
    time, angle = measured.time, measured.angle
    return 0.5 * (time[1:] + time[:-1])[same], (np.diff(angle)[same]) / np.diff(time)[same]


def _joined(measured: Edges) -> np.ndarray:
    """Which intervals (m - 1,) between successive edges hold no reversal."""
    return (
        (measured.direction[1:] == measured.direction[:-1])
        & (measured.run[1:] == measured.run[:-1])
        & (np.diff(measured.time) > 0)
    )


def drive_speed(log: RigLog, disc: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) in s and speeds (m,) in rad/s of a driving disc: its column of speed, else its encoder, mid-interval.

    Raises:
        StickslipError: the log holds neither.
    """
    name = f"drive{disc}"
    if log.has(f"{name}_speed"):
        return log.time, log.column(f"{name}_speed")
    if not log.has(f"{name}_count"):
        raise StickslipError(
            f"Log '{log.name}' does not say how disc {disc} turned: it needs '{name}_count' and '{name}_edge_time', or "
            f"'{name}_speed' [rad/s], or a nominal speed: stickslip describe FILES --set 'w:FILE=VALUE ± UNCERTAINTY "
            "rad/s'."
        )
    return velocity_mid_interval(log, name)
