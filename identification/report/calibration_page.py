"""The page of a calibration: values, logs beside the model, and the model with sliders within the intervals."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.explorer.module import check
from fmu_models.explorer.page import explored
from fmu_models.explorer.subject import ExplorerSubject
from fmu_models.fmu.fmu import Fmu
from fmu_models.report.document import bullets, drawing, glance, paragraph, section
from fmu_models.simulation.signal import Signal
from identification.calibration.follow import FollowedLog, follow
from identification.calibration.log import ModelLog
from identification.calibration.result import Calibration
from identification.report.calibration_figures import draw_portrait, draw_time, followed_figure
from identification.report.calibration_summary import (
    followed_sentences,
    meaning,
    residuals_table,
    values_table,
    verdicts,
)
from identification.report.citations import calibration_citations
from identification.report.hysteresis_report import loop_tables
from identification.report.page import Findings, counted, warned

BESIDE = (
    "Each measured variable over time and of the model (line), what is left, and the variable over its rate, both by "
    "local parabolas of the measured and of the modelled samples. Start states alone were found for each log."
)
LIVE = (
    "The calibrated model runs here from the start of the first log. Sliders of what was sought move within the 95 % "
    "intervals; other values can be entered."
)


@dataclass(frozen=True, eq=False)
class CalibrationFindings(Findings):
    """What the report of a calibration is made of. followed: logs beside it; live: the model in a frame (empty: none);
    notes: what could not be shown, and why; loops: what is said of loops beside the law, plain values."""

    RECORD = ("calibration=calibration.to_dict", "logs=followed", "loops", "notes")

    calibration: Calibration
    followed: Sequence[FollowedLog]
    live: str = ""
    notes: Sequence[str] = ()
    loops: Mapping[str, Any] = field(default_factory=dict)

    def title(self) -> str:
        return self.calibration.title

    def about(self) -> str:
        return f"{len(self.calibration.parameters)} values, calibrated by a {self.calibration.method}"

    def citations(self) -> list[str]:
        return calibration_citations()

    def summary(self) -> list[str]:
        """How logs are followed, what is least known."""
        found = self.calibration
        determined = [parameter for parameter in found.parameters if parameter.standard_deviation is not None]
        first, *others = followed_sentences(found, self.followed) or [""]
        sentences = [f"{first} {counted('verdict', verdicts(found))}".strip()]
        sentences.append(f"{len(found.parameters)} values of {found.model} were found in {', '.join(found.logs)}.")
        if determined:
            worst = max(determined, key=lambda one: (one.standard_deviation or 0.0) / max(abs(one.value), 1e-300))
            sd = worst.standard_deviation or 0.0
            unit = "" if worst.unit in ("", "1") else f" {worst.unit}"
            sentences.append(f"Least well known is {worst.name}: {worst.value:.4g} ± {sd:.2g}{unit}.")
        return [*sentences, *others]

    def values(self) -> list[str]:
        """Verdicts; parameters and start states; the first variable of the first log."""
        calibration = self.calibration
        shown = [*warned("Verdicts", verdicts(calibration)), values_table(calibration).html()]
        if not self.followed:
            return shown
        one = self.followed[0]
        name = next(iter(one.modelled))
        driven = isinstance(one.log.inputs.get(one.log.over), Signal)
        over = f"over {one.log.over}" if driven else "and its rate"
        panels = [
            (lambda axes: draw_time(axes, one, name), f"{name} of {one.log.name}: measured (dots), model (line)."),
            (
                lambda axes: draw_portrait(axes, one, name),
                f"{name} {over}: measured (grey, broad), model (blue, thin).",
            ),
        ]
        return [*shown, glance(panels)]

    def sections(self) -> list[str]:
        """Logs beside the model, the model with sliders, residuals of the calibration, the model."""
        calibration, sections = self.calibration, []
        if self.live:
            sections.append(section("live", "The model, moved", [paragraph(LIVE), self.live], folded=False))
        if self.followed:
            lines = residuals_table([line for log in self.followed for line in log.residuals])
            parts = [drawing(followed_figure(self.followed), "logs", BESIDE), lines.html()]
            sections.append(section("logs", "Logs beside the model", parts))
        if self.loops:
            notes = [*self.loops["notes"], f"As Python: {self.loops['laws'][0]['declaration']}"]
            parts = [*(part.html() for part in loop_tables(self.loops)), bullets(notes)]
            sections.append(section("loops", "Sliders, cycles and laws", parts))
        rest = [residuals_table(calibration.residuals).html(), paragraph(meaning(calibration), "about")]
        sections.append(section("residuals", "What the calibration left, and what the intervals rest on", rest))
        where = f"Declared in {calibration.declaration}." if calibration.declaration else "Declared in a program."
        held_values = ", ".join(f"{name} = {value:g}" for name, value in calibration.held.items())
        notes = [where, *([f"Held: {held_values}."] if held_values else []), *self.notes]
        return [*sections, section("model", "The model", [bullets(notes)])]


def calibration_findings(
    calibration: Calibration,
    fmu: Fmu,
    logs: Sequence[ModelLog],
    *,
    interactive: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> CalibrationFindings:
    """Everything that is in the report of a calibration; what cannot be had is left out with a note.

    logs: that took part, or others; interactive: the model with sliders. Errors as for `follow`.
    """
    followed = []
    for number, log in enumerate(logs):
        followed.append(follow(calibration, fmu, log))
        progress(0.8 * (number + 1) / len(logs))
    live, notes = _live(calibration, fmu, followed) if interactive else ("", [])
    return CalibrationFindings(calibration, followed, live, notes)


def _live(calibration: Calibration, fmu: Fmu, followed: Sequence[FollowedLog]) -> tuple[str, list[str]]:
    """The model in a frame, as it ran along the first log, and what the frame leaves out."""
    values = {**calibration.held, **calibration.values_in(calibration.logs[0])}
    until, notes = None, []
    if followed:
        first = followed[0]
        until = float(first.log.time[-1] - first.log.time[0])
        values |= {name.removesuffix("(0)"): value for name, value in first.starts.items()}
        for name, signal in first.log.inputs.items():
            moving = isinstance(signal, Signal)
            values[name] = float(signal.piece(np.array([first.log.time[0]]))[0][0]) if moving else float(signal)
            notes += [f"'{name}' varies over time in the log; the moved model holds its first value."] if moving else []
    ranges = {
        parameter.name: ends
        for parameter in calibration.parameters
        if parameter.name in fmu.parameters and np.isfinite(ends := calibration.interval(parameter.name)).all()
    }
    subject = ExplorerSubject(
        fmu=fmu,
        model=calibration.declaration,
        arguments="",
        values={name: value for name, value in values.items() if name in fmu.variables},
        until=until,
        contacts=None,
        laws={},
        ranges=ranges,
    )
    try:
        check(fmu)
        return explored(subject)._repr_html_(), notes
    except StickslipError as error:
        return "", [f"The model does not move here: {error}"]
