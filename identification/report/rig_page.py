"""The page of a rig's fit: verdicts, figures, tables, assumptions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fmu_models.base.table import PrintedTable
from identification.estimators.savitzky_golay import FrictionSamples
from identification.fit.result import FrictionFit
from identification.inference.problem import Evaluation
from identification.measurement.free_decay import FreeDecay
from identification.model_check.families import FamilyComparison
from identification.model_check.portraits import MEANING
from identification.model_check.table import bifurcation_sentences, metrics_table, sequence_table
from identification.next_step.design import Design
from identification.report import tables
from identification.report.citations import citations
from identification.report.page import Findings, PageSection, bullets, counted, drawing, nested, paragraph, warned
from rig_io.logs.log import RigLog

INTERVALS = (
    "95 %: what noise and rig constants leave open together{least}. Noise: what sensors and the scatter from slip to "
    "slip leave open ({covariance}). Rig constants: what J, k, c, N, R and r, known only so well, pass on. Efficiency: "
    "variance of the Cramér-Rao bound over the stated one."
)
LIVE = (
    "The fitted model runs here beside the measurement. Sliders move it within the 95 % intervals of the fit; other "
    "values can be entered."
)


@dataclass(frozen=True, eq=False)
class RigFindings(Findings):
    """What the report of a rig is made of. samples: friction against slip speed by disc (None: not to be had);
    evaluation: residuals of the fit run again (None: not run); design: of the next experiment; live: the frame of
    `report.live` (empty: none); notes: what could not be shown, and why."""

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
        return {
            "fit": self.fit.to_dict(),
            "families": [family.to_dict() for family in self.families],
            "free_decay": None if self.decay is None else self.decay.to_dict(),
            "design": None if self.design is None else self.design.to_dict(),
            "notes": list(self.notes),
        }

    def title(self) -> str:
        fit, where = self.fit, " and ".join(self.fit.contacts)
        return f"Friction of {where}" + (f" ({', '.join(fit.materials)})" if fit.materials else "")

    def about(self) -> str:
        return f"{self.fit.law} law, estimator {self.fit.estimator}"

    def citations(self) -> list[str]:
        return citations(self.fit)

    def summary(self) -> list[str]:
        """The fit, what is least known, how the model does beside its logs."""
        fit = self.fit
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
        for family in self.families:
            passed = sum(member.passed for member in family.members)
            discs = " and ".join(family.members[0].drive_speeds)
            said.append(
                f"With {discs} in contact the model agrees with the measured motion at {passed} of "
                f"{len(family.members)} drive speeds (levels below)."
            )
            said += bifurcation_sentences(family)[: len(family.bifurcations)]
        if fit.whiteness is not None:
            wrong = [*fit.whiteness.beyond, *fit.whiteness.repeated]
            said.append(
                "The residuals show that the model misses something (below)."
                if wrong
                else "The residuals show no trend over the slip speed and no course that repeats from slip to slip."
            )
        return [*said, counted("warning", fit.warnings)]

    def values(self) -> list[str]:
        """Parameters, what their intervals hold, warnings."""
        fit = self.fit
        least = "; at least, for nobody says how well a constant is known"
        meaning = INTERVALS.format(
            least="" if all(constant.stated for constant in fit.constants) else least, covariance=fit.covariance
        )
        table = tables.parameter_table(fit).html()
        return [table, paragraph(meaning, "about"), *warned("Warnings", fit.warnings)]

    def sections(self) -> list[PageSection]:
        fit = self.fit
        sections = _friction_sections(self)
        sections += [_family_section(place, family) for place, family in enumerate(self.families)]
        if self.live:
            sections.append(PageSection("live", "The model, moved", [paragraph(LIVE), self.live]))
        sections += _residual_sections(self)
        sections.append(PageSection("assumptions", "Assumptions", [bullets(fit.structure)]))
        if self.design is not None:
            parts = [paragraph(self.design.advice), tables.design_table(self.design).html()]
            sections.append(PageSection("next", "Next experiment", parts))
        if other := tables.other_fields(fit):
            parts = [f"<h3>{name.replace('_', ' ').capitalize()}</h3>\n{nested(item)}" for name, item in other.items()]
            sections.append(PageSection("more", "Identifiability and further results", parts, folded=True))
        notes = [paragraph(note) for note in self.notes]
        parts = [*(one.html() for one in _tables(self)), *notes]
        return [*sections, PageSection("tables", "Tables", parts, folded=True)]


def _friction_sections(findings: RigFindings) -> list[PageSection]:
    if findings.samples is None:
        return []
    from identification.report.friction_figure import fitted_law, friction_figure

    caption = (
        "Friction coefficient against slip speed: local values from the measured motion (marks by log), the fitted law "
        "(line), and the curve that is free of any law (hatched band); below, what is left, with the means that the "
        "estimator used."
    )
    fit = findings.fit
    parts = [drawing(friction_figure(fit, findings.samples), "friction", caption)]
    parts += [paragraph(fit.free.words(fitted_law(fit, fit.contacts[0])))] if fit.free else []
    return [PageSection("law", "Friction law", parts)]


def _residual_sections(findings: RigFindings) -> list[PageSection]:
    fit = findings.fit
    if fit.whiteness is None:
        return []
    from identification.report.residual_figure import residual_figure

    caption = "Residuals of the estimator: mean over the slip speed"
    caption += ", and correlation from value to value by log." if findings.evaluation is not None else "."
    power = (
        f"Root mean square of the residual: {tables.shown(fit.rms_residual)} {fit.residual_unit}, {fit.values} values; "
        f"correlation of neighbours {tables.shown(fit.autocorrelation)}."
    )
    figure = residual_figure(fit, findings.evaluation)
    parts = [drawing(figure, "residuals", caption), paragraph(power)]
    return [PageSection("residuals", "Residuals", parts, folded=True)]


def _family_section(place: int, family: FamilyComparison) -> PageSection:
    from identification.report.family_figure import family_figure

    caption = (
        "Measured (broad, grey) and modelled (dashed, rings) phase portraits by drive speed, below each when each disc "
        "sticks; at the bottom the share of stick over the drive speed with the bifurcations."
    )
    parts = [
        drawing(family_figure(family), f"family{place}", caption),
        bullets([*bifurcation_sentences(family), *family.notes]),
        metrics_table(family).html(),
        sequence_table(family).html(),
        paragraph(MEANING, "about"),
    ]
    return PageSection(f"family{place}", "Model against measurement", parts)


def _tables(findings: RigFindings) -> list[PrintedTable]:
    fit = findings.fit
    found = [tables.correlation_table(fit), tables.constants_table(fit)]
    found += [tables.plain_table(fit)] if fit.causes else []
    found += [tables.rivals_table(fit)] if len(fit.rivals) > 1 else []
    found += [tables.nuisance_table(fit.nuisance)] if fit.nuisance else []
    white = tables.whiteness_table(fit)
    found += [white] if white is not None else []
    found += [tables.decay_table(findings.decay)] if findings.decay is not None else []
    return [*found, *tables.sensor_tables(fit), tables.logs_table(fit, findings.logs)]
