"""How families of motions are drawn in given axes, and what they say in words (`fmu_models.base.shown`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import fmu_models.report.equilibrium_views  # registers what it draws
import fmu_models.report.plane_view  # noqa: F401  the same
from fmu_models.analyses.attractors import UNDECIDED
from fmu_models.analyses.basins import Basins
from fmu_models.analyses.chart import Chart
from fmu_models.analyses.crossings import BAND, JUMPS, CrossingDiagram
from fmu_models.analyses.diagram import Diagram
from fmu_models.analyses.edge import EdgeState
from fmu_models.analyses.labels import FAILED, INFINITE, UNLABELLED
from fmu_models.analyses.lyapunov import Exponents
from fmu_models.analyses.reduced_map import ReducedMap
from fmu_models.analyses.section import PoincareSection
from fmu_models.analyses.shares import BasinShares
from fmu_models.analyses.shock import LeastShock
from fmu_models.analyses.spectrum import Spectrum
from fmu_models.analyses.tipping import TippingRates
from fmu_models.base.shown import draw, tell
from fmu_models.report.branch_views import draw_branches, legend_below
from fmu_models.report.colours import COLOURS
from fmu_models.report.words import WIDTH, axis_label, in_words, symbol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fmu_models.base.arrays import Integers

    Vector = NDArray[Any]

HATCHES = {UNDECIDED: "////", INFINITE: "....", FAILED: "xxxx"}
SWEEPS = {"up": "black", "down": COLOURS[5]}
NONE = "#E5E5E5"  # of motions that do not repeat themselves, in charts of periods
FEWER = 4000  # points of a diagram from which on they are drawn as a picture
CELLS, PALE = 400, 0.3  # across the height, in which points of a diagram are counted; the shade of a lonely one
NARROW, SHORT = 30, 15  # letters in a line of a label beside other panels; of a legend that stands beside its picture
ACROSS = 500.0  # markers of a diagram that lie side by side, points
DENSE = 20000  # points of a section from which on their density is drawn
FEW = 200  # different points up to which each is a dot
FLOOR = 1e-8  # of the largest line: those below are not drawn


@draw.register(Diagram)
def _(diagram: Diagram, axes: Axes) -> None:
    """One state over the parameter, and exponents below it; where sweeps agree the one down is a smaller dot on that of
    the one up. A motion without a period is as dark as its points are dense."""
    from matplotlib.lines import Line2D

    ways = list(dict.fromkeys(diagram.ways))
    colours = [SWEEPS[way] if len(ways) > 1 else "black" for way in diagram.ways]
    lowest = _exponents_below(diagram, colours, axes) if diagram.durations.size else axes
    for k, colour in enumerate(colours):
        _dots(diagram, k, colour, axes)
    if diagram.branches is not None:
        draw_branches(diagram.branches.branches, diagram.of, axes)
    shown = diagram.amount.label if diagram.amount else diagram.of
    axes.set(xlabel="", ylabel=axis_label(shown, diagram.units))
    lowest.set_xlabel(axis_label(diagram.over, diagram.units))
    axes.set_title(diagram.model, fontsize="medium")
    dots = [Line2D([], [], marker="o", ls="", color=SWEEPS[way], ms=4, label=f"swept {way}") for way in ways]
    legend = axes.get_legend()
    handles = [*(dots if len(dots) > 1 else []), *(legend.legend_handles if legend else [])]
    if legend:
        legend.remove()
    if handles:
        legend_below(lowest, handles)


def _dots(diagram: Diagram, sweep: int, colour: str, axes: Axes) -> None:
    """The points of a sweep, the smaller the more values there are: dark where a motion has a period, else in the shade
    of their density."""
    from matplotlib.colors import LinearSegmentedColormap

    points = diagram.shown[sweep]
    there = np.isfinite(points)
    heights = points[there]
    if not heights.size:
        return
    rows = np.nonzero(there)[0]
    share = (1.0 / np.maximum(there.sum(axis=1), 1))[rows]
    span = np.ptp(diagram.shown[np.isfinite(diagram.shown)]) or 1.0
    cells = np.stack([rows, np.floor((heights - heights.min()) / span * CELLS).astype(int)], 1)
    _, inverse = np.unique(cells, axis=0, return_inverse=True)
    dense = np.bincount(inverse.ravel(), share)[inverse.ravel()]
    shade = np.where(diagram.periods[sweep][rows] > 0, 1.0, np.minimum(1.0, PALE + np.sqrt(dense)))
    order = np.argsort(shade, kind="stable")
    size = max(0.7, min(2.2, ACROSS / len(diagram.values))) * (1.0, 0.6)[diagram.ways[sweep] != diagram.ways[0]]
    axes.scatter(
        diagram.values[rows][order],
        heights[order],
        s=size**2,
        c=shade[order],
        cmap=LinearSegmentedColormap.from_list("shade", ["white", colour]),
        vmin=0.0,
        vmax=1.0,
        linewidths=0.0,
        rasterized=heights.size > FEWER,
    )


def _exponents_below(diagram: Diagram, colours: Sequence[str], axes: Axes) -> Axes:
    """Largest exponents in axes of their own, which share the parameter."""
    from matplotlib.gridspec import GridSpecFromSubplotSpec

    place, figure = axes.get_subplotspec(), axes.figure
    if place is None or figure is None:
        return axes
    parts = GridSpecFromSubplotSpec(2, 1, place, height_ratios=(2, 1), hspace=0.05)
    axes.set_subplotspec(parts[0])
    below = figure.add_subplot(parts[1], sharex=axes)
    axes.tick_params(labelbottom=False)
    for colour, values in zip(colours, diagram.per_time, strict=True):
        below.plot(diagram.values, values, ".-", color=colour, markersize=1.5, linewidth=0.6)
    below.axhline(0.0, color="0.5", linewidth=0.7, zorder=0)
    below.set_ylabel(f"largest exponent\n(1/{diagram.unit})", fontsize="small")
    return below


def colours_of(classes: Sequence[str]) -> list[str]:
    """A colour for each class; what does not repeat itself has a pale one."""
    return [NONE if name == "0" else COLOURS[i % len(COLOURS)] for i, name in enumerate(classes)]


def _mesh(
    axes: Axes,
    labels: Integers,
    axes_of: Mapping[str, Any],
    classes: Sequence[str],
    names: Sequence[str],
    units: Mapping[str, str],
) -> None:
    """Classes as colours, with a legend that says them; what has none is hatched."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    (name, rows), (second, columns) = axes_of.items()
    colours = colours_of(classes) or [NONE]
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
    handles = [Patch(facecolor=colour, label=text) for colour, text in zip(colours, names, strict=False)]
    for value, text in UNLABELLED.items():
        if (labels == value).any() and min(labels.shape) > 1:
            masked = np.ma.masked_where(labels != value, np.ones(labels.shape)).T
            white = ListedColormap(["white"])
            axes.pcolor(
                rows,
                columns,
                masked,
                hatch=HATCHES[value],
                cmap=white,
                shading="nearest",
                edgecolor="0.4",
                linewidth=0.0,
            )
            handles.append(Patch(facecolor="white", edgecolor="0.4", hatch=HATCHES[value], label=text))
    panels = axes.figure is not None and len(axes.figure.axes) > 1  # side by side they have little room
    across, up = (axis_label(one, units, NARROW if panels else WIDTH) for one in (name, second))
    axes.set(xlabel=across, ylabel=up)
    if panels or max(map(len, names), default=0) > SHORT:
        legend_below(axes, handles, 1 if panels else 0)
    else:
        axes.legend(handles=handles, frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))


@draw.register(Basins)
def _(basins: Basins, axes: Axes) -> None:
    names = list(basins.axes)
    if len(names) != 2:
        axes.plot(basins.axes[names[0]], basins.labels.reshape(len(basins.axes[names[0]]), -1), ".", color="black")
        axes.set(xlabel=axis_label(names[0], basins.units), ylabel="attractor")
        return
    classes = attractors_of(basins)
    _mesh(axes, basins.labels, basins.axes, classes, [in_words(name, basins.units) for name in classes], basins.units)
    limits = axes.get_xlim(), axes.get_ylim()
    for i, attractor in enumerate(basins.attractors):
        axes.plot(
            *(attractor.points[:, basins.states.index(name)] for name in names),
            "o" if attractor.period else ",",
            markerfacecolor=COLOURS[i % len(COLOURS)],
            markeredgecolor="black",
            color="black",
            markersize=6,
            markeredgewidth=1.2,
        )
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])
    axes.set_title(basins.model, fontsize="medium")


def attractors_of(basins: Basins) -> list[str]:
    """Texts of the attractors, each with its share of the starts."""
    return [f"{word} ({100 * share:.3g} %)" for word, share in zip(basins.words, basins.shares, strict=True)]


def classes_of(chart: Chart) -> list[str]:
    """Texts of the classes of a chart."""
    return ["none found" if name == "0" else name for name in chart.classes]


@draw.register(Chart)
def _(chart: Chart, axes: Axes) -> None:
    names = [in_words(name, chart.units) for name in classes_of(chart)]
    _mesh(axes, chart.labels, chart.axes, chart.classes, names, chart.units)
    legend = axes.get_legend()
    assert legend is not None
    legend.set_title(chart.what)
    axes.set_title(chart.model, fontsize="medium")


@draw.register(ReducedMap)
def _(result: ReducedMap, axes: Axes) -> None:
    """The map over its state, the diagonal, and where they meet: full dots where it is less steep than 1."""
    name = axis_label(result.of, result.units)
    ends = [min(result.values[0], result.images.min()), max(result.values[-1], result.images.max())]
    axes.plot(ends, ends, color="0.6", linewidth=0.7)
    axes.plot(result.values, result.images, color="black", linewidth=1.2)
    at = result.fixed[:, result.states.index(result.of)]
    for x, slope in zip(at, result.fixed_slopes, strict=True):
        axes.plot(x, x, "o", color="black" if abs(slope) < 1.0 else "white", markeredgecolor="black", markersize=5)
        text_offset: dict[str, Any] = {"xytext": (-7, 5), "ha": "right"} if slope > 1.0 else {"xytext": (7, -9)}
        axes.annotate(f"slope {slope:.3f}", (x, x), textcoords="offset points", fontsize="small", **text_offset)
    axes.set(xlabel=name, ylabel=f"{name} after the step")
    axes.set_title(result.model, fontsize="medium")


@draw.register(CrossingDiagram)
def _(result: CrossingDiagram, axes: Axes) -> None:
    """Stable fixed points thick, unstable ones thin and grey, jump crossings dotted; marks where they meet; bands."""
    for curve in result.curves:
        if curve.kind == JUMPS:
            axes.plot(curve.values, curve.points, ":", color="black", linewidth=1.0)
        elif curve.kind != BAND:
            steps = curve.stable[:-1] & curve.stable[1:]
            for stable, colour, width in ((False, "0.55", 0.9), (True, "black", 1.6)):
                shown = np.append(False, steps == stable) | np.append(steps == stable, False)
                axes.plot(curve.values, np.where(shown, curve.points, np.nan), color=colour, linewidth=width)
    for n in range(1, result.period + 1):  # the lower edge there and the upper one back
        edges = [curve for curve in result.curves if (curve.kind, curve.period) == (BAND, n)]
        for low, high in zip(edges[::2], edges[1::2], strict=False):
            outline = [np.append(getattr(low, name), getattr(high, name)) for name in ("values", "points")]
            axes.fill(*outline, color="black", linewidth=0.5)
    marks: dict[str, list[tuple[float, float]]] = {}
    for point in result.special:
        marks.setdefault(point.kind, []).append((point.value, point.x))
    for (kind, places), mark in zip(sorted(marks.items()), "osv^", strict=False):
        shape = {"markerfacecolor": "white", "markeredgecolor": "black", "markersize": 4}
        axes.plot(*zip(*places, strict=True), mark, label=kind, **shape)
    styles = {"stable": ("-", "black", 1.6), "unstable": ("-", "0.55", 0.9), "jump crossing": (":", "black", 1.0)}
    handles = [axes.plot([], [], ls, color=c, linewidth=w, label=name)[0] for name, (ls, c, w) in styles.items()]
    axes.set(xlabel=axis_label(result.over, result.units), ylabel=axis_label(result.of, result.units))
    axes.set_title(result.model, fontsize="medium")
    legend_below(axes, [*handles, *axes.get_legend_handles_labels()[0][: len(marks)]])


@draw.register(Spectrum)
def _(spectrum: Spectrum, axes: Axes) -> None:
    if spectrum.lines:
        floor = spectrum.amplitude.max() * FLOOR
        strong = spectrum.amplitude > floor
        axes.vlines(spectrum.frequency[strong], floor, spectrum.amplitude[strong], color="black", linewidth=1.2)
        axes.set_ylim(floor, 3.0 * spectrum.amplitude.max())
        axes.set_ylabel(f"amplitude of {symbol(spectrum.of)} ({spectrum.unit})")
    else:
        axes.plot(spectrum.frequency, spectrum.amplitude, color="black", linewidth=0.8)
        axes.fill_between(spectrum.frequency, spectrum.low, spectrum.high, color="0.8", label="95 %")
        axes.set_ylabel(f"density of {symbol(spectrum.of)} (({spectrum.unit})$^2$/Hz)")
        axes.legend(frameon=False)
    axes.set(yscale="log", xlabel="frequency (Hz)")


@draw.register(Exponents)
def _(result: Exponents, axes: Axes) -> None:
    number = np.arange(1, len(result.values) + 1)
    finite = np.isfinite(result.per_time)
    axes.bar(number[finite], result.per_time[finite], yerr=3 * result.per_time_errors[finite], color="0.7", capsize=4)
    for i in np.flatnonzero(~finite):
        axes.annotate("$-\\infty$", (number[i], 0.0), ha="center", va="top")
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_xticks(number)
    axes.set(xlabel="exponent", ylabel=f"growth rate (1/{result.unit}), bars: 3 standard errors")


@draw.register(PoincareSection)
def _(section: PoincareSection, axes: Axes) -> None:
    names = section.states[:2]
    x, y = section.points[:, 0], section.points[:, min(1, section.points.shape[1] - 1)]
    if len(np.unique(np.round(section.points, 9), axis=0)) < FEW:
        axes.plot(x, y, "o", color="black", markersize=4)
    elif len(section.points) > DENSE:
        drawn = axes.hexbin(x, y, gridsize=150, bins="log", cmap="viridis", mincnt=1, linewidths=0.2)
        axes.figure.colorbar(drawn, ax=axes, label="points in a cell")
    else:
        axes.plot(x, y, "o", color="black", markersize=1.2, markeredgewidth=0.0)
    axes.set(xlabel=axis_label(names[0], section.units), ylabel=axis_label(names[-1], section.units))
    axes.set_title(section.model, fontsize="medium")


@draw.register(EdgeState)
def _(result: EdgeState, axes: Axes) -> None:
    """The border as it was followed, and the edge state on it."""
    columns, names = (0, min(1, len(result.states) - 1)), [axis_label(name, result.units) for name in result.states]
    axes.plot(*(result.path[:, i] for i in columns), ".-", color="0.6", markersize=3, linewidth=0.6, label="border")
    points = [result.points[:, i] for i in columns]
    axes.plot(*points, "o", color="white", markeredgecolor="black", label=result.word)
    axes.set(xlabel=names[columns[0]], ylabel=names[columns[1]])
    axes.set_title(f"{result.model}, between {' and '.join(result.between)}", fontsize="medium")
    axes.legend(frameon=False)


@draw.register(LeastShock)
def _(result: LeastShock, axes: Axes) -> None:
    """The shock in the first two states, and all shocks of its norm where both are struck."""
    columns = (0, min(1, len(result.states) - 1))
    x, y = columns
    at, end = ((float(numbers[x]), float(numbers[y])) for numbers in (result.point, result.point + result.shock))
    weights = [result.weights.get(result.states[i], np.inf) for i in columns]
    angles = np.linspace(0.0, 2.0 * np.pi, 200)
    circle = (place + result.size * f(angles) / w for place, f, w in zip(at, (np.cos, np.sin), weights, strict=True))
    axes.plot(*circle, color="0.7", linewidth=0.8, label=f"norm {result.size:.6g}{', at most' * result.upper_bound}")
    axes.annotate("", end, at, arrowprops={"arrowstyle": "->"})
    axes.plot(*at, "o", color="black", label=result.comes_from)
    axes.set(**{f"{k}label": axis_label(result.states[i], result.units) for k, i in zip("xy", columns, strict=True)})
    axes.set_title(f"{result.model}, to {result.leads_to}", fontsize="medium")
    axes.legend(frameon=False)


@draw.register(BasinShares)
def _(result: BasinShares, axes: Axes) -> None:
    """Shares over the parameter with their 95 % intervals, and dotted lines where attractors begin and end."""
    for k, name in enumerate(result.names):
        there = result.counts[:, k] > 0
        if there.any():
            colour, share = COLOURS[k % len(COLOURS)], np.where(there, result.shares[:, k], np.nan)
            axes.plot(result.values, share, ".-", color=colour, markersize=3, linewidth=0.8)
            word = next((row[k] for row in result.words if row[k:] and row[k]), name)
            axes.lines[-1].set_label(in_words(word, result.units))
            axes.fill_between(
                result.values, result.low[:, k], result.high[:, k], where=there, color=colour, alpha=0.2, linewidth=0.0
            )
    for tip in result.tips:
        axes.axvline(tip.value, color="0.5", linestyle=":", linewidth=0.8)
    axes.set(xlabel=axis_label(result.over, result.units), ylabel="share of the starts", ylim=(-0.02, 1.02))
    axes.set_title(result.model, fontsize="medium")
    axes.legend(title="attractor", frameon=False, fontsize="small")


@draw.register(TippingRates)
def _(result: TippingRates, axes: Axes) -> None:
    """What the motion comes to over the rate, one line for each, and dotted lines where that changes."""
    kinds = sorted(set(zip(result.labels.tolist(), result.words, strict=True)))
    places = {label: place for place, (label, _) in enumerate(kinds)}
    axes.plot(result.rates, [places[label] for label in result.labels.tolist()], "o", color="black", markersize=4)
    for tip in result.tips:
        axes.axvline(tip.value, color="0.5", linestyle=":", linewidth=0.8)
    axes.set_yticks([*places.values()], [in_words(word, result.units) for _, word in kinds])
    unit = result.units.get(result.over, "")
    axes.set(xscale="log", xlabel=f"rate of {symbol(result.over)} ({unit}/s)", ylim=(-0.5, len(kinds) - 0.5))
    axes.set_title(f"{result.model}, {symbol(result.over)} from {result.first:g} to {result.last:g}", fontsize="medium")


@tell.register(Diagram)
def _(diagram: Diagram) -> str:
    lines = [repr(diagram), *([tell(diagram.branches)] if diagram.branches else ())]
    lines += [
        f"swept {lost.direction}: a stable branch that goes on is left between {diagram.over} = {lost.before:.9g} and "
        f"{lost.value:.9g}, {diagram.of} = {lost.state:.6g}"
        for lost in diagram.lost or ()
    ]
    return "\n".join(lines)


REPEATED = (BasinShares, EdgeState, LeastShock, TippingRates, ReducedMap, Basins, Chart, Spectrum, Exponents)
for kind in (*REPEATED, PoincareSection, CrossingDiagram):
    tell.register(kind, repr)
