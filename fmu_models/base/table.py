"""A table as a value: title, heads with units, rows of cells. Built once per kind of result, drawn for a terminal
(`terminal_table`) and for a page (`html_table`)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from fmu_models.base.digits import UNCERTAIN, deviation, like_sd, value_with_sd
from fmu_models.base.printable import in_line


@dataclass(frozen=True)
class Cell:
    """What stands in one place. kind: "number" keeps its digits together and stands right; "fail" is a verdict that
    catches the eye."""

    words: str
    kind: Literal["text", "number", "fail"] = "text"

    def __post_init__(self) -> None:
        # what somebody else wrote must be no command to a terminal, and is as wide as it is shown
        object.__setattr__(self, "words", "\n".join(map(in_line, self.words.split("\n"))))


@dataclass(frozen=True)
class Column:
    """A head and its unit. spare: columns that a narrow terminal may leave out, the highest first; 0: none of them."""

    head: str
    unit: str = ""
    spare: int = 0

    @property
    def words(self) -> str:
        """Head with unit."""
        return f"{self.head} ({self.unit})" if self.unit else self.head


@dataclass(frozen=True)
class Table:
    """Rows of as many cells as there are columns; the first cell of a row is its name."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def turned(self) -> Table:
        """Rows as columns."""
        head, *others = zip(tuple(Cell(column.words) for column in self.columns), *self.rows, strict=True)
        return Table(self.title, tuple(Column(cell.words) for cell in head), tuple(others))

    def is_number(self, place: int) -> bool:
        """Whether a column is one of numbers."""
        return any(row[place].kind == "number" for row in self.rows)


def table(title: str, columns: Sequence[str | Column], rows: Iterable[Sequence[str | Cell]]) -> Table:
    """A table of plain heads and texts, or of columns and cells."""
    return Table(
        title,
        tuple(one if isinstance(one, Column) else Column(one) for one in columns),
        tuple(tuple(one if isinstance(one, Cell) else Cell(one) for one in row) for row in rows),
    )


def number(value: float | None, digits: str = UNCERTAIN) -> Cell:
    """A number in a format of Python's; nothing for None."""
    return Cell("" if value is None else f"{value:{digits}}", "number")


def counted(value: int | None) -> Cell:
    """A count; nothing for None."""
    return Cell("" if value is None else str(value), "number")


def measured(value: float, sd: float | None) -> Cell:
    """A value with its standard deviation."""
    return Cell(value_with_sd(value, sd), "number")


def known_to(value: float | None, sd: float | None) -> Cell:
    """A value whose standard deviation stands in another column, or an end of its interval; "open" for None and for
    infinity."""
    return Cell("open" if value is None or math.isinf(value) else like_sd(value, sd), "number")


def sd(value: float | None) -> Cell:
    """A standard deviation."""
    return Cell(deviation(value), "number")


def interval(low: float | None, high: float | None, sd: float | None) -> Cell:
    """Two ends, to the digits that the standard deviation leaves; an end of None is open."""
    return Cell(f"{known_to(low, sd).words} .. {known_to(high, sd).words}", "number")


def verdict(passed: bool | None, words: str = "") -> Cell:
    """Words of a verdict, those of a failure marked; None: not judged."""
    return Cell(words or {True: "pass", False: "FAIL", None: ""}[passed], "fail" if passed is False else "text")
