"""A table as a reader found it, and the checks all formats share: units, finite numbers, whole counts, rising time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fmu_models.errors import StickslipError, nearest
from rig_io.columns import ANGLE_SOURCES, COLUMNS, TIME, Column

SHORTEST = 10  # samples; fewer cannot show a single movement
AHEAD = 0.010  # s; an edge stamped later than this after its tick was stamped by another clock


@dataclass(frozen=True)
class Table:
    """Numbers as read. columns: name -> (n_rows,) float64 (NaN where a cell holds no number).

    units: those the file itself states; first_line: line of the first row in the file, None where a file has no lines;
    scalars: single numbers beside the columns; left_out: name -> why it is no column.
    """

    source: str
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    first_line: int | None
    scalars: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)

    def place(self, row: int) -> str:
        """Where a row (from 0) is in the file, for messages."""
        return f"sample {row + 1}" if self.first_line is None else f"line {self.first_line + row}"


def checked(table: Table, stated_units: Mapping[str, str]) -> dict[str, np.ndarray]:
    """The known columns of a table in their expected units, ``time`` first; unknown columns are left out.

    stated_units: from the sidecar; where it is silent the file's own units count.

    Raises:
        StickslipError: a needed column or unit is missing, a unit has another dimension, a cell is not a finite number,
            a count is not whole, time does not rise, there are fewer than `SHORTEST` rows.
    """
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
    found: dict[str, np.ndarray] = {}
    for name, column in COLUMNS.items():
        if name not in table.columns:
            continue
        values = _numbers(table, column)
        found[name] = _in_unit(table, column, values, stated_units.get(name, table.units.get(name)))
    _check_time(table, found[TIME.name])
    for name in found:
        if name.endswith("_edge_time"):
            _check_edges(table, name, found[TIME.name], found[name.removesuffix("_edge_time") + "_count"], found[name])
    return found


def _missing(table: Table, name: str, what: str = "") -> StickslipError:
    if name in table.left_out:
        return StickslipError(
            f"{table.source}: '{name}' is {table.left_out[name]}. It is needed as a vector of numbers."
        )
    hint = nearest(name, table.columns)
    return StickslipError(
        f"{table.source} lacks {what or repr(name)}; its columns are {', '.join(table.columns)}."
        f"{hint if 'Did' in hint else ''} Rename the column (names as in data/README.md)."
    )


def _numbers(table: Table, column: Column) -> np.ndarray:
    values = table.columns[column.name]
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise StickslipError(
            f"{table.source}: column '{column.name}' has {bad.size} cells without a finite number, the first on "
            f"{table.place(bad[0])}. Cut the log before or after them, or repair them at the source."
        )
    if column.whole:
        broken = np.flatnonzero(values != np.round(values))
        if broken.size:
            raise StickslipError(
                f"{table.source}: column '{column.name}' counts edges, but {table.place(broken[0])} holds "
                f"{values[broken[0]]:g}. Log the raw count; an angle belongs in a column 'angle' [rad]."
            )
    return values


def _in_unit(table: Table, column: Column, values: np.ndarray, unit: str | None) -> np.ndarray:
    """Values in the column's unit; pint is loaded only when the stated unit is not that very string."""
    if unit is None:
        header = "" if table.first_line is None else f", or write the header as '{column.name} [{column.unit}]'"
        raise StickslipError(
            f'{table.source}: column \'{column.name}\' has no unit. Add "unit": "{column.unit}" to its field in '
            f"datapackage.json{header}."
        )
    if unit == column.unit or (column.unit == "1" and unit in ("", "count", "counts", "pulses")):
        return values
    return values * conversion(unit, column.unit, f"{table.source}: column '{column.name}'")


def conversion(unit: str, expected: str, where: str) -> float:
    """Factor from one unit to another.

    Raises:
        StickslipError: the unit is unknown or has another dimension; the message begins with ``where``.
    """
    if unit == expected:
        return 1.0
    import pint

    from fmu_models.language.unit_names import parse_unit

    try:
        return float(parse_unit(unit).to(parse_unit(expected).units).magnitude)
    except pint.DimensionalityError as error:
        raise StickslipError(
            f"{where} is in '{unit}', which cannot be converted to {expected}. Check the unit, or whether columns were "
            "mixed up."
        ) from error
    except Exception as error:  # pint hands an ill-formed unit to Python's tokenizer and lets any of its errors through
        raise StickslipError(f"{where} has the unknown unit '{unit}'. Write {expected} or a multiple of it.") from error


def _check_time(table: Table, time: np.ndarray) -> None:
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0)
    if back.size:
        raise StickslipError(
            f"{table.source}: time falls from {time[back[0]]:.9g} s to {time[back[0] + 1]:.9g} s on "
            f"{table.place(back[0] + 1)} ({back.size} such steps). Sort the rows by time, or "
            "split the file where the clock was reset."
        )
    same = np.flatnonzero(steps == 0)
    if same.size:
        raise StickslipError(
            f"{table.source}: {table.place(same[0] + 1)} repeats the time {time[same[0]]:.9g} s ({same.size} repeats). "
            "Remove doubled rows, or write time with nine digits after the point."
        )


def _check_edges(table: Table, name: str, time: np.ndarray, count: np.ndarray, stamp: np.ndarray) -> None:
    advance = np.diff(stamp)
    faults = (
        ("runs ahead of the tick", stamp[1:] > time[1:] + AHEAD, "Log both on one clock."),
        ("falls", advance < 0, "Log the clock without wrapping, on the scale of 'time'."),
        ("stays while the count changes", (advance == 0) & (np.diff(count) != 0), "Log the time of the last edge."),
    )
    for fault, where, advice in faults:
        if where.any():
            place = table.place(int(np.argmax(where)) + 1)
            raise StickslipError(f"{table.source}: '{name}' {fault} on {place} ({where.sum()} times). {advice}")
