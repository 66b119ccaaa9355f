"""Slip events in a log of friction (force over weight) against time.

The log is smoothed by a running median. Peaks and valleys alternate; a fall from a peak to the valley after it counts
    beyond noise       larger than 6 standard deviations of the noise (log less smoothed log)
    as a slip event    of which there are two definitions, by name:
        "large"  larger than a share of the root mean square of those beyond noise, smaller ones are partial slips
                 (the energy that a slip frees goes with the square of its fall)
        "every"  all of those beyond noise: what a detector of falling pieces of the log, as in the source, counts

Source of the measurement: Colas, Pustelnik, Oliver, Abry, Geminard, Vidal, Nonlinear denoising for solid friction
dynamics characterization, Physical Review E.
"""

from dataclasses import dataclass

import numpy as np

from identification.measurement.motion import odd_count

NOISE_FACTOR = 6.0  # standard deviations: noise alone falls so far in one of 1e9 samples
STICK = (0.2, 0.8)  # part of the loading between two events where its rate is measured: off the rounded ends
DEFINITIONS = ("large", "every")
ORDINARY = 0.9  # of the falls' heights: begin at 5 %, end at 95 %


@dataclass(frozen=True, eq=False)
class SlipEvents:
    """Slip events of one log, by number. time: (n,) s of the peak; peak, after: (n,) friction; end: (n,) s of the
    valley that ``after`` is read at; duration: (n,) s of the middle `ORDINARY` part of the fall; interval: (n,) s since
    the event before, NaN for the first behind a gap; loading: (n,) 1/s, rate in the stick before, NaN likewise;
    beyond_noise: number of falls that noise does not explain; partial: of these, smaller than the threshold; threshold:
    least drop; noise: standard deviation; smooth_time, smooth: the smoothed log."""

    time: np.ndarray
    peak: np.ndarray
    after: np.ndarray
    end: np.ndarray
    duration: np.ndarray
    interval: np.ndarray
    loading: np.ndarray
    beyond_noise: int
    partial: int
    threshold: float
    noise: float
    smooth_time: np.ndarray
    smooth: np.ndarray

    @property
    def drop(self) -> np.ndarray:
        """Fall of friction (n,)."""
        return self.peak - self.after

    def to_dict(self) -> dict[str, list[float]]:
        """One list per column, a value for each event."""
        columns = ("time", "peak", "after", "duration", "interval", "loading")
        return {name: getattr(self, name).tolist() for name in columns}


def find_slips(
    pieces: list[tuple[np.ndarray, np.ndarray]], step: float, window: float, share: float = 0.5
) -> SlipEvents:
    """Slip events. pieces: times (n,) s and friction (n,) between gaps, every ``step`` s; window: s, of the running
    median; share: of the root mean square fall, above which a fall is a slip event."""
    from scipy.ndimage import median_filter

    count = odd_count(window, step)
    smooth = [median_filter(friction, count, mode="nearest") for _, friction in pieces]
    away = np.concatenate([friction - s for (_, friction), s in zip(pieces, smooth, strict=True)])
    # from the mean absolute value: coarse resolution makes the median zero, spikes make the rms large
    noise = float(np.sqrt(np.pi / 2) * np.mean(np.abs(away)))
    least = max(NOISE_FACTOR * noise, 1e-9 * float(np.ptp(np.concatenate(smooth))))
    falls = [_falls(s, least) for s in smooth]
    drops = np.concatenate([s[peak] - s[valley] for s, (peak, valley) in zip(smooth, falls, strict=True)])
    threshold = max(least, share * float(np.sqrt(np.mean(drops**2)))) if drops.size else least
    rows = []
    for (time, _), s in zip(pieces, smooth, strict=True):
        peak, valley = _falls(s, threshold)
        slips = [_slip_time(time, s, i, j) for i, j in zip(peak, valley, strict=True)]
        loads = [np.nan, *(_loading(time, s, j, i) for j, i in zip(valley[:-1], peak[1:], strict=True))]
        interval = np.diff(time[peak], prepend=np.nan)
        rows.append(
            (time[peak], s[peak], s[valley], time[valley], np.array(slips), interval, np.array(loads[: len(peak)]))
        )
    return SlipEvents(
        *(np.concatenate(column) for column in zip(*rows, strict=True)),
        beyond_noise=len(drops),
        partial=int(np.sum(drops < threshold)),
        threshold=threshold,
        noise=noise,
        smooth_time=np.concatenate([time for time, _ in pieces]),
        smooth=np.concatenate(smooth),
    )


def _falls(values: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Peaks and the valleys after them, indices (n,) each: every fall and the rise after it are ``least`` or more.

    A fall that the log begins or ends in is left out: its peak or valley was not seen.
    """
    steps = np.diff(values)
    moving = np.flatnonzero(steps)
    turns = moving[:-1][np.sign(steps[moving[:-1]]) != np.sign(steps[moving[1:]])] + 1
    peaks, valleys = [], []
    high, low = 0, None  # the valley, once a fall has been seen
    for i in (*turns, len(values) - 1):
        value = values[i]
        if low is None:
            if value > values[high]:
                high = i
            elif values[high] - value >= least:
                low = i
        elif value < values[low]:
            low = i
        elif value - values[low] >= least:
            if high > 0:
                peaks.append(high)
                valleys.append(low)
            high, low = i, None
    return np.array(peaks, dtype=int), np.array(valleys, dtype=int)


def _slip_time(time: np.ndarray, values: np.ndarray, peak: int, valley: int) -> float:
    """Time, s, of the middle `ORDINARY` part of a fall."""
    fallen = (values[peak] - values[peak : valley + 1]) / (values[peak] - values[valley])
    edge = (1 - ORDINARY) / 2
    end = int(np.argmax(fallen >= 1 - edge))
    start = int(np.flatnonzero(fallen[: end + 1] <= edge)[-1])

    def reached(level: float, sample: int) -> float:
        """Time between two samples, of which only a few may fall into a slip."""
        return float(np.interp(level, fallen[sample : sample + 2], time[peak + sample : peak + sample + 2]))

    return reached(1 - edge, end - 1) - reached(edge, start)


def _loading(time: np.ndarray, values: np.ndarray, valley: int, peak: int) -> float:
    """Rate, 1/s, at which friction rises from a valley to the next peak; NaN if there are too few samples."""
    start, end = (valley + round(share * (peak - valley)) for share in STICK)
    if end - start < 4:
        return float("nan")
    return float(np.polyfit(time[start:end] - time[start], values[start:end], 1)[0])
