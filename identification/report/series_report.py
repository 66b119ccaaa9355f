"""A measured series in words, and drawn: itself, its spectrum, how neighbours part, its dimension, its recurrence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.console import plain
from fmu_models.base.record import record
from fmu_models.base.table import number, table
from identification.report.slip_report import BLUE, GREY, RED
from identification.series.rhythm import spectrum

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from rich.console import Group

    from identification.series.analyse import SeriesInvariants

SHOWN = 30  # cycles of a series that are drawn


def series_report(found: SeriesInvariants) -> Group:
    """The verdict, why, and every number."""
    from rich.console import Group

    per = f"1/{found.series.unit}" if found.series.unit != "1" else "1"
    rows = [[f"exponent, {name}", one["value"], one["error"], per] for name, one in found.methods.items()]
    if found.dimension:
        rows.append(["correlation dimension", found.dimension.value, found.dimension.error, "1"])
    if found.zero_one:
        rows.append(["0-1 test, K", *found.zero_one, "1"])
    if found.surrogates:
        rows += [["error of prediction over surrogates'", found.surrogates[1], None, "1"]]
        rows += [["surrogates foretold as well", 100 * found.surrogates[0], None, "%"]]
    for name, value in (record(found.recurrence) or {}).items():
        rows.append([f"recurrence: {name.replace('_', ' ')}", float(value), None, "1"])
    rows += [["cycle", found.cycle, None, found.series.unit], ["cycles", found.cycles, None, "1"]]
    if len(found.returns) > 2:
        steps = np.diff(found.returns)
        rows.append(["return to the mean, upwards", float(steps.mean()), float(steps.std()), found.series.unit])
    state = found.reconstruction
    rows += [["delay", state.delay * found.series.step, None, found.series.unit]]
    rows += [["dimension, by false neighbours", float(state.dimension), None, "1"]]
    rows += [["noise", 100 * state.noise, None, "% of the rms"]]
    cells = [[name, number(value, ".4g"), number(error, ".2g"), unit] for name, value, error, unit in rows]
    heading = plain(f"{found.series.name}: {found.sentence}", "bold")
    wanted = [] if found.needed is None else [f"Intervals of 10 % need about {found.needed} cycles."]
    notes = [found.why, *(wanted if found.verdict != "too short" else []), *found.series.notes]
    shown = table("Invariants, with standard deviations", ["of", "value", "sd", "unit"], cells)
    return Group(heading, *(plain(f"- {note}") for note in notes), shown)


def series_figure(found: SeriesInvariants) -> Figure:
    """Six panels: series, spectrum, delay portrait, parting of neighbours with plateaus, dimension, recurrence."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 7.5), layout="constrained")
    axes = figure.subplots(2, 3)
    figure.suptitle(f"{found.series.name}: {found.sentence}", fontsize="medium")
    _draw_series(found, axes[0, 0])
    frequencies, power = spectrum(found.series.values)
    axes[0, 1].semilogy(frequencies[1:] / found.series.step, power[1:], color=BLUE, linewidth=0.6)
    axes[0, 1].set_xlim(0, min(6 / found.cycle, frequencies[-1] / found.series.step))
    axes[0, 1].set(xlabel=f"frequency (1/{found.series.unit})", ylabel="power, parts of all")
    delay = found.reconstruction.delay
    line = "." if found.cycle <= 4 * found.series.step else "-"
    x = found.series.values[-20000:]
    axes[0, 2].plot(x[:-delay], x[delay:], line, color=BLUE, linewidth=0.3, markersize=1)
    axes[0, 2].set(xlabel="x(t)", ylabel=f"x(t + {delay * found.series.step:.3g} {found.series.unit})")
    draw_divergence(found, axes[1, 0])
    if found.dimension:
        axes[1, 1].semilogx(found.dimension.radii, found.dimension.slopes, color=BLUE)
        axes[1, 1].axvspan(*found.dimension.plateau, color=GREY, alpha=0.2)
        axes[1, 1].axhline(found.dimension.value, color=RED, linewidth=0.9)
        axes[1, 1].set(xlabel="distance, parts of the rms", ylabel="slope of the correlation sum", ylim=(0, 4))
    if found.recurrence:
        plot = found.recurrence
        last = len(plot.matrix) * plot.every * found.series.step
        axes[1, 2].imshow(plot.matrix, cmap="Greys", origin="lower", extent=(0, last, 0, last), interpolation="nearest")
        axes[1, 2].set(xlabel=f"t ({found.series.unit})", ylabel="t", title=f"recurrence, {100 * plot.rate:.2g} %")
    for one in axes.flat[:5]:
        one.grid(alpha=0.25)
    return figure


def _draw_series(found: SeriesInvariants, axes: Axes) -> None:
    """A stretch at the end; of a transient the whole."""
    series = found.series
    shown = len(series.values) if found.end else min(int(SHOWN * found.cycle / series.step), len(series.values))
    time = series.step * np.arange(len(series.values))[-shown:]
    axes.plot(time, series.values[-shown:], "." if found.cycle <= 4 * series.step else "-", color=BLUE, linewidth=0.8)
    if found.end:
        axes.axvline(found.end, color=RED, linewidth=0.9)
    axes.set(xlabel=f"t ({series.unit})", ylabel=series.name.split(": ")[-1])


def draw_divergence(found: SeriesInvariants, axes: Axes) -> None:
    """Mean logarithms of distance with the plateaus that were read, and the slope of the exponent beside them."""
    for one, color in zip(found.divergences, (BLUE, RED), strict=False):
        time = one.lags * found.series.step
        axes.plot(time, one.curve, color=color, linewidth=0.9, label=one.method)
        inside = (one.lags >= one.plateau[0]) & (one.lags <= one.plateau[1])
        axes.plot(time[inside], one.curve[inside], color=color, linewidth=2.6)
    if found.exponent is not None and found.divergences:
        one = found.divergences[0]
        first, last = (edge * found.series.step for edge in one.plateau)
        level = float(np.interp(first, one.lags * found.series.step, one.curve))
        rise = found.exponent * (last - first)
        axes.plot([first, last], [level, level + rise], "k--", linewidth=0.9, label="local maps")
    axes.set(xlabel=f"t ({found.series.unit})", ylabel="mean ln of distance")
    if found.divergences:
        axes.legend(fontsize="small")
