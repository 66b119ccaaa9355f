"""What an input may be given as, made into a number or a `Signal`: the one place that does.

0.41                        a constant
"log.csv:speed"             a column of a log, in any unit that converts to that of the input
(times, values)             straight lines between; also an array of two rows or two columns
pandas Series               over its index (s, or dates and durations), in the unit of its ``attrs``
lambda t: 0.4 + 0.1 * t     a function of the time in s, sampled until straight lines follow it
Signal                      as it is
"""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.measured import column_of_log, in_unit, read_measured
from fmu_models.simulation.signal import Signal

if TYPE_CHECKING:
    import pandas

TOLERANCE = 1e-6  # of the largest value: by so much straight lines may miss a function
COARSEST = 256  # pieces that a function is looked at in, at the least
MOST_KNOTS = 200_000
SHORTEST = 2.0**-40  # of the run: a change within less is a jump
PROBES = (0.5, 0.2113, 0.7887)  # of a piece: where parabolas and cubics are furthest from a straight line
FORMS = "(times, values), a pandas Series, a function of time, a column LOG:COLUMN or a Signal"


def signals_of(fmu: Fmu, inputs: Mapping[str, Any], start: float, stop: float) -> dict[str, Any]:
    """Inputs of a run of an FMU from ``start`` to ``stop`` (s): each a number or a Signal in its unit.

    A name that the FMU does not have is left for others to refuse. Errors as for `signal_of`.
    """
    signals = dict(inputs)
    for name, value in inputs.items():
        if isinstance(value, (float, int, Signal)):
            continue
        variable = fmu.variables.get(owner(name, fmu.variables))
        if variable is not None:
            signals[name] = signal_of(value, start, stop, label=f"input '{name}'", unit=variable.unit)
    return signals


def signal_of(
    form: "float | str | Signal | Iterable[ArrayLike] | Callable[[float], Any] | pandas.Series",
    start: float,
    stop: float,
    *,
    label: str = "the input",
    unit: str | None = None,
    folder: Path | None = None,
    tolerance: float = TOLERANCE,
) -> float | Signal:
    """An input over a run from ``start`` to ``stop`` (s), from any of the forms above.

    Args:
        label: of the input, for messages.
        unit: of the input; None: not known, and nothing is converted.
        folder: that a relative path of a log starts from; the working folder if None.
        tolerance: of a function, relative to its largest value.

    Raises:
        StickslipError: none of these forms; a log, column, unit, time or value that does not do; says what to do.
    """
    if isinstance(form, Signal):
        return form
    if isinstance(form, (float, int, np.number)):
        return float(form)
    if isinstance(form, str) and ":" in form:
        path, column = column_of_log(form, folder)
        return read_measured(path).signal(column, unit, label)
    if hasattr(form, "index") and hasattr(form, "to_numpy"):
        return _of_series(cast("pandas.Series", form), unit, label)
    if callable(form):
        return _sampled(form, start, stop, tolerance, label)
    try:
        times, values = _pair(form)
    except (TypeError, ValueError):
        text = repr(form) if len(repr(form)) < 60 else f"{type(form).__name__} without times"
        raise StickslipError(
            f"{label[0].upper()}{label[1:]} must be a finite number, found {text}. What changes with time is {FORMS}."
        ) from None
    return _signal(times, values, label)


def _pair(form: Iterable[ArrayLike]) -> tuple[Vector, Vector]:
    if isinstance(form, np.ndarray) and form.ndim == 2 and form.shape[1] == 2 and form.shape[0] != 2:
        form = form.T
    times, values = (np.asarray(column, dtype=float) for column in form)
    if times.ndim != 1 or times.shape != values.shape or times.size < 2:
        raise ValueError
    return times, values


def _signal(times: Vector, values: Vector, label: str) -> Signal:
    for kind, numbers in (("time", times), ("value", values)):
        missing = np.flatnonzero(~np.isfinite(numbers))
        if missing.size:
            raise StickslipError(
                f"A {kind} of {label} is no finite number in row {missing[0] + 1} ({missing.size} times). Fill or cut "
                "these rows."
            )
    descents = np.flatnonzero(np.diff(times) < 0)
    if descents.size:
        row = int(descents[0])
        raise StickslipError(
            f"The times of {label} run back at row {row + 1} ({times[row]:.9g} s to {times[row + 1]:.9g} s). Sort them."
        )
    return Signal(times, values)


def _of_series(series: "pandas.Series", unit: str | None, label: str) -> Signal:
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
            f"The series for {label} needs at least two numbers over an index of times (s, durations or dates), found "
            f"{index.size} of type {series.dtype} over {index.dtype}."
        ) from None
    stated_unit = series.attrs.get("unit", series.attrs.get("units", {}).get(series.name))
    return _signal(times, in_unit(values, stated_unit, unit, f"The series for {label}"), label)


def _sampled(function: Callable[..., Any], start: float, stop: float, tolerance: float, label: str) -> Signal:
    """A function as straight lines that miss it by at most ``tolerance`` of its largest value, where three points of
    each show it; a jump is one within `SHORTEST` of the run."""

    def at(times: Vector) -> Vector:
        values = np.empty(times.size)
        for i, time in enumerate(times.tolist()):
            try:
                values[i] = function(time)
            except (TypeError, ValueError, ArithmeticError, LookupError) as error:
                raise StickslipError(f"The function for {label} fails at t = {time:.9g} s: {error}") from error
            if not math.isfinite(values[i]):
                raise StickslipError(
                    f"The function for {label} gives {values[i]} at t = {time:.9g} s; it must be finite."
                )
        return values

    times = np.linspace(start, stop, COARSEST + 1)
    values, open_pieces, allowed = at(times), np.ones(COARSEST, dtype=bool), 0.0
    shortest = max(SHORTEST * (stop - start), 4 * float(np.spacing(np.abs(times).max())))
    while open_pieces.any():
        if times.size > MOST_KNOTS:
            raise StickslipError(
                f"The function for {label} changes too fast: {MOST_KNOTS} straight lines do not follow it to "
                f"{tolerance:g} of its largest value. Give a smoother one, or (times, values)."
            )
        pieces = np.flatnonzero(open_pieces)
        width = np.diff(times)[pieces]
        allowed = tolerance * np.abs(values).max()
        probed = [at(times[pieces] + share * width) for share in PROBES]
        lines = [values[pieces] + share * np.diff(values)[pieces] for share in PROBES]
        misses = np.abs(np.subtract(probed, lines)).max(axis=0)
        split = (misses > allowed) & (width > shortest)
        at_piece = pieces[split]
        open_pieces[:] = False
        open_pieces[at_piece] = True
        open_pieces = np.insert(open_pieces, at_piece + 1, True)
        times = np.insert(times, at_piece + 1, (times[pieces] + PROBES[0] * width)[split])
        values = np.insert(values, at_piece + 1, probed[0][split])
    steep = (np.diff(times) <= shortest) & (np.abs(np.diff(values)) > allowed)
    times[:-1][steep] = times[1:][steep]
    return Signal(times, values)
