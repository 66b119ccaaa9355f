"""CSV: one header row of plain names (or ``name [unit]``, or a row of units below), then numbers.

Accepted besides comma and dot: a byte-order mark; ``;`` or tab between cells; a decimal comma with those.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.log import StickslipWarning
from rig_io.logs.table import Reader, Table, content

if TYPE_CHECKING:
    from pandas import DataFrame

# what recorders write where they have no number; the first are passed to pandas, the pattern knows all of them
NO_NUMBER = ["", "nan", "NaN", "NAN", "NA", "N/A", "null", "None"]
_NO_NUMBER = re.compile(
    r"([+-]?(1[.,]#(QNAN|SNAN|IND|INF)\d*|[qs]?nan(\(\w*\))?|inf(inity)?|over|overflow|overrange|underflow|ol)"
    r"|n/?a|#n/a|#num!|#value!|#div/0!|null|none|-+)?",
    re.IGNORECASE,
)
_NAME_AND_UNIT = re.compile(r"^(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?$")
_DECIMAL_COMMA = re.compile(r"^\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*$")


@dataclass(frozen=True)
class _Layout:
    """How a file is written: separator, decimal mark, names, units it states, line of its first row (from 1)."""

    separator: str
    decimal: str
    names: tuple[str, ...]
    units: Mapping[str, str]
    first_line: int


def read(path: Path) -> Table:
    """Read every column of a CSV file as numbers.

    A truncated last row is dropped with a `StickslipWarning`.

    Raises:
        StickslipError: the file is missing, empty, not text, without header, holds a row of another length or a cell
            that is no number; with the line number.
    """
    lines, whole = _lines(path)
    layout = _layout(path, lines)
    last = _last_row(path, lines, layout, whole)
    return Table(
        f"'{path}'", _numbers(path, lines[layout.first_line - 1 : last], layout), layout.units, layout.first_line
    )


def write(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write columns, each (n_rows,): time with nine digits after the point, counts whole, the rest to the last bit."""
    import pandas

    cells: dict[str, object] = {}
    for name, values in columns.items():
        if name == TIME.name:
            cells[name] = [f"{value:.9f}" for value in values]
        else:
            cells[name] = values.astype(np.int64) if name in COLUMNS and COLUMNS[name].whole else values
    pandas.DataFrame(cells).to_csv(path, index=False, lineterminator="\n")


def _lines(path: Path) -> tuple[list[str], bool]:
    """Lines of the file without trailing blank ones, and whether the last one was ended by a line break."""
    data = content(path, "a header row with 'time' and rows of numbers")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise StickslipError(f"'{path}' is not UTF-8 text (byte {error.start}). Save it as CSV in UTF-8.") from error
    if "\0" in text:
        raise StickslipError(f"'{path}' holds zero bytes: a binary file or UTF-16 text. Save it as CSV in UTF-8.")
    lines = text.splitlines()
    while not lines[-1].strip():
        lines.pop()
    return lines, text.endswith(("\n", "\r"))


def _layout(path: Path, lines: list[str]) -> _Layout:
    header = lines[0]
    separator = next((mark for mark in (";", "\t") if mark in header), ",")
    found = [_NAME_AND_UNIT.match(cell.strip().strip('"').strip()) for cell in header.split(separator)]
    if None in found:
        raise StickslipError(
            f"'{path}': the header cell {found.index(None) + 1} of '{header[:60]}' is not a name or 'name [unit]'. "
            "Name every column."
        )
    names = [match["name"] for match in found if match]
    if all(_is_number(name.replace(",", ".")) for name in names):
        raise StickslipError(f"'{path}' begins with numbers. Expected a header row of names, 'time' among them.")
    double = next((name for name in names if names.count(name) > 1), None)
    if double is not None:
        raise StickslipError(f"'{path}' has two columns named '{double}'. Rename or remove one.")
    units = {match["name"]: match["unit"] for match in found if match and match["unit"] is not None}
    first = 1
    below = [cell.strip().strip('"').strip("[]() ") for cell in lines[1].split(separator)] if len(lines) > 1 else []
    if len(below) == len(names) and all(map(_is_unit, below)) and set(below) - {"", "1"}:
        units |= dict(zip(names, below, strict=True))
        first = 2
    if len(lines) == first:
        raise StickslipError(f"'{path}' has a header but no rows of numbers.")
    sample = [cell for line in lines[first : first + 20] for cell in line.split(separator)]
    comma = separator != "," and any(_DECIMAL_COMMA.match(cell) for cell in sample)
    return _Layout(separator, "," if comma else ".", tuple(names), units, first + 1)


def _last_row(path: Path, lines: list[str], layout: _Layout, whole: bool) -> int:
    """Number of lines to use: all, or all but a truncated last one."""
    expected = len(layout.names) - 1
    wrong = [i for i in range(layout.first_line - 1, len(lines)) if lines[i].count(layout.separator) != expected]
    last = len(lines) - 1
    torn = wrong == [last] and lines[last].count(layout.separator) < expected
    if torn or (not wrong and not whole and lines[last].rstrip().endswith(layout.separator)):
        warnings.warn(f"'{path}': line {last + 1} is cut off and was left out.", StickslipWarning, stacklevel=4)
        return last
    if wrong:
        line = wrong[0]
        advice = "Mend or remove the row."
        if layout.separator == "," and len(wrong) > 1 and lines[line].count(",") >= 2 * expected:
            advice = "A comma as decimal mark needs ';' between cells, or use a decimal point."
        raise StickslipError(
            f"'{path}': line {line + 1} has {lines[line].count(layout.separator) + 1} cells, the header has "
            f"{len(layout.names)}. {advice}"
        )
    return len(lines)


def _numbers(path: Path, rows: list[str], layout: _Layout) -> dict[str, np.ndarray]:
    if not rows:
        raise StickslipError(f"'{path}' has a header but no complete row of numbers.")
    import pandas

    try:
        frame = _parsed(rows, layout)
    except (ValueError, pandas.errors.ParserError):
        mark = layout.separator
        plain = [mark.join("" if _is_none(cell) else cell for cell in row.split(mark)) for row in rows]
        try:
            frame = _parsed(plain, layout)
        except (ValueError, pandas.errors.ParserError) as error:
            raise _no_number(path, rows, layout) from error
    return {name: frame[name].to_numpy() for name in layout.names}


def _parsed(rows: list[str], layout: _Layout) -> DataFrame:
    import pandas

    return pandas.read_csv(
        StringIO("\n".join(rows) + "\n"),
        sep=layout.separator,
        decimal=layout.decimal,
        header=None,
        names=list(layout.names),
        index_col=False,
        dtype=np.float64,
        na_values=NO_NUMBER,
        skipinitialspace=True,
        skip_blank_lines=False,
    )


def _is_none(cell: str) -> bool:
    return _NO_NUMBER.fullmatch(cell.strip().strip('"').strip()) is not None


def _no_number(path: Path, rows: list[str], layout: _Layout) -> StickslipError:
    """The error that names the first cell that is neither a number nor a recorder's word for none."""
    for i, row in enumerate(rows):
        for name, cell in zip(layout.names, row.split(layout.separator), strict=True):
            text = cell.strip()
            if not _is_none(text) and not _is_number(text.replace(layout.decimal, ".")):
                return StickslipError(
                    f"'{path}': line {layout.first_line + i}, column '{name}' holds '{text[:40]}', not a number. "
                    "Mend or remove the row."
                )
    return StickslipError(f"'{path}' cannot be read as a table of numbers. Save it again as plain CSV, UTF-8.")


def _is_unit(text: str) -> bool:
    """Whether a cell below the header can be a unit; that of a count may be written 1 or left out."""
    return text in ("", "1") or not (_is_number(text.replace(",", ".")) or _is_none(text))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


READER = Reader((".csv", ".txt"), read)
