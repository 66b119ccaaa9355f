"""A log as a calibration takes it: measured variables of a model, and its inputs over time."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, nearest, refuse_unknown
from fmu_models.base.files import existing
from fmu_models.base.unit_names import conversion
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.inputs import signal_of
from fmu_models.simulation.measured import UNSTATED, Instrument, MeasuredLog, in_unit, read_measured
from fmu_models.simulation.signal import Signal
from rig_io.packages.datapackage import described_columns

if TYPE_CHECKING:
    import pandas

TIME = "time"
FEWEST = 4  # times of events
LogLike = Union["os.PathLike[str]", str, "pandas.DataFrame", Mapping[str, ArrayLike], MeasuredLog, "ModelLog"]


@dataclass(frozen=True)
class Reading:
    """How the logs of a model were read. columns: by variable; inputs: constants by name, None of one that a log or a
    signal drove; hold: inputs that keep their value between samples; events: columns of event times by contact. roles:
    what columns are for where they are no variables, of loops or decays, which have readers of their own; units: by
    role."""

    columns: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, float | None] = field(default_factory=dict)
    hold: tuple[str, ...] = ()
    events: Mapping[str, str] = field(default_factory=dict)
    roles: str = ""
    units: Mapping[str, str] = field(default_factory=dict)

    def read(self, source: LogLike, fmu: Fmu, *, name: str = "log") -> ModelLog:
        """Another log of the model. StickslipError: as in `model_log`, or it lacks an input that the others had."""
        constants = {name: value for name, value in self.inputs.items() if value is not None}
        log = model_log(
            source, fmu, columns=self.columns, inputs=constants, hold=self.hold, events=self.events, name=name
        )
        if missing := [name for name in self.inputs if name not in log.inputs]:
            raise StickslipError(f"The log {log.name} has no column of the input '{missing[0]}', which the others had.")
        return log


@dataclass(frozen=True, eq=False)
class ModelLog:
    """name: of the log; time: (n,) s; measured: (n,) by variable, in its unit; inputs: by name; events:
    (k,) s by contact; instruments: what is said of the sensors of measured variables, in their units; over: the
    input that measured variables are drawn over, empty for their rates; begun: states whose start is this log's own,
    though a calibration holds them.

    Raises:
        StickslipError: times that do not ascend, a cell without a number, an input that does not cover the log.
    """

    name: str
    time: NDArray[np.float64]
    measured: Mapping[str, NDArray[np.float64]]
    inputs: Mapping[str, float | Signal] = field(default_factory=dict)
    events: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    instruments: Mapping[str, Instrument] = field(default_factory=dict)
    over: str = ""
    begun: tuple[str, ...] = ()

    @property
    def observed(self) -> dict[str, NDArray[np.float64]]:
        """What is compared with the model: measured variables, then times of events."""
        return {**self.measured, **self.events}

    def until(self, end: float) -> ModelLog:
        """The log up to a time in s, of events alone."""
        events = {name: times[times < end] for name, times in self.events.items()}
        return ModelLog(self.name, np.append(self.time[self.time < end], end), {}, self.inputs, events)

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
        return replace(self, time=self.time[::stride], measured=thinned)


def model_log(
    source: LogLike,
    fmu: Fmu,
    *,
    columns: Mapping[str, str] | None = None,
    inputs: Mapping[str, Any] | None = None,
    hold: Sequence[str] = (),
    events: Mapping[str, str] | None = None,
    name: str = "log",
) -> ModelLog:
    """A log of a model. source: a file, a data frame (indexed by time in s unless it has such a column), or arrays by
    name; columns: column by variable where their names differ, and then columns that stand for nothing are left out;
    inputs: beside those of the log, as `signal_of` takes them; hold: inputs that keep their value between samples;
    events: column of the times (s) at which a contact began to touch or to slip, by contact, cells without a number
    left out; a log may hold nothing else.

    Raises:
        StickslipError: a column that no variable matches, of another unit, nothing measured, or as `ModelLog`.
    """
    if isinstance(source, ModelLog):
        return source
    label = Path(source).name if isinstance(source, str | os.PathLike) else name
    samples, timed = _events(source, fmu, events or {}, label)
    if samples is None:
        return ModelLog(label, _around(timed), {}, _inputs(fmu, inputs, _around(timed)), timed)
    log = _measured(samples, name)
    log = replace(log, stepwise=log.stepwise | {log.by_variable.get(variable, variable) for variable in hold})
    named = {column: variable for variable, column in (columns or {}).items()}
    for column, variable in named.items():
        log.values(column, None, variable)
    known = [*measurable(fmu), *fmu.inputs]
    measured: dict[str, NDArray[np.float64]] = {}
    driven: dict[str, float | Signal] = {}
    instruments: dict[str, Instrument] = {}
    for column in log.columns:
        variable = named.get(column, log.variables.get(column, column))
        instrument = log.instruments.get(column, UNSTATED)
        if variable not in known and ((named and column not in named) or instrument.role == ""):
            continue
        _check_role(log, column, variable, instrument, fmu)
        if variable not in known:
            raise StickslipError(
                f"Column '{column}' of {log.source} is no state, output or input of '{fmu.description.modelName}'."
                f"{nearest(variable, known)} Say what it is: --column VARIABLE={column}."
            )
        unit = str(fmu.variables[variable].unit or "1")
        if variable in fmu.inputs:
            signal = log.signal(column, unit, f"input '{variable}'")
            driven[variable] = float(signal.value[0]) if np.ptp(signal.value) == 0 else signal
        else:
            measured[variable] = log.values(column, unit, f"variable '{variable}'")
            stated = log.units.get(column)
            instruments[variable] = instrument.scaled(conversion(stated, unit, log.source) if stated else 1.0)
    if not measured and not timed:
        raise StickslipError(
            f"{log.source} measures nothing of '{fmu.description.modelName}': it needs a column of a state or output "
            f"({', '.join(measurable(fmu)[:12])})."
        )
    return ModelLog(label, log.time, measured, driven | _inputs(fmu, inputs, log.time), timed, instruments)


def _check_role(log: MeasuredLog, column: str, variable: str, instrument: Instrument, fmu: Fmu) -> None:
    """Refuse a role that the variable cannot have."""
    if instrument.role in ("input", "measured") and (instrument.role == "input") != (variable in fmu.inputs):
        names = fmu.inputs if instrument.role == "input" else measurable(fmu)
        raise StickslipError(
            f"{log.source}: column '{column}' has the role '{instrument.role}' in datapackage.json, and '{variable}' "
            f"is none of '{fmu.description.modelName}'.{nearest(variable, names)}"
        )


def _inputs(fmu: Fmu, inputs: Mapping[str, Any] | None, time: NDArray[np.float64]) -> dict[str, float | Signal]:
    """Inputs that the log does not hold."""
    driven = {}
    for name, form in (inputs or {}).items():
        refuse_unknown(name, fmu.inputs, f"'{fmu.description.modelName}' has no input '{name}'.")
        unit = str(fmu.variables[name].unit or "1")
        driven[name] = signal_of(form, float(time[0]), float(time[-1]), label=f"input '{name}'", unit=unit)
    return driven


def _events(
    source: LogLike, fmu: Fmu, events: Mapping[str, str], label: str
) -> tuple[LogLike | None, dict[str, NDArray[np.float64]]]:
    """The log without columns of event times, None if nothing else is in it; and these times by contact."""
    table = None
    if isinstance(source, str | os.PathLike):
        table, fields, _ = described_columns(existing(source, "log"))
        event_names = {one.variable or one.name: one.name for one in fields if one.instrument.role == "event"}
        events = {**event_names, **events}
    if not events:
        return source, {}
    columns: Any = table.columns if table is not None else source
    timed = {}
    for contact, column in events.items():
        refuse_unknown(contact, fmu.contacts, f"'{fmu.description.modelName}' has no contact '{contact}'.")
        refuse_unknown(column, columns, f"{label} has no column '{column}' of event times.")
        times = np.asarray(columns[column], dtype=float)
        stated = table.units.get(column) if table is not None else None
        times = in_unit(times[np.isfinite(times)], stated, "s", f"{label}: column '{column}'")
        if times.size < FEWEST or (np.diff(times) <= 0).any():
            raise StickslipError(
                f"'{column}' of {label} holds {times.size} event times; {FEWEST} or more are needed, ascending."
            )
        timed[contact] = times
    if not any(name not in events.values() for name in columns):
        return None, timed
    log = _measured(source, label)
    samples = {name: values for name, values in log.columns.items() if name not in events.values()}
    return replace(log, columns=samples), timed


def _around(events: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """(2,) s, where a run over events begins and ends: at 0, if that is shortly before them."""
    times = np.sort(np.concatenate(list(events.values())))
    apart = float(np.median(np.diff(times)))
    return np.array([0.0 if 0 < times[0] <= 2 * apart else times[0] - apart / 2, times[-1] + apart / 100])


def measurable(fmu: Fmu) -> list[str]:
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
    return sum(values.size for log in logs for values in log.observed.values())
