"""Friction laws compared: a table for a page and a terminal."""

from math import isfinite

from fmu_models.base.digits import value_with_sd
from fmu_models.base.table import Cell, PrintedColumn, PrintedTable, number, table
from identification.inference.comparison import LawComparison, LawScore

LEGEND = (
    "Criteria against the first law. Weight: how far the values of a law count (Akaike). Held out: rms of predicted "
    "residuals, 1 = as good as the law that fits best; not asked of laws that are far behind."
)


def law_table(found: LawComparison, of: str = "") -> PrintedTable:
    """One row for each law, the best first. of: what has the friction, before the title."""
    by = f" by {found.estimator}" if found.estimator else ""
    title = f"Friction laws{by}: {found.residuals} residuals, worth {found.effective:.0f} independent ones"
    best = found.best
    rows = [
        [
            score.law,
            number(score.bic - best.bic, "+.1f"),
            number(score.aic - best.aic, "+.1f"),
            number(score.weight, ".2f"),
            number(score.held_out, ".3g"),
            Cell("" if score.worse is None else f"{score.worse:.1f} se", "number"),
            "\n".join(_value(score, name) for name in score.values),
            "put aside" if score.warnings else "preferred" if score.law == found.preferred else "",
        ]
        for score in found.scores
    ]
    columns = ("law", "BIC", PrintedColumn("AIC", spare=2), PrintedColumn("weight", spare=1))
    columns += ("held out", "worse by", "parameters", "")
    return table(f"{of}: {title}" if of else title, columns, rows)


def _value(one: LawScore, name: str) -> str:
    bound = " (bound)" if name in one.bounds else ""
    deviation = one.deviations[name] if isfinite(one.deviations[name]) else None
    return f"{name} = {value_with_sd(one.values[name], deviation, one.units[name])}{bound}"
