"""A calibration in tables and words, and its residuals beside the log."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.console import plain
from fmu_models.base.table import Cell, PrintedColumn, PrintedTable, known_to, number, sd, table
from identification.calibration.conclude import MISTRUSTED
from identification.calibration.follow import FollowedLog
from identification.calibration.result import Calibration, SeriesResidual
from identification.inference.whiteness import COLOURED
from identification.next_step.experiments import Experiments
from identification.report.tables import posterior_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Group

WORSE = 1.5  # times what is left in the calibration: a log that is followed less well


def calibration_report(found: Calibration) -> Group:
    """Everything that a calibration says."""
    from rich.console import Group

    parts: list[Any] = [values_table(found), residuals_table(found.residuals), plain(meaning(found))]
    if found.posterior is not None:
        own = {one.name: found.interval(one.name) for one in found.all_values}
        parts.insert(1, posterior_table(found.posterior, own))
    return Group(plain(found.title, "bold"), *parts, *(plain(f"- {note}") for note in verdicts(found)))


def verdicts(found: Calibration) -> list[str]:
    """What the logs leave open, other minima, warnings."""
    hint = ["What would tell that: stickslip design RESULT --within NAME=LOW:HIGH."] if found.directions else []
    return [*found.directions, *hint, *_minima(found), *found.warnings]


def values_table(found: Calibration) -> PrintedTable:
    """Parameters, sensors, then start states."""
    rows = []
    for one in (*found.parameters, *found.starts):
        low, high = found.interval(one.name)
        rows.append(
            [
                one.name,
                known_to(one.value, one.standard_deviation),
                sd(one.standard_deviation),
                *(known_to(end, one.standard_deviation) if np.isfinite(end) else "open" for end in (low, high)),
                one.unit if one.unit != "1" else "",
                number(one.first, ".4g"),
            ]
        )
    return table("Values", ["of", "value", "sd", "from", "to (95 %)", "unit", "first"], rows)


def residuals_table(residuals: Sequence[SeriesResidual]) -> PrintedTable:
    """What is left of each series."""
    rows = [
        [
            f"{one.log}{' (held out)' if one.held_out else ''}",
            one.variable,
            number(one.samples, "d"),
            number(one.rms, ".4g"),
            one.unit,
            number(None if one.share is None else 100 * one.share, ".3g"),
            number(one.autocorrelation, ".2f"),
            number(one.chance, ".2g"),
            number(one.order, "d"),
        ]
        for one in residuals
    ]
    columns = ["log", "variable", "samples", "rms", "unit", PrintedColumn("of the motion", "%", spare=2)]
    columns += ["neighbours", PrintedColumn("white by chance (Ljung-Box)", spare=1), PrintedColumn("AR order", spare=3)]
    return table("Residuals", columns, rows)


def experiments_table(ranked: Experiments) -> PrintedTable:
    """Deviations as they are, and with each candidate beside the logs, the best first."""
    names = list(ranked.deviations)
    settings: dict[str, str | Cell] = {name: "" for one in ranked.candidates for name in one.settings}
    labels = ["experiment"] if any(one.label for one in ranked.candidates) else []
    blank = [""] * (len(labels) + len(settings) - 1)
    rows: list[list[str | Cell]] = [["as it is", *blank, *(sd(ranked.deviations[name]) for name in names)]]
    for candidate in ranked.candidates:
        if candidate.refused is None:
            values = {**settings, **{name: number(value, ".4g") for name, value in candidate.settings.items()}}
            rows.append(
                [
                    *([candidate.label] if labels else []),
                    *values.values(),
                    *(sd(candidate.deviations[n]) for n in names),
                ]
            )
    columns = [*labels, *settings, *(f"sd {name}" for name in names)]
    return table(f"Predicted with one more log of {ranked.duration:g} s", columns, rows)


def followed_sentences(found: Calibration, followed: Sequence[FollowedLog]) -> list[str]:
    """How well logs are followed, against what is left of those that were calibrated with."""
    fitted: dict[str, float] = {}
    for line in found.residuals:
        if not line.held_out:
            fitted[line.variable] = max(fitted.get(line.variable, 0.0), line.rms)
    sentences = []
    for one in followed:
        windows = "" if len(one.begins) == 1 else f" in {len(one.begins)} runs within the horizon"
        for line in one.residuals:
            motion = "" if line.share is None else f", {100 * line.share:.2g} % of its motion"
            text = f"{line.log}: '{line.variable}' is followed to {line.rms:.3g} {line.unit} rms{motion}{windows}"
            ratio = line.rms / fitted[line.variable] if fitted.get(line.variable) else None
            if ratio is None:
                text += "; the calibration did not measure it."
            elif ratio > WORSE:
                text += f": {ratio:.2g} times what it left in the calibration. The model or its parameters differ here."
            else:
                text += f", {ratio:.2g} times what it left in the calibration."
            if line.chance < COLOURED:
                text += f" What is left is coloured (neighbours {line.autocorrelation:+.2f})."
            sentences.append(text)
    return [*sentences, *(note for log in followed for note in log.notes)]


def followed_report(found: Calibration, followed: Sequence[FollowedLog]) -> Group:
    """Logs beside the calibrated model."""
    from rich.console import Group

    lines = residuals_table([line for log in followed for line in log.residuals])
    return Group(
        plain(found.title, "bold"), lines, *(plain(f"- {text}") for text in followed_sentences(found, followed))
    )


def _minima(found: Calibration) -> list[str]:
    if len(found.minima) < 2:
        return []
    others = [
        f"{', '.join(f'{name} {value:.4g}' for name, value in one.values.items())} (misfit {one.misfit:.3f})"
        for one in found.minima[1:]
    ]
    return [f"Other minima within a tenth of the least misfit: {'; '.join(others)}."]


def meaning(found: Calibration) -> str:
    whitened = any(line.order for line in found.residuals)
    ratio = f"{found.inflation:.2g} times as large at most"
    if found.inflation > MISTRUSTED:
        how = f"by the sandwich (Newey-West), {ratio}: residuals are coloured, or the model misses something"
    else:
        rows = "whitened by an autoregression" if whitened else "that are white"
        how = f"of residuals {rows}; by the sandwich (Newey-West) {ratio}"
    return f"By a {found.method}. Deviations: {how}."


def draw_calibration(found: Calibration, axes: Axes) -> None:
    """The first measured variable of the first log, and the model's free run."""
    log, run = found.log(0), found.free_run(0)
    name = next(iter(log.measured))
    shown = slice(None) if found.horizon is None else log.time <= log.time[0] + found.horizon
    axes.plot(log.time, log.measured[name], ".", color="0.6", markersize=3, label="measured")
    axes.plot(log.time[shown], np.asarray(run[name])[shown], color="#0072b2", linewidth=0.9, label="model")
    axes.set(xlabel="time (s)", ylabel=f"{name} ({run.units.get(name, '1')})")
    axes.legend(frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)  # curves fill the axes
