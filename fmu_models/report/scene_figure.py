"""What a scene computed: phase portraits, one panel each on common axes; families of motions, one panel each."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from fmu_models.analyses.lyapunov import Exponents
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import save_figure
from fmu_models.report.colours import COLOURS
from fmu_models.report.words import axis_label, caption, symbol

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fmu_models.base.arrays import Vector
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.kinds.kind import Row
    from fmu_models.scene.scene import Scene
    from fmu_models.simulation.trajectory import Trajectory

BARS = 2  # values up to which exponents are bars in a panel each
WIDTH = 6.3  # inches: a page of a journal


def draw_scene(
    scene: Scene,
    fmu: Fmu,
    rows: Sequence[Row],
    path: str | os.PathLike[str],
    *,
    beside: Sequence[tuple[Vector, Vector] | None] = (),
    overwrite: bool = False,
) -> None:
    """Draw what a scene computed: its families, or else a phase portrait per run.

    beside: of each run the points of another one, (n,) in both states, or None.

    Raises:
        StickslipError: the scene computed nothing that has a picture; the file exists or cannot be written.
    """
    families = [row for row in rows if row.family is not None]
    if families:
        draw_families(scene, families, Path(path), overwrite=overwrite)
        return
    panels = [(_heading(scene, row), row.trajectory) for row in rows if row.trajectory]
    states = fmu.states or ["", ""]  # of a map, whose motions are no trajectories
    axes = (states[0], states[len(states) // 2])
    under, points = caption(scene), scene.compute.kind == "strobe"
    draw(scene.title, panels, axes, Path(path), points=points, under=under, beside=beside, overwrite=overwrite)


def _heading(scene: Scene, row: Row) -> str:
    """What is held in a panel."""
    held = {**{name: row.panel for name in scene.compute.panels}, str(scene.compute.over): row.at}
    units = {name: f" {unit}" if unit != "1" else "" for name, unit in scene.units.items()}
    return ", ".join(f"{symbol(n)} = {v:g}{units.get(n, '')}" for n, v in held.items() if v is not None)


def _write_under(figure: Figure, text: str) -> None:
    """Small words below all panels."""
    if text:
        figure.supxlabel(text, x=0.01, ha="left", fontsize="x-small", color="0.25")


def draw(
    title: str,
    panels: Sequence[tuple[str, Trajectory]],
    axes: tuple[str, str],
    path: Path,
    *,
    points: bool = False,
    under: str = "",
    beside: Sequence[tuple[Vector, Vector] | None] = (),
    overwrite: bool = False,
) -> None:
    """Draw two states against each other, a panel with its heading per trajectory.

    points: the trajectories are sampled once per period: no line between samples. under: words below all panels.
    beside: of each trajectory points (n,) that are drawn with it, or None.

    Raises:
        StickslipError: nothing to draw, or the file exists or cannot be written.
    """
    if not panels:
        raise StickslipError("There is no motion to draw: of a map those of a family are, as basins and branches.")
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
        if beside and (others := beside[i]) is not None:
            axis.plot(*others, "o", color="0.45", markersize=2.0, markeredgewidth=0.0)
        axis.set_title(heading, fontsize="medium")
        lowest = i + columns >= len(panels)
        axis.tick_params(labelbottom=lowest, labelleft=i % columns == 0)
        axis.set(
            xlabel=axis_label(x, trajectory.units) if lowest else "",
            ylabel=axis_label(y, trajectory.units) if i % columns == 0 else "",
        )
    _write_under(figure, under)
    save_figure(figure, path, overwrite=overwrite)


def draw_families(scene: Scene, rows: Sequence[Row], path: Path, *, overwrite: bool = False) -> None:
    """Draw each family of motions in a panel of its own; exponents at many values in one, over what is varied.

    Raises:
        StickslipError: the file exists or cannot be written.
    """
    families = {id(row.family): row for row in rows}
    exponents = isinstance(rows[0].family, Exponents)
    count = 1 if exponents and len(rows) > BARS else len(families)
    columns = 1 if scene.compute.panels else min(2, count)
    lines = math.ceil(count / columns)
    figure = Figure(figsize=(WIDTH if columns == 1 else 1.3 * WIDTH, 0.5 + 3.7 * lines), layout="constrained")
    figure.suptitle(scene.title, fontsize="medium")
    grid = list(figure.subplots(lines, columns, squeeze=False).flat)
    if exponents and count == 1 < len(rows):
        over = str(scene.compute.over)
        _exponents(axis_label(over, scene.units), rows, grid[0])
    else:
        for axes, row in zip(grid, families.values(), strict=False):
            assert row.family is not None
            row.family.plot(axes)
            sweeps = len(families) < len(rows)
            held = dataclasses.replace(row, at=None) if sweeps else row
            axes.set_title("" if count == 1 else _heading(scene, held), fontsize="medium")
    for axes in grid[: count - 1] if scene.compute.panels else ():  # the lowest says it for all
        axes.set_xlabel("")
        if legend := axes.get_legend():
            legend.remove()
    for axes in grid[count:]:
        axes.set_axis_off()
    _write_under(figure, caption(scene))
    save_figure(figure, path, overwrite=overwrite)


def _exponents(over: str, rows: Sequence[Row], axes: Axes) -> None:
    """Exponents over a parameter, with bars of three standard errors."""
    families = [row.family for row in rows if isinstance(row.family, Exponents)]
    at = [float(row.at or 0.0) for row in rows]
    for i in range(len(families[0].values)):
        values = [float(exponents.per_time[i]) for exponents in families]
        errors = [3.0 * float(exponents.per_time_errors[i]) for exponents in families]
        axes.errorbar(
            at, values, errors, fmt=".-", capsize=2, linewidth=0.8, color=COLOURS[i], label=f"exponent {i + 1}"
        )
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set(xlabel=over, ylabel=f"growth rate (1/{families[0].unit}), bars: 3 standard errors")
    axes.legend(frameon=False)
