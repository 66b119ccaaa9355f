"""Work-precision diagram: error against wall time and against right-hand sides, as SVG."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from fmu_models.validation.bench.run import MethodComparison, MethodRow

MARKERS = {"event-driven": "o", "switch model": "s", "smoothing": "^", "time-stepping": "D"}
LINES = ("-", "--", ":", "-.")
TINIEST = 1e-17  # where an error of exactly zero is drawn
LARGEST = 1e2  # and one of another motion


def draw(comparison: MethodComparison) -> Figure:
    """Error over seconds, error over right-hand sides, and error of event times over seconds."""
    figure = Figure(figsize=(15.5, 6.2), layout="constrained")
    axes = figure.subplots(1, 3)
    names = list(dict.fromkeys(row.method for row in comparison.rows))
    colors = mpl.colormaps["tab20"]
    seen: Counter[str] = Counter()
    for k, name in enumerate(names):
        rows = [row for row in comparison.rows if row.method == name]
        family = rows[0].family
        style: dict[str, Any] = {"color": colors(k % 20), "marker": MARKERS[family], "markersize": 5}
        # those of a family share its mark; line and filling tell them apart where colours do not
        style |= {"linestyle": LINES[seen[family] % len(LINES)]}
        style |= {"markerfacecolor": "white"} if seen[family] % 2 else {}
        seen[family] += 1
        for axis, points in zip(axes, _points(rows), strict=True):
            axis.plot(*zip(*points, strict=True), linewidth=1.0, label=name, **style) if points else None
    for axis, cost in zip(axes, ("wall time (s)", "right-hand sides (1)", "wall time (s)"), strict=True):
        axis.set(xscale="log", yscale="log", xlabel=cost)
        axis.grid(True, which="major", color="0.9", linewidth=0.6)
    floor = comparison.own_error
    if math.isfinite(floor):
        for axis in axes[:2]:
            axis.axhspan(
                TINIEST / 10, 3.0 * max(floor, TINIEST), color="0.92", zorder=0, label="error of the reference, times 3"
            )
            axis.set_ylim(bottom=max(TINIEST, min([floor, *(row.error for row in comparison.rows)])) / 3)
    for axis in axes[:2]:
        axis.set_ylabel("error of the end state (in nominal values, 1)")
    axes[2].set_ylabel("largest error of an event time (s)")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=10)
    figure.suptitle(f"{comparison.title}: {comparison.stop_time:g} s")
    return figure


def _points(rows: Sequence[MethodRow]) -> tuple[list[tuple[float, float]], ...]:
    """Pairs of cost and error for the three axes."""
    errors = [min(LARGEST, max(TINIEST, row.error if math.isfinite(row.error) else LARGEST)) for row in rows]
    time = [(row.seconds, error) for row, error in zip(rows, errors, strict=True)]
    work = [(float(row.evaluations), error) for row, error in zip(rows, errors, strict=True) if row.evaluations]
    events = [
        (row.seconds, max(TINIEST, row.events.time))
        for row in rows
        if row.events is not None and row.events.time is not None and row.events.missed == 0
    ]
    return time, work, events
