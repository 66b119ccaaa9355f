"""Logs beside a calibrated model: in time, what is left, and as portraits of a variable and its rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.simulation.signal import Signal
from identification.calibration.follow import FollowedLog
from identification.calibration.log import ModelLog
from identification.calibration.nodes import local_motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE = "#0072b2"
ROWS = 8  # log and variable, at most


def followed_figure(followed: Sequence[FollowedLog]) -> Figure:
    """A row for each variable of each log: time, residual over time, portrait."""
    from matplotlib.figure import Figure

    rows = [(log, name) for log in followed for name in log.modelled][:ROWS]
    figure = Figure(figsize=(12.0, 0.6 + 2.4 * max(len(rows), 1)), layout="constrained")
    panels = figure.subplots(max(len(rows), 1), 3, squeeze=False, gridspec_kw={"width_ratios": (2, 1.3, 1)})
    for (one, name), (time, left, portrait) in zip(rows, panels, strict=False):
        draw_time(time, one, name)
        _draw_residual(left, one, name)
        draw_portrait(portrait, one, name)
    if rows:
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower left", ncols=2, frameon=False)
    return figure


def _unit(one: FollowedLog, name: str) -> str:
    return next(line.unit for line in one.residuals if line.variable == name)


def draw_time(axes: Axes, one: FollowedLog, name: str) -> None:
    """A measured variable over time, and the model's."""
    log, modelled = one.log, one.modelled[name].copy()
    for begin in one.begins[1:]:
        modelled[np.searchsorted(log.time, begin)] = np.nan  # a run of its own begins here
    axes.plot(log.time, log.measured[name], ".", color="0.6", markersize=3, label="measured")
    axes.plot(log.time, modelled, color=BLUE, linewidth=0.9, label="model")
    axes.set_title(log.name, fontsize="medium", loc="left")
    axes.set(xlabel="time (s)", ylabel=f"{name} ({_unit(one, name)})")
    axes.grid(alpha=0.25)


def _draw_residual(axes: Axes, one: FollowedLog, name: str) -> None:
    axes.plot(one.log.time, one.log.measured[name] - one.modelled[name], ".", color="black", markersize=2)
    axes.axhline(0.0, color="0.5", linewidth=0.8)
    axes.set(xlabel="time (s)", ylabel=f"{name}: measured less model ({_unit(one, name)})")
    axes.grid(alpha=0.25)


def draw_portrait(axes: Axes, one: FollowedLog, name: str) -> None:
    """Both by the same local parabolas, which blur them alike; or over the input that the log is drawn over."""
    log, kept = one.log, np.isfinite(one.modelled[name])
    unit = _unit(one, name)
    if isinstance(driven := log.inputs.get(log.over), Signal):
        way = driven.piece(log.time)[0]
        axes.plot(way, log.measured[name], color="0.6", linewidth=2.4)
        axes.plot(way, one.modelled[name], color=BLUE, linewidth=0.9)
        axes.set(xlabel=log.over, ylabel=f"{name} ({unit})")
        axes.grid(alpha=0.25)
        return
    for values, colour, width in ((log.measured[name], "0.6", 2.4), (one.modelled[name], BLUE, 0.9)):
        part = ModelLog(log.name, log.time[kept], {name: values[kept]})
        motion, _ = local_motion(part, np.arange(part.time.size))
        axes.plot(motion.value[name], motion.speed[name], color=colour, linewidth=width)
    axes.set(xlabel=f"{name} ({unit})", ylabel=f"its rate ({unit}/s)" if unit != "1" else "its rate (1/s)")
    axes.grid(alpha=0.25)
