"""The page of a rig's fit: verdicts, figures, tables, assumptions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from fmu_models.report.document import bullets, drawing, glance, paragraph, section
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
from identification.report.family_figure import draw_family
from identification.report.fit_summary import certainty, fit_tables
from identification.report.friction_figure import draw_fit, fitted_law, friction_figure
from identification.report.page import Findings, counted, warned
from rig_io.logs.log import RigLog

PARTS = (
    "Noise: what sensors and the scatter from slip to slip leave open ({covariance}). Rig constants: what J, k, c, N, "
    "R and r, known only so well, pass on.{law}{bound}"
)
LAW = " Law: by how much the values move from one law to another that the logs cannot tell apart."
BOUND = " Efficiency: variance of the Cramér-Rao bound over the stated one."
FAMILY = (
    "Measured (broad, grey) and modelled (dashed, rings) phase portraits by drive speed, below each when each disc "
    "sticks; at the bottom the share of stick over the drive speed with the bifurcations."
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

    RECORD = ("fit=fit.to_dict", "families", "free_decay", "design", "notes")

    fit: FrictionFit
    logs: Sequence[RigLog]
    families: Sequence[FamilyComparison]
    decay: FreeDecay | None = None
    samples: Mapping[str, FrictionSamples] | None = None
    evaluation: Evaluation | None = None
    design: Design | None = None
    live: str = ""
    notes: Sequence[str] = ()

    @property
    def free_decay(self) -> dict[str, Any] | None:
        """The free decay as plain values, each with its unit."""
        return None if self.decay is None else self.decay.to_dict()

    def title(self) -> str:
        fit, where = self.fit, " and ".join(self.fit.contacts)
        return f"Friction of {where}" + (f" ({', '.join(fit.materials)})" if fit.materials else "")

    def about(self) -> str:
        return f"{self.fit.law} law, estimator {self.fit.estimator}"

    def citations(self) -> list[str]:
        return citations(self.fit)

    def summary(self) -> list[str]:
        """How the model does beside its logs, what is least known, what disturbs."""
        fit = self.fit
        agreed = [
            f"at {sum(member.passed for member in family.members)} of {len(family.members)} drive speeds with "
            f"{' and '.join(family.members[0].drive_speeds)} in contact"
            for family in self.families
        ]
        judged = f"The model agrees with the measured motion {', '.join(agreed)}. " if agreed else ""
        ended = "" if fit.converged else f"The fit did not converge ({fit.message}). "
        sentences = [f"{ended}{judged}{counted('warning', fit.warnings)}"]
        sentences.append(
            f"The {fit.law} law was fitted to {fit.segments} slips in {len(fit.logs)} logs by the estimator "
            f"'{fit.estimator}'."
        )
        worst = max(fit.parameters, key=lambda q: q.total_deviation / max(abs(q.value), 1e-300))
        parts = (worst.total_deviation, worst.standard_deviation, worst.scale_deviation, worst.law_deviation or 0.0)
        total, noise, scale, law = (100 * part / max(abs(worst.value), 1e-300) for part in parts)
        by_law = f", {_digits(law)} % from the choice of the law" if worst.law_deviation is not None else ""
        sentences.append(
            f"Least well known is {worst.name}, to {fit.words_at_least(worst.name)}{_digits(total)} % "
            f"({_digits(noise)} % from noise, {_digits(scale)} % from the rig's constants{by_law}; "
            "one standard deviation)."
        )
        sentences.append(fit.words_of_law)
        sentences += [f"Disturbance {cause.sentence}" for cause in fit.causes]
        for family in self.families:
            sentences += bifurcation_sentences(family)[: len(family.bifurcations)]
        if fit.whiteness is not None:
            wrong = [*fit.whiteness.beyond, *fit.whiteness.repeated]
            sentences.append(
                "The residuals show that the model misses something (below)."
                if wrong
                else "The residuals show no trend over the slip speed and no course that repeats from slip to slip."
            )
        return sentences

    def values(self) -> list[str]:
        """Warnings; parameters; portraits and the law at a glance."""
        fit = self.fit
        table = tables.parameter_table(fit).taking("value", "95 %", "unit", "meaning").html()
        parts = "noise, rig constants and the choice of the law" if fit.rivals else "noise and rig constants"
        least = "" if all(one.stated for one in fit.constants) else "; at least, for a constant lacks its uncertainty"
        portraits = [
            (partial(draw_family, family), "Phase portraits by drive speed: measured broad and grey, the model dashed.")
            for family in self.families
        ]
        band = ", beside the 95 % band of the curve that is free of any law" if fit.free else ""
        means = "; marks: means that the estimator used, with 95 % intervals" if _has_means(fit) else ""
        law = (partial(draw_fit, fit), f"Friction law (line){band}{means}.")
        held = paragraph(f"95 %: what {parts} leave open together{least}.", "about")
        return [*warned("Warnings", fit.warnings), table, held, glance([*portraits, law])]

    def sections(self) -> list[str]:
        fit = self.fit
        live = [section("live", "The model, moved", [paragraph(LIVE), self.live], folded=False)] if self.live else []
        sections = [*live, *(_family_section(place, family) for place, family in enumerate(self.families))]
        sections += [*_friction_sections(self), *_residual_sections(self)]
        sections.append(section("assumptions", "Assumptions", [bullets(fit.structure)]))
        if self.design is not None:
            parts = [paragraph(self.design.advice), tables.design_table(self.design).html()]
            sections.append(section("next", "Next experiment", parts))
        declared = [f"The law is declared in {fit.declaration}."] if fit.declaration else []
        if certain := [*certainty(fit), *declared]:
            sections.append(section("more", "What can be told apart, and contact in stick", [bullets(certain)]))
        bounded = fit.parameters[0].bound is not None
        meaning = PARTS.format(covariance=fit.covariance, law=LAW if fit.rivals else "", bound=BOUND if bounded else "")
        first, *others = (one.html() for one in (*fit_tables(fit, self.decay), tables.logs_table(fit, self.logs)))
        notes = [paragraph(note) for note in self.notes]
        return [*sections, section("tables", "Tables", [first, paragraph(meaning, "about"), *others, *notes])]


def _digits(value: float) -> str:
    """Two of them, and no power of ten."""
    return f"{float(f'{value:.2g}'):g}"


def _has_means(fit: FrictionFit) -> bool:
    return any(one.standard_error is not None for one in fit.bins)


def _friction_sections(findings: RigFindings) -> list[str]:
    if findings.samples is None:
        return []
    fit = findings.fit
    free = ", and the curve that is free of any law (hatched band)" if fit.free else ""
    means = ", with the means that the estimator used" if _has_means(fit) else ""
    caption = (
        "Friction coefficient against slip speed: local values from the measured motion (marks by log), the fitted law "
        f"(line){free}; below, what is left{means}."
    )
    parts = [drawing(friction_figure(fit, findings.samples), "friction", caption)]
    parts += [paragraph(fit.free.words(fitted_law(fit, fit.contacts[0])))] if fit.free else []
    return [section("law", "Friction law", parts)]


def _residual_sections(findings: RigFindings) -> list[str]:
    fit = findings.fit
    if fit.whiteness is None:
        return []
    from identification.report.residual_figure import residual_figure

    caption = "Residuals of the estimator: mean over the slip speed"
    caption += ", and correlation from value to value by log." if findings.evaluation is not None else "."
    power = (
        f"Root mean square of the residual: {fit.rms_residual:.5g} {fit.residual_unit}, {fit.values} values; "
        f"correlation of neighbours {fit.autocorrelation:.5g}."
    )
    figure = residual_figure(fit, findings.evaluation)
    white = tables.whiteness_table(fit)
    parts = [drawing(figure, "residuals", caption), paragraph(power), *([white.html()] if white else [])]
    return [section("residuals", "Residuals", parts)]


def _family_section(place: int, family: FamilyComparison) -> str:
    from identification.report.family_figure import family_figure

    parts = [
        drawing(family_figure(family), f"family{place}", FAMILY),
        bullets([*bifurcation_sentences(family), *family.notes]),
        metrics_table(family).html(),
        sequence_table(family).html(),
        paragraph(MEANING, "about"),
    ]
    return section(f"family{place}", "Model against measurement", parts)
