"""Slip statistics for a terminal (rich), and the figure of slip events in time and their distributions.

matplotlib is imported only here, inside the functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.console import plain
from fmu_models.base.digits import deviation
from fmu_models.base.table import table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Group, RenderableType

    from identification.slips.block_on_belt import SlipModel
    from identification.slips.events import SlipEvents
    from identification.slips.statistics import SlipStatistics


def slip_report(statistics: SlipStatistics, model: SlipModel | None, missing: str = "") -> Group:
    """Statistics of slip events, and the model beside them, or why there is none."""
    from rich.console import Group

    statistic_rows = (
        ("peak friction, median", statistics.peak, "1"),
        ("after slip, median", statistics.after, "1"),
        ("drop, median", statistics.drop, "1"),
        ("period, mean", statistics.period, "s"),
        ("slip time, median", statistics.slip_time, "s"),
    )
    shown = table(
        f"{statistics.events} slip events ({statistics.definition}) of {statistics.log}",
        ("", ">value", ">95 %", ">sd of one", "unit"),
        [
            [name, f"{one.value:.4g}", f"{one.low:.4g} .. {one.high:.4g}", deviation(one.spread), unit]
            for name, one, unit in statistic_rows
        ],
    )
    parts: list[RenderableType] = [plain(statistics.title, "bold"), plain(f"{statistics.source}\n"), shown]
    parts.append(
        plain(
            f"Period varies by {100 * statistics.period_variation:.2g} %. Noise {statistics.noise:.2g}, least drop "
            f"counted {statistics.threshold:.3g}."
        )
    )
    if model:
        rows = []
        for prediction in model.predictions:
            mark = "fitted" if prediction.fitted else "in the 95 % interval" if prediction.inside else "outside"
            row = (f"{prediction.measured:.4g}", f"{prediction.modelled:.4g}", f"{prediction.ratio:.3f}", mark)
            rows.append([f"{prediction.name}{'' if prediction.unit == '1' else f', {prediction.unit}'}", *row])
        title, columns = "Block on a belt with the slider's constants", ("", ">measured", ">model", ">ratio", "")
        values = f"mu_s = {model.mu_s:.4g}, mu_k = {model.mu_k:.4g}, p = {model.p:.3g} s/m assumed"
        parts += [table(title, columns, rows), plain(f"{values}. {model.verdict}")]
    parts += [plain(f"No model beside it. {missing}")] if missing else []
    parts += [plain(f"- {verdict}") for verdict in statistics.verdicts]
    return Group(*parts)


BLUE, RED, GREY = "#0072b2", "#d55e00", "#777777"


def slip_figure(statistics: SlipStatistics, events: SlipEvents, model: SlipModel | None) -> Figure:
    """Friction in time with peaks and after-slip values, a stretch of it, and histograms."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    grid = figure.add_gridspec(2, 6)
    whole, part = figure.add_subplot(grid[0, :3]), figure.add_subplot(grid[0, 3:])
    middle = len(events.time) // 2
    last = min(middle + 4, len(events.time) - 1)
    begin, end = events.time[max(middle - 4, 0)], events.end[last] + float(np.median(np.diff(events.time))) / 4
    inside = (events.smooth_time >= begin) & (events.smooth_time <= end)
    every = max(len(events.smooth) // 20000, 1)
    whole.plot(events.smooth_time[::every], events.smooth[::every], color=GREY, linewidth=0.5)
    part.plot(events.smooth_time[inside], events.smooth[inside], color=GREY, linewidth=1.0)
    for axes, chosen in ((whole, slice(None)), (part, slice(max(middle - 4, 0), middle + 5))):
        axes.plot(events.time[chosen], events.peak[chosen], "^", color=BLUE, markersize=3, label="peak")
        axes.plot(events.end[chosen], events.after[chosen], "v", color=RED, markersize=3, label="after slip")
        axes.set(xlabel="time (s)", ylabel="force over weight (1)")
    figure.legend(
        *part.get_legend_handles_labels(), loc="outside upper right", ncols=2, fontsize="small", frameon=False
    )
    lines = {prediction.name: prediction.modelled for prediction in model.predictions} if model else {}
    histograms = (
        ("peak friction", events.peak, statistics.peak.value, "1"),
        ("friction after slip", events.after, statistics.after.value, "1"),
        ("period", events.interval[np.isfinite(events.interval)], statistics.period.value, "s"),
    )
    for place, (name, values, centre, unit) in enumerate(histograms):
        axes = figure.add_subplot(grid[1, 2 * place : 2 * place + 2])
        axes.hist(values, bins="auto", color="#c6dbef", edgecolor=BLUE)
        axes.axvline(centre, color=BLUE, linewidth=1.6, label=f"measured {centre:.4g}")
        if name in lines:
            axes.axvline(lines[name], color="black", linestyle="--", linewidth=1.6, label=f"model {lines[name]:.4g}")
        axes.set(xlabel=f"{name} ({unit})", ylabel="slip events")
        axes.locator_params(axis="x", nbins=5)
        axes.locator_params(axis="y", integer=True)
        axes.legend(fontsize="small", frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    figure.suptitle(f"{statistics.title}: {statistics.events} slip events")
    return figure
