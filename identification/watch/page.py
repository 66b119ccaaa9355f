"""The page of a watch: parameters against time with their intervals and control limits, and what was called."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import like_sd
from fmu_models.base.files import write_whole
from fmu_models.base.table import Cell, PrintedColumn, PrintedTable
from fmu_models.base.table import table as made_table
from fmu_models.report.document import bullets, document, drawing, paragraph
from identification.laws import find_law
from identification.watch.chart import control_chart
from identification.watch.state import FITTED, Entry, WatchState

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AGAIN = '<p><label><input type="checkbox" id="again"> load this page anew every {seconds} s</label></p>'
RELOAD = """
const again = document.getElementById("again");
again.checked = sessionStorage.getItem("again") !== "no";
again.onchange = () => sessionStorage.setItem("again", again.checked ? "yes" : "no");
setInterval(() => again.checked && location.reload(), 1000 * %d);
"""
SHOWN = 200  # logs in the table


def names(state: WatchState) -> list[str]:
    """Names of the values that the logs give, in order."""
    return list(dict.fromkeys(name for entry in state.fitted() for name in entry.values))


def watch_table(state: WatchState, last: int = SHOWN) -> PrintedTable:
    """The logs, the latest first, with their values and what was called."""
    columns = names(state)
    rows = []
    for entry in sorted(state.entries, key=lambda entry: -entry.recorded)[:last]:
        cells = [Cell(like_sd(*entry.values[name]) if name in entry.values else "", "number") for name in columns]
        remark = "; ".join(entry.calls) or entry.reason
        status = Cell(entry.status, "text" if entry.status != "refused" else "fail")
        time = datetime.datetime.fromtimestamp(entry.recorded, datetime.UTC).strftime("%Y-%m-%d %H:%M:%S")
        rows.append([time, entry.name, status, *cells, Cell(remark, "fail" if entry.calls else "text")])
    heads = (PrintedColumn(name, _unit(state, name)) for name in columns)
    return made_table("Logs, the latest first", ("time (UTC)", "log", "result", *heads, "called"), rows)


def watch_figure(state: WatchState) -> Figure:
    """Each value against time: points with 95 % intervals (noise: the rig is one), EWMA with its limits."""
    from matplotlib.figure import Figure

    columns = names(state)
    figure = Figure(figsize=(8.0, 2.0 * max(len(columns), 1) + 0.4), layout="constrained")
    axes = np.atleast_1d(figure.subplots(max(len(columns), 1), 1, sharex=True))
    for panel, name in zip(axes, columns, strict=False):
        entries = [entry for entry in state.fitted() if name in entry.values]
        _draw(panel, name, entries)
        unit = _unit(state, name)
        panel.set_ylabel(f"{name} ({unit})" if unit else name)
    axes[-1].set_xlabel("time (UTC)")
    figure.autofmt_xdate()
    return figure


def _draw(panel, name: str, entries: Sequence[Entry]) -> None:  # type: ignore[no-untyped-def]
    at = [datetime.datetime.fromtimestamp(entry.recorded, datetime.UTC) for entry in entries]
    value, sd = (np.array([entry.values[name][i] for entry in entries]) for i in (0, 1))
    chart = control_chart(value, sd)
    panel.errorbar(at, value, 1.96 * sd, fmt="o", markersize=3.5, color="#0072b2", capsize=2, label="log, 95 % (noise)")
    panel.plot(at, chart.level, color="#d55e00", label="EWMA")
    panel.fill_between(at, chart.low, chart.high, color="0.85", label="limits")
    if chart.out.any():
        out = np.flatnonzero(chart.out)
        panel.plot([at[i] for i in out], value[out], "s", markersize=8, mfc="none", color="#d55e00", label="out")
    panel.legend(fontsize="small", ncols=4, loc="best")


def write_page(path: Path, state: WatchState, folder: Path, refresh: float) -> None:
    """Write the page, whole or not at all; a browser loads it anew every ``refresh`` s, unless its reader says no."""
    count = sum(entry.status == FITTED for entry in state.entries)
    date = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    calls = [f"{entry.name}: {call}" for entry in state.entries for call in entry.calls]
    caption = (
        "Each value against time, its limits (grey band), their running mean (line), logs that left them (squares)"
    )
    drawn = [drawing(watch_figure(state), "watch", caption)] if count else []
    verdict = f"{len(calls)} called, the latest last:" if calls else "Nothing was called."
    main = [paragraph(verdict, "verdict"), bullets(calls, "warning"), *drawn, watch_table(state).html()]
    seconds = max(round(refresh), 1)
    main.append(AGAIN.format(seconds=seconds))
    about = f"{count} logs fitted with the law {state.law}; as of {date}"
    text = document(str(folder), about, main, tail=f"<script>{RELOAD % seconds}</script>\n")
    with write_whole(path, overwrite=True) as temporary:
        temporary.write_text(text, "utf-8")


def _unit(state: WatchState, name: str) -> str:
    """Of a value; nothing where it has none."""
    known = {one.name: one.unit for one in find_law(state.law).parameters}
    unit = known.get(name, known.get(name.rstrip("0123456789"), "1"))
    return "" if unit == "1" else unit
