"""The fit of a machine of several joints, for a terminal (rich)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fmu_models.base.console import plain, table
from fmu_models.base.digits import deviation, like_sd
from identification.report.law_table import LEGEND, law_table

if TYPE_CHECKING:
    from rich.console import Group, RenderableType

    from identification.inference.comparison import LawComparison
    from identification.machines.machine_fit import MachineFit


def machine_report(fit: MachineFit) -> Group:
    """Everything that logs say of a machine."""
    from rich.console import Group

    shown = table(
        *("base parameter", ">value", ">sd", "unit", ">least squares", ">sd", ">shift, sd"),
        title=f"{fit.title}: by {fit.method}, cutoff {fit.cutoff:g} Hz, efforts {fit.parallel_cutoff:g} Hz",
    )
    for one in fit.parameters:
        squares = like_sd(one.least_squares, one.least_squares_deviation), deviation(one.least_squares_deviation)
        shown.add_row(
            one.combination,
            like_sd(one.value, one.standard_deviation),
            deviation(one.standard_deviation),
            one.unit,
            *squares,
            f"{one.shift:+.1f}",
        )
    scores = table(
        *("joint", ">seen", ">logs left out in turn", ">held out", ">free run of 1 s"),
        title="Errors, % of the effort; of a free run, % of the motion",
    )
    for one in fit.joints:
        errors = (one.seen, one.left_out, one.held_out, one.free_run)
        scores.add_row(one.joint, *("" if error is None else f"{100 * error:.1f}" for error in errors))
    known = ", ".join(f"{name} = {value:g}" for name, value in fit.known.items())
    parts: list[RenderableType] = [shown, scores]
    parts.append(
        plain(
            f"{fit.samples} thinned samples of {len(fit.logs)} logs; condition of the columns {fit.condition:.3g}. "
            "Deviations: the larger of Newey-West's and that of a jackknife over logs."
            + (f" Taken as known: {known}." if known else "")
        )
    )
    return Group(*parts, *(plain(f"- {verdict}") for verdict in fit.verdicts))


def joint_laws(compared: Mapping[str, LawComparison]) -> Group:
    """Friction laws of each joint."""
    from rich.console import Group

    parts: list[RenderableType] = []
    for joint, found in compared.items():
        shown = law_table(found)
        shown.title = f"{joint}: {shown.title}"
        parts += [shown, plain(f"- {found.verdict}")]
    return Group(*parts, plain(LEGEND))
