"""LVM (LabVIEW's text files): headers of ``key<separator>value`` ended by a mark, then the rows of one segment."""

from __future__ import annotations

import re
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs import stamps
from rig_io.logs.table import Reader, Table, check_file
from rig_io.logs.text_layout import HEAD, is_none, is_number

END = b"***End_of_Header***"
SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}
TIME = "time"


def read(path: Path) -> Table:
    """Read every channel as a column; the column of X becomes ``time``, or is made from its begin and step.

    Raises:
        StickslipError: the file is missing or no LVM file, has several segments, or a row that is none; with its line.
    """
    check_file(path, "a LabVIEW measurement file")
    data = path.read_bytes()
    if not data.lstrip(b"\xef\xbb\xbf").startswith(b"LabVIEW Measurement"):
        raise StickslipError(f"'{path}' is no LabVIEW measurement file: it does not begin with 'LabVIEW Measurement'.")
    ends = [match.start() for match in re.finditer(re.escape(END), data)]
    if len(ends) < 2:
        raise StickslipError(f"'{path}' is cut off: its headers do not end ('{END.decode()}' twice). Copy it again.")
    if len(ends) > 2:
        raise StickslipError(
            f"'{path}' holds {len(ends) - 1} segments with headers of their own. Save each as one file in LabVIEW "
            "(one header only)."
        )
    text = data[: min(ends[1] + HEAD, len(data))].decode("latin-1")
    file, channel = text[: ends[0]], text[ends[0] : ends[1]]
    said = re.search(r"^Separator\W(\w+)", file, re.MULTILINE)
    separator = SEPARATORS.get(said[1] if said else "", "\t")
    decimal = "," if re.search(r"^Decimal_Separator\W,", file, re.MULTILINE) else "."
    after = data.find(b"\n", ends[1]) + 1
    begin = data.find(b"\n", after) + 1
    if not after or not begin:
        raise StickslipError(f"'{path}' is cut off: it has no row of numbers. Copy it again from its source.")
    names = [cell.strip() for cell in data[after:begin].decode("latin-1").rstrip("\r\n").split(separator)]
    line = data.count(b"\n", 0, begin) + 1
    return _table(path, data[begin:], names, _settings(file, channel, separator), (separator, decimal), line)


def _settings(file: str, channel: str, separator: str) -> dict[str, list[str]]:
    """What the headers state: values of a key, one for each channel."""
    found: dict[str, list[str]] = {}
    for line in (file + "\n" + channel).splitlines():
        cells = [cell.strip() for cell in line.split(separator)]
        if cells[0] and len(cells) > 1:
            found[cells[0]] = cells[1:]
    return found


def _table(
    path: Path,
    rows: bytes,
    names: list[str],
    settings: Mapping[str, list[str]],
    marks: tuple[str, str],
    line: int,
) -> Table:
    separator, decimal = marks
    number = settings.get("Channels", [""])[0]
    if not number.isdigit() or not 0 < int(number) < len(names) + 1:
        raise StickslipError(f"'{path}' states {number or 'no number of'} channels and names {len(names)} columns.")
    channels = int(number)
    with_clock = settings.get("X_Columns", ["One"])[0]
    if with_clock == "Multi":
        raise StickslipError(f"'{path}' has a column of X for every channel. Save it with one (X columns: one only).")
    behind = int(with_clock == "One" or names[0] == "X_Value")
    kept = names[behind : behind + channels]
    places = [names.index(name) if names.count(name) == 1 else i + 1 for i, name in enumerate(kept)]
    wanted = ([0] if with_clock == "One" else []) + places
    values = _numbers(path, rows, len(names), wanted, separator, decimal, line)
    unique: list[str] = []
    for name in kept:
        unique.append(name if name not in unique and name != TIME else f"{name} ({unique.count(name) + 2})")
    columns: dict[str, np.ndarray] = {}
    if with_clock == "One":
        columns[TIME] = values[0]
    else:
        step, start = (_number(settings.get(key, ["0"])[0]) for key in ("Delta_X", "X0"))
        if not step > 0:
            raise StickslipError(f"'{path}' has neither a column of X nor a step (Delta_X). Save it with one.")
        columns[TIME] = start + step * np.arange(len(values[0]))
    columns |= dict(zip(unique, values[len(wanted) - len(kept) :], strict=True))
    units = dict(zip(unique, settings.get("Y_Unit_Label", []), strict=False))
    date, clock = settings.get("Date", [""])[0], settings.get("Time", [""])[0]
    notes = tuple(part for part in (f"{date} {clock}".strip(), *settings.get("Operator", [])) if part)
    named = {TIME: "s", **{name: unit for name, unit in units.items() if unit}}
    return Table(f"'{path}'", columns, named, line, notes=notes)


def _number(text: str) -> float:
    return float(text.replace(",", ".")) if is_number(text, ",") or is_number(text, ".") else 0.0


def _numbers(
    path: Path, rows: bytes, width: int, wanted: list[int], separator: str, decimal: str, line: int
) -> list[np.ndarray]:
    import pandas

    body = rows.rstrip(b"\r\n\t ")
    if not body:
        raise StickslipError(f"'{path}' is cut off: it has no row of numbers. Copy it again from its source.")
    try:
        frame = pandas.read_csv(
            BytesIO(body + b"\n"),
            sep=separator,
            decimal=decimal,
            header=None,
            names=list(range(width)),
            usecols=wanted,
            dtype=np.float64,
            index_col=False,
            encoding="latin-1",
            skip_blank_lines=False,
        )
    except (ValueError, OverflowError, pandas.errors.ParserError) as error:
        raise _fault(path, body, wanted, separator, decimal, line) or StickslipError(
            f"'{path}' is no table of numbers from line {line} on: {error}."
        ) from error
    last = frame.iloc[-1]
    if last.isna().any() and not rows.endswith(b"\n"):
        frame = frame.iloc[:-1]
    return [frame[place].to_numpy() for place in wanted]


def _fault(
    path: Path, body: bytes, wanted: list[int], separator: str, decimal: str, line: int
) -> StickslipError | None:
    for i, row in enumerate(body.decode("latin-1").splitlines()):
        cells = [cell.strip() for cell in row.split(separator)]
        for place in wanted:
            if place >= len(cells):
                return StickslipError(f"'{path}': line {line + i} has {len(cells)} cells, too few. Mend or remove it.")
            if not is_none(cells[place]) and not is_number(cells[place], decimal) and not stamps.kind_of(cells[place]):
                return StickslipError(
                    f"'{path}': line {line + i} holds '{cells[place][:40]}', not a number. Mend or remove the row."
                )
    return None


READER = Reader((".lvm",), read)
