"""Simulate an exported FMU: one call into its own engine per run, in an instance that is kept for the next one."""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.shown import Shown
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import Engine, engine_of
from fmu_models.simulation.signal import Signal, knots
from fmu_models.simulation.trajectory import Events, Trajectory


def simulate(
    fmu: Fmu,
    stop_time: float,
    *,
    start_time: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    inputs: Mapping[str, float | Signal] | None = None,
    output_times: ArrayLike | None = None,
    tolerance: float = 1e-14,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Run an FMU of this suite from ``start_time`` to ``stop_time`` (s).

    Args:
        parameters: values that replace the defaults, in the units of the FMU.
        start: values of states at ``start_time``; for a start inside a stop that remembers its speed of entry also
            ``<stop>_memory``, m/s.
        inputs: constant or Signal per input; the rate of an input is the slope of its Signal.
        output_times: (n,) s, ascending, within the run; default 1001 equally spaced.
        tolerance: relative local error of a step. Values above 1e-14 have no effect: the engine's default costs little.
        progress: called with the fraction of output times done, several times a second.

    Raises:
        StickslipError: unknown name, value out of its range, times out of order, an FMU of somebody else, or a motion
            that the engine cannot continue (the message says when and why).
    """
    return KeptRun(fmu, tolerance=tolerance)(
        stop_time,
        start_time=start_time,
        parameters=parameters,
        start=start,
        inputs=inputs,
        output_times=output_times,
        progress=progress,
    )


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
        self._engine: Engine | None = engine_of(fmu)
        self._names = _names_of(fmu)

    def _contents(self) -> dict[str, object]:
        return {"model": self.fmu.description.modelName, "tolerance": self.tolerance}

    def __enter__(self) -> KeptRun:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """No run afterwards."""
        self._engine = None

    def __call__(
        self,
        stop_time: float,
        *,
        start_time: float = 0.0,
        parameters: Mapping[str, float] | None = None,
        start: Mapping[str, float] | None = None,
        inputs: Mapping[str, float | Signal] | None = None,
        output_times: ArrayLike | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Trajectory:
        """The run of ``simulate`` with these arguments.

        Raises:
            StickslipError: as for ``simulate``, after which the next run is as any other; or this was closed.
        """
        engine, names = self._engine, self._names
        if engine is None:
            raise StickslipError("The runs of this FMU are closed. Open a KeptRun again.")
        check_span(start_time, stop_time)
        initial, signals = self._initial(parameters, start, inputs)
        times = checked_times(output_times, start_time, stop_time)
        stops = np.concatenate((times, [stop_time])) if times[-1] < stop_time else times
        driven = None
        if signals:
            table = knots(signals, start_time, stop_time)
            driven = np.array([names.inputs[name] for name in signals], dtype=np.uint32), table
            for i, name in enumerate(signals):
                initial[names.inputs[name]], initial[names.rates[name]] = table[1][0, i], table[2][0, i]
        request = whole_run.Request(stops, names.recorded, driven)
        instance = engine.take()
        try:
            instance.restart(initial, start_time, self.tolerance)
            return names.trajectory(times, whole_run.run(engine, instance, request, progress))
        finally:
            engine.give(instance)

    def _initial(
        self,
        parameters: Mapping[str, float] | None,
        start: Mapping[str, float] | None,
        inputs: Mapping[str, float | Signal] | None,
    ) -> tuple[dict[int, float], dict[str, Signal]]:
        """Checked start values by reference, and the inputs that change with time."""
        fmu, names = self.fmu, self._names
        signals: dict[str, Signal] = {}
        initial: dict[int, float] = {}
        for kind, given, known in (
            ("parameter", parameters, names.parameters),
            ("state", start, names.states),
            ("input", inputs, names.inputs),
        ):
            if not given:
                continue
            check_names(fmu, kind, given, known)
            for name, value in given.items():
                if isinstance(value, Signal):
                    signals[name] = value
                else:
                    check_value(fmu, name, value)
                    initial[known[name]] = value
        return initial, signals


class _Names:
    """Value references by name, and what a trajectory records, in order; of one FMU."""

    def __init__(self, fmu: Fmu) -> None:
        def references(names: Sequence[str]) -> dict[str, int]:
            return {name: fmu.variables[name].valueReference for name in names}

        self.parameters = references(fmu.parameters)
        self.states = references([*fmu.states, *fmu.memories])
        self.inputs = references(fmu.inputs)
        self.rates = {name: fmu.variables[f"{name}_rate"].valueReference for name in fmu.inputs}
        derivatives = [f"der({name})" for name in fmu.states]
        real = [*fmu.inputs, *fmu.states, *derivatives, *fmu.outputs, *fmu.memories]
        self._recorded, self._n_real = [*real, *(f"{name}_state" for name in fmu.contacts)], len(real)
        self.recorded = np.array(list(references(self._recorded).values()), dtype=np.uint32)
        self._units = {name: fmu.variables[name].unit or "1" for name in self._recorded}
        self._contacts, self._rigid = tuple(fmu.contacts), frozenset(fmu.impacts)

    def trajectory(self, times: NDArray[np.float64], result: whole_run.Result) -> Trajectory:
        """What came of a run, by name."""
        n = self._n_real
        rows = result.values[: times.size]
        # rows of the instance are copied; many have an array of their own, of which the columns are views
        real, states = rows[:, :n].T, rows[:, n:].T.astype(np.int8, order="C")
        real = real.copy() if result.kept else real
        values: dict[str, NDArray] = dict(zip(self._recorded, (*real, *states), strict=True))
        events = Events(result.events, self._contacts, self._rigid)
        return Trajectory(
            times, values, dict(self._units), events, result.steps, result.evaluations, seconds=result.seconds
        )


_known: weakref.WeakKeyDictionary[Fmu, _Names] = weakref.WeakKeyDictionary()


def _names_of(fmu: Fmu) -> _Names:
    found = _known.get(fmu)
    if found is None:
        found = _known[fmu] = _Names(fmu)
    return found


def check_tolerance(tolerance: float) -> None:
    if not (math.isfinite(tolerance) and tolerance > 0):
        raise StickslipError(f"The tolerance must be a positive number, found {tolerance:g}.")


def check_names(fmu: Fmu, kind: str, given: Iterable[str], known: Collection[str]) -> None:
    for name in given:
        if name not in known:
            has = nearest(name, known) if known else f" It has no {kind}s."
            raise StickslipError(f"'{fmu.description.modelName}' has no {kind} '{name}'.{has}")


def check_value(fmu: Fmu, name: str, value: float) -> None:
    variable = fmu.variables[owner(name, fmu.variables)]
    unit = f" {variable.unit}" if variable.unit else ""
    if not isinstance(value, (int, float, np.number)) or not math.isfinite(value):
        raise StickslipError(f"The value of '{name}' must be a finite number, found {value!r}.")
    if variable.min is not None and value < float(variable.min):
        raise StickslipError(
            f"'{name}' ({variable.description}) must be at least {variable.min}{unit}, found {value:g}."
        )
    if variable.max is not None and value > float(variable.max):
        raise StickslipError(
            f"'{name}' ({variable.description}) must be at most {variable.max}{unit}, found {value:g}."
        )


def check_span(start: float, stop: float) -> None:
    if not (math.isfinite(start) and math.isfinite(stop) and stop > start):
        raise StickslipError(f"The run must end after it starts, found start {start:g} s and stop {stop:g} s.")


def checked_times(given: ArrayLike | None, start: float, stop: float) -> NDArray[np.float64]:
    """Checked output times; 1001 equally spaced ones where none are given."""
    if given is None:
        return np.linspace(start, stop, 1001)
    times = np.array(given, dtype=float)
    if times.ndim != 1 or times.size == 0:
        raise StickslipError(f"Output times must be a list of numbers, found shape {times.shape}.")
    # what is not a number is not in order either, and what is infinite comes first or last
    ascending = times.size == 1 or (times[1:] >= times[:-1]).all()
    if not ascending or not (math.isfinite(times[0]) and math.isfinite(times[-1])):
        raise StickslipError("Output times must be finite and ascending. Sort them.")
    if times[0] < start or times[-1] > stop:
        raise StickslipError(
            f"Output times from {times[0]:g} s to {times[-1]:g} s leave the run from {start:g} s to {stop:g} s."
        )
    return times
