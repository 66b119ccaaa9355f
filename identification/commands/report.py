"""Command that reports on a fit in one page."""

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.files import checked_page
from identification.commands.calibrations import report_calibration
from identification.commands.fits import ANY_MODEL, MACHINE, RIG, FitFile, fitted_kind, say_report
from identification.commands.logs import Logs, ReaderOption, Repairs, read_logs, stated
from identification.commands.machines import MachinePlace, refuse, report_machine


@console.trusting
def report(
    fitted: FitFile,
    logs: Logs,
    output: Annotated[Path, typer.Option("--output", "-o", help="Page to write (.html).")] = Path("report.html"),
    settings: console.Settings = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    residuals: Annotated[
        bool, typer.Option(help="Run the fit once more, for the correlation of its residuals and as a check.")
    ] = True,
    uncertainty: Annotated[
        bool, typer.Option(help="Carry the uncertainty of the fit on to the predicted bifurcation speeds.")
    ] = True,
    interactive: Annotated[
        bool, typer.Option(help="The model live: sliders for law, N and k over portraits, or for what was calibrated.")
    ] = False,
    machine: MachinePlace = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Write one HTML page that holds all of a fit: verdicts, figures, tables, assumptions, and its data as JSON.

    It needs nothing but itself: no network and, unless it is interactive, no scripts. Logs that were not fitted are
    compared as well.

    Example: stickslip report fit.json data/rigs/paper_rubber -o report.html

    Example: stickslip report fit.json data/rigs/paper_rubber --interactive -o live.html

    Example: stickslip report tanks.json train.csv test.csv -o tanks.html
    """
    from identification.fit.result import read_fit
    from identification.report.findings import findings

    checked_page(output, overwrite=overwrite)
    kind = fitted_kind(fitted)
    if kind == ANY_MODEL:
        refuse(ANY_MODEL, "a rig or a machine", {"set": settings, "repair": repair, "reader": reader})
        report_calibration(fitted, logs, output, machine, interactive, overwrite, json)
        return
    if kind == MACHINE:
        refuse(MACHINE, RIG, {"set": settings, "interactive": interactive})
        report_machine(fitted, logs, output, machine, (reader, repair), overwrite, json)
        return
    refuse(RIG, MACHINE, {"machine": machine})
    fit = read_fit(fitted)
    with console.progress("reporting") as advance:
        read = read_logs(logs, stated(settings), repair, reader)
        page_findings = findings(
            fit, read, residuals=residuals, uncertainty=uncertainty, interactive=interactive, progress=advance
        )
    say_report(page_findings, output, overwrite, json)
