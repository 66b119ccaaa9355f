"""Everything that a fit says, for a terminal (rich)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from identification.inference.uncertainty import LAG_RULE
from identification.inference.whiteness import BEYOND
from identification.report import tables
from identification.report.friction_figure import fitted_law

if TYPE_CHECKING:
    from rich.console import Group

    from fmu_models.base.table import PrintedTable
    from identification.fit.result import FrictionFit
    from identification.measurement.free_decay import FreeDecay


def fit_summary(fit: FrictionFit, decay: FreeDecay | None = None) -> Group:
    """Tables and sentences of a fit, those of its free decay first."""
    from rich.console import Group
    from rich.text import Text

    shown = [tables.decay_table(decay)] if decay is not None else []
    shown += fit_tables(fit)
    sentences = [f"Disturbance {cause.sentence}" for cause in fit.causes]
    sentences += [fit.words_of_law]
    sentences += [fit.free.words(fitted_law(fit, fit.contacts[0]))] if fit.free else []
    sentences += ["Assumed: " + "; ".join(fit.structure) + ".", *certainty(fit)]
    warnings = [Text(f"Warning: {warning}", style="bold") for warning in fit.warnings]
    return Group(*shown, *map(Text, sentences), *warnings)


def fit_tables(fit: FrictionFit, decay: FreeDecay | None = None) -> list[PrintedTable]:
    """Of a fit, that of its parameters first."""
    shown = [tables.parameter_table(fit), tables.correlation_table(fit)]
    shown += [tables.plain_table(fit)] if fit.causes else []
    shown += [tables.rivals_table(fit)] if len(fit.rivals) > 1 else []
    shown += [tables.nuisance_table(fit.nuisance)] if fit.nuisance else []
    shown += [tables.constants_table(fit)]
    if fit.posterior is not None:
        shown.append(tables.posterior_table(fit.posterior, {q.name: fit.interval(q.name) for q in fit.parameters}))
    shown += [tables.decay_table(decay)] if decay is not None else []
    return [*shown, *tables.sensor_tables(fit)]


def certainty(fit: FrictionFit) -> list[str]:
    """What a fit says of its identifiability, of its residuals and of the contact in stick."""
    sentences = [f"Deviations: {LAG_RULE}."] if fit.covariance == "hac" else []
    if fit.collinearity:
        judged = "nearly collinear" if fit.collinearity.poor else "told apart"
        sentences.append(f"Collinearity index {fit.collinearity.index:.3g} ({judged}): {fit.collinearity.words}.")
    if fit.whiteness:
        coloured = fit.whiteness.coloured
        names = f"coloured in {' and '.join(coloured)} (the deviations allow for it)" if coloured else "white"
        beyond, tried = len(fit.whiteness.beyond), len(fit.whiteness.speeds)
        sentences.append(
            f"Residuals: {names} (Ljung-Box, 1 %); beyond {BEYOND:g} standard errors in {beyond} of {tried} "
            "ranges of slip speed."
        )
    if fit.presliding and not fit.presliding.elastic:
        reach = fit.presliding.compliance + 2 * fit.presliding.deviation
        least = f"above {1 / reach:.1g} N/m" if reach > 0 else "beyond measure"
        sentences.append(f"In stick the contact is as good as rigid: its stiffness is {least} (95 %).")
    if fit.breakaway:
        sentences.append(f"Breakaway: {fit.breakaway.words}.")
    return sentences
