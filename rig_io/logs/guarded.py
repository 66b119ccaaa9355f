"""Readers of other people's binary formats, run in a process of their own: a damaged file may take a parser down, hang
it, or make it ask for more memory than there is. Columns come back through a file, which costs no second copy.
"""

import importlib
import importlib.util
import logging
import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from datetime import datetime
from io import StringIO
from pathlib import Path

import numpy as np

from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError
from fmu_models.base.processes import Value, isolated
from rig_io.logs.table import Table, check_file

EXTRA = "daq"
_COLUMNS = "columns.bin"
LARGEST = 1 << 36  # bytes of all columns
PATIENCE = 60.0  # s for a small file, on a machine that is busy
SLOWEST = 1e5  # bytes/s of a sound one; workbooks come near it


class DamagedTable(StickslipError):
    """The parser does not understand the file; the text is the parser's."""


@dataclass(frozen=True)
class Channel:
    """One channel of a file as its parser gives it: values (n,) of any numeric type; unit, "" if none is stated."""

    name: str
    values: np.ndarray
    unit: str = ""


@dataclass(frozen=True)
class Channels:
    """Channels of one length; left_out: name -> why it is no column; scalars; begin: what time zero is, ISO, or "";
    stamps: names of the channels that hold times; notes: lines beside them."""

    channels: Sequence[Channel]
    left_out: Mapping[str, str] = field(default_factory=dict)
    scalars: Mapping[str, float] = field(default_factory=dict)
    begin: str = ""
    stamps: Sequence[str] = ()
    notes: Sequence[str] = ()


def need(module: str, package: str, purpose: str) -> None:
    """Whether a package is installed that only some users need. StickslipError: it is not; with the line that installs
    it."""
    if importlib.util.find_spec(module) is None:
        raise StickslipError(
            f"{purpose} are read by the package '{package}'. Install it: pip install 'stickslip[{EXTRA}]'"
        )


def table_of(
    path: Path, parse: Callable[..., Channels], expected: str, magic: Sequence[bytes] = (), **options: str
) -> Table:
    """The table of a file. parse: called in the child with the path and the options; magic: what such a file begins
    with; expected: what it should be, in words. StickslipError: the file is missing, empty, not of its kind, damaged,
    or holds no column of numbers."""
    check_file(path, expected)
    with open(path, "rb") as file:
        head = file.read(max(map(len, magic), default=0))
    if magic and not any(head.startswith(prefix) for prefix in magic):
        raise StickslipError(f"'{path}' is not {expected} (it begins otherwise). Give it the suffix of its kind.")
    with tempfile.TemporaryDirectory(prefix="stickslip-") as room:
        parsed, rows = parsed_apart(path, _parsed, parse, str(path), room, dict(options))
        columns = {
            channel.name: np.fromfile(Path(room) / _COLUMNS, np.float64, rows, offset=8 * rows * index)
            for index, channel in enumerate(parsed.channels)
        }
    return Table(
        f"'{path}'",
        columns,
        {channel.name: channel.unit for channel in parsed.channels if channel.unit},
        scalars=parsed.scalars,
        left_out=parsed.left_out,
        begin=datetime.fromisoformat(parsed.begin) if parsed.begin else None,
        stamps=tuple(parsed.stamps),
        notes=tuple(parsed.notes),
    )


def parsed_apart(path: Path, parse: Callable[..., Value], *arguments: object, again: str = "", less: str = "") -> Value:
    """What a parser makes of a file in a process of its own. again, less: how to save it, behind the advice to save it
    again, and to save less. StickslipError: the file is damaged, or larger than what can be read."""
    # ample for a sound file of that size: some damaged ones send their parser in circles
    limits = replace(Limits.default(), time=PATIENCE + path.stat().st_size / SLOWEST)
    try:
        return isolated(parse, *arguments, limits=limits)
    except DamagedTable as error:
        raise StickslipError(
            f"'{path}' is damaged or cut off: {error}. Copy it again from its source, or save it again{again}."
        ) from error
    except IsolatedFailure as error:
        raise StickslipError(
            f"'{path}' is damaged, or unpacks to more than can be read here. It was read in a process of its own: "
            f"{error} Copy it again from its source{less}."
        ) from error


def _parsed(parse: Callable[..., Channels], path: str, room: str, options: dict[str, str]) -> tuple[Channels, int]:
    """In the child: the file parsed, its columns written as float64 one after the other; without their values."""
    # parsers complain of a damaged file in tracebacks of their own; what there is to say, the error says
    sys.unraisablehook = lambda _: None
    logging.disable(logging.CRITICAL)
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parsed = parse(path, **options)
        lengths = {channel.name: len(channel.values) for channel in parsed.channels}
        if not parsed.channels:
            why = "; ".join(f"'{name}' is {reason}" for name, reason in list(parsed.left_out.items())[:8])
            raise StickslipError(f"'{path}' holds no column of numbers{f' ({why})' if why else ''}.")
        if len(set(lengths.values())) > 1:
            listing = ", ".join(f"'{name}' {length}" for name, length in list(lengths.items())[:8])
            raise StickslipError(f"'{path}' holds channels of different lengths: {listing}. Choose those of one rate.")
        rows = next(iter(lengths.values()))
        if 8 * rows * len(lengths) > LARGEST:
            raise DamagedTable(f"{len(lengths)} columns of {rows} rows")
        with open(Path(room) / _COLUMNS, "wb") as file, np.errstate(invalid="ignore", over="ignore"):
            for channel in parsed.channels:
                np.ascontiguousarray(channel.values, dtype=np.float64).tofile(file)
    except (StickslipError, MemoryError):
        raise
    except Exception as error:  # the parsers raise errors of many kinds on damaged files
        raise DamagedTable(str(error).strip().rstrip(".")[:300] or type(error).__name__) from error
    bare = [Channel(channel.name, np.zeros(0), channel.unit) for channel in parsed.channels]
    return Channels(bare, parsed.left_out, parsed.scalars, parsed.begin, parsed.stamps, parsed.notes), rows


def fits(name: str, values: object, left_out: dict[str, str]) -> bool:
    """Whether an array is a column of numbers; if not, why is put down."""
    kind = getattr(getattr(values, "dtype", None), "kind", "O")
    shape = getattr(values, "shape", ())
    if kind not in "biuf":
        left_out[name] = "complex" if kind == "c" else "not of numbers"
    elif len(shape) != 1:
        left_out[name] = f"no vector, but an array of {' x '.join(map(str, shape)) or 'one number'}"
    elif not shape[0]:
        left_out[name] = "empty"
    else:
        return True
    return False


def of_one_length(channels: Sequence[Channel], left_out: dict[str, str]) -> list[Channel]:
    """The channels of the length that most have; the others are left out, with the reason."""
    lengths = [len(channel.values) for channel in channels]
    if not lengths:
        return []
    commonest = max(set(lengths), key=lambda length: (lengths.count(length), length))
    for channel in channels:
        if len(channel.values) != commonest:
            left_out[channel.name] = f"of another rate: {len(channel.values)} values, not {commonest}"
    return [channel for channel in channels if len(channel.values) == commonest]
