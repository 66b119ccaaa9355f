"""Counters of encoders: wraps undone by the counter's width, steps faster than any shaft found.

A counter of b bits shows the count modulo 2^b; of the steps that differ by a multiple of it the smallest is taken. A
step beyond what the shaft can do is a glitch: an excursion that comes back within a few samples is held at the value
before it, one that stays has lost or gained edges, and the log is split there.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.columns import TIME
from rig_io.logs.log import InstrumentCalibrations

WIDTHS = (8, 16, 24, 32)  # bits
FASTEST = 100.0  # rad/s, of any shaft of the rig; its drives reach 2.7
BELIEVED = 10.0  # rad/s, always believed: a log may hold few and quick slips
SPARE = 5.0  # times the step that one in a hundred exceeds is still believed
BRIEF = 10  # samples within which an excursion has to come back
TOO_MANY = 0.01  # of the samples: the counter, or what is stated of it, is wrong


@dataclass(frozen=True, eq=False)
class Glitches:
    """held: (n,) samples that are no counts; breaks: samples before which edges were lost for good."""

    held: np.ndarray
    breaks: tuple[int, ...]


def counted(
    columns: Mapping[str, np.ndarray],
    breaks: Sequence[int],
    calibration: InstrumentCalibrations,
    source: str,
    locate: Callable[[int], str],
) -> tuple[dict[str, np.ndarray], tuple[int, ...], tuple[str, ...]]:
    """Columns with all counts unwrapped and without glitches, where the log is to be split, and what was done.

    columns: (n,) each, ``time`` among them; breaks: samples at which a recording begins anew; locate: says where in the
    file ``source`` a sample stands, for messages.

    Raises:
        StickslipError: counts beyond the stated width, or more glitches than a sound counter has.
    """
    repaired, remarks = dict(columns), []
    ends = [0, *breaks, len(columns[TIME.name])]
    split = set(breaks)
    for name in columns:
        instrument = name.removesuffix("_count")
        if instrument == name:
            continue
        encoder = calibration.need(instrument)
        counts = columns[name][np.isfinite(columns[name])]
        if encoder.counter_bits is not None and not _holds(counts, encoder.counter_bits):
            raise StickslipError(
                f"{source}: '{name}' runs from {np.min(counts):.0f} to {np.max(counts):.0f}, which a counter of "
                f'{encoder.counter_bits} bits does not hold. Mend or remove "counter_bits" in the calibration.'
            )
        lost = []
        mask = np.zeros(len(columns[name]), dtype=bool)
        for first, last in pairwise(ends):
            span = slice(first, last)
            count, unwraps, bits = unwrapped(columns[name][span], encoder.counter_bits)
            if unwraps and encoder.counter_bits is None:
                remarks.append(
                    f"'{name}' was taken for a counter of {bits} bits and unwrapped ({unwraps} times). State its width "
                    f'under "calibration": "{instrument}": {{"counter_bits": {bits}}}.'
                )
            bad = glitches(columns[TIME.name][span], count, encoder.pitch)
            mask[span] = bad.held
            lost += [first + at for at in bad.breaks]
            repaired[name] = np.concatenate([repaired[name][:first], hold(count, bad.held), repaired[name][last:]])
        if np.count_nonzero(mask) + len(lost) > TOO_MANY * len(mask):
            raise StickslipError(
                f"{source}: '{name}' steps faster than a shaft can turn at {np.count_nonzero(mask) + len(lost)} "
                f"samples, the first on {locate(int(np.argmax(mask)) if mask.any() else lost[0])}. Check the cable, "
                "the width of the counter (counter_bits) and pulses_per_revolution."
            )
        if mask.any():
            remarks.append(
                f"'{name}' leaps and comes back, faster than a shaft can turn: {np.count_nonzero(mask)} samples were "
                f"held at the count beside, the first on {locate(int(np.argmax(mask)))}."
            )
            stamps = f"{instrument}_edge_time"
            if stamps in repaired:
                repaired[stamps] = hold(repaired[stamps], mask)
        if lost:
            leap = repaired[name][lost[0]] - repaired[name][lost[0] - 1]
            remarks.append(
                f"'{name}' leaps by {leap:.0f} on {locate(lost[0])} and stays there, faster than a shaft can turn "
                f"({len(lost)} such leaps): edges were lost. The log is split there."
            )
            split |= set(lost)
    return repaired, tuple(sorted(split)), tuple(remarks)


def unwrapped(count: np.ndarray, bits: int | None) -> tuple[np.ndarray, int, int]:
    """Counts (n,) without wraps, how many were undone, and the width in bits (0: no wrap, no width stated).

    Without a stated width the smallest of `WIDTHS` that holds all counts is tried; its wraps must leave ordinary steps.
    Counts may be NaN, and are left so.
    """
    good = np.flatnonzero(np.isfinite(count))
    steps = np.diff(count[good])
    if not steps.size:
        return count, 0, bits or 0
    if bits is None:
        bits = next((b for b in WIDTHS if _holds(count[good], b)), 0)
        size = 2.0**bits
        leaps = np.abs(steps) > size / 2
        if not bits or not leaps.any() or leaps.mean() > TOO_MANY:
            return count, 0, 0
        remainders = steps[leaps] - size * np.round(steps[leaps] / size)
        if np.max(np.abs(remainders)) > _usual(steps[~leaps]):
            return count, 0, 0
    size = 2.0**bits
    wraps = np.round(steps / size)
    unwrapped_count = count.copy()
    unwrapped_count[good[1:]] -= size * np.cumsum(wraps)
    return unwrapped_count, int(np.count_nonzero(wraps)), bits


def _holds(count: np.ndarray, bits: int) -> bool:
    low, high = float(np.min(count)), float(np.max(count))
    return (low >= 0 and high < 2.0**bits) or (low >= -(2.0 ** (bits - 1)) and high < 2.0 ** (bits - 1))


def _usual(steps: np.ndarray) -> float:
    """Greatest step that is still believed."""
    return SPARE * float(np.quantile(np.abs(steps), 0.99)) + 3.0 if steps.size else 3.0


def glitches(time: np.ndarray, count: np.ndarray, pitch: float) -> Glitches:
    """Steps of a count (n,) that are faster than any shaft. time: (n,) s, rising; pitch: rad."""
    mask = np.zeros(len(count), dtype=bool)
    good = np.flatnonzero(np.isfinite(count))
    steps = np.diff(count[good])
    if not steps.size:
        return Glitches(mask, ())
    interval = float(np.median(np.diff(time)))
    fastest = float(np.clip(_usual(steps), BELIEVED * interval / pitch, max(FASTEST * interval / pitch, 3.0)))
    passed = np.diff(time[good]) / interval  # more than one where samples are missing
    fast = list(np.flatnonzero(np.abs(steps) > fastest * np.maximum(passed, 1.0)))
    breaks = []
    while fast:
        leap = fast.pop(0)
        neighbours = [leap_index for leap_index in fast if leap_index - leap <= BRIEF]
        return_leap = next(
            (o for o in neighbours if abs(count[good[o + 1]] - count[good[leap]]) <= fastest * (o + 1 - leap)), None
        )
        if return_leap is not None:
            mask[good[leap + 1 : return_leap + 1]] = True
            fast = [leap_index for leap_index in fast if leap_index > return_leap]
        elif leap + 1 <= BRIEF or len(good) - 1 - leap <= BRIEF:  # at an end of the log too little is left to part
            mask[good[: leap + 1] if leap + 1 <= BRIEF else good[leap + 1 :]] = True
            fast = [leap_index for leap_index in fast if not mask[good[leap_index + 1]]]
        else:
            breaks.append(int(good[leap + 1]))
    return Glitches(mask, tuple(breaks))


def hold(values: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Values (n,) with the last one before in place of those that are ``held`` (the first after, at the begin)."""
    valid = np.flatnonzero(~mask)
    return values[valid[np.maximum(np.searchsorted(valid, np.arange(len(values)), side="right") - 1, 0)]]
