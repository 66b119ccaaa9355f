"""Loops in tables and words, and drawn: measured, by sliders and by the best law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.console import plain
from fmu_models.base.table import PrintedColumn, PrintedTable, number, table
from identification.hysteresis.loop import LoopLog
from identification.hysteresis.result import HysteresisFit
from identification.report.calibration_summary import values_table
from identification.report.slip_report import BLUE, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from rich.console import Group

MOST_CYCLES = 12  # rows


def hysteresis_report(fit: HysteresisFit) -> Group:
    """Everything that is said of loops."""
    from rich.console import Group

    loops = fit.record()
    at = f", where {' and '.join(fit.spectrum.factors)} = 0" if fit.spectrum.factors else ""
    shown = [plain(f"Hysteresis of {', '.join(fit.names)}", "bold"), *loop_tables(loops, at)]
    if fit.laws and fit.laws[0].calibration is not None:
        at = "" if fit.load is None else f", at a load of {fit.load:.4g} N"
        shown += [plain(f"{fit.laws[0].name}{at}", "bold"), values_table(fit.laws[0].calibration)]
        shown.append(plain(f"As Python: {fit.laws[0].declaration}"))
    notes = [*fit.notes, *(f"{law.name}: {note}" for law in fit.laws for note in (*law.notes, law.why) if note)]
    return Group(*shown, *(plain(f"- {note}") for note in notes))


def _units(load: float | None) -> tuple[str, str]:
    """Of stiffness and force of the sliders."""
    return ("N/m", "N") if load is None else ("1/m", "of the load")


def loop_tables(loops: Mapping[str, Any], at: str = "") -> list[PrintedTable]:
    """Sliders, cycles and laws beside one another of a result in plain values (``HysteresisFit.record``); at: which of
    the sliders, where their stiffness changes."""
    return [_sliders_table(loops, at), _cycles_table(loops["cycles"]), *([_laws_table(loops)] if loops["laws"] else [])]


def _sliders_table(loops: Mapping[str, Any], at: str) -> PrintedTable:
    """What the sliders say, without a choice of a law."""
    stiffness, force = _units(loops["load"])
    rows = [
        ["stiffness of what gives way", number(loops["stiffness"], ".4g"), stiffness],
        ["its sliding force", number(loops["sliding_force"], ".4g"), force],
        ["spring beside", number(loops["spring_beside"], ".4g"), "N/m"],
        *(
            [f"left of {name}{held}", number(100 * left, ".3g"), "% of the force"]
            for held, key in (("", "left"), (" (held out)", "left_out"))
            for name, left in loops[key].items()
        ),
    ]
    return table(f"Sliders{at}", ["of", "value", "unit"], rows)


def _cycles_table(cycles: Sequence[Mapping[str, Any]]) -> PrintedTable:
    """Energy a cycle, equivalent stiffness and damping, by amplitude."""
    shown = cycles if len(cycles) <= MOST_CYCLES else cycles[:: -(-len(cycles) // MOST_CYCLES)]
    keys = {"amplitude": ".4g", "count": "d", "work": ".4g", "stiffness": ".4g", "damping_ratio": ".3g"}
    rows = [[cycle["log"], *(number(cycle[key], style) for key, style in keys.items())] for cycle in shown]
    columns = [
        "log",
        PrintedColumn("amplitude", "m"),
        PrintedColumn("cycles", spare=1),
        PrintedColumn("energy a cycle", "J"),
    ]
    columns += [PrintedColumn("equivalent stiffness", "N/m"), PrintedColumn("equivalent damping ratio", spare=2)]
    return table("Cycles", columns, rows)


def _laws_table(loops: Mapping[str, Any]) -> PrintedTable:
    """Laws beside one another, the best first."""
    rows = []
    for law in loops["laws"]:
        parts = [*(law["left"].get(name) for name in loops["left"]), *map(law["held_out"].get, loops["left_out"])]
        cells = (number(None if part is None else 100 * part, ".3g") for part in parts)
        rows.append([law["name"], number(len(law["parameters"]), "d"), *cells])
    heads = [PrintedColumn(f"left of {name}", "%") for name in loops["left"]]
    heads += [PrintedColumn(f"left of {name}, held out", "%") for name in loops["left_out"]]
    return table("Laws, each beside a spring and an offset", ["law", "parameters", *heads], rows)


def hysteresis_figure(fit: HysteresisFit) -> Figure:
    """Each log's loop, and the virgin curve of the sliders."""
    from matplotlib.figure import Figure

    logs = (*fit.logs, *fit.held_out)
    columns = min(len(logs) + 1, 3)
    rows = -(-(len(logs) + 1) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.8 * rows), layout="constrained")
    for place, log in enumerate(logs):
        axes = figure.add_subplot(rows, columns, place + 1)
        _draw_loop(fit, log, axes)
        axes.set_title(f"{log.name}{', held out' if log in fit.held_out else ''}", fontsize="medium")
    axes = figure.add_subplot(rows, columns, len(logs) + 1)
    way, force = fit.spectrum.backbone()
    axes.plot(way, force, color="black", linewidth=1.6)
    axes.set(xlabel="way from rest (m)", ylabel=f"force ({_units(fit.load)[1]})", title="virgin curve of the sliders")
    axes.grid(alpha=0.25)
    figure.axes[0].legend(fontsize="small")
    return figure


def draw_hysteresis(fit: HysteresisFit, axes: Axes) -> None:
    """The loop of the first log."""
    _draw_loop(fit, fit.logs[0], axes)
    axes.legend(fontsize="small")


def _draw_loop(fit: HysteresisFit, log: LoopLog, axes: Axes) -> None:
    axes.plot(log.way, log.force, color=BLUE, linewidth=1.4, label="measured")
    axes.plot(log.way, fit.spectrum.force(log), color="black", linewidth=0.9, linestyle="--", label="sliders")
    best = next((law for law in fit.laws if law.calibration is not None), None)
    if best is not None and best.calibration is not None and log in fit.logs:
        number = fit.logs.index(log)
        run = best.calibration.free_run(number)
        time = np.asarray(run.time)
        way = best.calibration.log(number).inputs["way"].piece(time)[0]  # type: ignore[union-attr]
        axes.plot(way, run["force"], color=RED, linewidth=0.9, linestyle=":", label=best.name)
    axes.set(xlabel="way (m)", ylabel="force (N)")
    axes.grid(alpha=0.25)
