"""How fits and comparisons are drawn in given axes, and what they say in words (`fmu_models.base.shown`)."""

from __future__ import annotations

from html import escape
from io import StringIO
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import draw, move, tell
from identification.calibration.result import Calibration
from identification.calibration.track import Course
from identification.fit.result import FrictionFit
from identification.hysteresis.result import HysteresisFit
from identification.inference.comparison import LawComparison
from identification.machines.machine_fit import MachineFit
from identification.model_check.families import FamilyComparison, compare_families
from identification.model_check.portraits import PortraitComparison
from identification.model_check.table import comparison_report
from identification.report.calibration_summary import calibration_report, draw_calibration
from identification.report.course_summary import course_report, draw_course
from identification.report.family_figure import draw_diagram, draw_portrait
from identification.report.fit_summary import fit_summary
from identification.report.friction_figure import draw_fit
from identification.report.hysteresis_report import draw_hysteresis, hysteresis_report
from identification.report.live import live_frame
from identification.report.machine_figures import draw_effort
from identification.report.machine_tables import machine_report
from identification.report.series_report import draw_divergence, series_report
from identification.series.analyse import SeriesInvariants

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import RenderableType

WIDTH = 100  # characters of a line
DRAWN = {
    FrictionFit: draw_fit,
    FamilyComparison: draw_diagram,
    PortraitComparison: draw_portrait,
    MachineFit: draw_effort,
    Calibration: draw_calibration,
    Course: draw_course,
    HysteresisFit: draw_hysteresis,
    SeriesInvariants: draw_divergence,
}
REPORTS = {
    FrictionFit: fit_summary,
    MachineFit: machine_report,
    Calibration: calibration_report,
    Course: course_report,
    HysteresisFit: hysteresis_report,
    SeriesInvariants: series_report,
}

for kind, drawing in DRAWN.items():
    draw.register(kind, drawing)
for kind, report in REPORTS.items():
    tell.register(kind, lambda result, report=report: _text(report(result)))


@move.register(FrictionFit)
def _(fit: FrictionFit) -> str:
    """Beside the portraits of its logs, which a fit that was read from a file does not have."""
    if not fit.recorded:
        return ""
    try:
        return live_frame(fit, compare_families(fit, fit.recorded, uncertainty=False))._repr_html_()
    except StickslipError as error:
        return f"<p>Not live: {escape(str(error))}</p>"


@draw.register(LawComparison)
def _(laws: LawComparison, axes: Axes) -> None:
    """By how much each law is behind the first."""
    names = [score.law for score in laws.scores]
    axes.barh(names, [score.bic - laws.best.bic for score in laws.scores], color="0.6", edgecolor="black")
    axes.invert_yaxis()
    axes.set_xlabel("BIC behind that of the first law (above 10: very strong)")


@tell.register(FamilyComparison)
def _(family: FamilyComparison) -> str:
    return _text(comparison_report([family]))


@tell.register(LawComparison)
def _(laws: LawComparison) -> str:
    return f"{laws.frame.to_string()}\n\n{laws.verdict}"


@tell.register(PortraitComparison)
def _(portrait: PortraitComparison) -> str:
    sentence = f"{portrait.log}: measured {portrait.measured.words}; model {portrait.model.words}."
    return f"{sentence}\n\n{portrait.frame.to_string()}"


def _text(renderable: RenderableType) -> str:
    from fmu_models.base.printable_console import PrintableConsole

    out = StringIO()
    # text wherever it is asked for: a notebook's console would show it instead, and colours are codes
    console = PrintableConsole(file=out, width=WIDTH, highlight=False, force_terminal=False, force_jupyter=False)
    console.print(renderable)
    return out.getvalue().rstrip()
