"""Do the instruments agree with each other? What it means, in words, where they do not.

Laser and encoder see one disc: a ratio of their motions other than one is a wrong resolution or gain, a delay that
grows over a log is two clocks. The drive and the disc move as one while they stick: a ratio of R th' to r w that is
kept for long and is not one is a wrong unit or resolution of one of them.
"""

from collections.abc import Sequence

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError
from identification.inference.uncertainty import clustered_covariance
from identification.measurement.motion import DiscMotion, EdgeEquations
from rig_io.logs.log import EncoderCalibration, LaserCalibration, RigLog

DELAY_SUSPECT = 0.2e-3  # s: a delay moves p by 5 % per ms, a change below this by less than its noise
SURE = 5.0  # standard deviations
NOMINAL = 0.1  # of the nominal drive speed: a motor is set more closely
NEAR = 0.03  # a ratio this close to a known one is that one
ROUGH = 0.1  # the same for a ratio that is only roughly measured
KEPT = 0.15  # of the time: an oscillation without stick stays for 0.09 at most within 2 % of one speed
LEAST_ROWS = 20  # edges of one log, for its own delay and drift
SLACK = 0.05  # of the median of a normal force
LEAST_LINES = 3  # different ones among them


def resolution_advice(ratio: float, laser: LaserCalibration, encoder: EncoderCalibration) -> str:
    """What would make laser and encoder agree. ratio: motion shown by the encoder over that shown by the laser."""
    if ratio <= 0:
        return (
            "they run in opposite directions: give the laser's gain the other sign, or swap the encoder's two tracks."
        )
    gain = f"or the laser's gain is {laser.gain * ratio:.3g} m/V, or R is off"
    return f"{_encoder_advice(ratio, encoder)} ({gain})."


def _encoder_advice(ratio: float, encoder: EncoderCalibration) -> str:
    """What resolution an encoder has that shows ``ratio`` times the motion there is."""
    ratio = next((factor for factor in (4.0, 2.0, 0.5, 0.25) if abs(ratio / factor - 1) < ROUGH), ratio)
    if ratio == 4 and not encoder.quadrature:
        return 'four edges of each pulse seem to be counted: state "quadrature": true for the encoder'
    if ratio == 0.25 and encoder.quadrature:
        return 'one edge of each pulse seems to be counted: state "quadrature": false for the encoder'
    return f'it would agree with "pulses_per_revolution": {float(f"{encoder.pulses_per_revolution * ratio:.3g}"):g}'


def delay_warnings(
    motions: Sequence[DiscMotion], equations: EdgeEquations, misfit: np.ndarray, steady: Sequence[bool]
) -> tuple[str, ...]:
    """Delays between laser and encoder that differ between logs or drift within one.

    equations: of all motions; misfit: (n,) rad, edge less laser, after the common gain and delay; steady: by motion,
    whether its laser stays where it is (what is left of a drift would be taken for a delay).
    """
    warnings = []
    for number, motion in enumerate(motions):
        mine = equations.motion == number
        time, speed = equations.time[mine], equations.design[mine, 1]
        if not steady[number] or len(time) < LEAST_ROWS or len(np.unique(equations.line[mine])) < LEAST_LINES:
            continue
        middle = 0.5 * (motion.time[0] + motion.time[-1])
        length = float(motion.time[-1] - motion.time[0])
        # edge - laser = delay th' + drift th' (t - middle)/length + offset
        design = np.column_stack([speed, speed * (time - middle) / length, np.ones_like(time)])
        solution = np.linalg.lstsq(design, misfit[mine], rcond=None)[0]
        covariance = clustered_covariance(design, design @ solution - misfit[mine], equations.line[mine])
        delay, drift = solution[:2]
        delay_sd, drift_sd = np.sqrt(np.diag(covariance))[:2]
        name = motion.log.name
        if abs(drift) > max(DELAY_SUSPECT, SURE * drift_sd):
            warnings.append(
                f"Log '{name}': the laser's delay against the encoder drifts by "
                f"{value_with_sd(1e3 * drift, 1e3 * drift_sd, 'ms')} over {length:.3g} s: they were recorded on two "
                f"clocks, whose rates differ by {1e6 * drift / length:.0f} ppm. Record both on one, or stretch the "
                "time of one of them."
            )
        if abs(delay) > max(DELAY_SUSPECT, SURE * delay_sd):
            # a play lags by as much at any speed: at slow ones that is a long time
            design = np.column_stack([np.sign(speed), speed, np.ones_like(time)])
            play = np.linalg.lstsq(design, misfit[mine], rcond=None)[0]
            covariance = clustered_covariance(design, design @ play - misfit[mine], equations.line[mine])
            width, width_sd = 2 * abs(play[0]), 2 * float(np.sqrt(covariance[0, 0]))
            apart = "the recorders were started apart. Fit this log alone, or shift one of its clocks."
            loose = "the encoder's coupling, or what the laser looks at, has play"
            if width > SURE * width_sd:
                apart = f"{loose} of {value_with_sd(1e3 * width, 1e3 * width_sd, 'mrad')}. Tighten it."
            elif SURE * width_sd > 2 * abs(delay) * float(np.sqrt(np.mean(speed**2))):
                apart = f"{loose}, or {apart}"
            warnings.append(
                f"Log '{name}': the laser lags by {value_with_sd(1e3 * delay, 1e3 * delay_sd, 'ms')} against what "
                f"it does in all logs together: {apart}"
            )
    return tuple(warnings)


def slack_warning(log: RigLog, loads: np.ndarray | None) -> tuple[str, ...]:
    """What to say of normal forces (n_discs, n) in N that come near to nothing."""
    for contact, force in zip(log.contacts, () if loads is None else loads, strict=False):
        least, usual = float(force.min()), float(np.median(force))
        if least < SLACK * usual:
            return (
                f"Log '{log.name}': the normal force of {contact} comes down to {least:.2g} N, near to nothing beside "
                f"its usual {usual:.3g} N. There friction says little of the law, and the disc may lift.",
            )
    return ()


def drive_warnings(motion: DiscMotion) -> tuple[str, ...]:
    """Warnings of drives that turn otherwise than the log says they were set."""
    warnings = []
    for contact, drive, nominal in zip(
        motion.log.contacts, motion.drives, motion.log.experiment.drive_speed, strict=False
    ):
        mean = float(np.mean(drive))
        if nominal and abs(mean / nominal - 1) > NOMINAL:
            encoder = getattr(motion.log.calibration, f"drive{contact[-1]}", None)
            warnings.append(
                f"Log '{motion.log.name}': the drive of {contact} turns at {mean:.4g} rad/s, {mean / nominal:.3g} "
                f"times the speed that the log states ({nominal:g} rad/s): {_drive_advice(mean / nominal, encoder)}"
            )
    return tuple(warnings)


def check_stick_speed(motion: DiscMotion, r: float, R: float, window: float) -> None:
    """Refuse a log whose disc keeps, as long as only a stick lasts, to a multiple of the drive's speed that tells of a
    wrong unit or resolution. StickslipError: the ratio R th' / (r w) that is kept longest is a known factor other than
    one."""
    if len(motion.log.contacts) != 1:
        return
    ratio, share = stick_ratio(motion, r, R, window)
    factor = next((f for f in _FACTORS if abs(ratio / f - 1) < NEAR), None)
    if factor is None or share < KEPT:
        return
    raise StickslipError(
        f"Log '{motion.log.name}': for {100 * share:.0f} % of the time the disc's border moves at one multiple of the "
        f"driving disc's speed, R th' = {ratio:.3g} r w; in a stick it does so at once that speed. So "
        f"{_FACTORS[factor]} Check also the laser's gain, R and r."
    )


def stick_ratio(motion: DiscMotion, r: float, R: float, window: float) -> tuple[float, float]:
    """R th' / (r w) that is kept longest, and the share of the time for which it is; 0, 0 of a disc that never follows.

    r, R: m; window: s, of the smoothing.
    """
    drive = r * motion.drive
    moving = np.abs(drive) > 1e-3 * np.max(np.abs(drive))
    ratio = R * motion.smoothed(window, derivative=1)[moving] / drive[moving]
    ratio = np.sort(ratio[ratio > 0])
    if not len(ratio):
        return 0.0, 0.0
    inside = np.searchsorted(ratio, 1.04 * ratio, side="right") - np.arange(len(ratio))
    best = int(np.argmax(inside))
    return float(np.median(ratio[best : best + inside[best]])), float(inside[best] / len(motion.time))


# R th' / (r w) in a stick -> what it tells
_FACTORS = {
    4.0: 'the drive is shown four times too slow: its encoder is stated with four edges per pulse ("quadrature").',
    2.0: 'the drive is shown twice too slow: its encoder has half the stated "pulses_per_revolution".',
    0.5: 'the drive is shown twice too fast: its encoder has twice the stated "pulses_per_revolution".',
    0.25: 'the drive is shown four times too fast: four edges of each pulse are counted; state "quadrature": true.',
    180 / np.pi: "the angle is in degrees where radians are stated.",
    np.pi / 180: "the drive's speed is in degrees per second where rad/s are stated.",
    np.pi / 30: "the drive's speed is in revolutions per minute where rad/s are stated.",
    2 * np.pi: "the drive's speed is in revolutions per second where rad/s are stated.",
    1000.0: "the angle is in thousandths of the stated unit.",
    0.001: "the drive's speed is in thousandths of the stated unit, or the angle in thousands.",
}


def _drive_advice(ratio: float, encoder: EncoderCalibration | None) -> str:
    """ratio: of measured to stated speed."""
    if abs(ratio + 1) < NOMINAL:
        return "it turns the other way; check the sign."
    for factor, unit in ((30 / np.pi, "rpm"), (180 / np.pi, "degrees per second")):
        if abs(ratio / factor - 1) < NEAR or abs(ratio * factor - 1) < NEAR:
            return f"one of the two is in {unit}. State both in rad/s."
    if encoder is None or ratio <= 0:
        return "check the column and the stated speed."
    return f"{_encoder_advice(ratio, encoder)}."


def clipped_warning(log: RigLog, clipped: np.ndarray) -> tuple[str, ...]:
    """Warning of samples (n,) at which the laser stands at an end of its range."""
    if not clipped.any():
        return ()
    return (
        f"Log '{log.name}': the laser is saturated in {100 * np.mean(clipped):.2g} % of the samples, which were left "
        "out together with the slips that hold them. Move the laser so that the whole motion is within its range.",
    )


def stray_warning(log: RigLog, stray: np.ndarray) -> tuple[str, ...]:
    """Warning of samples (n,) at which the angle leaps and comes back."""
    if not stray.any():
        return ()
    first = log.time[int(np.argmax(stray))]
    return (
        f"Log '{log.name}': the angle leaps and comes back, faster than the disc can turn, in "
        f"{np.count_nonzero(stray)} samples, first at {first:g} s; they were left out together with the slips that "
        "hold them.",
    )
