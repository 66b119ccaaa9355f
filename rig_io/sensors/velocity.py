"""Speed from an encoder: pitch over each interval between edges, dated at its middle; exact to second order."""

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import RigLog
from rig_io.sensors.encoder import Edges, edges


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
