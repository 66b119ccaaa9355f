"""Speeds as instruments show them from an encoder during a test: coarse, or late, and no ground for a law."""

import numpy as np

from rig_io.logs.log import RigLog
from rig_io.sensors import edges


def velocity_by_count(log: RigLog, window: float = 0.010) -> np.ndarray:
    """Speed (n_samples,) in rad/s from the counts of the last ``window`` seconds; NaN in the first window."""
    count, samples = log.column("encoder_count"), round(window / float(np.median(np.diff(log.time))))
    speed = np.full(len(count), np.nan)
    passed = log.calibration.need("encoder").pitch * (count[samples:] - count[:-samples])
    speed[samples:] = passed / (log.time[samples:] - log.time[:-samples])
    return speed


def velocity_real_time_period(log: RigLog) -> np.ndarray:
    """Speed (n_samples,) in rad/s: pitch over the last interval, with the sign of its last edge, held; 0 before it."""
    measured = edges(log)
    passed = measured.direction[1:] * log.calibration.need("encoder").pitch / np.diff(measured.time)
    return np.concatenate([[0.0, 0.0], passed])[np.searchsorted(measured.time, log.time, side="right")]
