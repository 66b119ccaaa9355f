"""Slip statistics as tables for a terminal (rich)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.console import plain, table
from fmu_models.base.digits import deviation

if TYPE_CHECKING:
    from rich.console import Group, RenderableType

    from identification.slips.block_on_belt import SlipModel
    from identification.slips.statistics import SlipStatistics


def slip_report(statistics: SlipStatistics, model: SlipModel | None, missing: str = "") -> Group:
    """Statistics of slip events, and the model beside them, or why there is none."""
    from rich.console import Group

    shown = table(
        "",
        ">value",
        ">95 %",
        ">sd of one",
        "unit",
        title=f"{statistics.events} slip events ({statistics.definition}) of {statistics.log}",
    )
    for name, prediction, unit in (
        ("peak friction, median", statistics.peak, "1"),
        ("after slip, median", statistics.after, "1"),
        ("drop, median", statistics.drop, "1"),
        ("period, mean", statistics.period, "s"),
        ("slip time, median", statistics.slip_time, "s"),
    ):
        shown.add_row(
            name,
            f"{prediction.value:.4g}",
            f"{prediction.low:.4g} .. {prediction.high:.4g}",
            f"{deviation(prediction.spread)}",
            unit,
        )
    parts: list[RenderableType] = [plain(statistics.title, "bold"), plain(f"{statistics.source}\n"), shown]
    parts.append(
        plain(
            f"Period varies by {100 * statistics.period_variation:.2g} %. Noise {statistics.noise:.2g}, least drop "
            f"counted {statistics.threshold:.3g}."
        )
    )
    if model:
        compared = table("", ">measured", ">model", ">ratio", "", title="Block on a belt with the slider's constants")
        for prediction in model.predictions:
            mark = "fitted" if prediction.fitted else "in the 95 % interval" if prediction.inside else "outside"
            row = (f"{prediction.measured:.4g}", f"{prediction.modelled:.4g}", f"{prediction.ratio:.3f}", mark)
            compared.add_row(f"{prediction.name}{'' if prediction.unit == '1' else f', {prediction.unit}'}", *row)
        values = f"mu_s = {model.mu_s:.4g}, mu_k = {model.mu_k:.4g}, p = {model.p:.3g} s/m assumed"
        parts += [compared, plain(f"{values}. {model.verdict}")]
    parts += [plain(f"No model beside it. {missing}")] if missing else []
    parts += [plain(f"- {verdict}") for verdict in statistics.verdicts]
    return Group(*parts)
