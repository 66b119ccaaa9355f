"""A log as a calibration takes it: measured variables of a model, and its inputs over time."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.inputs import signal_of
from fmu_models.simulation.measured import MeasuredLog, read_measured
from fmu_models.simulation.signal import Signal

if TYPE_CHECKING:
    import pandas

TIME = "time"
LogLike = Union["os.PathLike[str]", str, "pandas.DataFrame", Mapping[str, ArrayLike], MeasuredLog, "ModelLog"]


@dataclass(frozen=True, eq=False)
class ModelLog:
    """name: of the log; time: (n,) s; measured: (n,) by variable, in its unit; inputs: by name.

    Raises:
        StickslipError: times that do not ascend, a cell without a number, an input that does not cover the log.
    """

    name: str
    time: NDArray[np.float64]
    measured: Mapping[str, NDArray[np.float64]]
    inputs: Mapping[str, float | Signal] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, values in {TIME: self.time, **self.measured}.items():
            missing = np.flatnonzero(~np.isfinite(values))
            if missing.size:
                raise StickslipError(
                    f"'{name}' of {self.name} has {missing.size} cells without a number, the first in sample "
                    f"{missing[0] + 1}. Fill them, or leave these rows out."
                )
        back = np.flatnonzero(np.diff(self.time) <= 0)
        if back.size:
            at = int(back[0])
            raise StickslipError(
                f"The times of {self.name} run back or stand still after sample {at + 1} ({self.time[at]:.9g} s to "
                f"{self.time[at + 1]:.9g} s). Sort the rows and remove doubled ones."
            )
        for name, signal in self.inputs.items():
            if isinstance(signal, Signal) and (signal.time[0] > self.time[0] or signal.time[-1] < self.time[-1]):
                raise StickslipError(
                    f"The input '{name}' covers {signal.time[0]:g} s to {signal.time[-1]:g} s, the log {self.name} "
                    f"{self.time[0]:g} s to {self.time[-1]:g} s. Extend the input or shorten the log."
                )

    def every(self, stride: int) -> ModelLog:
        """The log with one sample of ``stride``, and its inputs as they are."""
        thinned = {name: values[::stride] for name, values in self.measured.items()}
        return ModelLog(self.name, self.time[::stride], thinned, self.inputs)


def model_log(
    source: LogLike,
    fmu: Fmu,
    *,
    columns: Mapping[str, str] | None = None,
    inputs: Mapping[str, Any] | None = None,
    hold: Sequence[str] = (),
    name: str = "log",
) -> ModelLog:
    """A log of a model. source: a file, a data frame (indexed by time in s unless it has such a column), or arrays by
    name; columns: column by variable where their names differ, and then columns that stand for nothing are left out;
    inputs: beside those of the log, as `signal_of` takes them; hold: inputs that keep their value between samples.

    Raises:
        StickslipError: a column that no variable matches, of another unit, nothing measured, or as `ModelLog`.
    """
    if isinstance(source, ModelLog):
        return source
    log = _measured(source, name)
    log = replace(log, stepwise=log.stepwise | {log.by_variable.get(variable, variable) for variable in hold})
    named = {column: variable for variable, column in (columns or {}).items()}
    for column, variable in named.items():
        log.values(column, None, variable)
    known = [*_measurable(fmu), *fmu.inputs]
    measured: dict[str, NDArray[np.float64]] = {}
    driven: dict[str, float | Signal] = {}
    for column in log.columns:
        variable = named.get(column, log.variables.get(column, column))
        if variable not in known and named and column not in named:
            continue
        if variable not in known:
            raise StickslipError(
                f"Column '{column}' of {log.source} is no state, output or input of '{fmu.description.modelName}'."
                f"{nearest(variable, known)} Say what it is: --column VARIABLE={column}."
            )
        unit = str(fmu.variables[variable].unit or "1")
        if variable in fmu.inputs:
            driven[variable] = log.signal(column, unit, f"input '{variable}'")
        else:
            measured[variable] = log.values(column, unit, f"variable '{variable}'")
    if not measured:
        raise StickslipError(
            f"{log.source} measures nothing of '{fmu.description.modelName}': it needs a column of a state or output "
            f"({', '.join(_measurable(fmu)[:12])})."
        )
    for variable, form in (inputs or {}).items():
        if variable not in fmu.inputs:
            raise StickslipError(
                f"'{fmu.description.modelName}' has no input '{variable}'.{nearest(variable, fmu.inputs)}"
            )
        ends, unit = (float(log.time[0]), float(log.time[-1])), str(fmu.variables[variable].unit or "1")
        driven[variable] = signal_of(form, *ends, label=f"input '{variable}'", unit=unit)
    label = Path(source).name if isinstance(source, str | os.PathLike) else log.source
    return ModelLog(label, log.time, measured, driven)


def _measurable(fmu: Fmu) -> list[str]:
    """States and outputs, and of FMUs of others what is local too."""
    local = [name for name, variable in fmu.variables.items() if variable.causality == "local" and not fmu.ours]
    return list(dict.fromkeys((*fmu.states, *fmu.outputs, *local)))


def _measured(source: LogLike, name: str) -> MeasuredLog:
    if isinstance(source, MeasuredLog):
        return source
    if isinstance(source, str | os.PathLike):
        return read_measured(source)
    columns = {str(key): np.asarray(source[key], dtype=float) for key in source}  # type: ignore[index]
    if TIME not in columns and hasattr(source, "index"):
        columns[TIME] = np.asarray(source.index, dtype=float)  # type: ignore[union-attr]
    if TIME not in columns:
        raise StickslipError(f"{name} has no column '{TIME}', in s; it has {', '.join(columns)}.")
    time = columns.pop(TIME)
    for column, values in columns.items():
        if values.shape != time.shape:
            raise StickslipError(f"'{column}' of {name} has {values.size} values for {time.size} times.")
    return MeasuredLog(name, time, columns)


def rows_of(logs: Sequence[ModelLog]) -> int:
    """How many values the logs hold."""
    return sum(log.time.size * len(log.measured) for log in logs)
