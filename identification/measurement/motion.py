"""One angle and the drives' speeds on an even clock: what every estimator starts from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import perm

import numpy as np

from rig_io.logs.log import RigLog
from rig_io.sensors import edges

WANDERS = 0.1  # s, of memory of what is left of a drift that was taken off
SMOOTHING = 0.045  # of the natural period: window of the smoothing that serves only to find edges, gains and segments
BENDS = (2, 3)  # powers of the angle: a beam that is tilted; an arc or a flat where the other is taken for granted
CLOSE = 1e-5  # s: edges nearer to one another are one line, passed forth and back
LINE_ERROR = 0.02  # of the pitch, largest misplacement of a line where nothing is stated: that of usual rulings

HOLE = 1.75  # sample intervals: between stamps further apart a sample is missing
STANDS, MANY_GAPS = 0.4, 20.0  # s, and median intervals, without an edge of a drive that stands still
LEAVES, STANDS_EVERY = 0.1, 0.02  # s, in which it comes to a stop; between the angles put there


@dataclass(frozen=True)
class VelocityFit:
    """How a velocity sensor and the angle agree.

    sensor: its column; gain: of the speed it shows over that of the angle, 1; delay: s, by which it lags; their
    standard deviations; noise: rad/s or m/s, its misfit against the angle included; memory: s, within which it tells
    more than the angle (0: nowhere, it is not used).
    """

    sensor: str
    gain: float
    gain_deviation: float
    delay: float
    delay_deviation: float
    noise: float
    memory: float


@dataclass(frozen=True, eq=False)
class SensorFit:
    """How laser and encoder agree.

    gain: relative correction of the laser; delay: s, by which the laser lags behind its stated latency; covariance
    (2, 2) of the two; rms: misplacement of the encoder's edges, rad; lines: number of different edges used (0: no
    encoder, or nothing but it); warnings: where the delay is not one and the same, in words; velocity: of a velocity
    sensor, where there is one; bend: b_n of sin(angle) + sum of b_n angle^n, which the laser shows over R, n in
    `BENDS`, each with its deviation, as the encoder tells them.
    """

    gain: float = 0.0
    delay: float = 0.0
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))
    rms: float = 0.0
    lines: int = 0
    warnings: tuple[str, ...] = ()
    velocity: VelocityFit | None = None
    bend: tuple[tuple[float, float], ...] | None = None


@dataclass(frozen=True, eq=False)
class Passes:
    """Edges of the body's encoder in a log where nothing else shows the angle.

    time: (m,) s, ascending; angle: (m,) rad; line: (m,) number of the ruled line on its disc.
    """

    time: np.ndarray
    angle: np.ndarray
    line: np.ndarray

    def between(self, time: np.ndarray) -> np.ndarray:
        """Angle (n,) rad at times (n,) from the first edge to the last: a cubic spline through all edges, which departs
        from the motion of the rig by no more than lines are misplaced."""
        from scipy.interpolate import make_interp_spline

        distinct = np.concatenate([[True], np.diff(self.time) > CLOSE])
        return make_interp_spline(self.time[distinct], self.angle[distinct], 3)(time)

    def turned(self, angle: float | np.ndarray) -> Passes:
        """The same with angles (m,) larger by so much, rad."""
        return replace(self, angle=self.angle + angle)


@dataclass(frozen=True)
class Colour:
    """Noise of first order of an angle that a velocity sensor has joined: standard deviation ``noise`` in rad, and
    ``memory`` in s, in which a correlation falls to 1/e."""

    noise: float
    memory: float


@dataclass(frozen=True, eq=False)
class DiscMotion:
    """Motion of the disc in one log, on an even clock.

    time: (n,) s; angle: (n,) rad, unsmoothed; drives: (n_discs, n) rad/s, speeds of the driving discs in contact, in
    the order of the log's contacts; filled: (n,) samples that the sensor did not give and that are interpolated (no
    estimator uses a segment that holds one); warnings: what was done to the samples, in words. passes: edges of the
    encoder where no other sensor shows the angle, which then is interpolated between them. loads: (n_discs, n)
    N, normal forces by load cells, without their noise; warmer: (n,) K, temperature over its mean in all logs, none
    where one log does not record it. colour: of the angle's noise, where it is not white.
    wander: rad, deviation of a drift that is left beside it, with `WANDERS` s of memory; shift: rad, that of its mean.
    """

    log: RigLog
    time: np.ndarray
    angle: np.ndarray
    drives: np.ndarray
    filled: np.ndarray
    warnings: tuple[str, ...] = ()
    passes: Passes | None = None
    loads: np.ndarray | None = None
    warmer: np.ndarray | None = None
    colour: Colour | None = None
    wander: float = 0.0
    shift: float = 0.0

    @property
    def drive(self) -> np.ndarray:
        """Speed (n,) in rad/s of the driving disc, or of the first of two."""
        return self.drives[0]

    @property
    def memory(self) -> float:
        """Memory of the angle's noise, s; 0 where it is white."""
        return 0.0 if self.colour is None else self.colour.memory

    @property
    def step(self) -> float:
        """Sample interval, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    def smoothed(self, window: float, order: int = 2, derivative: int = 0) -> np.ndarray:
        """Savitzky-Golay value or derivative (n,) of the angle. window: s."""
        return savitzky_golay(self.angle, self.step, window, order, derivative)

    def slip(self, r: float, R: float, window: float) -> np.ndarray:
        """Slip speed (n_discs, n) of each drive against the disc, r w - R th', in m/s, smoothed over ``window`` s."""
        return r * self.drives - R * self.smoothed(window, derivative=1)


def drive_angle(motion: DiscMotion, disc: int) -> np.ndarray:
    """Angle (n,) of the driving disc at the samples, from its encoder's edges, or from its speed."""
    if motion.log.has(f"drive{disc}_count"):
        return np.interp(motion.time, *drive_edges(motion.log, disc))
    return np.concatenate([[0.0], np.cumsum(0.5 * (motion.drive[1:] + motion.drive[:-1]) * np.diff(motion.time))])


def drive_edges(log: RigLog, disc: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) s and angles (n,) rad of the edges of a driving disc's encoder. Where none comes for long the drive
    stands still: there stand angles midway between two edges, one every `STANDS_EVERY` s."""
    passed = edges(log, f"drive{disc}")
    if len(passed.time) < 2:
        return passed.time, passed.angle
    gaps = np.diff(passed.time)
    times, angles = [passed.time], [passed.angle]
    for index in np.flatnonzero(gaps > max(STANDS, MANY_GAPS * float(np.median(gaps)))):
        start, gap = passed.time[index], gaps[index]
        stands = start + np.arange(LEAVES, gap - LEAVES, STANDS_EVERY)
        times.append(stands)
        angles.append(np.full(len(stands), 0.5 * (passed.angle[index] + passed.angle[index + 1])))
    order = np.argsort(np.concatenate(times), kind="stable")
    return np.concatenate(times)[order], np.concatenate(angles)[order]


def savitzky_golay(angle: np.ndarray, step: float, window: float, order: int, derivative: int) -> np.ndarray:
    """Local polynomial value or derivative (n,) on an even clock of ``step`` s; the window (s) becomes an odd count."""
    count = odd_count(window, step)
    fitted, shape = local_polynomial(count, order, derivative)
    half = count // 2
    first, last = shape[:half] @ (fitted @ angle[:count]), shape[half + 1 :] @ (fitted @ angle[-count:])
    return np.concatenate([first, np.correlate(angle, shape[half] @ fitted, "valid"), last]) / step**derivative


@lru_cache(maxsize=64)
def local_polynomial(count: int, order: int, derivative: int) -> tuple[np.ndarray, np.ndarray]:
    """Least-squares polynomial through ``count`` (odd) even samples: coefficients from values (order + 1, count), and
    the derivative at each sample, per sample, from coefficients (count, order + 1).

    Source: Savitzky & Golay (1964), Anal. Chem. 36, 1627.
    """
    half = count // 2
    powers = np.arange(min(order, count - 1) + 1)
    position = np.arange(-half, half + 1)[:, None] / half
    factor = np.array([perm(power, derivative) for power in powers.tolist()]) / float(half) ** derivative
    return np.linalg.pinv(position**powers), factor * position ** np.maximum(powers - derivative, 0)


def odd_count(window: float, step: float) -> int:
    """Odd number of samples nearest to a window, three or more."""
    return max(2 * round((window / step - 1) / 2) + 1, 3)


@dataclass(frozen=True, eq=False)
class EdgeEquations:
    """One row for each edge of the encoder, of all motions.

    design: (n, 2 + n_motions), by gain, delay and the motion's offset; edge: (n,) rad, edge less laser; line: (n,)
    number of the ruled line, by angle; time: (n,) s; motion: (n,) number of the motion; lost: (n,) counts too many,
    which have been taken off.
    """

    design: np.ndarray
    edge: np.ndarray
    line: np.ndarray
    time: np.ndarray
    motion: np.ndarray
    lost: np.ndarray
