"""Several files of one run as one table: signals side by side, stretches of time one after the other, two recorders.

columns   one file per signal (or some of them): as many rows in each, one clock
time      one recorder that began a new file: rows are appended, in the order of their clocks
clocks    two recorders: see `rig_io.joining.clocks`
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.unit_names import conversion
from rig_io.joining.clocks import ClockFit, on_one_clock
from rig_io.logs.columns import TIME
from rig_io.logs.stamps import DAY
from rig_io.logs.table import Table

RULES = ("columns", "time", "clocks")
SAME = 0.5  # sample intervals by which the clocks of files with one signal each may differ


@dataclass(frozen=True, eq=False)
class Joined:
    """table: of all files; clock: how the second recorder's clock stands to the first's, if there are two."""

    table: Table
    clock: ClockFit | None = None
    said: tuple[str, ...] = ()


def joined(tables: Sequence[Table], rule: str | None, sizes: Mapping[str, float]) -> Joined:
    """The tables of a run's files, columns by their roles, as one.

    sizes: for `on_one_clock`.

    Raises:
        StickslipError: an unknown rule, or files that do not fit together; with the reason.
    """
    if len(tables) == 1:
        return Joined(tables[0])
    if rule not in RULES:
        raise StickslipError(
            f"{_names(tables)} are files of one log, but how they belong together is not said"
            f"{f' (found {rule!r})' if rule else ''}.{nearest(str(rule), RULES)}"
        )
    if rule == "columns":
        return Joined(_by_columns(tables))
    if rule == "time":
        return _by_time(tables)
    if len(tables) != 2:
        raise StickslipError(f"{_names(tables)}: two recorders write two files, found {len(tables)}.")
    first, second = map(_in_seconds, tables)
    return Joined(*on_one_clock(first, second, sizes))


def _names(tables: Sequence[Table]) -> str:
    return " and ".join(table.source for table in tables)


def _by_columns(tables: Sequence[Table]) -> Table:
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    lengths = {table.source: len(next(iter(table.columns.values()))) for table in tables if table.columns}
    if len(set(lengths.values())) > 1:
        listing = ", ".join(f"{source} {rows}" for source, rows in lengths.items())
        raise StickslipError(
            f"Files that hold one signal each have one number of rows, found {listing}. If they are of two recorders: "
            "stickslip describe FILES --join clocks."
        )
    for table in tables:
        for name, values in table.columns.items():
            if name == TIME.name and name in columns:
                _check_same_clock(columns[name], values, units.get(name), table)
                continue
            if name in columns:
                raise StickslipError(
                    f"{table.source} holds a column '{name}', and so does a file before it. Keep one: stickslip "
                    "describe FILES --map COLUMN=none."
                )
            columns[name] = values
        units = {**table.units, **units}
    first = next((table for table in tables if TIME.name in table.columns), tables[0])
    ordered = {name: columns[name] for name in sorted(columns, key=lambda name: name != TIME.name)}
    left_out = {name: why for table in tables for name, why in table.left_out.items()}
    return replace(first, source=_names(tables), columns=ordered, units=units, left_out=left_out)


def _check_same_clock(first: np.ndarray, second: np.ndarray, unit: str | None, table: Table) -> None:
    factor = conversion(table.units.get(TIME.name, "s"), unit or "s", table.source)
    step = float(np.median(np.abs(np.diff(first)))) if len(first) > 1 else 0.0
    if np.nanmax(np.abs(first - factor * second), initial=0.0) > SAME * step:
        raise StickslipError(
            f"{table.source} has another clock than the files before it. If it is of another recorder: stickslip "
            "describe FILES --join clocks."
        )


def _in_seconds(table: Table) -> Table:
    if TIME.name not in table.columns:
        raise StickslipError(f"{table.source} has no clock, without which it cannot be joined to others in time.")
    factor = conversion(table.units.get(TIME.name, "s"), "s", table.source)
    changed = {
        name: factor * values
        for name, values in table.columns.items()
        if name == TIME.name or (name.endswith("_edge_time") and table.units.get(name) == table.units.get(TIME.name))
    }
    units = {**table.units, **dict.fromkeys(changed, "s")}
    return replace(table, columns={**table.columns, **changed}, units=units)


def _by_time(tables: Sequence[Table]) -> Joined:
    in_seconds = [_in_seconds(table) for table in tables]
    first = in_seconds[0]
    for table in in_seconds[1:]:
        if set(table.columns) != set(first.columns):
            raise StickslipError(
                f"{first.source} and {table.source} hold different columns, so they are no parts of one recording: "
                f"{', '.join(sorted(set(table.columns) ^ set(first.columns)))} is in one of them alone."
            )
        _check_zones(first, table)
        if table.units != first.units:
            raise StickslipError(f"{first.source} and {table.source} state different units. Record them alike.")
    moved = []  # clocks that count from the zero of the first one's
    for table in in_seconds:
        later = (table.begin - first.begin).total_seconds() if first.begin and table.begin else 0.0
        moved.append(_shifted(table, later, table.stamps))
    order = sorted(range(len(in_seconds)), key=lambda i: moved[i].columns[TIME.name][0])
    if all(table.begin is None for table in in_seconds):
        order = list(range(len(in_seconds)))  # clocks that begin anew do not tell which came first
        moved = _past_midnight(moved)
    columns = {name: np.concatenate([moved[i].columns[name] for i in order]) for name in first.columns}
    sentence = f"{len(in_seconds)} files were joined in time: {', '.join(in_seconds[i].source for i in order)}."
    return Joined(replace(first, source=_names(tables), columns=columns, first_line=None), None, (sentence,))


def _check_zones(first: Table, second: Table) -> None:
    if (first.begin is None) != (second.begin is None) or (
        first.begin and second.begin and (first.begin.tzinfo is None) != (second.begin.tzinfo is None)
    ):
        raise StickslipError(
            f"{first.source} and {second.source}: the stamps of one state a date or a time zone, those of the other do "
            "not, so that they cannot be put in order. Write both alike."
        )


def _shifted(table: Table, shift: float, names: Sequence[str]) -> Table:
    return replace(table, columns={n: v + shift if n in names else v for n, v in table.columns.items()})


def _past_midnight(tables: list[Table]) -> list[Table]:
    """Times of day without a date: a file that begins half a day before the last one ended is of the next day."""
    moved = tables[:1]
    for table in tables[1:]:
        before = float(np.nanmax(moved[-1].columns[TIME.name]))
        start = float(table.columns[TIME.name][0])
        days = DAY * np.ceil((before - start) / DAY - 0.5) if TIME.name in table.stamps else 0.0
        moved.append(_shifted(table, float(days), table.stamps))
    return moved
