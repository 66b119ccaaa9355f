"""A trajectory at one glance: every coordinate as a phase portrait and over time, or what is asked for.

Stretches of stick and of contact are shaded; where several contacts have them, a strip below says which. The state of
a contact is drawn in its words, with a dot where an event begins each. What was
measured of a variable is drawn as dots, over time, and in portraits of which both variables were measured.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contact_kinds import BY_TYPE_NAME
from fmu_models.report.colours import COLOURS
from fmu_models.report.words import axis_label, symbol

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fmu_models.simulation.beside import MeasuredVariable
    from fmu_models.simulation.trajectory import Trajectory

MOST = 6  # coordinates, and variables without one, that are drawn unless some are chosen
COLUMNS, ABREAST = 6, 3  # of the grid; portraits in a row
MANY = 5000  # dots of a measurement, from which on they are drawn as a picture
WIDTH, SERIES, PORTRAIT, STRIP = 11.0, 1.5, 3.4, 0.25  # inches: of the figure; heights, the last of one contact
# what is shaded, and how dark; the last hides those before
SHADES = {"contact": "0.93", "sliding": "0.8", "stick": "0.8"}
DOTS: dict[str, Any] = {"marker": ".", "linestyle": "", "color": COLOURS[5], "markersize": 2.5, "label": "measured"}


@dataclass(frozen=True)
class Panel:
    """Variables of one unit over another, or over the time."""

    y: tuple[str, ...]
    x: str | None = None


@dataclass
class PanelLayout:
    """Panels on a grid of rows, heights in inches, and ``COLUMNS`` columns."""

    heights: list[float] = field(default_factory=list)
    cells: list[tuple[Panel, slice, slice]] = field(default_factory=list)

    def series(self, names: Sequence[str], first: int = 0) -> None:
        """A row for variables over time, from a column on."""
        self._row(Panel(tuple(names)), SERIES, first)

    def strip(self, contacts: Panel, first: int = 0) -> None:
        """A row with a line for each contact, from a column on."""
        self._row(contacts, STRIP * len(contacts.y) + 0.2, first)

    def _row(self, panel: Panel, height: float, first: int) -> None:
        self.heights.append(height)
        row = len(self.heights) - 1
        self.cells.append((panel, slice(row, row + 1), slice(first, COLUMNS)))

    def coordinate(self, q: str, v: str) -> None:
        """A portrait, and beside it both over time."""
        row = len(self.heights)
        self.cells.append((Panel((v,), q), slice(row, row + 2), slice(0, COLUMNS // 3)))
        self.series([q], COLUMNS // 3)
        self.series([v], COLUMNS // 3)

    def portraits(self, panels: Sequence[Panel]) -> None:
        """A row of portraits."""
        self.heights.append(PORTRAIT)
        row, width = len(self.heights) - 1, COLUMNS // len(panels)
        for i, panel in enumerate(panels):
            self.cells.append((panel, slice(row, row + 1), slice(i * width, (i + 1) * width)))


Spells = dict[str, dict[str, NDArray[np.bool_]]]  # by kind of shading and contact: whether it is so, (n,)


def trajectory_figure(
    trajectory: Trajectory,
    model: Fmu | Mapping[str, Fmu],
    plots: Sequence[str] = (),
    measured: Sequence[MeasuredVariable] = (),
    title: str = "",
) -> Figure:
    """Phase portrait and time series of every coordinate.

    Args:
        model: of the run, or the FMUs of a coupled system by the names of its units.
        measured: what is drawn beside the run.
        title: that of the model if left out.
        plots: what to draw instead: "x,v" for time series, "x:v" for one variable against another.

    Raises:
        StickslipError: there is no such variable, or nothing to draw.
    """
    trajectory = trajectory.drawn
    fmus = {"": model} if isinstance(model, Fmu) else {f"{unit}.": fmu for unit, fmu in model.items()}
    title = title or ", ".join(str(fmu.description.modelName) for fmu in fmus.values())
    spells = _spells(trajectory, fmus)
    contacts = sorted({name for of_kind in spells.values() for name in of_kind})
    strip = Panel(tuple(contacts) if len(contacts) > 1 else ())
    layout = _chosen(trajectory, plots, strip) if plots else _all(trajectory, fmus, strip, measured)
    if not layout.cells:
        raise StickslipError(f"{title} has no state or output to draw. Leave the figure out.")
    figure = Figure(figsize=(WIDTH, sum(layout.heights) + 1.0), layout="constrained")
    grid = figure.add_gridspec(len(layout.heights), COLUMNS, height_ratios=layout.heights)
    series: list[Axes] = []
    for panel, rows, columns in layout.cells:
        axes = figure.add_subplot(grid[rows, columns])
        if panel is strip:
            _draw_strip(axes, trajectory, spells, contacts)
        elif panel.x is None:
            _draw_series(axes, panel, trajectory, spells, measured, fmus.get(""))
        else:
            _draw_portrait(axes, panel, trajectory, spells, measured)
        if panel.x is None:
            series.append(axes)
    for axes in series:
        axes.set_xlim(trajectory.time[0], trajectory.time[-1])
        axes.tick_params(labelbottom=axes is series[-1])
    if series:
        series[-1].set_xlabel("time (s)")
        figure.align_ylabels([axes for axes in series if axes.get_ylabel()])
    _head(figure, title, spells, portraits=len(series) < len(layout.cells), measured=bool(measured))
    return figure


def _all(
    trajectory: Trajectory, fmus: Mapping[str, Fmu], strip: Panel, measured: Sequence[MeasuredVariable]
) -> PanelLayout:
    """Every coordinate with its velocity; of other states, two are a plane, more are series, as is all that was
    measured."""
    states = [f"{unit}{name}" for unit, fmu in fmus.items() for name in fmu.states]
    states = [name for name in states if name in trajectory.values]
    pairs = [(f"{unit}{q}", f"{unit}{v}") for unit, fmu in fmus.items() for q, v in _coordinates(fmu)]
    planes = [pair for pair in pairs if set(pair) <= set(states)]
    alone = [name for name in states if not any(name in pair for pair in planes)]
    if len(alone) == 2:
        planes.append((alone.pop(0), alone.pop()))
    if not states:
        outputs = [f"{unit}{name}" for unit, fmu in fmus.items() for name in fmu.outputs]
        alone = [name for name in outputs if name in trajectory.values]
    layout = PanelLayout()
    for q, v in planes[:MOST]:
        layout.coordinate(q, v)
    first = COLUMNS // 3 if planes else 0
    drawn = {*alone[:MOST], *(name for plane in planes[:MOST] for name in plane)}
    others = dict.fromkeys(series.variable for series in measured if series.variable not in drawn)
    for name in [*alone[:MOST], *others]:
        layout.series([name], first)
    if strip.y:
        layout.strip(strip, first)
    return layout


def _coordinates(fmu: Fmu) -> Iterator[tuple[str, str]]:
    """Coordinates with their velocities: states whose rate depends on one other state and on nothing else."""
    for rate in fmu.description.derivatives:
        behind = [str(variable.name) for variable in rate.dependencies or ()]
        state = rate.variable.derivative if rate.variable else None
        if state is not None and len(behind) == 1 and behind[0] in fmu.states and behind[0] != state.name:
            yield str(state.name), behind[0]


def _chosen(trajectory: Trajectory, plots: Sequence[str], strip: Panel) -> PanelLayout:
    """What was asked for: series with a panel for each unit, then portraits side by side."""
    layout, portraits = PanelLayout(), []
    for text in plots:
        x, colon, y = text.partition(":")
        names = [name.strip() for name in (y if colon else x).split(",")]
        if not all((x.strip(), *names)) or (colon and (len(names) > 1 or ":" in y)):
            raise StickslipError(f"A plot is x,v (both over time) or x:v (v over x); found '{text}'.")
        for name in (x.strip(), *names) if colon else names:
            trajectory[name]
        if colon:
            portraits.append(Panel((names[0],), x.strip()))
        else:
            for unit in dict.fromkeys(_unit(trajectory, name) for name in names):
                layout.series([name for name in names if _unit(trajectory, name) == unit])
    if layout.cells and strip.y:
        layout.strip(strip)
    for i in range(0, len(portraits), ABREAST):
        layout.portraits(portraits[i : i + ABREAST])
    return layout


def _spells(trajectory: Trajectory, fmus: Mapping[str, Fmu]) -> Spells:
    """When contacts stick, slide along a switch or are closed; only what occurs."""
    spells: Spells = {kind: {} for kind in SHADES}
    contacts = [(unit, fmu, contact) for unit, fmu in fmus.items() if fmu.ours for contact in fmu.contacts]
    for unit, fmu, contact in contacts:
        name = f"{unit}{contact}"
        declared = fmu.variables[f"{contact}_state"].declaredType
        if f"{name}_state" not in trajectory.values or declared is None:
            continue
        state = trajectory[f"{name}_state"]
        kind, states = BY_TYPE_NAME[str(declared.name)].spell
        when = np.isin(state, list(states))
        if when.any():
            spells[kind][name] = when
    return {kind: contacts for kind, contacts in spells.items() if contacts}


def _draw_series(
    axes: Axes,
    panel: Panel,
    trajectory: Trajectory,
    spells: Spells,
    measured: Sequence[MeasuredVariable],
    fmu: Fmu | None,
) -> None:
    first = panel.y[0]
    for i, name in enumerate(panel.y):
        color = COLOURS[i % len(COLOURS)] if len(panel.y) > 1 else "black"
        if trajectory[name].dtype.kind not in "iu":
            axes.plot(trajectory.time, trajectory[name], color=color, linewidth=0.9, label=symbol(name))
        for series in measured:
            if series.variable == name:
                dots = {**DOTS, "label": f"{symbol(name)}, measured"}
                axes.plot(series.time, series.value, **dots, rasterized=series.time.size > MANY)
    _draw_states(axes, panel, trajectory, fmu)
    for kind, contacts in spells.items():
        for start, end in _intervals(trajectory.time, np.any(list(contacts.values()), axis=0)):
            axes.axvspan(start, end, color=SHADES[kind], linewidth=0, zorder=0)
    if len(panel.y) > 1:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, borderaxespad=0.3)
    axes.set_ylabel(_unit(trajectory, first) if len(panel.y) > 1 else _label(trajectory, first))


def _draw_states(axes: Axes, panel: Panel, trajectory: Trajectory, fmu: Fmu | None) -> None:
    """Integers in steps; of a model, in which state its contacts are from event to event, each in its word."""
    words: dict[int, str] = {}
    for i, name in enumerate(panel.y):
        if trajectory[name].dtype.kind not in "iu":
            continue
        color, contact = COLOURS[i % len(COLOURS)] if len(panel.y) > 1 else "black", name.removesuffix("_state")
        times, states = trajectory.time, trajectory[name]
        if fmu is not None and fmu.ours and contact in fmu.contacts:
            words |= BY_TYPE_NAME[str(getattr(fmu.variables[name].declaredType, "name", ""))].state_words
            events = [event for event in trajectory.events if event.contact == contact]
            times = np.array([times[0], *(event.time for event in events), times[-1]])
            states = np.array([events[0].before if events else states[0], *(event.after for event in events)])
            states = np.append(states, states[-1])
            axes.plot(times[1:-1], states[1:-1], "o", color=color, markersize=3)
        axes.plot(times, states, color=color, linewidth=0.9, drawstyle="steps-post", label=name)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if words:
        axes.set_yticks(list(words), list(words.values()))


def _draw_portrait(
    axes: Axes, panel: Panel, trajectory: Trajectory, spells: Spells, measured: Sequence[MeasuredVariable]
) -> None:
    x_name, (y_name,) = str(panel.x), panel.y
    x, y = trajectory[x_name], trajectory[y_name]
    axes.plot(x, y, color="black", linewidth=0.9)
    axes.plot(x[0], y[0], "o", color="black", markersize=4)
    pairs = [(a, b) for a in measured for b in measured if (a.variable, b.variable) == (x_name, y_name)]
    for across, up in pairs:
        if across.source == up.source:
            times, first, second = np.intersect1d(across.time, up.time, return_indices=True)
            axes.plot(across.value[first], up.value[second], **DOTS, rasterized=times.size > MANY)
    for kind, contacts in spells.items():
        when = np.any(list(contacts.values()), axis=0)
        axes.plot(np.where(when, x, np.nan), np.where(when, y, np.nan), color=SHADES[kind], linewidth=5, zorder=1)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.set(xlabel=_label(trajectory, x_name), ylabel=_label(trajectory, y_name))


def _draw_strip(axes: Axes, trajectory: Trajectory, spells: Spells, contacts: Sequence[str]) -> None:
    """One line per contact."""
    for kind, of_kind in spells.items():
        for name, when in of_kind.items():
            spans = [(start, end - start) for start, end in _intervals(trajectory.time, when)]
            row = len(contacts) - 1 - contacts.index(name)
            axes.broken_barh(spans, (row - 0.35, 0.7), color=SHADES[kind], edgecolor="0.5", linewidth=0.3)
    axes.set_yticks(range(len(contacts)), contacts[::-1])
    axes.set_ylim(-0.6, len(contacts) - 0.4)


def _intervals(time: NDArray[np.float64], when: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Stretches in which something is so, from the first such sample to the first other one, s."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], when.astype(int), [0]])))
    ends = np.minimum(edges[1::2], len(time) - 1)
    return [(float(time[first]), float(time[end])) for first, end in zip(edges[::2], ends, strict=True)]


def _head(figure: Figure, title: str, spells: Spells, *, portraits: bool, measured: bool) -> None:
    """The title, and what the marks mean."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    marks: list[Any] = [Patch(facecolor=SHADES[kind], edgecolor="0.5", linewidth=0.3, label=kind) for kind in spells]
    if portraits:
        marks.insert(0, Line2D([], [], marker="o", linestyle="", color="black", markersize=4, label="start"))
    if measured:
        marks.append(Line2D([], [], **{**DOTS, "markersize": 6}))
    if marks:
        figure.legend(handles=marks, loc="outside upper right", ncols=len(marks), frameon=False)
    figure.suptitle(title, x=0.02, ha="left")


def _unit(trajectory: Trajectory, name: str) -> str:
    return "s" if name == "time" else trajectory.units[name]


def _label(trajectory: Trajectory, name: str) -> str:
    return axis_label(name, {name: _unit(trajectory, name)})
