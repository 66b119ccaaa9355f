"""A run beside what was measured: which columns of logs are which variables, and by how much the two differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.simulation.measured import MeasuredLog, column_of_log, read_measured
from fmu_models.simulation.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class MeasuredVariable(Shown):
    """What a column of a log says of a variable, within the run: time (n,) s, value (n,) in the variable's unit."""

    variable: str
    column: str
    source: str
    unit: str
    time: Vector
    value: Vector


@dataclass(frozen=True)
class Deviation(Shown):
    """Run less measurement, at the times of the samples.

    Attributes:
        rms, largest: in the unit of the variable; ``at``: s, where it is largest.
        span: difference of the largest and least measured value.
        share: rms relative to the span.
        samples: that lie within the run and hold a number.
    """

    variable: str
    column: str
    source: str
    unit: str
    rms: float
    largest: float
    at: float
    span: float
    share: float
    samples: int


@dataclass(frozen=True, eq=False)
class Beside(Shown):
    """A log to be set beside runs; columns: by variable, empty for all whose names are those of variables."""

    log: MeasuredLog
    columns: Mapping[str, str]

    @classmethod
    def read(cls, text: str) -> Beside:
        """``LOG`` for all of its columns, or ``VARIABLE=LOG:COLUMN``. StickslipError: another form, or a log that
        cannot be read."""
        variable, equals, column_text = text.partition("=")
        if not equals:
            return cls(read_measured(text), {})
        path, column = column_of_log(column_text)
        return cls(read_measured(path), {variable.strip(): column})

    def match(self, trajectory: Trajectory) -> list[MeasuredVariable]:
        """The measured variables of a run. StickslipError: no column is a variable, none lies in the run, or a unit
        cannot be converted."""
        log, variables = self.log, trajectory.values
        pairs = dict(self.columns) or {name: name for name in log.by_variable if name in variables}
        if not pairs:
            listing = ", ".join(f"'{name}'" for name in log.by_variable)
            raise StickslipError(
                f"{log.source}: none of its columns ({listing}) is a variable of the run ({', '.join(variables)}). "
                "Say which is: --beside VARIABLE=LOG:COLUMN."
            )
        inside = (log.time >= trajectory.time[0]) & (log.time <= trajectory.time[-1])
        measured = []
        for variable, column in pairs.items():
            refuse_unknown(variable, variables, f"{log.source}: the run has no variable '{variable}'.")
            unit = trajectory.units[variable]
            values = log.values(column, None if unit == "1" else unit, f"variable '{variable}'")
            usable = inside & np.isfinite(values)
            if not usable.any():
                raise StickslipError(
                    f"{log.source}: column '{column}' holds no number between {trajectory.time[0]:g} s and "
                    f"{trajectory.time[-1]:g} s, where the run is; the log covers {log.time[0]:g} s to "
                    f"{log.time[-1]:g} s."
                )
            measured.append(MeasuredVariable(variable, column, log.source, unit, log.time[usable], values[usable]))
        return measured


def times_beside(logs: Sequence[Beside], times: Vector) -> Vector:
    """Output times (n,) s, and those of all samples between the first and last of them."""
    if not logs:
        return times
    measured = np.concatenate([times, *(log.log.time for log in logs)])
    return np.unique(measured[(measured >= times[0]) & (measured <= times[-1])])


def deviations(trajectory: Trajectory, measured: Sequence[MeasuredVariable]) -> list[Deviation]:
    """One per measured variable; between output times the run is taken as straight."""
    rows = []
    for variable in measured:
        error = np.interp(variable.time, trajectory.time, trajectory[variable.variable].astype(float)) - variable.value
        rms, worst = float(np.sqrt(np.mean(error**2))), int(np.argmax(np.abs(error)))
        span = float(np.ptp(variable.value))
        share = rms / span if span > 0 else (0.0 if rms == 0 else float("inf"))
        names = variable.variable, variable.column, variable.source, variable.unit
        largest = float(abs(error[worst])), float(variable.time[worst])
        rows.append(Deviation(*names, rms, *largest, span, share, variable.time.size))
    return rows
