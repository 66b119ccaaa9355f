"""The columns of logs, each over the rows, with the role that is proposed for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rig_io.description.runs import DescribedLog

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 4000  # of a line, at most


def columns_figure(logs: Sequence[DescribedLog]) -> Figure:
    """Axes for every column of the log that has most of them."""
    from matplotlib.figure import Figure

    most = max(([(file, column) for file in log.files for column in file.columns] for log in logs), key=len)
    figure = Figure(figsize=(8.0, 1.1 * len(most) + 0.6), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(most), 1, sharex=True))
    for axis, (file, column) in zip(axes, most, strict=True):
        values = file.table.columns[column.name]
        every = max(len(values) // POINTS, 1)
        axis.plot(np.arange(len(values))[::every], values[::every], linewidth=0.7, color="C0" if column.role else "0.6")
        sure = f", {100 * column.confidence:.0f} %" if column.role else ""
        axis.set_title(
            f"{column.name}: {column.role or 'no role'}{sure}", loc="left", fontsize="small", parse_math=False
        )
        axis.set_ylabel(column.unit or "?", parse_math=False)
    axes[-1].set_xlabel("row")
    return figure
