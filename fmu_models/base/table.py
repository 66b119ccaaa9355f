"""A table as a value: title, heads with units, rows of cells. It is built once per kind of result, and draws itself.

In a page it is HTML. In a terminal of any width words wrap, columns are left out with a word or go on below, and digits
never break:

1. heads and texts wrap between words, texts down to `NARROWEST`, names of rows and lines of a cell only from `LONGEST`,
   a name that is one word from `NAME`;
2. columns that the table can spare are left out, and named below it;
3. what is still too wide goes on in further blocks, each with the names of the rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Any, Literal

from fmu_models.base.digits import UNCERTAIN, deviation, like_sd, value_with_sd
from fmu_models.base.printable import in_line

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult
    from rich.table import Table as RichTable

GAP = 2  # between columns
NARROWEST = 16  # of a text, unless all of it is shorter
NAME = 60  # of a word that names a row: it is to be copied
LONGEST = 32  # of a word of a text, of the name of a row, and of one of several lines: what is longer may break


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
class PrintedColumn:
    """A head and its unit. spare: columns that a narrow terminal may leave out, the highest first; 0: none of them."""

    head: str
    unit: str = ""
    spare: int = 0

    @property
    def words(self) -> str:
        """Head with unit."""
        return f"{self.head} ({self.unit})" if self.unit else self.head


@dataclass(frozen=True)
class PrintedTable:
    """Rows of as many cells as there are columns; the first cell of a row is its name."""

    title: str
    columns: tuple[PrintedColumn, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def turned(self) -> PrintedTable:
        """Rows as columns."""
        head, *others = zip(tuple(Cell(column.words) for column in self.columns), *self.rows, strict=True)
        return PrintedTable(self.title, tuple(PrintedColumn(cell.words) for cell in head), tuple(others))

    def is_number(self, index: int) -> bool:
        """Whether a column is one of numbers."""
        return any(row[index].kind == "number" for row in self.rows)

    def taking(self, *heads: str) -> PrintedTable:
        """Its first column, then those of some heads."""
        places = {column.head: place for place, column in enumerate(self.columns)}
        kept = (0, *(places[head] for head in heads))
        rows = tuple(tuple(row[i] for i in kept) for row in self.rows)
        return replace(self, columns=tuple(self.columns[i] for i in kept), rows=rows)

    def html(self) -> str:
        """The table as HTML; its styles are the page's: classes "number", "fail", "long" for what takes several lines,
        and "wide" for what may scroll, by the keyboard too."""
        heads = "".join(
            f'<th scope="col"{_class("number" if self.is_number(index) else "")}>{escape(column.words)}</th>'
            for index, column in enumerate(self.columns)
        )
        rows = "\n".join(f"<tr>{_row(self, row)}</tr>" for row in self.rows)
        return scrolling(
            f"<table>\n<caption>{escape(self.title)}</caption>\n<thead><tr>{heads}</tr></thead>\n"
            f"<tbody>\n{rows}\n</tbody></table>",
            self.title or "table",
        )

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.text import Text

        arranged = layout(self, options.max_width)
        if self.title:
            yield Text(self.title, style="bold")
        for block in arranged.blocks:
            yield _block(self, block)
            yield Text()
        if arranged.left_out:
            names = "; ".join(self.columns[index].head for index in arranged.left_out)
            yield Text(f"Left out for want of width: {names} (--json has all).\n", style="italic")


def table(title: str, columns: Sequence[str | PrintedColumn], rows: Iterable[Sequence[str | Cell]]) -> PrintedTable:
    """A table of plain heads and texts, or of columns and cells; texts below a head with a leading '>' are numbers."""
    named = [column if isinstance(column, PrintedColumn) else PrintedColumn(column) for column in columns]
    kinds: list[Any] = ["number" if column.head.startswith(">") else "text" for column in named]
    lines = (zip(row, kinds, strict=True) for row in rows)
    return PrintedTable(
        title,
        tuple(replace(column, head=column.head.lstrip(">")) for column in named),
        tuple(tuple(cell if isinstance(cell, Cell) else Cell(cell, kind) for cell, kind in line) for line in lines),
    )


def number(value: float | None, digits: str = UNCERTAIN) -> Cell:
    """A number in a format of Python's; nothing for None."""
    return Cell("" if value is None else f"{value + 0:{digits}}", "number")  # + 0: no zero has a sign


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


@dataclass(frozen=True)
class TableLayout:
    """blocks: places and widths of the columns that stand side by side, block under block; left_out: places."""

    blocks: tuple[tuple[tuple[int, int], ...], ...]
    left_out: tuple[int, ...]


def layout(table: PrintedTable, width: int) -> TableLayout:
    """Where each column of a table stands in ``width`` characters."""
    widths = [_widths(table, index) for index in range(len(table.columns))]
    columns = list(range(len(table.columns)))
    left_out: list[int] = []
    while _total([widths[index][0] for index in columns]) > width:
        spare = max(columns, key=lambda index: (table.columns[index].spare, index))
        if not table.columns[spare].spare:
            break
        columns.remove(spare)
        left_out.append(spare)
    blocks = _blocks(columns, [least for least, _ in widths], width)
    return TableLayout(tuple(tuple(_widened(block, widths, width)) for block in blocks), tuple(sorted(left_out)))


def _widths(table: PrintedTable, index: int) -> tuple[int, int]:
    """Least and best width of a column."""
    from rich.cells import cell_len

    head = table.columns[index].words
    lines = [line for row in table.rows for line in row[index].words.split("\n")]
    head_word = max((cell_len(word) for word in head.split()), default=0)
    natural = max((cell_len(line) for line in lines), default=0)
    if table.is_number(index):
        return max(head_word, natural), max(cell_len(head), natural)
    word = max((cell_len(word) for line in lines for word in line.split()), default=0)
    if index == 0 or any("\n" in row[index].words for row in table.rows):
        whole = max(LONGEST, min(word, NAME)) if index == 0 else LONGEST
        return max(head_word, min(natural, whole)), max(cell_len(head), natural)
    least = max(head_word, min(natural, max(NARROWEST, min(word, LONGEST))))
    return least, max(cell_len(head), natural, least)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)


def _blocks(columns: Sequence[int], least: Sequence[int], width: int) -> list[list[int]]:
    """Columns side by side as far as they go; each further block begins with the names of the rows."""
    name, *others = columns
    blocks = [[name]]
    for index in others:
        if len(blocks[-1]) > 1 and _total([least[column] for column in (*blocks[-1], index)]) > width:
            blocks.append([name])
        blocks[-1].append(index)
    return blocks


def _widened(block: Sequence[int], widths: Sequence[tuple[int, int]], width: int) -> list[tuple[int, int]]:
    """Places with widths: what room there is goes to those that need least of it first."""
    room = width - _total([widths[index][0] for index in block])
    granted: dict[int, int] = {}
    wanting = sorted(block, key=lambda index: widths[index][1] - widths[index][0])
    for number, index in enumerate(wanting):
        least, best = widths[index]
        extra = max(min(best - least, room // (len(wanting) - number)), 0)
        granted[index] = least + extra
        room -= extra
    return [(index, granted[index]) for index in block]


def _block(table: PrintedTable, block: Sequence[tuple[int, int]]) -> RichTable:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    grid = RichTable(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
    for index, width in block:
        justify = "right" if table.is_number(index) else "left"
        grid.add_column(Text(table.columns[index].words), justify=justify, width=width, overflow="fold")
    for row in table.rows:
        grid.add_row(*(Text(row[index].words, style="bold" if row[index].kind == "fail" else "") for index, _ in block))
    return grid


def scrolling(html: str, label: str) -> str:
    """HTML that scrolls in itself where it is wider than the page, by the keyboard too. label: what a reader hears."""
    return f'<div class="wide" tabindex="0" role="group" aria-label="{escape(label)}">{html}</div>'


def _row(table: PrintedTable, row: tuple[Cell, ...]) -> str:
    html = f'<th scope="row">{_words(row[0])}</th>'
    for index, cell in enumerate(row[1:], 1):
        classes = ["number"] * table.is_number(index) + ["fail"] * (cell.kind == "fail")
        classes += ["long"] * (max(map(len, cell.words.split("\n"))) > LONGEST)
        html += f"<td{_class(' '.join(classes))}>{_words(cell)}</td>"
    return html


def _words(cell: Cell) -> str:
    return escape(cell.words).replace("\n", "<br>")


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""
