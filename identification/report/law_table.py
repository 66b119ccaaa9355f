"""Friction laws compared, as a table for a terminal (rich)."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from fmu_models.base.console import table
from fmu_models.base.digits import value_with_sd

if TYPE_CHECKING:
    from identification.inference.comparison import LawComparison, LawScore

LEGEND = (
    "Criteria against the first law. Held out: rms of predicted residuals, 1 = as good as the law with the most "
    "parameters fits."
)


def law_table(found: LawComparison) -> table:
    """One row for each law, the best first."""
    columns = ("law", ">BIC", ">AICc", ">AIC", ">held out", ">worse by", "parameters", "")
    title = f"Friction laws: {found.residuals} residuals, worth {found.effective:.0f} independent ones"
    shown = table(*columns, title=title)
    best = found.best
    for one in found.scores:
        criteria = (one.bic - best.bic, one.aicc - best.aicc, one.aic - best.aic)
        mark = "put aside" if one.warnings else "preferred" if one.law == found.preferred else ""
        shown.add_row(
            one.law,
            *(f"{lead:+.1f}" for lead in criteria),
            f"{one.held_out:.3g}",
            f"{one.worse:.1f} se",
            "\n".join(_value(one, name) for name in one.values),
            mark,
        )
    return shown


def _value(one: LawScore, name: str) -> str:
    bound = " (bound)" if name in one.bounds else ""
    deviation = one.deviations[name] if isfinite(one.deviations[name]) else None
    return f"{name} = {value_with_sd(one.values[name], deviation, one.units[name])}{bound}"
