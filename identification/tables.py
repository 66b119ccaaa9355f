"""Results as tables for a terminal (rich)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

    from identification.free_decay import FreeDecay
    from identification.result import FrictionFit


def _table(title: str, *columns: tuple[str, str]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for name, justify in columns:
        table.add_column(name, justify="right" if justify == "right" else "left")
    return table


def parameter_table(fit: FrictionFit) -> Table:
    """Parameters with the two kinds of uncertainty and 95 % interval."""
    where = f"{fit.law} law of {fit.contact}" + (f", {' and '.join(fit.materials)}" if fit.materials else "")
    table = _table(
        f"{where} ({fit.estimator}, {fit.segments} slip segments of {len(fit.logs)} logs)",
        ("parameter", "left"),
        ("value", "right"),
        ("sd (noise)", "right"),
        ("sd (rig constants)", "right"),
        ("95 % (noise)", "right"),
        ("unit", "left"),
    )
    for parameter in fit.parameters:
        low, high = fit.interval(parameter.name)
        table.add_row(
            parameter.name,
            f"{parameter.value:.5g}",
            f"{parameter.standard_deviation:.2g}",
            f"{parameter.scale_deviation:.2g}",
            f"{low:.5g} .. {high:.5g}",
            parameter.unit,
        )
    return table


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
    lines += [Text(f"Warning: {warning}", style="bold") for warning in fit.warnings]
    return Group(parameter_table(fit), correlation_table(fit), constants_table(fit), *lines)


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
