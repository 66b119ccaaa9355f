"""Motions on the way to portraits: fused, smoothed, cut into cycles, averaged; and when they have settled."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.measurement.disc_motion import fuse
from identification.measurement.free_decay import fit_free_decay
from identification.measurement.motion import SMOOTHING, DiscMotion, savitzky_golay
from identification.measurement.pooling import at_rest, by_kind, check_contacts, motions_as_seen
from identification.measurement.slip_segments import THRESHOLD
from identification.model_check.portraits import LIMITS, PHASES, Portrait, Rest, Stick
from rig_io.logs.log import RigLog, stretches

CYCLES = 5  # natural periods: a shorter piece of a log with gaps shows no portrait
HYSTERESIS = 0.25  # of the half range, that the angle must fall below the middle before it counts as rising through it
LEAST_CYCLES = 2
LATE = 2.0  # periods from the begin of a motion to its first cycle, beyond which others were too small to count
RESTING = 1e-3  # rad, half range below which there is no cycle
ZERO = 0.25  # of the threshold of slip speed, below which a disc sticks: ten times the noise of the smoothed speed
DYING = 0.8  # second half of a motion without stick over its first half: below that the motion is no cycle
IRREGULAR = 0.2  # of the mean period, spread of the periods of a motion without stick from which on it is no cycle


class NoCycleError(StickslipError):
    """A motion that holds too few whole cycles for a portrait."""


def measured_motions(logs: Sequence[RigLog], natural_period: float) -> dict[tuple[str, ...], list[DiscMotion]]:
    """Motions of the stick-slip logs of one rig, by the discs in contact. Unlike the logs of a fit these need no stick:
    above the bifurcation the disc slides steadily, and that is a result.

    logs: a free decay among them gives the zero of the angle, and the laser's beam is the one that the encoder shows,
    as in a fit; natural_period: s, scale of the smoothing.
    StickslipError: no such log, different rigs, a log without disc, or one that cannot be read as a motion.
    """
    check_contacts(by_kind(logs, "Give those to compare with.")[0])
    logs, raw, _, _ = motions_as_seen(logs, SMOOTHING * natural_period, CYCLES * natural_period)
    if decay := next((log for log in logs if log.kind == "free-decay"), None):
        raw = at_rest(raw, fit_free_decay(decay))
    families: dict[tuple[str, ...], list[DiscMotion]] = {}
    for motion in fuse(raw, SMOOTHING * natural_period)[0]:
        families.setdefault(motion.log.contacts, []).append(motion)
    return families


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
        label: str = "the motion",
        states: Mapping[str, np.ndarray] | None = None,
    ) -> Portrait | Rest:
        """Mean cycle of a steady motion, or where it rests.

        time: (n,) s, even; angle: (n,) rad, as measured or simulated, unsmoothed; drives: by contact (n,) rad/s;
        states: of a model, by contact (n,), 0 where it sticks. StickslipError: a motion with stick of fewer than
        `LEAST_CYCLES` cycles.
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
            raise NoCycleError(
                f"{label[0].upper()}{label[1:]} holds {max(len(starts) - 1, 0)} whole cycles in "
                f"{time[-1] - time[0]:.3g} s; {LEAST_CYCLES} or more are needed. Use a longer record."
            )
        periods = np.diff(starts)
        if not any(mask.any() for mask in masks.values()) and np.std(periods) > IRREGULAR * np.mean(periods):
            return rest  # what the drive's unevenness stirs up
        phase = (np.arange(PHASES) / PHASES)[None, :] * periods[:, None] + starts[:-1, None]
        mean_angle = np.interp(phase, time, smooth).mean(axis=0)
        inside = (time >= starts[0]) & (time < starts[-1])
        sticks = {
            contact: Stick(
                float(np.mean(mask[inside])),
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
        odd = np.flatnonzero(np.abs(swings / np.median(late) - 1) > LIMITS["amplitude"])
        first = int(odd[-1]) + 1 if len(odd) else 0
        if first == 0 and starts[0] - time[0] < LATE * float(np.median(np.diff(starts))):
            return float(time[0])
        return float(starts[first]) if len(starts) - 1 - first >= LEAST_CYCLES else None

    def state(self, time: np.ndarray, angle: np.ndarray) -> tuple[float, float, float]:
        """Time (s), angle (rad) and speed (rad/s) at the begin of a motion, half a smoothing window after its first
        sample. time, angle: as in `motion`."""
        step, window = float(time[1] - time[0]), SMOOTHING * self.natural_period
        index = round(0.5 * window / step)
        smooth, speed = (savitzky_golay(angle, step, window, 2, derivative) for derivative in (0, 1))
        return float(time[index]), float(smooth[index]), float(speed[index])

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
    separate = (runs[1:, 0] - runs[:-1, 1]) * step > window
    return np.stack([runs[np.append(True, separate), 0], runs[np.append(separate, True), 1]], axis=1)


def _durations(mask: np.ndarray, step: float, window: float) -> np.ndarray:
    """How long (n,) s each stick lasts that begins and ends within the record."""
    runs = _runs(mask, step, window)
    inside = (runs[:, 0] > 0) & (runs[:, 1] < len(mask))
    return (runs[:, 1] - runs[:, 0])[inside] * step


def _comes_to_zero(slip: np.ndarray, mask: np.ndarray, step: float, window: float, limit: float) -> bool:
    """Whether the least slip speed (n,) m/s of most sticks is below a limit, m/s."""
    least = [float(slip[first:last].min()) for first, last in _runs(mask, step, window)]
    return bool(least) and float(np.median(least)) < limit


def _risings(time: np.ndarray, height: np.ndarray, guard: float) -> np.ndarray:
    """Times (m,) at which (n,) heights rise through zero after having been below -guard; interpolated."""
    side = np.where(height > guard, 1, np.where(height < -guard, -1, 0))
    outside = np.flatnonzero(side)
    before, after = outside[:-1], outside[1:]
    times = []
    for first, last in zip(before, after, strict=True):
        if side[first] < 0 < side[last]:
            stretch = slice(first, last + 1)
            # noise may cross zero several times on the way up: the line through the stretch crosses once
            slope, offset = np.polyfit(time[stretch] - time[first], height[stretch], 1)
            times.append(time[first] - offset / slope)
    return np.array(times)
