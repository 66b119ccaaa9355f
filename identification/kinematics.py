"""From raw logs to one angle and one drive speed on an even clock: what every estimator starts from.

The laser gives the shape of the motion (absolute, dense, noisy), the encoder its scale and its clock. At the edges of
the encoder, which are stamped to a microsecond and lie at known distances,
    angle_edge + offset = laser(t_edge) + gain tan(laser(t_edge)) + delay laser'(t_edge)
is solved over all logs at once: one gain and one delay for the instrument, an offset for each log. The misplaced lines
of the encoder are the noise; being fixed, each line is one cluster. Left uncorrected, a gain error of 0.2 % passes to
the friction coefficients one to one, and 5 ms of delay move p by 25 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fmu_models.errors import StickslipError
from identification.uncertainty import clustered_covariance
from rig_io.log import RigLog
from rig_io.sensors import drive_speed, edges, laser_angle, laser_clipped

SMOOTHING = (
    0.045  # of the natural period: the window of the smoothing that serves only to find edges, gains and segments
)
DRIVE_EDGES = (6, 9, 13, 19, 28, 42, 64)  # of the drive's encoder between knots of its speed, to be chosen from
GAIN_SUSPECT = 0.02  # a correction of the laser's gain beyond this is a wrong calibration, not a tolerance
LEAST_LINES = 5  # of the encoder, passed: fewer cannot tell gain from line errors
UNEVEN = 0.02  # of the sample interval: jitter above this is refused


@dataclass(frozen=True, eq=False)
class SensorFit:
    """How laser and encoder agree.

    gain: relative correction of the laser; delay: s, by which the laser lags behind its stated latency; covariance
    (2, 2) of the two; rms: misplacement of the encoder's edges, rad; lines: number of different edges used (0: no
    encoder).
    """

    gain: float = 0.0
    delay: float = 0.0
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))
    rms: float = 0.0
    lines: int = 0


@dataclass(frozen=True, eq=False)
class DiscMotion:
    """Motion of the disc in one log, on an even clock.

    time: (n,) s; angle: (n,) rad, unsmoothed; drive: (n,) rad/s, speed of the driving disc; filled: (n,) samples that
    the sensor did not give and that are interpolated (no estimator uses a segment that holds one).
    """

    log: RigLog
    time: np.ndarray
    angle: np.ndarray
    drive: np.ndarray
    filled: np.ndarray

    @property
    def step(self) -> float:
        """Sample interval, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    def smoothed(self, window: float, order: int = 2, derivative: int = 0) -> np.ndarray:
        """Savitzky-Golay value or derivative (n,) of the angle. window: s."""
        return savitzky_golay(self.angle, self.step, window, order, derivative)

    def slip(self, r: float, R: float, window: float) -> np.ndarray:
        """Slip speed (n,) of the drive against the disc, r w - R th', in m/s, smoothed over ``window`` s."""
        return r * self.drive - R * self.smoothed(window, derivative=1)


def savitzky_golay(angle: np.ndarray, step: float, window: float, order: int, derivative: int) -> np.ndarray:
    """Local polynomial value or derivative (n,) on an even clock of ``step`` s; the window (s) becomes an odd count."""
    from scipy.signal import savgol_filter

    count = odd_count(window, step)
    return np.asarray(savgol_filter(angle, count, min(order, count - 1), deriv=derivative, delta=step))


def odd_count(window: float, step: float) -> int:
    """Odd number of samples nearest to a window, three or more."""
    return max(2 * round((window / step - 1) / 2) + 1, 3)


def angle_at_ticks(log: RigLog) -> tuple[np.ndarray, np.ndarray]:
    """Absolute angle of the disc: times (n,) in s, with the laser's stated latency taken off, and angles (n,) in rad.

    A column ``angle`` is taken as it is; else the laser's, NaN where it is clipped.

    Raises:
        StickslipError: neither is there (an encoder alone counts from an unknown angle).
    """
    if log.has("angle"):
        return log.time, log.column("angle")
    if not log.has("laser"):
        found = ", ".join(log.columns) or "no columns"
        raise StickslipError(
            f"Log '{log.name}' has no absolute angle (found: {found}). It needs 'laser' [V] with its calibration, or "
            "'angle' [rad]; an encoder alone counts from an unknown angle, which would shift every friction "
            "coefficient."
        )
    angle = laser_angle(log).copy()
    angle[laser_clipped(log)] = np.nan
    return log.time - log.calibration.need("laser").latency, angle


def disc_motion(log: RigLog, disc: int = 0) -> DiscMotion:
    """Motion of the disc in one log, sensors as calibrated in the log. disc: number of the driving disc in contact.

    Raises:
        StickslipError: no angle, no drive speed, too few samples, or an uneven clock.
    """
    time, angle = angle_at_ticks(log)
    if len(time) < 100:
        raise StickslipError(
            f"Log '{log.name}' has {len(time)} samples; a fit needs several cycles of 100 samples or more."
        )
    interval = np.diff(time)
    step = float(np.median(interval))
    uneven = np.flatnonzero(np.abs(interval - step) > UNEVEN * step)
    if uneven.size:
        raise StickslipError(
            f"Log '{log.name}' is sampled unevenly: the interval is {step:g} s, but {interval[uneven[0]]:g} s at "
            f"{time[uneven[0]]:g} s ({uneven.size} such). Split it at the gaps, or resample it on an even clock."
        )
    for name, column in log.columns.items():
        missing = (
            np.flatnonzero(~np.isfinite(column)) if name.startswith(("encoder", "drive")) else np.array([], dtype=int)
        )
        if missing.size:
            raise StickslipError(
                f"Log '{log.name}': column '{name}' holds no number in {missing.size} samples, first at "
                f"{log.time[missing[0]]:g} s. A count cannot be bridged: split the log there, or leave the column out."
            )
    filled = ~np.isfinite(angle)
    if np.mean(filled) > 0.5:
        raise StickslipError(
            f"Log '{log.name}': {100 * np.mean(filled):.0f} % of the angle is missing or clipped. Check the sensor's "
            "range."
        )
    angle = np.interp(time, time[~filled], angle[~filled])
    return DiscMotion(log, time, angle, smooth_drive(log, time, disc), filled)


def smooth_drive(log: RigLog, time: np.ndarray, disc: int = 0) -> np.ndarray:
    """Speed (n,) in rad/s of a driving disc at the times (n,): a cubic spline fitted to the edges of its encoder,
    whose knots are as far apart as generalised cross-validation finds best: line errors against unevenness.

    Source: Craven & Wahba (1979), Numer. Math. 31, 377.

    Raises:
        StickslipError: the log does not say how the drive turned, or the drive stood still.
    """
    from scipy.interpolate import make_lsq_spline

    if log.has(f"drive{disc}_speed") or not log.has(f"drive{disc}_count"):
        known, speed = drive_speed(log, disc)
        return np.interp(time, known, speed)
    found = edges(log, f"drive{disc}")
    if len(found.time) < 20:
        raise StickslipError(
            f"Log '{log.name}': the encoder of disc {disc} shows {len(found.time)} edges, so the drive hardly turned. "
            "A fit needs a driven disc; check the column and pulses_per_revolution."
        )
    first, last = float(found.time[0]), float(found.time[-1])
    best, least = None, np.inf
    for between in DRIVE_EDGES:
        pieces = max(len(found.time) // between, 1)
        inner = np.quantile(found.time, np.linspace(0, 1, pieces + 1)[1:-1])
        knots = np.concatenate([[first] * 4, inner, [last] * 4])
        spline = make_lsq_spline(found.time, found.angle, knots, 3)
        share = (pieces + 3) / len(found.time)
        score = float(np.mean((spline(found.time) - found.angle) ** 2)) / (1 - share) ** 2
        if score < least:
            best, least = spline, score
    assert best is not None
    return best.derivative()(np.clip(time, first, last))


def fuse(motions: Sequence[DiscMotion], window: float) -> tuple[list[DiscMotion], SensorFit]:
    """Laser angles scaled and dated by the encoder, one gain and one delay for all logs. window: s, smoothing.

    Without encoder or laser the motions are returned as they are, with an empty `SensorFit`.

    Raises:
        StickslipError: laser and encoder differ by more than a tolerance: one calibration is wrong.
    """
    usable = [m for m in motions if _by_laser(m.log) and m.log.has("encoder_count")]
    if not usable:
        return list(motions), SensorFit()
    design, edge, line = _edge_equations(usable, window)
    lines = len(np.unique(line))
    if lines < LEAST_LINES:
        return list(motions), SensorFit()
    solution = np.linalg.lstsq(design, edge, rcond=None)[0]
    residual = design @ solution - edge
    gain, delay = float(solution[0]), float(solution[1])
    if abs(gain) > GAIN_SUSPECT:
        raise StickslipError(
            f"Laser and encoder disagree: one shows {1 + gain:.3f} times the motion of the other. Check the laser's "
            "gain (m/V), the radius R and the encoder's pulses_per_revolution and quadrature."
        )
    covariance = clustered_covariance(design, residual, line)[:2, :2]
    fit = SensorFit(gain, delay, covariance, float(np.sqrt(np.mean(residual**2))), lines)
    return [corrected(m, gain, delay) if _by_laser(m.log) else m for m in motions], fit


def _by_laser(log: RigLog) -> bool:
    return log.has("laser") and not log.has("angle")


def zeroed(motion: DiscMotion, rest: float) -> DiscMotion:
    """The motion with the angle sensor's zero put where it showed ``rest`` (rad)."""
    if not _by_laser(motion.log):
        return replace(motion, angle=motion.angle - rest)
    return replace(motion, angle=np.arcsin(np.sin(motion.angle) - np.sin(rest)))


def corrected(motion: DiscMotion, gain: float, delay: float) -> DiscMotion:
    """The motion with the displacement R sin(angle) times 1 + gain, dated ``delay`` s earlier, the drive read there."""
    time = motion.time - delay
    angle = np.arcsin((1 + gain) * np.sin(motion.angle))
    return replace(motion, time=time, angle=angle, drive=np.interp(time, motion.time, motion.drive))


def _edge_equations(motions: Sequence[DiscMotion], window: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows (n, 2 + n_logs) of gain, delay, offsets; edge less laser (n,), rad; number of the line (n,), by angle."""
    rows, values, labels = [], [], []
    for place, motion in enumerate(motions):
        found = edges(motion.log, "encoder")
        smooth, speed = motion.smoothed(window), motion.smoothed(window, derivative=1)
        inside = (found.time > motion.time[0] + window) & (found.time < motion.time[-1] - window)
        near = np.interp(found.time, motion.time, motion.filled.astype(float)) == 0
        time, angle = found.time[inside & near], found.angle[inside & near]
        row = np.zeros((len(time), 2 + len(motions)))
        seen = np.interp(time, motion.time, smooth)
        # displacement R sin(angle) is what a gain multiplies: d angle / d gain = tan(angle)
        row[:, 0] = np.tan(seen)
        row[:, 1] = np.interp(time, motion.time, speed)
        row[:, 2 + place] = 1.0
        rows.append(row)
        values.append(angle - seen)
        labels.append(np.floor(angle / motion.log.calibration.need("encoder").pitch))
    return np.vstack(rows), np.concatenate(values), np.concatenate(labels)
