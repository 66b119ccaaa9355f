"""Two recorders, two clocks: the time of one as a straight line in that of the other, from what both have recorded.

    t_first = offset + (1 + drift) (t_second - middle) + middle

A signal that both have (trigger, drive, or the motion by laser in one and encoder in the other) is correlated over all
shifts; the best one begins a least-squares fit of offset, drift, scale and level of one signal to the other. Of a
count only its edges are used, which are known to a tick and lie at known distances. The uncertainty is that of a
jackknife over blocks of time, which holds for coloured noise. A second shift that fits nearly as well means that the
signal repeats itself: refused.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.table import Table

POINTS = 1 << 17  # of a correlation over all shifts, at most
OVERLAP = 0.5  # of the shorter recording, at least
ALIKE = 0.8  # correlation of two signals that are one, at least
DISTINCT = 5.0  # log of the likelihood by which the best shift must be ahead of any other one
ALIKE_IN_A_ROW = 5.0  # values of the rest that count as one
PASSES = 3.0  # times that each line of an encoder is passed, on average, for its place to be free
REACH = 2  # samples to either side that a signal is smoothed over
BLOCKS = 20  # of the jackknife
ROUNDS = 30  # of the search for the line
LEAST = 50  # values that a line is drawn through
HILLS = 40  # of the correlation that are tried
MOST = 200_000  # values that a line is drawn through
SIZE = 0.1  # by which two calibrated sensors of one motion may differ
DRIFT = 2e-3  # relative; quartzes differ by a tenth of it
MOTION = ("angle", "laser", "encoder_count")  # what shows the disc
SHARED = ("trigger", "angle", "laser", "encoder_count", "drive0_count", "drive0_speed", "drive1_count", "load0")


@dataclass(frozen=True)
class ClockFit:
    """offset: s, to be added to the second recorder's clock in the middle of its recording; drift: relative; their
    standard deviations; signals: names in first and second; correlation: of the two once they are aligned; spread: s,
    standard deviation of a time carried over, at the ends of the recording."""

    offset: float
    drift: float
    offset_deviation: float
    drift_deviation: float
    middle: float
    signals: tuple[str, str]
    correlation: float
    spread: float

    def moved(self, time: np.ndarray) -> np.ndarray:
        """Times (n,) of the second recorder on the clock of the first, s."""
        return self.middle + self.offset + (1 + self.drift) * (time - self.middle)

    def sentence(self) -> str:
        """The result in words."""
        first, second = self.signals
        names = f"'{first}'" if first == second else f"'{first}' against '{second}'"
        return (
            f"two recorders were put on one clock by {names}: offset {self.offset:.6f} s +- "
            f"{self.offset_deviation:.1g}, drift {1e6 * self.drift:.1f} ppm +- {1e6 * self.drift_deviation:.1g} "
            f"(correlation {self.correlation:.4f})."
        )


def on_one_clock(first: Table, second: Table, sizes: Mapping[str, float]) -> tuple[Table, ClockFit]:
    """The columns of both on the clock of the first, where both recorded; and how their clocks stand.

    sizes: rad per unit of a column that shows the disc, as far as it is known: a decay is like itself a period later,
    but for its size.

    Raises:
        StickslipError: nothing in them is common, or it does not fix one shift; with the reason of each attempt.
    """
    fit = _clock_fit(first, second, sizes)
    time = first.columns[TIME.name]
    other_time = fit.moved(second.columns[TIME.name])
    overlap = (time >= other_time[0]) & (time <= other_time[-1])
    columns = {name: values[overlap] for name, values in first.columns.items()}
    for name, values in second.columns.items():
        if name not in columns and name != TIME.name and not name.endswith("_edge_time"):
            columns |= _carried(name, values, second, fit, other_time, time[overlap])
    units = {**second.units, **first.units, **{n: "s" for n in columns if n.endswith("_edge_time")}}
    source = f"{first.source} and {second.source}"
    left_out = {**second.left_out, **first.left_out}
    table = replace(first, source=source, columns=columns, units=units, left_out=left_out, rows=np.flatnonzero(overlap))
    return table, fit


def _carried(
    name: str, values: np.ndarray, second: Table, fit: ClockFit, other_time: np.ndarray, time: np.ndarray
) -> dict[str, np.ndarray]:
    """A column of the second recorder at the times (n,) of the first; a count with the times of its edges."""
    if not COLUMNS[name].whole:
        good = np.isfinite(values)
        return {name: np.interp(time, other_time[good], values[good])}
    last = np.searchsorted(other_time, time, side="right") - 1
    edge = name.removesuffix("_count") + "_edge_time"
    if edge in second.columns:
        stamps = fit.moved(second.columns[edge])
    else:
        # an edge lies between two ticks; before the first one nothing is known
        changed = np.diff(values, prepend=values[:1]) != 0
        middle = 0.5 * (other_time + np.concatenate([other_time[:1], other_time[:-1]]))
        stamps = np.maximum.accumulate(np.where(changed, middle, other_time[0]))
    return {name: values[last], edge: stamps[last]}


def _clock_fit(first: Table, second: Table, sizes: Mapping[str, float]) -> ClockFit:
    tried = []
    for first_name, second_name in _pairs(first, second):
        try:
            return _aligned(first, first_name, second, second_name, sizes)
        except StickslipError as error:
            tried.append(f"'{first_name}' and '{second_name}': {error}")
    if not tried:
        raise StickslipError(
            f"{first.source} ({', '.join(first.columns)}) and {second.source} ({', '.join(second.columns)}) hold no "
            "signal in common, so that their clocks cannot be compared. Record a trigger, the drive or the motion with "
            "both."
        )
    raise StickslipError(f"The clocks of {first.source} and {second.source} cannot be compared. {' '.join(tried)}")


def _pairs(first: Table, second: Table) -> Iterator[tuple[str, str]]:
    for name in SHARED:
        if name in first.columns and name in second.columns:
            yield name, name
    for first_name in MOTION:
        for second_name in MOTION:
            if first_name != second_name and first_name in first.columns and second_name in second.columns:
                yield first_name, second_name


def _aligned(first: Table, first_name: str, second: Table, second_name: str, sizes: Mapping[str, float]) -> ClockFit:
    """The line between two clocks by two signals."""
    a, b = _signal(first, first_name), _signal(second, second_name)
    step, lags, score = _correlation(a, b)
    if score.max() < ALIKE:
        raise StickslipError(f"they do not agree at any shift (correlation {score.max():.2f} at most).")
    middle = float(0.5 * (b.time[0] + b.time[-1]))
    # the smoother signal is read at the times of the other, so that its slope is one
    reversed_fit = COLUMNS[first_name].whole and not COLUMNS[second_name].whole
    scale = sizes[first_name] / sizes[second_name] if first_name in sizes and second_name in sizes else None
    lines = [_line(a, b, middle, float(lags[peak]), reversed_fit) for peak in _peaks(score)]
    fits = [line for line in lines if line is not None]
    if not fits:
        raise StickslipError("they hardly overlap.")
    fits = [line for line in fits if scale is None or abs(abs(line.scale * scale) - 1) < SIZE]
    if not fits:
        raise StickslipError("where they are alike the size of the motion differs. Check both calibrations.")
    fitted = min(fits, key=lambda line: line.squares)
    for rival in fits:
        distinct = abs(rival.offset - fitted.offset) > 2 * step
        # values of the rest are not independent one by one
        evidence = 0.5 * min(rival.free, fitted.free) / ALIKE_IN_A_ROW * np.log(rival.squares / fitted.squares)
        if distinct and evidence < DISTINCT:
            raise StickslipError(
                f"shifts by {fitted.offset:.4g} s and {rival.offset:.4g} s fit alike: the signal repeats itself. "
                "Record a trigger, or the begin of the motion, with both."
            )
    if abs(fitted.drift) > DRIFT:
        raise StickslipError(f"the clocks would differ by {1e6 * fitted.drift:.0f} ppm, more than any two do.")
    reach = float(max(b.time[-1] - middle, middle - b.time[0]))
    spread = float(np.hypot(fitted.offset_deviation, reach * fitted.drift_deviation))
    return ClockFit(
        fitted.offset,
        fitted.drift,
        fitted.offset_deviation,
        fitted.drift_deviation,
        middle,
        (first_name, second_name),
        fitted.correlation,
        spread,
    )


@dataclass(frozen=True, eq=False)
class _Signal:
    """time: (n,) s; value: (n,); at: (m,) s and level (m,), where it is known best (the edges of a count)."""

    time: np.ndarray
    value: np.ndarray
    at: np.ndarray
    level: np.ndarray


def _signal(table: Table, name: str) -> _Signal:
    time, value = table.columns[TIME.name], table.columns[name]
    good = np.isfinite(time) & np.isfinite(value)
    time, value = time[good], value[good]
    rising = np.concatenate([[True], np.diff(time) > 0])
    time, value = time[rising], value[rising]
    if len(time) < LEAST or not np.ptp(value) > 0:
        raise StickslipError(f"{table.source} shows nothing in '{name}'.")
    if not COLUMNS[name].whole:
        return _Signal(time, value, time, value)
    change = np.diff(value)
    changes = np.flatnonzero(change)
    edge = name.removesuffix("_count") + "_edge_time"
    if edge in table.columns:
        at = table.columns[edge][good][rising][changes + 1]
    else:
        at = 0.5 * (time[changes] + time[changes + 1])
    return _Signal(time, value, at, value[changes + 1] - 0.5 * np.sign(change[changes]))


def _correlation(a: _Signal, b: _Signal) -> tuple[float, np.ndarray, np.ndarray]:
    """Step in s, shifts in s to be added to the second clock, and the size of the correlation at each."""
    from scipy.signal import correlate

    spans = [signal.time[-1] - signal.time[0] for signal in (a, b)]
    step = max(float(np.median(np.diff(a.time))), float(np.median(np.diff(b.time))), max(spans) / POINTS)
    x, y = (_even(signal, step) for signal in (a, b))
    lags = np.arange(-(len(y) - 1), len(x))

    def sums(left: np.ndarray, right: np.ndarray) -> np.ndarray:
        return correlate(left, right, mode="full", method="fft")

    ones = (np.ones_like(x), np.ones_like(y))
    number = np.maximum(np.round(sums(*ones)), 1.0)
    mean_x, mean_y = sums(x, ones[1]) / number, sums(ones[0], y) / number
    power_x = np.maximum(sums(x * x, ones[1]) / number - mean_x**2, 0)
    power_y = np.maximum(sums(ones[0], y * y) / number - mean_y**2, 0)
    power = np.sqrt(power_x * power_y)
    score = np.abs(sums(x, y) / number - mean_x * mean_y) / np.maximum(power, 1e-6 * np.max(power))
    score[number < OVERLAP * min(len(x), len(y))] = 0.0
    return step, a.time[0] - b.time[0] + step * lags, score


def _even(signal: _Signal, step: float) -> np.ndarray:
    """A signal on an even clock, without level and trend, of unit size."""
    time = np.arange(signal.time[0], signal.time[-1], step)
    value = np.interp(time, signal.time, signal.value)
    slope = np.polynomial.polynomial.polyfit(time - time[0], value, 1)
    level = np.polynomial.polynomial.polyval(time - time[0], slope) if _is_ramp(signal) else value.mean()
    value = value - level
    return value / max(float(np.std(value)), 1e-300)


def _is_ramp(signal: _Signal) -> bool:
    """Whether a signal rises or falls throughout: of a drive its unevenness is what can be compared."""
    line = np.corrcoef(signal.time, signal.value)[0, 1]
    return bool(abs(line) > 0.999)


def _peaks(score: np.ndarray) -> list[int]:
    """The shifts of the highest hills."""
    from scipy.signal import find_peaks

    least = 0.8 * float(score.max())
    wide = int(np.count_nonzero(score > least) / 50) + 1
    peaks, _ = find_peaks(np.concatenate([[0.0], score, [0.0]]), height=least, distance=wide)
    order = np.argsort(score[peaks - 1])[::-1][:HILLS]
    return [int(peaks[i] - 1) for i in order]


@dataclass(frozen=True)
class _Line:
    """As `ClockFit`; squares: what is left, relative; scale: size of the first signal over that of the second; free:
    degrees of freedom."""

    offset: float
    drift: float
    offset_deviation: float
    drift_deviation: float
    squares: float
    correlation: float
    scale: float
    free: int


def _line(a: _Signal, b: _Signal, middle: float, lag: float, reversed_fit: bool) -> _Line | None:
    """Least squares for offset and drift; back: the second signal is read at the times of the first. None where they
    hardly overlap."""
    source, read = (a, b) if reversed_fit else (b, a)
    every = len(source.at) // MOST + 1
    source = replace(source, at=source.at[::every], level=source.level[::every])
    value, slope = _smooth(read)
    # begins as t_read = t_known + shift
    line = np.array([-lag if reversed_fit else lag, 0.0])
    centre = middle + lag if reversed_fit else middle
    fitted = _Fitted(np.zeros(0), np.zeros((0, 0)), 0, 1.0)
    spread = 1.0
    for _ in range(ROUNDS):
        u = source.at - centre
        at = centre + line[0] + (1 + line[1]) * u
        inside = (at >= read.time[0]) & (at <= read.time[-1])
        if np.count_nonzero(inside) < LEAST:
            return None
        seen = np.interp(at[inside], read.time, value)
        rate = np.interp(at[inside], read.time, slope)
        spread = float(np.var(seen))
        fitted = _fitted(source.level[inside], seen, rate, u[inside], _is_ramp(a))
        change = np.linalg.lstsq(fitted.design, fitted.rest, rcond=None)[0][:2]
        line = line + change
        if abs(change[0]) < 1e-9 and abs(change[1]) < 1e-10:
            break
    first, second = _jackknife(fitted.design, fitted.rest)
    squares = float(np.sum(fitted.rest**2) / fitted.free / max(spread, 1e-300))
    correlation = float(np.sqrt(max(1 - squares, 0.0)))
    (offset, drift), scale = line, fitted.scale if reversed_fit else 1 / fitted.scale
    if reversed_fit:
        # t_b = centre + o + (1 + d)(t_a - centre), solved for t_a at the middle of the second recording
        drift = 1 / (1 + line[1]) - 1
        offset = centre + (middle - centre - line[0]) * (1 + drift) - middle
    return _Line(float(offset), float(drift), first, second, squares, correlation, scale, fitted.free)


@dataclass(frozen=True, eq=False)
class _Fitted:
    """rest: (n,) of the signal that is read, in its unit; design (n, m), its first columns those of offset and drift;
    free: degrees of freedom; scale: size of the known signal over that of the one that is read."""

    rest: np.ndarray
    design: np.ndarray
    free: int
    scale: float


def _fitted(level: np.ndarray, seen: np.ndarray, rate: np.ndarray, u: np.ndarray, ramp: bool) -> _Fitted:
    """What a shift leaves, and what a further one would change. level: (n,) of the known signal; seen, rate: of the
    other, at the same times; u: s, these times."""
    lines, level_index, times = np.unique(level, return_inverse=True, return_counts=True)
    moved = np.column_stack([-rate, -rate * u])
    slope = np.polyfit(level, seen, 1)[0]
    scale = float(1 / slope) if slope else np.inf
    if len(lines) <= len(level) / PASSES:
        # each line of an encoder has a place of its own: what is compared is where it is passed again
        def within(values: np.ndarray) -> np.ndarray:
            return values - (np.bincount(level_index, values) / times)[level_index]

        free = max(len(level) - len(lines) - 2, 1)
        return _Fitted(within(seen), np.column_stack([within(column) for column in moved.T]), free, scale)
    trend = [u] if ramp else []
    basis = np.column_stack([level, np.ones_like(level), *trend])
    residuals = seen - basis @ np.linalg.lstsq(basis, seen, rcond=None)[0]
    return _Fitted(residuals, np.column_stack([moved, basis]), max(len(level) - 4, 1), scale)


def _smooth(signal: _Signal) -> tuple[np.ndarray, np.ndarray]:
    """A signal as its mean over some samples, and its rate of change, (n,) each."""
    wide = np.pad(signal.value, REACH, mode="edge")
    value = np.convolve(wide, np.ones(2 * REACH + 1) / (2 * REACH + 1), mode="valid")
    return value, np.gradient(value, signal.time)


def _jackknife(design: np.ndarray, residuals: np.ndarray) -> tuple[float, float]:
    """Standard deviations of the first two unknowns, leaving out one block of time after the other."""
    blocks = np.array_split(np.arange(len(residuals)), BLOCKS)
    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0] = 1.0
    unit = design / scale
    gram, right = unit.T @ unit, unit.T @ residuals
    estimates = np.array(
        [
            np.linalg.lstsq(gram - unit[block].T @ unit[block], right - unit[block].T @ residuals[block], rcond=None)[
                0
            ][:2]
            for block in blocks
        ]
    )
    spread = estimates - estimates.mean(axis=0)
    deviation = np.sqrt((BLOCKS - 1) / BLOCKS * np.sum(spread**2, axis=0)) / scale[:2]
    return float(deviation[0]), float(deviation[1])
