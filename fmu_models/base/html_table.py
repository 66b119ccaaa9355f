"""A table for a page or a notebook."""

from __future__ import annotations

from html import escape

from fmu_models.base.table import Cell, Table


def html(table: Table) -> str:
    """The table as HTML; its styles are the page's: classes "number", "fail", and "wide" for what may scroll."""
    heads = "".join(
        f'<th scope="col"{_class("number" if table.is_number(place) else "")}>{escape(column.words)}</th>'
        for place, column in enumerate(table.columns)
    )
    rows = "\n".join(f"<tr>{_row(table, row)}</tr>" for row in table.rows)
    return (
        f'<div class="wide"><table>\n<caption>{escape(table.title)}</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>"
    )


def _row(table: Table, row: tuple[Cell, ...]) -> str:
    shown = f'<th scope="row">{_words(row[0])}</th>'
    for place, cell in enumerate(row[1:], 1):
        classes = ["number"] * table.is_number(place) + ["fail"] * (cell.kind == "fail")
        shown += f"<td{_class(' '.join(classes))}>{_words(cell)}</td>"
    return shown


def _words(cell: Cell) -> str:
    return escape(cell.words).replace("\n", "<br>")


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""
