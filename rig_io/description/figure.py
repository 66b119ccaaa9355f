"""The columns of logs, each over the rows, with the role that is proposed for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rig_io.description.runs import Log

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 4000  # of a line, at most


def columns_figure(logs: Sequence[Log]) -> Figure:
    """Axes for every column of the first log."""
    from matplotlib.figure import Figure

    first = [(file, one) for file in logs[0].files for one in file.columns]
    figure = Figure(figsize=(8.0, 1.1 * len(first) + 0.6), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(first), 1, sharex=True))
    for place, (file, one) in zip(axes, first, strict=True):
        values = file.table.columns[one.name]
        every = max(len(values) // POINTS, 1)
        place.plot(np.arange(len(values))[::every], values[::every], linewidth=0.7, color="C0" if one.role else "0.6")
        sure = f", {100 * one.confidence:.0f} %" if one.role else ""
        place.set_title(f"{one.name}: {one.role or 'no role'}{sure}", loc="left", fontsize="small", parse_math=False)
        place.set_ylabel(one.unit or "?", parse_math=False)
    axes[-1].set_xlabel("row")
    return figure
