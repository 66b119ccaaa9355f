"""Slip events in a log of friction (force over weight) against time, and their statistics.

The log is smoothed by a running median. Peaks and valleys alternate; a fall from a peak to the valley after it counts
    beyond noise       larger than 6 standard deviations of the noise (log less smoothed log)
    as a slip event    larger than a share of the root mean square of those beyond noise, smaller ones are partial slips
(the energy that a slip frees goes with the square of its fall). A slip event has a peak (static friction), a value
after it, a drop, and the time since the event before. While it sticks, a slider of mass m on a spring k drawn at speed
V loads at d(F/mg)/dt = k V/(m g): a check of units and constants.

Source of the measurement: Colas, Pustelnik, Oliver, Abry, Geminard, Vidal, Nonlinear denoising for solid friction
dynamics characterization, Physical Review E.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from identification.measurement.motion import odd_count
from identification.one_dof.memory import memory
from identification.one_dof.recipe import FRICTION, SLIP_UNITS, TIME, Recipe
from identification.one_dof.signals import prepare
from identification.one_dof.terms import GRAVITY
from rig_io.readers import read_table

NOISE_FACTOR = 6.0  # standard deviations: noise alone falls so far in one of 1e9 samples
SMOOTHING = 0.1  # of the natural period: a tenth of a slip's two halves keeps its edges
LEAST_EVENTS = 5
STICK = (0.2, 0.8)  # part of the loading between two events where its rate is measured: off the rounded ends
ORDINARY = 0.9  # of the falls' heights: begin at 5 %, end at 95 %
LOADING_SUSPECT = 0.15  # relative difference of the loading rate from k V/(m g)
SLOW = 1.0  # natural periods: a slip that lasts longer is not one of a free slider


@dataclass(frozen=True)
class Statistic:
    """A median (of the period: mean) with its 95 % interval (bootstrap by blocks) and the standard deviation of single
    values."""

    value: float
    low: float
    high: float
    spread: float


@dataclass(frozen=True, eq=False)
class SlipEvents:
    """Slip events of one log, by number. time: (n,) s of the peak; peak, after: (n,) friction; rise: (n,) s that the
    slip takes; interval: (n,) s since the event before, NaN for the first behind a gap; loading: (n,) 1/s, rate in the
    stick before, NaN likewise; beyond_noise: number of falls that noise does not explain; threshold: least drop;
    noise: standard deviation; smooth_time, smooth: the smoothed log."""

    time: np.ndarray
    peak: np.ndarray
    after: np.ndarray
    duration: np.ndarray
    interval: np.ndarray
    loading: np.ndarray
    beyond_noise: int
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


@dataclass(frozen=True)
class SlipStatistics:
    """Statistics of a log. period_variation: standard deviation over mean; loading_expected: k V/(m g), None where a
    constant is unknown; verdicts: in words."""

    title: str
    source: str
    log: str
    duration: float
    events: int
    beyond_noise: int
    threshold: float
    noise: float
    peak: Statistic
    after: Statistic
    drop: Statistic
    period: Statistic
    period_variation: float
    slip_time: Statistic
    loading: float
    loading_expected: float | None
    known: dict[str, float]
    verdicts: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return dataclasses.asdict(self)


def slip_statistics(
    recipe: Recipe, log: str | os.PathLike[str], settings: Mapping[str, float] | None = None, *, seed: int = 0
) -> tuple[SlipStatistics, SlipEvents]:
    """Slip events of a log and what they amount to. settings: SI values of `SLIP_UNITS`, and ``share``, in place of
    the recipe's.

    Raises:
        StickslipError: unknown setting, the log cannot be read or does not fit the recipe, a constant is missing or not
            above zero, or there are hardly any slip events.
    """
    if recipe.slips is None or FRICTION not in recipe.signals:
        raise StickslipError(
            f"Recipe {recipe.path.name} needs [slips] and [signals.{FRICTION}] for slip statistics; without them it is "
            "one for 'stickslip inverse'."
        )
    for name in settings or {}:
        if name not in (*SLIP_UNITS, "share"):
            raise StickslipError(f"There is no setting '{name}'.{nearest(name, (*SLIP_UNITS, 'share'))}")
    known = {**recipe.slips.known, **(settings or {})}
    share = known.pop("share", recipe.slips.share)
    if not 0 <= share < 1:
        raise StickslipError(f"'share' must lie from 0 to below 1, found {share:g}.")
    for name, value in known.items():
        if value <= 0 and not (name == "damping" and value == 0):
            raise StickslipError(f"'{name}' must be above 0, found {value:g}.")
    window = _window(recipe, known)
    prepared = prepare(recipe, read_table(log))
    pieces = [(piece.values[TIME], piece.values[FRICTION]) for piece in prepared.pieces]
    events = find_slips(pieces, prepared.step, window, share)
    if len(events.time) < LEAST_EVENTS:
        raise StickslipError(
            f"{prepared.source} shows {len(events.time)} slip events (noise {events.noise:.2g}); statistics need "
            f"{LEAST_EVENTS} or more. Check the column, 'smoothing' and 'share', or record for longer."
        )
    return _summary(recipe, os.fspath(log), known, events, seed), events


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
    parts = []
    for (time, _), s in zip(pieces, smooth, strict=True):
        peak, valley = _falls(s, threshold)
        slips = [_slip_time(time, s, i, j) for i, j in zip(peak, valley, strict=True)]
        loads = [np.nan, *(_loading(time, s, j, i) for j, i in zip(valley[:-1], peak[1:], strict=True))]
        interval = np.diff(time[peak], prepend=np.nan)
        parts.append((time[peak], s[peak], s[valley], np.array(slips), interval, np.array(loads[: len(peak)])))
    at, peak, after, duration, interval, loading = (np.concatenate(column) for column in zip(*parts, strict=True))
    everywhere = np.concatenate([time for time, _ in pieces])
    return SlipEvents(
        at,
        peak,
        after,
        duration,
        interval,
        loading,
        len(drops),
        threshold,
        noise,
        everywhere,
        np.concatenate(smooth),
    )


def _falls(values: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Peaks and the valleys after them, indices (n,) each: every fall and the rise after it are ``least`` or more.

    A fall that the log begins or ends in is left out: its peak or valley was not seen.
    """
    steps = np.diff(values)
    moving = np.flatnonzero(steps)
    turns = moving[:-1][np.sign(steps[moving[:-1]]) != np.sign(steps[moving[1:]])] + 1
    peaks, valleys = [], []
    high, low = 0, -1
    for i in (*turns, len(values) - 1):
        value = values[i]
        if low < 0:
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
            high, low = i, -1
    return np.array(peaks, dtype=int), np.array(valleys, dtype=int)


def _slip_time(time: np.ndarray, values: np.ndarray, peak: int, valley: int) -> float:
    """Time, s, of the middle `ORDINARY` part of a fall."""
    fallen = (values[peak] - values[peak : valley + 1]) / (values[peak] - values[valley])
    edge = (1 - ORDINARY) / 2
    end = int(np.argmax(fallen >= 1 - edge))
    begin = int(np.flatnonzero(fallen[: end + 1] <= edge)[-1])
    return float(time[peak + end] - time[peak + begin])


def _loading(time: np.ndarray, values: np.ndarray, valley: int, peak: int) -> float:
    """Rate, 1/s, at which friction rises from a valley to the next peak; NaN if there are too few samples."""
    begin, end = (valley + round(part * (peak - valley)) for part in STICK)
    if end - begin < 4:
        return float("nan")
    return float(np.polyfit(time[begin:end] - time[begin], values[begin:end], 1)[0])


def _window(recipe: Recipe, known: Mapping[str, float]) -> float:
    if "smoothing" in known:
        return known["smoothing"]
    if "mass" in known and "stiffness" in known:
        return SMOOTHING * _natural_period(known)
    missing = ", ".join(f"{name}=..." for name in ("mass", "stiffness") if name not in known)
    raise StickslipError(
        f"Recipe {recipe.path.name} does not say how far to smooth: give {missing} (from which follows the time a slip "
        "takes), or smoothing=... in s, in [slips] or with --set."
    )


def _natural_period(known: Mapping[str, float]) -> float:
    return float(2 * np.pi * np.sqrt(known["mass"] / known["stiffness"]))


def _summary(recipe: Recipe, log: str, known: dict[str, float], events: SlipEvents, seed: int) -> SlipStatistics:
    interval = events.interval[np.isfinite(events.interval)]
    loading = float(np.nanmedian(events.loading)) if np.isfinite(events.loading).any() else float("nan")
    expected = None
    if all(name in known for name in ("mass", "stiffness", "speed")):
        expected = known["stiffness"] * known["speed"] / (known["mass"] * GRAVITY)
    slip_time = statistic(events.duration, seed)
    return SlipStatistics(
        recipe.title,
        recipe.source,
        log,
        float(events.smooth_time[-1] - events.smooth_time[0]),
        len(events.time),
        events.beyond_noise,
        events.threshold,
        events.noise,
        statistic(events.peak, seed),
        statistic(events.after, seed),
        statistic(events.drop, seed),
        statistic(interval, seed, mean=True),
        float(np.std(interval) / np.mean(interval)),
        slip_time,
        loading,
        expected,
        known,
        tuple(_verdicts(events, known, slip_time.value, loading, expected)),
    )


def statistic(values: np.ndarray, seed: int, *, mean: bool = False, draws: int = 1000) -> Statistic:
    """Median or mean of (n,) with a 95 % interval: blocks as long as the series remembers are drawn anew."""
    centre = np.mean if mean else np.median
    rng = np.random.default_rng(seed)
    length = min(memory(values).lags, max(len(values) // 4, 1))
    starts = rng.integers(0, len(values), size=(draws, -(-len(values) // length)))
    rows = (starts[:, :, None] + np.arange(length)).reshape(draws, -1)[:, : len(values)] % len(values)
    low, high = np.quantile(centre(values[rows], axis=1), [0.025, 0.975])
    return Statistic(float(centre(values)), float(low), float(high), float(np.std(values)))


def _verdicts(
    events: SlipEvents, known: Mapping[str, float], slip_time: float, loading: float, expected: float | None
) -> list[str]:
    said = []
    partial = events.beyond_noise - len(events.time)
    if partial > 0:
        said.append(
            f"{partial} smaller falls beyond noise (below {events.threshold:.3g}) are counted as partial slips: the "
            "number of events and the period depend on 'share'."
        )
    if expected is not None:
        ratio = loading / expected
        rate = f"Loading in stick: {loading:.4g} 1/s, from k V/(m g) {expected:.4g} 1/s, ratio {ratio:.3f}"
        if abs(ratio - 1) <= LOADING_SUSPECT:
            said.append(f"{rate}: stiffness, speed and mass fit the log.")
        else:
            said.append(
                f"{rate}: a stiffness, speed or mass is not that of this log, or the slider creeps or swings instead "
                "of sticking."
            )
    if "mass" in known and "stiffness" in known and slip_time > SLOW * _natural_period(known):
        said.append(
            f"A slip takes {slip_time:.3g} s, longer than the natural period of {_natural_period(known):.3g} s: what "
            "falls is not a free slider."
        )
    return said
