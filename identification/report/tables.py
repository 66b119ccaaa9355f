"""The tables of a fit and of what belongs to it, for a terminal and for a page alike."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fmu_models.base.table import Cell, PrintedColumn, PrintedTable, interval, known_to, measured, number, sd, table
from identification.fit.parts import Constant, FittedParameter
from identification.fit.result import FrictionFit
from identification.inference.posterior import Posterior
from identification.measurement.free_decay import FreeDecay
from identification.next_step.design import Design
from rig_io.logs.log import RigLog
from rig_io.packages.sidecar import file_hash

SHOWN = 12  # experiments


def parameter_table(fit: FrictionFit) -> PrintedTable:
    """Values with their 95 % interval, what it is made of, and how near the sensors' bound they come."""
    kinds = " or ".join(dict.fromkeys(one.kind for one in fit.intervals)) or "noise"
    bounded = fit.parameters[0].bound is not None
    rivalled = bool(fit.rivals)
    rows = []
    for q in fit.parameters:
        noise = q.standard_deviation
        whole = interval(*fit.interval(q.name), q.total_deviation)
        rows.append([
            q.name,
            known_to(q.value, q.total_deviation),
            replace(whole, words=fit.words_at_least(q.name) + whole.words),
            sd(noise),
            sd(q.scale_deviation),
            *([sd(q.law_deviation)] if rivalled else ()),
            interval(*fit.noise_interval(q.name), noise),
            *([sd(q.bound), number(q.efficiency, ".0%")] if bounded else ()),
            q.unit,
            q.description + (" (at a bound of the search)" if q.at_bound else ""),
        ])  # fmt: skip
    columns = [
        *("parameter", "value", "95 %", "sd, noise", "sd, rig constants", *(["sd, law"] if rivalled else ())),
        PrintedColumn(f"95 %, {kinds}", spare=4),
        *([PrintedColumn("sd, bound", spare=3), PrintedColumn("efficiency", spare=2)] if bounded else ()),
        *("unit", PrintedColumn("meaning", spare=5)),
    ]
    where = f"{fit.law} law of {' and '.join(fit.contacts)}"
    where += f", {' and '.join(fit.materials)}" if fit.materials else ""
    of = f"{fit.estimator}, {fit.segments} slip segments of {len(fit.logs)} logs, {fit.covariance}"
    return table(f"{where} ({of})", columns, rows)


def plain_table(fit: FrictionFit) -> PrintedTable:
    """The parameters without the disturbances that were found, and with them."""
    rows = []
    for one, q in zip(fit.plain, fit.parameters, strict=True):
        both = (measured(part.value, part.total_deviation) for part in (one, q))
        least = fit.words_at_least(q.name)
        rows.append([q.name, *(replace(cell, words=cell.words.replace("± ", f"± {least}")) for cell in both), q.unit])
    causes = ", ".join(cause.name for cause in fit.causes)
    return table(f"Plain fit, and with {causes}", ("", "plain ± sd", "corrected ± sd", "unit"), rows)


def rivals_table(fit: FrictionFit) -> PrintedTable:
    """Laws on the same residuals, and what each makes of the parameters of the fit."""
    names = [q.name for q in fit.parameters]
    rows = [
        [
            one.law,
            number(one.lead, "+.1f"),
            number(one.weight, ".2f"),
            *(number(one.values.get(name), ".5g") for name in names),
        ]
        for one in sorted(fit.rivals, key=lambda rival: rival.lead)
    ]
    return table("Laws on the same evidence", ("law", "BIC", "weight", *names), rows)


def nuisance_table(parameters: Sequence[FittedParameter]) -> PrintedTable:
    """What else was estimated, from these logs and what was known of it."""
    rows = [[q.name, measured(q.value, q.standard_deviation), q.unit, q.description] for q in parameters]
    return table("Estimated beside the law", ("", "value ± sd", "unit", "meaning"), rows)


def posterior_table(found: Posterior, own: Mapping[str, tuple[float, float]]) -> PrintedTable:
    """Medians and intervals of the posterior, beside the widths of the intervals that a fit has of its ``own``."""
    rows = []
    for one in found.marginals:
        low, high = own.get(one.name, (np.nan, np.nan))
        reach = one.quantiles[-1] - one.quantiles[0]
        rows.append([
            one.name,
            known_to(one.quantiles[2], one.standard_deviation),
            interval(one.quantiles[0], one.quantiles[-1], one.standard_deviation),
            interval(one.quantiles[1], one.quantiles[3], one.standard_deviation),
            number(reach / (high - low) if np.isfinite(high - low) else None, ".2f"),
            one.unit,
            f"open {one.open_side}" if one.open_side else "",
        ])  # fmt: skip
    title = f"Posterior ({found.independent:.0f} independent samples of {found.walkers * found.steps})"
    return table(title, ("", "median", "95 %", "68 %", "width over the fit's", "unit", ""), rows)


def correlation_table(fit: FrictionFit) -> PrintedTable:
    """Correlations of the parameters, from noise."""
    names = [q.name for q in fit.parameters]
    rows = [[name, *(number(value, "+.3f") for value in row)] for name, row in zip(names, fit.correlation, strict=True)]
    return table("Correlations, from noise", ("", *names), rows)


def constants_table(fit: FrictionFit) -> PrintedTable:
    """Constants of the rig, adjusted to the logs, and by how many per cent a parameter moves if one is 1 % larger."""
    names = [q.name for q in fit.parameters]
    rows = [
        [
            constant.name,
            measured(constant.value, constant.standard_uncertainty)
            if constant.stated
            else Cell(f"{constant.value:g} ± ?", "number"),
            _before(constant),
            constant.unit,
            *(number(constant.sensitivity.get(name), "+.2f") for name in names),
            constant.source,
        ]
        for constant in fit.constants
    ]
    effects = (PrintedColumn(name, "%") for name in names)
    return table(
        "Rig constants: effect of +1 % on the parameters",
        ("constant", "value ± sd", "as stated", "unit", *effects, PrintedColumn("from", spare=1)),
        rows,
    )


def _before(one: Constant) -> Cell:
    """A constant as it was stated, where it was adjusted."""
    if one.before is None or (one.before == one.value and one.before_uncertainty == one.standard_uncertainty):
        return Cell("", "number")
    known = one.before_uncertainty
    return Cell(f"{one.before:g} ± ?", "number") if known is None else measured(one.before, known)


def logs_table(fit: FrictionFit, logs: Sequence[RigLog]) -> PrintedTable:
    """The logs given, which of them were fitted, and their checksums."""
    used = {one.name: one for one in fit.logs}
    rows = []
    for log in logs:
        one = used.get(log.name)
        speeds = ", ".join(f"{speed:g}" for speed in log.experiment.drive_speed)
        slips = "" if one is None else f"{one.least_slip:.3g} .. {one.greatest_slip:.3g}"
        sum_ = file_hash(log.path).removeprefix("sha256:") if log.path is not None and log.path.is_file() else ""
        what = "fitted" if one is not None else log.kind if log.kind == "free-decay" else "compared only"
        count = Cell("" if one is None else str(one.segments), "number")
        rows.append([log.name, what, number(log.duration, ".3g"), speeds, count, Cell(slips, "number"), sum_])
    columns = (
        *("log", "use", PrintedColumn("length", "s"), PrintedColumn("drive speeds", "rad/s"), "slips"),
        *(PrintedColumn("slip speeds", "m/s"), "sha256"),
    )
    return table("Logs", columns, rows)


def sensor_tables(fit: FrictionFit) -> list[PrintedTable]:
    """Corrections of the laser by the encoder, and a velocity sensor against the angle, as far as they were found."""
    laser = ("laser_gain_correction", "laser_delay", "_sd", 100, "%")
    velocity = ("velocity_gain", "velocity_delay", "_deviation", 1, "1")
    s, tables = fit.sensors, []
    for title, head, (gain, delay, known, size, unit) in (
        ("Laser against encoder", "correction", laser),
        ("Velocity sensor against the angle", "of the sensor", velocity),
    ):
        if gain in s:
            gained, late = (measured(by * s[name], by * s[name + known]) for name, by in ((gain, size), (delay, 1e3)))
            tables.append(table(title, (head, "value ± sd", "unit"), [["gain", gained, unit], ["delay", late, "ms"]]))
    return tables


def decay_table(decay: FreeDecay) -> PrintedTable:
    """k/J and c/J."""
    rows = [
        ["k/J", measured(decay.stiffness_ratio, decay.stiffness_ratio_deviation), "1/s^2"],
        ["c/J", measured(decay.damping_ratio, decay.damping_ratio_deviation), "1/s"],
    ]
    return table(f"Free decay '{decay.log}' ({decay.cycles:.1f} cycles)", ("quantity", "value ± sd", "unit"), rows)


def whiteness_table(fit: FrictionFit) -> PrintedTable | None:
    """Tests of the residuals by log."""
    if fit.whiteness is None:
        return None
    rows = [
        [
            log.log,
            Cell(str(log.values), "number"),
            number(log.autocorrelation, "+.3f"),
            number(log.colour, ".2g"),
            number(log.course, ".2g"),
        ]
        for log in fit.whiteness.logs
    ]
    heads = ("log", "values", "correlation of neighbours", "white by chance (Ljung-Box)", "no common course by chance")
    return table("Tests of the residuals (probabilities)", heads, rows)


def design_table(design: Design) -> PrintedTable:
    """The best of the experiments that were tried, against what is known now."""
    names = list(design.deviations)
    known = (sd(design.deviations[name]) for name in names)
    rows: list[list[str | Cell]] = [["as it is", "", *known, "", number(design.index, ".3g"), ""]]
    for one in [candidate for candidate in design.candidates if candidate.refused is None][:SHOWN]:
        deviations = (sd(one.deviations[name]) for name in names)
        settings = (number(one.drive_speed, ".3g"), number(one.load, ".3g"))
        judged = (number(one.gain, ".0%"), number(one.index, ".3g"), number(one.greatest_slip, ".2g"))
        rows.append([*settings, *deviations, *judged])
    columns = (
        *(PrintedColumn("drive", "rad/s"), PrintedColumn("load", "N"), *(f"sd {name}" for name in names)),
        *("gain", PrintedColumn("collinearity", spare=2), PrintedColumn("greatest slip", "m/s", spare=1)),
    )
    return table(f"Predicted with one more log of {design.duration:g} s", columns, rows)


def plan_table(design: Design) -> PrintedTable:
    """The logs of a plan, with the deviations after each, and those after as many like the logs that were made."""
    names = list(design.deviations)
    rows: list[list[str | Cell]] = [["as it is", "", "", *(sd(design.deviations[name]) for name in names), ""]]
    for place, one in enumerate(design.plan.logs):
        settings = (number(one.drive_speed, ".3g"), number(one.load, ".3g"))
        rows.append([f"log {place + 1}", *settings, *(sd(one.deviations[name]) for name in names), one.start])
    rows.append(["repeated", "", "", *(sd(design.plan.repeated[name]) for name in names), "logs as before"])
    columns = ("after", PrintedColumn("drive", "rad/s"), PrintedColumn("load", "N"), *(f"sd {name}" for name in names))
    return table(f"Plan of {len(design.plan.logs)} logs of {design.duration:g} s", (*columns, "start"), rows)
