"""Tables of a report: heads and rows of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from identification.model_check.table import metric_rows, sequence_rows

if TYPE_CHECKING:
    from identification.fit.result import FittedParameter, FrictionFit
    from identification.measurement.free_decay import FreeDecay
    from identification.model_check.families import FamilyComparison
    from identification.next_step.design import Design
    from rig_io.logs.log import RigLog

SHOWN = 6  # experiments

# fields of a fit that have a place of their own in the report; what else it holds is shown as it is
PLACED = frozenset(
    {
        *("type", "version", "estimator", "law", "structure", "contacts", "materials", "parameters", "correlation"),
        *("constants", "logs", "bins", "sensors", "segments", "values", "rms_residual", "autocorrelation"),
        *("converged", "message", "warnings", "residual_unit", "nuisance", "covariance", "whiteness"),
    }
)


@dataclass(frozen=True)
class Table:
    """A table: caption, heads, rows; the first column is text, the others are numbers if not ``text``."""

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: bool = False


def parameter_table(fit: FrictionFit) -> Table:
    """Values with both kinds of uncertainty."""
    rows = []
    for q in fit.parameters:
        low, high = fit.interval(q.name)
        wide = fit.interval(q.name, with_scale=True)
        efficiency = q.efficiency
        rows.append(
            [
                q.name,
                f"{q.value:.5g}" + (" (at a bound of the search)" if q.at_bound else ""),
                q.unit,
                f"{q.standard_deviation:.2g}",
                f"{q.scale_deviation:.2g}",
                f"{low:.5g} to {high:.5g}",
                f"{wide[0]:.5g} to {wide[1]:.5g}",
                "" if efficiency is None else f"{100 * efficiency:.0f} %",
                q.description,
            ]
        )
    heads = (
        "",
        "value",
        "unit",
        "sd, noise",
        "sd, rig constants",
        "95 %, noise",
        "95 %, both",
        "efficiency",
        "meaning",
    )
    return Table("Parameters of the friction law", heads, rows)


def nuisance_table(parameters: Sequence[FittedParameter]) -> Table:
    """What else was estimated."""
    rows = [[q.name, f"{q.value:.5g}", q.unit, f"{q.standard_deviation:.2g}", q.description] for q in parameters]
    return Table("Estimated beside the law", ("", "value", "unit", "sd", "meaning"), rows)


def correlation_table(fit: FrictionFit) -> Table:
    """Correlations from noise."""
    names = [q.name for q in fit.parameters]
    rows = [[name, *(f"{value:+.3f}" for value in row)] for name, row in zip(names, fit.correlation, strict=False)]
    return Table("Correlations, from noise", ("", *names), rows)


def constants_table(fit: FrictionFit) -> Table:
    """Constants of the rig and what a change of one does."""
    names = [q.name for q in fit.parameters]
    rows = []
    for one in fit.constants:
        effects = (one.sensitivity.get(name) for name in names)
        shown = ["" if effect is None else f"{effect:+.2f}" for effect in effects]
        rows.append([one.name, f"{one.value:.6g}", f"{one.standard_uncertainty:.1g}", one.unit, one.source, *shown])
    heads = ("", "value", "sd", "unit", "from", *(f"{name}, %" for name in names))
    return Table("Constants of the rig, and by how many % a parameter moves if one is 1 % larger", heads, rows)


def logs_table(fit: FrictionFit, logs: Sequence[RigLog]) -> Table:
    """The logs given, which of them were fitted, and their checksums."""
    from rig_io.packages.sidecar import file_hash

    used = {one.name: one for one in fit.logs}
    rows = []
    for log in logs:
        one = used.get(log.name)
        speeds = ", ".join(f"{speed:g}" for speed in log.experiment.drive_speed)
        slips = "" if one is None else f"{one.least_slip:.3g} to {one.greatest_slip:.3g}"
        sum_ = file_hash(log.path).removeprefix("sha256:") if log.path is not None and log.path.is_file() else ""
        what = "fitted" if one is not None else log.kind if log.kind == "free-decay" else "compared only"
        count = "" if one is None else str(one.segments)
        rows.append([log.name, what, f"{log.duration:.3g}", speeds, count, slips, sum_])
    heads = ("", "use", "length, s", "drive speeds, rad/s", "slips", "slip speeds, m/s", "sha256")
    return Table("Logs", heads, rows, text=True)


def sensors_table(fit: FrictionFit) -> Table:
    """Corrections of the laser by the encoder."""
    rows = [[name.replace("_", " "), f"{value:.4g}"] for name, value in fit.sensors.items()]
    return Table("Laser against encoder (SI units)", ("", "value"), rows)


def decay_table(decay: FreeDecay) -> Table:
    """k/J and c/J."""
    rows = [
        ["k/J", f"{decay.stiffness_ratio:.6g}", f"{decay.stiffness_ratio_deviation:.1g}", "1/s^2"],
        ["c/J", f"{decay.damping_ratio:.6g}", f"{decay.damping_ratio_deviation:.1g}", "1/s"],
    ]
    return Table(f"Free decay '{decay.log}'", ("", "value", "sd", "unit"), rows)


def whiteness_table(fit: FrictionFit) -> Table | None:
    """Tests of the residuals by log."""
    if fit.whiteness is None:
        return None
    rows = [
        [
            one.log,
            str(one.values),
            f"{one.autocorrelation:+.3f}",
            f"{one.colour:.2g}",
            "" if one.course is None else f"{one.course:.2g}",
        ]
        for one in fit.whiteness.logs
    ]
    heads = ("", "values", "correlation of neighbours", "white by chance (Ljung-Box)", "no common course by chance")
    return Table("Tests of the residuals (probabilities)", heads, rows)


def metrics_table(family: FamilyComparison) -> Table:
    """Model against measurement at each drive speed."""
    heads, rows = metric_rows(family)
    return Table("Model against measurement", [head.replace("\n", ", ") for head in heads], rows)


def sequence_table(family: FamilyComparison) -> Table:
    """Which disc sticks when."""
    heads = ("", "drive speeds", "measured", "model", "stick fraction, measured", "model")
    return Table("Stick by disc, in order within a cycle", heads, sequence_rows(family), text=True)


def design_table(design: Design) -> Table:
    """The best of the experiments that were tried, against what is known now."""
    names = list(design.deviations)
    rows = [["as it is", "", "", *(f"{design.deviations[name]:.2g}" for name in names), f"{design.index:.3g}"]]
    for one in [one for one in design.candidates if one.refused is None][:SHOWN]:
        deviations = (f"{one.deviations[name]:.2g}" for name in names)
        rows.append([one.kind, f"{one.drive_speed:.3g}", f"{one.load:.3g}", *deviations, f"{one.index:.3g}"])
    heads = ("", "drive speed, rad/s", "load, N", *(f"sd {name}" for name in names), "collinearity")
    return Table(f"Predicted with one more log of {design.duration:g} s", heads, rows)


def other_fields(fit: FrictionFit) -> dict[str, Any]:
    """What a fit holds beyond the fields that have a place of their own; empty ones are left out."""
    return {
        name: value for name, value in fit.to_dict().items() if name not in PLACED and value not in (None, (), [], {})
    }


def shown(value: Any) -> str:
    """A plain value as text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {shown(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(shown(item) for item in value)
    return "" if value is None else str(value)
