"""XLSX and ODS: one sheet, a header of names (``name [unit]``, or a row of units below) above rows of numbers."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Sequence
from datetime import date, datetime, time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from rig_io.logs.guarded import Channel, Channels, need, table_of
from rig_io.logs.stamps import DAY
from rig_io.logs.table import Reader, Table
from rig_io.logs.text_layout import is_none, is_number, unit_like, unit_of

if TYPE_CHECKING:
    import pandas

UNPACKED = 2 << 30  # bytes of all parts of the archive
HEADER = 40  # rows within which the table begins


def read(path: Path, **options: str) -> Table:
    """Read every column of a sheet. StickslipError: the file is missing, damaged or none of its kind; several sheets
    hold tables and none is chosen; openpyxl (odfpy) is not installed."""
    if path.suffix.lower() == ".ods":
        need("odf", "odfpy", "ODS files")
    else:
        need("openpyxl", "openpyxl", "XLSX files")
    return table_of(path, channels, "a workbook with a sheet of numbers", (b"PK\x03\x04",), **options)


def channels(path: str, sheet: str = "") -> Channels:
    """The columns of a sheet; in the child."""
    with zipfile.ZipFile(path) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > UNPACKED:
            raise StickslipError(f"'{path}' unpacks to more than {UNPACKED >> 30} GB. Save it as CSV.")
    import pandas

    frames = pandas.read_excel(path, sheet_name=None, header=None, dtype=object)
    chosen = {str(name): frame for name, frame in frames.items() if sheet in ("", str(name))}
    if not chosen:
        raise StickslipError(f"'{path}' has no sheet '{sheet}'.{nearest(sheet, map(str, frames))}")
    tables = {name: table for name, frame in chosen.items() if (table := _table(frame)) is not None}
    if len(tables) > 1:
        raise StickslipError(
            f"'{path}' has tables in the sheets {', '.join(tables)}. Say which one: stickslip describe FILE --read "
            "sheet=NAME."
        )
    return next(iter(tables.values()), Channels([]))


def _table(frame: pandas.DataFrame) -> Channels | None:
    """The table in a sheet: below the last row of words within the first ones."""
    cells = ([None if cell != cell else cell for cell in row] for row in frame.itertuples(index=False))
    rows = [row for row in cells if any(cell not in (None, "") for cell in row)]
    start = next((i for i, row in enumerate(rows[:HEADER]) if _is_row(row)), None)
    if start is None:
        return None
    width = max(len(row) for row in rows[start : start + HEADER])
    names, units = _header(rows[:start], width)
    channels: list[Channel] = []
    left_out: dict[str, str] = {}
    stamps, origin = [], ""
    for j in range(width):
        cells = [row[j] if j < len(row) else None for row in rows[start:]]
        if all(cell in (None, "") for cell in cells):
            continue
        name = names[j] or f"column {j + 1}"
        while name in {channel.name for channel in channels}:
            name += " (2)"
        if any(isinstance(cell, datetime | date | time) for cell in cells[:HEADER]):
            values, begun = _seconds(cells)
            origin = origin or begun
            channels.append(Channel(name, values, "s"))
            stamps.append(name)
            continue
        try:
            values = np.array([_number(cell) for cell in cells])
        except ValueError:
            left_out[name] = "a column of words"
            continue
        channels.append(Channel(name, values, units[j]))
    notes = [" ".join(str(cell) for cell in row if cell is not None) for row in rows[: max(start - 1, 0)]]
    return Channels(channels, left_out, {}, origin, stamps, notes) if channels else None


def _is_row(row: Sequence[Any]) -> bool:
    filled = [cell for cell in row if cell not in (None, "")]
    numbers = [cell for cell in filled if isinstance(cell, int | float | datetime | date | time)]
    return len(numbers) >= max(1, 0.5 * len(filled))


def _header(above: Sequence[Sequence[Any]], width: int) -> tuple[list[str], list[str]]:
    """Names and units of the columns."""
    empty = [""] * width
    if not above:
        return empty, empty

    def words(row: Sequence[Any]) -> list[str]:
        return [*("" if cell is None else str(cell).strip() for cell in row), *empty][:width]

    last = words(above[-1])
    bare = [cell.strip("[]() ") for cell in last]
    are_units = len(above) > 1 and any(map(unit_like, bare)) and all(b in ("", "1", "-") or unit_like(b) for b in bare)
    if are_units:
        return words(above[-2]), ["1" if b in ("", "-") else b for b in bare]
    pairs = [unit_of(cell) for cell in last]
    return [name for name, _ in pairs], [unit or "" for _, unit in pairs]


def _number(cell: float | str | None) -> float:
    """A cell as a number, NaN for none; raises ValueError for a word."""
    if cell is None or (isinstance(cell, str) and is_none(cell.strip())):
        return np.nan
    if isinstance(cell, str):
        text = cell.strip().replace(",", ".") if is_number(cell.strip(), ",") else cell.strip()
        return float(text)
    return float(cell)


def _seconds(cells: Iterable[Any]) -> tuple[np.ndarray, str]:
    """Seconds since the first midnight, and that midnight (ISO, "" for times of day)."""
    times, first = [], None
    for cell in cells:
        if isinstance(cell, datetime):
            first = first or datetime(cell.year, cell.month, cell.day)
            times.append((cell - first).total_seconds())
        elif isinstance(cell, time):
            times.append(cell.hour * 3600 + cell.minute * 60 + cell.second + 1e-6 * cell.microsecond)
        elif isinstance(cell, date):
            first = first or datetime(cell.year, cell.month, cell.day)
            times.append(DAY * (cell - first.date()).days)
        else:
            times.append(np.nan)
    return np.array(times), first.isoformat() if first else ""


READER = Reader((".xlsx", ".xlsm", ".ods"), read, {"sheet": "name of the sheet"})
