"""Results as tables for a terminal (rich)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from identification.inference.uncertainty import LAG_RULE

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

    from identification.fit.result import FrictionFit
    from identification.inference.profile import Interval
    from identification.measurement.free_decay import FreeDecay


def _table(title: str, *columns: tuple[str, str]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for name, justify in columns:
        table.add_column(name, justify="right" if justify == "right" else "left")
    return table


def parameter_table(fit: FrictionFit) -> Table:
    """Parameters with the two kinds of uncertainty, 95 % interval, and how near the sensors' bound they come."""
    where = f"{fit.law} law of {' and '.join(fit.contacts)}"
    where += f", {' and '.join(fit.materials)}" if fit.materials else ""
    named = {one.name: one for one in fit.intervals}
    kinds = dict.fromkeys(one.kind for one in fit.intervals) or ["noise"]
    table = _table(
        f"{where} ({fit.estimator}, {fit.segments} slip segments of {len(fit.logs)} logs, {fit.covariance})",
        ("parameter", "left"),
        ("value", "right"),
        ("sd (noise)", "right"),
        ("sd (rig constants)", "right"),
        *((f"95 % ({kind})", "right") for kind in kinds),
        *([("sd (bound)", "right"), ("efficiency", "right")] if fit.parameters[0].bound is not None else ()),
        ("unit", "left"),
    )
    for parameter in fit.parameters:
        low, high = fit.interval(parameter.name)
        table.add_row(
            parameter.name,
            f"{parameter.value:.5g}",
            f"{parameter.standard_deviation:.2g}",
            f"{parameter.scale_deviation:.2g}",
            _ends(named[parameter.name]) if parameter.name in named else f"{low:.5g} .. {high:.5g}",
            *([] if parameter.bound is None else [f"{parameter.bound:.2g}", f"{parameter.efficiency or 0:.0%}"]),
            parameter.unit,
        )
    return table


def nuisance_table(fit: FrictionFit) -> Table:
    """What was estimated beside the law, from these logs and what was known of it."""
    table = _table(
        "Estimated beside the law", ("", "left"), ("value", "right"), ("sd", "right"), ("unit", "left"), ("", "left")
    )
    for one in fit.nuisance:
        table.add_row(one.name, f"{one.value:.6g}", f"{one.standard_deviation:.2g}", one.unit, one.description)
    return table


def _ends(interval: Interval) -> str:
    """An interval as people read it; an end that the data leave open is called so."""
    low, high = ("open" if end is None else f"{end:.5g}" for end in (interval.low, interval.high))
    return f"{low} .. {high}"


def correlation_table(fit: FrictionFit) -> Table:
    """Correlations of the parameters, from noise."""
    names = [parameter.name for parameter in fit.parameters]
    table = _table("Correlations (noise)", ("", "left"), *((name, "right") for name in names))
    for name, row in zip(names, fit.correlation, strict=True):
        table.add_row(name, *(f"{value:+.3f}" for value in row))
    return table


def constants_table(fit: FrictionFit) -> Table:
    """Constants taken as given: by how many per cent a parameter moves if a constant is 1 % larger."""
    names = [parameter.name for parameter in fit.parameters]
    table = _table(
        "Rig constants: effect of +1 % on the parameters, %",
        ("constant", "left"),
        ("value", "right"),
        ("sd", "right"),
        ("unit", "left"),
        ("from", "left"),
        *((name, "right") for name in names),
    )
    for constant in fit.constants:
        effects = (constant.sensitivity[name] for name in names)
        table.add_row(
            constant.name,
            f"{constant.value:.5g}",
            f"{constant.standard_uncertainty:.1g}",
            constant.unit,
            constant.source,
            *("" if effect is None else f"{effect:+.2f}" for effect in effects),
        )
    return table


def fit_report(fit: FrictionFit) -> Group:
    """Everything a fit says."""
    from rich.console import Group
    from rich.text import Text

    lines = [Text("Assumed: " + "; ".join(fit.structure) + ".")]
    if fit.sensors:
        lines.append(
            Text(
                f"Laser against encoder: gain {100 * fit.sensors['laser_gain_correction']:+.3f} +- "
                f"{100 * fit.sensors['laser_gain_correction_sd']:.3f} %, delay {1e3 * fit.sensors['laser_delay']:+.3f} "
                f"+- {1e3 * fit.sensors['laser_delay_sd']:.3f} ms."
            )
        )
    lines += [Text(line) for line in _certainty(fit)]
    lines += [Text(f"Warning: {warning}", style="bold") for warning in fit.warnings]
    beside = [nuisance_table(fit)] if fit.nuisance else []
    return Group(parameter_table(fit), correlation_table(fit), *beside, constants_table(fit), *lines)


def _certainty(fit: FrictionFit) -> list[str]:
    """What a fit says of its identifiability, of its residuals and of the contact in stick."""
    said = [f"Deviations: {LAG_RULE}."] if fit.covariance == "hac" else []
    if fit.collinearity:
        judged = "nearly collinear" if fit.collinearity.poor else "told apart"
        said.append(f"Collinearity index {fit.collinearity.index:.3g} ({judged}): {fit.collinearity.words}.")
    if fit.whiteness:
        coloured = fit.whiteness.coloured
        names = f"coloured in {' and '.join(coloured)} (the deviations allow for it)" if coloured else "white"
        beyond, tried = len(fit.whiteness.beyond), len(fit.whiteness.speeds)
        said.append(
            f"Residuals: {names} (Ljung-Box, 1 %); beyond 3 standard errors in {beyond} of {tried} ranges of slip "
            "speed."
        )
    if fit.presliding and not fit.presliding.elastic:
        reach = fit.presliding.compliance + 2 * fit.presliding.deviation
        least = f"above {1 / reach:.1g} N/m" if reach > 0 else "beyond measure"
        said.append(f"In stick the contact is as good as rigid: its stiffness is {least} (95 %).")
    return said


def decay_table(decay: FreeDecay) -> Table:
    """k/J and c/J."""
    table = _table(
        f"Free decay '{decay.log}' ({decay.cycles:.1f} cycles)",
        ("quantity", "left"),
        ("value", "right"),
        ("sd", "right"),
        ("unit", "left"),
    )
    table.add_row("k/J", f"{decay.stiffness_ratio:.6g}", f"{decay.stiffness_ratio_deviation:.1g}", "1/s^2")
    table.add_row("c/J", f"{decay.damping_ratio:.6g}", f"{decay.damping_ratio_deviation:.1g}", "1/s")
    return table
