"""What an input may be given as, made into a number or a `Signal`: the one place that does.

0.41                        a constant
"log.csv:speed"             a column of a log, in any unit that converts to that of the input
(times, values)             straight lines between; also an array of two rows or two columns
pandas Series               over its index (s, or dates and durations), in the unit of its ``attrs``
lambda t: 0.4 + 0.1 * t     a function of the time in s, sampled until straight lines follow it
Signal                      as it is
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.measured import column_of_log, in_unit, read_measured
from fmu_models.simulation.signal import Signal

TOLERANCE = 1e-6  # of the largest value: by so much straight lines may miss a function
COARSEST = 256  # pieces that a function is looked at in, at the least
MOST_KNOTS = 200_000
SHORTEST = 2.0**-40  # of the run: a change within less is a jump
PROBES = (0.5, 0.2113)  # of a piece: where parabolas and cubics are furthest from a straight line
FORMS = "(times, values), a pandas Series, a function of time, a column LOG:COLUMN or a Signal"


def signals_of(fmu: Fmu, given: Mapping[str, Any], start: float, stop: float) -> dict[str, Any]:
    """Inputs of a run of an FMU from ``start`` to ``stop`` (s): each a number or a Signal in its unit.

    A name that the FMU does not have is left for others to refuse.

    Raises:
        StickslipError: as for `signal_of`.
    """
    found = dict(given)
    for name, value in given.items():
        if isinstance(value, (float, int, Signal)):
            continue
        variable = fmu.variables.get(owner(name, fmu.variables))
        if variable is not None:
            found[name] = signal_of(value, start, stop, what=f"input '{name}'", unit=variable.unit)
    return found


def signal_of(
    given: Any,
    start: float,
    stop: float,
    *,
    what: str = "the input",
    unit: str | None = None,
    folder: Path | None = None,
    tolerance: float = TOLERANCE,
) -> float | Signal:
    """An input over a run from ``start`` to ``stop`` (s), from any of the forms above.

    Args:
        what: it is, for messages.
        unit: of the input; None: not known, and nothing is converted.
        folder: that a relative path of a log starts from; the working folder if None.
        tolerance: of a function, relative to its largest value.

    Raises:
        StickslipError: none of these forms; a log, column, unit, time or value that does not do; says what to do.
    """
    if isinstance(given, Signal):
        return given
    if isinstance(given, (float, int, np.number)):
        return float(given)
    if isinstance(given, str) and ":" in given:
        path, column = column_of_log(given, folder)
        return read_measured(path).signal(column, unit, what)
    if hasattr(given, "index") and hasattr(given, "to_numpy"):
        return _of_series(given, unit, what)
    if callable(given):
        return _sampled(given, start, stop, tolerance, what)
    try:
        times, values = _pair(given)
    except (TypeError, ValueError):
        text = repr(given) if len(repr(given)) < 60 else f"{type(given).__name__} without times"
        raise StickslipError(
            f"{what[0].upper()}{what[1:]} must be a finite number, found {text}. What changes with time is {FORMS}."
        ) from None
    return _signal(times, values, what)


def _pair(given: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    if isinstance(given, np.ndarray) and given.ndim == 2 and given.shape[1] == 2 and given.shape[0] != 2:
        given = given.T
    times, values = (np.asarray(part, dtype=float) for part in given)
    if times.ndim != 1 or times.shape != values.shape or times.size < 2:
        raise ValueError
    return times, values


def _signal(times: NDArray[np.float64], values: NDArray[np.float64], what: str) -> Signal:
    for kind, numbers in (("time", times), ("value", values)):
        missing = np.flatnonzero(~np.isfinite(numbers))
        if missing.size:
            raise StickslipError(
                f"A {kind} of {what} is no finite number in row {missing[0] + 1} ({missing.size} times). Fill or cut "
                "these rows."
            )
    back = np.flatnonzero(np.diff(times) < 0)
    if back.size:
        row = int(back[0])
        raise StickslipError(
            f"The times of {what} run back at row {row + 1} ({times[row]:.9g} s to {times[row + 1]:.9g} s). Sort them."
        )
    return Signal(times, values)


def _of_series(series: Any, unit: str | None, what: str) -> Signal:
    """A series of pandas over its index: s, durations, or dates from the first on."""
    index = np.asarray(series.index)
    if index.dtype.kind == "M" and index.size:
        index = index - index[0]
    if index.dtype.kind == "m":
        index = index / np.timedelta64(1, "s")
    try:
        times, values = _pair((index, series.to_numpy()))
    except (TypeError, ValueError):
        raise StickslipError(
            f"The series for {what} needs at least two numbers over an index of times (s, durations or dates), found "
            f"{index.size} of type {series.dtype} over {index.dtype}."
        ) from None
    own = series.attrs.get("unit", series.attrs.get("units", {}).get(series.name))
    return _signal(times, in_unit(values, own, unit, f"The series for {what}"), what)


def _sampled(function: Callable[..., Any], start: float, stop: float, tolerance: float, what: str) -> Signal:
    """A function as straight lines that miss it by at most ``tolerance`` of its largest value, where two points of each
    show it; a jump is one within `SHORTEST` of the run."""

    def at(times: NDArray[np.float64]) -> NDArray[np.float64]:
        found = np.empty(times.size)
        for i, time in enumerate(times.tolist()):
            try:
                found[i] = function(time)
            except (TypeError, ValueError, ArithmeticError, LookupError) as error:
                raise StickslipError(f"The function for {what} fails at t = {time:.9g} s: {error}") from error
            if not math.isfinite(found[i]):
                raise StickslipError(
                    f"The function for {what} gives {found[i]} at t = {time:.9g} s; it must be finite."
                )
        return found

    times = np.linspace(start, stop, COARSEST + 1)
    values, open_pieces, allowed = at(times), np.ones(COARSEST, dtype=bool), 0.0
    shortest = max(SHORTEST * (stop - start), 4 * float(np.spacing(np.abs(times).max())))
    while open_pieces.any():
        if times.size > MOST_KNOTS:
            raise StickslipError(
                f"The function for {what} changes too fast: {MOST_KNOTS} straight lines do not follow it to "
                f"{tolerance:g} of its largest value. Give a smoother one, or (times, values)."
            )
        left = np.flatnonzero(open_pieces)
        width = np.diff(times)[left]
        allowed = tolerance * np.abs(values).max()
        middle = at(times[left] + PROBES[0] * width)
        misses = np.abs(middle - values[left] - PROBES[0] * np.diff(values)[left])
        aside = at(times[left] + PROBES[1] * width)
        misses = np.maximum(misses, np.abs(aside - values[left] - PROBES[1] * np.diff(values)[left]))
        split = (misses > allowed) & (width > shortest)
        at_piece = left[split]
        open_pieces[:] = False
        open_pieces[at_piece] = True
        open_pieces = np.insert(open_pieces, at_piece + 1, True)
        times = np.insert(times, at_piece + 1, (times[left] + PROBES[0] * width)[split])
        values = np.insert(values, at_piece + 1, middle[split])
    steep = (np.diff(times) <= shortest) & (np.abs(np.diff(values)) > allowed)
    times[:-1][steep] = times[1:][steep]
    return Signal(times, values)
