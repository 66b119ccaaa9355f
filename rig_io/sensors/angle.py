"""The disc's angle from whatever a log holds."""

import numpy as np

from rig_io.logs.log import RigLog
from rig_io.sensors.encoder import encoder_edges
from rig_io.sensors.laser import laser_angle


def disc_angle(log: RigLog) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) in s and angles (m,) in rad: the column ``angle``, else the laser, else the encoder's edges.

    The laser's latency is taken off the times; the encoder's angle is right but for a common shift within half a pitch.

    Raises:
        StickslipError: calibration or R is missing.
    """
    if log.has("angle"):
        return log.time, log.column("angle")
    if log.has("laser"):
        return log.time - log.calibration.need("laser").latency, laser_angle(log)
    return encoder_edges(log)
