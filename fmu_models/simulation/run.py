"""Simulate an exported FMU: one call into its own engine per run, in an instance that is kept for the next one."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.shown import Shown
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import engine_of, indicators_of
from fmu_models.simulation.inputs import signals_of
from fmu_models.simulation.signal import Knots, Signal, knots
from fmu_models.simulation.trajectory import Columns, Sides, Trajectory

if TYPE_CHECKING:
    from fmpy.model_description import ScalarVariable

Progress = Callable[[float], None] | None  # called with the share that is done


def simulate(
    fmu: Fmu,
    stop_time: float,
    *,
    start_time: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    output_times: ArrayLike | None = None,
    tolerance: float = 1e-14,
    sides: bool = False,
    progress: Progress = None,
) -> Trajectory:
    """Run an FMU of this suite from ``start_time`` to ``stop_time`` (s).

    Args:
        parameters: values that replace the defaults, in the units of the FMU.
        start: values of states at ``start_time``; for a start inside a stop that remembers its speed of entry also
            ``<stop>_memory``, m/s.
        inputs: per input a constant, or what changes with time in one of the forms of ``inputs.signal_of`` (a Signal, a
            column of a log, times and values, a pandas Series, a function); its rate is the slope of its Signal.
        output_times: (n,) s, ascending, within the run; default 1001 equally spaced.
        tolerance: relative local error of a step. Values above 1e-14 have no effect: the engine's default costs little.
        sides: record also what was right before and after each event between the output times (``Trajectory.sides``).
        progress: called with the fraction of output times done, several times a second.

    Raises:
        StickslipError: unknown name, value out of its range, times out of order, an FMU of somebody else, or a motion
            that the engine cannot continue (the message says when and why).
    """
    check_tolerance(tolerance)
    values = parameters, start, inputs
    return _trajectory(fmu, facts_of(fmu), tolerance, start_time, stop_time, values, output_times, sides, progress)


@dataclass(frozen=True)
class Repeated:
    """One run of ``simulate``, to be made again: at other times, with steps that end at given times too."""

    fmu: Fmu
    stop_time: float
    start_time: float
    tolerance: float
    parameters: Mapping[str, float]
    start: Mapping[str, float]
    inputs: Mapping[str, float | Signal]

    def trajectory(self, output_times: ArrayLike | None, ends: Vector, progress: Progress) -> Trajectory:
        """The run with steps that end at ``ends`` (k,) s as well as where they would by themselves."""
        times = checked_times(output_times, self.start_time, self.stop_time)
        return facts_of(self.fmu).trajectory(times, self._rows(times, ends, progress=progress))

    def record(self, times: Vector, ends: Vector | None) -> Vector:
        """(n, 2 s + d) the s states, their rates and the d deciding functions at times (n,), by direct evaluation.

        A deciding function, the event indicator of a contact, is positive while the contact may keep its state.
        """
        return self._rows(times, ends, facts_of(self.fmu).deciding).values[: times.size]

    def _rows(
        self, times: Vector, ends: Vector | None, recorded: NDArray[np.uint32] | None = None, progress: Progress = None
    ) -> whole_run.Result:
        span, values = (self.start_time, self.stop_time), (self.parameters, self.start, self.inputs)
        return _rows(self.fmu, facts_of(self.fmu), self.tolerance, span, values, times, progress, ends, recorded)

    @property
    def kinks(self) -> Vector:
        """Times s within the run at which an input has a knot, the start and the end."""
        signals = [s for s in self.inputs.values() if isinstance(s, Signal)]
        times = np.concatenate([[self.start_time, self.stop_time], *(signal.time for signal in signals)])
        return np.unique(times[(times >= self.start_time) & (times <= self.stop_time)])

    def deciding_name(self, index: int) -> str:
        """The name of a deciding function."""
        reference = int(facts_of(self.fmu).deciding[2 * len(self.fmu.states) + index])
        names = {int(v.valueReference): name for name, v in self.fmu.variables.items()}
        return names.get(reference, f"event indicator {index}")


class KeptRun(Shown):
    """Runs of one FMU of this suite, one after the other or in several threads at once; a context manager.

    Each run starts afresh: it is that of ``simulate`` to the last bit, whatever was run before it.

    Args:
        tolerance: relative local error of a step, as for ``simulate``.

    Raises:
        StickslipError: the tolerance is none, or an FMU of somebody else.
    """

    def __init__(self, fmu: Fmu, *, tolerance: float = 1e-14) -> None:
        check_tolerance(tolerance)
        self.fmu, self.tolerance = fmu, tolerance
        self._facts: RunFacts | None = facts_of(fmu)

    def _contents(self) -> dict[str, object]:
        return {"model": self.fmu.description.modelName, "tolerance": self.tolerance}

    def __enter__(self) -> KeptRun:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """No run afterwards."""
        self._facts = None

    def __call__(
        self,
        stop_time: float,
        *,
        start_time: float = 0.0,
        parameters: Mapping[str, float] | None = None,
        start: Mapping[str, float] | None = None,
        inputs: Mapping[str, Any] | None = None,
        output_times: ArrayLike | None = None,
        sides: bool = False,
        progress: Progress = None,
    ) -> Trajectory:
        """The run of ``simulate`` with these arguments. StickslipError: as for ``simulate``, after which the next run
        is as any other; or this was closed."""
        if self._facts is None:
            raise StickslipError("The runs of this FMU are closed. Open a KeptRun again.")
        given, values = (self.fmu, self._facts, self.tolerance), (parameters, start, inputs)
        return _trajectory(*given, start_time, stop_time, values, output_times, sides, progress)


def _trajectory(
    fmu: Fmu, model: RunFacts, tolerance: float, start: float, stop: float, values: _Values,
    output_times: ArrayLike | None, sides: bool, progress: Progress,
) -> Trajectory:  # fmt: skip
    """The run of ``simulate``; arguments in their order, since names cost time."""
    check_span(start, stop)
    times = checked_times(output_times, start, stop)
    return model.trajectory(times, _rows(fmu, model, tolerance, (start, stop), values, times, progress, sides=sides))


def _rows(
    fmu: Fmu, model: RunFacts, tolerance: float, span: tuple[float, float], values: _Values, times: Vector,
    progress: Progress, ends: Vector | None = None, recorded: NDArray[np.uint32] | None = None, sides: bool = False,
) -> whole_run.Result:  # fmt: skip
    """The values of the recorded variables. At ``ends`` steps have to end beside where they would."""
    initial, driven = settings_of(fmu, model, span, values, ends)
    stops = np.concatenate((times, [span[1]])) if times.item(-1) < span[1] else times
    references = model.recorded if recorded is None else recorded
    engine = model.engine
    instance = engine.take()
    try:
        begin = initial, span[0], tolerance
        return whole_run.run(engine, instance, begin, stops, references, driven, sides, progress)
    finally:
        engine.give(instance)


def settings_of(
    fmu: Fmu, model: RunFacts, span: tuple[float, float], values: _Values, ends: Vector | None = None
) -> tuple[dict[int, float], tuple[NDArray[np.uint32], Knots] | None]:
    """Start values by reference, and the inputs that change with time, for a request; the rest as for ``_rows``."""
    parameters, start, inputs = values
    initial: dict[int, float] = {}
    signals: dict[str, Signal] = {}
    if parameters:
        _set(fmu, "parameter", parameters, model.parameters, initial)
    if start:
        _set(fmu, "state", start, model.states, initial)
    if inputs:
        check_names(fmu, "input", inputs, model.inputs)
        signals = _set(fmu, "input", signals_of(fmu, inputs, *span), model.inputs, initial)
    if not signals and ends is None:
        return initial, None
    table = knots(signals, *span, ends)
    references = [model.inputs[name][0] for name in signals]
    for i, name in enumerate(signals):
        initial[references[i]], initial[model.rates[name]] = table[1][0, i], table[2][0, i]
    return initial, (np.array(references, dtype=np.uint32), table)


def _set(
    fmu: Fmu, kind: str, values: Mapping[str, float | Signal], settable: _Settable, initial: dict[int, float]
) -> dict[str, Signal]:
    """Write checked start values by reference; the inputs that change with time are returned."""
    signals: dict[str, Signal] = {}
    for name, value in values.items():
        if name not in settable:
            check_names(fmu, kind, values, settable)
        reference, low, high = settable[name]
        if isinstance(value, _PLAIN) and low <= value <= high:
            initial[reference] = value
        elif not isinstance(value, Signal):
            check_names(fmu, kind, values, settable)
            check_value(fmu, name, value)
            initial[reference] = value
        elif kind == "input":
            signals[name] = value
        else:
            raise StickslipError(f"'{name}' is a {kind} and takes a number, found a Signal: only inputs change.")
    return signals


_PLAIN = (float, int)
# parameters, start states and inputs of a run, by name
_Values = tuple[Mapping[str, float] | None, Mapping[str, float] | None, Mapping[str, Any] | None]
_Settable = dict[str, tuple[int, float, float]]  # by name: value reference, least and largest value


class RunFacts:
    """What does not change from run to run of an FMU: its engine, value references by name, what is recorded."""

    def __init__(self, fmu: Fmu) -> None:
        def reference(name: str) -> int:
            if name not in fmu.variables:
                raise StickslipError(
                    f"'{fmu.path}' is damaged: its description has no variable '{name}'. Export it again."
                )
            return fmu.variables[name].valueReference

        def settable(names: Iterable[str]) -> _Settable:
            return {name: (reference(name), *bounds_of(fmu.variables[name])) for name in names}

        self.engine = engine_of(fmu, runs_alone=True)
        self.parameters = settable(fmu.parameters)
        self.states = settable([*fmu.states, *fmu.memories])
        self.inputs = settable(fmu.inputs)
        self.rates = {name: reference(f"{name}_rate") for name in fmu.inputs}
        derivatives = [f"der({name})" for name in fmu.states]
        real = [*fmu.inputs, *fmu.states, *derivatives, *fmu.outputs, *fmu.memories]
        names = [*real, *(f"{name}_state" for name in fmu.contacts)]
        self._columns, self._n_real = {name: i for i, name in enumerate(names)}, len(real)
        self.recorded = np.array([reference(name) for name in names], dtype=np.uint32)
        states = [reference(name) for name in (*fmu.states, *derivatives)]
        self.deciding = np.array([*states, *indicators_of(fmu)], dtype=np.uint32)
        self._units = {name: fmu.variables[name].unit or "1" for name in names}
        self._contacts, self._rigid = tuple(fmu.contacts), frozenset(fmu.impacts)

    def trajectory(self, times: Vector, result: whole_run.Result) -> Trajectory:
        """The trajectory of a run, by names."""
        rows, events, steps, evaluations, seconds, both = result
        rows = rows if len(rows) == times.size else rows[: times.size]
        trajectory = object.__new__(Trajectory)  # what is frozen is written field by field otherwise
        vars(trajectory).update({
            "_parts": (rows, self._columns, self._n_real, events, self._contacts, self._rigid),
            "time": times, "units": self._units.copy(), "steps": steps, "evaluations": evaluations, "seconds": seconds,
            "arrays": {}, "texts": {}, "sides": None if both is None else self._sides(both, times[-1]),
        })  # fmt: skip
        return trajectory

    def _sides(self, rows: Vector, last: float) -> Sides:
        """Both sides of each instant, whose events may have come one by one."""
        rows = rows[rows[:, 0, 0] <= last]
        moves = np.diff(rows[:, 0, 0], prepend=np.nan, append=np.nan) != 0.0
        both = np.stack([rows[moves[:-1], 0], rows[moves[1:], 1]], axis=1).reshape(-1, rows.shape[2])
        return Sides(both[:, 0], Columns(both[:, 1:], self._columns, self._n_real))


def facts_of(fmu: Fmu) -> RunFacts:
    if not isinstance(fmu, Fmu):
        raise StickslipError(f"An opened FMU is run here, found {fmu!r}. Load it first: fmu_models.load({fmu!r}).")
    kept = vars(fmu)  # beside what it has derived of itself
    model = kept.get("_run_facts")
    if model is None:
        model = kept["_run_facts"] = RunFacts(fmu)
    return model


def bounds_of(variable: ScalarVariable) -> tuple[float, float]:
    """Between which values a finite number passes ``check_value``."""
    low, high = variable.min, variable.max
    largest = sys.float_info.max
    try:
        return -largest if low is None else float(low), largest if high is None else float(high)
    except ValueError as error:
        raise StickslipError(
            f"The bounds of '{variable.name}' are no numbers ({error}). Export its FMU again."
        ) from error


def check_tolerance(tolerance: float) -> None:
    if not (math.isfinite(tolerance) and tolerance > 0):
        raise StickslipError(f"The tolerance must be a positive number, found {tolerance:g}.")


def check_names(fmu: Fmu, kind: str, names: Iterable[str], choices: Collection[str]) -> None:
    for name in names:
        if name not in choices:
            has = nearest(name, choices) if choices else f" It has no {kind}s."
            raise StickslipError(f"'{fmu.description.modelName}' has no {kind} '{name}'.{has}")


def check_settings(fmu: Fmu, kind: str, values: Mapping[str, float], choices: Collection[str]) -> None:
    """Check the names and the values of parameters, states or inputs."""
    check_names(fmu, kind, values, choices)
    for name, value in values.items():
        check_value(fmu, name, value)


def check_value(fmu: Fmu, name: str, value: float) -> None:
    variable = fmu.variables[owner(name, fmu.variables)]
    unit = f" {variable.unit}" if variable.unit else ""
    if not isinstance(value, (int, float, np.number)) or not math.isfinite(value):
        raise StickslipError(f"The value of '{name}' must be a finite number, found {value!r}.")
    for bound, sense, word in ((variable.min, -1, "least"), (variable.max, 1, "most")):
        if bound is not None and sense * (value - float(bound)) > 0:
            raise StickslipError(f"'{name}' ({variable.description}) must be at {word} {bound}{unit}, found {value:g}.")


def check_span(start: float, stop: float) -> None:
    if not -math.inf < start < stop < math.inf:
        raise StickslipError(f"The run must end after it starts, found start {start:g} s and stop {stop:g} s.")


def checked_times(values: ArrayLike | None, start: float, stop: float) -> Vector:
    """Checked output times; 1001 equally spaced ones where none are given."""
    if values is None:
        return np.linspace(start, stop, 1001)
    times = np.array(values, dtype=float)
    if times.ndim != 1 or times.size == 0:
        raise StickslipError(f"Output times must be a list of numbers, found shape {times.shape}.")
    first, last = times.item(0), times.item(-1)
    # what is not a number is not in order either, and what is infinite comes first or last
    ascending = times.size == 1 or (times[1:] >= times[:-1]).all()
    if ascending and start <= first and last <= stop and last < math.inf:
        return times
    if not ascending or not (math.isfinite(first) and math.isfinite(last)):
        raise StickslipError("Output times must be finite and ascending. Sort them.")
    raise StickslipError(f"Output times from {first:g} s to {last:g} s leave the run from {start:g} s to {stop:g} s.")
