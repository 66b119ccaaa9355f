"""The grid as a table, as data, and as a heat map."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base.record import record
from fmu_models.base.table import PrintedTable, number, table
from fmu_models.validation.stress.judge import ACCURATE, VERDICTS, StressCell
from fmu_models.validation.stress.random_cases import RANDOM, command_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

# of a cell in words, the longest line of a message that is printed
WIDTH = 90
# up to which a heat map has a column for each
CASES = 24
MARKS = {"r": "some refused with a reason", "F": "some failed"}


def content(cells: Sequence[StressCell], asked: int) -> dict[str, Any]:
    """The cells as data, with counts per model; ``asked`` is how many cells there would have been."""
    rows = [
        {
            "model": cell.case.model,
            "case": cell.case.name,
            "about": group(cell),
            "verdict": cell.verdict,
            "error": record(cell.error),
            "check": cell.check,
            "message": cell.message,
            **({"again": command_line(cell.case)} if cell.case.of == RANDOM else {}),
            "checks": cell.checks,
            "reached": cell.reached,
            "seconds": cell.seconds,
        }
        for cell in cells
    ]
    models = dict.fromkeys(cell.case.model for cell in cells)
    return {
        "asked": asked,
        "finished": len(cells),
        "models": {
            model: {verdict: sum(c.case.model == model and c.verdict == verdict for c in cells) for verdict in VERDICTS}
            for model in models
        },
        "totals": {verdict: sum(c.verdict == verdict for c in cells) for verdict in VERDICTS},
        "cells": rows,
    }


def group(cell: StressCell) -> str:
    """What a cell is about, in two words."""
    return f"{cell.case.of} {cell.case.what}".strip()


def print_report(cells: Sequence[StressCell], requested: int, out: Console, *, every: bool = False) -> None:
    """One table per model with the counts of each group of cases; every cell that is not accurate by name."""
    for model in dict.fromkeys(cell.case.model for cell in cells):
        cells_of_model = [cell for cell in cells if cell.case.model == model]
        out.print(groups_table(model, cells_of_model))
        for cell in cells_of_model:
            if every or cell.verdict != "accurate":
                out.print(f"  {sentence(cell)}", markup=False)
                if cell.case.of == RANDOM:
                    out.print(f"    again: {command_line(cell.case)}", markup=False, soft_wrap=True)
        out.print()
    totals = Counter(cell.verdict for cell in cells)
    out.print(
        f"{len(cells)} of {requested} cells: " + ", ".join(f"{totals[verdict]} {verdict}" for verdict in VERDICTS)
    )


def groups_table(model: str, cells: Sequence[StressCell]) -> PrintedTable:
    """A row for each group of a model's cases: how many got which verdict, and the largest error."""
    rows = []
    for about in dict.fromkeys(map(group, cells)):
        chosen = [cell for cell in cells if group(cell) == about]
        counts = Counter(cell.verdict for cell in chosen)
        worst = max((c for c in chosen if c.error), key=lambda c: c.error or 0.0, default=None)
        figures = (number(worst.error, ".1e"), worst.case.name) if worst is not None else (number(None), "")
        rows.append([about, *(number(counts[verdict] or None, "d") for verdict in VERDICTS), *figures])
    return table(model, ("about", *VERDICTS, "largest error", "in"), rows)


def sentence(cell: StressCell) -> str:
    """A cell in one line."""
    error = "" if cell.error is None else f" {cell.error:.1e}"
    reached = "" if cell.reached >= 1.0 else f" [{cell.reached:.0e} of the time]"
    why = f" ({cell.check})" if cell.check else ""
    message = cell.message if len(cell.message) <= WIDTH * 2 else cell.message[: WIDTH * 2] + "..."
    return f"{cell.case.name}: {cell.verdict}{error}{why}{reached}{': ' + message if message else ''}"


def draw(cells: Sequence[StressCell], path: Path, *, overwrite: bool = False) -> None:
    """Heat map: a row for each model, a column for each case, or where these are many for each group of cases; the
    largest error as colour and as its power of ten. StickslipError: the file exists or cannot be written."""
    from fmu_models.base.figures import save_figure

    save_figure(heat_map(cells), path, overwrite=overwrite)


def heat_map(cells: Sequence[StressCell]) -> Figure:
    """The figure of `draw`."""
    import numpy as np
    from matplotlib.figure import Figure

    models = list(dict.fromkeys(cell.case.model for cell in cells))
    names = list(dict.fromkeys(cell.case.name for cell in cells))
    by_case = len(names) <= CASES
    columns = names if by_case else sorted(set(map(group, cells)))
    errors = np.full((len(models), len(columns)), np.nan)
    marks: dict[tuple[int, int], str] = {}
    for cell in cells:
        at = models.index(cell.case.model), columns.index(cell.case.name if by_case else group(cell))
        if cell.error is not None:
            size = math.log10(min(max(cell.error, 1e-16), 1.0))
            errors[at] = np.nanmax([errors[at], size])
        mark = {"refused": "r", "failed": "F"}.get(cell.verdict, "")
        marks[at] = max(marks.get(at, ""), mark, key=("", "r", "F").index)
    size = (max(3.6 + 0.42 * len(columns), 7.0), 2.6 + 0.3 * len(models) + 0.07 * max(map(len, columns)))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(errors, vmin=-16, vmax=0, cmap="YlOrRd", aspect="auto")
    axes.set_facecolor("0.85")
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(models)), models)
    for (row, column), mark in marks.items():
        power = "" if np.isnan(errors[row, column]) else f"{errors[row, column]:.0f}"
        dark = errors[row, column] > -4
        axes.text(
            column, row, f"{power}{mark}", ha="center", va="center", fontsize=8, color="white" if dark else "black"
        )
    figure.colorbar(image, ax=axes, label="log10 of the largest\nrelative error (1)")
    axes.set_xlabel("case" if by_case else "what is extreme")
    labels = [f"accurate up to {math.log10(ACCURATE):.0f}"]
    labels += [f"{mark}: {words}" for mark, words in MARKS.items() if mark in marks.values()]
    labels += ["grey: no such case, or no error to be had"] if np.isnan(errors).any() else []
    axes.set_title(f"Numbers: log10 of the largest error\n{'; '.join(labels)}", fontsize="small")
    return figure
