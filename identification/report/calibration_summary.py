"""A calibration in tables and words, and its residuals beside the log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.console import plain
from fmu_models.base.table import Table, known_to, number, sd, table
from identification.calibration.conclude import MISTRUSTED
from identification.calibration.result import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Group


def calibration_report(found: Calibration) -> Group:
    """Everything that a calibration says."""
    from rich.console import Group

    notes = [*found.directions, *_minima(found), *found.warnings]
    parts = [values_table(found), residuals_table(found), plain(_meaning(found))]
    return Group(plain(found.title, "bold"), *parts, *(plain(f"- {note}") for note in notes))


def values_table(found: Calibration) -> Table:
    """Parameters, sensors, then start states."""
    rows = []
    for one in (*found.parameters, *found.starts):
        low, high = found.interval(one.name)
        told = one.standard_deviation is not None
        rows.append(
            [
                one.name,
                known_to(one.value, one.standard_deviation),
                sd(one.standard_deviation),
                *(known_to(end, one.standard_deviation) if told else "open" for end in (low, high)),
                one.unit if one.unit != "1" else "",
                number(one.first, ".4g"),
            ]
        )
    return table("Values", ["of", "value", "sd", "from", "to (95 %)", "unit", "first"], rows)


def residuals_table(found: Calibration) -> Table:
    """What is left of each series."""
    rows = [
        [
            f"{one.log}{' (held out)' if one.held_out else ''}",
            one.variable,
            number(one.samples, "d"),
            number(one.rms, ".4g"),
            one.unit,
            number(one.autocorrelation, ".2f"),
            number(one.order, "d"),
        ]
        for one in found.residuals
    ]
    return table("Residuals", ["log", "variable", "samples", "rms", "unit", "neighbours", "AR order"], rows)


def _minima(found: Calibration) -> list[str]:
    if len(found.minima) < 2:
        return []
    others = [
        f"{', '.join(f'{name} {value:.4g}' for name, value in one.values.items())} (misfit {one.misfit:.3f})"
        for one in found.minima[1:]
    ]
    return [f"Other minima within a tenth of the least misfit: {'; '.join(others)}."]


def _meaning(found: Calibration) -> str:
    whitened = any(one.order for one in found.residuals)
    ratio = f"{found.inflation:.2g} times as large at most"
    if found.inflation > MISTRUSTED:
        how = f"by the sandwich (Newey-West), {ratio}: residuals are coloured, or the model misses something"
    else:
        rows = "whitened by an autoregression" if whitened else "that are white"
        how = f"of residuals {rows}; by the sandwich (Newey-West) {ratio}"
    return f"By a {found.method}. Deviations: {how}."


def draw_calibration(axes: Axes, found: Calibration) -> None:
    """The first measured variable of the first log, and the model's free run."""
    log, run = found.log(0), found.free_run(0)
    name = next(iter(log.measured))
    shown = slice(None) if found.horizon is None else log.time <= log.time[0] + found.horizon
    axes.plot(log.time, log.measured[name], ".", color="0.6", markersize=3, label="measured")
    axes.plot(log.time[shown], np.asarray(run[name])[shown], color="#0072b2", linewidth=0.9, label="model")
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"{name} ({run.units.get(name, '1')})")
    axes.legend(frameon=False)
