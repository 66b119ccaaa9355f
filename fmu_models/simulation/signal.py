"""Inputs of a run: piecewise linear in time, so that every bend is known and nothing is smeared over a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown


@dataclass(frozen=True, eq=False)
class Signal(Shown):
    """An input over time: straight lines between knots; two knots at one time are a jump.

    Attributes:
        time: (n,) s, ascending; the signal must cover the run.
        value: (n,) in the unit of the input.

    Raises:
        StickslipError: shapes differ, values are not finite, or times descend.
    """

    time: Vector
    value: Vector

    def __init__(self, time: ArrayLike, value: ArrayLike) -> None:
        times, values = np.array(time, dtype=float), np.array(value, dtype=float)
        if times.ndim != 1 or times.shape != values.shape or times.size < 2:
            raise StickslipError(
                "A signal needs one value per time and at least two of them, "
                f"found shapes {times.shape} and {values.shape}."
            )
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise StickslipError("A signal has times or values that are not finite. Remove or fill them.")
        if (np.diff(times) < 0).any():
            row = int(np.argmax(np.diff(times) < 0)) + 1
            raise StickslipError(
                f"The times of a signal descend at row {row} ({times[row - 1]:g} s to {times[row]:g} s). Sort them."
            )
        times.flags.writeable = values.flags.writeable = False
        object.__setattr__(self, "time", times)
        object.__setattr__(self, "value", values)

    @classmethod
    def constant(cls, value: float, start: float, stop: float) -> Signal:
        """The same value throughout [start, stop]."""
        return cls([start, stop], [value, value])

    @classmethod
    def held(cls, time: ArrayLike, value: ArrayLike) -> Signal:
        """Values that hold until the time of the next one: a jump there."""
        return cls(np.repeat(np.asarray(time), 2)[1:], np.repeat(np.asarray(value), 2)[:-1])

    @cached_property
    def bends(self) -> Vector:
        """(k,) s, knots but those between equal values: a run need not stop where a level just goes on."""
        level = np.diff(self.value) == 0
        return self.time[~(np.append(False, level) & np.append(level, False))]

    def piece(self, times: Vector) -> tuple[Vector, Vector]:
        """Value and slope just after each of ``times`` (m,), both (m,)."""
        last = np.searchsorted(self.time, times, side="right") - 1
        piece = np.clip(last, 0, self.time.size - 2)
        span = self.time[piece + 1] - self.time[piece]
        # at the very end there is no piece to the right: go on with the last value
        rise = self.value[piece + 1] - self.value[piece]
        slope = np.where((span > 0) & (last < self.time.size - 1), rise / np.where(span > 0, span, 1), 0.0)
        base = np.where(last > piece, last, piece)
        return self.value[base] + slope * (times - self.time[base]), slope


Knots = tuple[Vector, Vector, Vector]


def knots(signals: Mapping[str, Signal], start: float, stop: float, step_ends: Vector | None = None) -> Knots:
    """Common table of several signals over [start, stop], with more times if steps are to end at these too.

    Returns:
        times (k,) ascending from ``start``; values and slopes just after each of them, (k, len(signals)).

    Raises:
        StickslipError: a signal does not cover the run.
    """
    for name, signal in signals.items():
        if signal.time[0] > start or signal.time[-1] < stop:
            raise StickslipError(
                f"The signal for input '{name}' covers {signal.time[0]:.9g} s to {signal.time[-1]:.9g} s, "
                f"the run {start:.9g} s to {stop:.9g} s. Extend the signal or shorten the run."
            )
    # a run may need a small part of a long signal
    bends = [signal.bends for signal in signals.values()]
    inner = [b[np.searchsorted(b, start, side="right") : np.searchsorted(b, stop)] for b in bends]
    times = np.unique(np.concatenate([[start], *inner, [] if step_ends is None else step_ends]))
    values, slopes = np.empty((times.size, len(signals))), np.empty((times.size, len(signals)))
    for i, signal in enumerate(signals.values()):
        values[:, i], slopes[:, i] = signal.piece(times)
    return times, values, slopes
