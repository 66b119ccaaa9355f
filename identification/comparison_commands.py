"""Command that compares the fitted model with measurements."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_models import console
from fmu_models.console import Json, Overwrite, Settings
from fmu_models.files import refuse_existing
from identification.commands import FigurePath, Logs, draw_families, print_comparison, read_fit, read_logs

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
    from identification.family import compare as compare_families

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
        read = read_logs(logs, console.assignments(settings, "rig constant"))
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
