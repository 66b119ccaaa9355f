"""Command that reports on a fit in one page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import refuse_existing
from identification.commands.fits import FitFile, print_files, read_fit
from identification.commands.logs import Logs, ReaderOption, Repairs, read_logs

if TYPE_CHECKING:
    from rich.console import Console

    from identification.fit.result import FrictionFit
    from identification.report.page import Findings
    from rig_io.logs.log import RigLog


def report(
    fitted: FitFile,
    logs: Logs,
    output: Annotated[Path, typer.Option("--output", "-o", help="Page to write (.html).")] = Path("report.html"),
    settings: Settings = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    residuals: Annotated[
        bool, typer.Option(help="Run the fit once more, for the correlation of its residuals and as a check.")
    ] = True,
    uncertainty: Annotated[
        bool, typer.Option(help="Carry the uncertainty of the fit on to the predicted bifurcation speeds.")
    ] = True,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Write one HTML page that holds all of a fit: verdicts, figures, tables, assumptions, and its data as JSON.

    It needs nothing but itself: no network, no scripts. Logs that were not fitted are compared as well.

    Example: stickslip report fit.json data/rigs/paper_rubber -o report.html
    """
    if output.suffix.lower() not in (".html", ".htm"):
        raise StickslipError(f"'{output}' is to be a page: end it in .html.")
    refuse_existing(output, overwrite=overwrite)
    found = read_fit(fitted)
    with console.progress("reporting") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"), repair, reader)
        findings = _findings(found, read, residuals, uncertainty, advance)
        from identification.report.page import summary, write_report

        write_report(findings, output, overwrite=overwrite)
    content = {"file": str(output), "bytes": output.stat().st_size, "summary": summary(findings), **findings.to_dict()}

    def show(out: Console) -> None:
        for sentence in content["summary"]:
            out.print(sentence)
        print_files([str(output)], out)

    console.say(json, content, show)


def _findings(
    found: FrictionFit, read: list[RigLog], residuals: bool, uncertainty: bool, advance: Callable[[float], None]
) -> Findings:
    """Everything that is in the report; what cannot be had is left out with a note."""
    from identification.fit.samples import samples_by_disc
    from identification.measurement.free_decay import fit_free_decay
    from identification.measurement.pooling import pool
    from identification.model_check.families import compare as compare_families
    from identification.next_step.design import design
    from identification.report.page import Findings
    from identification.report.residuals import refitted

    families = compare_families(found, read, uncertainty=uncertainty, progress=lambda share: advance(0.5 * share))
    decays = [log for log in read if log.kind == "free-decay"]
    names = {one.name for one in found.logs}
    fitted = [log for log in read if log.name in names]
    missing = sorted(names - {log.name for log in fitted})
    notes, samples, evaluation = [], None, None
    if missing:
        notes.append(f"Not among the logs given, though fitted: {', '.join(missing)}. Figures of the fit lack them.")
    try:
        ready = pool([*fitted, *decays[:1]], allow_no_stick=True)
        samples = samples_by_disc(found, ready) if not missing else None
        if residuals and not missing:
            evaluation, said = refitted(found, ready)
            notes += said
    except StickslipError as error:
        notes.append(f"Residuals could not be found again: {error}")
    advance(0.9)
    decay = fit_free_decay(decays[0]) if decays else None
    try:
        following = design(found)
    except StickslipError as error:
        following = None
        notes.append(f"No next experiment is proposed: {error}")
    return Findings(found, read, families, decay, samples, evaluation, following, notes)
