"""How a phase plane is drawn: the flow grey, surfaces dotted, what slides thick, cycles and manifolds by their kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.analyses.plane import PhasePlane
from fmu_models.base.shown import draw, tell
from fmu_models.report.colours import COLOURS
from fmu_models.report.words import axis_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SLIDES = {True: ("slide or stick", "-"), False: ("may leave at any time", ":")}
HALVES = {"unstable": (COLOURS[1], "-"), "stable": (COLOURS[0], "--")}


@draw.register(PhasePlane)
def _(plane: PhasePlane, axes: Axes) -> None:
    for line in plane.flow:
        axes.plot(*line.T, color="0.75", linewidth=0.6, zorder=1)
        middle = len(line) // 2
        if np.ptp(line, axis=0).any():
            arrow = {"arrowstyle": "->", "color": "0.6", "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", line[middle], line[middle - 1], arrowprops=arrow, zorder=1)
    for line in plane.surfaces:
        axes.plot(*line.T, color="0.5", linestyle=":", linewidth=0.9, zorder=2, label="contacts change")
    for sliding in plane.slidings:
        label, style = SLIDES[sliding.attracting]
        axes.plot(*sliding.points.T, style, color="0.5", linewidth=4.0, solid_capstyle="butt", zorder=2, label=label)
    for half in plane.manifolds:
        colour, style = HALVES[half.kind]
        axes.plot(*half.points.T, style, color=colour, linewidth=1.0, zorder=3, label=f"{half.kind} manifold")
    for cycle in plane.cycles:
        style = "-" if cycle.stable else (0, (5, 2))
        axes.plot(*cycle.points.T, color="black", linestyle=style, linewidth=1.6, zorder=4, label=cycle.word)
    for rest in plane.rests:
        axes.plot(*rest.point, linestyle="none", zorder=5, label=rest.kind, **_mark(rest.kind, rest.stable))
    x, y = plane.states
    axes.set(xlabel=axis_label(x, plane.units), ylabel=axis_label(y, plane.units))
    axes.set(xlim=plane.limits[:, 0], ylim=plane.limits[:, 1])
    axes.set_title(plane.model, fontsize="medium")
    one_each = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    narrow: dict[str, Any] = {"ncols": 2, "columnspacing": 1.0, "handlelength": 2.4, "handletextpad": 0.5}
    if one_each:  # two columns, small: panels side by side are no wider
        where = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.15), "fontsize": "x-small"}
        axes.legend(handles=list(one_each.values()), frameon=False, **where, **narrow)


def _mark(kind: str, stable: bool) -> dict[str, Any]:
    if "saddle" in kind:
        return {"marker": "X", "color": "black", "markersize": 6, "markeredgecolor": "white", "markeredgewidth": 0.5}
    filled = {"marker": "o", "markersize": 6, "markeredgecolor": "black", "markerfacecolor": "black"}
    if kind == "on a surface":
        return {**filled, "fillstyle": "left", "markerfacecoloralt": "white"}
    return filled if stable else {**filled, "markerfacecolor": "white"}


@tell.register(PhasePlane)
def _(plane: PhasePlane) -> str:
    """All that is in it, one a line."""
    lines = [plane._heading()]
    for name, value in plane._contents().items():
        parts = value if isinstance(value, tuple) else (value,)
        lines += [f"  {name}: {', '.join(map(_said, parts))}"] if value is not None else []
    return "\n".join(lines)


def _said(part: Any) -> str:
    if isinstance(part, np.ndarray | tuple):
        return f"({', '.join(f'{number + 0.0:.10g}' for number in np.asarray(part).tolist())})"
    return str(part)
