"""Simulate an exported FMU: one call into its own engine per run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.library import library
from fmu_models.simulation import whole_run
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
    parameters, start, inputs = dict(parameters or {}), dict(start or {}), dict(inputs or {})
    check_span(start_time, stop_time)
    if not (math.isfinite(tolerance) and tolerance > 0):
        raise StickslipError(f"The tolerance must be a positive number, found {tolerance:g}.")
    check_names(fmu, "parameter", parameters, fmu.parameters)
    check_names(fmu, "state", start, [*fmu.states, *fmu.memories])
    check_names(fmu, "input", inputs, fmu.inputs)
    values = {**parameters, **start, **{name: v for name, v in inputs.items() if not isinstance(v, Signal)}}
    for name, value in values.items():
        check_value(fmu, name, value)
    times = checked_times(output_times, start_time, stop_time)
    stops = np.append(times, stop_time) if times[-1] < stop_time else times
    signals = {
        name: v if isinstance(v, Signal) else Signal.constant(float(v), start_time, stop_time)
        for name, v in inputs.items()
    }
    table = knots(signals, start_time, stop_time)
    recorded = [
        *fmu.inputs,
        *fmu.states,
        *(f"der({name})" for name in fmu.states),
        *fmu.outputs,
        *fmu.memories,
        *(f"{name}_state" for name in fmu.contacts),
    ]
    request = whole_run.Request(
        stops,
        [fmu.variables[name].valueReference for name in recorded],
        [fmu.variables[name].valueReference for name in signals],
        *table,
    )
    initial = {**parameters, **start}
    for i, name in enumerate(signals):
        initial[name], initial[f"{name}_rate"] = table[1][0, i], table[2][0, i]
    with instance(fmu, initial, start_time, tolerance) as (slave, failure):
        result = whole_run.run(whole_run.library_of(slave.dll, fmu.path.name), slave.component, request, progress)
        if result is None:
            raise failure()
    return _trajectory(fmu, times, recorded, result)


def check_names(fmu: Fmu, kind: str, given: Mapping[str, object], known: Sequence[str]) -> None:
    for name in given:
        if name not in known:
            has = nearest(name, known) if known else f" It has no {kind}s."
            raise StickslipError(f"'{fmu.description.modelName}' has no {kind} '{name}'.{has}")


def check_value(fmu: Fmu, name: str, value: float) -> None:
    variable = fmu.variables[name]
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
    if not np.isfinite(times).all() or (np.diff(times) < 0).any():
        raise StickslipError("Output times must be finite and ascending. Sort them.")
    if times[0] < start or times[-1] > stop:
        raise StickslipError(
            f"Output times from {times[0]:g} s to {times[-1]:g} s leave the run from {start:g} s to {stop:g} s."
        )
    return times


@contextmanager
def instance(
    fmu: Fmu, initial: Mapping[str, float], start_time: float, tolerance: float
) -> Iterator[tuple[Any, Callable[[], StickslipError]]]:
    """A Co-Simulation instance past its initialization, and what makes an error of the last message it logged."""
    from fmpy.fmi1 import FMICallException

    slave, failure = new_instance(fmu)
    try:
        begin(fmu, slave, initial, start_time, tolerance)
        yield slave, failure
    except FMICallException as error:
        raise failure() from error
    finally:
        slave.freeInstance()


def begin(fmu: Fmu, slave: Any, initial: Mapping[str, float], start_time: float, tolerance: float) -> None:
    """Take a new or a reset instance past its initialization; fmpy's FMICallException if it refuses."""
    references = [fmu.variables[name].valueReference for name in initial]
    write = slave.setReal if fmu.fmi == 2 else slave.setFloat64
    write(references, [float(value) for value in initial.values()])
    if fmu.fmi == 2:
        slave.setupExperiment(tolerance=tolerance, startTime=start_time)
        slave.enterInitializationMode()
    else:
        slave.enterInitializationMode(tolerance=tolerance, startTime=start_time)
    slave.exitInitializationMode()


def new_instance(fmu: Fmu) -> tuple[Any, Callable[[], StickslipError]]:
    """An fmpy instance, to be freed by the caller, and what makes an error of the last message it logged."""
    from fmpy import fmi2, fmi3

    messages: list[str] = []

    def failure() -> StickslipError:
        text = messages[-1] if messages else "the FMU failed without a message."
        return StickslipError(f"{fmu.description.modelName}: {text}")

    description = fmu.description
    if description.coSimulation is None:
        raise StickslipError(f"'{fmu.path}' has no Co-Simulation interface, through which FMUs are simulated here.")
    library(fmu, str(description.coSimulation.modelIdentifier))
    arguments = {
        "guid": description.guid,
        "modelIdentifier": description.coSimulation.modelIdentifier,
        "unzipDirectory": str(fmu.folder),
        "instanceName": description.modelName,
    }

    def keep(message: bytes) -> None:
        # our messages begin with the C function that refused; that is of no use to the reader
        text = message.decode("utf-8", "replace")
        head, separator, rest = text.partition(": ")
        messages.append(rest if separator and head.startswith(("fmi2", "fmi3")) else text)

    try:
        if fmu.fmi == 2:
            slave = fmi2.FMU2Slave(**arguments)
            callbacks = fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _e, _n, _s, _c, message: keep(message))
            slave.instantiate(callbacks=callbacks, loggingOn=True)
        else:
            slave = fmi3.FMU3Slave(**arguments)
            slave.instantiate(loggingOn=True, logMessage=lambda _e, _s, _c, message: keep(message))
    except Exception as error:  # fmpy raises plain exceptions
        raise StickslipError(f"'{fmu.path}' cannot be loaded: {messages[-1] if messages else error}") from error
    return slave, failure


def _trajectory(fmu: Fmu, times: NDArray[np.float64], recorded: Sequence[str], result: whole_run.Result) -> Trajectory:
    states = {f"{name}_state" for name in fmu.contacts}
    values = {}
    for column, name in enumerate(recorded):
        data = result.values[: times.size, column]
        values[name] = data.astype(np.int8) if name in states else np.ascontiguousarray(data)
    units = {name: fmu.variables[name].unit or "1" for name in recorded}
    events = Events(result.events, fmu.contacts, fmu.impacts)
    return Trajectory(times, values, units, events, result.steps, result.evaluations, seconds=result.seconds)
