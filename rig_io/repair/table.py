"""A table as a reader found it, and the checks all formats share: units, sizes, numbers, whole counts, the clock."""

import difflib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import scale_of
from rig_io.logs.columns import ANGLE_SOURCES, COLUMNS, TIME, LogColumn, metres
from rig_io.logs.table import Table
from rig_io.repair.clock import SHORTEST, check_repairs, mended
from rig_io.repair.plausible import check_sizes

AHEAD = 0.010  # s; an edge stamped later than this after its tick was stamped by another clock
COUNTED = ("", "1", "count", "counts", "pulses")  # how files call the unit of a count


@dataclass(frozen=True, eq=False)
class Checked:
    """Columns of a rig log, ``time`` first, each (n,) float64 in its expected unit; NaN where the file has no number.

    breaks: samples at which a further recording begins; said: what was mended, in sentences; table: where they are
    from, with the rows that are left; units: of the columns, of which only a laser's may be another one than usual (m).
    """

    table: Table
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    breaks: tuple[int, ...]
    said: tuple[str, ...]


def checked(table: Table, repair: Collection[str] = ()) -> Checked:
    """The known columns of a table in their expected units, on a rising clock; unknown columns are left out.

    repair: see `rig_io.repair.clock`.

    Raises:
        StickslipError: a needed column or unit is missing, a unit has another dimension, a count is not whole, a column
            holds no number or one of implausible size, time cannot be put in order, there are fewer than `SHORTEST`
            rows.
    """
    check_repairs(repair)
    if TIME.name not in table.columns:
        raise _missing(table, TIME.name)
    if not any(name in table.columns for name in ANGLE_SOURCES):
        raise _missing(table, "laser", "one source of the disc's angle ('laser', 'encoder_count' or 'angle')")
    for name in table.columns:
        count = name.removesuffix("_edge_time") + "_count"
        if name in COLUMNS and name.endswith("_edge_time") and count not in table.columns:
            raise _missing(table, count, f"'{count}', without which the edge times say nothing of the angle,")
    rows = len(table.columns[TIME.name])
    if rows < SHORTEST:
        raise StickslipError(
            f"{table.source} is too short: {rows} rows, at least {SHORTEST} are needed. Record a longer log."
        )
    standard = {name: column for name, column in COLUMNS.items() if name in table.columns}
    if "laser" in standard and metres(table.units.get("laser")):  # a telemeter that writes lengths
        standard["laser"] = replace(standard["laser"], unit="m")
    converted = {
        name: _in_unit(table, column, _whole(table, column), table.units.get(name)) for name, column in standard.items()
    }
    clock = mended(converted[TIME.name], table, repair)
    table = replace(table, rows=clock.rows)
    remarks = list(clock.said)
    columns = {name: values[clock.rows] for name, values in converted.items()}
    columns[TIME.name] = clock.time
    for name in columns:
        if name.endswith("_edge_time"):
            columns[name] = columns[name] + clock.moved
        if name != TIME.name:
            remarks += _missing_numbers(table, name, columns[name])
    check_sizes(table.source, columns)
    return Checked(
        table, columns, {name: column.unit for name, column in standard.items()}, clock.breaks, tuple(remarks)
    )


def _missing(table: Table, name: str, detail: str = "") -> StickslipError:
    if name in table.left_out:
        return StickslipError(
            f"{table.source}: '{name}' is {table.left_out[name]}. It is needed as a vector of numbers."
        )
    others = [*table.columns, *table.left_out]
    # closer than for a slip of the keys: 'Antrieb' has half the letters of 'time'
    close = difflib.get_close_matches(name, others, n=1, cutoff=0.7)
    hint = f" Did you mean '{close[0]}'?" if close else ""
    return StickslipError(
        f"{table.source} lacks {detail or repr(name)}; its columns are {', '.join(others)}.{hint} Say which one it is: "
        f"stickslip describe FILE --map COLUMN={name}."
    )


def _whole(table: Table, column: LogColumn) -> np.ndarray:
    """Values of a column, NaN where infinite; those of a count must be whole."""
    values = table.columns[column.name]
    values = np.where(np.isfinite(values), values, np.nan)
    if column.whole:
        broken = np.flatnonzero((values != np.round(values)) & ~np.isnan(values))
        if broken.size:
            raise StickslipError(
                f"{table.source}: column '{column.name}' counts edges, but {table.place(broken[0])} holds "
                f"{values[broken[0]]:g}. Log the raw count; an angle belongs in a column 'angle' [rad]."
            )
    return values


def _missing_numbers(table: Table, name: str, values: np.ndarray) -> list[str]:
    """What to say of cells without a number."""
    bad = np.flatnonzero(np.isnan(values))
    if bad.size == len(values):
        raise StickslipError(f"{table.source}: column '{name}' holds no number. Check the column, or leave it out.")
    if not bad.size:
        return []
    share = 100 * bad.size / len(values)
    return [
        f"column '{name}' has {bad.size} cells without a number ({share:.2g} %), the first on {table.place(bad[0])}."
    ]


def _in_unit(table: Table, column: LogColumn, values: np.ndarray, unit: str | None) -> np.ndarray:
    """Values in the column's unit; converted only when the stated unit is another string."""
    if unit is None:
        header = "" if table.first_line is None else f", or write the header as '{column.name} [{column.unit}]'"
        raise StickslipError(
            f"{table.source}: column '{column.name}' has no unit. State it: stickslip describe FILES --unit "
            f"COLUMN={column.unit}{header}."
        )
    if unit == column.unit or (column.unit == "1" and unit in COUNTED):
        return values
    factor, zero = scale_of(unit, column.unit, f"{table.source}: column '{column.name}'")
    return values * factor + zero


def check_edges(table: Table, columns: Mapping[str, np.ndarray], breaks: Sequence[int]) -> None:
    """Edge times of each recording against its ticks and its counts. StickslipError: edges stamped by another clock, or
    in another unit, or not at all."""
    for name in columns:
        if name.endswith("_edge_time"):
            for first, last in pairwise([0, *breaks, len(columns[TIME.name])]):
                _check_edges(table, name, columns, slice(first, last))


def _check_edges(table: Table, name: str, columns: Mapping[str, np.ndarray], span: slice) -> None:
    time, stamp = columns[TIME.name][span], columns[name][span]
    steps = np.diff(columns[name.removesuffix("_edge_time") + "_count"][span])
    changed = np.isfinite(steps) & (steps != 0)  # a count that is missing is spoken of elsewhere
    advance = np.diff(stamp)
    unit = "Log both on one clock, and state the unit in which each is written."
    faults = (
        ("runs ahead of the tick", stamp[1:] > time[1:] + AHEAD, unit),
        ("falls", advance < 0, "Log the clock without wrapping, on the scale of 'time'."),
        ("stays while the count changes", (advance == 0) & changed, "Log the time of the last edge."),
        ("lies ticks before the count changes", changed & (stamp[1:] < time[:-1] - AHEAD), unit),
    )
    for fault, where, advice in faults:
        if where.any():
            position = table.place(span.start + int(np.argmax(where)) + 1)
            raise StickslipError(f"{table.source}: '{name}' {fault} on {position} ({where.sum()} times). {advice}")
