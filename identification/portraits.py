"""Phase portraits compared: a measured cycle against a modelled one, both processed alike.

Both motions are smoothed by the same filter, cut into cycles where the angle rises through the middle of its range, and
averaged over cycles at equal phase: a closed mean cycle (angle, speed). Angles and speeds are scaled by the half
ranges of the measured cycle, so that the figures are free of units. Acceptance levels (prototypes of this project):
    amplitude 3 %, period 1 %, stick fraction 0.02, symmetric-difference area 5 %, phase-aligned rms 4 %.
The Hausdorff distance is reported and not judged: one noisy point decides it.
A stick fraction of a smoothed motion is too large by nature (.270 where the truth is .213), hence the equal processing.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fmu_models.errors import StickslipError
from identification.kinematics import SMOOTHING, savitzky_golay
from identification.slip_segments import THRESHOLD

PHASES = 400  # points of a mean cycle
SCANLINES = 2000  # of the symmetric difference: area to 1e-3 of itself
HYSTERESIS = 0.25  # of the half range, that the angle must fall below the middle before it counts as rising through it
LEAST_CYCLES = 2
RESTING = 1e-3  # rad, half range below which there is no cycle

LIMITS = {"amplitude": 0.03, "period": 0.01, "stick fraction": 0.02, "area": 0.05, "rms": 0.04}

MEANING = (
    "A pass means that mu_s is right within 2-3 % or p within 20 %, no more: different parameters can make nearly the "
    "same portrait. It does not prove the friction law; residuals against slip speed and a log left out of the fit "
    "say more."
)


@dataclass(frozen=True, eq=False)
class Portrait:
    """A mean cycle. angle: (PHASES,) rad; speed: (PHASES,) rad/s; period s and its deviation from cycle to cycle;
    amplitude: rad, half range; stick_fraction: share of time with |slip| below the threshold; cycles averaged.
    """

    angle: np.ndarray
    speed: np.ndarray
    period: float
    period_deviation: float
    amplitude: float
    stick_fraction: float
    cycles: int


@dataclass(frozen=True)
class Verdict:
    """One metric: value, what it is relative to, acceptance level (None: reported only) and whether it is kept."""

    name: str
    value: float
    limit: float | None
    passed: bool | None
    meaning: str


@dataclass(frozen=True, eq=False)
class PortraitComparison:
    """A measured portrait, the model's, and the verdicts. drive_speed: rad/s, at which the model ran."""

    log: str
    drive_speed: float
    measured: Portrait
    model: Portrait
    verdicts: tuple[Verdict, ...]

    @property
    def passed(self) -> bool:
        """Whether every judged metric is kept."""
        return all(verdict.passed is not False for verdict in self.verdicts)

    def __getitem__(self, name: str) -> Verdict:
        """A verdict by the name of its metric."""
        return next(verdict for verdict in self.verdicts if verdict.name == name)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON (the curves left out)."""
        portraits = {
            kind: {
                "period": one.period,
                "amplitude": one.amplitude,
                "stick_fraction": one.stick_fraction,
                "cycles": one.cycles,
            }
            for kind, one in (("measured", self.measured), ("model", self.model))
        }
        return {
            "log": self.log,
            "drive_speed": self.drive_speed,
            "passed": self.passed,
            **portraits,
            "metrics": [asdict(verdict) for verdict in self.verdicts],
            "meaning": MEANING,
        }


def portrait(
    time: np.ndarray,
    angle: np.ndarray,
    drive: np.ndarray,
    *,
    r: float,
    R: float,
    natural_period: float,
    threshold: float = THRESHOLD,
    what: str = "the motion",
) -> Portrait:
    """Mean cycle of a steady motion.

    time: (n,) s, even; angle: (n,) rad, as measured or simulated, unsmoothed; drive: (n,) rad/s, of the driving disc;
    r, R: m, radii of driving disc and disc; natural_period: s, scale of the smoothing; threshold: m/s, of slip speed.

    Raises:
        StickslipError: the motion rests, or holds fewer than `LEAST_CYCLES` cycles.
    """
    step = float((time[-1] - time[0]) / (len(time) - 1))
    window = SMOOTHING * natural_period
    smooth, speed = (savitzky_golay(angle, step, window, 2, derivative) for derivative in (0, 1))
    low, high = np.quantile(smooth, [0.002, 0.998])
    if high - low < 2 * RESTING:
        raise StickslipError(
            f"{what[0].upper()}{what[1:]} rests: its angle stays within {high - low:.1g} rad, so there is no cycle to "
            "compare. Above some drive speed stick-slip dies out; compare at a lower one."
        )
    starts = _risings(time, smooth - 0.5 * (low + high), HYSTERESIS * 0.5 * (high - low))
    if len(starts) < LEAST_CYCLES + 1:
        raise StickslipError(
            f"{what[0].upper()}{what[1:]} holds {max(len(starts) - 1, 0)} whole cycles in {time[-1] - time[0]:.3g} s; "
            f"{LEAST_CYCLES} or more are needed. Use a longer record."
        )
    periods = np.diff(starts)
    phase = (np.arange(PHASES) / PHASES)[None, :] * periods[:, None] + starts[:-1, None]
    mean_angle = np.interp(phase, time, smooth).mean(axis=0)
    mean_speed = np.interp(phase, time, speed).mean(axis=0)
    whole = (time >= starts[0]) & (time < starts[-1])
    stick = np.abs(r * drive - R * speed) < threshold
    return Portrait(
        mean_angle,
        mean_speed,
        float(np.mean(periods)),
        float(np.std(periods, ddof=1)),
        float(np.ptp(mean_angle)) / 2,
        float(np.mean(stick[whole])),
        len(periods),
    )


def compare_portraits(measured: Portrait, model: Portrait) -> tuple[Verdict, ...]:
    """The metrics of `identification.portraits`, each against its acceptance level."""
    scale = np.array([np.ptp(measured.angle), np.ptp(measured.speed)]) / 2
    first = np.stack([measured.angle, measured.speed], axis=1) / scale
    second = np.stack([model.angle, model.speed], axis=1) / scale
    values = {
        "amplitude": (model.amplitude / measured.amplitude - 1, "half range of the angle, relative to measured"),
        "period": (model.period / measured.period - 1, "relative to measured"),
        "stick fraction": (model.stick_fraction - measured.stick_fraction, "difference of the shares of time"),
        "area": (
            symmetric_difference(first, second) / polygon_area(first),
            "area between the cycles, relative to the measured one's",
        ),
        "rms": (aligned_rms(first, second), "distance at equal phase, relative to the half ranges"),
        "hausdorff": (hausdorff(first, second), "greatest distance between the curves, relative to the half ranges"),
    }
    return tuple(
        Verdict(
            name,
            float(value),
            LIMITS.get(name),
            bool(abs(value) <= LIMITS[name]) if name in LIMITS else None,
            meaning,
        )
        for name, (value, meaning) in values.items()
    )


def polygon_area(curve: np.ndarray) -> float:
    """Area inside a closed curve (n, 2)."""
    x, y = curve.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def symmetric_difference(first: np.ndarray, second: np.ndarray, scanlines: int = SCANLINES) -> float:
    """Area that lies inside one of two closed curves (n, 2), (m, 2) and not inside the other.

    Along a vertical line, all crossings of either curve sorted by height enclose the difference between the first and
    the second, the third and the fourth ..., because inside both is inside an even number of curves.
    """
    both = np.concatenate([first, second])
    low, high = both[:, 0].min(), both[:, 0].max()
    width = (high - low) / scanlines
    area = 0.0
    edges = np.concatenate([np.stack([curve, np.roll(curve, -1, axis=0)], axis=1) for curve in (first, second)])
    left, right = edges[:, :, 0].min(axis=1), edges[:, :, 0].max(axis=1)
    for x in low + width * (np.arange(scanlines) + 0.5):
        start, end = edges[(left <= x) & (x < right)].transpose(1, 0, 2)
        height = start[:, 1] + (x - start[:, 0]) / (end[:, 0] - start[:, 0]) * (end[:, 1] - start[:, 1])
        height.sort()
        area += width * float(np.sum(height[1::2] - height[::2]))
    return area


def aligned_rms(first: np.ndarray, second: np.ndarray) -> float:
    """Root mean square distance per coordinate of two curves (n, 2) at equal phase, the phase shifted for the best
    fit."""
    shifts = (np.mean((first - np.roll(second, shift, axis=0)) ** 2) for shift in range(len(second)))
    return float(np.sqrt(min(shifts)))


def hausdorff(first: np.ndarray, second: np.ndarray) -> float:
    """Greatest distance from a point of either closed curve (n, 2), (m, 2) to the other curve."""
    return max(float(_distances(first, second).max()), float(_distances(second, first).max()))


def _distances(points: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Distance (n,) of each point (n, 2) to a closed curve (m, 2)."""
    along = np.roll(curve, -1, axis=0) - curve
    away = points[:, None, :] - curve
    length = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
    share = np.clip(np.sum(away * along, axis=2) / length, 0, 1)
    return np.sqrt(np.min(np.sum((away - share[:, :, None] * along) ** 2, axis=2), axis=1))


def _risings(time: np.ndarray, height: np.ndarray, guard: float) -> np.ndarray:
    """Times (m,) at which (n,) heights rise through zero after having been below -guard; interpolated."""
    side = np.where(height > guard, 1, np.where(height < -guard, -1, 0))
    known = np.flatnonzero(side)
    before, after = known[:-1], known[1:]
    found = []
    for first, last in zip(before, after, strict=True):
        if side[first] < 0 < side[last]:
            stretch = slice(first, last + 1)
            # noise may cross zero several times on the way up: the line through the stretch crosses once
            slope, offset = np.polyfit(time[stretch] - time[first], height[stretch], 1)
            found.append(time[first] - offset / slope)
    return np.array(found)
