"""Friction laws compared, as a table for a terminal (rich)."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from fmu_models.base.console import table
from fmu_models.base.digits import value_with_sd

if TYPE_CHECKING:
    from identification.inference.comparison import LawComparison, LawScore

LEGEND = (
    "Criteria against the first law. Weight: how far the values of a law count (Akaike). Held out: rms of predicted "
    "residuals, 1 = as good as the law that fits best; not asked of laws that are far behind."
)


def law_table(found: LawComparison) -> table:
    """One row for each law, the best first."""
    columns = ("law", ">BIC", ">AIC", ">weight", ">held out", ">worse by", "parameters", "")
    by = f" by {found.estimator}" if found.estimator else ""
    title = f"Friction laws{by}: {found.residuals} residuals, worth {found.effective:.0f} independent ones"
    shown = table(*columns, title=title)
    best = found.best
    for one in found.scores:
        criteria = (one.bic - best.bic, one.aic - best.aic)
        mark = "put aside" if one.warnings else "preferred" if one.law == found.preferred else ""
        shown.add_row(
            one.law,
            *(f"{lead:+.1f}" for lead in criteria),
            f"{one.weight:.2f}",
            "" if one.held_out is None else f"{one.held_out:.3g}",
            "" if one.worse is None else f"{one.worse:.1f} se",
            "\n".join(_value(one, name) for name in one.values),
            mark,
        )
    return shown


def _value(one: LawScore, name: str) -> str:
    bound = " (bound)" if name in one.bounds else ""
    deviation = one.deviations[name] if isfinite(one.deviations[name]) else None
    return f"{name} = {value_with_sd(one.values[name], deviation, one.units[name])}{bound}"
