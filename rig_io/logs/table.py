"""A table of numbers as a reader found it in a file, and what a reader is."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing


def check_file(path: Path, expected: str) -> None:
    """Whether there is a file that holds something. StickslipError: there is none, it cannot be read or is empty
    (``expected`` says what it should hold)."""
    try:
        with open(existing(path, "log", " Check the name and the folder."), "rb") as file:
            first_byte = file.read(1)
    except OSError as error:
        raise StickslipError(f"The log '{path}' cannot be read: {error.strerror}.") from error
    if not first_byte:
        raise StickslipError(f"The log '{path}' is empty. Expected {expected}.")


@dataclass(frozen=True)
class Table:
    """Numbers as read. columns: name -> (n_rows,) float64 (NaN where a cell holds no number).

    units: those the file itself states; first_line: line of the first row in the file, None where a file has no lines;
    scalars: single numbers beside the columns; left_out: name -> why it is no column; rows: in the file, where they
    are not those of the file one by one; nameless: whether the file gives its columns no names, so that they are called
    'column 1' and on; doubled: names that the file gives to several columns, of which the second is called 'name (2)';
    begin: what date and time the zero of the columns in ``stamps`` stands for (None: not known), in UTC where the file
    states a zone; notes: lines beside the table, such as those above its header.
    """

    source: str
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str] = field(default_factory=dict)
    first_line: int | None = None
    scalars: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    rows: np.ndarray | None = None
    nameless: bool = False
    doubled: tuple[str, ...] = ()
    begin: datetime | None = None
    stamps: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def place(self, row: int) -> str:
        """Where a row (from 0) is in the file, for messages."""
        if self.rows is not None:
            row = int(self.rows[row])
        return f"sample {row + 1}" if self.first_line is None else f"line {self.first_line + row}"


@dataclass(frozen=True)
class Reader:
    """A kind of log files. suffixes: of their names, such as (".csv", ".txt"); read: makes a file's table, with those
    of its ``options`` (name -> meaning) that the user has given, as text.

    Raises:
        StickslipError: a suffix is none.
    """

    suffixes: tuple[str, ...]
    read: Callable[..., Table]
    options: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if isinstance(self.suffixes, str) or not all(re.fullmatch(r"\.[^.A-Z]+", suffix) for suffix in self.suffixes):
            raise StickslipError(
                f"The suffixes of a reader are a tuple of small letters such as ('.csv', '.txt'), found "
                f"{self.suffixes!r}."
            )
