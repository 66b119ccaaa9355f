"""Text: rows of numbers, above them perhaps a header of names (``name [unit]``, or a row of units) and other lines.

Accepted besides comma and dot: any encoding, `;`, tab, `|` or blanks between cells, a decimal comma, quotation marks,
columns without names, columns of words (left out), date and time in one column or in two.
"""

from __future__ import annotations

import codecs
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, StickslipWarning
from rig_io.logs import stamps
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.table import Reader, Table, check_file
from rig_io.logs.text_layout import (
    BLANKS,
    HEAD,
    NO_NUMBER,
    TextLayout,
    encoding_of,
    is_none,
    is_number,
    layout_of,
    unquoted,
)

if TYPE_CHECKING:
    from pandas import DataFrame

BLOCK = 1 << 24  # bytes that are read at once
OPTIONS = {
    "encoding": "of the text, such as latin-1",
    "separator": "semicolon, tab, comma, bar or blank",
    "decimal": "point or comma",
    "header": "number of the line that names the columns, 0 for none",
    "dates": "day or month: which stands first in 03/04/2025",
}


def read(path: Path, **options: str) -> Table:
    """Read every column of a text file as numbers.

    A truncated last row is dropped with a `StickslipWarning`.

    Raises:
        StickslipError: the file is missing, empty, not text, holds no rows of numbers, a row of another length or a
            cell that is no number; with the line number.
    """
    check_file(path, "a header row with 'time' and rows of numbers")
    if options.get("dates", "day") not in stamps.ORDERS:
        raise StickslipError(f"'{path}': dates begin with the 'day' or the 'month', found '{options['dates']}'.")
    with _as_lines(path, options) as (file, encoding):
        head = file.read(HEAD)
        layout = layout_of(path, head, len(head) < HEAD, encoding, options)
        file.seek(layout.offset)
        return _table(path, layout, _blocks(file))


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


@contextmanager
def _as_lines(path: Path, options: Mapping[str, str]) -> Iterator[tuple[IO[bytes], str]]:
    """The file with lines that end in a line feed, in an encoding that has ASCII in it, and that encoding."""
    with open(path, "rb") as file:
        head = file.read(HEAD)
        if not head.strip():
            raise StickslipError(f"The log '{path}' is empty. Expected a header row with 'time' and rows of numbers.")
        encoding = options.get("encoding") or encoding_of(path, head)
        try:
            codecs.lookup(encoding)
        except LookupError:
            raise StickslipError(f"'{path}': there is no encoding '{encoding}'. Known are utf-8, latin-1 ...") from None
        wide = encoding.lower().replace("_", "-").startswith(("utf-16", "utf-32"))
        old = b"\r" in head and b"\n" not in head
        file.seek(0)
        if not (wide or old):
            yield file, encoding
            return
        try:
            text = file.read().decode(encoding)
        except UnicodeDecodeError as error:
            raise StickslipError(
                f"'{path}' is not {encoding} text (byte {error.start}). Save it as CSV in UTF-8, or say what it is: "
                "stickslip describe FILE --read encoding=NAME."
            ) from error
    yield BytesIO(text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").encode("utf-8")), "utf-8"


def _blocks(file: IO[bytes]) -> Iterator[tuple[bytes, bool]]:
    """Whole lines of a file, some megabytes of them, and whether they are the last."""
    remainder = b""
    while True:
        data = file.read(BLOCK)
        if not data:
            yield remainder, True
            return
        end = data.rfind(b"\n") + 1
        if not end:
            remainder += data
            continue
        lines, remainder = remainder + data[:end], data[end:]
        # blank lines at the end of the file belong to the last block
        body = lines.rstrip(b"\r\n\t \x1a")
        keep = lines.find(b"\n", len(body)) + 1
        remainder = lines[keep:] + remainder
        yield lines[:keep], False


def _table(path: Path, layout: TextLayout, blocks: Iterator[tuple[bytes, bool]]) -> Table:
    """All rows, block by block."""
    numeric = [j for j, kind in enumerate(layout.kinds) if kind not in ("text", "empty")]
    pieces: dict[int, list[np.ndarray]] = {j: [] for j in numeric}
    zoned: dict[int, set[bool]] = {j: set() for j in numeric}
    line = layout.first_line
    for block, last in blocks:
        if last:
            block = _whole_rows(path, block, layout, line)
        if not block.strip():
            break
        frame = _frame(path, block, layout, numeric, line)
        for j in numeric:
            if layout.kinds[j] == "number":
                pieces[j].append(frame[j].to_numpy())
                continue
            try:
                times, zone = stamps.instants(frame.loc[:, j], layout.kinds[j], layout.dates)
            except StickslipError as error:
                raise StickslipError(
                    f"'{path}', from line {line} on, column '{layout.names[j]}': {error}. Write all in one zone."
                ) from error
            pieces[j].append(times)
            zoned[j].add(zone)
        line += len(frame)
    if line == layout.first_line:
        raise StickslipError(f"'{path}' has a header but no complete row of numbers.")
    return _joined(path, layout, pieces, zoned)


def _joined(
    path: Path, layout: TextLayout, pieces: dict[int, list[np.ndarray]], zoned: Mapping[int, set[bool]]
) -> Table:
    """The table of the parts of each column; a date and a time of day become one column."""
    columns: dict[str, np.ndarray] = {}
    units = dict(layout.units)
    names: list[str] = []
    start = None
    for j in list(pieces):
        values, name, kind = np.concatenate(pieces.pop(j)), layout.names[j], layout.kinds[j]
        if kind == "number":
            columns[name] = values
            continue
        if len(zoned[j]) > 1:
            raise StickslipError(f"'{path}': some stamps of column '{name}' state a time zone, some do not.")
        time, origin = stamps.seconds(values, kind, True in zoned[j])
        columns[name] = time
        units[name] = "s"
        names.append(name)
        start = start or origin
    kinds = dict(zip(layout.names, layout.kinds, strict=True))
    dates = [name for name in names if kinds[name] == "date"]
    clocks = [name for name in names if kinds[name] == "time of day"]
    if len(dates) == 1 and len(clocks) == 1:
        # dates count from the first one: the time of day that falls at midnight begins there anew
        day, clock = columns.pop(dates[0]), columns.pop(clocks[0])
        within = np.mod(clock, stamps.DAY)
        joined = f"{dates[0]} {clocks[0]}"
        columns = {joined: day + within, **columns}
        units = {joined: "s", **{name: unit for name, unit in units.items() if name not in (dates[0], clocks[0])}}
        names = [joined, *(name for name in names if name not in (dates[0], clocks[0]))]
    words = {
        name: "a column of words" if kind == "text" else "a column of nothing"
        for name, kind in kinds.items()
        if kind in ("text", "empty") and (kind == "text" or not name.startswith("column "))
    }
    return Table(
        f"'{path}'",
        columns,
        units,
        layout.first_line,
        left_out=words,
        nameless=layout.nameless,
        doubled=layout.doubled,
        begin=start,
        stamps=tuple(names),
        notes=layout.notes,
    )


def _whole_rows(path: Path, block: bytes, layout: TextLayout, line: int) -> bytes:
    """The last block without blank lines at its end, and without a last row that is cut off."""
    ended = block.endswith((b"\n", b"\r"))
    body = block.rstrip(b"\r\n\t \x1a" if layout.separator != "\t" else b"\r\n \x1a")
    if not body.strip():
        return b""
    start = body.rfind(b"\n") + 1
    final = body[start:].decode(layout.encoding, errors="replace")
    cells = _count(final, layout)
    before = body[:start]
    short = cells < len(layout.names)
    if (short and not ended) or (not ended and final.endswith(layout.separator) and layout.kinds[-1] != "empty"):
        if line == layout.first_line and not before.strip():
            raise StickslipError(f"'{path}' has a header but no complete row of numbers.")
        number = line + before.count(b"\n")
        warnings.warn(f"'{path}': line {number} is cut off and was left out.", StickslipWarning, stacklevel=6)
        return before
    return body + b"\n"


def _count(row: str, layout: TextLayout) -> int:
    """Cells of a row as it stands."""
    return len(layout.cells(row)) if layout.separator == BLANKS or '"' in row else row.count(layout.separator) + 1


def _frame(path: Path, block: bytes, layout: TextLayout, numeric: Sequence[int], line: int) -> DataFrame:
    """The wanted columns of a block of whole rows, numbers as float64, stamps as text."""
    import pandas

    if not block.isascii():
        block = block.decode(layout.encoding, errors="replace").encode("utf-8")
    if b'"' in block:
        block = unquoted(block.decode("utf-8"), layout.separator).encode("utf-8")
    rows = block.count(b"\n")
    if layout.separator == BLANKS:
        counted = all(len(row.split()) == len(layout.names) for row in block.split(b"\n")[:-1])
    else:
        counted = block.count(layout.separator.encode()) == rows * (len(layout.names) - 1)
    if not counted:
        raise _uneven_row(path, block, layout, line)
    try:
        # as many separators as rows need, and none with too many, which pandas refuses: none has too few
        return _parsed(block, layout, numeric)
    except (ValueError, OverflowError, pandas.errors.ParserError):
        text = block.decode("utf-8").replace("\r", "")
        if any(len(_raw(row, layout)) != len(layout.names) for row in text.split("\n")[:-1]):
            raise _uneven_row(path, block, layout, line) from None
        plain = "\n".join(
            layout.separator.replace(BLANKS, " ").join("NaN" if is_none(c) else c for c in _raw(row, layout))
            for row in text.split("\n")[:-1]
        )
        try:
            return _parsed((plain + "\n").encode("utf-8"), layout, numeric)
        except (ValueError, OverflowError, pandas.errors.ParserError) as error:
            raise _no_number(path, text, layout, numeric, line) from error


def _raw(row: str, layout: TextLayout) -> list[str]:
    return row.split() if layout.separator == BLANKS else [cell.strip() for cell in row.split(layout.separator)]


def _parsed(block: bytes, layout: TextLayout, numeric: Sequence[int]) -> DataFrame:
    import pandas

    everything = range(len(layout.names))
    kinds: Any = {j: np.float64 if layout.kinds[j] == "number" else "string" for j in everything}
    frame = pandas.read_csv(
        BytesIO(block),
        sep=layout.separator,
        decimal=layout.decimal,
        header=None,
        names=list(everything),
        index_col=False,
        dtype=kinds,
        na_values=NO_NUMBER,
        keep_default_na=True,
        skipinitialspace=True,
        skip_blank_lines=False,
        encoding="utf-8",
    )
    return frame.loc[:, list(numeric)]


def _uneven_row(path: Path, block: bytes, layout: TextLayout, line: int) -> StickslipError:
    """The error that names the first row of another length."""
    rows = block.decode("utf-8", errors="replace").split("\n")[:-1]
    counts = [_count(row.rstrip("\r"), layout) for row in rows]
    expected = len(layout.names)
    wrong = [i for i, count in enumerate(counts) if count != expected]
    first = wrong[0] if wrong else 0
    advice = "Mend or remove the row."
    if layout.separator == "," and len(wrong) > 1 and counts[first] >= 2 * expected - 1:
        advice = "A comma as decimal mark needs ';' between cells, or use a decimal point."
    return StickslipError(
        f"'{path}': line {line + first} has {counts[first]} cells, the header has {expected}. {advice}"
    )


def _no_number(path: Path, text: str, layout: TextLayout, numeric: Sequence[int], line: int) -> StickslipError:
    """The error that names the first cell that is neither a number nor a recorder's word for none."""
    for i, row in enumerate(text.split("\n")[:-1]):
        cells = _raw(row, layout)
        for j in numeric:
            if layout.kinds[j] == "number" and not is_none(cells[j]) and not is_number(cells[j], layout.decimal):
                other_mark = "," if layout.decimal == "." else "."
                advice = "Mend or remove the row."
                if is_number(cells[j], other_mark):
                    mark = "comma" if other_mark == "," else "point"
                    advice = f"If that is its decimal mark, say so: stickslip describe FILE --read decimal={mark}."
                return StickslipError(
                    f"'{path}': line {line + i}, column '{layout.names[j]}' holds '{cells[j][:40]}', not a number. "
                    f"{advice}"
                )
    return StickslipError(f"'{path}' cannot be read as a table of numbers. Save it again as plain CSV, UTF-8.")


READER = Reader((".csv", ".txt", ".tsv", ".asc", ".dat", ".t"), read, OPTIONS)
