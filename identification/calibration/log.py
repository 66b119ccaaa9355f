"""A log as a calibration takes it: measured variables of a model, and its inputs over time."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.unit_names import conversion_factor
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.signal import Signal
from rig_io.logs.table import Table
from rig_io.packages.datapackage import read_columns

if TYPE_CHECKING:
    import pandas

TIME = "time"
HOLDS = ("held", "linear")
LogLike = Union["os.PathLike[str]", str, Table, "pandas.DataFrame", Mapping[str, ArrayLike], "MeasuredLog"]


@dataclass(frozen=True, eq=False)
class MeasuredLog:
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

    def every(self, stride: int) -> MeasuredLog:
        """The log with one sample of ``stride``, and its inputs as they are."""
        thinned = {name: values[::stride] for name, values in self.measured.items()}
        return MeasuredLog(self.name, self.time[::stride], thinned, self.inputs)


def measured_log(
    source: LogLike,
    fmu: Fmu,
    *,
    columns: Mapping[str, str] | None = None,
    inputs: Mapping[str, float | Signal] | None = None,
    hold: Mapping[str, str] | None = None,
    name: str = "log",
) -> MeasuredLog:
    """A log of a model. source: a file, a table, a data frame (indexed by time unless it has such a column), or arrays
    by name; columns: column by variable (or ``time``) where their names differ, and then columns that stand for nothing
    are left out; inputs: beside those of the log; hold: "held" (default) or "linear" between samples, by input.

    Raises:
        StickslipError: a column that no variable matches, of another unit, nothing measured, or as `MeasuredLog`.
    """
    if isinstance(source, MeasuredLog):
        return source
    table = _table(source, name)
    named = {column: variable for variable, column in (columns or {}).items()}
    for column, variable in named.items():
        if column not in table.columns:
            raise StickslipError(
                f"{table.source} has no column '{column}' for {variable}.{nearest(column, table.columns)}"
            )
    variables = {column: named.get(column, column) for column in table.columns}
    if TIME not in variables.values():
        raise StickslipError(f"{table.source} has no column '{TIME}'. Name it: --column time=COLUMN.")
    time = _values(table, next(column for column, variable in variables.items() if variable == TIME), "s")
    known = [*_measurable(fmu), *fmu.inputs]
    measured, driven = {}, dict(inputs or {})
    for column, variable in variables.items():
        if variable == TIME or (variable not in known and named and column not in named):
            continue
        if variable not in known:
            raise StickslipError(
                f"Column '{column}' of {table.source} is no state, output or input of '{fmu.description.modelName}'."
                f"{nearest(variable, known)} Say what it is: --column VARIABLE={column}."
            )
        values = _values(table, column, str(fmu.variables[variable].unit or "1"))
        if variable in fmu.inputs:
            driven[variable] = _signal(variable, time, values, table.source, (hold or {}).get(variable, HOLDS[0]))
        else:
            measured[variable] = values
    if not measured:
        raise StickslipError(
            f"{table.source} measures nothing of '{fmu.description.modelName}': it needs a column of a state or output "
            f"({', '.join(_measurable(fmu)[:12])})."
        )
    for name in driven:
        if name not in fmu.inputs:
            raise StickslipError(f"'{fmu.description.modelName}' has no input '{name}'.{nearest(name, fmu.inputs)}")
    label = Path(source).name if isinstance(source, str | os.PathLike) else table.source
    return MeasuredLog(label, time, measured, driven)


def _measurable(fmu: Fmu) -> list[str]:
    """States and outputs, and of FMUs of others what is local too."""
    local = [name for name, variable in fmu.variables.items() if variable.causality == "local" and not fmu.ours]
    return list(dict.fromkeys((*fmu.states, *fmu.outputs, *local)))


def _table(source: LogLike, name: str) -> Table:
    if isinstance(source, Table):
        return source
    if isinstance(source, str | os.PathLike):
        return read_columns(source)
    columns = {str(key): np.asarray(source[key], dtype=float) for key in source}  # type: ignore[index]
    if TIME not in columns and hasattr(source, "index"):
        columns = {TIME: np.asarray(source.index, dtype=float), **columns}  # type: ignore[union-attr]
    lengths = {key: len(values) for key, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise StickslipError(f"The columns of {name} differ in length: {lengths}.")
    return Table(name, columns)


def _values(table: Table, column: str, unit: str) -> NDArray[np.float64]:
    values, stated = np.asarray(table.columns[column], dtype=float), table.units.get(column)
    if stated is None or stated == unit:
        return values
    try:
        return values * conversion_factor(stated, unit)
    except ValueError as error:
        raise StickslipError(
            f"Column '{column}' of {table.source} is in '{stated}', and the model has it in '{unit}' ({error})."
        ) from error


def _signal(name: str, time: NDArray[np.float64], values: NDArray[np.float64], source: str, hold: str) -> Signal:
    if hold not in HOLDS:
        raise StickslipError(f"Between samples the input '{name}' can be {' or '.join(HOLDS)}; found '{hold}'.")
    if not np.isfinite(values).all():
        raise StickslipError(f"The input '{name}' of {source} has cells without a number. Fill them.")
    if (np.diff(time) <= 0).any() or hold == "linear":
        return Signal(time, values)
    return Signal(np.repeat(time, 2)[1:], np.repeat(values, 2)[:-1])


def rows_of(logs: Sequence[MeasuredLog]) -> int:
    """How many values the logs hold."""
    return sum(log.time.size * len(log.measured) for log in logs)
