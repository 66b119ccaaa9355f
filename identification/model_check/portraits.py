"""Phase portraits compared: a measured cycle against a modelled one, both processed alike.

Both motions are smoothed by the same filter, cut into cycles where the angle rises through the middle of its range, and
averaged over cycles at equal phase: a closed mean cycle (angle, speed) with the stick on each disc. Angles and speeds
are scaled by the half ranges of the measured cycle, so that the figures are free of units. Acceptance levels
(prototypes of this project):
    amplitude 3 %, period 1 %, stick fraction 0.02, symmetric-difference area 5 %, phase-aligned rms 4 %.
The Hausdorff distance is reported and not judged: one noisy point decides it.
A stick fraction of a smoothed motion is too large by nature (.270 where the truth is .213), hence the equal processing.
Above the bifurcation there is no cycle: two motions that slide steadily agree, one that sticks and one that does not
differ, whatever their curves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured, Shown
from identification.measurement.motion import SMOOTHING, savitzky_golay
from identification.measurement.slip_segments import THRESHOLD, stretches

if TYPE_CHECKING:
    import pandas

PHASES = 400  # points of a mean cycle
SCANLINES = 2000  # of the symmetric difference: area to 1e-3 of itself
HYSTERESIS = 0.25  # of the half range, that the angle must fall below the middle before it counts as rising through it
LEAST_CYCLES = 2
LATE = 2.0  # periods from the begin of a motion to its first cycle, beyond which others were too small to count
RESTING = 1e-3  # rad, half range below which there is no cycle
ZERO = 0.25  # of the threshold of slip speed, below which a disc sticks: ten times the noise of the smoothed speed
DYING = 0.8  # second half of a motion without stick over its first half: below that the motion is no cycle
IRREGULAR = 0.2  # of the mean period, spread of the periods of a motion without stick from which on it is no cycle

LIMITS = {"amplitude": 0.03, "period": 0.01, "stick fraction": 0.02, "area": 0.05, "rms": 0.04}

MEANING = (
    "A pass means that mu_s is right within 2-3 % or p within 20 %, no more: different parameters can make nearly the "
    "same portrait. It does not prove the friction law; residuals against slip speed and a log left out of the fit "
    "say more."
)


@dataclass(frozen=True, eq=False)
class Stick(Shown):
    """Stick on one disc. fraction: share of time with |slip| below the threshold; strip: (PHASES,) share of the cycles
    that stick at each phase; squares: (n,) s^2, square of the time of each stick with the threshold's part taken off;
    real: whether the slip speed comes to zero rather than near it; held: (PHASES,) as strip, by the model's own contact
    states (None where measured)."""

    fraction: float
    strip: np.ndarray
    squares: np.ndarray
    real: bool
    held: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Portrait(Shown):
    """A mean cycle. angle: (PHASES,) rad; speed: (PHASES,) rad/s; period s and its deviation from cycle to cycle;
    amplitude: rad, half range; sticks: by contact; cycles averaged.
    """

    angle: np.ndarray
    speed: np.ndarray
    period: float
    period_deviation: float
    amplitude: float
    sticks: Mapping[str, Stick]
    cycles: int

    @property
    def sequence(self) -> tuple[tuple[str, ...], ...]:
        """Which discs stick, one after the other within a cycle, from the first stick on after the angle has risen
        through the middle of its range. What is shorter than the acceptance level of a stick fraction is left out."""
        together = np.stack([(stick.strip > 0.5) & stick.real for stick in self.sticks.values()], axis=1)
        sets = [tuple(name for name, on in zip(self.sticks, row, strict=True) if on) for row in together]
        runs = [(one, len(list(same))) for one, same in groupby(sets)]
        if len(runs) > 1 and runs[0][0] == runs[-1][0]:  # a stick that lasts over the beginning
            runs = [*runs[1:-1], (runs[0][0], runs[0][1] + runs[-1][1])]
        kept = [one for one, length in runs if one and length > LIMITS["stick fraction"] * PHASES]
        return tuple(one for one, _ in groupby(kept))

    @property
    def words(self) -> str:
        """The motion in words, as in "stick on {0} -> {0, 1} -> {1}"."""
        discs = ("{" + ", ".join(contact[-1] for contact in one) + "}" for one in self.sequence)
        return "stick on " + " -> ".join(discs) if self.sequence else "a cycle without stick"

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON (the curves left out)."""
        return {
            "motion": self.words,
            "period": self.period,
            "amplitude": self.amplitude,
            "stick_fraction": {name: stick.fraction for name, stick in self.sticks.items()},
            "sequence": [list(one) for one in self.sequence],
            "cycles": self.cycles,
        }


@dataclass(frozen=True)
class Rest:
    """Steady sliding: the mean angle, and half the range in which it stays, rad."""

    angle: float
    swing: float
    words: str = "steady sliding"

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {"motion": self.words, "angle": self.angle, "swing": self.swing}


@dataclass(frozen=True)
class Verdict:
    """One metric: value, what it is relative to, acceptance level (None: reported only) and whether it is kept."""

    name: str
    value: float
    limit: float | None
    passed: bool | None
    meaning: str


@dataclass(frozen=True)
class Settling(Shown):
    """When motions that begin before they have settled do so, s after the begin of the log; None: not within it.
    measured: of the log; model: of the model, from the log's first state."""

    measured: float | None
    model: float | None

    @property
    def words(self) -> str:
        """What is said of it."""
        log, model = ("not within it" if one is None else f"after {one:.3g} s" for one in (self.measured, self.model))
        compared = (
            "all of it was compared, its size not judged" if self.measured is None else "it was compared from there on"
        )
        return (
            f"begins before its motion has settled, which it does {log} (the model from the same state: {model}); "
            + (f"{compared}, with the model from the log's own state")
        )


@dataclass(frozen=True, eq=False)
class PortraitComparison(Pictured):
    """A measured motion, the model's, and the verdicts. drive_speeds: rad/s by contact, at which the model ran;
    settling: of a log that begins before its motion has settled."""

    log: str
    drive_speeds: Mapping[str, float]
    measured: Portrait | Rest
    model: Portrait | Rest
    verdicts: tuple[Verdict, ...]
    settling: Settling | None = None

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each metric: value, limit, whether it is kept."""
        import pandas

        rows = [{"value": one.value, "limit": one.limit, "passed": one.passed} for one in self.verdicts]
        return pandas.DataFrame(rows, index=pandas.Index([one.name for one in self.verdicts], name="metric"))

    @property
    def passed(self) -> bool:
        """Whether every judged metric is kept."""
        return all(verdict.passed is not False for verdict in self.verdicts)

    @property
    def drives(self) -> str:
        """The drive speeds in words."""
        return ", ".join(f"{speed:.3g}" for speed in self.drive_speeds.values()) + " rad/s"

    def __getitem__(self, name: str) -> Verdict:
        """A verdict by the name of its metric."""
        return next(verdict for verdict in self.verdicts if verdict.name == name)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON (the curves left out)."""
        return {
            "log": self.log,
            "drive_speeds": dict(self.drive_speeds),
            "passed": self.passed,
            "measured": self.measured.to_dict(),
            "model": self.model.to_dict(),
            "metrics": [asdict(verdict) for verdict in self.verdicts],
            "settling": None if self.settling is None else asdict(self.settling),
            "meaning": MEANING,
        }


@dataclass(frozen=True)
class Processing:
    """How motions become portraits. r, R: m, radii of driving discs and disc; natural_period: s, scale of the
    smoothing; threshold: m/s, of slip speed; arrangement of two discs, and the angle (rad) at which contact changes."""

    r: float
    R: float
    natural_period: float
    threshold: float = THRESHOLD
    arrangement: str = "together"
    changeover: float = 0.0

    def touches(self, contact: str, angle: np.ndarray) -> np.ndarray:
        """Where a disc touches the body at these angles (n,)."""
        if self.arrangement == "together":
            return np.ones(len(angle), dtype=bool)
        edge = self.changeover
        if self.arrangement == "sequential":
            return angle < edge if contact == "disc0" else angle >= edge
        return angle <= edge if contact == "disc0" else angle >= -edge

    def motion(
        self,
        time: np.ndarray,
        angle: np.ndarray,
        drives: Mapping[str, np.ndarray],
        what: str = "the motion",
        states: Mapping[str, np.ndarray] | None = None,
    ) -> Portrait | Rest:
        """Mean cycle of a steady motion, or where it rests.

        time: (n,) s, even; angle: (n,) rad, as measured or simulated, unsmoothed; drives: by contact (n,) rad/s;
        states: of a model, by contact (n,), 0 where it sticks.

        Raises:
            StickslipError: a motion with stick of fewer than `LEAST_CYCLES` cycles.
        """
        step = float((time[-1] - time[0]) / (len(time) - 1))
        window = SMOOTHING * self.natural_period
        smooth, speed = (savitzky_golay(angle, step, window, 2, derivative) for derivative in (0, 1))
        low, high = np.quantile(smooth, [0.002, 0.998])
        slips = {contact: np.abs(self.r * drive - self.R * speed) for contact, drive in drives.items()}
        masks = {name: (slip < self.threshold) & self.touches(name, smooth) for name, slip in slips.items()}
        rest = Rest(float(np.mean(smooth)), float(high - low) / 2)
        if rest.swing < RESTING:
            return rest
        half = len(smooth) // 2
        if not any(mask.any() for mask in masks.values()) and np.ptp(smooth[half:]) < DYING * np.ptp(smooth[:half]):
            late = smooth[3 * len(smooth) // 4 :]
            return Rest(float(np.mean(late)), float(np.ptp(late)) / 2, "a swing that dies out to steady sliding")
        starts = _risings(time, smooth - 0.5 * (low + high), HYSTERESIS * rest.swing)
        if len(starts) < LEAST_CYCLES + 1:
            if not any(mask.any() for mask in masks.values()):
                return rest
            raise StickslipError(
                f"{what[0].upper()}{what[1:]} holds {max(len(starts) - 1, 0)} whole cycles in "
                f"{time[-1] - time[0]:.3g} s; {LEAST_CYCLES} or more are needed. Use a longer record."
            )
        periods = np.diff(starts)
        if not any(mask.any() for mask in masks.values()) and np.std(periods) > IRREGULAR * np.mean(periods):
            return rest  # what the drive's unevenness stirs up
        phase = (np.arange(PHASES) / PHASES)[None, :] * periods[:, None] + starts[:-1, None]
        mean_angle = np.interp(phase, time, smooth).mean(axis=0)
        whole = (time >= starts[0]) & (time < starts[-1])
        sticks = {
            contact: Stick(
                float(np.mean(mask[whole])),
                np.interp(phase, time, mask.astype(float)).mean(axis=0),
                self._squares(_durations(mask, step, window), float(np.mean(drives[contact]))),
                _comes_to_zero(slips[contact], mask, step, window, ZERO * self.threshold),
                None if states is None else np.interp(phase, time, (states[contact] == 0) * 1.0).mean(axis=0),
            )
            for contact, mask in masks.items()
        }
        return Portrait(
            mean_angle,
            np.interp(phase, time, speed).mean(axis=0),
            float(np.mean(periods)),
            float(np.std(periods, ddof=1)),
            float(np.ptp(mean_angle)) / 2,
            sticks,
            len(periods),
        )

    def settled(self, time: np.ndarray, angle: np.ndarray) -> float | None:
        """Time (s) from which on the cycles of a motion swing alike: its begin, if all do; None, if too few are left.

        time, angle: as in `motion`.
        """
        smooth = savitzky_golay(angle, float(time[1] - time[0]), SMOOTHING * self.natural_period, 2, 0)
        low, high = np.quantile(smooth, [0.002, 0.998])
        if high - low < 2 * RESTING:
            return float(time[0])
        starts = _risings(time, smooth - 0.5 * (low + high), HYSTERESIS * 0.5 * float(high - low))
        if len(starts) < LEAST_CYCLES + 1:
            return float(time[0])
        swings = np.array([np.ptp(smooth[(time >= a) & (time < b)]) for a, b in pairwise(starts)])
        late = swings[-max(len(swings) // 3, 1) :]
        other = np.flatnonzero(np.abs(swings / np.median(late) - 1) > LIMITS["amplitude"])
        first = int(other[-1]) + 1 if len(other) else 0
        if first == 0 and starts[0] - time[0] < LATE * float(np.median(np.diff(starts))):
            return float(time[0])
        return float(starts[first]) if len(starts) - 1 - first >= LEAST_CYCLES else None

    def state(self, time: np.ndarray, angle: np.ndarray) -> tuple[float, float, float]:
        """Time (s), angle (rad) and speed (rad/s) at the begin of a motion, half a smoothing window after its first
        sample. time, angle: as in `motion`."""
        step, window = float(time[1] - time[0]), SMOOTHING * self.natural_period
        place = round(0.5 * window / step)
        smooth, speed = (savitzky_golay(angle, step, window, 2, derivative) for derivative in (0, 1))
        return float(time[place]), float(smooth[place]), float(speed[place])

    def _squares(self, times: np.ndarray, drive_speed: float) -> np.ndarray:
        """Squares (n,) s^2 of the times of sticks from those below the threshold (n,) s.

        The slip speed leaves stick as a = k r w/(2 J) t^2, and near the end of stick-slip comes to it so: a stick of t
        stays below h for  t_h = sqrt(t^2 + b^2) + b,  b^2 = h/a,  hence  t^2 = t_h^2 - 2 b t_h.
        """
        rate = 0.5 * (2 * np.pi / self.natural_period) ** 2 * self.r * abs(drive_speed)
        return times**2 - 2 * np.sqrt(self.threshold / rate) * times


def _runs(mask: np.ndarray, step: float, window: float) -> np.ndarray:
    """First and past-the-last sample (n, 2) of each stick; gaps shorter than the smoothing window are its noise."""
    runs = stretches(mask)
    if len(runs) == 0:
        return runs
    apart = (runs[1:, 0] - runs[:-1, 1]) * step > window
    return np.stack([runs[np.append(True, apart), 0], runs[np.append(apart, True), 1]], axis=1)


def _durations(mask: np.ndarray, step: float, window: float) -> np.ndarray:
    """How long (n,) s each stick lasts that begins and ends within the record."""
    runs = _runs(mask, step, window)
    inside = (runs[:, 0] > 0) & (runs[:, 1] < len(mask))
    return (runs[:, 1] - runs[:, 0])[inside] * step


def _comes_to_zero(slip: np.ndarray, mask: np.ndarray, step: float, window: float, limit: float) -> bool:
    """Whether the least slip speed (n,) m/s of most sticks is below a limit, m/s."""
    least = [float(slip[first:last].min()) for first, last in _runs(mask, step, window)]
    return bool(least) and float(np.median(least)) < limit


def compare_motions(measured: Portrait | Rest, model: Portrait | Rest) -> tuple[Verdict, ...]:
    """The metrics of `model_check.portraits`, each against its acceptance level; where one of the two has
    no stick, only whether the other has none either is judged."""
    first, second = sequence_of(measured), sequence_of(model)
    # where a cycle begins does not count
    alike = len(first) == len(second) and any(
        first == second[shift:] + second[:shift] for shift in range(max(len(first), 1))
    )
    state = Verdict("same motion", float(not alike), 0.0, alike, f"measured: {measured.words}; model: {model.words}")
    if isinstance(measured, Portrait) and isinstance(model, Portrait) and bool(first) == bool(second):
        return (state, *compare_portraits(measured, model))
    if isinstance(measured, Rest) and isinstance(model, Rest):
        value = model.angle / measured.angle - 1 if measured.angle else 0.0
        return (state, Verdict("rest angle", value, None, None, "relative to measured"))
    return (state,)


def sequence_of(motion: Portrait | Rest) -> tuple[tuple[str, ...], ...]:
    """The sticks of a motion, one after the other; none where it rests."""
    return motion.sequence if isinstance(motion, Portrait) else ()


def compare_portraits(measured: Portrait, model: Portrait) -> tuple[Verdict, ...]:
    """The metrics of two cycles."""
    scale = np.array([np.ptp(measured.angle), np.ptp(measured.speed)]) / 2
    first = np.stack([measured.angle, measured.speed], axis=1) / scale
    second = np.stack([model.angle, model.speed], axis=1) / scale
    share = "difference of the shares of time"
    sticks = {
        "stick fraction" + (f" {contact}" if len(measured.sticks) > 1 else ""): (
            model.sticks[contact].fraction - stick.fraction,
            share,
        )
        for contact, stick in measured.sticks.items()
    }
    values = {
        "amplitude": (model.amplitude / measured.amplitude - 1, "half range of the angle, relative to measured"),
        "period": (model.period / measured.period - 1, "relative to measured"),
        **sticks,
        "area": (
            symmetric_difference(first, second) / polygon_area(first),
            "area between the cycles, relative to the measured one's",
        ),
        "rms": (aligned_rms(first, second), "distance at equal phase, relative to the half ranges"),
        "hausdorff": (hausdorff(first, second), "greatest distance between the curves, relative to the half ranges"),
    }
    limits = {name: next((limit for key, limit in LIMITS.items() if name.startswith(key)), None) for name in values}
    return tuple(
        Verdict(name, float(value), limit, None if limit is None else bool(abs(value) <= limit), meaning)
        for (name, (value, meaning)), limit in zip(values.items(), limits.values(), strict=True)
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
