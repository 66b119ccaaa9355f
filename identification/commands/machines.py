"""Commands for logs of other machines: inverse dynamics of one degree of freedom, and statistics of slip events."""

from __future__ import annotations

import json as json_files
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite, Settings
from fmu_models.base.files import refuse_existing, write_whole

app = console.app("Machines of one degree of freedom: parameters from effort and motion, statistics of slips.")

RecipeArgument = Annotated[
    str,
    typer.Argument(metavar="RECIPE", help="A TOML file, or a name of 'stickslip data'.", show_default=False),
]
Log = Annotated[Path, typer.Argument(metavar="LOG", help="A log of any kind that is read: .csv, .txt, .mat.")]
FigurePath = Annotated[Path | None, typer.Option("--figure", help="Draw the figure (png, svg, pdf).")]
ResultPath = Annotated[Path | None, typer.Option("--result", "-o", help="Write the result as JSON.")]


@app.command()
def inverse(
    recipe: RecipeArgument,
    log: Log,
    held_out: Annotated[
        list[Path] | None, typer.Option("--held-out", metavar="LOG", help="Score this log too; repeat for several.")
    ] = None,
    result: ResultPath = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Fit inertia, friction and other terms to measured effort and motion, judge them, and compare friction laws.

    Example: stickslip inverse emps DATA_EMPS.mat --figure emps.png
    """
    from identification.one_dof.inverse import inverse_dynamics
    from identification.one_dof.recipe import read_recipe

    _check(result, figure, overwrite)
    with console.progress("fitting") as advance:
        run = inverse_dynamics(read_recipe(recipe), log, held_out or ())
        advance(0.8)
        if figure:
            from fmu_models.report.figures import save_figure
            from identification.one_dof.figures import inverse_figure

            save_figure(inverse_figure(run), figure, overwrite=overwrite)
    content = _finish(run.result.to_dict(), result, figure, overwrite)

    def show(out: Any) -> None:
        from identification.one_dof.tables import inverse_report

        out.print(inverse_report(run.result))
        _files(content, out)

    console.say(json, content, show)


@app.command()
def slips(
    recipe: RecipeArgument,
    log: Log,
    settings: Settings = None,
    seed: Annotated[int, typer.Option(help="Of the bootstrap.", min=0)] = 0,
    result: ResultPath = None,
    figure: FigurePath = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Find the slip events in a log of friction, and compare their statistics with a block on a belt.

    --set gives mass (kg), stiffness (N/m), speed (m/s), damping (N s/m), smoothing (s), share in place of the recipe's.

    Example: stickslip slips lyon_stick_slip k168Nm_v42.mat --set stiffness=168 --set speed=42e-6
    """
    from identification.one_dof.recipe import read_recipe
    from identification.one_dof.slip_model import fit_slip_model
    from identification.one_dof.slip_statistics import slip_statistics

    _check(result, figure, overwrite)
    with console.progress("looking for slips") as advance:
        given = console.assignments(settings, "constant")
        statistics, events = slip_statistics(read_recipe(recipe), log, given, seed=seed)
        advance(0.4)
        model = fit_slip_model(statistics)
        advance(0.8)
        if figure:
            from fmu_models.report.figures import save_figure
            from identification.one_dof.figures import slip_figure

            save_figure(slip_figure(statistics, events, model), figure, overwrite=overwrite)
    found = {**statistics.to_dict(), "model": model.to_dict() if model else None, "table": events.to_dict()}
    content = _finish(found, result, figure, overwrite)

    def show(out: Any) -> None:
        from identification.one_dof.tables import slip_report

        out.print(slip_report(statistics, model))
        _files(content, out)

    console.say(json, content, show)


def _check(result: Path | None, figure: Path | None, overwrite: bool) -> None:
    """Refuse targets before the work rather than after it."""
    refuse_existing(result, figure, overwrite=overwrite)
    if figure:
        from fmu_models.report.figures import check_format

        check_format(figure)


def _finish(found: dict[str, Any], result: Path | None, figure: Path | None, overwrite: bool) -> dict[str, Any]:
    """The content for JSON, written to ``result`` if asked for."""
    content = _finite(found)
    if result:
        with write_whole(result, overwrite=overwrite) as temporary:
            text = json_files.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
            temporary.write_text(text + "\n", encoding="utf-8")
    return {**content, "files": [str(path) for path in (result, figure) if path]}


def _finite(value: Any) -> Any:
    """JSON knows no NaN: None stands for a value that there is not."""
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _files(content: dict[str, Any], out: Any) -> None:
    for path in content["files"]:
        out.print(f"written: {path}")
