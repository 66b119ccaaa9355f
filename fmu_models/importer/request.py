"""What the master is asked for, as arrays: variables by type, inputs as a table, communication points."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.fmu.elements import element_names, owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import instance
from fmu_models.simulation.run import check_span, check_value, checked_times
from fmu_models.simulation.signal import Signal, knots

if TYPE_CHECKING:
    from fmpy.model_description import ModelVariable

INTERVALS = 500  # of an experiment, where its step is not stated
MOST_STEPS = 10_000  # that a step of an experiment nobody thought of asks of a long run: seconds, not hours
JUMP = 2  # in Table.jumps, of an input; 1 is any other knot at which inputs are written in a co-simulation


def address(array: NDArray) -> int:
    """Address of the first element: ``array.ctypes.data`` at a tenth of its time."""
    return array.__array_interface__["data"][0]


@dataclass(frozen=True, eq=False)
class Selection:
    """Variables in the order given, as the master takes them: names, types, value references and sizes (n,) of their
    n elements."""

    names: tuple[str, ...]
    types: NDArray[np.int32]
    references: NDArray[np.uint32]
    sizes: NDArray[np.int32]

    @classmethod
    def of(cls, fmu: Fmu, names: Sequence[str]) -> Selection:
        """The variables ``names``; that of which a name is an element comes whole, once."""
        codes = instance.types_of(fmu)
        owners = dict.fromkeys(owner(name, fmu.variables) for name in names)
        variables = [fmu.variables[name] for name in owners]
        elements = [element_names(str(v.name), v.shape or ()) for v in variables]
        counts = [len(names) for names in elements]
        return cls(
            tuple(name for names in elements for name in names),
            np.repeat(np.array([codes[str(v.type)] for v in variables], dtype=np.int32), counts),
            np.repeat(np.array([v.valueReference for v in variables], dtype=np.uint32), counts),
            np.array([size for n in counts for size in (n, *[0] * (n - 1))[:n]], dtype=np.int32),
        )

    @cached_property
    def c(self) -> ctypes.Structure:
        return instance.Variables(len(self.names), *map(address, (self.types, self.references, self.sizes)))


NOTHING = Selection((), np.zeros(0, np.int32), np.zeros(0, np.uint32), np.zeros(0, np.int32))


def is_numeric(fmu: Fmu, name: str) -> bool:
    """Numbers that the master can read and write: no text, no binary, no clock."""
    return str(fmu.variables[name].type) in instance.types_of(fmu)


def is_number(fmu: Fmu, name: str) -> bool:
    """One such number: no array."""
    return is_numeric(fmu, name) and not fmu.variables[name].shape


def inputs_of(fmu: Fmu) -> list[str]:
    return [name for name, v in fmu.variables.items() if v.causality == "input" and is_numeric(fmu, name)]


def recordable(fmu: Fmu) -> list[str]:
    """What is recorded unless something else is asked for: inputs, derivatives of states, outputs."""
    derivatives = [str(u.variable.name) for u in fmu.description.derivatives if u.variable]
    names = [n for n, v in fmu.variables.items() if v.causality == "output" and n not in derivatives]
    return [name for name in (*inputs_of(fmu), *derivatives, *names) if is_numeric(fmu, name)]


def unrecordable(fmu: Fmu) -> list[str]:
    """Outputs that are no numbers, with their types; clocks are told as events."""
    outputs = {name: v for name, v in fmu.variables.items() if v.causality == "output"}
    texts = {name: v for name, v in outputs.items() if v.type != "Clock"}
    return [f"'{name}' ({v.type})" for name, v in texts.items() if not is_numeric(fmu, name)]


def check_recorded(fmu: Fmu, names: Sequence[str]) -> None:
    for name in names:
        if name not in fmu.variables:
            hint = nearest(name, fmu.variables)
            raise StickslipError(f"'{fmu.description.modelName}' has no variable '{name}' to record.{hint}")
        if fmu.variables[name].type == "Clock":
            raise StickslipError(f"'{name}' cannot be recorded: it is a Clock, whose ticks are told with the events.")


def start_values(fmu: Fmu, parameters: Mapping[str, float], start: Mapping[str, float]) -> dict[str, float]:
    """Checked values to write before initialization. StickslipError: unknown name, a value out of its range, a variable
    that cannot be set."""
    if not parameters and not start:
        return {}
    model, variables = fmu.description.modelName, fmu.variables
    for name in (*parameters, *start):
        variable = variables.get(owner(name, variables))
        if variable is not None and variable.causality == "structuralParameter":
            raise StickslipError(
                f"'{name}' of '{model}' is a structural parameter, on which sizes of arrays depend: it is set when the "
                "FMU is loaded (structural_parameters of the Driver), not for a run."
            )
    for name in parameters:
        variable = variables.get(owner(name, variables))
        if variable is None or variable.causality != "parameter":
            has = [name for name, v in variables.items() if v.causality == "parameter" and is_numeric(fmu, name)]
            hint = nearest(name, has) if has else " It has no parameters."
            raise StickslipError(f"'{model}' has no parameter '{name}'.{hint}")
    for name in start:
        variable = variables.get(owner(name, variables))
        if variable is None:
            settable = [n for n, v in variables.items() if has_start(v)]
            raise StickslipError(f"'{model}' has no variable '{name}' to start from.{nearest(name, settable)}")
        if not has_start(variable):
            raise StickslipError(f"'{name}' of '{model}' is computed by the FMU and cannot be given a start value.")
    values = {**parameters, **start}
    for name, value in values.items():
        if fmu.variables[owner(name, variables)].variability == "constant":
            raise StickslipError(f"'{name}' of '{model}' is a constant and cannot be set.")
        _check_settable(fmu, name)
        check_value(fmu, name, value)
    return {name: float(value) for name, value in _whole(fmu, values).items()}


def _check_settable(fmu: Fmu, name: str) -> None:
    """One number, by itself or as an element."""
    variable = fmu.variables[owner(name, fmu.variables)]
    if not is_numeric(fmu, str(variable.name)):
        raise StickslipError(f"'{name}' cannot be set: it is of type {variable.type}, and numbers are set.")
    shape = variable.shape or ()
    if name not in (elements := element_names(str(variable.name), shape)):
        size = " x ".join(map(str, shape))
        ends = f": '{elements[0]}' to '{elements[-1]}'" if elements else ""
        raise StickslipError(f"'{name}' is no number: '{variable.name}' is an array of {size}. Set its elements{ends}.")


def _whole(fmu: Fmu, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by name, with all elements of an array where one is given: FMI sets it as a whole."""
    complete: dict[str, Any] = {}
    for array in dict.fromkeys(owner(name, fmu.variables) for name in values):
        elements = element_names(array, fmu.variables[array].shape or ())
        starts = str(fmu.variables[array].start or "").split()
        if len(starts) == 1:
            starts *= len(elements)
        if len(starts) != len(elements) and not all(name in values for name in elements):
            raise StickslipError(
                f"'{array}' has {len(elements)} elements and {len(starts)} start values; give all of its elements."
            )
        defaults = dict(zip(elements, starts, strict=False))
        complete |= {name: values[name] if name in values else _number(defaults[name]) for name in elements}
    return complete


def _number(text: str) -> float:
    """A start value of modelDescription.xml."""
    return float(text) if text not in ("true", "false") else float(text == "true")


def has_start(variable: ModelVariable) -> bool:
    """Whether it is given a value before the run rather than computed by the FMU."""
    return variable.initial in ("exact", "approx") and variable.causality != "input"


@dataclass(frozen=True, eq=False)
class InputTable:
    """Inputs over time: values and slopes (k, n) just after each of ``times`` (k,), and whether it is an event (k,)."""

    inputs: Selection
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    slopes: NDArray[np.float64]
    jumps: NDArray[np.int64]


def table(fmu: Fmu, inputs: Mapping[str, float | Signal], start: float, stop: float) -> InputTable:
    """The inputs given, as a table over the run. StickslipError: unknown name, a value out of range, a signal that does
    not cover the run."""
    if not inputs:
        none = np.zeros((1, 0))
        return InputTable(NOTHING, np.array([start]), none, none, np.zeros(1, dtype=np.int64))
    input_names = inputs_of(fmu)
    for name, value in inputs.items():
        variable = fmu.variables.get(owner(name, fmu.variables))
        if variable is None or variable.causality != "input":
            hint = nearest(name, input_names) if input_names else " It has no inputs."
            raise StickslipError(f"'{fmu.description.modelName}' has no input '{name}'.{hint}")
        _check_settable(fmu, name)
        if not isinstance(value, Signal):
            check_value(fmu, name, value)
    inputs = _whole(fmu, inputs)
    signals = {n: v if isinstance(v, Signal) else Signal.constant(float(v), start, stop) for n, v in inputs.items()}
    times, values, slopes = knots(signals, start, stop)
    for column, (name, signal) in enumerate(signals.items()):
        variable = fmu.variables[owner(name, fmu.variables)]
        if variable.variability == "discrete" or not str(variable.type).startswith(("Real", "Float")):
            # between the knots it keeps the value of the last one
            last = np.searchsorted(signal.time, times, side="right") - 1
            values[:, column], slopes[:, column] = signal.value[np.clip(last, 0, None)], 0.0
    names = list(signals)
    for column, name in enumerate(list(signals)):
        # an FMU exported here takes the rate of an input as an input of its own
        rate = f"{name}_rate"
        if rate in input_names and rate not in signals and fmu.inputs.count(name):
            names.append(rate)
            values, slopes = (
                np.column_stack([values, slopes[:, column]]),
                np.column_stack([slopes, np.zeros(times.size)]),
            )
    reached = values[:-1] + slopes[:-1] * np.diff(times)[:, None]
    size = np.maximum(np.abs(values).max(axis=0, initial=0.0), 1e-300)
    jumps = np.zeros(times.size, dtype=np.int64)
    jumps[1:] = JUMP * (np.abs(values[1:] - reached) > 1e-12 * size).any(axis=1)
    values, slopes = np.ascontiguousarray(values), np.ascontiguousarray(slopes)
    return InputTable(Selection.of(fmu, names), times, values, slopes, jumps)


def output_times(times: ArrayLike | None, start: float, stop: float) -> NDArray[np.float64]:
    """Checked output times of a run from ``start`` to ``stop``, s; 1001 equally spaced ones where none are given."""
    check_span(start, stop)
    return checked_times(times, start, stop)


def communication_step(fmu: Fmu, step: float | None, start: float, stop: float) -> float:
    """The step asked for, or the one the FMU recommends, or a thousandth of the run."""
    if step is not None:
        return checked_step("communication", step)
    fixed = fmu.description.coSimulation and fmu.description.coSimulation.fixedInternalStepSize
    return _stated(fmu, "stepSize") or (float(fixed) if fixed and float(fixed) > 0 else (stop - start) / 1000)


def checked_step(kind: str, length: float, *, endless: bool = False) -> float:
    """A length of steps, s, that was asked for; where ``endless`` it may be infinite."""
    if not (length > 0 and (endless or math.isfinite(length))):
        raise StickslipError(f"The {kind} step must be a positive number of seconds, found {length:g}.")
    return float(length)


def _stated(fmu: Fmu, name: str) -> float | None:
    """A number of the experiment that the FMU suggests, where it states a finite one above zero."""
    text = getattr(fmu.description.defaultExperiment, name, None)
    try:
        value = float(text) if text is not None else 0.0
    except ValueError:
        raise StickslipError(
            f"'{fmu.path}' suggests an experiment with the {name} '{text}', which is no number."
        ) from None
    return value if 0 < value < math.inf else None


@dataclass(frozen=True)
class StepBound:
    """The longest step of a method of integration, s, infinite where there is none, and where it comes from."""

    longest: float
    source: str

    @classmethod
    def of(cls, fmu: Fmu, max_step: float | None, start: float, stop: float) -> StepBound:
        """As asked for; or the step of the FMU's own experiment, of which a run needs at most MOST_STEPS.

        An FMU that states the end of its experiment alone is taken to show itself in INTERVALS steps, which is what
        tools write by default.
        """
        if max_step is not None:
            return cls(max_step, "as asked for")
        step, end = _stated(fmu, "stepSize"), _stated(fmu, "stopTime")
        if step is None and end is not None:
            interval = (end - (_stated(fmu, "startTime") or 0.0)) / INTERVALS
            step = interval if interval > 0 else None
        if step is None:
            return cls(math.inf, "the FMU states no experiment")
        least = (stop - start) / MOST_STEPS
        return cls(step, "by the FMU's own experiment") if step >= least else cls(least, f"the run / {MOST_STEPS}")

    @property
    def words(self) -> str:
        """The step in words, for a run's report."""
        return f", steps of at most {self.longest:.4g} s ({self.source})" if math.isfinite(self.longest) else ""


def communication_points(
    fmu: Fmu, step: float, start: float, stop: float, outputs: NDArray[np.float64] | None, inputs: InputTable
) -> NDArray[np.float64]:
    """From start to stop in steps as asked, with output times and jumps of inputs in between. StickslipError: the FMU
    allows no steps of other lengths, and these need some."""
    n = max(1, math.floor((stop - start) / step * (1 + 1e-12)))
    grid = start + step * np.arange(n + 1)
    others = np.concatenate([[stop], inputs.times[inputs.jumps == JUMP], *([outputs] if outputs is not None else [])])
    resolution = 1e-9 * step
    off = others[np.abs(others - start - step * np.round((others - start) / step)) > resolution]
    interface = fmu.description.coSimulation
    if off.size and interface and str(interface.canHandleVariableCommunicationStepSize).lower() not in ("true", "1"):
        raise StickslipError(
            f"'{fmu.description.modelName}' takes communication steps of one length only, and t = {off[0]:g} s (an "
            f"output time, a jump of an input or the end of the run) is no multiple of {step:g} s. Choose another."
        )
    points = np.unique(np.concatenate([grid[grid <= stop + resolution], others]))
    # of points that differ by rounding the last stands for all
    points = points[np.append(np.diff(points) > resolution, True)]
    points[0], points[-1] = start, stop
    return np.asarray(points, dtype=np.float64)


def at_points(table: InputTable, points: NDArray[np.float64]) -> InputTable:
    """The same inputs as values that hold from one communication point to the next."""
    rows = np.clip(np.searchsorted(table.times, points, side="right") - 1, 0, None)
    values = table.values[rows] + table.slopes[rows] * (points - table.times[rows])[:, None]
    jumps = np.where((table.times[rows] == points) & (table.jumps[rows] == JUMP), JUMP, 1)
    return replace(table, times=points, values=values, slopes=np.zeros_like(values), jumps=jumps)
