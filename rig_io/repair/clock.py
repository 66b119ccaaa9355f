"""The clock of a log: stamps mended where that is sure, refused with the repair that is named where it is not.

no number               the row is left out
a fall to a new begin   the clock was reset, or runs were joined: split there; the later part is moved on in time
any other fall          refused, or sorted by ``repair``
many rows on one stamp  printed with too few digits: rebuilt from the even interval that fits within the last digit
few doubled stamps      refused, or the first kept by ``repair``
gaps, jitter            kept as they are
"""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from rig_io.logs.columns import TIME
from rig_io.logs.log import GAP, stretches
from rig_io.logs.table import Table

SHORTEST = 10  # samples; fewer cannot show a single movement
UNEVEN = 0.02  # of the sample interval: a clock that departs by less counts as even
SHARE = 0.05  # of the steps that must be uneven before the digits are blamed: a lost or doubled row is rarer
DIGITS = 9  # after the point, the most that are looked at

REPAIRS = {"sort": "sorts the rows by time", "duplicates": "keeps the first of rows with one time"}


@dataclass(frozen=True, eq=False)
class Clock:
    """rows: (n,) rows of the file that are kept, in their order; time: (n,) s, rising; moved: (n,) s, what was added to
    the stamps of a row because of a reset; breaks: first rows (of n) of further recordings; said: what was mended."""

    rows: np.ndarray
    time: np.ndarray
    moved: np.ndarray
    breaks: tuple[int, ...]
    said: tuple[str, ...]


def check_repairs(repair: Collection[str]) -> None:
    """Raises StickslipError: a repair that is not known."""
    for name in repair:
        if name not in REPAIRS:
            listing = "; ".join(f"'{key}' {meaning}" for key, meaning in REPAIRS.items())
            raise StickslipError(f"There is no repair '{name}'.{nearest(name, REPAIRS)} Known are: {listing}.")


def mended(stamps: np.ndarray, table: Table, repair: Collection[str]) -> Clock:
    """The clock of a log from its stamps (n_rows,) in s.

    table: where they are from; doubled rows are known by its other columns. repair: names from `REPAIRS`.

    Raises:
        StickslipError: no stamp is a number; stamps fall or repeat in a way that is not mended; unknown repair.
    """
    check_repairs(repair)
    remarks = []
    rows = np.flatnonzero(np.isfinite(stamps))
    lost = len(stamps) - len(rows)
    if not len(rows):
        raise StickslipError(f"{table.source}: column 'time' holds no number. Check the column.")
    if lost:
        first = int(np.argmax(~np.isfinite(stamps)))
        remarks.append(f"{lost} rows without a time were left out, the first on {table.place(first)}.")
    if "sort" in repair and np.any(np.diff(stamps[rows]) < 0):
        order = np.argsort(stamps[rows], kind="stable")
        remarks.append(f"{np.count_nonzero(order != np.arange(len(order)))} rows were moved to sort them by time.")
        rows = rows[order]
    begins = [0, *_resets(stamps[rows], rows, table), len(rows)]
    kept_rows, times, moved, breaks = [], [], [], []
    for first, last in pairwise(begins):
        span = rows[first:last]
        chosen, time = _risen(span, stamps[span], table, repair, remarks)
        shift = 0.0
        if times:
            shift = times[-1][-1] + _interval(time) - time[0]
            breaks.append(sum(map(len, times)))
            remarks.append(
                f"time falls to {time[0]:.9g} s on {table.place(int(span[0]))}: the clock was reset, or two runs were "
                f"joined. The log is split there, the stamps after it moved on by {shift:.9g} s."
            )
        if np.any(np.diff(time + shift) <= 0):
            raise StickslipError(
                f"{table.source}: time reaches {times[-1][-1]:g} s on {table.place(int(kept_rows[-1][-1]))}, beside "
                "which the steps of the stamps after it vanish. Correct that stamp, or leave the row out."
            )
        kept_rows.append(chosen)
        times.append(time + shift)
        moved.append(np.full(len(time), shift))
    return Clock(np.concatenate(kept_rows), np.concatenate(times), np.concatenate(moved), tuple(breaks), tuple(remarks))


def _interval(time: np.ndarray) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def _resets(time: np.ndarray, rows: np.ndarray, table: Table) -> list[int]:
    """Where time falls because it begins anew: whole runs on both sides, each going on at its interval."""
    steps = np.diff(time)
    falls = np.flatnonzero(steps < 0)
    if not falls.size:
        return []
    begins = falls + 1
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    long = np.diff(np.concatenate([[0], begins, [len(time)]])).min() >= SHORTEST
    if long and np.all(-steps[falls] >= SHORTEST * step) and np.all(steps[begins] <= SHORTEST * step):
        return [int(start) for start in begins]
    raise StickslipError(
        f"{table.source}: time falls from {time[falls[0]]:.9g} s to {time[begins[0]]:.9g} s on "
        f"{table.place(int(rows[begins[0]]))} ({falls.size} such steps), and not because a whole run begins anew: rows "
        "are out of order. Sort them by time, or let it be done: --repair sort."
    )


def _risen(
    rows: np.ndarray, time: np.ndarray, table: Table, repair: Collection[str], remarks: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and strictly rising times of one recording whose stamps do not fall."""
    same = np.flatnonzero(np.diff(time) == 0)
    others = [column for name, column in table.columns.items() if name != TIME.name]
    copies = np.ones(len(same), dtype=bool)
    for column in others:
        copies &= np.isclose(column[rows[same]], column[rows[same + 1]], rtol=0, atol=0, equal_nan=True)
    if not same.size or np.mean(copies) <= 0.5:
        rebuilt = _rebuilt(time)
        if rebuilt is not None:
            even, resolution = rebuilt
            longest = int(np.ptp(stretches(np.diff(time) == 0), axis=1).max(initial=0))
            shared = f"up to {longest + 1} rows share a stamp" if same.size else "steps are uneven"
            remarks.append(
                f"time is printed to {resolution:g} s only, so that {shared}: it was rebuilt from the interval of "
                f"{_interval(even):.6g} s. Write time with nine digits after the point."
            )
            return rows, even
    if not same.size:
        return rows, time
    if "duplicates" in repair:
        remarks.append(f"{same.size} rows with the time of the row before were left out.")
        keep = np.concatenate([[True], np.diff(time) > 0])
        return rows[keep], time[keep]
    raise StickslipError(
        f"{table.source}: {table.place(int(rows[same[0] + 1]))} repeats the time {time[same[0]]:.9g} s ({same.size} "
        "repeats). Remove doubled rows, or let it be done: --repair duplicates; if the stamps are too coarse, write "
        "time with nine digits after the point."
    )


def _rebuilt(time: np.ndarray) -> tuple[np.ndarray, float] | None:
    """An even clock (n,) that every stamp is a rounded or cut-off print of, and the coarsest print's step in s.

    None if the stamps are even as they are, or if no even clock explains them. Gaps are kept: each stretch between
    them has its own line.
    """
    steps = np.diff(time)
    if len(time) < 2 * SHORTEST or not np.any(steps > 0):
        return None
    mean = (time[-1] - time[0]) / len(steps)
    if np.all(np.abs(steps - mean) <= UNEVEN * mean):
        return None
    last_digit = _resolution(time)
    usual = float(np.median(steps[steps > 0]))
    leaps = np.flatnonzero(steps > GAP * np.maximum(usual, last_digit[1:])) + 1
    even = np.empty(len(time))
    uneven: list[np.ndarray] = []  # of each stretch: steps that are not its interval
    for first, last in zip([0, *leaps], [*leaps, len(time)], strict=True):
        stamps, digit = time[first:last], last_digit[first:last]
        if len(stamps) < SHORTEST:
            return None
        line = _line(stamps, digit)
        # a print cut off instead of rounded is a digit late; where no stamp repeats a lost row must not pass for that
        within = 1.05 if np.any(np.diff(stamps) == 0) else 0.55
        if line[1] <= line[0] or np.any(np.abs(stamps - line) > within * digit):
            return None
        even[first:last] = line
        uneven.append(np.flatnonzero(np.abs(np.diff(stamps) - (line[1] - line[0])) > UNEVEN * (line[1] - line[0])))
    odd = sum(off.size for off in uneven)
    if odd < SHORTEST or odd < SHARE * sum(np.ptp(off) for off in uneven if off.size):
        return None
    return even, float(np.max(last_digit))


def _line(stamps: np.ndarray, digit: np.ndarray) -> np.ndarray:
    """Even clock (n,) through stamps that show no less than ``digit`` (n,) s.

    Halfway between two stamps lies the instant at which the print changed: known within a sample, however coarse it is.
    """
    number = np.arange(len(stamps), dtype=float)
    change = np.flatnonzero(np.diff(stamps) > 0)
    if len(change) < 2:
        return np.zeros_like(stamps)
    at, height = number[change] + 0.5, 0.5 * (stamps[change] + stamps[change + 1])
    share = 1 / np.minimum(digit[change + 1], (stamps[-1] - stamps[0]) / (len(stamps) - 1)) ** 2
    share /= share.sum()
    middle, level = share @ at, share @ height
    slope = share @ ((at - middle) * (height - level)) / (share @ (at - middle) ** 2)
    return level + slope * (number - middle)


def _resolution(time: np.ndarray) -> np.ndarray:
    """Step (n,) in s of the last digit that the stamps of each decade show: six digits are 10 us at 5 s."""
    decade = np.floor(np.log10(np.maximum(np.abs(time), 10.0**-DIGITS)))
    step = np.empty(len(time))
    decades = np.unique(decade)
    if len(decades) > 1:  # zero shows no digits: it counts with the next
        decade[decade == -DIGITS] = decades[decades > -DIGITS][0]
    for number in np.unique(decade):
        in_decade = decade == number
        digits = -int(number)
        while digits < DIGITS and np.any(
            np.abs(np.round(time[in_decade] * 10.0**digits) - time[in_decade] * 10.0**digits) > 1e-4
        ):
            digits += 1
        step[in_decade] = 10.0**-digits
    return step
