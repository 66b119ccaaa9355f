"""A velocity sensor joined to the angle: a tachometer of the body (rad/s) or a vibrometer on its border (m/s).

What it shows is u(t) = gain y'(t - delay) + offset, of the angle (y = th) or of the border (y = R sin th). Its gain and
delay, the same in all logs, and an offset for each log follow from windows phi that vanish at both ends,
    integral phi u dt = -gain integral (phi' + delay phi'') y dt + offset integral phi dt
in which no derivative of the noisy angle stands. Then, with deviations s_y of the angle's noise and s_u of the speed's,
the most likely y is that of
    least sum (y_i - shown_i)^2/s_y^2 + sum (y_i+1 - y_i - h u_i+1/2)^2/(h s_u)^2
No model of the motion enters, so that sticks and switches stay as sharp as they are. The noise of y is one of first
order, of memory s_y/s_u, and every estimator whitens by it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError
from identification.measurement.motion import HOLE, Colour, DiscMotion, VelocityFit, odd_count

SENSORS = ("tachometer", "vibrometer")
WINDOW = 4.0  # smoothing windows
GAIN_SUSPECT = 0.05  # a gain that is off by more is a wrong unit or calibration
LATEST = 0.05  # s; a sensor that lags by more runs on another clock
SETTLED = 1e-6  # s of delay
ROUNDS = 12
LEAST_NOISE = 1e-6  # of the range of a reading
LEAST_MEMORY = 1.0  # samples: noise of the angle that is forgotten sooner is not lowered
LEAST_WINDOWS = 5  # of a log
_FACTORS = {
    -1.0: "it counts the other way: give it the other sign",
    180 / np.pi: "it is in degrees per second where rad/s are stated",
    np.pi / 180: "it is in rad/s where degrees per second are stated",
    30 / np.pi: "it is in revolutions per minute where rad/s are stated",
    0.5 / np.pi: "it is in revolutions per second where rad/s are stated",
    1000.0: "it is in thousandths of the stated unit",
    0.001: "it is in thousands of the stated unit",
}
NEAR = 0.05


@dataclass(frozen=True, eq=False)
class _LogMotion:
    """What one log shows. y: (n,) rad or m, as above, at the times of its motion; speed: (m,) of the sensor, at its
    stamps (m,), s."""

    motion: DiscMotion
    y: np.ndarray
    stamps: np.ndarray
    speed: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Speeds (m,) shown at times (m,)."""
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.stamps, self.speed)(np.clip(time, self.stamps[0], self.stamps[-1]))

    def covers(self, time: np.ndarray) -> np.ndarray:
        """Whether the sensor gave numbers around times (m,)."""
        after = np.clip(np.searchsorted(self.stamps, time), 1, len(self.stamps) - 1)
        gap = self.stamps[after] - self.stamps[after - 1]
        return (gap < HOLE * self.motion.step) & (time >= self.stamps[0]) & (time <= self.stamps[-1])


def with_velocity(
    motions: Sequence[DiscMotion], window: float
) -> tuple[list[DiscMotion], VelocityFit | None, tuple[str, ...]]:
    """The motions with what a velocity sensor shows joined to the angle, how the two agree, and what to say of it.

    window: s, smoothing. Motions of logs without such a sensor, and those that nothing but an encoder's edges shows,
    stay as they are.

    Raises:
        StickslipError: logs hold two such sensors, one shows another speed than the angle does, or lags too far.
    """
    names = [_name(motion) for motion in motions]
    every = {name for name in names if name}
    if not every:
        return list(motions), None, ()
    if len(every) > 1:
        raise StickslipError(
            "Some logs hold a tachometer and others a vibrometer, and one of them can be joined to the angle. Leave "
            "the noisier column out."
        )
    (name,) = every
    chosen = [m for m, sensor in zip(motions, names, strict=True) if sensor and m.passes is None]
    if not chosen:
        notes = f"The {name} is not used: edges of an encoder alone are fitted as they are, and it stands for no angle."
        return list(motions), None, (notes,)
    logs = [_log_motion(motion, name) for motion in chosen]
    scale = _calibrated(logs, name, window)
    if scale is None:
        return list(motions), None, (f"The {name} is not used: the disc hardly moves in the logs that hold it.",)
    joined = {
        id(log.motion): _joined(log, scale, offset, name) for log, offset in zip(logs, scale.offsets, strict=True)
    }
    memory = float(np.median([motion.memory for motion in joined.values()]))
    fit = VelocityFit(name, scale.gain, scale.deviations[0], scale.delay, scale.deviations[1], scale.noise, memory)
    notes = [_words(fit)]
    without = [m.log.name for m, sensor in zip(motions, names, strict=True) if not sensor or m.passes is not None]
    if without:
        notes.append(f"The {name} is not in all logs that show the angle: {' and '.join(without)} are as they are.")
    return [joined.get(id(motion), motion) for motion in motions], fit, tuple(notes)


@dataclass(frozen=True, eq=False)
class _Calibrated:
    """gain: 1; delay: s; deviations: of them; offsets: by log, in the sensor's unit; noise: the sensor's, its misfit
    against the angle included."""

    gain: float
    delay: float
    deviations: tuple[float, float]
    offsets: tuple[float, ...]
    noise: float


def _name(motion: DiscMotion) -> str | None:
    sensors = [name for name in SENSORS if motion.log.has(name)]
    if len(sensors) > 1:
        raise StickslipError(
            f"Log '{motion.log.name}' holds a tachometer and a vibrometer, and one of them can be joined to the "
            "angle. Leave the noisier column out."
        )
    return sensors[0] if sensors else None


def _log_motion(motion: DiscMotion, name: str) -> _LogMotion:
    log, speed = motion.log, motion.log.column(name)
    good = np.isfinite(speed)
    if np.mean(good) < 0.5:
        raise StickslipError(
            f"Log '{log.name}': the {name} holds no number in {100 * np.mean(~good):.0f} % of the samples. Check it, "
            "or leave the column out."
        )
    y = motion.angle if name == "tachometer" else log.rig.value("R") * np.sin(motion.angle)
    return _LogMotion(motion, y, log.time[good], speed[good])


def _white(values: np.ndarray) -> float:
    """Standard deviation of the white noise of a reading (n,), by third differences."""
    return max(float(np.sqrt(np.mean(np.diff(values, 3) ** 2) / 20)), LEAST_NOISE * float(np.ptp(values)))


def _windows(values: np.ndarray, count: int) -> np.ndarray:
    """Windows (m, count) that overlap by half, of values (n,)."""
    return np.lib.stride_tricks.sliding_window_view(values, count)[:: count // 2]


def _calibrated(logs: Sequence[_LogMotion], name: str, window: float) -> _Calibrated | None:
    """Gain, delay and offsets over all logs; None where too little moves."""
    step = logs[0].motion.step
    count = odd_count(WINDOW * window, step)
    # weights of a window: (1 - s^2)^4, its first and its second derivative
    s, half = np.linspace(-1, 1, count), 0.5 * (count - 1) * step
    inside = 1 - s**2
    bump, first = inside**4, -8 * s * inside**3 / half
    second = (48 * s**2 * inside**2 - 8 * inside**3) / half**2
    good = [
        ~_windows(log.motion.filled, count).any(axis=1) & _windows(log.covers(log.motion.time), count).all(axis=1)
        for log in logs
    ]
    rows = []
    for number, (log, keep) in enumerate(zip(logs, good, strict=True)):
        positions = _windows(log.y - np.mean(log.y), count)[keep]
        row = np.zeros((len(positions), 2 + len(logs)))
        row[:, 0], row[:, 1], row[:, 2 + number] = -positions @ first, -positions @ second, bump.sum()
        rows.append(row)
    design = np.concatenate(rows)
    if min(len(row) for row in rows) < LEAST_WINDOWS or np.ptp(design[:, 0]) == 0:
        return None

    def solved(delay: float) -> tuple[np.ndarray, np.ndarray]:
        seen = [
            _windows(log.at(log.motion.time + delay), count)[keep] @ bump for log, keep in zip(logs, good, strict=True)
        ]
        target = np.concatenate(seen)
        values = np.linalg.lstsq(design, target, rcond=None)[0]
        return values, target - design @ values

    delay, (values, error) = 0.0, solved(0.0)
    for _ in range(ROUNDS):
        late = float(values[1] / values[0])
        delay += late
        if abs(delay) > LATEST:
            raise StickslipError(
                f"The {name} lags behind the angle by {1e3 * delay:.3g} ms or more: it shows another motion, or the "
                "two were recorded on two clocks. Record them on one, shift one of them, or leave the column out."
            )
        values, error = solved(delay)
        if abs(late) < SETTLED:
            break
    gain = float(values[0])
    _check_gain(gain, name, logs)
    variance = float(error @ error) / (len(error) - design.shape[1])
    gain_sd, late_sd = np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design))[:2])
    by_angle = max(_white(log.y) for log in logs) * abs(gain) * float(np.linalg.norm(first))
    # what the sensor does besides white noise, slow parts and a filter of its own, counts as noise of it
    misfit = float(np.sqrt(max(variance - by_angle**2, 0.0)) / np.linalg.norm(bump))
    noise = max(misfit, *(_white(log.speed) for log in logs))
    return _Calibrated(gain, delay, (float(gain_sd), float(late_sd / abs(gain))), tuple(values[2:].tolist()), noise)


def _check_gain(gain: float, name: str, logs: Sequence[_LogMotion]) -> None:
    if abs(gain - 1) <= GAIN_SUSPECT:
        return
    hint = next((words for factor, words in _FACTORS.items() if abs(gain / factor - 1) < NEAR), None)
    lever = ", and R" if name == "vibrometer" else ""
    raise StickslipError(
        f"The {name} and the angle disagree: in {' and '.join(log.motion.log.name for log in logs)} it shows "
        f"{gain:.4g} times the speed of the angle; {hint or 'its calibration is wrong'}. Mend it (its unit, its "
        f"calibration{lever}), or leave the column out."
    )


def _joined(log: _LogMotion, scale: _Calibrated, offset: float, name: str) -> DiscMotion:
    """The motion of the most likely angle."""
    from scipy.linalg import solveh_banded

    motion, step = log.motion, log.motion.step
    noise, speed_noise = _white(log.y), scale.noise / abs(scale.gain)
    colour = _colour(noise, speed_noise, step)
    if colour.memory < LEAST_MEMORY * step:
        return motion
    between = 0.5 * (motion.time[1:] + motion.time[:-1]) + scale.delay
    moved = step * (log.at(between) - offset) / scale.gain - np.diff(log.y)
    weight = np.where(motion.filled, 0.0, 1 / noise**2)
    tie = np.where(log.covers(between), 1 / (step * speed_noise) ** 2, 0.0)
    if np.any((weight[1:] + tie == 0) | (weight[:-1] + tie == 0)):
        weight = np.maximum(weight, 1e-9 / noise**2)
    bands = np.zeros((2, len(weight)))
    bands[0, 1:] = -tie
    bands[1] = weight + np.append(tie, 0.0) + np.append(0.0, tie)
    pull = np.append(0.0, tie * moved) - np.append(tie * moved, 0.0)
    y = log.y + solveh_banded(bands, pull)
    if name == "tachometer":
        return replace(motion, angle=y, colour=colour)
    R = motion.log.rig.value("R")
    return replace(motion, angle=np.arcsin(np.clip(y / R, -1, 1)), colour=replace(colour, noise=colour.noise / R))


def _colour(noise: float, speed_noise: float, step: float) -> Colour:
    """Colour of the joined angle's noise."""
    half = 1 + 0.5 * (step * speed_noise / noise) ** 2
    lasting = half - np.sqrt(half**2 - 1)
    return Colour(noise * float(np.sqrt((1 - lasting) / (1 + lasting))), float(-step / np.log(lasting)))


def _words(fit: VelocityFit) -> str:
    unit = "rad/s" if fit.sensor == "tachometer" else "m/s"
    text = (
        f"The {fit.sensor} shows {value_with_sd(fit.gain, fit.gain_deviation)} times the speed of the angle, "
        f"{value_with_sd(1e3 * fit.delay, 1e3 * fit.delay_deviation, 'ms')} late, with a noise of {fit.noise:.2g} "
        f"{unit}"
    )
    if not fit.memory:
        return f"{text}: too loud to tell more than the angle, so it is not used."
    return f"{text}: what changes within {1e3 * fit.memory:.2g} ms is taken from it, the rest from the angle."
