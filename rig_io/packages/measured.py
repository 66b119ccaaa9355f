"""Any log as columns over time, for inputs of runs and for what runs are held against."""

from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing
from fmu_models.base.unit_names import conversion
from fmu_models.simulation.measured import MeasuredLog
from rig_io.logs.columns import TIME
from rig_io.logs.table import Table
from rig_io.packages.datapackage import described_columns
from rig_io.packages.described import Field

TIMES = ("time", "t")  # names of a column of times that nobody describes


def read_measured(path: Path) -> MeasuredLog:
    """Every column over the log's times in s; key ``hold`` of a column says that its values hold until the next one.
    StickslipError: as for `read_columns`; no column of times, times that run back or are missing, no rows."""
    table, fields, rate = described_columns(existing(path, "log"))
    clock = None if rate else _clock(table, fields)
    if clock is None:
        time = np.arange(len(next(iter(table.columns.values()), ()))) / float(rate or 1.0)
    else:
        unit = table.units.get(clock, TIME.unit)
        time = table.columns[clock] * conversion(unit, TIME.unit, f"{table.source}: column '{clock}'")
    _check(table, time, clock)
    return MeasuredLog(
        table.source,
        time,
        {name: values for name, values in table.columns.items() if name != clock},
        {name: unit for name, unit in table.units.items() if name != clock},
        frozenset(field.name for field in fields if field.hold),
        {field.name: field.variable for field in fields if field.variable},
        {field.name: field.instrument for field in fields},
        table.place,
    )


READ_MEASURED = read_measured


def _clock(table: Table, fields: tuple[Field, ...]) -> str:
    """The column of times: by its role, by its name, or the only one of dates and clock times."""
    declared = [field.name for field in fields if field.role == TIME.name and field.name in table.columns]
    named = [name for name in table.columns if name.strip().lower() in TIMES]
    for names in (declared, named, list(table.stamps)):
        if len(names) == 1:
            return names[0]
    listing = ", ".join(f"'{name}'" for name in table.columns)
    raise StickslipError(
        f"{table.source} has no column of times among {listing}. Call one 'time', or say which it is: stickslip "
        "describe FILE --map COLUMN=time."
    )


def _check(table: Table, time: np.ndarray, clock: str | None) -> None:
    if time.size < 2:
        raise StickslipError(f"{table.source} has {time.size} rows; at least two are needed.")
    missing = np.flatnonzero(~np.isfinite(time))
    if missing.size:
        raise StickslipError(
            f"{table.source}: '{clock}' holds no time on {table.place(int(missing[0]))} ({missing.size} times). Remove "
            "these rows."
        )
    rows = np.flatnonzero(np.diff(time) < 0)
    if rows.size:
        row = int(rows[0]) + 1
        raise StickslipError(
            f"{table.source}: the times run back on {table.place(row)} ({rows.size} times), from {time[row - 1]:.9g} s "
            f"to {time[row]:.9g} s. Sort the rows, or cut the log there."
        )
