"""From raw logs to one angle and one drive speed on an even clock: what every estimator starts from.

The laser gives the shape of the motion (absolute, dense, noisy), the encoder its scale and its clock. At the edges of
the encoder, which are stamped to a microsecond and lie at known distances,
    angle_edge + offset = laser(t_edge) + gain tan(laser(t_edge)) + delay laser'(t_edge)
is solved over all logs at once: one gain and one delay for the instrument, an offset for each log. The misplaced lines
of the encoder are the noise; being fixed, each line is one cluster. Left uncorrected, a gain error of 0.2 % passes to
the friction coefficients one to one, and 5 ms of delay move p by 25 %.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.uncertainty import clustered_covariance
from identification.measurement.laser_drift import without_drift
from identification.measurement.lost_counts import lost_counts, lost_words
from identification.measurement.motion import (
    BENDS,
    HOLE,
    LINE_ERROR,
    DiscMotion,
    EdgeEquations,
    Passes,
    SensorFit,
    drive_edges,
    odd_count,
    savitzky_golay,
)
from identification.measurement.sensor_checks import (
    clipped_warning,
    delay_warnings,
    resolution_advice,
    slack_warning,
    stray_warning,
)
from identification.measurement.velocity import with_velocity
from rig_io.logs.log import LaserCalibration, RigLog
from rig_io.repair.clock import UNEVEN
from rig_io.sensors import drive_speed, edges, laser_angle, laser_clipped

DRIVE_EDGES = (6, 9, 13, 19, 28, 42, 64)  # of the drive's encoder between knots of its speed, to be chosen from
BEATS = 1.2  # times the variance of an edge that may lie anywhere between two samples: no less is asked of a spline
GAIN_SUSPECT = 0.02  # a correction of the laser's gain beyond this is a wrong calibration, not a tolerance
LOAD_WINDOW = 0.05  # s, over which the noise of a load cell is smoothed; forces of the rig change once per turn
TEMPERATURE_WINDOW = 1.0  # s, over which the noise of a thermometer is smoothed
STEP = 5.0  # deviations of its noise by which a force leaves its smooth course where it steps
LEAST_EDGES = 20  # of an encoder alone
LEAST_LINES = 5  # of the encoder, passed: fewer cannot tell gain from line errors
ROUNDING = 1e-6  # of a pitch, in an angle that counts have been taken off
JITTER = 0.3  # of the sample interval, rms: a clock that wanders more is no clock
STRAY = 5.0  # times the leap that one sample in a hundred exceeds is still noise
SHARPEST = 1000.0  # rad/s^2; the disc reaches 100
SHORTEST = 100  # samples of a log


def angle_at_ticks(log: RigLog) -> tuple[np.ndarray, np.ndarray]:
    """Absolute angle of the disc: times (n,) in s, with the laser's stated latency taken off, and angles (n,) in rad.

    A column ``angle`` is taken as it is; else the laser's, NaN where it is clipped; of an encoder alone, between its
    edges.

    Raises:
        StickslipError: nothing in the log shows the angle.
    """
    if log.has("angle"):
        return log.time, log.column("angle")
    if by_encoder(log):
        passes = passed_lines(log)
        inside = (log.time >= passes.time[0]) & (log.time <= passes.time[-1])
        return log.time[inside], passes.between(log.time[inside])
    if not log.has("laser"):
        columns = ", ".join(log.columns) or "no columns"
        raise StickslipError(
            f"Log '{log.name}' does not show the disc's angle (found: {columns}). It needs 'laser' [V] or "
            "'encoder_count' with its calibration, or 'angle' [rad]; a speed alone does not say where the spring rests."
        )
    angle = laser_angle(log).copy()
    angle[laser_clipped(log)] = np.nan
    return log.time - log.calibration.need("laser").latency, angle


def angle_sensor(log: RigLog) -> str:
    """The signal that shows the angle of the disc: "angle", "laser", or "encoder" where nothing else does."""
    return next((name for name in ("angle", "laser") if log.has(name)), "encoder")


def by_encoder(log: RigLog) -> bool:
    """Whether nothing but the encoder shows the angle of the disc."""
    return log.has("encoder_count") and angle_sensor(log) == "encoder"


def passed_lines(log: RigLog) -> Passes:
    """Edges of the body's encoder; their angles are right but for one shift within half a pitch. StickslipError: too
    few."""
    passed = edges(log, "encoder")
    if len(passed.time) < LEAST_EDGES:
        raise StickslipError(
            f"Log '{log.name}': the encoder shows {len(passed.time)} edges, so the disc hardly moved, and nothing else "
            "shows its angle. Fit a laser, an encoder of more lines, or drive so that the disc sticks and slips."
        )
    calibration = log.calibration.need("encoder")
    line = np.round(passed.angle / calibration.pitch + 0.5).astype(int) % calibration.edges_per_revolution
    return Passes(passed.time, passed.angle, line)


def disc_motion(log: RigLog) -> DiscMotion:
    """Motion of the disc in one log, sensors as calibrated in the log, and speeds of the driving discs in contact.

    Stamps that depart from an even clock are kept where they are: the angle is interpolated from them.

    Raises:
        StickslipError: no angle, no drive speed, too few samples, a log in pieces, a count that is missing, or a clock
            that is none.
    """
    if len(log.time) < SHORTEST:
        raise StickslipError(
            f"Log '{log.name}' has {len(log.time)} samples; a fit needs several cycles of {SHORTEST} samples or more."
        )
    pieces = log.pieces()
    if len(pieces) > 1:
        raise StickslipError(
            f"Log '{log.name}' is in {len(pieces)} pieces, the second from {pieces[1].time[0]:g} s on. Nothing may be "
            "filtered across a gap: take its pieces()."
        )
    _check_counts(log)
    stamps, angle = angle_at_ticks(log)
    clipped = laser_clipped(log) if angle_sensor(log) == "laser" else np.zeros(len(angle), dtype=bool)
    passes = passed_lines(log) if by_encoder(log) else None
    stray = _stray(angle, float(np.median(np.diff(stamps)))) if passes is None else np.zeros(len(angle), dtype=bool)
    if angle_sensor(log) == "laser":
        stray |= np.isnan(angle) & ~clipped & np.isfinite(log.column("laser"))
    warnings = (*clipped_warning(log, clipped), *stray_warning(log, stray))
    good = np.isfinite(angle) & ~stray
    if np.mean(good) < 0.5:
        raise StickslipError(
            f"Log '{log.name}': {100 * np.mean(~good):.0f} % of the angle is missing or clipped. Check the sensor's "
            "range."
        )
    time, notes = _even_clock(log.name, stamps)
    after = np.clip(np.searchsorted(stamps[good], time), 1, np.count_nonzero(good) - 1)
    gaps = stamps[good][after] - stamps[good][after - 1]
    measured = np.isin(time, stamps[good])
    filled = (gaps > HOLE * (time[1] - time[0])) & ~measured
    filled |= (time < stamps[good][0]) | (time > stamps[good][-1])
    angle = np.interp(time, stamps[good], angle[good])
    drives = np.stack([smooth_drive(log, time, contact) for contact in log.contacts])
    loads = _loads(log, time)
    said = (*warnings, *notes, *slack_warning(log, loads))
    return DiscMotion(log, time, angle, drives, filled, said, passes, loads)


def _loads(log: RigLog, time: np.ndarray) -> np.ndarray | None:
    """Normal forces (n_discs, n) in N at times (n,); None where not each disc in contact has a load cell."""
    names = [f"load{contact[-1]}" for contact in log.contacts]
    if not names or not all(log.has(name) for name in names):
        return None
    step = float(time[1] - time[0])
    forces = []
    for name in names:
        finite = np.isfinite(log.column(name))
        seen = np.interp(time, log.time[finite], log.column(name)[finite])
        force = savitzky_golay(seen, step, LOAD_WINDOW, 2, 0)
        # third differences of white noise have 20 times its variance; a force that steps is not smoothed there
        noise = float(np.median(np.abs(np.diff(seen, 3)))) / (0.6745 * np.sqrt(20))
        steps = np.abs(seen - force) > STEP * noise
        near = np.convolve(steps, np.ones(odd_count(LOAD_WINDOW, step)), "same") > 0
        force = np.where(near, seen, force)
        if force.min() <= 0:
            raise StickslipError(
                f"Log '{log.name}': the load cell '{name}' shows {force.min():.3g} N, a disc that is pulled or away. "
                "Check its sign and its zero, or leave the column out."
            )
        forces.append(force)
    return np.stack(forces)


def with_temperature(motions: Sequence[DiscMotion]) -> tuple[list[DiscMotion], float | None]:
    """Motions with the temperature over its mean in all, and that mean, K; as they are where one does not record
    it."""
    if not all(motion.log.has("temperature") for motion in motions):
        return list(motions), None
    rows = []
    for motion in motions:
        column, seen = motion.log.column("temperature"), motion.log.time
        finite = np.isfinite(column)
        even = np.interp(motion.time, seen[finite], column[finite])
        window = min(TEMPERATURE_WINDOW, 0.3 * motion.log.duration)
        rows.append(savitzky_golay(even, motion.step, window, 1, 0))
    mean = float(np.mean(np.concatenate(rows)))
    return [replace(motion, warmer=row - mean) for motion, row in zip(motions, rows, strict=True)], mean


def _check_counts(log: RigLog) -> None:
    used = ("encoder", *(f"drive{contact[-1]}" for contact in log.contacts))
    for name, column in log.columns.items():
        missing = np.flatnonzero(~np.isfinite(column)) if name.startswith(used) else np.zeros(0)
        if missing.size:
            raise StickslipError(
                f"Log '{log.name}': column '{name}' holds no number in {missing.size} samples, first at "
                f"{log.time[int(missing[0])]:g} s. A count cannot be bridged: split the log there, or leave the column "
                "out."
            )


def _stray(angle: np.ndarray, step: float) -> np.ndarray:
    """Samples (n,) that leap from the median of the five around them as no disc does; at the ends of the log none."""
    stray = np.zeros(len(angle), dtype=bool)
    around = np.lib.stride_tricks.sliding_window_view(angle, 5)
    finite = np.isfinite(around).all(axis=1)
    if not finite.any():
        return stray
    leap = np.where(finite, np.abs(angle[2:-2] - np.median(around, axis=1)), 0.0)
    resolution = np.diff(np.unique(angle[np.isfinite(angle)]))
    noise = max(float(np.quantile(leap[finite], 0.99)), float(np.min(resolution, initial=np.inf)))
    stray[2:-2] = leap > STRAY * noise + SHARPEST * step**2
    return stray


def _even_clock(name: str, stamps: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Times (m,) an even interval apart over the span of stamps (n,), and what was wrong with those."""
    intervals = np.diff(stamps)
    usual = float(np.median(intervals))
    if np.all(np.abs(intervals - usual) <= UNEVEN * usual):
        return stamps, ()
    single = intervals[intervals < 1.5 * usual]
    mean = float(np.mean(single))
    # the interval that the recorder was set to is a short number, and the same in all its logs
    step = next((s for s in (float(f"{mean:.{digits}g}") for digits in (1, 2, 3)) if abs(s / mean - 1) < 2e-3), mean)
    jitter = float(np.sqrt(np.mean((single / step - 1) ** 2)))
    if jitter > JITTER:
        raise StickslipError(
            f"Log '{name}' has no even clock: its intervals depart from {step:g} s by {100 * jitter:.0f} % (rms). "
            "Record with a clock of the recorder, not with that of a program."
        )
    time = stamps[0] + step * np.arange(int((stamps[-1] - stamps[0]) / step + 1e-6) + 1)
    warnings = []
    if jitter > UNEVEN / 2:
        warnings.append(
            f"Log '{name}' is sampled unevenly: intervals depart from {step:g} s by {100 * jitter:.2g} % (rms), at "
            f"most by {np.max(np.abs(single - step)):.2g} s. Its angle was interpolated at even times."
        )
    lost = int(np.sum(np.round(intervals[intervals >= 1.5 * usual] / step) - 1))
    if lost:
        warnings.append(f"Log '{name}' lacks {lost} samples; slips that hold one are left out.")
    return time, tuple(warnings)


def nominal_drives(log: RigLog) -> tuple[str, ...]:
    """Discs in contact of which the log does not record how they turned."""
    signals = ("count", "speed")
    return tuple(on for on in log.contacts if not any(log.has(f"drive{on[-1]}_{signal}") for signal in signals))


def smooth_drive(log: RigLog, time: np.ndarray, contact: str = "disc0") -> np.ndarray:
    """Speed (n,) in rad/s of a driving disc at the times (n,): a cubic spline fitted to the edges of its encoder,
    whose knots are as far apart as generalised cross-validation finds best: line errors against unevenness. What an
    edge without a time of its own is misplaced by beats with the samples and would pass for unevenness: no knots are
    asked to explain it. Where nothing records the drive, its nominal speed.

    Source: Craven & Wahba (1979), Numer. Math. 31, 377.

    Raises:
        StickslipError: the log does not say how the drive turned, or the drive stood still.
    """
    from scipy.interpolate import make_lsq_spline

    disc = int(contact[-1])
    nominal = dict(zip(log.contacts, log.experiment.drive_speed, strict=False)).get(contact)
    if contact in nominal_drives(log) and nominal:
        return np.full(len(time), nominal)
    if log.has(f"drive{disc}_speed") or not log.has(f"drive{disc}_count"):
        stamps, speed = drive_speed(log, disc)
        return np.interp(time, stamps, speed)
    seen, angle = drive_edges(log, disc)
    if len(seen) < 20:
        raise StickslipError(
            f"Log '{log.name}': the encoder of disc {disc} shows {len(seen)} edges, so the drive hardly turned. "
            "A fit needs a driven disc; check the column and pulses_per_revolution."
        )
    first, last = float(seen[0]), float(seen[-1])
    unexplained = 0.0
    if not log.has(f"drive{disc}_edge_time"):
        turned = abs(angle[-1] - angle[0]) / (last - first) * float(np.median(np.diff(log.time)))
        unexplained = BEATS * min(turned, log.calibration.need(f"drive{disc}").pitch) ** 2 / 12
    best, least = None, np.inf
    for between in reversed(DRIVE_EDGES):
        pieces = max(len(seen) // between, 1)
        inner = np.quantile(seen, np.linspace(0, 1, pieces + 1)[1:-1])
        knots = np.concatenate([[first] * 4, inner, [last] * 4])
        # banded normal equations: time grows with the log, not with its square; B-splines lose few digits by them
        spline = make_lsq_spline(seen, angle, knots, 3, method="norm-eq")
        share = (pieces + 3) / len(seen)
        score = max(float(np.mean((spline(seen) - angle) ** 2)) / (1 - share) ** 2, unexplained)
        if score < least:
            best, least = spline, score
    assert best is not None
    return best.derivative()(np.clip(time, first, last))


def fuse(motions: Sequence[DiscMotion], window: float) -> tuple[list[DiscMotion], SensorFit]:
    """Laser angles scaled and dated by the encoder, one gain and one delay for all logs, and joined by the speeds of a
    tachometer or vibrometer. window: s, smoothing. StickslipError: sensors differ by more than a tolerance: one
    calibration is wrong."""
    scaled, sensors = _scaled(motions, window)
    joined, velocity, notes = with_velocity(scaled, window)
    return joined, replace(sensors, warnings=(*sensors.warnings, *notes), velocity=velocity)


def _scaled(motions: Sequence[DiscMotion], window: float) -> tuple[list[DiscMotion], SensorFit]:
    """Laser angles scaled and dated by the encoder.

    Without encoder or laser the motions are returned as they are, with what the calibration says in the `SensorFit`."""
    usable = with_lines(motions, window)
    if not usable:
        return list(motions), _as_stated(motions)
    equations = edge_equations(usable, window)
    lines = len(np.unique(equations.line))
    mended, notes = without_drift(usable, equations)
    steady = [new is old for old, new in zip(usable, mended, strict=True)]
    if notes:
        moved = {id(old): new for old, new in zip(usable, mended, strict=True)}
        motions, usable = [moved.get(id(motion), motion) for motion in motions], mended
        equations = edge_equations(usable, window)
    solution = np.linalg.lstsq(equations.design, equations.edge, rcond=None)[0]
    residual = equations.design @ solution - equations.edge
    gain, delay = float(solution[0]), float(solution[1])
    bend, straight = _bend(equations)
    if abs(gain) > GAIN_SUSPECT:
        calibration = usable[0].log.calibration
        advice = resolution_advice(1 + gain, calibration.need("laser"), calibration.need("encoder"))
        if abs(straight) < GAIN_SUSPECT and (named := calibration.need("laser").bent(*(value for value, _ in bend))):
            advice = f"what it shows bends with the angle, and {named}."
        raise StickslipError(
            f"Laser and encoder disagree: the encoder shows {1 + gain:.4g} times the motion that the laser shows; "
            f"{advice}"
        )
    covariance = clustered_covariance(equations.design, residual, equations.line)[:2, :2]
    covariance[1, 1] += max(m.log.clock_deviation for m in usable) ** 2
    counted = (equations.motion == number for number in range(len(usable)))
    lost = [lost_words(m.log.name, equations.time[c], equations.lost[c]) for m, c in zip(usable, counted, strict=True)]
    warnings = (
        *notes,
        *(words for said in lost for words in said),
        *delay_warnings(usable, equations, -residual, steady),
    )
    rms = float(np.sqrt(np.mean(residual**2)))
    fit = SensorFit(gain, delay, covariance, rms, lines, warnings, bend=bend)
    return [corrected(m, gain, delay) if angle_sensor(m.log) == "laser" else m for m in motions], fit


def with_lines(motions: Sequence[DiscMotion], window: float) -> list[DiscMotion]:
    """Motions whose laser an encoder can scale; none where it passed too few lines."""
    usable = [m for m in motions if angle_sensor(m.log) == "laser" and m.log.has("encoder_count")]
    # a log that passes one line alone fixes its own offset and tells nothing else
    lines = [(m, np.unique(edge_equations([m], window).line)) for m in usable]
    lines = [(m, some) for m, some in lines if len(some) > 1]
    several = bool(lines) and len(np.unique(np.concatenate([some for _, some in lines]))) >= LEAST_LINES
    return [m for m, _ in lines] if several else []


def _bend(equations: EdgeEquations) -> tuple[tuple[tuple[float, float], ...], float]:
    """How the laser bends against the encoder, by power of the angle, and deviations; its gain beside that."""
    tangent = equations.design[:, 0]
    powers = [-(np.arctan(tangent) ** power) * np.sqrt(1 + tangent**2) for power in BENDS]
    design = np.column_stack([*powers, equations.design])
    solution = np.linalg.lstsq(design, equations.edge, rcond=None)[0]
    covariance = clustered_covariance(design, design @ solution - equations.edge, equations.line)
    values = tuple(zip(solution.tolist(), np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return values[: len(BENDS)], float(solution[len(BENDS)])


def _as_stated(motions: Sequence[DiscMotion]) -> SensorFit:
    """Without an encoder the gain is that of the calibration, and the delay is as sure as the recorders' clocks."""
    clock = max((m.log.clock_deviation for m in motions), default=0.0)
    pitches = [m.log.calibration.need("encoder").pitch for m in motions if m.passes is not None]
    rms = LINE_ERROR * max(pitches, default=0.0) / np.sqrt(3)
    return SensorFit(covariance=np.diag([0.0, clock**2]), rms=rms)


def zeroed(motion: DiscMotion, zero: float) -> DiscMotion:
    """The motion with the angle sensor's zero put where it showed ``zero`` (rad)."""
    if angle_sensor(motion.log) != "laser":
        passes = None if motion.passes is None else motion.passes.turned(-zero)
        return replace(motion, angle=motion.angle - zero, passes=passes)
    laser = motion.log.calibration.need("laser")
    return replace(motion, angle=laser.angle(laser.shown(motion.angle) - laser.shown(np.array(zero))))


def corrected(motion: DiscMotion, gain: float, delay: float) -> DiscMotion:
    """The motion with the laser's displacement times 1 + gain, dated ``delay`` s earlier, the drive read there."""
    time, laser = motion.time - delay, motion.log.calibration.laser or LaserCalibration(1.0)
    angle = laser.angle((1 + gain) * laser.shown(motion.angle))
    drives = np.stack([np.interp(time, motion.time, drive) for drive in motion.drives])
    return replace(motion, time=time, angle=angle, drives=drives)


def edge_equations(motions: Sequence[DiscMotion], window: float) -> EdgeEquations:
    """Edges of the body's encoder against the laser. window: s, over which the laser is smoothed."""
    rows, values, labels, times, places, lost = [], [], [], [], [], []
    for number, motion in enumerate(motions):
        passed = edges(motion.log, "encoder")
        smooth, speed = motion.smoothed(window), motion.smoothed(window, derivative=1)
        inside = (passed.time > motion.time[0] + window) & (passed.time < motion.time[-1] - window)
        good = np.interp(passed.time, motion.time, motion.filled.astype(float)) == 0
        time, angle = passed.time[inside & good], passed.angle[inside & good]
        row = np.zeros((len(time), 2 + len(motions)))
        seen, pitch = np.interp(time, motion.time, smooth), motion.log.calibration.need("encoder").pitch
        lost.append(lost_counts(angle - seen, pitch))
        angle = angle - pitch * lost[-1]
        # displacement R sin(angle) is what a gain multiplies: d angle / d gain = tan(angle)
        row[:, 0] = np.tan(seen)
        row[:, 1] = np.interp(time, motion.time, speed)
        row[:, 2 + number] = 1.0
        rows.append(row)
        values.append(angle - seen)
        labels.append(np.floor(angle / pitch + ROUNDING))
        times.append(time)
        places.append(np.full(len(time), number))
    return EdgeEquations(*(np.concatenate(arrays) for arrays in (rows, values, labels, times, places, lost)))
