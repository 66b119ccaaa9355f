"""LVM (LabVIEW's text files): headers of ``key<separator>value`` ended by a mark, then the rows of one segment."""

import codecs
import re
import warnings
from collections.abc import Mapping
from mmap import ACCESS_READ, mmap
from os import SEEK_END
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError, StickslipWarning
from rig_io.logs.table import Reader, Table, check_file
from rig_io.logs.text_layout import HEAD, is_none, is_number

BEGIN = b"LabVIEW Measurement"
END = b"***End_of_Header***"
SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}
TIME = "time"


def read(path: Path) -> Table:
    """Read every channel as a column; the column of X becomes ``time``, or is made from its begin and step.
    StickslipError: the file is missing or no LVM file, has several segments, or a row that is none; with its line."""
    check_file(path, "a LabVIEW measurement file")
    with open(path, "rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
        start = 3 if data[:3] == codecs.BOM_UTF8 else 0
        if data[start : start + len(BEGIN)] != BEGIN:
            raise StickslipError(f"'{path}' is no LabVIEW measurement file: it does not begin with '{BEGIN.decode()}'.")
        ends = [match.start() for match in re.finditer(re.escape(END), data)]
        if len(ends) < 2:
            raise StickslipError(f"'{path}' is cut off: its headers do not end. Copy it again.")
        if len(ends) > 2:
            raise StickslipError(
                f"'{path}' holds {len(ends) - 1} segments with headers of their own. Save each as one file in LabVIEW "
                "(one header only)."
            )
        after = data.find(b"\n", ends[1]) + 1
        body = data.find(b"\n", after) + 1
        if not after or not body or not data[body : body + HEAD].strip():
            raise StickslipError(f"'{path}' is cut off: it has no row of numbers. Copy it again from its source.")
        head = data[:body].decode("latin-1")
    first, channel, names = head[: ends[0]], head[ends[0] : ends[1]], head[after:].rstrip("\r\n")
    separator_word = re.search(r"^Separator\W(\w+)", first, re.MULTILINE)
    separator = SEPARATORS.get(separator_word[1] if separator_word else "", "\t")
    decimal = "," if re.search(r"^Decimal_Separator\W,", first, re.MULTILINE) else "."
    settings: dict[str, list[str]] = {}  # values of a key, one for each channel
    for line in (first + "\n" + channel).splitlines():
        cells = [cell.strip() for cell in line.split(separator)]
        if cells[0] and len(cells) > 1:
            settings[cells[0]] = cells[1:]
    return _table(path, body, [name.strip() for name in names.split(separator)], settings, (separator, decimal), head)


def _table(
    path: Path, body: int, names: list[str], settings: Mapping[str, list[str]], marks: tuple[str, str], head: str
) -> Table:
    """The table of the rows that begin at a byte, after the text ``head``."""
    line = head.count("\n") + 1
    number = settings.get("Channels", [""])[0]
    if not number.isdigit() or not 0 < int(number) < len(names) + 1:
        raise StickslipError(f"'{path}' states {number or 'no number of'} channels and names {len(names)} columns.")
    channels = int(number)
    with_clock = settings.get("X_Columns", ["One"])[0]
    if with_clock == "Multi":
        raise StickslipError(f"'{path}' has a column of X for every channel. Save it with one (X columns: one only).")
    behind = int(with_clock == "One" or names[0] == "X_Value")
    channel_names = names[behind : behind + channels]
    places = [names.index(name) if names.count(name) == 1 else i + 1 for i, name in enumerate(channel_names)]
    numeric = ([0] if with_clock == "One" else []) + places
    values = _numbers(path, body, len(names), numeric, marks, line)
    unique: list[str] = []
    for name in channel_names:
        unique.append(name if name not in unique and name != TIME else f"{name} ({unique.count(name) + 2})")
    columns: dict[str, np.ndarray] = {}
    if with_clock == "One":
        columns[TIME] = values[0]
    else:
        step, start = (_number(settings.get(key, ["0"])[0]) for key in ("Delta_X", "X0"))
        if not step > 0:
            raise StickslipError(f"'{path}' has neither a column of X nor a step (Delta_X). Save it with one.")
        columns[TIME] = start + step * np.arange(len(values[0]))
    columns |= dict(zip(unique, values[len(numeric) - len(channel_names) :], strict=True))
    units = dict(zip(unique, settings.get("Y_Unit_Label", []), strict=False))
    date, clock = settings.get("Date", [""])[0], settings.get("Time", [""])[0]
    notes = tuple(note for note in (f"{date} {clock}".strip(), *settings.get("Operator", [])) if note)
    named = {TIME: "s", **{name: unit for name, unit in units.items() if unit}}
    return Table(f"'{path}'", columns, named, line, notes=notes)


def _number(text: str) -> float:
    return float(text.replace(",", ".")) if is_number(text, ",") or is_number(text, ".") else 0.0


def _numbers(
    path: Path, start: int, width: int, numeric: list[int], marks: tuple[str, str], line: int
) -> list[np.ndarray]:
    import pandas

    with open(path, "rb") as file:
        file.seek(-1, SEEK_END)
        ended = file.read(1) == b"\n"
        file.seek(start)
        try:
            frame = pandas.read_csv(
                file,
                sep=marks[0],
                decimal=marks[1],
                header=None,
                names=list(range(width)),
                dtype={column: np.float64 if column in numeric else "string" for column in range(width)},
                index_col=False,
                encoding="latin-1",
            )
        except (ValueError, OverflowError, pandas.errors.ParserError) as error:
            raise _fault(path, start, numeric, marks, line) or StickslipError(
                f"'{path}' is no table of numbers from line {line} on: {error}."
            ) from error
    if len(frame) and not ended and frame[numeric].iloc[-1].isna().any():
        warnings.warn(f"'{path}': the last line is cut off and was left out.", StickslipWarning, stacklevel=5)
        frame = frame.iloc[:-1]
    if not len(frame):
        raise StickslipError(f"'{path}' is cut off: it has no row of numbers. Copy it again from its source.")
    return [frame[column].to_numpy() for column in numeric]


def _fault(path: Path, start: int, numeric: list[int], marks: tuple[str, str], line: int) -> StickslipError | None:
    """The first row that is none."""
    with open(path, "rb") as file:
        file.seek(start)
        for i, row in enumerate(file):
            cells = [cell.strip() for cell in row.decode("latin-1").split(marks[0])]
            for column in numeric:
                if column >= len(cells):
                    return StickslipError(f"'{path}': line {line + i} has {len(cells)} cells, too few. Mend it.")
                if not is_none(cells[column]) and not is_number(cells[column], marks[1]):
                    return StickslipError(
                        f"'{path}': line {line + i} holds '{cells[column][:40]}', not a number. Mend or remove the row."
                    )
    return None


READER = Reader((".lvm",), read)
