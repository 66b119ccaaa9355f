"""Command that fits the parameters of a machine of one degree of freedom to effort and motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite
from identification.commands.fits import FigurePath, print_files
from identification.commands.logs import ReaderOption, Repairs, repairs
from identification.commands.recipes import Log, RecipeArgument, ResultPath, check_targets, finish


def inverse(
    recipe: RecipeArgument,
    log: Log,
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", metavar="LOG", help="Score this log too; repeat for several.")
    ] = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    result: ResultPath = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Fit inertia, friction and other terms to measured effort and motion, judge them, and compare friction laws.

    Example: stickslip inverse axis data/machines/axis.csv --figure axis.png
    """
    from identification.fit.inverse import inverse_dynamics
    from identification.measurement.recipe import read_recipe

    check_targets(result, figure, overwrite)
    with console.warnings_said(), console.progress("fitting") as advance:
        run = inverse_dynamics(read_recipe(recipe), log, held_out or (), reader=reader, repair=repairs(repair))
        advance(0.8)
        if figure:
            from fmu_models.report.figures import save_figure
            from identification.report.machine_figures import inverse_figure

            save_figure(inverse_figure(run), figure, overwrite=overwrite)
    content = finish(run.result.to_dict(), result, figure, overwrite)

    def show(out: Any) -> None:
        from identification.report.machine_tables import inverse_report

        out.print(inverse_report(run.result))
        print_files(content["files"], out)

    console.say(json, content, show)
