"""Phase portraits of what a scene computed, one panel each on common axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from fmu_models.base.errors import StickslipError
from fmu_models.report.figures import save_figure

if TYPE_CHECKING:
    from fmu_models.simulation.trajectory import Trajectory


def draw(
    title: str,
    panels: Sequence[tuple[str, Trajectory]],
    axes: tuple[str, str],
    path: Path,
    *,
    points: bool = False,
    overwrite: bool = False,
) -> None:
    """Draw two states against each other, a panel with its heading per trajectory.

    points: the trajectories are sampled once per period: no line between samples.

    Raises:
        StickslipError: nothing to draw, or the file exists or cannot be written.
    """
    if not panels:
        raise StickslipError("There is no motion to draw.")
    columns = 2 if len(panels) == 4 else min(3, len(panels))
    rows = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(1.0 + 3.6 * columns, 0.8 + 3.0 * rows), layout="constrained")
    figure.suptitle(title)
    figure.get_layout_engine().set(w_pad=0.1)  # type: ignore[union-attr] # labels of neighbours stay apart
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    x, y = axes
    for i, axis in enumerate(grid.flat):
        if i >= len(panels):
            axis.set_axis_off()
            continue
        heading, trajectory = panels[i]
        style = {"linestyle": "none", "marker": ".", "markersize": 2} if points else {"linewidth": 0.9}
        axis.plot(trajectory[x], trajectory[y], color="black", **style)
        axis.set_title(heading, fontsize="medium")
        lowest = i + columns >= len(panels)
        axis.tick_params(labelbottom=lowest, labelleft=i % columns == 0)
        axis.set_xlabel(f"{x} ({trajectory.units[x]})" if lowest else "")
        axis.set_ylabel(f"{y} ({trajectory.units[y]})" if i % columns == 0 else "")
    save_figure(figure, path, overwrite=overwrite)
