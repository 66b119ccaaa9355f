"""Statistics of the slip events in a log of friction (force over weight) against time.

A slip event has a peak (static friction), a value after it, a drop, and the time since the event before. While it
sticks, a slider of mass m on a spring k drawn at speed V loads at d(F/mg)/dt = k V/(m g): a check of units and
constants. Medians and means have 95 % intervals by a bootstrap of blocks of successive events.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.record import Recorded
from fmu_models.base.registry import Reference
from fmu_models.base.shown import Tabular
from identification.inference.uncertainty import lag_count, student
from identification.measurement.motion import odd_count
from identification.measurement.recipe import FRICTION, TIME, Recipe
from identification.measurement.signals import GRAVITY, prepare
from identification.slips.events import DEFINITIONS, SlipEvents, find_slips
from rig_io.packages.datapackage import read_columns

if TYPE_CHECKING:
    import pandas

SMOOTHING = 0.1  # of the natural period: a tenth of a slip's two halves keeps its edges
INERTIAL = 0.1  # of the natural period: what a mean period lasts longer at most where the slider swings
LEAST_EVENTS = 5
LEAST_INTERVALS = 2  # one varies by nothing
LOADING_SUSPECT = 0.15  # relative difference of the loading rate from k V/(m g)
SLOW = 1.0  # natural periods: a slip that lasts longer is not one of a free slider
SHARE = 0.5  # of the root mean square fall: a smaller one is a partial slip


@dataclass(frozen=True)
class Setting:
    """A key of [slips]: its unit, and what the reference of the manual says of it."""

    unit: str
    meaning: str


SETTINGS: Mapping[str, Setting] = {
    "mass": Setting("kg", "of the slider"),
    "stiffness": Setting("N/m", "of the spring that draws it"),
    "speed": Setting("m/s", "at which the spring is drawn"),
    "damping": Setting("N s/m", "of the slider, 0 if left out"),
    "smoothing": Setting("s", f"over which the log is smoothed, {SMOOTHING:g} of the natural period if left out"),
    "share": Setting("1", f"of the root mean square fall, below which a fall is a partial slip; {SHARE:g} if left out"),
}


@dataclass(frozen=True)
class Statistic:
    """A median (of the period: mean) with its 95 % interval (bootstrap by blocks) and the standard deviation of single
    values."""

    value: float
    low: float
    high: float
    spread: float


@dataclass(frozen=True)
class SlipStatistics(Tabular, Recorded):
    """Statistics of a log. definition: of a slip event, one of `events.DEFINITIONS`; smoothed: s, over which the log
    was smoothed, three samples or more; period_variation: standard deviation over mean; loading_expected: k V/(m g),
    None where a constant is unknown; verdicts: in words."""

    title: str
    source: str
    log: str
    duration: float
    definition: str
    smoothed: float
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

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each statistic: its value, its 95 % interval, and the standard deviation of single values."""
        import pandas

        names = ("peak", "after", "drop", "period", "slip_time")
        return pandas.DataFrame([vars(getattr(self, name)) for name in names], index=pandas.Index(names, name="of"))

    def _heading(self) -> str:
        return f"SlipStatistics: {self.title}, {self.events} slips in {self.duration:.4g} s"

    def _contents(self) -> Mapping[str, Any]:
        table = {name: getattr(self, name) for name in ("peak", "after", "drop", "period", "slip_time")}
        return {name: f"{s.value:.4g} ({s.low:.4g} to {s.high:.4g})" for name, s in table.items()}


def slip_statistics(
    recipe: Recipe,
    log: str | os.PathLike[str],
    settings: Mapping[str, float] | None = None,
    *,
    definition: str = "large",
    seed: int = 0,
    reader: Reference | None = None,
    repair: Collection[str] = (),
) -> tuple[SlipStatistics, SlipEvents]:
    """Slip events of a log and what they amount to. settings: SI values of `SETTINGS`, in place of the recipe's.
    definition: of a slip event, "large" or "every", see `events`. reader, repair: as in `rig_io.read_log`.
    StickslipError: unknown setting or definition, the log cannot be read or does not fit the recipe, a constant is
    missing or not above zero, or there are hardly any slip events or periods."""
    if "slips" not in recipe.document.data or FRICTION not in recipe.signals:
        raise StickslipError(
            f"Recipe {recipe.name} needs [slips] and [signals.{FRICTION}] for slip statistics; without them it is one "
            "for 'stickslip inverse'."
        )
    refuse_unknown(
        definition,
        DEFINITIONS,
        f"There is no definition '{definition}' of a slip event; there are {' and '.join(DEFINITIONS)}.",
    )
    if definition == "every" and "share" in (settings or {}):
        raise StickslipError("'share' tells large slips from partial ones; with the definition 'every' there is none.")
    for name in settings or {}:
        refuse_unknown(name, SETTINGS, f"There is no setting '{name}'.")
    rig = {**read_slips(recipe), **(settings or {})}
    share = rig.pop("share")
    if not 0 <= share < 1:
        raise StickslipError(f"'share' must lie from 0 to below 1, found {share:g}.")
    for name, value in rig.items():
        if not (0 < value < np.inf or (name == "damping" and value == 0)):
            raise StickslipError(f"'{name}' must be finite and above 0, found {value:g}.")
    window = _window(recipe, rig)
    prepared = prepare(recipe, read_columns(log, reader=reader), repair)
    pieces = [(piece.values[TIME], piece.values[FRICTION]) for piece in prepared.pieces]
    longest = max(time[-1] - time[0] for time, _ in pieces)
    if window > longest:
        raise StickslipError(
            f"{prepared.source} would be smoothed over {window:.4g} s, which is more than its {longest:.4g} s: a mass "
            "or stiffness is not that of this log, or 'smoothing' is too long."
        )
    events = find_slips(pieces, prepared.step, window, 0.0 if definition == "every" else share)
    if len(events.time) < LEAST_EVENTS:
        raise StickslipError(
            f"{prepared.source} shows {len(events.time)} slip events (noise {events.noise:.2g}); statistics need "
            f"{LEAST_EVENTS} or more. Check the column, 'smoothing' and 'share', or record for longer."
        )
    if np.count_nonzero(np.isfinite(events.interval)) < LEAST_INTERVALS:
        raise StickslipError(
            f"{prepared.source}: a gap of the clock lies between nearly all of its {len(events.time)} slip events, so "
            "that they have no period. Record without gaps."
        )
    smoothed = max(window, odd_count(0.0, prepared.step) * prepared.step)
    return _summary(recipe, os.fspath(log), rig, definition, smoothed, events, seed), events


def read_slips(recipe: Recipe) -> dict[str, float]:
    """The table [slips] of a recipe, SI: what is known of the slider, and ``share`` of the root mean square fall, below
    which a fall is a partial slip. StickslipError: what is wrong in it, with its line."""
    document = recipe.document
    document.check_keys(SETTINGS, "slips")
    table = document.table("slips")
    rig = {name: document.value(table[name], s.unit, "slips", name) for name, s in SETTINGS.items() if name in table}
    share = rig.setdefault("share", SHARE)
    if not 0 <= share < 1:
        raise document.fault(f"'share' must lie from 0 to below 1, found {share:g}.", "slips", "share")
    return rig


def _window(recipe: Recipe, rig: Mapping[str, float]) -> float:
    if "smoothing" in rig:
        return rig["smoothing"]
    if "mass" in rig and "stiffness" in rig:
        return SMOOTHING * natural_period(rig)
    missing = ", ".join(f"{name}=..." for name in ("mass", "stiffness") if name not in rig)
    raise StickslipError(
        f"Recipe {recipe.name} does not say how far to smooth: give {missing} (from which follows the time a slip "
        "takes), or smoothing=... in s, in [slips] or with --set."
    )


def swings(rig: Mapping[str, float], period: Statistic) -> bool:
    """Whether slips come at the natural period or faster, which leaves no time to stick, as far as that is known."""
    if "mass" not in rig or "stiffness" not in rig:
        return False
    return period.value <= (1 + INERTIAL) * natural_period(rig)


def natural_period(rig: Mapping[str, float]) -> float:
    return float(2 * np.pi * np.sqrt(rig["mass"] / rig["stiffness"]))


def _summary(
    recipe: Recipe, log: str, rig: dict[str, float], definition: str, smoothed: float, events: SlipEvents, seed: int
) -> SlipStatistics:
    interval = events.interval[np.isfinite(events.interval)]
    loading = float(np.nanmedian(events.loading)) if np.isfinite(events.loading).any() else float("nan")
    expected = None
    if all(name in rig for name in ("mass", "stiffness", "speed")):
        expected = rig["stiffness"] * rig["speed"] / (rig["mass"] * GRAVITY)
    slip_time = statistic(events.duration, seed)
    period = statistic(interval, seed, mean=True)
    return SlipStatistics(
        recipe.title,
        recipe.source,
        log,
        float(events.smooth_time[-1] - events.smooth_time[0]),
        definition,
        smoothed,
        len(events.time),
        events.beyond_noise,
        events.threshold,
        events.noise,
        statistic(events.peak, seed),
        statistic(events.after, seed),
        statistic(events.drop, seed),
        period,
        float(np.std(interval) / np.mean(interval)),
        slip_time,
        loading,
        expected,
        rig,
        tuple(_verdicts(events, rig, period, slip_time.value, loading, expected)),
    )


def statistic(values: np.ndarray, seed: int, *, mean: bool = False, draws: int = 1000) -> Statistic:
    """Median or mean of (n,) with a 95 % interval: blocks of successive values are drawn anew.

    Blocks are sqrt(n) long at least: two successive periods share a peak, in a log of few slips too. As few blocks
    vary less than what they are drawn from, and their own spread is uncertain, the interval is widened as Student's is.
    """
    centre = np.mean if mean else np.median
    rng = np.random.default_rng(seed)
    count = len(values)
    length = max(lag_count(count), math.isqrt(count))
    starts = rng.integers(0, count, size=(draws, -(-count // length)))
    rows = (starts[:, :, None] + np.arange(length)).reshape(draws, -1)[:, :count] % count
    middle = float(centre(values))
    ends = np.quantile(centre(values[rows], axis=1), [0.025, 0.975])
    blocks = count / length
    wider = student(blocks - 1, 0.95) / student(np.inf, 0.95) * np.sqrt(blocks / (blocks - 1))
    low, high = middle + wider * (ends - middle)
    return Statistic(middle, float(low), float(high), float(np.std(values)))


def _verdicts(
    events: SlipEvents,
    rig: Mapping[str, float],
    period: Statistic,
    slip_time: float,
    loading: float,
    expected: float | None,
) -> list[str]:
    verdicts = []
    if events.partial:
        falls = "1 smaller fall" if events.partial == 1 else f"{events.partial} smaller falls"
        verdicts.append(
            f"{falls} beyond noise (below {events.threshold:.3g}) not counted, as partial slips: the number of events "
            "and the period depend on 'share' (the definition 'every' counts them too)."
        )
    if expected is not None:
        ratio = loading / expected
        rate = f"Loading in stick: {loading:.4g} 1/s, from k V/(m g) {expected:.4g} 1/s, ratio {ratio:.3f}"
        if np.isnan(ratio):
            verdicts.append("Too few samples lie in stick to see how fast it loads: record faster.")
        elif abs(ratio - 1) <= LOADING_SUSPECT:
            verdicts.append(f"{rate}: stiffness, speed and mass fit the log.")
        else:
            verdicts.append(
                f"{rate}: a stiffness, speed or mass is not that of this log, or the slider creeps or swings instead "
                "of sticking."
            )
    if swings(rig, period):
        verdicts.append(
            f"A slip comes every {period.value:.4g} s, the natural period is {natural_period(rig):.4g} s: the slider "
            "swings on its spring instead of sticking (inertial regime). Peaks and drops are those "
            "of its swing; draw it slower for static friction."
        )
    if "mass" in rig and "stiffness" in rig and slip_time > SLOW * natural_period(rig):
        verdicts.append(
            f"A slip takes {slip_time:.3g} s, longer than the natural period of {natural_period(rig):.3g} s: what "
            "falls is not a free slider."
        )
    return verdicts
