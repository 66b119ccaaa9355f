"""How families of motions are drawn in given axes, and what they say in words (`fmu_models.base.shown`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.analyses.basins import FAILED, INFINITE, UNDECIDED, Basins
from fmu_models.analyses.chart import Chart
from fmu_models.analyses.diagram import Diagram
from fmu_models.analyses.lyapunov import Exponents
from fmu_models.analyses.poincare import PoincareSection
from fmu_models.analyses.spectrum import Spectrum
from fmu_models.base.shown import draw, tell

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito: told apart by all kinds of eyes
COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#999999"),
    *("#003A59", "#7A5500", "#00513B", "#6B3D54", "#B3DDF5", "#F2B48F", "#FAF5B0", "#DDDDDD"),
)
DENSE = 20000  # points of a section from which on their density is drawn


@draw.register(Diagram)
def _(diagram: Diagram, axes: Axes) -> None:
    """The first state over the parameter; a sweep down lies over the one up in another colour."""
    for k, way in enumerate(diagram.directions):
        shown = diagram.shown[k]
        across = np.broadcast_to(diagram.values[:, None], shown.shape)
        axes.plot(
            across.ravel(),
            shown.ravel(),
            ",",
            color=("black", COLOURS[5])[k % 2],
            label=way,
            rasterized=shown.size > DENSE,
        )
    axes.set_xlabel(diagram.over)
    axes.set_ylabel(diagram.of)
    axes.set_title(diagram.model, fontsize="medium")
    if len(diagram.directions) > 1:
        for line in axes.legend(frameon=False, markerscale=10).get_lines():
            line.set_marker("o")
            line.set_markersize(4)


def _mesh(axes: Axes, labels: Any, grid: Any, names: list[str], classes: list[str]) -> None:
    """Classes as colours, with a legend; what has none is hatched."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    rows, columns = grid
    colours = [COLOURS[i % len(COLOURS)] for i in range(max(1, len(classes)))]
    axes.pcolormesh(
        rows,
        columns,
        np.ma.masked_less(labels, 0).T,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        rasterized=True,
        shading="nearest",
    )
    handles = [Patch(facecolor=colour, label=name) for colour, name in zip(colours, classes, strict=False)]
    for value, name, hatch in (
        (UNDECIDED, "undecided", "////"),
        (INFINITE, "to infinity", "...."),
        (FAILED, "failed", "xx"),
    ):
        if (labels == value).any() and min(labels.shape) > 1:
            part = np.ma.masked_where(labels != value, np.ones(labels.shape)).T
            axes.pcolor(rows, columns, part, hatch=hatch, alpha=0.0, shading="nearest")
            handles.append(Patch(facecolor="white", edgecolor="black", hatch=hatch, label=name))
    axes.set_xlabel(names[0])
    axes.set_ylabel(names[1])
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small")


@draw.register(Basins)
def _(basins: Basins, axes: Axes) -> None:
    names = list(basins.axes)
    if len(names) != 2:
        axes.plot(basins.axes[names[0]], basins.labels.reshape(len(basins.axes[names[0]]), -1), ".", color="black")
        axes.set_xlabel(names[0])
        axes.set_ylabel("attractor")
        return
    classes = [_attractor(basins, i) for i in range(len(basins.attractors))]
    _mesh(axes, basins.labels, [basins.axes[name] for name in names], names, classes)
    limits = axes.get_xlim(), axes.get_ylim()
    for i, attractor in enumerate(basins.attractors):
        axes.plot(
            *(attractor.points[:, basins.states.index(name)] for name in names),
            "o" if attractor.period else ",",
            markerfacecolor=COLOURS[i % len(COLOURS)],
            markeredgecolor="black",
            color="black",
            markersize=5,
        )
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])
    axes.set_title(basins.model, fontsize="medium")


def _attractor(basins: Basins, i: int) -> str:
    attractor = basins.attractors[i]
    word = "-".join(map(str, (attractor.period, *getattr(attractor, "began", ())))) if attractor.period else "chaotic"
    return f"{word} ({100 * basins.shares[i]:.3g} %)"


@draw.register(Chart)
def _(chart: Chart, axes: Axes) -> None:
    names = list(chart.axes)
    _mesh(axes, chart.labels, [chart.axes[name] for name in names], names, list(chart.classes))
    axes.set_title(f"{chart.model}: {chart.what}", fontsize="medium")


@draw.register(Spectrum)
def _(spectrum: Spectrum, axes: Axes) -> None:
    if spectrum.lines:
        axes.vlines(
            spectrum.frequency, spectrum.amplitude.max() * 1e-8, spectrum.amplitude, color="black", linewidth=1.2
        )
        axes.set_ylabel(f"amplitude of {spectrum.of} ({spectrum.unit})")
    else:
        axes.plot(spectrum.frequency, spectrum.amplitude, color="black", linewidth=0.8)
        axes.fill_between(spectrum.frequency, spectrum.low, spectrum.high, color="0.8", label="95 %")
        axes.set_ylabel(f"density of {spectrum.of} (({spectrum.unit})$^2$/Hz)")
        axes.legend(frameon=False)
    axes.set_yscale("log")
    axes.set_xlabel("frequency (Hz)")


@draw.register(Exponents)
def _(found: Exponents, axes: Axes) -> None:
    number = np.arange(1, len(found.values) + 1)
    finite = np.isfinite(found.per_time)
    axes.bar(number[finite], found.per_time[finite], yerr=3 * found.per_time_errors[finite], color="0.7", capsize=4)
    for i in np.flatnonzero(~finite):
        axes.annotate("$-\\infty$", (number[i], 0.0), ha="center", va="top")
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_xticks(number)
    axes.set_xlabel("exponent")
    axes.set_ylabel(f"growth rate (1/{found.unit}), bars: 3 standard errors")


@draw.register(PoincareSection)
def _(section: PoincareSection, axes: Axes) -> None:
    names = section.states[:2]
    x, y = section.points[:, 0], section.points[:, min(1, section.points.shape[1] - 1)]
    if len(section.points) > DENSE:
        axes.hexbin(x, y, gridsize=250, bins="log", cmap="viridis", mincnt=1)
    else:
        axes.plot(x, y, ",", color="black")
    axes.set_xlabel(names[0])
    axes.set_ylabel(names[-1])
    axes.set_title(section.model, fontsize="medium")


for kind in (Diagram, Basins, Chart, Spectrum, Exponents, PoincareSection):
    tell.register(kind, repr)
