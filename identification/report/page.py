"""One page with everything a fit says: self-contained HTML, figures as SVG in it, and the data as JSON at its end."""

from __future__ import annotations

import datetime
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base.files import write_whole
from fmu_models.base.shown import Shown
from fmu_models.base.table import Table
from fmu_models.base.version import version
from fmu_models.report.inline_svg import inline_svg
from identification.model_check.portraits import MEANING
from identification.model_check.table import bifurcation_sentences, metrics_table, sequence_table
from identification.report import tables
from identification.report.citations import citations

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from identification.estimators.savitzky_golay import FrictionSamples
    from identification.fit.result import FrictionFit
    from identification.inference.problem import Evaluation
    from identification.measurement.free_decay import FreeDecay
    from identification.model_check.families import FamilyComparison
    from identification.next_step.design import Design
    from rig_io.logs.log import RigLog

TEMPLATE = "report.html.j2"


@dataclass(frozen=True, eq=False)
class Drawing:
    """A figure in the page: its SVG and what it shows."""

    svg: str
    caption: str


@dataclass(frozen=True, eq=False)
class Findings(Shown):
    """What a report is made of. samples: friction against slip speed by disc (None: not to be had); evaluation:
    residuals of the fit run again (None: not run); design: of the next experiment; live: the frame of `report.live`
    (empty: none); notes: what could not be shown, and why."""

    fit: FrictionFit
    logs: Sequence[RigLog]
    families: Sequence[FamilyComparison]
    decay: FreeDecay | None = None
    samples: Mapping[str, FrictionSamples] | None = None
    evaluation: Evaluation | None = None
    design: Design | None = None
    live: str = ""
    notes: Sequence[str] = ()

    def to_dict(self) -> dict[str, Any]:
        """The data of the report, plain values."""
        return {
            "fit": self.fit.to_dict(),
            "families": [family.to_dict() for family in self.families],
            "free_decay": None if self.decay is None else self.decay.to_dict(),
            "design": None if self.design is None else self.design.to_dict(),
            "notes": list(self.notes),
        }


def write_report(findings: Findings, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write the page of what ``findings`` gathered.

    Raises:
        StickslipError: ``path`` exists and ``overwrite`` is false, or cannot be written.
    """
    text = page(findings)
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, "utf-8")
    return Path(path)


def page(findings: Findings) -> str:
    """The page as text."""
    fit = findings.fit
    families = [
        {
            "drawing": drawing,
            "tables": [metrics_table(family), sequence_table(family)],
            "sentences": bifurcation_sentences(family),
            "notes": family.notes,
        }
        for family, drawing in zip(findings.families, _family_drawings(findings.families), strict=True)
    ]
    return rendered(
        TEMPLATE,
        findings.to_dict(),
        title=_title(fit),
        about=f"{fit.law} law, estimator {fit.estimator}",
        fit=fit,
        summary=summary(findings),
        parameters=tables.parameter_table(fit),
        friction=_friction_drawing(findings),
        residuals=_residual_drawing(findings),
        families=families,
        live=findings.live,
        meaning=MEANING,
        tables=_tables(findings),
        design=None if findings.design is None else tables.design_table(findings.design),
        advice="" if findings.design is None else findings.design.advice,
        other=tables.other_fields(fit),
        notes=findings.notes,
        citations=citations(fit),
    )


def rendered(template: str, data: Mapping[str, Any], **parts: Any) -> str:
    """A page of a template. data: plain values, that go with it as JSON."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("identification.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["shown"] = tables.shown
    return environment.get_template(template).render(
        version=version(),
        date=datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        # "</" would end the element that holds it
        data=json.dumps(data, ensure_ascii=False).replace("</", "<\\/"),
        **parts,
    )


def _title(fit: FrictionFit) -> str:
    where = " and ".join(fit.contacts)
    return f"Friction of {where}" + (f" ({', '.join(fit.materials)})" if fit.materials else "")


def summary(findings: Findings) -> list[str]:
    """What was found and how far it can be trusted, in sentences."""
    fit = findings.fit
    said = [
        f"The {fit.law} law was fitted to {fit.segments} slips in {len(fit.logs)} logs by the estimator "
        f"'{fit.estimator}'" + ("." if fit.converged else f", which did not converge ({fit.message}).")
    ]
    worst = max(fit.parameters, key=lambda q: q.total_deviation / max(abs(q.value), 1e-300))
    parts = (worst.total_deviation, worst.standard_deviation, worst.scale_deviation, worst.law_deviation or 0.0)
    total, noise, scale, law = (100 * part / max(abs(worst.value), 1e-300) for part in parts)
    by_law = f", {law:.2g} % from the choice of the law" if worst.law_deviation is not None else ""
    said.append(
        f"Least well known is {worst.name}, to {fit.words_at_least(worst.name)}{total:.2g} % ({noise:.2g} % from "
        f"noise, {scale:.2g} % from the rig's constants{by_law}; one standard deviation)."
    )
    said.append(fit.words_of_law)
    said += [f"Disturbance {cause.sentence}" for cause in fit.causes]
    said += [f"Breakaway: {fit.breakaway.words}."] if fit.breakaway else []
    for family in findings.families:
        passed = sum(member.passed for member in family.members)
        discs = " and ".join(family.members[0].drive_speeds)
        said.append(
            f"With {discs} in contact the model agrees with the measured motion at {passed} of {len(family.members)} "
            "drive speeds (levels below)."
        )
        said += bifurcation_sentences(family)[: len(family.bifurcations)]
    if fit.whiteness is not None:
        wrong = [*fit.whiteness.beyond, *fit.whiteness.repeated]
        said.append(
            "The residuals show that the model misses something (below)."
            if wrong
            else "The residuals show no trend over the slip speed and no course that repeats from slip to slip."
        )
    count = len(fit.warnings)
    said.append(
        {0: "There are no warnings.", 1: "There is one warning (below)."}.get(count, f"{count} warnings (below).")
    )
    return said


def _friction_drawing(findings: Findings) -> Drawing | None:
    if findings.samples is None:
        return None
    from identification.report.friction_figure import friction_figure

    caption = (
        "Friction coefficient against slip speed: local values from the measured motion (marks by log), the fitted law "
        "(line); below, what is left, with the means that the estimator used."
    )
    return drawing(friction_figure(findings.fit, findings.samples), "friction", caption)


def _residual_drawing(findings: Findings) -> Drawing | None:
    if findings.fit.whiteness is None:
        return None
    from identification.report.residual_figure import residual_figure

    caption = "Residuals of the estimator: mean over the slip speed"
    caption += ", and correlation from value to value by log." if findings.evaluation is not None else "."
    return drawing(residual_figure(findings.fit, findings.evaluation), "residuals", caption)


def _family_drawings(families: Sequence[FamilyComparison]) -> list[Drawing]:
    from identification.report.family_figure import family_figure

    caption = (
        "Measured (broad, grey) and modelled (dashed, rings) phase portraits by drive speed, below each when each disc "
        "sticks; at the bottom the share of stick over the drive speed with the bifurcations."
    )
    return [drawing(family_figure(family), f"family{i}", caption) for i, family in enumerate(families)]


def drawing(figure: Figure, prefix: str, caption: str) -> Drawing:
    """A figure for a page. prefix: of its ids there."""
    return Drawing(inline_svg(figure, prefix, caption), caption)


def _tables(findings: Findings) -> list[Table]:
    fit = findings.fit
    found = [tables.correlation_table(fit), tables.constants_table(fit)]
    found += [tables.plain_table(fit)] if fit.causes else []
    found += [tables.rivals_table(fit)] if len(fit.rivals) > 1 else []
    found += [tables.nuisance_table(fit.nuisance)] if fit.nuisance else []
    white = tables.whiteness_table(fit)
    found += [white] if white is not None else []
    found += [tables.decay_table(findings.decay)] if findings.decay is not None else []
    found += [tables.sensors_table(fit)] if "laser_gain_correction" in fit.sensors else []
    found += [tables.velocity_table(fit)] if "velocity_gain" in fit.sensors else []
    return [*found, tables.logs_table(fit, findings.logs)]
