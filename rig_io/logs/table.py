"""A table of numbers as a reader found it in a file, and what a reader is."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing


def content(path: Path, expected: str) -> bytes:
    """The bytes of a log's file.

    Raises:
        StickslipError: there is none, it cannot be read or is empty (``expected`` says what it should hold).
    """
    try:
        data = existing(path, "log", " Check the name and the folder.").read_bytes()
    except OSError as error:
        raise StickslipError(f"The log '{path}' cannot be read: {error.strerror}.") from error
    if not data.strip():
        raise StickslipError(f"The log '{path}' is empty. Expected {expected}.")
    return data


@dataclass(frozen=True)
class Table:
    """Numbers as read. columns: name -> (n_rows,) float64 (NaN where a cell holds no number).

    units: those the file itself states; first_line: line of the first row in the file, None where a file has no lines;
    scalars: single numbers beside the columns; left_out: name -> why it is no column; rows: in the file, where they
    are not those of the file one by one.
    """

    source: str
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str] = field(default_factory=dict)
    first_line: int | None = None
    scalars: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    rows: np.ndarray | None = None

    def place(self, row: int) -> str:
        """Where a row (from 0) is in the file, for messages."""
        if self.rows is not None:
            row = int(self.rows[row])
        return f"sample {row + 1}" if self.first_line is None else f"line {self.first_line + row}"


@dataclass(frozen=True)
class Reader:
    """A kind of log files. suffixes: of their names, such as (".csv", ".txt"); read: makes a file's table.

    Raises:
        StickslipError: a suffix is none.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path], Table]

    def __post_init__(self) -> None:
        if isinstance(self.suffixes, str) or not all(re.fullmatch(r"\.[^.A-Z]+", suffix) for suffix in self.suffixes):
            raise StickslipError(
                f"The suffixes of a reader are a tuple of small letters such as ('.csv', '.txt'), found "
                f"{self.suffixes!r}."
            )
