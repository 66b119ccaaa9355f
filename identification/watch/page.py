"""The page of a watch: parameters against time with their intervals and control limits, and what was called."""

from __future__ import annotations

import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import like_sd
from fmu_models.base.files import write_whole
from fmu_models.base.table import Cell, PrintedColumn, PrintedTable
from fmu_models.base.table import table as made_table
from fmu_models.report.document import bullets, document, glance, paragraph
from identification.laws import find_law
from identification.watch.chart import control_chart
from identification.watch.state import FITTED, WatchState

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


def draw_value(state: WatchState, name: str, axes: Axes) -> None:
    """A value against time: points with 95 % intervals (noise: the rig is one), EWMA with its limits."""
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter, date2num

    entries = [entry for entry in state.fitted() if name in entry.values]
    at = date2num([datetime.datetime.fromtimestamp(entry.recorded, datetime.UTC) for entry in entries])
    value, sd = (np.array([entry.values[name][i] for entry in entries]) for i in (0, 1))
    chart = control_chart(value, sd)
    axes.errorbar(at, value, 1.96 * sd, fmt="o", markersize=3.5, color="#0072b2", capsize=2, label="log, 95 % (noise)")
    axes.plot(at, chart.level, "--", color="#d55e00", label="EWMA")
    axes.fill_between(at, chart.low, chart.high, color="0.85", label="limits")
    if chart.out.any():
        out = np.flatnonzero(chart.out)
        axes.plot(at[out], value[out], "s", markersize=8, mfc="none", color="#d55e00", label="out")
    locator = AutoDateLocator(minticks=2, maxticks=5)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    unit = _unit(state, name)
    axes.set(xlabel="time (UTC)", ylabel=f"{name} ({unit})" if unit else name)
    axes.legend(fontsize="small", ncols=2, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def write_page(path: Path, state: WatchState, folder: Path, refresh: float) -> None:
    """Write the page, whole or not at all; a browser loads it anew every ``refresh`` s, unless its reader says no."""
    count = sum(entry.status == FITTED for entry in state.entries)
    date = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    calls = [f"{entry.name}: {call}" for entry in state.entries for call in entry.calls]
    caption = "{}: logs with 95 % intervals, their running mean (dashed), its limits (grey), logs beyond (squares)."
    drawn = glance([(partial(draw_value, state, name), caption.format(name)) for name in names(state)])
    verdict = f"{len(calls)} called, the latest last:" if calls else "Nothing was called."
    main = [paragraph(verdict, "verdict"), bullets(calls, "warning"), drawn, watch_table(state).html()]
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
