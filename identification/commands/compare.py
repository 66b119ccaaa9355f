"""Commands that compare the fitted model with measurements, and report on all of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite, Settings
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import refuse_existing
from identification.commands.fit import (
    FigurePath,
    Logs,
    Repairs,
    draw_families,
    print_comparison,
    print_files,
    read_logs,
)

if TYPE_CHECKING:
    from rich.console import Console


app = console.app("Friction: compare the fitted model with measurements.")

Fit = Annotated[Path, typer.Argument(metavar="FIT", help="Result of 'stickslip fit --result'.")]
SceneOption = Annotated[
    str | None, typer.Option(metavar="SCENE", help="Scene (.toml) whose FMU is run with the fitted values.")
]


@app.command()
def compare(
    fitted: Fit,
    logs: Logs,
    settings: Settings = None,
    repair: Repairs = None,
    scene: SceneOption = None,
    uncertainty: Annotated[
        bool, typer.Option(help="Carry the uncertainty of the fit on to the predicted bifurcation speeds.")
    ] = True,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Compare the fitted model with a family of logs: portraits, stick by disc, and where stick appears or disappears.

    Logs above the bifurcation, where the disc slides steadily, belong to the family.

    Example: stickslip compare fit.json data/rigs/paper_rubber --figure family.png
    """
    from identification.fit.result import read_fit
    from identification.model_check.families import compare_families

    refuse_existing(figure, overwrite=overwrite)
    if figure:
        from fmu_models.report.figures import check_format

        check_format(figure)
    found = read_fit(fitted)
    chosen = None
    if scene:
        from fmu_models.scene.read import read_scene

        chosen = read_scene(scene)
    with console.progress("comparing") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"), repair)
        families = compare_families(
            found, read, scene=chosen, uncertainty=uncertainty, progress=lambda share: advance(0.9 * share)
        )
        files = [str(path) for path in draw_families(families, figure, overwrite)] if figure else []
    content = {
        "passed": all(one.passed for one in families),
        "families": [one.to_dict() for one in families],
        "files": files,
    }
    console.say(json, content, lambda out: print_comparison(families, files, out))


@app.command()
def report(
    fitted: Fit,
    logs: Logs,
    output: Annotated[Path, typer.Option("--output", "-o", help="Page to write (.html).")] = Path("report.html"),
    settings: Settings = None,
    repair: Repairs = None,
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
    from identification.fit.result import read_fit
    from identification.report.findings import findings
    from identification.report.page import summary, write_report

    if output.suffix.lower() not in (".html", ".htm"):
        raise StickslipError(f"'{output}' is to be a page: end it in .html.")
    refuse_existing(output, overwrite=overwrite)
    found = read_fit(fitted)
    with console.progress("reporting") as advance:
        read = read_logs(logs, console.assignments(settings, "rig constant"), repair)
        made = findings(found, read, residuals=residuals, uncertainty=uncertainty, progress=advance)
        write_report(made, output, overwrite=overwrite)
    content = {"file": str(output), "bytes": output.stat().st_size, "summary": summary(made), **made.to_dict()}

    def show(out: Console) -> None:
        for sentence in content["summary"]:
            out.print(sentence)
        print_files([str(output)], out)

    console.say(json, content, show)
