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
    rows = "\n".join(f"<tr>{_row(row)}</tr>" for row in table.rows)
    return (
        f'<div class="wide"><table>\n<caption>{escape(table.title)}</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>"
    )


def _row(row: tuple[Cell, ...]) -> str:
    name, *others = row
    return f'<th scope="row">{_words(name)}</th>' + "".join(
        f"<td{_class('' if cell.kind == 'text' else cell.kind)}>{_words(cell)}</td>" for cell in others
    )


def _words(cell: Cell) -> str:
    return escape(cell.words).replace("\n", "<br>")


def _class(name: str) -> str:
    return f' class="{name}"' if name else ""
