"""A table for a terminal of any width: words wrap, columns are left out with a word or go on below, digits never break.

1. heads and texts wrap between words, texts down to `NARROWEST`, names of rows and lines of a cell only from `LONGEST`;
2. columns that the table can spare are left out, and named below it;
3. what is still too wide goes on in further blocks, each with the names of the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fmu_models.base.table import Table

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult
    from rich.table import Table as RichTable

GAP = 2  # between columns
NARROWEST = 16  # of a text, unless all of it is shorter
LONGEST = 32  # of a word of a text, of the name of a row, and of one of several lines: what is longer may break


@dataclass(frozen=True)
class Layout:
    """blocks: places and widths of the columns that stand side by side, block under block; left_out: places."""

    blocks: tuple[tuple[tuple[int, int], ...], ...]
    left_out: tuple[int, ...]


@dataclass(frozen=True)
class terminal:
    """A table as rich prints it, to the width of the console."""

    table: Table

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.text import Text

        table = self.table
        found = layout(table, options.max_width)
        if table.title:
            yield Text(table.title, style="bold")
        for block in found.blocks:
            yield _block(table, block)
            yield Text()
        if found.left_out:
            names = "; ".join(table.columns[place].head for place in found.left_out)
            yield Text(f"Left out for want of width: {names} (--json has all).\n", style="italic")


def layout(table: Table, width: int) -> Layout:
    """Where each column of a table stands in ``width`` characters."""
    widths = [_widths(table, place) for place in range(len(table.columns))]
    shown = list(range(len(table.columns)))
    left_out: list[int] = []
    while _total([widths[place][0] for place in shown]) > width:
        spare = max(shown, key=lambda place: (table.columns[place].spare, place))
        if not table.columns[spare].spare:
            break
        shown.remove(spare)
        left_out.append(spare)
    blocks = _blocks(shown, [least for least, _ in widths], width)
    return Layout(tuple(tuple(_widened(block, widths, width)) for block in blocks), tuple(sorted(left_out)))


def _widths(table: Table, place: int) -> tuple[int, int]:
    """Least and best width of a column."""
    from rich.cells import cell_len

    head = table.columns[place].words
    lines = [line for row in table.rows for line in row[place].words.split("\n")]
    head_word = max((cell_len(word) for word in head.split()), default=0)
    natural = max((cell_len(line) for line in lines), default=0)
    if table.is_number(place):
        return max(head_word, natural), max(cell_len(head), natural)
    if place == 0 or any("\n" in row[place].words for row in table.rows):
        return max(head_word, min(natural, LONGEST)), max(cell_len(head), natural)
    word = max((cell_len(word) for line in lines for word in line.split()), default=0)
    least = max(head_word, min(natural, max(NARROWEST, min(word, LONGEST))))
    return least, max(cell_len(head), natural, least)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)


def _blocks(shown: Sequence[int], least: Sequence[int], width: int) -> list[list[int]]:
    """Columns side by side as far as they go; each further block begins with the names of the rows."""
    name, *others = shown
    blocks = [[name]]
    for place in others:
        if len(blocks[-1]) > 1 and _total([least[one] for one in (*blocks[-1], place)]) > width:
            blocks.append([name])
        blocks[-1].append(place)
    return blocks


def _widened(block: Sequence[int], widths: Sequence[tuple[int, int]], width: int) -> list[tuple[int, int]]:
    """Places with widths: what room there is goes to those that need least of it first."""
    room = width - _total([widths[place][0] for place in block])
    given: dict[int, int] = {}
    wanting = sorted(block, key=lambda place: widths[place][1] - widths[place][0])
    for number, place in enumerate(wanting):
        least, best = widths[place]
        more = max(min(best - least, room // (len(wanting) - number)), 0)
        given[place] = least + more
        room -= more
    return [(place, given[place]) for place in block]


def _block(table: Table, block: Sequence[tuple[int, int]]) -> RichTable:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    made = RichTable(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, GAP - 1, 0, 0))
    for place, width in block:
        justify = "right" if table.is_number(place) else "left"
        made.add_column(Text(table.columns[place].words), justify=justify, width=width, overflow="fold")
    for row in table.rows:
        made.add_row(*(Text(row[place].words, style="bold" if row[place].kind == "fail" else "") for place, _ in block))
    return made
